"""A problem of inference from outcomes: data, study, ranges, its simulations, what stages return.

The emulator learns from runs that are simulated at nodes of the parameters, and is tested with
others.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from driftwalk.assembly.outcome_posterior.emulator import Emulator
from driftwalk.assembly.outcome_posterior.records import (
    KINDS,
    Categories,
    Observed,
    Outcomes,
    Record,
    merged,
    observed_of,
    records_from_text,
    records_of_events,
    records_to_text,
)
from driftwalk.assembly.outcome_posterior.region import CREDIBLE_REGION, Coverage
from driftwalk.assembly.runs.dataset import times_of
from driftwalk.assembly.runs.plan import chirality_of
from driftwalk.assembly.sensitivity.settings import (
    OF_EACH_RUN,
    Piece,
    Settings,
    make_settings,
    place_first,
    simulate_pieces,
    world_plan,
)
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.core.files.shards import Arrays
from driftwalk.core.study_keys import INFERRED_KEYS, INFERRED_RANGES
from driftwalk.model import Study, apply_overrides
from driftwalk.simulation.backend import BROKEN
from driftwalk.sweep import Design, SweepStudy, WorkUnit, grid, settings_per_unit

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class Nodes(SweepStudy["list[list[Record]]"]):
    """Runs at some values of the parameters; a work unit is a few nodes.

    Attributes
    ----------
    study : Study
        With the number of runs, their duration and their seed in its [sensitivity] and [assembly].
    flow : xarray.Dataset
        The flow field.
    names : sequence of str
        Parameters that vary, keys of `INFERRED_KEYS`.
    value : ndarray, shape (node, parameter)
        Their values, SI.
    first_trial : int
        Address of the random numbers of the first node.
    threads : int or None
        Threads of a call.
    """

    study: Study
    flow: xr.Dataset
    names: Sequence[str]
    value: Floats
    first_trial: int
    threads: int | None = None

    names_units: ClassVar = False

    def __call__(self, unit: WorkUnit) -> Arrays:
        """Return the records of the runs of each node of a unit, as text."""
        settings = self.settings(range(unit.start, unit.stop))
        texts = [""] * settings.size
        for number, plan in enumerate(settings.worlds):
            same = np.flatnonzero(settings.world == number).tolist()
            pieces = [Piece(at, range(plan.index.size)) for at in same]
            found, classes = simulate_pieces(plan, settings, pieces)
            sound = (found["status"].astype(np.int64) & BROKEN) == 0
            time = times_of(found["event_step"], time_step=plan.study.time_step_s)
            for place, at in enumerate(same):
                mine = np.flatnonzero(sound) // plan.index.size == place
                rows = np.flatnonzero(sound)[mine]
                texts[at] = records_to_text(
                    records_of_events(
                        time[rows], found["event_class"][rows], classes,
                        blocks=plan.study.assembly.blocks, end=self.study.assembly.duration_s,
                    )
                )  # fmt: skip
        return {"records": np.array(texts, dtype=object)}

    def settings(self, rows: range) -> Settings:
        """Return some nodes as settings of a map.

        Raises
        ------
        InputError
            When the blocks of a node have no room, or its flow does not cover the tank.
        """
        value = self.value[rows.start : rows.stop]
        column = dict(zip(self.names, value.T, strict=True))
        apart = {
            INFERRED_KEYS[name]: column[name] for name in self.names if name not in OF_EACH_RUN
        }
        studies = [
            apply_overrides(self.study, {key: float(row[at]) for key, row in apart.items()})
            for at in range(len(value) if apart else 1)
        ]
        worlds = [world_plan(one, self.flow, threads=self.threads) for one in studies]
        world = np.arange(len(value)) % len(worlds)
        along = {name: column[name] for name in self.names if name in OF_EACH_RUN}
        return make_settings(worlds, world, first_trial=self.first_trial + rows.start, **along)

    def design(self) -> Design:
        """Return the numbers of the nodes."""
        return grid(node=np.arange(len(self.value)))

    @property
    def unit_size(self) -> int:
        """Number of nodes that are simulated and stored at once."""
        assembly = self.study.assembly
        steps = self.study.sensitivity.runs * assembly.duration_s / self.study.time_step_s
        return settings_per_unit(len(self.value), steps * assembly.blocks)

    def result(self, found: Arrays) -> list[list[Record]]:
        """Return the records of the runs of each node; refuse a node that broke down."""
        records = [records_from_text(text) for text in found["records"].tolist()]
        if not all(records):
            raise InputError("all runs of a node broke down: use a smaller time step")
        return records


class DesignPolicy(NamedTuple):
    """Where the emulator is simulated, and when it is refined."""

    first_nodes: int = 32
    """Nodes of the first round for each parameter, spread evenly; chosen by hand."""
    more_nodes: int = 16
    """Nodes of a further round for each parameter; chosen by hand."""
    rounds: int = 4
    """Further rounds at most; chosen by hand."""
    runs: int = 300
    """Simulated runs of a node; chosen by hand."""
    truths: int = 200
    """Data sets of the self-check: a coverage of 90 % is known within 2 %, in closed form."""
    points: int = 8192
    """Sample of the prior, on which posteriors are computed: a power of two. Chosen by hand."""
    noise: float = 0.1
    """Error of the emulator, in parts of the sampling error of the data, below which no further
    node is simulated; chosen by hand."""
    spread: float = 0.5
    """Power of the posterior that places further nodes: below one, its surroundings get some;
    chosen by hand."""
    fewest: int = 20
    """Runs of a node, or truths, without which none is begun; chosen by hand."""


DESIGN_POLICY = DesignPolicy()


@dataclass(frozen=True, eq=False)
class OutcomeProblem:
    """A checked problem: data, study and ranges."""

    observed: Observed
    study: Study
    flow: xr.Dataset
    names: tuple[str, ...]
    low: Floats
    high: Floats
    truths: int
    threads: int | None

    @property
    def seed(self) -> int:
        """Seed of the simulations."""
        return self.study.sensitivity.seed

    @cached_property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of data that all observed runs hold, of those that are simulated."""
        held = set.intersection(*(set(one.kinds) for one in set(self.observed.records)))
        return tuple(kind for kind in KINDS if kind in held)

    def sample(self, count: int, number: int) -> Floats:
        """Return points that fill the unit cube evenly, shape (count, parameter)."""
        from scipy.stats import qmc

        # The seed of a study may be larger than what the scrambling takes.
        seed = (self.seed + number) % 2**31
        # The first points of a balanced set: those of a power of two.
        found: Floats = qmc.Sobol(len(self.names), seed=seed).random(1 << (count - 1).bit_length())
        return found[:count]

    def nodes(self, point: Floats, first_trial: int, runs: int | None = None) -> Nodes:
        """Return simulations at points of the unit cube."""
        study = self.study
        if runs is not None:
            study = apply_overrides(study, {"sensitivity.runs": runs})
        value = self.low + point * (self.high - self.low)
        return Nodes(study, self.flow, self.names, value, first_trial, self.threads)


