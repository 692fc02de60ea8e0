"""The likelihood fit: flow, drag, stochastic force and tracking noise, together."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.conditions import jump_warnings, unstated_warning
from driftwalk.core.processors import one_blas_thread
from driftwalk.core.progress import StagedProgress, ignore_progress
from driftwalk.likelihood.angle_consistency import angle_given_facts, spin_correlation
from driftwalk.likelihood.check.criteria import agreement_criteria
from driftwalk.likelihood.check.measured import agreement_facts
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.interaction.glued import (
    GLUED,
    EarlierFit,
    earlier_prior,
    glued_start,
    glued_stirring,
    glued_study,
)
from driftwalk.likelihood.interaction.shared_stirring import shared_stirring
from driftwalk.likelihood.interval_inflation import (
    open_where_undetermined,
    parameter_covariance,
    parameter_facts,
    with_mended_frames,
)
from driftwalk.likelihood.law.candidate_laws import MODES
from driftwalk.likelihood.law.flow_modes import (
    find_flow_modes,
    modes_at,
    require_one_flow,
    with_layers,
)
from driftwalk.likelihood.law.force_law import Assumptions, assumptions_of, side_slopes, stated_drag
from driftwalk.likelihood.law.forward_selection import LawResult
from driftwalk.likelihood.law.search import LawSearch
from driftwalk.likelihood.law.shape_changes import shape_change, shape_facts
from driftwalk.likelihood.newton import (
    EXCERPT,
    FROM_ANOTHER,
    FROM_THINNED,
    Mode,
    ModeSearch,
    Tell,
    converged,
    require_mode,
    thinned,
    usual_work,
    work_listener,
)
from driftwalk.likelihood.preparation import (
    AngleUse,
    Estimate,
    PreparedRecordings,
    as_list,
    estimate_of,
    prepare,
)
from driftwalk.likelihood.prior import PRIOR, Weights
from driftwalk.likelihood.refuse import (
    BREAKDOWN,
    reason_of_no_solution,
    require_noise_below_motion,
    solved,
)
from driftwalk.likelihood.reml import Restricted, restricted_drag
from driftwalk.likelihood.result import build_fit, law_facts, visited_shares, whiteness_of
from driftwalk.likelihood.start import Starts, first_points, first_weights
from driftwalk.likelihood.warnings import precision_facts, warnings_of
from driftwalk.schema.answers.facts import texts
from driftwalk.schema.check import described
from driftwalk.schema.kinds.fit import BLOCK_NUMBERS

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


def fit_motion(
    recordings: xr.Dataset | Sequence[xr.Dataset],
    study: Study | None = None,
    *,
    angle: AngleUse | None = None,
    body: str | None = None,
    flow: xr.Dataset | None = None,
    earlier: EarlierFit | None = None,
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
        switching times there each interval has its own flow, see `fitted_flow`.
    angle : {"auto", "state", "given", "none"}, optional
        How the recorded orientation is used; default: what the study says.
    body : str, optional
        The body, where a recording has several; without one the study's ``fit.interaction`` fits
        all of them, and says over which length they share the stirring.
    flow : xarray.Dataset, optional
        A flow that was measured, a `flow_field` as `load_flow` returns it: its *measured* nodes,
        with their errors, become the prior of the fitted flow. Of a series that changes in time,
        time 0 is the recording's first sample; the fitted flow is its mean and up to five modes.
    earlier : EarlierFit, optional
        Of glued blocks, ``shape = "xx"``: a fit of one block in the same water, with its
        recordings. The fit then says how much drag the hidden faces feel, and over which length
        the stirring is shared.
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
        block is at the wall all the time, angles are asked for where there are none, switching
        times are outside a recording or too near to each other, or the flow is no measurement.

    Examples
    --------
    >>> import driftwalk as dw
    >>> fit = dw.fit_motion(dw.tank30_recording())  # doctest: +SKIP
    >>> round(float(fit["estimate"].sel(parameter="drag_coefficient")), 2)  # doctest: +SKIP
    0.39
    """
    from driftwalk.model import Study

    chosen = study or Study()
    if earlier is not None:
        chosen = glued_study(chosen, earlier.fit)
    # Not a decorator, which would be one frame more between a call and the kernel.
    with one_blas_thread():
        ready = prepare(as_list(recordings), chosen, angle, body, flow)
        before = (
            None if earlier is None else estimate_of(earlier.fit, earlier.recordings, body=None)
        )
        require_one_flow(ready, before)
        if before is not None:
            ready = replace(ready, earlier=earlier_prior(ready, before))
        passes, known = ready.passes, ready.earlier
        starts = first_points(ready) if before is None else glued_start(ready, before)
        assumptions = _assumptions(ready, before)
        usual = usual_work(passes, interaction=chosen.fit.interaction)
        staged = StagedProgress(tell or ignore_progress, usual)
        reason = reason_of_no_solution(ready.wall_share, ready.tracks, chosen)
        # The stages stay in one function: they share most of their variables.
        with solved(reason):
            passed = work_listener(staged, usual["likelihood"])
            search = ModeSearch(passes, ready.prior, chosen.fit.iterations, passed)
            wanted = chosen.fit.flow_modes
            weights = first_weights(ready.tracks, passes.spline) if known is None else known.weights
            modes, begin = find_flow_modes(search, starts.paper, weights, wanted), starts
            while True:
                if modes.start is not None:
                    point, weights = modes.start.point, modes.start.weights
                    search, begin = with_layers(search, point.layers), Starts(point, (point,))
                    of_modes = {name: point.opened[name] for name in MODES if name in point.opened}
                    assumptions = replace(assumptions, opened={**assumptions.opened, **of_modes})
                # Of a fast camera the law is searched on samples that are further apart.
                few = replace(search, passes=thinned(search.passes))
                laws = LawSearch(few, assumptions, partial(ready.undisturbed, EXCERPT.interval_s))
                law = laws.find(begin, weights)
                if few.passes is not search.passes:
                    whole = _of_all_samples(law, search)
                    if whole is None:
                        laws = LawSearch(search, assumptions, ready.undisturbed)
                        whole = laws.find(begin, weights)
                    law = whole
                if wanted == "none" or modes.start is not None:
                    break
                # Under the right law the line may stand out that did not under the paper's.
                shape = shape_change(laws.selection.scores, law.base)
                modes = modes_at(laws.search, law.base, shape, wanted)
                if modes.start is None:
                    break
            staged.begin("drag")
            law, restricted = _restricted(search, laws, law)
        require_noise_below_motion(math.exp(restricted.point.log_noise), ready.tracks, reason)
        with solved(reason):
            innovations = search.passes.innovations(restricted.point)
        turning = _turning_facts(ready, starts, search, law.mode, restricted, staged)
        with solved(reason):
            parameters = _parameter_facts(search, law.mode, restricted, ready)
            for alternative in law.alternatives:
                parameters = _with_alternative(parameters, search, alternative, ready)
            shape = shape_change(laws.selection.scores, law.mode)
            stirring = (
                shared_stirring(ready, restricted.point, staged)
                if before is None or earlier is None
                else glued_stirring(ready, law.mode, restricted.point, before, earlier)
            )
        facts = {
            **parameters,
            **law_facts(law, assumptions),
            **shape_facts(shape, law.tests),
            **({"flow_modes_unsettled": modes.unsettled} if modes.unsettled else {}),
            **turning,
            **stirring.facts,
            **whiteness_of(innovations)._asdict(),
            **ready.facts,
            **_search_facts(law, restricted),
            **_measured_flow_facts(ready, law.mode.weights, restricted.point),
            "wetted_depth_m": chosen.wetted_depth_m,
        }
        fit = build_fit(ready, law, restricted, facts)
        shares = visited_shares(fit)
        warnings = [
            *_recording_warnings(ready, body, stirring.warnings),
            *warnings_of(facts, shares, ready.intervals, block=chosen.block),
            *law.unsettled,
            *law.noted,
            *(one.sentence for one in agreement_criteria(facts) if one.failed),
            *(facts[one] for one in ("flow_modes_unsettled", "flow_shape_change") if one in facts),
        ]
        if law.left_out:
            names = " and ".join(law.left_out)
            warnings.append(f"the search for {names} has no solution and was left out")
        return described(
            fit.assign(visited_share=((), min(shares)), **stirring.variables).assign_coords(
                warning=("warning", texts(warnings))
            )
        )


