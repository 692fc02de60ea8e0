"""The part of a page on a recording: path, speeds, gaps and noise, and how it was tracked."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Bools, Floats, Integers
from driftwalk.core.errors import InputError
from driftwalk.core.units import percent
from driftwalk.page import parts
from driftwalk.page.arrays import binary_step, encode_array, number, plain_list
from driftwalk.page.parts import Section, count, is_simulated, quantity
from driftwalk.plot.tank import GAP_INTERVALS
from driftwalk.schema import Track, body_names, body_track, check_trajectory

if TYPE_CHECKING:
    import xarray as xr


class RecordingSectionPolicy(NamedTuple):
    """How much of a recording a page holds, and how finely; sizes chosen by hand."""

    most_samples: int = 20_000
    """Of a path that is drawn and played; chosen by hand."""
    most_gaps: int = 1000
    """The longest ones; chosen by hand."""
    most_bodies: int = 8
    """Chosen by hand."""
    speed_bins: int = 40
    """Chosen by hand."""
    far_speed: float = 2.0
    """How many times the 99th percentile a speed may be and still be in the histogram; chosen by
    hand."""
    position_parts: int = 20_000
    """The extent of a path in steps of its resolution, at least; chosen by hand."""
    angle_step_rad: float = 2.0**-10
    """Chosen by hand: 0.06 degrees."""
    time_step_s: float = 2.0**-14
    """Chosen by hand: 0.06 ms."""


SECTION: Final = RecordingSectionPolicy()

COUNTED: Final = {
    "frames": ("frames tracked", None),
    "dropped": ("frames dropped", "lost before processing"),
    "duplicates": ("frames doubled", "no later than the one before, left out"),
    "stale": ("frames stale", "the same image as the one before, left out"),
    "taken_back": ("positions taken back", "rejected as something else"),
}


class Noise(NamedTuple):
    """Estimates of the tracking noise."""

    position: float
    """[m]"""
    low: float | None
    high: float | None
    source: str
    """Who says so, such as "estimated by the fit"."""


def recording_sections(
    trajectory: xr.Dataset,
    *,
    body: str | None = None,
    noise: Noise | Mapping[str, Noise | None] | None = None,
) -> list[Section]:
    """Return a section for each body of a recording, or for the one that was used.

    Parameters
    ----------
    trajectory : xarray.Dataset
        A `trajectory`.
    body : str, optional
        The body that was used; all, at most 8, without it.
    noise : Noise or mapping, optional
        The noise of its tracking where one body is shown, or that of each body by its name.
    """
    names = body_names(check_trajectory(trajectory))
    chosen = names[: SECTION.most_bodies] if body is None else [body]
    if not isinstance(noise, Mapping):
        # Of several bodies it is unknown which one's it is.
        noise = {chosen[0]: noise} if len(chosen) == 1 else {}
    made: list[Section] = []
    for number_of, name in enumerate(chosen, start=1):
        id = f"recording-{number_of}"
        title = "The recording" if len(names) == 1 else f"The recording, body {name}"
        make = partial(trajectory_section, trajectory, body=name, noise=noise.get(name), id=id)
        made += parts.attempt(id, title, make)
    more = len(names) - SECTION.most_bodies
    if body is None and more > 0:
        made[-1]["note"] = f"{made[-1]['note'] or ''} {more} more bodies."
    return made


def trajectory_section(
    trajectory: xr.Dataset,
    *,
    body: str | None = None,
    noise: Noise | None = None,
    id: str = "recording-1",
) -> Section:
    """Return the section on one body of a recording: path, speeds, gaps and facts.

    Parameters
    ----------
    trajectory : xarray.Dataset
        A `trajectory`.
    body : str, optional
        Which body; may be left out when there is only one.
    noise : Noise, optional
        The noise of its tracking.
    id : str
        Name of the section in its page.

    Returns
    -------
    dict
        A section of kind "trajectory": at most some 20,000 samples, a sample of NaN in each gap.

    Raises
    ------
    InputError
        When there is no such body, or it has fewer than two positions.

    Examples
    --------
    >>> from driftwalk.schema import build_trajectory
    >>> moving = build_trajectory([0.0, 0.1, 0.2], [0.0, 0.01, 0.02], [0.0, 0.0, 0.0])
    >>> trajectory_section(moving)["kind"]
    'trajectory'
    """
    check_trajectory(trajectory)
    track = body_track(trajectory, body)
    if track.time.size < 2:
        raise InputError(f"the recording has {count(track.time.size, 'position')}: nothing to show")
    interval = np.diff(track.time)
    gap = interval > GAP_INTERVALS * np.median(interval)
    ends = np.flatnonzero(gap)
    longest = ends[np.argsort(-interval[ends], kind="stable")[: SECTION.most_gaps]]
    shown, every = _shown(track, longest)
    step = binary_step(max(float(np.ptp(track.x)), float(np.ptp(track.y))), SECTION.position_parts)
    path: dict[str, Any] = {
        "time": encode_array(shown.time, step=SECTION.time_step_s, offset=float(shown.time[0])),
        "x": encode_array(shown.x, step=step),
        "y": encode_array(shown.y, step=step),
        "theta": encode_array(shown.theta, step=SECTION.angle_step_rad)
        if track.has_orientation
        else None,
    }
    # Of all samples, whatever is shown; but over a gap a body is not seen to move.
    speed = np.hypot(np.diff(track.x), np.diff(track.y))[~gap] / interval[~gap]
    notes = [parts.SIMULATED] if is_simulated(trajectory) else []
    if every > 1:
        notes.append(f"One position in {every} is shown.")
    notes.append(f"Positions are shown to {quantity(step, 'm', digits=2)}.")
    top = _top_speed(speed)
    beyond = speed[speed > top]
    if beyond.size:
        notes.append(
            f"{percent(beyond.size / speed.size)} of the speeds are beyond the histogram, up to "
            f"{quantity(float(beyond.max()), 'm/s', digits=3)}."
        )
    names = body_names(trajectory)
    title = "The recording" if len(names) == 1 else f"The recording, body {body}"
    return parts.section(
        id, "trajectory", title, " ".join(notes),
        arena=parts.arena_part(trajectory),
        **path,
        gaps=track.time[np.sort(longest)[:, None] + np.arange(2)].tolist(),
        speed=_speed_density(speed, top),
        facts=[*_facts(track, interval, gap, speed, noise), *_ambiguity(trajectory, body)],
    )  # fmt: skip


def noise_of(described: Mapping[str, Any], body: str) -> Noise | None:
    """Return the noise that a description of a recording states, None when it has none.

    Parameters
    ----------
    described : mapping
        Result of `driftwalk.describe`.
    body : str
        Name of the body.
    """
    facts = described.get("bodies", {}).get(body, {})
    value = number(facts.get("position_noise_m"))
    if value is None:
        return None
    error = number(facts.get("position_noise_standard_error_m"))
    if error is None:
        return Noise(value, None, None, "estimated from the recording")
    if value == 0.0:
        words = "standard error of an estimate of zero: too small to determine from the recording"
        return Noise(error, None, None, words)
    words = "estimated from the recording, ± standard error"
    return Noise(value, max(value - error, 0.0), value + error, words)


def _shown(track: Track, longest: Integers) -> tuple[Track, int]:
    """Return what is shown of a track, broken by NaN at gaps, and every how manyth sample it is."""
    size = track.time.size
    room = max(SECTION.most_samples - 3 * longest.size - 1, 1)
    every = max(1, -(-size // room))
    kept = np.unique(np.concatenate([np.arange(0, size, every), longest, longest + 1, [size - 1]]))
    after = np.searchsorted(kept, longest) + 1
    middle = 0.5 * (track.time[longest] + track.time[longest + 1])
    time = np.insert(track.time[kept], after, middle)
    x, y, theta = (np.insert(column[kept], after, np.nan) for column in track[1:])
    return Track(time, x, y, theta), every


def _top_speed(speed: Floats) -> float:
    """Return where the histogram ends: a few jumps must not squeeze all else into one bin."""
    top = float(speed.max(initial=0.0)) or 1.0
    usual = SECTION.far_speed * float(np.percentile(speed, 99.0)) if speed.size else top
    return usual if 0.0 < usual < top else top


def _speed_density(speed: Floats, top: float) -> dict[str, Any]:
    """Return the density of all speeds, as far as it is shown."""
    number_of, edges = np.histogram(speed, bins=SECTION.speed_bins, range=(0.0, top))
    density = number_of / (max(speed.size, 1) * np.diff(edges))
    return {"edges": plain_list(edges), "density": plain_list(density)}


def _facts(
    track: Track,
    interval: Floats,
    gap: Bools,
    speed: Floats,
    noise: Noise | None,
) -> list[dict[str, Any]]:
    usual = float(np.median(interval))
    duration = float(track.time[-1] - track.time[0])
    facts = [
        parts.figure("positions", track.time.size),
        parts.figure("duration", duration, "s"),
        parts.figure("rate", 1.0 / usual, "Hz"),
        parts.figure("gaps", int(gap.sum())),
        parts.figure("time in gaps", 100.0 * float((interval[gap] - usual).sum()) / duration, "%"),
        parts.figure("mean speed", speed.mean() if speed.size else None, "m/s"),
        parts.figure(
            "99 % of speeds are below", np.percentile(speed, 99.0) if speed.size else None, "m/s"
        ),
    ]
    if noise is not None:
        ends = (noise.low, noise.high)
        facts.append(
            parts.figure("tracking noise", noise.position, "m", note=noise.source, ends=ends)
        )
    return facts


def _ambiguity(trajectory: xr.Dataset, body: str | None) -> list[dict[str, Any]]:
    """Return the share of a tracked recording in which the body could be another one."""
    if "ambiguous" not in trajectory:
        return []
    scores = trajectory["ambiguous"].transpose("time", "body").values
    which = 0 if body is None else body_names(trajectory).index(body)
    share = 100.0 * float((scores[:, which] > 0.0).mean())
    return [parts.figure("identity ambiguous", share, "%", note="share of the time")]


def tracking_sections(tracking: Mapping[str, Any] | None) -> list[Section]:
    """Return the section on the tracking of a recording, none of one that was not tracked here.

    Parameters
    ----------
    tracking : mapping or None
        ``tracking`` of what `driftwalk.describe` returns.

    Examples
    --------
    >>> tracking_sections(None)
    []
    >>> (part,) = tracking_sections({"tracked_from": "v.mp4", "complete": True, "frames": 9})
    >>> part["numbers"][0]["value"]
    9.0
    """
    if tracking is None:
        return []
    words = [f"Tracked from {tracking.get('tracked_from') or 'an unnamed source'}."]
    rejected = tracking.get("rejected") or {}
    if rejected:
        listed = ", ".join(f"{reason} {number}" for reason, number in rejected.items())
        words.append(f"Candidates rejected, over all frames: {listed}.")
    numbers = [
        parts.figure(label, tracking[key], note=note)
        for key, (label, note) in COUNTED.items()
        if key in tracking
    ]
    return [parts.summary_section(words, numbers, id="tracking", title="Tracking")]


def tracking_warnings(tracking: Mapping[str, Any] | None) -> list[str]:
    """Return what a reader has to know of the tracking: that it ended early.

    Examples
    --------
    >>> tracking_warnings({"complete": False, "interrupted": "the disk is full"})
    ['the tracking broke off: the disk is full']
    >>> tracking_warnings({"complete": True, "interrupted": None}), tracking_warnings(None)
    ([], [])
    """
    if tracking is None or tracking.get("complete", True):
        return []
    reason = tracking.get("interrupted")
    ending = "" if reason is None else f": {reason}"
    return [f"the tracking broke off{ending}"]