def check_outcomes(
    outcomes: Outcomes | xr.Dataset,
    flow: xr.Dataset,
    study: Study | None = None,
    *,
    vary: Mapping[str, tuple[float, float]] | None = None,
    after: float | None = None,
    runs: int = DESIGN_POLICY.runs,
    truths: int = DESIGN_POLICY.truths,
    seed: int = 1,
    threads: int | None = None,
) -> OutcomeProblem:
    """Raise the errors that `infer_outcomes` would raise, before any run is simulated.

    Parameters
    ----------
    outcomes, flow, study, vary, after, runs, truths, seed, threads
        As in `infer_outcomes`.

    Returns
    -------
    OutcomeProblem
        Data, study and ranges.

    Raises
    ------
    InputError
        As `infer_outcomes`.

    Examples
    --------
    >>> import driftwalk as dw
    >>> dw.assembly.check_outcomes({"T": -1}, dw.tank30_flow())
    Traceback (most recent call last):
    driftwalk.core.errors.InputError: class T: expected a whole number from 0 on, got -1
    """
    import xarray as xr

    given: Any = [outcomes] if isinstance(outcomes, xr.Dataset) else outcomes
    chosen = Study() if study is None else study
    observed = observed_of(given, after=after, breaks=chosen.assembly.bonds_break)
    for name, number in (("runs", runs), ("truths", truths)):
        if number < DESIGN_POLICY.fewest:
            raise InputError(f"{name}: expected at least {DESIGN_POLICY.fewest}, got {number}")
    if observed.blocks != chosen.assembly.blocks:
        raise InputError(
            f"the outcomes have {observed.blocks} blocks, and the study has "
            f"{chosen.assembly.blocks} (blocks): make them the same"
        )
    names, low, high = _ranges(INFERRED_RANGES if vary is None else vary, chosen)
    over: dict[str, Any] = {"sensitivity.runs": runs, "sensitivity.seed": seed}
    if observed.after is not None:
        over["assembly.duration_s"] = observed.after
    chosen = apply_overrides(chosen, over)
    observed_of(given, after=chosen.assembly.duration_s)
    if chirality_of(chosen) == "merged":
        observed = observed._replace(records=merged(observed.records))
    problem = OutcomeProblem(observed, chosen, flow, names, low, high, truths, threads)
    corners = problem.nodes(np.array([np.zeros(len(names)), np.ones(len(names))]), 0)
    place_first(corners.settings(range(2)))
    return problem


def _ranges(
    vary: Mapping[str, tuple[float, float]], study: Study
) -> tuple[tuple[str, ...], Floats, Floats]:
    """Return names and ranges of the parameters."""
    for name, ends in vary.items():
        if name not in INFERRED_KEYS:
            raise InputError(f"vary: there is no '{name}'; choose from {', '.join(INFERRED_KEYS)}")
        if len(ends) != 2 or not ends[0] < ends[1]:
            raise InputError(f"vary {name}: expected the lowest and the highest value, got {ends}")
        try:
            for end in ends:
                apply_overrides(study, {INFERRED_KEYS[name]: float(end)})
        except ConfigurationError as error:
            raise InputError(f"vary {name}: {error}") from error
    if not 2 <= len(vary) <= 4:
        raise InputError(f"vary: expected two to four parameters, got {len(vary)}")
    low, high = np.array(list(vary.values()), dtype=np.float64).T
    return tuple(vary), low, high


class Emulated(NamedTuple):
    """Nodes, and an emulator of each kind of data."""

    node: Floats
    categories: Mapping[str, Categories]
    emulators: Mapping[str, Emulator]
    point: Floats
    """Sample of the prior in parts of the ranges, shape (point, parameter)."""
    noise: Mapping[str, float]
    """Error of the emulator of each kind of data that was observed, over its sampling error."""


class Checked(NamedTuple):
    """Result of the self-check."""

    truth: Floats
    coverage: Mapping[str, Coverage]
    log_likelihood: Mapping[str, Floats]
    """Of the observed runs, by kind of data, at the points."""
    p: float
    """Share of the data sets, the real one too, that agree with the emulator no better than it."""

    @property
    def explained(self) -> bool:
        """Whether some setting agrees with the outcomes, as far as so many data sets can tell."""
        return self.p >= max(CREDIBLE_REGION.least_p, 1.5 / (len(self.truth) + 1))