def _recording_warnings(
    ready: PreparedRecordings, body: str | None, of_stirring: Sequence[str]
) -> Iterator[str]:
    """Yield what is not stated, what the blocks say of the stirring, and jumps of the tracker."""
    unstated = unstated_warning(ready.study, about="block")
    if unstated is not None:
        yield unstated
    yield from of_stirring
    for recording, track in zip(ready.recordings, ready.tracks, strict=True):
        yield from jump_warnings(recording, body, track=track)


def _restricted(
    search: ModeSearch, laws: LawSearch, law: LawResult
) -> tuple[LawResult, Restricted]:
    """Return the restricted likelihood, and the law with the mode that has one."""
    try:
        return law, restricted_drag(search, law.mode)
    except BREAKDOWN:
        # What was opened may have no restricted likelihood; the law without it has one.
        base = law.base
        if laws.search.passes is not search.passes:
            base = require_mode(search.find(base.point, base.weights, held=FROM_ANOTHER))
        return replace(law, mode=base), restricted_drag(search, base)


def _turning_facts(
    ready: PreparedRecordings,
    starts: Starts,
    search: ModeSearch,
    mode: Mode,
    restricted: Restricted,
    staged: StagedProgress,
) -> dict[str, Any]:
    """Return how the spin goes with the water's, and C_d with the orientation as an input."""
    facts: dict[str, Any] = {}
    if ready.angle != "none" and ready.intervals.steady:
        mean = starts.paper.mean_coefficients
        facts["spin_correlation"] = spin_correlation(mean, thinned(ready.passes))
    if ready.angle == "state":
        staged.begin("angle as given")
        facts |= angle_given_facts(ready, search, mode, restricted)
    return facts


