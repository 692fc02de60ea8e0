"""The maximum of the penalised likelihood, by Gauss-Newton with a step that is kept in bounds.

A search on excerpts of long recordings, which costs a part of the time, comes first.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.progress import StagedProgress, ignore_progress, share_of_search
from driftwalk.likelihood.filter.filter_pass import Passes, Sums
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.filter.series import Series
from driftwalk.likelihood.law.candidate_laws import NUMBERS
from driftwalk.likelihood.prior import LEVER, PRIOR, Prior, Weights
from driftwalk.likelihood.refuse import BREAKDOWN, cholesky

Tell = Callable[[int, int, str], None]
Passed = Callable[[float], None]
"""Hears of work as it is done, see `work_of_pass`."""
Held = Sequence[Sequence[int]]
"""Parameters, counted from C_d on, that the first steps leave as they are."""
FROM_AFAR: Final[Held] = ((0, 2, 3, 4), (0,))
"""Flow and q have to settle before a step of C_d or of the other noises means anything."""
FROM_ANOTHER: Final[Held] = ((1, 2, 3, 4), (1, 2, 3, 4))
"""Where the search begins at the mode of other samples, the flow has to follow the new ones before
a step of the noises means anything."""
FROM_NEAR: Final[Held] = ()
FROM_THINNED: Final[Held] = ((1, 2, 3, 4),)
"""At the mode of samples further apart the flow is known all over the track."""


class NewtonPolicy(NamedTuple):
    """How far a step goes, and when the search ends."""

    most_log_drag_step: float = 0.5
    """Largest step of ln C_d. Chosen by hand."""
    most_log_step: float = 1.0
    """Largest step of the logarithm of the lever or of the angle's noise. Chosen by hand."""
    close: float = 0.25
    """The search has converged when the steps of C_d and the noises, and in the mean those of the
    coefficients, are below this part of their standard deviations. A tenth of such a step is left
    then (docs/explanation/likelihood.md)."""
    close_enough: float = 0.5
    """The same where a search of many more samples begins: what is saved here costs more there.
    Chosen by hand."""
    left_over: float = 0.1
    """Part of `close` that may be left to the noises where the last steps hold them: a tenth, as
    usual. Measured: without it an orientation noise of 90 s ended 0.34 standard deviations off."""
    close_nats: float = 1.0
    """And when a whole step would raise the log likelihood by less than this [nat]. Hundreds of
    coefficients may each move by little and gain 100 nats together: on the plateau at the edge of a
    narrow jet a search ended 170 nats above its minimum; chosen by hand."""
    most_left: float = 2.0
    """Standard deviations from the maximum beyond which an interval does not hold it. A body that
    is driven on a circle without any force was given up 5 to 80 away; chosen by hand."""
    trial_iterations: int = 12
    """Most steps of a search that only tries whether a law or a number has a mode: as many as the
    longest usual search (docs/explanation/likelihood.md)."""


NEWTON: Final = NewtonPolicy()


class WorkPolicy(NamedTuple):
    """Usual work of each stage in passes of the filter, for the progress of a fit.

    Measured on the bundled recording and parts of it.
    """

    overhead_samples: float = 2000.0
    """Time of a pass besides its samples, in samples: measured on the first 100 and 300 s too."""
    from_afar: float = 9.0
    """Passes of a search from afar; measured."""
    of_pieces: float = 7.0
    """Passes of a search on pieces of a long recording; measured."""
    from_pieces: float = 4.0
    """Passes of the search on all of a long recording that follows; measured."""
    score_tests: float = 2.5
    """Passes that take as long as the score tests of closed numbers; measured."""
    restricted: float = 2.0
    """Passes that take as long as the restricted likelihood; measured."""
    shared_stirring: float = 12.0
    """Passes that the likelihoods of two bodies for all lengths take; measured."""
    angle_given: float = 3.0
    """Passes that take as long as the second fit, with the angle as an input; measured."""


WORK: Final = WorkPolicy()


