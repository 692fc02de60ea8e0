"""The likelihood fit: flow, drag, stochastic force and tracking noise, together."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from driftwalk.conditions import jump_warnings, unstated_warning
from driftwalk.core.processors import one_blas_thread
from driftwalk.core.run_stages import Course, share_of_search, tell_nobody
from driftwalk.flow.arena import outline_of
from driftwalk.likelihood.angle_consistency import angle_given_facts
from driftwalk.likelihood.excerpt import pieces
from driftwalk.likelihood.filter_pass import Passes, Point
from driftwalk.likelihood.interval_inflation import with_mended_frames
from driftwalk.likelihood.law.assumptions import Assumptions, assumptions_of
from driftwalk.likelihood.law.facts import law_facts, side_slopes, stated_drag
from driftwalk.likelihood.law.found import LawFound
from driftwalk.likelihood.law.modes import TRIAL_PASSES
from driftwalk.likelihood.law.search import LawSearch
from driftwalk.likelihood.newton import Passed, Prior, Tell, work_of_pass
from driftwalk.likelihood.ready import (
    AngleUse,
    Ready,
    as_list,
    body_of,
    is_simulated,
    prepare,
    series_of,
    spline_of,
    usable_intervals,
)
from driftwalk.likelihood.reml import Restricted, restricted_drag
from driftwalk.likelihood.result import (
    build_fit,
    open_where_undetermined,
    parameter_covariance,
    parameter_facts,
    visited_shares,
    whiteness_of,
)
from driftwalk.likelihood.solution import BREAKDOWN, require_noise_below_motion, solved
from driftwalk.likelihood.start import first_point, first_weights
from driftwalk.likelihood.tracker_errors.mirrored import spin_correlation
from driftwalk.likelihood.warnings import precision_facts, warnings_of
from driftwalk.schema import Track
from driftwalk.schema.answers.facts import texts
from driftwalk.schema.check import described

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

SEARCH: Final = "likelihood"
RESTRICTED: Final = "drag"
ANGLE_GIVEN: Final = "angle as given"
PASSES_FROM_AFAR: Final = 9.0
"""Passes of the filter that a search usually takes, on the bundled recording and parts of it: from
afar,"""
PASSES_OF_PIECES: Final = 7.0
"""of pieces of a long recording first,"""
PASSES_FROM_PIECES: Final = 4.0
"""and then of all of it."""
PASSES_RESTRICTED: Final = 2.0
"""Passes of a search that take as long as the restricted likelihood,"""
PASSES_ANGLE_GIVEN: Final = 3.0
"""and as the fit with the angle as given."""


@one_blas_thread()
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
    with the drag of the model, and the fit chooses the parameters that make its errors most likely.
    C_d is the minimum of the restricted likelihood, which allows for the flow being estimated along
    with it. See docs/explanation/likelihood.md.

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
        Called with the thousandths of the work that are done, 1000, and the present task.

    Returns
    -------
    xarray.Dataset
        A `fit`; `fitted_flow` makes a flow field of it. The answer stands in ``estimate``
        (parameter: drag_coefficient, force_std, force_noise_intensity, tracking_noise) with
        ``unit``, ``interval`` (parameter, bound) and ``warning``; besides there are
        ``force_interval``, ``wall_share``, ``converged`` and the check of the innovations
        (``chi_squared_per_dof``, ``autocorrelation``).

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
    >>> round(float(fit["estimate"].sel(parameter="drag_coefficient")), 2)  # doctest: +SKIP
    0.39
    """
    from driftwalk.model import Study

    chosen = study if study is not None else Study()
    many = as_list(recordings)
    ready = prepare(many, chosen, angle, body)
    series, used_angle, intervals = ready.series, ready.angle, ready.intervals
    outline = outline_of(chosen.tank.to_arena())
    spline = spline_of(chosen, outline)
    flows = len(intervals.labels)
    passes = Passes(series, body_of(chosen, used_angle), spline, flows)
    start = _start(passes, ready, chosen)
    assumptions = assumptions_of(chosen, used_angle, recordings=len(ready.tracks), flows=flows)
    course = Course(tell or tell_nobody, _usual_parts(passes, used_angle))
    law, restricted = _search(passes, start, ready, assumptions, chosen, course)
    mode = law.mode
    with solved(ready.wall_share):
        innovations = passes.innovations(restricted.point)
    whiteness = whiteness_of(
        [
            (white, used & one.settled)
            for (white, used), one in zip(innovations, series, strict=True)
        ]
    )
    facts_given: dict[str, Any] = {}
    if used_angle == "state":
        course.begin(ANGLE_GIVEN)
        given = series_of(ready.parts, chosen, outline, "given", ready.places)
        facts_given = angle_given_facts(
            Passes(given, body_of(chosen, "given"), spline, flows), mode, restricted, chosen
        )
    duration = sum(float(one.time[-1] - one.time[0]) for one in series)
    mended = ready.dropped_frames / max(ready.samples, 1)
    with solved(ready.wall_share):
        covariance = with_mended_frames(parameter_covariance(mode, restricted), mended)
        stated = open_where_undetermined(covariance, mode, restricted)
        slopes = side_slopes(passes, law, restricted, chosen)
        parameters = parameter_facts(restricted.point, stated, chosen, by_side=slopes)
    facts: dict[str, Any] = {
        **parameters,
        "maximum_likelihood_drag_coefficient": stated_drag(mode.point, chosen),
        **precision_facts(math.inf if mode.lost else math.sqrt(covariance[0, 0]), duration, chosen),
        **law_facts(law, assumptions),
        **_turning(start, passes),
        "wetted_depth_m": chosen.wetted_depth_m,
        "wall_share": ready.wall_share,
        "angle": used_angle,
        **facts_given,
        "restricted": "yes" if restricted.has_minimum else "no",
        "samples": ready.samples,
        "mistakes": ready.mistakes,
        "jumps_removed": ready.jumps_removed,
        "dropped_frames": ready.dropped_frames,
        "dropped_places": ready.dropped_places,
        "samples_used": mode.used,
        "intervals_usable": usable_intervals(series),
        "duration_s": duration,
        "recordings": len(ready.tracks),
        **whiteness._asdict(),
        "iterations": mode.iterations,
        "converged": "yes" if mode.converged else "no",
        "search_left": mode.left if mode.lost else 0.0,
        "roughness_weight": mode.weights.roughness,
        "size_weight": mode.weights.size,
        "source": ", ".join(str(one.attrs.get("source", "")) for one in many),
        "simulated_recording": "yes" if any(is_simulated(one) for one in many) else "no",
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
        law=law,
        facts=facts,
    )
    shares = visited_shares(fit)
    unstated = unstated_warning(chosen, about="block")
    warnings = [] if unstated is None else [unstated]
    warnings += [
        sentence
        for recording, track in zip(many, ready.tracks, strict=True)
        for sentence in jump_warnings(recording, body, track=track)
    ]
    warnings += warnings_of(facts, whiteness, shares, intervals, side_m=chosen.block.side_m)
    return described(
        fit.assign(visited_share=((), min(shares))).assign_coords(
            warning=("warning", texts(warnings))
        )
    )


