"""Draw how each member of the family moves: one minute in a 30-cm tank.

    python studies/motion_models/picture.py docs/images/motion-models/family.png

The paths are synthetic, simulated with the values below; every panel has its own random numbers.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final

import matplotlib as mpl
import numpy as np
from matplotlib.collections import LineCollection

import driftwalk as dw
from driftwalk.conditions import Conditions, Neighbours
from driftwalk.core.random_streams import world_keys
from driftwalk.model import Tank
from driftwalk.plot.parts.labels import model_words
from driftwalk.plot.parts.style import INK, add_colorbar, new_panels, print_style
from driftwalk.schema import Track
from driftwalk.simulation.backend import Camera
from driftwalk.simulation.initial import Start

if TYPE_CHECKING:
    from matplotlib.axes import Axes

RADIUS_M: Final = 0.15
SECONDS: Final = 60.0
RATE_HZ: Final = 20.0
FASTEST_CM_S: Final = 6.0
NAMES: Final = (
    "inertial", "active", "run_tumble", "run_rest", "burst_coast", "two_state",
    "active+wall", "active+wall+follow", "active+follow+keep", "run_rest+reverse",
    "run_tumble+slow", "active+stroke", "run_rest+wall", "active+wall+neighbours",
)  # fmt: skip
VALUES: Final = {
    "speed_std": 0.02, "memory_time": 1.5, "speed": 0.03, "rotational_diffusion": 0.15,
    "turn_rate": 0.0, "speed_cv": 0.4, "run_time": 2.5, "run_time_cv": 0.7, "rest_time": 1.5,
    "rest_time_cv": 0.7, "turn_std": 1.2, "kick_speed": 0.06, "kick_speed_cv": 0.3,
    "kick_time": 1.2, "kick_time_cv": 0.4, "glide_time": 0.6, "slow_speed": 0.008,
    "fast_speed": 0.05, "slow_time": 4.0, "fast_time": 2.0, "slow_rotational_diffusion": 2.0,
    "fast_rotational_diffusion": 0.05, "relaxation_time": 0.3, "wall_turn": 2.0,
    "wall_slowing": 0.5, "wall_range": 0.02, "wall_follow": 3.0, "slow_std": 0.6,
    "slow_time_": 10.0, "stroke": 3.0, "stroke_frequency": 0.5, "wall_gap": 0.03,
    "reversal_share": 0.8, "neighbour_push": 2.0, "neighbour_range": 0.03,
}  # fmt: skip
"""Of every parameter, SI; `slow_time_` is that of the part `slow`."""


OTHERS_M: Final = ((-0.07, 0.0), (0.05, -0.06), (0.05, 0.07))
"""Places of the bodies that push one off; they stand still."""


def standing_others() -> Neighbours:
    """Return the bodies that push one off."""
    time = np.array([0.0, SECONDS])
    return Neighbours(
        tuple(Track(time, 0 * time + x, 0 * time + y, np.nan * time) for x, y in OTHERS_M)
    )


def path_of(name: str, number: int) -> tuple[np.ndarray, np.ndarray]:
    """Return x and y [m] of one path."""
    like = Conditions(
        sample_time=np.arange(0.0, SECONDS, 1.0 / RATE_HZ),
        start=Start(-0.03, 0.02, 0.5),
        camera=Camera(),
        tank=Tank(diameter_m=2.0 * RADIUS_M),
        view=None,
        flow=None,
        threads=1,
        neighbours=standing_others(),
    )
    model = dw.motion_model(name)
    slow = "slow" in name.split("+")
    values = {
        one.name: np.array([VALUES["slow_time_" if slow and one.name == "slow_time" else one.name]])
        for one in model.parameters
    }
    worlds = model.simulate(values, like, world_keys(3, trial=number, replicate=np.arange(1)))
    return worlds.x[0], worlds.y[0]


def draw(axes: Axes, name: str, number: int) -> LineCollection:
    """Draw one path, coloured by its speed."""
    x, y = (100.0 * values for values in path_of(name, number))
    points = np.column_stack([x, y])
    lines = LineCollection(
        np.stack([points[:-1], points[1:]], axis=1),
        cmap="viridis_r",
        norm=mpl.colors.Normalize(0.0, FASTEST_CM_S),
        linewidths=0.9,
    )
    lines.set_array(np.hypot(np.diff(x), np.diff(y)) * RATE_HZ)
    axes.add_collection(lines)
    axes.add_patch(mpl.patches.Circle((0, 0), 100 * RADIUS_M, fill=False, color=INK, lw=0.8))
    if "neighbours" in name:
        for place in OTHERS_M:
            axes.add_patch(mpl.patches.Circle(100 * np.array(place), 0.8, color="0.6"))
    axes.plot(x[0], y[0], "o", color="black", markersize=2.5)
    axes.set(
        xlim=(-16, 16), ylim=(-16, 16), aspect="equal", xticks=(-10, 0, 10), yticks=(-10, 0, 10)
    )
    axes.set_title(model_words(name))
    return lines


def main(out: Path) -> None:
    """Draw all, and write the picture."""
    out.parent.mkdir(parents=True, exist_ok=True)
    with print_style():
        figure, panels = new_panels(
            3, 5, height_mm=116.0, layout="compressed", sharex=True, sharey=True
        )
        for number, axes in enumerate(panels):
            axes.set(xlabel="x (cm)", ylabel="y (cm)")
            axes.label_outer()
            if len(NAMES) - 5 <= number < 10:
                # The lowest of its column.
                axes.set_xlabel("x (cm)")
                axes.tick_params(labelbottom=True)
        for axes in panels[len(NAMES) :]:
            axes.remove()
        for number, (axes, name) in enumerate(zip(panels, NAMES, strict=False)):
            lines = draw(axes, name, number)
        add_colorbar(lines, panels[: len(NAMES)], "speed (cm/s)", extend="max")
        figure.savefig(out, dpi=160)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