@dataclass(frozen=True, eq=False)
class Mode:
    """Where the search has come to."""

    point: Point
    weights: Weights
    covariance: Floats
    """Of all parameters, at the last step."""
    used: int
    iterations: int
    converged: bool
    deviance: float
    """Negative log likelihood with the priors, at the last step."""
    left: float = 0.0
    """How far Newton's whole step would have moved C_d, a noise or an opened number at the last
    step, in standard deviations: how far the maximum seems to be."""

    @property
    def diverged(self) -> bool:
        """Whether the search was given up so far from a maximum that its numbers mean nothing."""
        return not self.converged and not self.left <= NEWTON.most_left

    def value_of(self, name: str) -> tuple[float, float]:
        """Return a noise or an opened number, and its standard deviation by theory."""
        (value,), covariance = self.values_of([name])
        return float(value), math.sqrt(float(covariance[0, 0]))

    def values_of(self, names: Sequence[str]) -> tuple[Floats, Floats]:
        """Return noises or opened numbers, and their covariance by theory."""
        extras = self.point.extras
        first, order = self.point.coefficients.size + 1, list(extras)
        at = [first + order.index(name) for name in names]
        return np.array([extras[name] for name in names]), self.covariance[np.ix_(at, at)]


def known_numbers_variance(mode: Mode) -> float:
    """Return the variance of ln C_d by theory, were the opened numbers known."""
    drag = mode.point.coefficients.size
    first = drag + 1 + len(mode.point.noises)
    own = mode.covariance[drag, drag]
    if first == len(mode.covariance):
        return float(own)
    across = mode.covariance[drag, first:]
    return float(own - across @ np.linalg.solve(mode.covariance[first:, first:], across))


def work_of_pass(passes: Passes) -> float:
    """Return the work of one pass of the filter with derivatives, in samples."""
    return sum(one.time.size for one in passes.series) + WORK.overhead_samples


@dataclass(frozen=True, eq=False)
class ModeSearch:
    """Searches the mode of the penalised likelihood for the recordings of one fit."""

    passes: Passes
    prior: Prior
    iterations: int
    """Most steps of a search."""
    passed: Passed = ignore_progress
    """Called after every pass of the filter with its work."""
    close: float = NEWTON.close
    """A search ends when its steps are below this part of the standard deviations,"""
    close_nats: float = NEWTON.close_nats
    """and when a whole step would gain less than this [nat]."""

    def of(self, series: Sequence[Series]) -> ModeSearch:
        """Return the search for other series."""
        return replace(self, passes=replace(self.passes, series=series))

    def shortened(self) -> ModeSearch:
        """Return the search with fewer steps, to see whether it comes to an end."""
        few = min(self.iterations, NEWTON.trial_iterations)
        return replace(self, iterations=few, close_nats=math.inf)

    def coarse(self) -> ModeSearch:
        """Return a search that ends a little earlier, where another one follows."""
        return replace(self, close=NEWTON.close_enough, close_nats=math.inf)

    def find(self, start: Point, weights: Weights, *, held: Held = FROM_AFAR) -> Mode | None:
        """Return the mode; None where the search breaks down, as under a wrong law it may."""
        point, used, converged, settled = start, 0, False, False
        known, near = np.zeros((0, 0)), 0.0
        pooled = any(one.pooled > 1 for one in self.passes.series)
        deviance = ahead = math.inf
        last = np.zeros(start.coefficients.size + 1 + len(start.extras))
        try:
            with np.errstate(all="ignore"):
                for index in range(self.iterations):
                    drag = point.coefficients.size
                    left = [drag + k for k in (held[index] if index < len(held) else ())]
                    left = [one for one in left if one <= drag + len(point.noises)]
                    # Derivatives by the noises take a pass each: none where all of them are held.
                    others = range(drag + 1, drag + 1 + len(point.extras))
                    moving = "without" if settled or set(others) <= set(left) else "with"
                    left = list(others) if settled else left
                    sums = self.passes.sums(point, noise=moving)
                    sums = _of_all(self.prior.add(sums, point, weights), last.size)
                    self.passed(work_of_pass(self.passes))
                    used, deviance = sums.used, sums.deviance
                    covariance = inverse(sums.information)
                    known = known if settled else covariance
                    whole = newton_step(sums, covariance, held=left)
                    step = limited(whole, drag, list(point.opened))
                    step = last = damped(step, last, sums.information)
                    point = point.moved(step)
                    # The smoothness follows the data: one step of the evidence's fixed point.
                    weights = self.prior.updated(weights, point, covariance)
                    stds = np.sqrt(np.diag(covariance))
                    moves, ways = np.abs(step) / stds, np.abs(whole) / stds
                    # A lever that is known from its prior alone may go to and fro without moving
                    # anything else.
                    if point.log_lever is not None:
                        moves[drag + LEVER] = ways[drag + LEVER] = 0.0
                    ahead = float(ways[drag:].max())
                    of_flow = float(np.sqrt((moves[:drag] ** 2).mean()))
                    before, near = near, max(float(moves[drag:].max()), of_flow)
                    gain = 0.5 * float(sums.score @ covariance @ sums.score)
                    free = settled or len(left) == 0
                    if free and near < self.close and gain < self.close_nats:
                        converged = True
                        break
                    # Of a fast camera the flow is brought to its end without the noises, where
                    # steps that shrink as the last one did leave little to them.
                    left_over = NEWTON.left_over * self.close * before
                    settled = pooled and free and near < self.close and near**2 < left_over
        except BREAKDOWN:
            return None
        return Mode(point, weights, known, used, index + 1, converged, deviance, ahead)

    def find_from_afar(self, start: Point, weights: Weights) -> Mode | None:
        """Return the mode, of long recordings by way of the mode of pieces of them."""
        few = pieces(self.passes)
        near = None if few is None else converged(self.of(few).coarse().find(start, weights))
        if near is not None:
            mode = converged(self.find(near.point, near.weights, held=FROM_ANOTHER))
            if mode is not None:
                return mode
        return self.find(start, weights)


