"""Posterior of parameters from outcomes alone, by an emulator that is refined and then checked.

Its dataset holds the intervals, the verdict with its reasons, and the self-check.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.assembly.outcome_posterior.emulator import Emulator, log_likelihoods
from driftwalk.assembly.outcome_posterior.problem import (
    DESIGN_POLICY,
    Checked,
    Emulated,
    Nodes,
    OutcomeProblem,
    check_outcomes,
)
from driftwalk.assembly.outcome_posterior.records import (
    BOTH,
    CLASSES,
    EARLY,
    JOINS,
    KINDS,
    TIMES,
    Categories,
    Outcomes,
    Record,
)
from driftwalk.assembly.outcome_posterior.region import (
    CREDIBLE_REGION,
    Coverage,
    intervals_of,
    self_check,
    weights_of,
)
from driftwalk.assembly.sensitivity.settings import FIRST_TRIALS
from driftwalk.core.arrays import Floats
from driftwalk.core.progress import ignore_progress
from driftwalk.core.study_keys import INFERRED_KEYS
from driftwalk.core.units import in_percent
from driftwalk.model import Study, declared
from driftwalk.schema.answers.facts import texts
from driftwalk.schema.answers.outcome_posterior import (
    BOTH_ENDS,
    LOWER_END,
    NO_END,
    REFUSED,
    UPPER_END,
)
from driftwalk.schema.check import build_dataset
from driftwalk.schema.kinds.sensitivity import axis_number
from driftwalk.schema.shapes import short_class

if TYPE_CHECKING:
    import numpy.typing as npt
    import xarray as xr

    from driftwalk.sweep import Store

Progress = Callable[[int, int], None]


def infer_outcomes(
    outcomes: Outcomes | xr.Dataset,
    flow: xr.Dataset,
    study: Study | None = None,
    *,
    vary: Mapping[str, tuple[float, float]] | None = None,
    after: float | None = None,
    runs: int = DESIGN_POLICY.runs,
    truths: int = DESIGN_POLICY.truths,
    seed: int = 1,
    store: Callable[[str], Store] | None = None,
    progress: Progress | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
) -> xr.Dataset:
    """Return the posterior of two to four parameters from the outcomes of self-assembly alone.

    Simulates runs at nodes of the parameters, learns from them how the shares of the outcomes
    depend on the parameters, adds nodes where the posterior lies, and infers the parameters of
    simulated data sets before it states a region of the real ones.

    Parameters
    ----------
    outcomes : mapping of str to int, sequence of Record, or xarray.Dataset or sequence of them
        Runs by final outcome class; or records of runs; or `assembly` or `classification` datasets.
    flow : xarray.Dataset
        The water's velocity, a `flow_field`.
    study : Study, optional
        All else about the tank and the blocks; default: the paper's.
    vary : mapping of str to (float, float), optional
        Lowest and highest value of two to four parameters, SI; equally likely in between. Default:
        ``drag_coefficient`` 0.3 to 0.6 and ``force_std`` 0.2 to 1.2 mN.
    after : float, optional
        When the final classes are read [s]; default: the length of the shortest run that is not
        complete, for counts the study's duration.
    runs : int
        Simulated runs of a node, at least 20.
    truths : int
        Data sets of the self-check, at least 20.
    seed : int
        Seed of the simulations, at least 0.
    store : callable, optional
        Returns the store of a sweep by its name, for example of a run directory, to be continued.
    progress : callable, optional
        Called as ``progress(done, total)`` with simulated runs; the total is the largest possible.
    threads : int, optional
        Default: all processors. The result does not depend on it.
    executor : concurrent.futures.Executor, optional
        Computes work units elsewhere; the result does not depend on it.

    Returns
    -------
    xarray.Dataset
        Kind "outcome_posterior". ``value`` (point, parameter) and ``weight`` (point): a sample of
        the posterior; ``estimate`` and ``interval`` (parameter), ``determined``; for every kind of
        data ``coverage`` in the self-check, ``power`` of the likelihood, ``expected_width`` over
        that of the prior. The verdict is ``attrs["verdict"]``.

    Raises
    ------
    InputError
        When the outcomes are no classes of the study's blocks, a parameter is not known or its
        range is empty, or blocks do not fit the tank.

    Notes
    -----
    ln p(n | θ) = ln E[Π_k p_k(θ)^n_k] over the error of a Gaussian process of the logarithms of the
    shares p_k (Milios et al. 2018), to a power that the self-check sets. See
    docs/how-to/outcomes-alone.md.

    Examples
    --------
    >>> import driftwalk as dw
    >>> study = dw.Study(assembly={"blocks": 2, "duration_s": 20.0})
    >>> few = {"runs": 20, "truths": 20}
    >>> counts = {"2": 12, "1+1": 8}
    >>> found = dw.assembly.infer_outcomes(counts, dw.tank30_flow(), study, **few)
    >>> found["parameter"].values.tolist()
    ['drag_coefficient', 'force_std']
    """
    problem = check_outcomes(
        outcomes, flow, study, vary=vary, after=after, runs=runs, truths=truths, seed=seed,
        threads=threads,
    )  # fmt: skip
    course = _Course(problem, store, progress, executor)
    emulated = emulate(problem, course)
    return posterior_dataset(problem, emulated, check_emulator(problem, emulated, course))


class _Course:
    """The simulations of a problem: stores, progress and workers."""

    def __init__(
        self, problem: OutcomeProblem, store: Any, progress: Progress | None, executor: Any
    ) -> None:
        self.store, self.executor, self.progress = store, executor, progress or ignore_progress
        nodes = DESIGN_POLICY.first_nodes + DESIGN_POLICY.rounds * DESIGN_POLICY.more_nodes
        self.checks = problem.truths * len(problem.observed.records)
        self.total = nodes * len(problem.names) * problem.study.sensitivity.runs + self.checks
        self.done = 0

    def simulate(self, name: str, nodes: Nodes) -> list[list[Record]]:
        """Simulate nodes, and say how many runs are done."""
        each, begun = nodes.study.sensitivity.runs, self.done
        found = nodes.sweep(
            store=None if self.store is None else self.store(name),
            progress=lambda done, _: self._say(begun + done * each),
            executor=self.executor,
        )
        self.done = begun + each * len(nodes.value)
        return found

    def _say(self, done: int) -> None:
        self.progress(min(done, self.total), self.total)

    def skip_to_check(self) -> None:
        """Count the rounds that were not needed as done."""
        self.done = self.total - self.checks
        self._say(self.done)


def emulate(problem: OutcomeProblem, course: _Course, *, rounds: int | None = None) -> Emulated:
    """Return an emulator: nodes spread evenly, then nodes where the posterior and its error lie."""
    policy, parameters = DESIGN_POLICY, len(problem.names)
    node = problem.sample(policy.first_nodes * parameters, 0)
    records = course.simulate("nodes", problem.nodes(node, FIRST_TRIALS.emulator))
    categories = {kind: Categories.of(kind, records) for kind in KINDS}
    point = problem.sample(policy.points, 1)
    for number in range(1, 2 + (policy.rounds if rounds is None else rounds)):
        emulator = Emulator.fitted(node, categories[CLASSES].table(records))
        weight, each = _errors(problem, emulator, categories[CLASSES], point)
        if number > policy.rounds or weight @ each < policy.noise:
            break
        chance = weight**policy.spread * each
        random = np.random.default_rng([problem.seed, number])
        size = policy.more_nodes * parameters
        chosen = random.choice(len(point), size, replace=False, p=chance / chance.sum())
        more = _jittered(point[chosen], random)
        first = FIRST_TRIALS.emulator + len(node)
        records += course.simulate(f"nodes-{number}", problem.nodes(more, first))
        node = np.vstack([node, more])
    emulators = {
        kind: emulator if kind == CLASSES else Emulator.fitted(node, one.table(records))
        for kind, one in categories.items()
    }
    noise = {}
    for kind in problem.kinds:
        weight, each = _errors(problem, emulators[kind], categories[kind], point)
        noise[kind] = float(weight @ each)
    return Emulated(node, categories, emulators, point, noise)


def _errors(
    problem: OutcomeProblem, emulator: Emulator, categories: Categories, point: Floats
) -> tuple[Floats, Floats]:
    """Return the posterior weights of points, and the emulator's relative errors there."""
    from scipy.special import softmax

    own = categories.counts(problem.observed.records)
    mean, variance = emulator.predict(point)
    weight = weights_of(log_likelihoods(mean, variance, own[None])[0])
    # Over the sampling error of so many runs.
    runs, share = max(int(own.sum()), 1), softmax(mean, axis=1)
    return weight, runs * (share * variance).sum(axis=1) / (mean.shape[1] - 1)


