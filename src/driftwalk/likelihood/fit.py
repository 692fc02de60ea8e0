"""The likelihood fit: flow, drag, stochastic force and tracking noise, together."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.flow.arena import Outline, outline_of, read_arena
from driftwalk.likelihood.agreement import angle_given_facts
from driftwalk.likelihood.angle import no_angle, smooth_angle
from driftwalk.likelihood.filter_pass import LONGEST_GAP_S, Body, Passes, Series
from driftwalk.likelihood.intervals import Intervals, cut_track, intervals_of
from driftwalk.likelihood.newton import Mode, Prior, Tell, find_mode, silent
from driftwalk.likelihood.refuse import (
    FEWEST_SAMPLES,
    require_length,
    require_motion,
    require_own_arena,
    require_size,
    require_usable,
)
from driftwalk.likelihood.reml import Restricted, restricted_drag
from driftwalk.likelihood.result import (
    build_fit,
    parameter_attrs,
    parameter_covariance,
    visited_shares,
    whiteness_of,
)
from driftwalk.likelihood.solution import require_noise_below_motion, solved
from driftwalk.likelihood.spline import Spline, lay_spline
from driftwalk.likelihood.start import first_point, first_weights
from driftwalk.likelihood.wall import wall_intervals
from driftwalk.likelihood.warnings import precision_facts, warnings_of
from driftwalk.schema import Track, body_track

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

ORIENTED_SHARE = 0.5
"""Share of samples with an orientation from which on "auto" uses it."""

AngleUse = Literal["auto", "state", "given", "none"]


def fit_motion(
    recordings: xr.Dataset | Sequence[xr.Dataset],
    study: Study | None = None,
    *,
    angle: AngleUse | None = None,
    body: str | None = None,
    tell: Tell | None = None,
) -> xr.Dataset:
    """Fit flow, drag coefficient, stochastic force and tracking noise to a recording, together.

    Nothing is differentiated: a Kalman filter predicts each recorded pose from the earlier ones
    with the drag of the model, and the parameters are those that make its errors likely. C_d is the
    minimum of the restricted likelihood, which allows for the flow being estimated along with it.
    See docs/explanation/likelihood.md.

    Parameters
    ----------
    recordings : xarray.Dataset or sequence of xarray.Dataset
        A `trajectory`, or several of the same block in the same tank and flow.
    study : Study, optional
        Block, tank, water, force interval and the section [fit]; default: the paper's. With
        switching times there each interval has a flow of its own, see `fitted_flow`.
    angle : {"auto", "state", "given", "none"}, optional
        How the recorded orientation is used; default: what the study says.
    body : str, optional
        The body, where a recording has several.
    tell : callable, optional
        Told how many steps are done, how many there are at most, and what is done.

    Returns
    -------
    xarray.Dataset
        A `fit`; `fitted_flow` makes a flow field of it. The answer stands in its attributes:
        ``drag_coefficient``, ``force_std_N``, ``force_noise_intensity_N2_s``, ``tracking_noise_m``,
        each with ``_interval``, ``force_interval_s``, ``wall_share``, ``warnings``, and the check
        of the innovations (``chi_squared_per_dof``, ``autocorrelation``).

    Raises
    ------
    InputError
        When a recording is too short or does not move, several bodies are there and none named, the
        block is at the wall all the time, angles are asked for where there are none, or switching
        times are outside a recording or too near to each other.

    Examples
    --------
    >>> import driftwalk as dw
    >>> fit = dw.fit_motion(dw.tank30_recording())  # doctest: +SKIP
    >>> round(fit.attrs["drag_coefficient"], 2)  # doctest: +SKIP
    0.39
    """
    from driftwalk.model import Study

    chosen = study if study is not None else Study()
    many = _as_list(recordings)
    ready = _prepare(many, chosen, angle, body)
    series, used_angle, intervals = ready.series, ready.angle, ready.intervals
    outline = outline_of(chosen.tank.to_arena())
    spline = _spline(chosen, outline)
    flows = len(intervals.labels)
    passes = Passes(series, _body(chosen, used_angle), spline, flows)
    mode, restricted = _search(passes, ready, chosen, tell or silent)
    with solved():
        innovations = passes.innovations(restricted.point)
    whiteness = whiteness_of(innovations)
    facts_given: dict[str, Any] = {}
    if used_angle == "state":
        given = _series(ready.parts, chosen, outline, "given", ready.places)
        facts_given = angle_given_facts(
            Passes(given, _body(chosen, "given"), spline, flows), mode, restricted, chosen
        )
    duration = sum(float(one.time[-1] - one.time[0]) for one in series)
    covariance = parameter_covariance(mode, restricted)
    attrs: dict[str, Any] = {
        **parameter_attrs(restricted.point, covariance, chosen),
        "maximum_likelihood_drag_coefficient": math.exp(mode.point.log_drag),
        **precision_facts(math.sqrt(covariance[0, 0]), duration, chosen),
        "wetted_depth_m": chosen.wetted_depth_m,
        "wall_share": ready.wall_share,
        "angle": used_angle,
        **facts_given,
        "restricted": "yes" if restricted.has_minimum else "no",
        "samples": sum(one.time.size for one in series),
        "samples_used": mode.used,
        "intervals_usable": _usable(series),
        "duration_s": duration,
        "recordings": len(ready.tracks),
        **whiteness._asdict(),
        "iterations": mode.iterations,
        "converged": "yes" if mode.converged else "no",
        "roughness_weight": mode.weights.roughness,
        "size_weight": mode.weights.size,
        "source": ", ".join(str(one.attrs.get("source", "")) for one in many),
        "simulated_recording": "yes" if any(_simulated(one) for one in many) else "no",
        "study": chosen.to_toml(),
    }
    fit = build_fit(
        spline,
        mode,
        restricted,
        series,
        study=chosen,
        oriented=used_angle != "none",
        intervals=intervals,
        first=float(ready.tracks[0].time[0]),
        attrs=attrs,
    )
    shares = visited_shares(fit)
    fit.attrs["visited_share"] = min(shares)
    warnings = warnings_of(fit.attrs, whiteness, shares, intervals, side_m=chosen.block.side_m)
    fit.attrs["warnings"] = json.dumps(warnings)
    return fit


def check_fit(
    recordings: xr.Dataset | Sequence[xr.Dataset],
    study: Study | None = None,
    *,
    angle: AngleUse | None = None,
    body: str | None = None,
) -> None:
    """Refuse recordings that `fit_motion` would refuse; takes no time worth speaking of.

    Parameters
    ----------
    recordings, study, angle, body
        As of `fit_motion`.

    Raises
    ------
    InputError
        When they cannot be fitted.

    Examples
    --------
    >>> import driftwalk as dw
    >>> dw.check_fit(dw.tank30_recording())
    """
    from driftwalk.model import Study

    _prepare(_as_list(recordings), study if study is not None else Study(), angle, body)


def _as_list(recordings: xr.Dataset | Sequence[xr.Dataset]) -> list[xr.Dataset]:
    import xarray as xr

    many = [recordings] if isinstance(recordings, xr.Dataset) else list(recordings)
    if not many:
        raise InputError("no recording given: fit_motion needs one at least")
    return many


class _Ready(NamedTuple):
    """Recordings, ready for the filter."""

    tracks: list[Track]
    """One for each recording."""
    parts: list[Track]
    """The same, cut at the switching times."""
    places: list[tuple[int, int]]
    """Of each part: its flow and its recording."""
    intervals: Intervals
    series: list[Series]
    """The parts as the filter takes them."""
    angle: str
    """How orientations are used."""
    wall_share: float


def _prepare(
    many: Sequence[xr.Dataset], study: Study, angle: AngleUse | None, body: str | None
) -> _Ready:
    intervals = intervals_of(study)
    outline = outline_of(study.tank.to_arena())
    require_size(len(intervals.labels), 2 * _spline(study, outline).size)
    tracks, parts, places = [], [], []
    for index, recording in enumerate(many):
        track, where = body_track(recording, body), _name_of(recording)
        require_length(track, study, where=where)
        require_motion(track, study, where=where)
        cut = cut_track(track, intervals, fewest=FEWEST_SAMPLES, where=where)
        for number, part in enumerate(cut):
            if len(cut) > 1:
                require_motion(part, study, where=f"{where}{intervals.describe(number)}: ")
        tracks.append(track)
        parts += cut
        places += [(flow, index) for flow in intervals.flows]
    used_angle = _use_angle(many, tracks, study.fit.angle if angle is None else angle)
    series = _series(parts, study, outline, used_angle, places)
    count, near_wall = (
        sum(one.time.size - 1 for one in series),
        sum(one.near_wall for one in series),
    )
    if _is_fitted_arena(many[0], study):
        require_own_arena(study, intervals=count, near_wall=near_wall, where=_name_of(many[0]))
    _require_usable(series, study)
    for flow in range(0 if intervals.steady else len(intervals.labels)):
        _require_usable(
            [one for one in series if one.flow == flow],
            study,
            where=f"{intervals.describe_flow(flow)}: ",
        )
    return _Ready(tracks, parts, places, intervals, series, used_angle, near_wall / count)


def _name_of(recording: xr.Dataset) -> str:
    """Return what a message on a recording begins with."""
    name = recording.attrs.get("source", "")
    return f"{name}: " if name else ""


def _is_fitted_arena(recording: xr.Dataset, study: Study) -> bool:
    """Whether the tank is the circle that was fitted to the positions (``arena="fit"``)."""
    arena, found = (
        read_arena(str(recording.attrs.get(key, "{}"))) for key in ("arena", "arena_found")
    )
    # Where the size is given and only the centre is fitted, no radius is found.
    return "radius_is" in found and arena.get("diameter_m") == study.tank.diameter_m


def _simulated(recording: xr.Dataset) -> bool:
    return str(recording.attrs.get("simulated", "no")) == "yes"


def _use_angle(many: Sequence[xr.Dataset], tracks: Sequence[Track], wanted: str) -> str:
    """Return how orientations are used: "state", "given" or "none"."""
    if wanted not in ("auto", "state", "given", "none"):
        raise InputError(f"angle must be 'auto', 'state', 'given' or 'none', got {wanted!r}")
    shares = [_oriented_share(track) for track in tracks]
    seen = min(shares)
    if wanted in ("state", "given") and seen == 0.0:
        where = _name_of(many[shares.index(seen)])
        raise InputError(
            f"{where}the recording has no orientations, or the same in every row: leave out "
            f"angle = {wanted!r} (--angle), or read the column that holds them"
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


def _series(
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
    for number, track in enumerate(tracks):
        flow, recording = (0, number) if places is None else places[number]
        if not found or found[-1].recording != recording:
            first = float(track.time[0])
        time = track.time - first
        smooth = no_angle(time.size)
        corners = None
        if used_angle != "none":
            smooth = smooth_angle(time, track.theta, longest_gap=LONGEST_GAP_S)
            corners = np.where(np.isfinite(track.theta), track.theta, smooth.theta)
        wall = wall_intervals(
            time,
            track.x,
            track.y,
            corners,
            outline=outline,
            side=study.block.side_m,
            longest_gap=LONGEST_GAP_S,
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
            )
        )
    return found


def _require_usable(series: Sequence[Series], study: Study, *, where: str = "") -> None:
    require_usable(
        _usable(series),
        intervals=sum(one.time.size - 1 for one in series),
        near_wall=sum(one.near_wall for one in series),
        tank=study.tank.describe(),
        longest_gap=LONGEST_GAP_S,
        where=where,
    )


def _usable(series: Sequence[Series]) -> int:
    """Return the number of intervals that are not left out and not longer than a gap."""
    return sum(
        int(np.count_nonzero((one.excluded[1:] == 0) & (np.diff(one.time) <= LONGEST_GAP_S)))
        for one in series
    )


def _spline(study: Study, outline: Outline) -> Spline:
    return lay_spline(
        outline,
        side=study.block.side_m,
        spacing=study.fit.spacing_m(side_m=study.block.side_m, widest_m=max(study.tank.extent_m)),
    )


def _body(study: Study, used_angle: str) -> Body:
    return Body(
        side=study.block.side_m,
        mass=study.block.mass_kg,
        depth=study.wetted_depth_m,
        strips=study.block.strips_per_face,
        water_density=study.water.density_kg_m3,
        orientation=used_angle,
    )


def _longest_in(ready: _Ready, flow: int) -> Track:
    """Return the longest part that is in a flow."""
    return max(
        (part for part, (one, _) in zip(ready.parts, ready.places, strict=True) if one == flow),
        key=lambda part: part.time.size,
    )


def _search(passes: Passes, ready: _Ready, study: Study, tell: Tell) -> tuple[Mode, Restricted]:
    """Return the maximum of the likelihood and that of the restricted one."""
    prior = Prior(passes)
    start = first_point(
        ready.tracks,
        study,
        passes.spline,
        angle=passes.body.orientation,
        in_flows=[_longest_in(ready, flow) for flow in range(passes.flows)],
    )
    weights = first_weights(ready.tracks, passes.spline)
    with solved():
        mode = find_mode(passes, start, weights, prior, iterations=study.fit.iterations, tell=tell)
        tell(mode.iterations, mode.iterations, "drag")
        restricted = restricted_drag(passes, mode, prior)
        noise = math.exp(restricted.point.log_noise)
    require_noise_below_motion(noise, ready.tracks)
    return mode, restricted
