"""Posterior of parameters from outcomes alone, by an emulator that is refined and then checked."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.assembly.outcome_posterior.dataset import posterior_dataset
from driftwalk.assembly.outcome_posterior.emulator import Emulator, log_likelihoods
from driftwalk.assembly.outcome_posterior.nodes import Nodes
from driftwalk.assembly.outcome_posterior.observed import Outcomes
from driftwalk.assembly.outcome_posterior.problem import (
    DESIGN_POLICY,
    Checked,
    Emulated,
    OutcomeProblem,
    check_outcomes,
)
from driftwalk.assembly.outcome_posterior.records import CLASSES, KINDS, Categories, Record
from driftwalk.assembly.outcome_posterior.region import Coverage, self_check, weights_of
from driftwalk.assembly.sensitivity.settings import FIRST_TRIALS
from driftwalk.core.arrays import Floats

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
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
        Returns the store of a sweep by its name, such as that of a run directory, to be continued.
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
        self.problem, self.store, self.progress, self.executor = problem, store, progress, executor
        parameters, policy = len(problem.names), DESIGN_POLICY
        nodes = policy.first_nodes + policy.rounds * policy.more_nodes
        self.runs = problem.study.sensitivity.runs
        checks = problem.truths * len(problem.observed.records)
        self.total = nodes * parameters * self.runs + checks
        self.done = 0

    def simulate(self, name: str, nodes: Nodes) -> list[list[Record]]:
        """Simulate nodes, and say how many runs are done."""
        each, begun = nodes.study.sensitivity.runs, self.done
        found = nodes.simulate(
            store=None if self.store is None else self.store(name),
            progress=None
            if self.progress is None
            else lambda done, _: self._say(begun + done * each),
            executor=self.executor,
        )
        self.done = begun + each * len(nodes.value)
        return found

    def _say(self, done: int) -> None:
        if self.progress is not None:
            self.progress(min(done, self.total), self.total)

    def skip_to_check(self) -> None:
        """Count the rounds that were not needed as done."""
        self.done = self.total - self.problem.truths * len(self.problem.observed.records)
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
    own = categories.counts(problem.observed.records)
    mean, variance = emulator.predict(point)
    weight = weights_of(log_likelihoods(mean, variance, own[None])[0])
    return weight, _relative_error(mean, variance, runs=max(int(own.sum()), 1))


def _relative_error(mean: Floats, variance: Floats, *, runs: int) -> Floats:
    """Return the emulator's error over the sampling error of so many runs, by point."""
    from scipy.special import softmax

    share = softmax(mean, axis=1)
    error: Floats = runs * (share * variance).sum(axis=1) / (mean.shape[1] - 1)
    return error


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
