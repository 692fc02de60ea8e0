"""Preparation of the recordings for the filter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from driftwalk.conditions import require_travel
from driftwalk.core.errors import InputError, argument_text
from driftwalk.core.text.json_text import parse_json
from driftwalk.flow.arena import Outline, outline_of, read_arena
from driftwalk.likelihood.angle import ORIENTED_SHARE, no_angle, smooth_angle
from driftwalk.likelihood.filter.series import FILTER, Body, Series
from driftwalk.likelihood.intervals import Intervals, cut_track, intervals_of
from driftwalk.likelihood.refuse import (
    LIMIT,
    require_length,
    require_memory,
    require_own_arena,
    require_size,
    require_usable,
)
from driftwalk.likelihood.spline import Spline, lay_spline
from driftwalk.likelihood.tracker_errors.dropped import (
    DroppedFrames,
    find_dropped_frames,
    places_of,
    with_gaps,
)
from driftwalk.likelihood.tracker_errors.outliers import without_outliers
from driftwalk.likelihood.tracker_errors.smoothed import require_raw
from driftwalk.likelihood.wall import wall_intervals
from driftwalk.schema import Track, body_track

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

AngleUse = Literal["auto", "state", "given", "none"]


def as_list(recordings: xr.Dataset | Sequence[xr.Dataset]) -> list[xr.Dataset]:
    """Return the recordings as a list, whether one or several were given; refuse none."""
    import xarray as xr

    many = [recordings] if isinstance(recordings, xr.Dataset) else list(recordings)
    if not many:
        raise InputError("no recording given: fit_motion needs one at least")
    return many


class PreparedRecordings(NamedTuple):
    """Recordings, ready for the filter."""

    tracks: list[Track]
    """One for each recording."""
    parts: list[Track]
    """The same, cut at the switching times."""
    places: list[tuple[int, int]]
    """Flow and recording of each part."""
    intervals: Intervals
    series: list[Series]
    """The parts as the filter takes them."""
    angle: str
    """How orientations are used."""
    wall_share: float
    mistakes: int
    """Samples that are left out as mistakes of the tracker."""
    jumps_removed: int
    """Samples that were left out when the recordings were read: too far away for `max_speed`."""
    dropped_frames: int
    """Frames that are missing though the stamps say a constant rate; their time is put in."""
    dropped_places: str
    """Where they are, in words; empty where there are none."""

    @property
    def duration(self) -> float:
        """Length of all recordings together [s]."""
        return sum(float(one.time[-1] - one.time[0]) for one in self.series)

    @property
    def samples(self) -> int:
        """Number of all samples, with those that are left out."""
        return sum(one.time.size for one in self.series) + self.mistakes


def prepare(
    many: Sequence[xr.Dataset], study: Study, angle: AngleUse | None, body: str | None
) -> PreparedRecordings:
    """Return recordings ready for the filter; refuse what cannot be fitted."""
    # The cheap refusals come first: memory and size need no track to be read.
    require_memory(sum(one.sizes["time"] for one in many))
    intervals = intervals_of(study)
    outline = outline_of(study.tank.to_arena())
    require_size(len(intervals.labels), 2 * spline_of(study, outline).size)
    tracks, parts, places = [], [], []
    raws: list[Track] = []
    mistakes, dropped = 0, list[DroppedFrames]()
    for index, recording in enumerate(many):
        seen, where = body_track(recording, body), _name_of(recording)
        name = str(recording.attrs.get("source", ""))
        track = without_outliers(seen)
        mistakes += seen.time.size - track.time.size
        require_length(track, study, where=where)
        require_travel(track, study, where=name)
        # Smoothing is looked for in the track as recorded: gaps would cut its spectrum.
        raws.append(track)
        dropped.append(find_dropped_frames(track, recording["time"].values))
        track = with_gaps(track, dropped[-1])
        cut = cut_track(track, intervals, fewest=LIMIT.fewest_samples, where=where)
        for number, part in enumerate(cut):
            if len(cut) > 1:
                require_travel(part, study, where=f"{where}{intervals.describe(number)}")
        tracks.append(track)
        parts += cut
        places += [(flow, index) for flow in intervals.flows]
    # One use of the angle for all recordings, as they share the noise of the angle.
    used_angle = use_angle(many, tracks, study.fit.angle if angle is None else angle)
    series = series_of(parts, study, outline, used_angle, places)
    count, near_wall = (
        sum(one.time.size - 1 for one in series),
        sum(one.near_wall for one in series),
    )
    # A tank that was fitted to the positions touches them: say so before the wall share does.
    if _is_fitted_arena(many[0], study):
        require_own_arena(study, intervals=count, near_wall=near_wall, where=_name_of(many[0]))
    _require_usable(series, study)
    # Each flow has its own coefficients, so each needs enough intervals.
    for flow in range(0 if intervals.steady else len(intervals.labels)):
        _require_usable(
            [one for one in series if one.flow == flow],
            study,
            where=f"{intervals.describe_flow(flow)}: ",
        )
    if study.fit.camera == "auto":
        for raw, recording in zip(raws, many, strict=True):
            require_raw(raw, where=_name_of(recording))
    share = near_wall / count
    return PreparedRecordings(
        tracks,
        parts,
        places,
        intervals,
        series,
        used_angle,
        share,
        mistakes,
        sum(_jumps_removed(recording, body) for recording in many),
        sum(one.frames for one in dropped),
        "; ".join(
            _name_of(recording) + places_of(one)
            for recording, one in zip(many, dropped, strict=True)
            if one.frames
        ),
    )


def _name_of(recording: xr.Dataset) -> str:
    """Return what a message on a recording begins with."""
    name = recording.attrs.get("source", "")
    return f"{name}: " if name else ""


def _jumps_removed(recording: xr.Dataset, body: str | None) -> int:
    """Return how many samples of a body the reading of its recording left out as jumps."""
    found = parse_json(str(recording.attrs.get("counts", "{}")))
    # A file may hold counts that `driftwalk.record` did not write.
    for key in ("per_body", str(recording["body"].values[0]) if body is None else body):
        found = found.get(key) if isinstance(found, dict) else None
    number = found.get("jumps_removed") if isinstance(found, dict) else None
    return number if isinstance(number, int) else 0


def _is_fitted_arena(recording: xr.Dataset, study: Study) -> bool:
    """Whether the tank is the circle that was fitted to the positions (``arena="fit"``)."""
    arena, found = (
        read_arena(str(recording.attrs.get(key, "{}"))) for key in ("arena", "arena_found")
    )
    # Where the size is given and only the centre is fitted, no radius is found.
    return "radius_is" in found and arena.get("diameter_m") == study.tank.diameter_m


def is_simulated(recording: xr.Dataset) -> bool:
    """Return whether a recording says of itself that it was simulated."""
    return str(recording.attrs.get("simulated", "no")) == "yes"


def use_angle(many: Sequence[xr.Dataset], tracks: Sequence[Track], wanted: str) -> str:
    """Return how orientations are used: "state", "given" or "none"."""
    if wanted not in ("auto", "state", "given", "none"):
        raise InputError(f"angle must be 'auto', 'state', 'given' or 'none', got {wanted!r}")
    shares = [_oriented_share(track) for track in tracks]
    seen = min(shares)
    if wanted in ("state", "given") and seen == 0.0:
        where = _name_of(many[shares.index(seen)])
        raise InputError(
            f"{where}the recording has no orientations, or the same in every row: leave out "
            f"{argument_text('angle', wanted)}, or read the column that holds them"
        )
    if wanted == "auto":
        return "state" if seen >= ORIENTED_SHARE else "none"
    return wanted


def _oriented_share(track: Track) -> float:
    """Return the share of samples with an orientation; 0 where a tracker only fills its column."""
    seen = np.isfinite(track.theta)
    if not seen.any() or np.ptp(track.theta[seen]) == 0.0:
        return 0.0
    return float(seen.mean())


def series_of(
    tracks: Sequence[Track],
    study: Study,
    outline: Outline,
    used_angle: str,
    places: Sequence[tuple[int, int]] | None = None,
) -> list[Series]:
    """Return the tracks as the filter takes them.

    `places` are the flow and the recording of each, by default one flow and recording after
    recording. Times begin with the recording's first sample.
    """
    found: list[Series] = []
    first = 0.0
    ends: dict[int, float] = {}
    for number, track in enumerate(tracks):
        ends[number if places is None else places[number][1]] = float(track.time[-1])
    for number, track in enumerate(tracks):
        flow, recording = (0, number) if places is None else places[number]
        # All parts of a recording count time from its first sample: the cosines of the flow's
        # strength run over the whole of it.
        if not found or found[-1].recording != recording:
            first = float(track.time[0])
        time = track.time - first
        smooth = no_angle(time.size)
        corners = None
        if used_angle != "none":
            smooth = smooth_angle(time, track.theta, longest_gap=FILTER.longest_gap_s)
            # A corner is where the recorded angle puts it; the smooth one only fills its holes.
            corners = np.where(np.isfinite(track.theta), track.theta, smooth.theta)
        wall = wall_intervals(
            time,
            track.x,
            track.y,
            corners,
            outline=outline,
            side=study.block.side_m,
            longest_gap=FILTER.longest_gap_s,
        )
        found.append(
            Series(
                time,
                np.ascontiguousarray(track.x),
                np.ascontiguousarray(track.y),
                np.ascontiguousarray(track.theta) if used_angle == "state" else smooth.theta,
                smooth.omega,
                (wall | ~smooth.known).astype(np.uint8),
                flow,
                recording,
                int(wall.sum()),
                smooth.theta,
                ends[recording] - first,
            )
        )
    return found


def _require_usable(series: Sequence[Series], study: Study, *, where: str = "") -> None:
    require_usable(
        usable_intervals(series),
        intervals=sum(one.time.size - 1 for one in series),
        near_wall=sum(one.near_wall for one in series),
        tank=study.tank.describe(),
        longest_gap=FILTER.longest_gap_s,
        where=where,
    )


def usable_intervals(series: Sequence[Series]) -> int:
    """Return the number of intervals that are not left out and not longer than a gap."""
    return sum(
        int(np.count_nonzero((one.excluded[1:] == 0) & (np.diff(one.time) <= FILTER.longest_gap_s)))
        for one in series
    )


def spline_of(study: Study, outline: Outline) -> Spline:
    """Return the spline of the flow over the tank of a study."""
    return lay_spline(
        outline,
        side=study.block.side_m,
        spacing=study.fit.spacing_m(side_m=study.block.side_m, widest_m=max(study.tank.extent_m)),
    )


def body_of(study: Study, used_angle: str) -> Body:
    """Return the block of a study as the filter takes it."""
    return Body(
        side=study.block.side_m,
        mass=study.block.mass_kg,
        depth=study.wetted_depth_m,
        strips=study.block.strips_per_face,
        water_density=study.water.density_kg_m3,
        # Linear and quadratic drag are compared at a speed of one side of the block a second.
        linear_speed=study.block.side_m,
        drag_speed=study.forces.drag_speed_m_s,
        orientation=used_angle,
    )
