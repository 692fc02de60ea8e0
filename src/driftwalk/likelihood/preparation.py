"""Recordings and stored fits, made ready for the filter."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from driftwalk.conditions import one_body_each, require_travel
from driftwalk.conditions.refuse import prefix_of
from driftwalk.conditions.study import fitted_law, is_fitted
from driftwalk.core.errors import InputError, argument_text
from driftwalk.core.text_files import parse_json
from driftwalk.flow.arena import outline_of
from driftwalk.likelihood.filter.filter_pass import Passes
from driftwalk.likelihood.filter.parameters import Body, Point
from driftwalk.likelihood.filter.series import (
    FILTER,
    ORIENTED_SHARE,
    Series,
    series_of,
    stretches_unsettled,
    usable_intervals,
    wall_intervals,
)
from driftwalk.likelihood.fitted_modes import stored_coefficients
from driftwalk.likelihood.flow_intervals import Intervals, cut_track, intervals_of, require_fit
from driftwalk.likelihood.law.force_law import effective_logs, stored_numbers
from driftwalk.likelihood.measured_flow import MeasuredFlow, measured_flow
from driftwalk.likelihood.measured_series import stored_flow
from driftwalk.likelihood.prior import Earlier, Prior, Weights
from driftwalk.likelihood.recording_artifacts.dropped_frames import (
    DroppedFrames,
    find_dropped_frames,
    places_of,
    with_gaps,
)
from driftwalk.likelihood.recording_artifacts.noise_free import AddedNoise, with_least_noise
from driftwalk.likelihood.recording_artifacts.smoothed import require_raw
from driftwalk.likelihood.refuse import (
    LIMIT,
    require_length,
    require_memory,
    require_own_arena,
    require_size,
    require_usable,
)
from driftwalk.likelihood.spline import Spline, lay_spline
from driftwalk.schema import Track, body_track
from driftwalk.schema.answers.facts import fitted_value
from driftwalk.schema.outliers import without_outliers
from driftwalk.schema.trajectory import read_arena

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


@dataclass(frozen=True, eq=False)
class PreparedRecordings:
    """Recordings, ready for the filter."""

    recordings: Sequence[xr.Dataset]
    study: Study
    body: str | None
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
    dropped: list[DroppedFrames]
    """Frames of each recording that are missing though the stamps say a constant rate."""
    outliers: int
    """Samples that are left out as outliers of the track."""
    added: AddedNoise
    """The most that a recording without noise of a camera got."""
    measured: MeasuredFlow | None = None
    earlier: Earlier | None = None
    """Posterior of a fit of one block in the same water, for glued blocks."""

    @property
    def prior(self) -> Prior:
        """The prior of the fit."""
        return Prior(self.passes, self.measured, earlier=self.earlier)

    @property
    def duration(self) -> float:
        """Length of all recordings together [s]."""
        return sum(float(one.time[-1] - one.time[0]) for one in self.series)

    @property
    def samples(self) -> int:
        """Number of all samples, with those that are left out."""
        return sum(one.time.size for one in self.series) + self.outliers

    @property
    def wall_share(self) -> float:
        """Share of the intervals that may hold a contact with the wall."""
        near_wall = sum(one.near_wall for one in self.series)
        return near_wall / sum(one.time.size - 1 for one in self.series)

    @property
    def passes(self) -> Passes:
        """The filter over these recordings."""
        body, flows = Body(self.study, self.angle), len(self.intervals.labels)
        layers = 1 if self.measured is None else self.measured.layers
        return Passes(self.series, body, spline_of(self.study), flows, layers)

    def undisturbed(self, interval: float = 0.0) -> list[Series]:
        """Return the series without what near the wall, or after a mistake, is no free motion.

        Left out as well are intervals with a corner within half a side of the wall, and those next
        to a gap: a sample or a frame that is missing may be a mistake of its own. The samples are
        about an interval [s] apart.
        """
        outline, block = outline_of(self.study.tank.to_arena()), self.study.block
        found = []
        for one in self.series:
            corners = None if self.angle == "none" else one.angle
            left_out = one.excluded != 0
            left_out |= wall_intervals(
                one.time, one.x, one.y, corners,
                outline=outline, block=block, margin=0.5 * block.side_m,
            )  # fmt: skip
            # An interval of 1.5 usual ones lacks a frame.
            gaps = np.flatnonzero(np.diff(one.time) > 1.5 * float(np.median(np.diff(one.time)))) + 1
            for later in range(FILTER.settling_samples + 1):
                left_out[np.minimum(gaps + later, one.time.size - 1)] = True
            found.append(replace(one, excluded=left_out.astype(np.uint8)).thinned(interval))
        return found

    def with_angle(self, angle: str) -> PreparedRecordings:
        """Return the same with another use of the orientations."""
        series = series_of(self.parts, self.study, angle, self.places)
        return replace(self, series=series, angle=angle)

    @property
    def facts(self) -> dict[str, Any]:
        """Facts of a fit on its recordings."""
        many = self.recordings
        unsettled = stretches_unsettled(self.series)
        return {
            **({"stretches_unsettled": unsettled} if unsettled else {}),
            "wall_share": self.wall_share,
            "angle": self.angle if self.study.block.body().symmetry else NO_HEADING,
            "samples": self.samples,
            "outliers": self.outliers,
            # Left out when the recordings were read: too far away for `max_speed`.
            "jumps_removed": sum(_jumps_removed(one, self.body) for one in many),
            **{f"added_{name}": value for name, value in self.added._asdict().items() if value},
            "dropped_frames": sum(one.frames for one in self.dropped),
            "dropped_places": "; ".join(
                prefix_of(recording) + places_of(one)
                for recording, one in zip(many, self.dropped, strict=True)
                if one.frames
            ),
            "intervals_usable": usable_intervals(self.series),
            "duration_s": self.duration,
            "recordings": len(self.tracks),
            "source": ", ".join(str(one.attrs.get("source", "")) for one in many),
            "simulated_recording": (
                "yes" if any(one.attrs.get("simulated") == "yes" for one in many) else "no"
            ),
        }


def prepare(
    many: Sequence[xr.Dataset],
    study: Study,
    angle: AngleUse | None,
    body: str | None,
    flow: xr.Dataset | None = None,
) -> PreparedRecordings:
    """Return recordings ready for the filter; refuse what cannot be fitted."""
    many = one_body_each(many, study)
    sources = tuple(str(one.attrs.get("source", "")) for one in many)
    measured = None
    # The cheap refusals come first: memory and size need no track to be read.
    require_memory(sum(one.sizes["time"] for one in many))
    intervals = intervals_of(study)
    require_size(len(intervals.labels), 2 * spline_of(study).size)
    wanted = study.fit.angle if angle is None else angle
    tracks, parts, places = [], [], []
    raws: list[Track] = []
    outliers, dropped, added = 0, list[DroppedFrames](), AddedNoise(0.0, 0.0)
    for index, recording in enumerate(many):
        seen, where = body_track(recording, body), prefix_of(recording)
        track = without_outliers(seen)
        outliers += seen.time.size - track.time.size
        require_length(track, study, where=where)
        require_travel(track, study, where=str(recording.attrs.get("source", "")))
        # Smoothing is looked for in the track as recorded: gaps would cut its spectrum.
        raws.append(track)
        dropped.append(find_dropped_frames(track, recording["time"].values))
        # A body with a heading is fitted no better with it where the orientation is not used.
        if not study.block.body().symmetry or (wanted != "none" and track.turns):
            track, more = with_least_noise(track, side=study.block.side_m, number=index)
            added = AddedNoise(*map(max, added, more))
        track = with_gaps(track, dropped[-1])
        cut = cut_track(track, intervals, fewest=LIMIT.fewest_samples, where=where)
        for number, part in enumerate(cut):
            if len(cut) > 1:
                require_travel(part, study, where=f"{where}{intervals.describe(number)}")
        tracks.append(track)
        parts += cut
        places += [(flow, index) for flow in intervals.flows]
    if flow is not None:
        lasts = max(float(one.time[-1] - one.time[0]) for one in tracks)
        measured = measured_flow(flow, study, spline_of(study), sources=sources, duration=lasts)
        if measured.layers > 1 and len(many) > 1:
            raise InputError(
                "a measured flow that changes in time is on the clock of one recording: fit the "
                "recordings one by one"
            )
    # One use of the angle for all recordings, as they share the noise of the angle.
    used_angle = use_angle(many, tracks, study, wanted)
    series = series_of(parts, study, used_angle, places)
    # A tank that was fitted to the positions touches them: say so before the wall share does.
    arena = read_arena(str(many[0].attrs.get("arena", "{}")))
    if is_fitted(many[0]) and arena.get("diameter_m") == study.tank.diameter_m:
        require_own_arena(series, study, where=prefix_of(many[0]))
    require_usable(series, study)
    # Each flow has its own coefficients, so each needs enough intervals.
    for number in range(0 if intervals.steady else len(intervals.labels)):
        in_flow = [one for one in series if one.flow == number]
        require_usable(in_flow, study, where=f"{intervals.describe_flow(number)}: ")
    if study.fit.camera == "auto":
        for raw, recording in zip(raws, many, strict=True):
            require_raw(raw, where=prefix_of(recording))
    return PreparedRecordings(
        many, study, body, tracks, parts, places, intervals, series, used_angle, dropped, outliers,
        added, measured,
    )  # fmt: skip


def describe_measured(flow: xr.Dataset, study: Study) -> str:
    """Return what a fit takes from a measured flow, in words.

    Parameters
    ----------
    flow : xarray.Dataset
        A `flow_field`.
    study : Study
        Tank, block and the section [fit].

    Returns
    -------
    str
        Source, number of vectors, their errors and where those are from.

    Raises
    ------
    InputError
        When the flow is no measurement of the water in the tank.

    Examples
    --------
    >>> import driftwalk as dw
    >>> dw.likelihood.describe_measured(dw.tank30_flow(), dw.Study())[:23]
    'flow_true.csv: 1976 vec'
    """
    return measured_flow(flow, study, spline_of(study)).sentence


def _jumps_removed(recording: xr.Dataset, body: str | None) -> int:
    """Return how many samples of a body the reading of its recording left out as jumps."""
    found = parse_json(str(recording.attrs.get("counts", "{}")))
    # A file may hold counts that `driftwalk.record` did not write.
    for key in ("per_body", str(recording["body"].values[0]) if body is None else body):
        found = found.get(key) if isinstance(found, dict) else None
    number = found.get("jumps_removed") if isinstance(found, dict) else None
    return number if isinstance(number, int) else 0


NO_HEADING = "no heading"
"""Use of the angle in a stored fit of a disc."""


def use_angle(
    many: Sequence[xr.Dataset], tracks: Sequence[Track], study: Study, wanted: str
) -> str:
    """Return how orientations are used: "state", "given" or "none"."""
    if not study.block.body().symmetry:
        if wanted in ("state", "given"):
            raise InputError(
                f"a disc has no heading: leave out {argument_text('angle', wanted)}; its drag is "
                "the same at every angle, and the recorded one is not used"
            )
        return "none"
    if wanted not in ("auto", "state", "given", "none"):
        raise InputError(f"angle must be 'auto', 'state', 'given' or 'none', got {wanted!r}")
    shares = [float(np.isfinite(track.theta).mean()) if track.turns else 0.0 for track in tracks]
    seen = min(shares)
    if wanted in ("state", "given") and seen == 0.0:
        where = prefix_of(many[shares.index(seen)])
        raise InputError(
            f"{where}the recording has no orientations, or the same in every row: leave out "
            f"{argument_text('angle', wanted)}, or read the column that holds them"
        )
    if wanted == "auto":
        return "state" if seen >= ORIENTED_SHARE else "none"
    return wanted


def spline_of(study: Study) -> Spline:
    """Return the spline of the flow over the tank of a study."""
    side = study.block.side_m
    spacing = study.fit.spacing_m(side_m=side, widest_m=max(study.tank.extent_m))
    return lay_spline(outline_of(study.tank.to_arena()), side=side, spacing=spacing)


@dataclass(frozen=True, eq=False)
class Estimate:
    """A fit, ready to run its filter at what it found."""

    study: Study
    passes: Passes
    point: Point
    weights: Weights
    tracks: Sequence[Track]
    """Sources of the series of the passes: the recordings, cut at the switching times."""
    prior: Prior


def estimate_of(fit: xr.Dataset, recordings: Sequence[xr.Dataset], *, body: str | None) -> Estimate:
    """Return what a fit found, with the recordings it was fitted to."""
    from driftwalk.model import apply_overrides, parse_study

    fit = require_fit(fit)
    study = apply_overrides(parse_study(fit.attrs["study"]), fitted_law(fit))
    ready = prepare(recordings, study, fit.attrs["angle"], body, stored_flow(fit))
    if ready.samples != int(fit["samples"]):
        raise InputError(
            f"the recordings have {ready.samples} positions, the fit was made of "
            f"{int(fit['samples'])}: check it with the recordings that it was fitted to"
        )
    coefficients = stored_coefficients(fit)
    x, y = fit["spline_origin"].values
    spline = Spline(float(x), float(y), float(fit["spline_spacing"]), *coefficients.shape[:-3:-1])
    opened, fixed = stored_numbers(fit)
    noise = math.log(fitted_value(fit, "tracking_noise"))
    known = None if ready.measured is None else ready.measured.amplitudes
    logs = effective_logs(fit, study)
    point = Point(coefficients, *logs, noise, opened=opened, fixed=fixed, amplitudes=known)
    if ready.angle == "state":
        lever, turning = (
            math.log(fitted_value(fit, name)) for name in ("force_lever", "orientation_noise")
        )
        point = replace(point, log_lever=lever, log_angle_noise=turning)
    modes = float(fit["mode_weight"]) if point.layers > 1 else 1.0
    determined = float(fit["measured_flow_determined"]) if "measured_u" in fit else 0.0
    weights = Weights(float(fit["roughness_weight"]), float(fit["size_weight"]), determined, modes)
    passes = replace(ready.passes, spline=spline, layers=point.layers)
    prior = Prior(passes, ready.measured)
    return Estimate(study, passes, point, weights, ready.parts, prior)
