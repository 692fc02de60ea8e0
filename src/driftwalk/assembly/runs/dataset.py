"""Build the datasets of the runs of the native core: `assembly`, `assembly_path`, a recording.

Of `assembly`: dimensions ``run``, ``event`` (one less than blocks, at least one), ``side`` (of the
assembly that stayed, of the one that was moved), ``part`` (stayed, moved, became), ``block``,
``axis``; coordinates ``class`` (outcome classes) and ``shape`` (polyominoes). Indices of what
is not there are -1, its times NaN.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.lattice.events import ReplayedEvents, replay_contacts, replay_events
from driftwalk.assembly.lattice.joined_faces import JOINING, PARTING, face_table
from driftwalk.assembly.runs.start import glued_cells
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.core.files.shards import Arrays
from driftwalk.schema.check import build_dataset, require_kind
from driftwalk.schema.trajectory import POSE
from driftwalk.simulation.backend import BROKEN
from driftwalk.simulation.series import series_facts

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.assembly.runs.plan import Plan


LAW_NAMES: Final = {
    "forces.linear_drag_kg_s": "linear_drag",
    "forces.drag_power": "drag_power",
    "forces.force_memory_s": "force_memory",
    "assembly.hidden_face_drag": "hidden_face_drag_share",
    "forces.stirring_length_m": "stirring_length",
}
"""Names of drawn numbers of the law, by their keys in the study."""
_RULES: Final = (
    *("blocks", "runs", "seed", "chirality", "latching", "block_restitution", "block_friction"),
)
_CONNECTOR: Final = ("connector_distance_m", "connector_axis_rad", "connector_rotation_rad")
_BONDS: Final = ("bond_rate_per_s", "bond_force_N", "bond_strength_N", "relatch_clearance")
"""Keys of [assembly] that are attributes of the same names."""
_SIZE: Final = ("block_shape", "block_side_m", "block_width_m")
"""Attributes that a recording of a run has too."""
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
    study = plan.study
    replayed = replay_of(plan, arrays)
    broken = (arrays["status"].astype(np.int64) & BROKEN) != 0
    # A broken world has no class, whatever its events say.
    outcome = np.where(broken, np.int32(-1), replayed.outcome)
    by_event, by_side, by_block = ("run", "event"), ("run", "event", "side"), ("run", "block")
    whole = {name: array.astype(np.int32) for name, array in arrays.items() if "pose" not in name}
    step = study.time_step_s
    data: dict[str, Any] = {
        "event_count": ("run", whole["event_count"]),
        "event_time": (by_event, times_of(whole["event_step"], time_step=step)),
        "event_block": (by_side, whole["event_block"]),
        "event_assembly": (by_side, replayed.event_assembly),
        "event_shape": ((*by_event, "part"), replayed.event_shape),
        "event_class": (by_event, replayed.event_class),
        "first_contact_time": ("run", times_of(whole["first_contact_step"], time_step=step)),
        "completion_time": ("run", times_of(completion_step(arrays), time_step=step)),
        "end_time": ("run", times_of(whole["end_step"], time_step=step)),
        **_poses(arrays["pose"], by_block),
        "assembly": (by_block, whole["assembly"]),
        "drag_coefficient": ("run", plan.drag_coefficient),
        "force_std": ("run", plan.force_std),
    }
    if plan.has_lattice:
        data["event_face"] = (by_side, whole["event_face"])
        data["cell"] = ((*by_block, "axis"), whole["cell"])
        data["quarter"] = (by_block, whole["quarter"])
    data |= _poles(plan)
    if study.assembly.binding is not None and replayed.kind is not None:
        data["kind"] = (by_block, replayed.kind.astype(np.int32))
    if plan.flow_draw is not None:
        data["flow_draw"] = ("run", plan.flow_draw.astype(np.int32))
    if plan.flow_start is not None:
        data["flow_start"] = ("run", plan.flow_start)
    if "event_kind" in whole:
        data["event_kind"] = (by_event, whole["event_kind"])
    data |= {LAW_NAMES[key]: ("run", values) for key, values in plan.law.items()}
    data |= {"outcome": ("run", outcome), "status": ("run", whole["status"])}
    return build_dataset(
        "assembly",
        data,
        {
            "run": ("run", np.arange(outcome.size)),
            "block": ("block", np.arange(study.assembly.blocks)),
            "class": ("class", np.array(replayed.classes, dtype=object)),
            "shape": ("shape", np.array(replayed.shapes, dtype=object)),
        },
        {**assembly_attrs(plan), **attrs},
    )


def replay_of(plan: Plan, arrays: Arrays) -> ReplayedEvents:
    """Return what the events of runs of the native core did on the lattice, or without one."""
    if not plan.has_lattice:
        return replay_contacts(
            arrays["event_count"],
            arrays["event_block"],
            pose=arrays["pose"],
            assembly=arrays["assembly"],
            **plan.study.block.contact_size,
            event_kind=arrays.get("event_kind"),
        )
    return replay_events(
        *(arrays[f"event_{name}"] for name in ("count", "block", "face")),
        **{name: arrays[name] for name in ("cell", "quarter", "assembly")},
        event_kind=arrays.get("event_kind"),
        chirality=plan.study.assembly.chirality,
        faces=face_table(plan.study.assembly),
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
    dims = ("run", "time", "block")
    pose, step = samples["sample_pose"], plan.study.time_step_s
    time = times_of(np.arange(pose.shape[1]) * every, time_step=step)
    assembly = samples["sample_assembly"].astype(np.int32)
    return build_dataset(
        "assembly_path",
        {**_poses(pose, dims), "assembly": (dims, assembly), **_poles(plan)},
        {
            "run": ("run", plan.index),
            "time": ("time", time),
            "block": ("block", np.arange(pose.shape[2])),
        },
        {
            **assembly_attrs(plan),
            "runs": plan.index.size,
            "sample_interval_s": float(np.round(every * step, DECIMALS)),
        },
    )


def _poles(plan: Plan) -> dict[str, Any]:
    """Return the poles of the blocks' faces, where there are any and no block changes them."""
    table = face_table(plan.study.assembly)
    if table is None or not table.pole.any() or table.rewrites:
        return {}
    kinds = table.first_kinds(plan.study.assembly.blocks)
    return {"pole": (("block", "face"), table.pole[kinds])}