def _jittered(point: Floats, random: np.random.Generator) -> Floats:
    """Return points moved within their cells of the sample, so that none is met twice."""
    half = 0.5 * DESIGN_POLICY.points ** (-1.0 / point.shape[1])
    return np.clip(point + random.uniform(-half, half, point.shape), 0.0, 1.0)


def check_emulator(problem: OutcomeProblem, emulated: Emulated, course: _Course) -> Checked:
    """Infer the parameters of simulated data sets whose truths are drawn from the posterior."""
    from scipy.special import xlogy

    records = problem.observed.records
    point = emulated.point
    own, _ = _likelihoods(emulated, CLASSES, [records], point)
    random = np.random.default_rng([problem.seed, 1 << 20])
    drawn = random.choice(len(point), problem.truths, p=weights_of(own[0]))
    truth = _jittered(point[drawn], random)
    course.skip_to_check()
    nodes = problem.nodes(truth, FIRST_TRIALS.self_check, runs=max(len(records), 1))
    sets = course.simulate("check", nodes)
    coverage: dict[str, Coverage] = {}
    found: dict[str, Floats] = {}
    deviances = []
    for kind in KINDS:
        held = kind in problem.kinds
        both, count = _likelihoods(
            emulated, kind, [*sets, *([records] if held else [])], np.vstack([point, truth])
        )
        size = len(point)
        at_truth = both[np.arange(len(sets)), size + np.arange(len(sets))]
        coverage[kind] = self_check(point, truth, both[: len(sets), :size], at_truth)
        if held:
            found[kind] = both[-1, :size]
            share = count / count.sum(axis=1, keepdims=True)
            deviances.append(xlogy(count, share).sum(axis=1) - both[:, :size].max(axis=1))
    # The smallest p-value of the kinds, against its own distribution (Westfall and Young).
    own_p = np.array([(one[None] >= one[:, None]).mean(axis=1) for one in deviances]).min(axis=0)
    return Checked(truth, coverage, found, float((own_p <= own_p[-1]).mean()))