def _assumptions(ready: PreparedRecordings, before: Estimate | None) -> Assumptions:
    """Return what is stated of the law; of glued blocks the drag of hidden faces is opened."""
    flows = ready.passes.flows
    found = assumptions_of(ready.study, ready.angle, recordings=len(ready.tracks), flows=flows)
    if before is None:
        return found
    return replace(found, opened={**found.opened, "hidden_share": GLUED.first_share})


def _of_all_samples(law: LawResult, search: ModeSearch) -> LawResult | None:
    """Return a law of thinned samples with the modes of all, None if its own does not converge."""
    mode, *alternatives = (
        converged(search.find(one.point, one.weights, held=FROM_THINNED))
        for one in (law.mode, *law.alternatives)
    )
    if mode is None:
        return None
    known = tuple(one for one in alternatives if one is not None)
    base = mode if law.base is law.mode else law.base
    noted = law.noted if len(known) == len(alternatives) else ()
    return replace(law, mode=mode, base=base, alternatives=known, noted=noted)


def _parameter_facts(
    search: ModeSearch, mode: Mode, restricted: Restricted, ready: PreparedRecordings
) -> dict[str, Any]:
    """Return the parameters with their intervals, and the precision of C_d."""
    study = ready.study
    mended = sum(one.frames for one in ready.dropped) / max(ready.samples, 1)
    covariance = with_mended_frames(parameter_covariance(mode, restricted), mended)
    stated = open_where_undetermined(covariance, mode, restricted)
    slopes = side_slopes(search, mode, restricted, study)
    std = math.inf if mode.diverged else math.sqrt(covariance[0, 0])
    return {
        **parameter_facts(restricted.point, stated, study, by_side=slopes),
        "maximum_likelihood_drag_coefficient": stated_drag(mode.point, study),
        **precision_facts(std, ready.duration, study),
    }


def _with_alternative(
    facts: dict[str, Any], search: ModeSearch, alternative: Mode, ready: PreparedRecordings
) -> dict[str, Any]:
    """Return the facts with intervals extended over another law's."""
    try:
        other = _parameter_facts(search, alternative, restricted_drag(search, alternative), ready)
    except BREAKDOWN:
        return facts
    shared = {
        f"{one.key}_interval": (facts[f"{one.key}_interval"], other[f"{one.key}_interval"])
        for one in BLOCK_NUMBERS
        if f"{one.key}_interval" in facts and f"{one.key}_interval" in other
    }
    return facts | {
        key: [min(first[0], second[0]), max(first[1], second[1])]
        for key, (first, second) in shared.items()
    }


def _measured_flow_facts(
    ready: PreparedRecordings, weights: Weights, point: Point
) -> dict[str, Any]:
    """Return how far the measured flow and the motion agree; nothing without a measured flow."""
    if ready.measured is None:
        return {}
    sums = ready.passes.sums(point, noise="without")
    across, own = sums.information[:-1, -1], sums.information[-1, -1] + PRIOR.log_drag_std**-2
    of_motion = sums.information[:-1, :-1] - np.outer(across, across) / own
    confidence = ready.study.fit.confidence
    return agreement_facts(ready.prior, weights, point.coefficients, of_motion, confidence)


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
        **({"mode_weight": mode.weights.modes} if mode.point.layers > 1 else {}),
    }


def check_fit(
    recordings: xr.Dataset | Sequence[xr.Dataset],
    study: Study | None = None,
    *,
    angle: AngleUse | None = None,
    body: str | None = None,
    flow: xr.Dataset | None = None,
) -> None:
    """Refuse recordings that `fit_motion` would refuse; takes almost no time.

    Parameters
    ----------
    recordings, study, angle, body, flow
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

    require_one_flow(prepare(as_list(recordings), study or Study(), angle, body, flow))