def assembly_attrs(plan: Plan) -> dict[str, Any]:
    """Return the attributes that say what was simulated."""
    study = plan.study
    settings = study.assembly
    names = [*_RULES, *(_CONNECTOR if settings.latching == "connector" else ())]
    names += _BONDS if settings.bonds_break else ()
    return {
        **{name: getattr(settings, name) for name in names},
        "duration_s": float(np.round(plan.duration, DECIMALS)),
        **({} if (faces := settings.typed_faces) is None else {"faces": faces.words}),
        "hidden_face_drag": "full" if not plan.has_lattice else str(settings.hidden_face_drag),
        "block_side_m": study.block.side_m,
        **({} if plan.has_lattice else {"block_shape": study.block.shape}),
        **({} if (width := study.block.width_m) is None else {"block_width_m": width}),
        **({"glued": settings.glued} if glued_cells(settings) is not None else {}),
        "arena": study.tank.to_arena_json(),
        "force_interval_s": study.forces.force_interval_s,
        "time_step_s": study.time_step_s,
        "trial": plan.trial,
        "backend": plan.backend,
        "study": study.to_toml(),
        **series_facts(plan.flow, plan.flow_start, duration=plan.duration),
    }


def completion_step(arrays: Arrays) -> npt.NDArray[Any]:
    """Return the step at which all blocks had become one assembly first, -1 in runs without.

    Parameters
    ----------
    arrays : dict of ndarray
        As in `build_assembly`.
    """
    step, blocks = arrays["event_step"], arrays["assembly"].shape[1]
    kind = arrays.get("event_kind", np.where(step < 0, -1, JOINING))
    parts = blocks - np.cumsum((kind == JOINING).astype(int) - (kind == PARTING), axis=1)
    # A single block is complete from the start.
    complete = (parts == 1) & (step >= 0)
    first = np.take_along_axis(step, complete.argmax(axis=1)[:, None], axis=1)[:, 0]
    return np.where(complete.any(axis=1), first, 0 if blocks == 1 else -1)


def times_of(step: npt.NDArray[Any], *, time_step: float) -> Floats:
    """Return the times [s] of the ends of steps, NaN where there is none (-1).

    Rounded to a nanosecond, so that step 30 of 0.01 s is at 0.3 s.
    """
    return np.where(step < 0, np.nan, np.round(step * time_step, DECIMALS))


def _poses(pose: Floats, dims: tuple[str, ...]) -> dict[str, Any]:
    """Return poses as variables: x, y, theta."""
    return {name: (dims, np.ascontiguousarray(pose[..., i])) for i, name in enumerate(POSE)}


def path_recording(path: xr.Dataset, *, run: int = 0) -> xr.Dataset:
    """Return one simulated run as a recording of all its blocks.

    Functions that read recordings can then be tried on motion whose events are known: `classify`
    above all.

    Parameters
    ----------
    path : xarray.Dataset
        An `assembly_path`.
    run : int
        The run's index, as in its coordinate ``run``.

    Returns
    -------
    xarray.Dataset
        A `trajectory`: ``x``, ``y`` [m], ``theta`` [rad] on (time, body), bodies named by their
        index.

    Raises
    ------
    InputError
        When the dataset is of another kind, or has no such run.

    Examples
    --------
    >>> import driftwalk as dw
    >>> still = dw.uniform_flow(0.0, 0.0)
    >>> path = dw.assembly_path(dw.Study(), still, blocks=2, duration=1.0)
    >>> dw.classify(dw.path_recording(path), side=0.03)["outcome"].sizes["time"]
    11
    """
    from driftwalk.schema import build_trajectory

    require_kind(path, "assembly_path", "assembly_path makes one")
    runs = path["run"].values.tolist()
    if run not in runs:
        raise InputError(f"there is no run {run}: the path holds {', '.join(map(str, runs))}")
    one = path.sel(run=run)
    placed = one.transpose("time", "block", ...)
    return build_trajectory(
        one["time"].values,
        *(placed[name].values.astype(np.float64) for name in POSE),
        body=[str(block) for block in one["block"].values],
        attrs={
            "source": f"simulated run {run}",
            "format": "driftwalk",
            "arena": path.attrs["arena"],
            "sample_rate_Hz": 1.0 / float(path.attrs["sample_interval_s"]),
            **{name: path.attrs[name] for name in _SIZE if name in path.attrs},
        },
    )