def _likelihoods(
    emulated: Emulated, kind: str, sets: Sequence[Sequence[Record]], point: Floats
) -> tuple[Floats, Any]:
    """Return the log likelihoods of data sets at points, and their counts."""
    count = emulated.categories[kind].table(sets)
    return log_likelihoods(*emulated.emulators[kind].predict(point), count), count


PREFERRED = (BOTH, CLASSES, JOINS, TIMES, EARLY)
"""Kinds of data in the order in which the stated region is taken from those that cover."""


def posterior_dataset(problem: OutcomeProblem, emulated: Emulated, checked: Checked) -> xr.Dataset:
    """Return the dataset of a posterior."""
    low, span = problem.low, problem.high - problem.low
    coverage, policy = checked.coverage, CREDIBLE_REGION
    explained = checked.explained
    offered = [
        kind for kind in PREFERRED if explained and kind in problem.kinds and coverage[kind].offered
    ]
    used = offered[0] if offered else None
    bounds = np.full((len(KINDS), len(problem.names), 3), np.nan)
    weight = np.full(len(emulated.point), 1.0 / len(emulated.point))
    for at, kind in enumerate(KINDS):
        if kind in offered:
            own = weights_of(checked.log_likelihood[kind], power=coverage[kind].power)
            bounds[at] = intervals_of(emulated.point, own)
            weight = own if kind == used else weight
    chosen = bounds[KINDS.index(used)] if used else bounds[0]
    limit = limits_of(chosen)
    value = low + emulated.point * span
    if not explained:
        # If the model were right: which class disagrees most, and where the search ended.
        weight = weights_of(checked.log_likelihood[problem.kinds[0]])
    names, observed, predicted = _classes(problem, emulated, weight)
    seen = observed / max(observed.sum(), 1)
    most = int(np.argmax(np.abs(seen - predicted)))
    worst = names[most] if names[most] == "rest" else short_class(names[most])
    first, _, last = intervals_of(emulated.point, weight).T
    poor_fit = (
        "widen the ranges, or the model is wrong"
        if not explained and ((first < policy.edge) | (last > 1.0 - policy.edge)).any()
        else f"most in {worst}, {seen[most]:.3f} seen and {predicted[most]:.3f} predicted"
    )
    unit = [_unit(name) for name in problem.names]
    noise = emulated.noise[used or CLASSES]
    reasons = _reasons(problem, chosen, limit, checked, used, poor_fit)
    if used and noise >= DESIGN_POLICY.noise:
        reasons.append(
            f"the emulator's error is {in_percent(noise)} of the sampling error, and not below "
            f"{in_percent(DESIGN_POLICY.noise)}: give more runs of a node (runs)"
        )
    verdict = "determined"
    if not explained:
        verdict = REFUSED
    elif used is None:
        verdict = "cannot tell: no kind of data has regions that cover"
    elif not (limit == BOTH_ENDS).all():
        verdict = "partly determined" if (limit != NO_END).any() else "cannot tell"
    checks = (coverage[kind] for kind in KINDS)
    power, joint, marginal, width = (np.array(one) for one in zip(*checks, strict=True))
    data: dict[str, Any] = {
        "value": (("point", "parameter"), value),
        "weight": ("point", weight),
        "estimate": ("parameter", low + chosen[:, 1] * span),
        "interval": (("parameter", "bound"), low[:, None] + chosen[:, [0, 2]] * span[:, None]),
        "determined": ("parameter", limit == BOTH_ENDS),
        "limit": ("parameter", limit.astype(object)),
        "low": ("parameter", low),
        "high": ("parameter", problem.high),
        "observed": ("data", np.isin(KINDS, problem.kinds)),
        "offered": ("data", np.isfinite(power)),
        "power": ("data", power),
        "coverage": ("data", joint),
        "interval_coverage": (("data", "parameter"), marginal),
        "expected_width": (("data", "parameter"), width),
        "width": (("data", "parameter"), (bounds[..., 2] - bounds[..., 0]) / policy.confidence),
        "count": ("class", observed),
        "share": ("class", predicted),
        "node_value": (("node", "parameter"), low + emulated.node * span),
        "truth_value": (("truth", "parameter"), low + checked.truth * span),
        "reason": ("reason", texts(reasons)),
    }
    coords = {
        "parameter": ("parameter", np.array(problem.names, dtype=object)),
        "unit": ("parameter", np.array(unit, dtype=object)),
        "data": ("data", np.array(KINDS, dtype=object)),
        "class": ("class", np.array(names, dtype=object)),
    }
    attrs = {
        "verdict": verdict,
        "used": used or "none",
        "runs": len(problem.observed.records),
        "blocks": problem.observed.blocks,
        "after_s": problem.study.assembly.duration_s,
        "p": checked.p,
        "emulator_noise": noise,
        "node_runs": problem.study.sensitivity.runs,
        "truths": problem.truths,
        "confidence": policy.confidence,
        "seed": problem.seed,
        "study": problem.study.to_toml(),
    }
    return build_dataset("outcome_posterior", data, coords, attrs)