def require_mode(mode: Mode | None) -> Mode:
    """Return a mode; raise `LinAlgError` where the search broke down."""
    if mode is None:
        raise np.linalg.LinAlgError("the search broke down")
    return mode


def converged(mode: Mode | None) -> Mode | None:
    """Return a mode that is one; nothing where the search broke down or did not come to its end."""
    return mode if mode is not None and mode.converged else None


def _of_all(sums: Sums, count: int) -> Sums:
    """Return the sums with rows of parameters that have no derivatives, and no step, behind."""
    information, score = np.eye(count), np.zeros(count)
    known = sums.score.size
    information[:known, :known], score[:known] = sums.information, sums.score
    return sums._replace(score=score, information=information)


def newton_step(sums: Sums, covariance: Floats, *, held: Sequence[int] = ()) -> Floats:
    """Return the Gauss-Newton step, the best one that leaves the `held` parameters as they are."""
    step = covariance @ sums.score
    if held:
        at = list(held)
        step = step - covariance[:, at] @ np.linalg.solve(covariance[np.ix_(at, at)], step[at])
    return np.asarray(step)


def damped(step: Floats, last: Floats, information: Floats) -> Floats:
    """Return the step, shortened where it takes back the last one.

    Gauss and Newton's step leaves out how the derivatives change; where they change much it goes
    too far, and back again. If a step is lambda times the last one, lambda < 0, then the sum of all
    the steps to come is 1 / (1 - lambda) of it.
    """
    length = float(last @ information @ last)
    ratio = float(step @ information @ last) / length if length > 0.0 else 0.0
    return step / (1.0 - ratio) if ratio < 0.0 else step


def limited(step: Floats, drag: int, opened: Sequence[str] = ()) -> Floats:
    """Return the step, shortened where it would jump, with q and r taken as factors.

    The step is the same whether it is made in the logarithm of a variance or in the variance; made
    in the variance it finds a wrong one in one step, from whatever side. Lever and noise of the
    angle are another matter: they may be known from their priors alone, which are those of
    logarithms.
    """
    shorter = step * min(1.0, NEWTON.most_log_drag_step / max(abs(float(step[drag])), 1e-300))
    for index, power in ((1, 1.0), (2, 2.0)):
        factor = np.clip(
            1.0 + power * step[drag + index], 1.0 / PRIOR.most_factor, PRIOR.most_factor
        )
        shorter[drag + index] = math.log(factor) / power
    numbers = step.size - len(opened)
    levers = slice(drag + LEVER, numbers)
    shorter[levers] = np.clip(step[levers], -NEWTON.most_log_step, NEWTON.most_log_step)
    for index, name in enumerate(opened, numbers):
        most = NUMBERS[name].most
        shorter[index] = min(max(float(step[index]), -most), most)
    return np.asarray(shorter)


