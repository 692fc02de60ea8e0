"""The likelihood fit: flow, drag, stochastic force and tracking noise, together."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from driftwalk.calibrate.fit_agreement import NOTABLE_DISAGREEMENT, angle_given_facts
from driftwalk.calibrate.fit_angle import no_angle, smooth_angle
from driftwalk.calibrate.fit_newton import Mode, Prior, Tell, find_mode, silent
from driftwalk.calibrate.fit_pass import LONGEST_GAP_S, Body, Passes, Series
from driftwalk.calibrate.fit_reml import Restricted, restricted_drag
from driftwalk.calibrate.fit_result import (
    Whiteness,
    build_fit,
    parameter_attrs,
    parameter_covariance,
    whiteness_of,
)
from driftwalk.calibrate.fit_spline import lay_spline
from driftwalk.calibrate.fit_start import first_point, first_weights
from driftwalk.calibrate.fit_wall import wall_intervals
from driftwalk.core.errors import InputError
from driftwalk.flow.arena import Outline, outline_of
from driftwalk.schema import Track, body_track

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

FEWEST_SAMPLES = 100
MOST_WALL_SHARE = 0.3
"""Share of intervals at the wall above which C_d means little."""
ORIENTED_SHARE = 0.5
"""Share of samples with an orientation from which on "auto" uses it."""
NOTABLE_AUTOCORRELATION = 0.05
NOTABLE_STDS = 4.0

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

    Nothing is differentiated: a Kalman filter predicts each recorded position from the earlier ones
    with the drag of the model, and the parameters are those that make its errors likely. C_d is the
    minimum of the restricted likelihood, which allows for the flow being estimated along with it.
    See docs/explanation/likelihood.md.

    Parameters
    ----------
    recordings : xarray.Dataset or sequence of xarray.Dataset
        A `trajectory`, or several of the same block in the same tank and flow.
    study : Study, optional
        Block, tank, water, force interval and the section [fit]; default: the paper's.
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
        block is at the wall all the time, or angles are asked for where there are none.

    Examples
    --------
    >>> import driftwalk as dw
    >>> fit = dw.fit_motion(dw.tank30_recording())  # doctest: +SKIP
    >>> round(fit.attrs["drag_coefficient"], 2)  # doctest: +SKIP
    0.37
    """
    from driftwalk.model import Study

    chosen = study if study is not None else Study()
    many = _as_list(recordings)
    tracks, series, used_angle, wall_share = _prepare(many, chosen, angle, body)
    outline = outline_of(chosen.tank.to_arena())
    spline = lay_spline(
        outline,
        side=chosen.block.side_m,
        spacing=chosen.fit.spacing_m(
            side_m=chosen.block.side_m, widest_m=max(chosen.tank.extent_m)
        ),
    )
    passes = Passes(series, _body(chosen, used_angle), spline)
    mode, restricted = _search(passes, tracks, chosen, tell or silent)
    whiteness = whiteness_of(passes.innovations(restricted.point))
    facts_given: dict[str, Any] = {}
    if used_angle == "state":
        given, _ = _series(tracks, chosen, outline, "given")
        facts_given = angle_given_facts(
            Passes(given, _body(chosen, "given"), spline), mode, restricted, chosen
        )
    attrs: dict[str, Any] = {
        **parameter_attrs(restricted.point, parameter_covariance(mode, restricted), chosen),
        "maximum_likelihood_drag_coefficient": math.exp(mode.point.log_drag),
        "wetted_depth_m": chosen.wetted_depth_m,
        "wall_share": wall_share,
        "angle": used_angle,
        **facts_given,
        "restricted": "yes" if restricted.has_minimum else "no",
        "samples": sum(one.time.size for one in series),
        "samples_used": mode.used,
        "duration_s": sum(float(one.time[-1] - one.time[0]) for one in series),
        "recordings": len(series),
        **whiteness._asdict(),
        "iterations": mode.iterations,
        "converged": "yes" if mode.converged else "no",
        "roughness_weight": mode.weights.roughness,
        "size_weight": mode.weights.size,
        "source": ", ".join(str(one.attrs.get("source", "")) for one in many),
        "simulated_recording": "yes" if any(_simulated(one) for one in many) else "no",
        "study": chosen.to_toml(),
    }
    attrs["warnings"] = json.dumps(_warnings(attrs, whiteness))
    return build_fit(
        spline, mode, restricted, series, study=chosen, oriented=used_angle != "none", attrs=attrs
    )


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


def _prepare(
    many: Sequence[xr.Dataset], study: Study, angle: AngleUse | None, body: str | None
) -> tuple[list[Track], list[Series], str, float]:
    """Return tracks, what the filter takes of them, how angles are used, and the wall share."""
    tracks = [_checked_track(recording, body) for recording in many]
    used_angle = _use_angle(tracks, study.fit.angle if angle is None else angle)
    outline = outline_of(study.tank.to_arena())
    series, wall_share = _series(tracks, study, outline, used_angle)
    return tracks, series, used_angle, wall_share


def _simulated(recording: xr.Dataset) -> bool:
    return str(recording.attrs.get("simulated", "no")) == "yes"