def _classes(
    problem: OutcomeProblem, emulated: Emulated, weight: Floats
) -> tuple[list[str], Any, Floats]:
    """Return the final classes, how often they were seen, and their predicted mean shares."""
    from scipy.special import softmax

    categories = emulated.categories[CLASSES]
    mean, _ = emulated.emulators[CLASSES].predict(emulated.point)
    seen = categories.counts(problem.observed.records)
    return [str(label) for label in categories.labels], seen, weight @ softmax(mean, axis=1)


def _unit(name: str) -> str:
    quantity = declared(INFERRED_KEYS[name]).quantity
    return "1" if quantity is None else quantity.unit


def limits_of(bounds: Floats) -> npt.NDArray[Any]:
    """Return which bounds of the intervals are limits: both, one, or none if wide or not stated.

    An end that is that of the range is none of the data's.

    Examples
    --------
    >>> limits_of(np.array([[0.3, 0.4, 0.5], [0.0, 0.2, 0.4], [0.0, 0.5, 0.9]])).tolist()
    ['both', 'upper', 'none']
    """
    policy = CREDIBLE_REGION
    low, high = bounds[:, 0], bounds[:, 2]
    narrow = (high - low) / policy.confidence < policy.prior_like
    sides = [~narrow, low < policy.edge, high > 1.0 - policy.edge]
    return np.select(sides, [NO_END, UPPER_END, LOWER_END], BOTH_ENDS)


def _reasons(
    problem: OutcomeProblem,
    bounds: Floats,
    limit: Any,
    checked: Checked,
    used: str | None,
    poor_fit: str,
) -> list[str]:
    """Return sentences for what is not determined, and why; `poor_fit`: where the model fails."""
    policy, found = CREDIBLE_REGION, []
    if not checked.explained:
        return [
            f"the outcomes agree with no setting of the ranges (p = {checked.p:.2g}): {poor_fit}"
        ]
    if used is None:
        lacking = ", ".join(
            f"for {kind} they hold {in_percent(min(one.joint, *one.marginal))}"
            for kind, one in checked.coverage.items()
            if kind in problem.kinds
        )
        return [f"regions do not cover in the self-check ({lacking}): use narrower ranges"]
    for name, side, (low, _, high) in zip(problem.names, limit, bounds, strict=True):
        words = axis_number(name).plain
        if side == NO_END:
            found.append(
                f"cannot tell {words}: its interval is "
                f"{in_percent((high - low) / policy.confidence)} of the one without data"
            )
        elif side != BOTH_ENDS:
            other = "lower" if side == UPPER_END else "upper"
            found.append(
                f"{words}: a limit from one side, as the interval reaches the {other} end of its "
                "range; widen it if it can be wider"
            )
    return found