def inverse(information: Floats) -> Floats:
    """Return the inverse of a symmetric positive definite matrix."""
    from scipy.linalg import cho_solve

    return np.asarray(cho_solve(cholesky(information), np.eye(len(information))))


class ExcerptPolicy(NamedTuple):
    """Sizes of the excerpts, in samples."""

    law_samples: int = 3000
    """Laws are compared on this many samples from the beginning of the recordings. Chosen by hand;
    eight floating bodies were ahead by 176 to 365 nats on them (docs/explanation/likelihood.md)."""
    near_samples: int = 3600
    """A search comes near its end on this many samples. Chosen by hand."""
    piece_samples: int = 300
    """The samples come in pieces of this many from all over the recordings. Chosen by hand."""
    interval_s: float = 0.1
    """The law is searched on samples this far apart, of a faster camera: ten times as many take ten
    times as long and tell hardly more of it. The interval of most recordings of known truth; chosen
    by hand."""
    worth_factor: float = 2.5
    """A search goes by way of pieces where the recordings have this many times as many samples.
    Chosen by hand."""


EXCERPT: Final = ExcerptPolicy()


def thinned(passes: Passes) -> Passes:
    """Return passes over the recordings with the samples of a fast camera further apart."""
    series = [one.thinned(EXCERPT.interval_s) for one in passes.series]
    same = all(one is other for one, other in zip(series, passes.series, strict=True))
    return passes if same else replace(passes, series=series)


def beginning(passes: Passes) -> Sequence[Series]:
    """Return the first 3000 samples or so, in series; all of them where there are several flows."""
    total = sum(one.time.size for one in passes.series)
    if passes.flows > 1 or total <= 1.2 * EXCERPT.law_samples:
        return passes.series
    found, count = [], 0
    for one in passes.series:
        if count >= EXCERPT.law_samples:
            break
        found.append(one.part(0, EXCERPT.law_samples - count))
        count += found[-1].time.size
    return found


def pieces(passes: Passes) -> Sequence[Series] | None:
    """Return pieces of the recordings; nothing where those are too short for it.

    The pieces come from all over the recordings, so that they show as much of the tank as those.
    """
    total = sum(one.time.size for one in passes.series)
    found = []
    for one in passes.series:
        size = one.time.size
        count = max(round(EXCERPT.near_samples * size / total / EXCERPT.piece_samples), 1)
        if count * EXCERPT.piece_samples >= size:
            found.append(one)
            continue
        ends = np.linspace(0, size - EXCERPT.piece_samples, count)
        firsts = ends if count > 1 else [0.5 * (size - EXCERPT.piece_samples)]
        found += [one.part(int(first), int(first) + EXCERPT.piece_samples) for first in firsts]
    # Each recording gives a piece, so of many short ones little is left out.
    few = sum(one.time.size for one in found)
    return found if EXCERPT.worth_factor * few <= total else None


def usual_work(passes: Passes, *, interaction: bool) -> dict[str, float]:
    """Return the work of each stage of a fit whose search ends where most do, in samples."""
    whole, few = work_of_pass(passes), pieces(passes)
    search = (WORK.from_afar + WORK.score_tests) * whole
    if few is not None:
        near = WORK.of_pieces * work_of_pass(replace(passes, series=few))
        search = near + (WORK.from_pieces + WORK.score_tests) * whole
    parts = {"likelihood": search, "drag": WORK.restricted * whole}
    if passes.body.orientation == "state":
        parts["angle as given"] = WORK.angle_given * whole
    if interaction:
        parts["shared stirring"] = WORK.shared_stirring * whole
    return parts


def work_listener(staged: StagedProgress, usual: float) -> Passed:
    """Return a listener to the work of the search, whose length is unknown beforehand."""
    said, done = staged.stage("likelihood"), 0.0

    def passed(work: float) -> None:
        nonlocal done
        done += work
        said(share_of_search(done / usual), 1)

    staged.begin("likelihood")
    return passed
