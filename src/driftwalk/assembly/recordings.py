"""Outcome classes of a recording of many blocks over time."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.lattice.join_history import Event, JoinHistory
from driftwalk.assembly.lattice.joined_faces import (
    JOIN_ANGLE,
    JOIN_POLICY,
    ROUNDING,
    JoinRules,
    Poses,
    find_joins,
    rigid_joins,
    smallest_distance,
)
from driftwalk.assembly.lattice.polyomino import Chirality, require_chirality
from driftwalk.assembly.outcomes.bond_kinetics import RATE_CONFIDENCE, bond_rate, recorded_rates
from driftwalk.assembly.outcomes.outcome_classes import listed_classes, listed_shapes
from driftwalk.core.arrays import Bools, Floats
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.schema import body_names, check_trajectory
from driftwalk.schema.check import build_dataset

if TYPE_CHECKING:
    import xarray as xr


UNKNOWN: Final = -1
"""In place of the number of a class where the frame shows none."""


def classify(
    recording: xr.Dataset,
    *,
    side: float,
    chirality: Chirality = "merged",
    join_distance: float | None = None,
    join_angle: float = JOIN_ANGLE,
    release_distance: float | None = None,
    release_angle: float | None = None,
    min_duration: float = JOIN_POLICY.min_duration_s,
    hold: float | None = None,
    play: float | None = None,
) -> xr.Dataset:
    """Return the outcome class of the blocks of a recording at every time.

    Two blocks are joined from the first sample at which the centres of two of their faces are
    within `join_distance` and the faces look at each other within `join_angle`, if that lasts for
    `min_duration`; they come apart at the first sample beyond `release_distance` or
    `release_angle`, if that lasts as long, or that have moved against each other by more than
    `play`. Assemblies are blocks connected by joins, on a lattice;
    where joins contradict each other there, the loosest are dropped and counted.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory` of one or more bodies with orientation; theta is the direction of face 0.
    side : float
        Side of a block [m].
    chirality : {"merged", "distinct"}
        Whether mirror images are one shape or two.
    join_distance : float, optional
        Largest distance between the centres of two faces that join [m]; default: a tenth of a side.
    join_angle : float
        Largest angle between them [rad], below pi/4.
    release_distance, release_angle : float, optional
        The same for faces that stay joined; not smaller, default: twice as large.
    min_duration : float
        Shortest duration of a join, and of coming apart [s]. With more than 0 it takes two samples
        in a row, so that a single noisy one changes nothing. Joins that begin later than this
        before the end of the recording are not seen.
    hold : float, optional
        How long a block that is not seen keeps its joins [s]; after that its state is unknown until
        it is seen again. Default: 1 s, or three sampling intervals if that is longer.
    play : float, optional
        How far joined faces may move against each other [m]; a turn counts as what the far face
        moves. Default: twice the median movement of faces that fit within `min_duration`, at least
        a fiftieth of a side. Then blocks that only drift past each other are left out; infinity
        counts them as joined.

    Returns
    -------
    xarray.Dataset
        Kind "classification". ``outcome`` (time): index into ``class``, -1 unknown; ``assembly``
        (time, body): lowest body of the assembly, -1 unknown; ``proportion`` (class): share of the
        time in which the class is known. Joins as in a simulated run: ``event_count``,
        ``event_time`` [s], ``event_block``, ``event_face``, ``event_assembly``, ``event_shape``,
        ``event_class``; blocks that came apart: ``split_count``, ``split_time`` [s],
        ``split_block``, ``split_face``, ``split_class``; padded with NaN and -1 to at least one.
        Several at one sample are in order, those that came apart before those that joined.
        ``joining_rate``, ``parting_rate`` (class) [1/s]: events in this class over the time in it,
        with counts and intervals: exact Poisson ones, of joinings widened as far as they cluster.
        ``attrs``: the tolerances, ``dropped_joins``, ``left_out_contacts`` (at rest, but no joins),
        ``unknown_samples``, ``known_s`` (time in which the class is known), ``closest_m`` (smallest
        distance of two centres), and ``bond_rate_per_s`` (partings per bond and second in classes
        without loops) with its ends ``bond_rate_low_per_s`` and ``bond_rate_high_per_s``.

    Raises
    ------
    InputError
        When there is no sample, the recording states that its bodies are no squares, a body has no
        orientation, no two bodies are ever seen in the same sample, or a tolerance is out of range.

    Notes
    -----
    Of the contacts in which the faces do not move, those are joins that lie as most of the joined
    time lies: their distance from fitting exactly is at most the 90 % quantile over that time, and
    play/sqrt(samples) for the noise of their median. One of 10 s or more is a join wherever the
    faces lie, and the further joins of its two blocks may lie as far off.

    Examples
    --------
    >>> import numpy as np
    >>> from driftwalk.schema import build_trajectory
    >>> x = np.column_stack([np.zeros(20), np.r_[np.full(10, 0.05), np.full(10, 0.03)]])
    >>> recording = build_trajectory(0.1 * np.arange(20), x, np.zeros((20, 2)), np.zeros((20, 2)))
    >>> found = classify(recording, side=0.03)
    >>> found["class"].values[found["outcome"].values[[0, -1]]].tolist()
    ['1+1', '2']
    """
    require_chirality(chirality)
    poses = _checked_poses(recording)
    if hold is None:
        usual = float(np.median(np.diff(poses.time))) if poses.time.size > 1 else 0.0
        hold = max(JOIN_POLICY.hold_s, JOIN_POLICY.frames_held * usual)
    rules = JoinRules.completed(
        side, join_distance, join_angle, release_distance, release_angle, min_duration, hold
    )
    if play is not None and not play > 0:
        raise ConfigurationError(f"play must be more than 0, got {play:g}")
    joins, play, left_out = rigid_joins(poses, find_joins(poses, rules), rules, play)
    history = JoinHistory(poses.x.shape, joins, chirality=chirality)
    return _dataset(recording, poses, rules, history, play, left_out)


def _checked_poses(recording: xr.Dataset) -> Poses:
    check_trajectory(recording)
    names = body_names(recording)
    if not names:
        raise InputError("the recording has no body: there is nothing to classify")
    if not recording.sizes["time"]:
        raise InputError("the recording has no sample: there is nothing to classify")
    if (shape := recording.attrs.get("block_shape", "square")) != "square":
        raise InputError(
            f"the shape of the bodies is '{shape}', and only squares are classified, by their "
            "faces: what simulated ones built is in the result of driftwalk assemble"
        )
    poses = Poses(*(recording[name].values for name in ("time", "x", "y", "theta")))
    blind = [name for index, name in enumerate(names) if not poses.seen[:, index].any()]
    if len(blind) == len(names):
        raise InputError(
            "the recording has no orientation: without the angle of each block the "
            "joined faces cannot be found "
            '(`theta` or `columns={"theta": "NAME"}` of `load` if the file has it)'
        )
    if blind:
        raise InputError(
            f"no sample has position and orientation of body {', '.join(blind[:8])}: leave it out "
            "of the recording, or add its angle"
        )
    if len(names) > 1 and (poses.seen.sum(axis=1) < 2).all():
        raise InputError(
            "no two bodies are ever seen in the same sample: give all bodies common time stamps"
        )
    return poses


def _unknown_blocks(poses: Poses, hold: float) -> Bools:
    """Return where a block was last seen too long ago, (time, block)."""
    sample = np.arange(poses.time.size)[:, None]
    last = np.maximum.accumulate(np.where(poses.seen, sample, -1), axis=0)
    age = poses.time[:, None] - poses.time[last]
    return np.asarray((last < 0) | (age > hold * (1.0 + ROUNDING)))


def _shares(outcome: npt.NDArray[np.int32], lasts: Floats, classes: int) -> Floats:
    """Return the share of each class in the time in which the class is known."""
    known = outcome >= 0
    # A recording of one sample lasts no time at all.
    weights = lasts[known] if lasts[known].any() else np.ones(int(known.sum()))
    sums = np.bincount(outcome[known], weights=weights, minlength=classes)
    return sums / sums.sum() if known.any() else np.full(classes, np.nan)


def _dataset(
    recording: xr.Dataset,
    poses: Poses,
    rules: JoinRules,
    history: JoinHistory,
    play: float,
    left_out: int,
) -> xr.Dataset:
    joined, blocks = history.joined, poses.x.shape[1]
    names = {*history.outcome, *(event.outcome for event in (*joined, *history.split))}
    classes = listed_classes(names, blocks, chirality=history.chirality)
    parts = {shape for event in joined for shape in event.shapes}
    shapes = listed_shapes({"1", *parts}, blocks, chirality=history.chirality)
    known = ~_unknown_blocks(poses, rules.hold)
    sound: Bools = np.logical_and.reduce(known, axis=1)
    outcome = np.where(sound, _places(history.outcome, classes), UNKNOWN).astype(np.int32)
    assembly = np.where(known, history.assembly, UNKNOWN).astype(np.int32)
    # A sample holds until the next one, if that comes in time.
    lasts = np.append(np.minimum(np.diff(poses.time), rules.hold), 0.0)
    lasts = np.where(sound, lasts, 0.0)
    rates = recorded_rates(history, outcome, lasts, classes)
    data: dict[str, Any] = {
        "outcome": ("time", outcome),
        "assembly": (("time", "body"), assembly),
        "proportion": ("class", _shares(outcome, lasts, len(classes))),
        **rates,
        **_event_variables("event", joined, poses.time, classes),
        **_event_variables("split", history.split, poses.time, classes),
        "event_assembly": (("event", "side"), _padded([one.assemblies for one in joined], 2)),
        "event_shape": (
            ("event", "part"),
            _padded([_places(one.shapes, shapes) for one in joined], 3),
        ),
    }
    return build_dataset(
        "classification",
        data,
        {
            "time": recording["time"],
            "body": recording["body"],
            "class": ("class", np.array(classes, dtype=object)),
            "shape": ("shape", np.array(shapes, dtype=object)),
        },
        {
            **{key: recording.attrs[key] for key in ("source", "arena") if key in recording.attrs},
            "blocks": blocks,
            "chirality": history.chirality,
            "block_side_m": rules.side,
            "join_distance_m": rules.join_distance,
            "join_angle_rad": rules.join_angle,
            "release_distance_m": rules.release_distance,
            "release_angle_rad": rules.release_angle,
            "min_duration_s": rules.min_duration,
            "hold_s": rules.hold,
            "play_m": play,
            "dropped_joins": len(history.dropped),
            "left_out_contacts": left_out,
            "closest_m": smallest_distance(poses),
            "unknown_samples": int((~sound).sum()),
            "known_s": float(lasts.sum()),
            "rate_confidence": RATE_CONFIDENCE,
            **bond_rate(rates, outcome, lasts, classes),
        },
    )


def _places(names: Iterable[str], listed: Sequence[str]) -> list[int]:
    place = {name: index for index, name in enumerate(listed)}
    return [place[name] for name in names]


def _event_variables(
    kind: str, events: list[Event], time: Floats, classes: Sequence[str]
) -> dict[str, Any]:
    """Return when and where assemblies joined or came apart, padded to at least one."""
    clock = [time[event.sample] for event in events] or [math.nan]
    after = _places([event.outcome for event in events], classes) or [UNKNOWN]
    return {
        f"{kind}_count": ((), np.int32(len(events))),
        f"{kind}_time": (kind, np.array(clock, dtype=np.float64)),
        f"{kind}_block": ((kind, "side"), _padded([event.blocks for event in events], 2)),
        f"{kind}_face": ((kind, "side"), _padded([event.faces for event in events], 2)),
        f"{kind}_class": (kind, np.array(after, dtype=np.int32)),
    }


def _padded(rows: Sequence[Sequence[int]], width: int) -> npt.NDArray[np.int32]:
    """Return rows of whole numbers, one of -1 where there is none."""
    return np.array(rows or [(UNKNOWN,) * width], dtype=np.int32)
