"""A simulated 30-minute recording of a block in a 30-cm tank, with everything about it known.

It was integrated by the Open Dynamics Engine, independently of driftwalk, with a static flow of
swirl, centripetal drift and four wall jets; camera noise was added. See PROVENANCE.md in the folder
of the data. It is simulated, and every result made from it says so.
"""

from __future__ import annotations

import json
from importlib.resources import as_file, files
from typing import TYPE_CHECKING, Any, Final, Literal

if TYPE_CHECKING:
    from importlib.resources.abc import Traversable

    import xarray as xr

_FILES: Final[dict[str, str]] = {
    "first": "recording.csv",
    "second": "recording_second_seed.csv",
    "without_noise": "without_tracking_noise.csv",
}


def tank30_recording(
    realisation: Literal["first", "second", "without_noise"] = "first",
) -> xr.Dataset:
    """Load the bundled recording, simulated by another engine.

    Parameters
    ----------
    realisation : {"first", "second", "without_noise"}
        The recording; another one of the same parameters; the first without camera noise.

    Returns
    -------
    xarray.Dataset
        A `trajectory` of one body: 18,001 samples at 10 Hz, x, y [m], theta [rad];
        ``attrs["simulated"]`` is "yes".

    Examples
    --------
    >>> tank30_recording().sizes["time"]
    18001
    """
    from driftwalk.record import load

    with as_file(_folder() / _FILES[realisation]) as path:
        recording = load(path, tank=f"circle:{_diameter()!r}@0,0")
    truth = tank30_truth()
    return recording.assign_attrs(
        simulated="yes", block_side_m=truth["side_m"], block_mass_kg=truth["mass_kg"]
    )


def tank30_flow() -> xr.Dataset:
    """Return the true flow field of the bundled recording, a `flow_field` of 50 x 50 nodes.

    Examples
    --------
    >>> tank30_flow().sizes["x"]
    50
    """
    from driftwalk.flow import load_flow

    arena = {"shape": "circle", "diameter_m": _diameter(), "center_m": [0.0, 0.0]}
    with as_file(_folder() / "flow_true.csv") as path:
        return load_flow(path, arena=arena)


def tank30_truth() -> dict[str, Any]:
    """Return every parameter of the bundled recording, units in the keys.

    Examples
    --------
    >>> tank30_truth()["drag_coefficient"]
    0.3867
    """
    values: dict[str, Any] = json.loads((_folder() / "truth.json").read_text(encoding="utf-8"))
    return values


def _diameter() -> float:
    return 2.0 * float(tank30_truth()["tank_radius_m"])


def _folder() -> Traversable:
    return files("driftwalk.datasets") / "tank30_ode_a"