def _checked_track(recording: xr.Dataset, body: str | None) -> Track:
    track = body_track(recording, body)
    name = recording.attrs.get("source", "")
    where = f"{name}: " if name else ""
    if track.time.size < FEWEST_SAMPLES:
        raise InputError(
            f"{where}the recording has {track.time.size} positions of this body; the fit needs "
            f"{FEWEST_SAMPLES} at least, and half an hour to be of use"
        )
    if np.ptp(track.x) == 0.0 and np.ptp(track.y) == 0.0:
        raise InputError(f"{where}the body never moves: there is nothing to fit")
    return track


def _use_angle(tracks: Sequence[Track], wanted: str) -> str:
    """Return how orientations are used: "state", "given" or "none"."""
    if wanted not in ("auto", "state", "given", "none"):
        raise InputError(f"angle must be 'auto', 'state', 'given' or 'none', got {wanted!r}")
    seen = min(float(np.isfinite(track.theta).mean()) for track in tracks)
    if wanted in ("state", "given") and seen == 0.0:
        raise InputError(
            f"a recording has no orientations: leave out angle = {wanted!r} (--angle), or read the "
            "column that holds them"
        )
    if wanted == "auto":
        return "state" if seen >= ORIENTED_SHARE else "none"
    return wanted


def _series(
    tracks: Sequence[Track], study: Study, outline: Outline, used_angle: str
) -> tuple[list[Series], float]:
    """Return the tracks as the filter takes them, and the share of intervals at the wall."""
    found, near_wall, intervals, usable = [], 0, 0, 0
    for track in tracks:
        time = track.time - track.time[0]
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
        near_wall += int(wall.sum())
        intervals += time.size - 1
        excluded = wall | ~smooth.known
        usable += int(np.count_nonzero(~excluded[1:] & (np.diff(time) <= LONGEST_GAP_S)))
        found.append(
            Series(
                time,
                np.ascontiguousarray(track.x),
                np.ascontiguousarray(track.y),
                np.ascontiguousarray(track.theta) if used_angle == "state" else smooth.theta,
                smooth.omega,
                excluded.astype(np.uint8),
            )
        )
    if usable < FEWEST_SAMPLES:
        raise InputError(
            f"only {usable} of {intervals} intervals can be used, at least {FEWEST_SAMPLES} are "
            f"needed: {near_wall} are at the wall of the tank (a {study.tank.describe()}), the "
            f"others are longer than {LONGEST_GAP_S:g} s or have no orientation near; check "
            "the tank, or record for longer"
        )
    return found, near_wall / intervals


def _body(study: Study, used_angle: str) -> Body:
    return Body(
        side=study.block.side_m,
        mass=study.block.mass_kg,
        depth=study.wetted_depth_m,
        strips=study.block.strips_per_face,
        water_density=study.water.density_kg_m3,
        orientation=used_angle,
    )


def _search(
    passes: Passes, tracks: Sequence[Track], study: Study, tell: Tell
) -> tuple[Mode, Restricted]:
    """Return the maximum of the likelihood and that of the restricted one."""
    prior = Prior(passes)
    start = first_point(tracks, study, passes.spline, angle=passes.body.orientation)
    weights = first_weights(tracks, passes.spline)
    try:
        mode = find_mode(passes, start, weights, prior, iterations=study.fit.iterations, tell=tell)
        tell(mode.iterations, mode.iterations, "drag")
        return mode, restricted_drag(passes, mode, prior)
    except np.linalg.LinAlgError as error:
        raise InputError(
            "the fit has no solution for this recording: its motion does not follow the model at "
            f"all, or tank, block or units are wrong ({error})"
        ) from error


def _warnings(facts: dict[str, Any], whiteness: Whiteness) -> list[str]:
    """Return what the user has to know, in sentences."""
    found = []
    if facts["wall_share"] > MOST_WALL_SHARE:
        found.append(
            f"{facts['wall_share']:.0%} of the intervals are at the wall and were left out: C_d is "
            "not to be trusted above 30 %; record where the block keeps away from the wall"
        )
    if facts["converged"] == "no":
        found.append(
            f"the search has not come to its end in {facts['iterations']} steps ([fit] iterations)"
        )
    if facts["restricted"] == "no":
        found.append(
            "the restricted likelihood has no minimum: C_d is that of the plain one, likely too "
            "large, and the motion tells little of it or does not follow the model"
        )
    if facts["angle"] == "none":
        found.append(
            "no orientation was used: the drag is averaged over all orientations of the block"
        )
    apart = facts.get("angle_disagreement_std", 0.0)
    if apart > NOTABLE_DISAGREEMENT:
        found.append(
            f"with the angle as an input C_d is {facts['drag_coefficient_angle_given']:.3g}, "
            f"{apart:.1f} combined standard deviations away: the turning of the block and its "
            "motion do not agree on one drag law, and the intervals are too narrow"
        )
    off = abs(whiteness.autocorrelation)
    if off > max(NOTABLE_STDS * whiteness.autocorrelation_std, NOTABLE_AUTOCORRELATION):
        found.append(
            f"the errors of prediction are correlated ({whiteness.autocorrelation:+.2f} from one "
            "sample to the next): the motion has something that the model has not, and the "
            "intervals are too narrow"
        )
    return found
