"""The likelihood fit: flow, drag, stochastic force and tracking noise, together."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from driftwalk.conditions import jump_warnings, unstated_warning
from driftwalk.core.processors import one_blas_thread
from driftwalk.core.run_stages import Course, share_of_search, tell_nobody
from driftwalk.flow.arena import outline_of
from driftwalk.likelihood.angle_consistency import angle_given_facts, spin_correlation
from driftwalk.likelihood.filter.excerpt import pieces
from driftwalk.likelihood.filter.filter_pass import Passes
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.interval_inflation import (
    open_where_undetermined,
    parameter_covariance,
    parameter_facts,
    with_mended_frames,
)
from driftwalk.likelihood.law.assumptions import assumptions_of
from driftwalk.likelihood.law.facts import law_facts, side_slopes, stated_drag
from driftwalk.likelihood.law.forward_selection import LawResult
from driftwalk.likelihood.law.search import LawSearch
from driftwalk.likelihood.newton import WORK, ModeSearch, Passed, Tell, work_of_pass
from driftwalk.likelihood.preparation import (
    AngleUse,
    PreparedRecordings,
    as_list,
    body_of,
    is_simulated,
    prepare,
    series_of,
    spline_of,
    usable_intervals,
)
from driftwalk.likelihood.prior import Prior
from driftwalk.likelihood.reml import Restricted, restricted_drag
from driftwalk.likelihood.result import Whiteness, build_fit, visited_shares, whiteness_of
from driftwalk.likelihood.solution import BREAKDOWN, require_noise_below_motion, solved
from driftwalk.likelihood.start import first_point, first_weights
from driftwalk.likelihood.warnings import precision_facts, warnings_of
from driftwalk.schema.answers.facts import texts
from driftwalk.schema.check import described

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


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
    spline = spline_of(chosen, outline_of(chosen.tank.to_arena()))
    flows = len(ready.intervals.labels)
    passes = Passes(ready.series, body_of(chosen, ready.angle), spline, flows)
    start = _start(passes, ready, chosen)
    assumptions = assumptions_of(chosen, ready.angle, recordings=len(ready.tracks), flows=flows)
    course = Course(tell or tell_nobody, _usual_parts(passes, ready.angle))
    prior = Prior(passes)
    weights = first_weights(ready.tracks, spline)
    # The stages stay in one function: they share most of their variables.
    with solved(ready.wall_share):
        passed = _work_listener(course, _usual_search(passes))
        search = ModeSearch(passes, prior, chosen.fit.iterations, passed)
        law = LawSearch(search, assumptions).find(start, weights)
        course.begin("drag")
        try:
            restricted = restricted_drag(passes, law.mode, prior)
        except BREAKDOWN:
            # What was opened may have no restricted likelihood; the law without it has one.
            law = replace(law, mode=law.base)
            restricted = restricted_drag(passes, law.mode, prior)
        noise = math.exp(restricted.point.log_noise)
    require_noise_below_motion(noise, ready.tracks, ready.wall_share)
    with solved(ready.wall_share):
        innovations = passes.innovations(restricted.point)
    whiteness = whiteness_of(
        [
            (white, used & one.settled)
            for (white, used), one in zip(innovations, ready.series, strict=True)
        ]
    )
    consistency: dict[str, Any] = {}
    if ready.angle == "state":
        course.begin("angle as given")
        outline = outline_of(chosen.tank.to_arena())
        given = series_of(ready.parts, chosen, outline, "given", ready.places)
        passes_given = Passes(given, body_of(chosen, "given"), spline, flows)
        consistency = angle_given_facts(passes_given, law.mode, restricted, chosen)
    with solved(ready.wall_share):
        facts = _parameter_facts(passes, law, restricted, ready, chosen)
    facts = {
        **facts,
        **law_facts(law, assumptions),
        **_turning(start, passes),
        **consistency,
        **whiteness._asdict(),
        **_recording_facts(many, ready),
        **_search_facts(law, restricted),
        "wetted_depth_m": chosen.wetted_depth_m,
    }
    fit = build_fit(
        spline,
        law,
        restricted,
        ready.series,
        study=chosen,
        oriented=ready.angle != "none",
        intervals=ready.intervals,
        first=float(ready.tracks[0].time[0]),
        facts=facts,
    )
    shares = visited_shares(fit)
    warnings = _warnings(many, ready, facts, whiteness, shares, chosen, body)
    if law.left_out:
        beside = " and ".join(law.left_out)
        warnings.append(f"the search for {beside} has no solution and was left out")
    return described(
        fit.assign(visited_share=((), min(shares))).assign_coords(
            warning=("warning", texts(warnings))
        )
    )


def _parameter_facts(
    passes: Passes, law: LawResult, restricted: Restricted, ready: PreparedRecordings, study: Study
) -> dict[str, Any]:
    """Return the parameters with their intervals, and the precision of C_d."""
    mode = law.mode
    mended = ready.dropped_frames / max(ready.samples, 1)
    covariance = with_mended_frames(parameter_covariance(mode, restricted), mended)
    stated = open_where_undetermined(covariance, mode, restricted)
    slopes = side_slopes(passes, law, restricted, study)
    std = math.inf if mode.diverged else math.sqrt(covariance[0, 0])
    return {
        **parameter_facts(restricted.point, stated, study, by_side=slopes),
        "maximum_likelihood_drag_coefficient": stated_drag(mode.point, study),
        **precision_facts(std, ready.duration, study),
    }


def _recording_facts(many: Sequence[xr.Dataset], ready: PreparedRecordings) -> dict[str, Any]:
    """Return what stands in a fit of its recordings."""
    return {
        "wall_share": ready.wall_share,
        "angle": ready.angle,
        "samples": ready.samples,
        "mistakes": ready.mistakes,
        "jumps_removed": ready.jumps_removed,
        "dropped_frames": ready.dropped_frames,
        "dropped_places": ready.dropped_places,
        "intervals_usable": usable_intervals(ready.series),
        "duration_s": ready.duration,
        "recordings": len(ready.tracks),
        "source": ", ".join(str(one.attrs.get("source", "")) for one in many),
        "simulated_recording": "yes" if any(is_simulated(one) for one in many) else "no",
    }


def _search_facts(law: LawResult, restricted: Restricted) -> dict[str, Any]:
    """Return what stands in a fit of its search."""
    mode = law.mode
    return {
        "restricted": "yes" if restricted.has_minimum else "no",
        "samples_used": mode.used,
        "iterations": mode.iterations,
        "converged": "yes" if mode.converged else "no",
        "search_left": mode.left if mode.diverged else 0.0,
        "roughness_weight": mode.weights.roughness,
        "size_weight": mode.weights.size,
    }


def _warnings(
    many: Sequence[xr.Dataset],
    ready: PreparedRecordings,
    facts: Mapping[str, Any],
    whiteness: Whiteness,
    shares: Sequence[float],
    study: Study,
    body: str | None,
) -> list[str]:
    """Return the warnings of a fit, in sentences."""
    unstated = unstated_warning(study, about="block")
    jumps = [
        sentence
        for recording, track in zip(many, ready.tracks, strict=True)
        for sentence in jump_warnings(recording, body, track=track)
    ]
    side = study.block.side_m
    own = warnings_of(facts, whiteness, shares, ready.intervals, side_m=side)
    return [*([] if unstated is None else [unstated]), *jumps, *own]


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
        return (WORK.from_afar + WORK.score_tests) * whole
    near = WORK.of_pieces * work_of_pass(replace(passes, series=few))
    return near + (WORK.from_pieces + WORK.score_tests) * whole


def _usual_parts(passes: Passes, angle: str) -> dict[str, float]:
    """Return the work of each stage of a fit, in samples."""
    whole = work_of_pass(passes)
    return {
        "likelihood": _usual_search(passes),
        "drag": WORK.restricted * whole,
        **({"angle as given": WORK.angle_given * whole} if angle == "state" else {}),
    }


def _work_listener(course: Course, usual: float) -> Passed:
    """Return a listener to the work of the search, whose length is unknown beforehand."""
    said, done = course.stage("likelihood"), 0.0

    def passed(work: float) -> None:
        nonlocal done
        done += work
        said(share_of_search(done / usual), 1)

    course.begin("likelihood")
    return passed


def _start(passes: Passes, ready: PreparedRecordings, study: Study) -> Point:
    """Return the point from which the search begins."""

    def longest(flow: int) -> Any:
        in_flow = zip(ready.parts, ready.places, strict=True)
        return max((part for part, (one, _) in in_flow if one == flow), key=lambda p: p.time.size)

    return first_point(
        ready.tracks,
        study,
        passes.spline,
        angle=passes.body.orientation,
        in_flows=[longest(flow) for flow in range(passes.flows)],
    )
