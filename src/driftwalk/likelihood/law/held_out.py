"""Force laws compared by evidence and by the prediction of what was held out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.processors import one_blas_thread
from driftwalk.core.progress import StagedProgress, ignore_progress
from driftwalk.likelihood.filter.filter_pass import log_densities
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.filter.series import Series
from driftwalk.likelihood.law.candidate_laws import DRAG_SHAPES, DRAGS
from driftwalk.likelihood.law.force_law import FLOATING
from driftwalk.likelihood.law.search import evidence_of
from driftwalk.likelihood.newton import ModeSearch, Passed, Tell
from driftwalk.likelihood.preparation import Estimate, estimate_of
from driftwalk.likelihood.refuse import BREAKDOWN
from driftwalk.schema.answers.parts import undetermined
from driftwalk.schema.check import described

if TYPE_CHECKING:
    import xarray as xr


LAWS: Final[dict[str, tuple[bool, str]]] = {
    "paper": (False, "quadratic"),
    "paper, linear drag": (False, "linear"),
    "paper, mixed drag": (False, "mixed"),
    "paper, a power of the speed": (False, "power"),
    "floating body": (True, "quadratic"),
    "floating body, linear drag": (True, "linear"),
    "floating body, mixed drag": (True, "mixed"),
    "floating body, a power of the speed": (True, "power"),
}
"""Whether the water's acceleration pushes the body, and its drag."""


class _Compared(NamedTuple):
    evidence: float
    scores: Floats
    """Logarithm of the predicted density of each sample that was held out."""
    drag: float


@one_blas_thread()
def compare_laws(
    fit: xr.Dataset,
    recordings: Sequence[xr.Dataset],
    *,
    body: str | None = None,
    tell: Tell | None = None,
) -> xr.Dataset:
    """Compare force laws on the recordings of a fit.

    Each law is fitted to the first 70 % of every recording, with the departures from the model
    that the fit has found as they are there. Then the filter predicts the rest, sample by sample.

    Parameters
    ----------
    fit : xarray.Dataset
        Result of `fit_motion`.
    recordings : sequence of xarray.Dataset
        Those that it was fitted to.
    body : str, optional
        The body, where a recording has several.
    tell : callable, optional
        Called with the thousandths of the work that are done, 1000, and the law at work.

    Returns
    -------
    xarray.Dataset
        The fit, with ``compared_log_evidence`` and ``compared_log_score`` by ``compared_law``: the
        mean logarithm of the density per held out sample; ``compared_log_score_std`` is the
        standard error of its difference from that of the best law. NaN where a law has no solution.

    Raises
    ------
    InputError
        When the recordings do not belong to the fit.

    Examples
    --------
    >>> import driftwalk as dw
    >>> recording = dw.tank30_recording()
    >>> fit = dw.fit_motion(recording)  # doctest: +SKIP
    >>> found = compare_laws(fit, [recording])  # doctest: +SKIP
    >>> found["compared_law"].values[found["compared_log_score"].argmax()]  # doctest: +SKIP
    'paper'
    """
    found: dict[str, _Compared | None] = dict.fromkeys(LAWS)
    # Without the numbers of the fit there is nothing to begin a search from.
    if not undetermined(fit):
        estimate = estimate_of(fit, recordings, body=body)
        staged = StagedProgress(tell or ignore_progress, _usual_parts(estimate.point))
        for name, law in LAWS.items():
            staged.begin(name)
            found[name] = _under(estimate, *law, passed=_counted(staged, name, estimate))
    means = {name: float(np.nanmean(one.scores)) for name, one in found.items() if one is not None}
    best = max(means, key=means.__getitem__) if means else None
    columns = {
        "compared_log_evidence": [one.evidence if one else math.nan for one in found.values()],
        "compared_log_score": [means.get(name, math.nan) for name in found],
        "compared_log_score_std": [_difference_std(found, name, best) for name in found],
        "compared_filter_drag_coefficient": [
            one.drag if one else math.nan for one in found.values()
        ],
    }
    data = {name: ("compared_law", np.array(values)) for name, values in columns.items()}
    names = np.array(list(found), dtype=np.str_)
    return described(fit.assign(data).assign_coords(compared_law=("compared_law", names)))


def _usual_parts(point: Point) -> dict[str, float]:
    """Return how long each law usually takes: another push of the water takes longer."""
    own = point.number("water_acceleration") != 0.0
    # Measured on the bundled recording: with the other push the search does not settle.
    return {name: 1.0 if floating == own else 3.0 for name, (floating, _) in LAWS.items()}


def _counted(staged: StagedProgress, name: str, estimate: Estimate) -> Passed:
    """Return what hears of the passes of one law's search."""
    said, done = staged.stage(name), 0

    def passed(_work: float) -> None:
        nonlocal done
        done += 1
        said(done, estimate.study.fit.iterations)

    return passed


def _under(estimate: Estimate, floating: bool, drag: str, *, passed: Passed) -> _Compared | None:
    """Fit a law to the first part and predict the rest; nothing where it has no solution."""
    passes, prior = estimate.passes, estimate.prior
    training = replace(passes, series=[one.part(0, _training(one)) for one in passes.series])
    start = _start(estimate.point, floating=floating, drag=drag)
    search = ModeSearch(training, prior, estimate.study.fit.iterations, passed)
    try:
        mode = search.find(start, estimate.weights)
        if mode is None:
            return None
        with np.errstate(all="ignore"):
            # Logarithms of the densities of the held out samples; NaN where not predicted.
            scores = np.concatenate(
                [
                    log_densities(passes, one, mode.point.in_flow(one.flow))[_training(one) :]
                    for one in passes.series
                ]
            )
            if not np.isfinite(scores).any():
                return None
            return _Compared(evidence_of(mode, prior), scores, math.exp(mode.point.log_drag))
    except BREAKDOWN:
        return None


def _start(point: Point, *, floating: bool, drag: str) -> Point:
    """Return the fit's point under another law."""
    known = {**point.fixed, **point.opened}
    for name in (*FLOATING, *DRAG_SHAPES):
        known.pop(name, None)
    known.update({**(FLOATING if floating else {}), **DRAGS[drag].fixed})
    return replace(point, opened=DRAGS[drag].opened, fixed=known)


def _training(series: Series) -> int:
    """Return how many samples of a series a law is fitted to."""
    # Chosen by hand: 70 % from the beginning of each recording; the rest is predicted.
    return int(0.7 * series.time.size)


def _difference_std(found: dict[str, _Compared | None], name: str, best: str | None) -> float:
    """Return the standard error of the difference of two mean scores, from blocks of samples."""
    one, other = found[name], None if best is None else found[best]
    if one is None or other is None:
        return math.nan
    apart = one.scores - other.scores
    blocks = [np.nanmean(part) for part in np.array_split(apart, 20) if np.isfinite(part).any()]
    return float(np.std(blocks, ddof=1) / math.sqrt(len(blocks))) if len(blocks) > 1 else math.nan
