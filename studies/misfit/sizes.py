"""Misfits of several sizes, by kind and size, to see how small one may be and still be found."""

from __future__ import annotations

from typing import Final

from cases import FLOATING, Case, dropped, jittered, marker_off, outliers, turned

SIZES: Final[dict[str, Case]] = {
    "floating body: added mass 0": Case(FLOATING, carried=True),
    "floating body: added mass 0.5 m": Case({"added_mass": 0.5, **FLOATING}, carried=True),
    "power of the drag: 1.9": Case({"drag_power": 1.9}),
    "power of the drag: 1.8": Case({"drag_power": 1.8}),
    "power of the drag: 1.6": Case({"drag_power": 1.6}),
    "linear drag: 1 g/s": Case({"linear_drag": 1e-3}),
    "linear drag: 3 g/s": Case({"linear_drag": 3e-3}),
    "memory of the force: 0.05 s": Case({"force_memory": 0.05}),
    "memory of the force: 0.1 s": Case({"force_memory": 0.1}),
    "memory of the force: 0.2 s": Case({"force_memory": 0.2}),
    "flow grows: 2 %": Case(growth=0.02),
    "flow grows: 5 %": Case(growth=0.05),
    "flow grows: 10 %": Case(growth=0.10),
    "pulses of 10 s: 2 %": Case({"pulse": 0.02}),
    "pulses of 10 s: 5 %": Case({"pulse": 0.05}),
    "pulses of 10 s: 10 %": Case({"pulse": 0.10}),
    "positions off by 5 mm: 0.2 %": Case(mistake=outliers(0.002, 5e-3)),
    "positions off by 5 mm: 1 %": Case(mistake=outliers(0.01, 5e-3)),
    "frames dropped: 0.5 %": Case(mistake=dropped(0.005, stamped=False)),
    "frames dropped: 2 %": Case(mistake=dropped(0.02, stamped=False)),
    "jitter of the stamps: 3 ms": Case(mistake=jittered(3e-3)),
    "jitter of the stamps: 6 ms": Case(mistake=jittered(6e-3)),
    "orientation off: 0.5°": Case(mistake=turned(0.5)),
    "orientation off: 1°": Case(mistake=turned(1.0)),
    "orientation off: 2°": Case(mistake=turned(2.0)),
    "marker off: 0.5 mm": Case(mistake=marker_off(0.5e-3)),
    "marker off: 1 mm": Case(mistake=marker_off(1e-3)),
    "marker off: 2 mm": Case(mistake=marker_off(2e-3)),
}