def _turning(start: Point, passes: Passes) -> dict[str, float]:
    """Return how the block's spin goes with the water's, where orientations and one flow are."""
    if passes.body.orientation == "none" or start.coefficients.ndim > 3:
        return {}
    found = spin_correlation(start.coefficients, passes.spline, passes.series)
    return {"spin_correlation": found}


def check_fit(
    recordings: xr.Dataset | Sequence[xr.Dataset],
    study: Study | None = None,
    *,
    angle: AngleUse | None = None,
    body: str | None = None,
) -> None:
    """Refuse recordings that `fit_motion` would refuse; takes almost no time.

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
    >>> dw.likelihood.check_fit(dw.tank30_recording())
    """
    from driftwalk.model import Study

    prepare(as_list(recordings), study if study is not None else Study(), angle, body)


def _usual_search(passes: Passes) -> float:
    """Return the work of a search that ends where most do, in samples."""
    few = pieces(passes)
    whole = work_of_pass(passes)
    if few is None:
        return (PASSES_FROM_AFAR + TRIAL_PASSES) * whole
    near = PASSES_OF_PIECES * work_of_pass(replace(passes, series=few))
    return near + (PASSES_FROM_PIECES + TRIAL_PASSES) * whole


def _usual_parts(passes: Passes, angle: str) -> dict[str, float]:
    """Return the work of each stage of a fit, in samples."""
    whole = work_of_pass(passes)
    return {
        SEARCH: _usual_search(passes),
        RESTRICTED: PASSES_RESTRICTED * whole,
        **({ANGLE_GIVEN: PASSES_ANGLE_GIVEN * whole} if angle == "state" else {}),
    }


def _counted(course: Course, usual: float) -> Passed:
    """Return what hears of the work of the search, of which nobody knows how much there will be."""
    said, done = course.stage(SEARCH), 0.0

    def passed(work: float) -> None:
        nonlocal done
        done += work
        said(share_of_search(done / usual), 1)

    course.begin(SEARCH)
    return passed


def _longest_in(ready: Ready, flow: int) -> Track:
    """Return the longest part that is in a flow."""
    return max(
        (part for part, (one, _) in zip(ready.parts, ready.places, strict=True) if one == flow),
        key=lambda part: part.time.size,
    )


def _start(passes: Passes, ready: Ready, study: Study) -> Point:
    """Return where the search begins."""
    return first_point(
        ready.tracks,
        study,
        passes.spline,
        angle=passes.body.orientation,
        in_flows=[_longest_in(ready, flow) for flow in range(passes.flows)],
    )


def _search(
    passes: Passes,
    start: Point,
    ready: Ready,
    assumptions: Assumptions,
    study: Study,
    course: Course,
) -> tuple[LawFound, Restricted]:
    """Return the law with the maximum of its likelihood, and that of the restricted one."""
    prior = Prior(passes)
    weights = first_weights(ready.tracks, passes.spline)
    with solved(ready.wall_share):
        passed = _counted(course, _usual_search(passes))
        law = LawSearch(passes, prior, assumptions, study.fit.iterations, passed).find(
            start, weights
        )
        course.begin(RESTRICTED)
        try:
            restricted = restricted_drag(passes, law.mode, prior)
        except BREAKDOWN:
            # What was opened may have no restricted likelihood; the law without it has one.
            law = replace(law, mode=law.base)
            restricted = restricted_drag(passes, law.mode, prior)
        noise = math.exp(restricted.point.log_noise)
    require_noise_below_motion(noise, ready.tracks, ready.wall_share)
    return law, restricted
