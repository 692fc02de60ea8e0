"""The `assembly` dataset: what the runs of the native core gave, with names and units.

Dimensions ``run``, ``event`` (one less than there are blocks, at least one), ``side`` (of the
assembly that stayed, of the one that was moved), ``part`` (stayed, moved, became), ``block``,
``axis``; coordinates ``class`` (outcome classes) and ``shape`` (polyominoes). Indices of what
is not there are -1, its times NaN.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.lattice.events import ReplayedEvents, replay_events
from driftwalk.simulation.backend import BROKEN, STATUS

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.assembly.runs.plan import Plan

Arrays = dict[str, npt.NDArray[Any]]
Floats = npt.NDArray[np.float64]

SCHEMA_VERSION: Final = 1
DECIMALS: Final = 9
"""Times are kept to a nanosecond."""


def build_assembly(plan: Plan, arrays: Arrays, *, attrs: dict[str, Any]) -> xr.Dataset:
    """Return the `assembly` dataset of some runs.

    Parameters
    ----------
    plan : Plan
        The simulated plan.
    arrays : dict of ndarray
        Result of `driftwalk._core.assemble`, by its names, one entry per run of the plan.
    attrs : dict
        Further attributes.
    """
    import xarray as xr

    study = plan.study
    replayed = replay_events(
        *(arrays[f"event_{name}"] for name in ("count", "block", "face")),
        **{name: arrays[name] for name in ("cell", "quarter", "assembly")},
        chirality=study.assembly.chirality,
    )
    broken = (arrays["status"].astype(np.int64) & BROKEN) != 0
    outcome = np.where(broken, np.int32(-1), replayed.outcome)
    step = study.time_step_s
    data: dict[str, Any] = {
        **_events(arrays, replayed, step),
        **_times(arrays, step),
        **_poses(arrays),
        **_parameters(plan),
        "outcome": ("run", outcome, _index("class", "outcome class at the end, -1 for none")),
        "status": ("run", arrays["status"].astype(np.int32), _status_flags()),
    }
    return xr.Dataset(
        data,
        coords={
            "run": ("run", np.arange(outcome.size), {"long_name": "run"}),
            "block": ("block", np.arange(study.assembly.blocks), {"long_name": "block"}),
            "class": _names("class", replayed.classes, "outcome class"),
            "shape": _names("shape", replayed.shapes, "shape of an assembly"),
        },
        attrs={
            "kind": "assembly",
            "schema_version": SCHEMA_VERSION,
            **assembly_attrs(plan),
            **attrs,
        },
    )


def build_path(plan: Plan, samples: Arrays, *, every: int) -> xr.Dataset:
    """Return the `assembly_path` dataset of some runs.

    Parameters
    ----------
    plan : Plan
        The simulated plan.
    samples : dict of ndarray
        ``sample_pose`` (run, time, block, 3) and ``sample_assembly`` (run, time, block).
    every : int
        Time steps between samples.
    """
    import xarray as xr

    dims = ("run", "time", "block")
    pose, step = samples["sample_pose"], plan.study.time_step_s
    time = times_of(np.arange(pose.shape[1]) * every, time_step=step)
    data: dict[str, Any] = {
        name: (dims, np.ascontiguousarray(pose[..., part]), _units(unit, long_name))
        for part, (name, unit, long_name) in enumerate(_POSE)
    }
    data["assembly"] = (dims, samples["sample_assembly"].astype(np.int32), _LOWEST)
    return xr.Dataset(
        data,
        coords={
            "run": ("run", plan.index, {"long_name": "run"}),
            "time": ("time", time, _units("s", "time from the start of the run")),
            "block": ("block", np.arange(pose.shape[2]), {"long_name": "block"}),
        },
        attrs={
            "kind": "assembly_path",
            "schema_version": SCHEMA_VERSION,
            **assembly_attrs(plan),
            "runs": plan.index.size,
            "sample_interval_s": float(np.round(every * step, DECIMALS)),
        },
    )


def assembly_attrs(plan: Plan) -> dict[str, Any]:
    """Return the attributes that say what was simulated."""
    study = plan.study
    settings, forces = study.assembly, study.forces
    connector = {
        "connector_distance_m": settings.connector_distance_m,
        "connector_axis_rad": settings.connector_axis_rad,
        "connector_rotation_rad": settings.connector_rotation_rad,
    }
    return {
        "blocks": settings.blocks,
        "runs": settings.runs,
        "duration_s": float(np.round(plan.steps * study.time_step_s, DECIMALS)),
        "seed": settings.seed,
        "chirality": settings.chirality,
        "latching": settings.latching,
        **(connector if settings.latching == "connector" else {}),
        "hidden_face_drag": settings.hidden_face_drag,
        "block_restitution": settings.block_restitution,
        "block_friction": settings.block_friction,
        "block_side_m": study.block.side_m,
        "arena": study.tank.to_arena_json(),
        "force_interval_s": forces.force_interval_s,
        "time_step_s": study.time_step_s,
        "trial": plan.trial,
        "backend": plan.backend,
        "study": study.to_toml(),
    }


def completion_step(arrays: Arrays) -> npt.NDArray[Any]:
    """Return the step at which all blocks had become one assembly, -1 in runs where they did not.

    Parameters
    ----------
    arrays : dict of ndarray
        As in `build_assembly`.
    """
    count = arrays["event_count"]
    complete = count == arrays["assembly"].shape[1] - 1
    # The last joining made one assembly of all; a single block is complete from the start.
    last = np.maximum(count.astype(np.int64) - 1, 0)[:, None]
    joined = np.take_along_axis(arrays["event_step"], last, axis=1)[:, 0]
    return np.where(complete, np.where(count > 0, joined, 0), -1)


def times_of(step: npt.NDArray[Any], *, time_step: float) -> Floats:
    """Return the times [s] of the ends of steps, NaN where there is none (-1).

    Rounded to a nanosecond, so that step 30 of 0.01 s is at 0.3 s.
    """
    return np.where(step < 0, np.nan, np.round(step * time_step, DECIMALS))


_POSE: Final = (
    ("x", "m", "position x of the block's centre"),
    ("y", "m", "position y of the block's centre"),
    ("theta", "rad", "orientation of the block, counter-clockwise from x"),
)
_LOWEST: Final = {"long_name": "assembly of the block, as its lowest block"}


def _events(arrays: Arrays, replayed: ReplayedEvents, step: float) -> dict[str, Any]:
    sides = ("run", "event", "side")
    order = "first of the assembly that stayed, then of the one that was moved"
    shape = _index("shape", "shapes of the assembly that stayed, of the one moved, of both joined")
    return {
        "event_count": (
            "run",
            arrays["event_count"].astype(np.int32),
            _units("1", "number of joinings"),
        ),
        "event_time": (
            ("run", "event"),
            times_of(arrays["event_step"], time_step=step),
            _units("s", "time of the joining"),
        ),
        "event_block": (
            sides,
            arrays["event_block"].astype(np.int32),
            {"long_name": f"blocks whose faces joined, {order}"},
        ),
        "event_face": (
            sides,
            arrays["event_face"].astype(np.int32),
            {"long_name": "faces that joined, in the blocks' own frames: 0 +x, 1 +y, 2 -x, 3 -y"},
        ),
        "event_assembly": (
            sides,
            replayed.event_assembly,
            {"long_name": f"lowest block of the assemblies that joined, {order}"},
        ),
        "event_shape": (("run", "event", "part"), replayed.event_shape, shape),
        "event_class": (
            ("run", "event"),
            replayed.event_class,
            _index("class", "outcome class of the whole world after the joining"),
        ),
    }


def _times(arrays: Arrays, step: float) -> dict[str, Any]:
    completion = completion_step(arrays)
    known = {
        "first_contact_time": (arrays["first_contact_step"], "time of the first contact of blocks"),
        "completion_time": (completion, "time at which all blocks had become one assembly"),
        "end_time": (arrays["end_step"], "time at which the run stopped"),
    }
    return {
        name: ("run", times_of(steps, time_step=step), _units("s", long_name))
        for name, (steps, long_name) in known.items()
    }


def _poses(arrays: Arrays) -> dict[str, Any]:
    dims = ("run", "block")
    poses = {
        name: (dims, np.ascontiguousarray(arrays["pose"][..., part]), _units(unit, long_name))
        for part, (name, unit, long_name) in enumerate(_POSE)
    }
    return {
        **poses,
        "cell": (
            (*dims, "axis"),
            arrays["cell"].astype(np.int32),
            {"long_name": "cell of the block on its assembly's lattice, x and y"},
        ),
        "quarter": (
            dims,
            arrays["quarter"].astype(np.int32),
            {"long_name": "quarter turns of the block against its assembly"},
        ),
        "assembly": (dims, arrays["assembly"].astype(np.int32), _LOWEST),
    }


def _parameters(plan: Plan) -> dict[str, Any]:
    drag, force = _units("1", "drag coefficient"), _units("N", "standard deviation of the force")
    known: dict[str, Any] = {
        "drag_coefficient": ("run", plan.drag_coefficient, drag),
        "force_std": ("run", plan.force_std, force),
    }
    if plan.flow_draw is not None:
        about = {"long_name": "which drawn flow field the run had"}
        known["flow_draw"] = ("run", plan.flow_draw.astype(np.int32), about)
    return known


def _status_flags() -> dict[str, Any]:
    return {
        "long_name": "problems in a run",
        "flag_masks": np.array(list(STATUS.values()), dtype=np.int32),
        "flag_meanings": " ".join(STATUS),
    }


def _names(dim: str, values: tuple[str, ...], long_name: str) -> tuple[str, Any, dict[str, str]]:
    return dim, np.array(values, dtype=object), {"long_name": long_name}


def _index(of: str, long_name: str) -> dict[str, Any]:
    return {"long_name": f"{long_name}: index into '{of}'"}


def _units(units: str, long_name: str) -> dict[str, Any]:
    return {"units": units, "long_name": long_name}
