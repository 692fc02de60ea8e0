"""Plan the control of self-assembly: a policy from runs in all modes, then from its own runs.

Whole runs of the microscopic engine then improve the policy without a model. Each world has its own
mode in every cell: a phase of the run, a class, and an age. Whether it reached the target counts
for all cells that it visited, each with the mode it had there (Monte Carlo control; Sutton and
Barto, Reinforcement learning, chapter 5). The probability that a mode of a cell reaches the target
has a Beta law. Modes are drawn in proportion to their probability of being the best (Thompson
1933), so that most worlds soon try what may be better.

A stored policy gives its modes and rules, ready to run.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from driftwalk.assembly.control.decision_process import (
    PROCESS_POLICY,
    Decisions,
    age_bin,
    gains,
    phase_of,
    transitions,
    value_iteration,
)
from driftwalk.assembly.control.modes import Modes
from driftwalk.assembly.control.worlds import Rules, Wanted, Worlds, decisions_of
from driftwalk.assembly.outcomes.outcome_classes import outcome_classes, target_class
from driftwalk.core.arrays import Floats, Integers
from driftwalk.core.errors import InputError
from driftwalk.core.files.shards import Arrays
from driftwalk.core.intervals import proportion_interval
from driftwalk.schema.check import build_dataset, require_kind
from driftwalk.schema.shapes import all_single
from driftwalk.sweep import Store, grid
from driftwalk.sweep.run import SweepSeries

if TYPE_CHECKING:
    import xarray as xr


class ImprovementPolicy(NamedTuple):
    """How much a plan and earlier runs count."""

    weight: float = 150.0
    """Worlds that value iteration counts for in each cell; measured: 20 took twice as many
    rounds."""
    kept: float = 0.9
    """Share of what earlier rounds count for: the policy around a cell was another one. By hand."""
    greedy: int = 4
    """Every such world follows the best policy so far; chosen by hand."""


IMPROVEMENT_POLICY = ImprovementPolicy()


class Cells(NamedTuple):
    """Worlds that reached the target and that did not, (phase, class, age bin, mode)."""

    reached: Floats
    failed: Floats

    def best(self) -> Integers:
        """Return the mode of each cell with the largest mean, shape (phase, class, age bin)."""
        return np.asarray((self.reached / (self.reached + self.failed)).argmax(axis=-1))

    def drawn(self, worlds: int, random: np.random.Generator) -> Integers:
        """Return modes for worlds, shape (world, phase, class, age bin)."""
        made = np.broadcast_to(self.best(), (worlds, *self.reached.shape[:-1])).copy()
        for at in np.flatnonzero(np.arange(worlds) % IMPROVEMENT_POLICY.greedy):
            made[at] = random.beta(self.reached, self.failed).argmax(axis=-1)
        return made

    def updated(self, found: Arrays, modes: Integers, hit: Floats) -> Cells:
        """Return what is known after worlds that had these modes.

        A cell counts where its mode was taken: not after a missed look, nor in the dwell of another
        mode.

        Parameters
        ----------
        found : dict of str to ndarray
            What the worlds did, as `Worlds` returns it.
        modes : ndarray of int, shape (world, phase, class, age bin)
            Their modes.
        hit : ndarray, shape (world,)
            1 where the target was reached, else 0.
        """
        seen, periods = found["seen"], found["seen"].shape[1]
        known = (seen >= 0) & (found["free"] > 0)
        world = np.nonzero(known)[0]
        phase = np.array([phase_of(left) for left in range(periods, 0, -1)])
        cell = np.stack([
            world, np.broadcast_to(phase, seen.shape)[known], seen[known],
            age_bin(found["age"][known]),
        ])  # fmt: skip
        own = np.unique(cell, axis=1)
        place = (*own[1:], modes[tuple(own)])
        counts = np.zeros((2, *self.reached.shape))
        np.add.at(counts[0], place, hit[own[0]])
        np.add.at(counts[1], place, 1.0 - hit[own[0]])
        return Cells(self.reached + counts[0], self.failed + counts[1])

    def faded(self, prior: Cells) -> Cells:
        """Return what is known when the worlds count for less, and the prior as before."""
        kept = IMPROVEMENT_POLICY.kept
        return Cells(*(own + kept * (now - own) for own, now in zip(prior, self, strict=True)))


def prior_of(gain: Floats, *, scale: float) -> Cells:
    """Return what value iteration says of the cells.

    Parameters
    ----------
    gain : ndarray, shape (phase, class, age bin, mode)
        As `gains` returns it.
    scale : float
        Factor on it: what its best policy reached over what it promised.
    """
    mean = np.clip(scale * gain, 0.01, 0.99)
    return Cells(IMPROVEMENT_POLICY.weight * mean, IMPROVEMENT_POLICY.weight * (1.0 - mean))


def cells_like(classes: int) -> tuple[int, int, int]:
    """Return the shape of a policy: phases, classes, bins of age."""
    return len(PROCESS_POLICY.phase_starts), classes, len(PROCESS_POLICY.age_starts)


class ControlPolicy(NamedTuple):
    """How a policy is planned."""

    most_blocks: int = 7
    """Blocks, at most: 7 have 200 classes; chosen by hand."""
    modelled: int = 2
    """Rounds by value iteration; more of them reach no more (`studies/control`)."""
    drawn: int = 20
    """Policies of a round, a quarter of them the best, the others of drawn probabilities; by hand.
    """
    unit: int = 250
    """Worlds of a work unit, about a second; chosen by hand."""
    confidence: float = 0.9
    """Of the intervals; by convention the same in all of driftwalk."""


CONTROL_POLICY = ControlPolicy()


def check_control(modes: Modes, wanted: Wanted) -> Wanted:
    """Return what is wanted, its target as runs name it; refuse what no policy can be planned for.

    Parameters
    ----------
    modes : Modes
        The modes.
    wanted : Wanted
        What is to be reached.

    Raises
    ------
    InputError
        When the target has another number of blocks, a time is out of range, or mirror images are
        distinct: the stream of a tracker merges them.

    Examples
    --------
    >>> import driftwalk as dw
    >>> from driftwalk.assembly import ModeSource, make_modes
    >>> modes = make_modes([ModeSource(dw.Study(), dw.tank30_flow())], flow_scales=[0.0, 1.0])
    >>> check_control(modes, Wanted("1+I3", 60.0, 5.0)).target
    'I3+1'
    """
    blocks = modes.study.assembly.blocks
    if not modes.study.block.has_lattice:
        shape = modes.study.block.shape
        raise InputError(
            f"control chooses by the shapes that squares build, and the body is '{shape}' "
            "(`block.shape`): plan with the fit of a square block"
        )
    if not 2 <= blocks <= CONTROL_POLICY.most_blocks:
        raise InputError(
            f"control is planned for 2 to {CONTROL_POLICY.most_blocks} blocks, got {blocks}"
        )
    if modes.study.assembly.chirality != "merged":
        raise InputError(
            "control needs chirality merged: the stream of a tracker names mirror images alike"
        )
    target = target_class(wanted.target, [blocks], chirality="merged")
    interval = modes.study.forces.force_interval_s
    if not interval <= wanted.every_s < np.inf:
        raise InputError(
            f"decisions every {wanted.every_s:g} s are below the {interval:g} s between two forces"
        )
    if not wanted.every_s <= wanted.by_s:
        raise InputError(
            f"the deadline must not be shorter than the decision period of {wanted.every_s:g} s, "
            f"got {wanted.by_s:g} s"
        )
    whole = wanted.by_s / wanted.every_s
    if abs(whole - round(whole)) > 1e-6 * whole:
        raise InputError(
            f"the deadline of {wanted.by_s:g} s is not a whole number of periods of "
            f"{wanted.every_s:g} s: choose another deadline or period"
        )
    wanted.require_in_range()
    if not 0.0 <= wanted.dwell_s <= wanted.by_s:
        raise InputError(
            f"the dwell must lie between 0 s and the deadline, got {wanted.dwell_s:g} s"
        )
    return replace(wanted, target=target)


def plan_control(
    modes: Modes,
    target: str,
    by: float,
    *,
    every: float = 5.0,
    latency: float = 0.0,
    missed: float = 0.0,
    dwell: float = 0.0,
    rounds: int = 12,
    worlds: int = 1000,
    seed: int = 1,
    store: Callable[[str], Store] | None = None,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Return which mode of agitation to choose when, so that a class is reached by a deadline.

    Each mode is run on its own first. In the first rounds, transitions between classes are
    estimated from all worlds so far, and fresh worlds run under policies of value iteration: the
    best one, and those of transitions drawn from what is known. In the later ones, the policy is
    improved by what whole worlds reach.

    Parameters
    ----------
    modes : Modes
        The modes, see `make_modes`.
    target : str
        Outcome class to be reached, such as "T".
    by : float
        Deadline [s].
    every : float
        Time between two decisions [s].
    latency : float
        From a look at the tank until the pumps have changed [s], below `every`.
    missed : float
        Share of the observations that give no class, 0 to below 1; the mode is held then.
    dwell : float
        Shortest time for which a mode is held [s].
    rounds : int
        Rounds of planning, from 1.
    worlds : int
        Worlds of a round, from 20.
    seed : int
        Seed of all worlds.
    store : callable, optional
        Returns the store of a sweep by its name, for example of a run directory, to be continued.
    executor : concurrent.futures.Executor, optional
        Computes work units elsewhere; the result does not depend on it.
    progress : callable, optional
        Called as ``progress(done, total)``.

    Returns
    -------
    xarray.Dataset
        Kind "control_policy". ``action`` on (phase, class, age); ``constant_reached`` on (mode);
        ``promised`` and ``reached`` on (round). The yield that is stated, ``attrs["reached"]`` with
        its interval, is that of fresh worlds.

    Raises
    ------
    InputError
        When the target has another number of blocks, or a number is out of range.

    Notes
    -----
    Puterman, Markov decision processes (1994), chapter 4; see docs/how-to/control.md.

    Examples
    --------
    >>> import driftwalk as dw
    >>> from driftwalk.assembly import ModeSource, make_modes
    >>> one = ModeSource(dw.Study(assembly={"blocks": 2}), dw.tank30_flow())
    >>> modes = make_modes([one], flow_scales=[0.0, 1.0])
    >>> policy = plan_control(modes, "2", 20.0, rounds=1, worlds=20)
    >>> policy.attrs["target"], policy.sizes["mode"]
    ('2', 2)
    """
    if rounds < 1 or worlds < 20:
        raise InputError(f"at least 1 round and 20 worlds are needed, got {rounds} and {worlds}")
    wanted = check_control(modes, Wanted(target, by, every, latency, missed, dwell))
    classes = outcome_classes(modes.study.assembly.blocks)
    planner = _Planner(
        modes, wanted, classes, worlds, seed,
        SweepSeries(worlds * (rounds + 6), store, executor, progress),
    )  # fmt: skip
    return planner.plan(rounds)


@dataclass
class _Planner:
    modes: Modes
    wanted: Wanted
    classes: tuple[str, ...]
    worlds: int
    seed: int
    sweeps: SweepSeries
    used: int = 0
    """Worlds so far: the number of the next new one."""
    safe: int = 0
    """Best mode alone."""

    def plan(self, rounds: int) -> xr.Dataset:
        """Return the policy."""
        none = np.zeros((1, *cells_like(len(self.classes))), dtype=np.int64)
        # The modes in turn, each in the same number of worlds.
        size = self.modes.size
        each = -(-self.worlds // size)
        alone = self.run("constant", none, worlds=each * size, turn=size, arm="constant")
        own = np.arange(each * size) % size
        hits = np.bincount(own, weights=self.hit(alone), minlength=size)
        constant = hits.astype(np.float64)
        self.safe, seen = int(constant.argmax()), [decisions_of(alone)]
        promised, reached = np.full((2, rounds), np.nan)
        count = CONTROL_POLICY.drawn
        best = np.arange(self.worlds) % count < count // 4
        for at in range(min(CONTROL_POLICY.modelled, rounds)):
            random = np.random.default_rng([self.seed, at])
            plans = [self.planned(seen, random if k >= count // 4 else None) for k in range(count)]
            promised[at] = plans[0][1]
            tables = np.stack([gain.argmax(axis=-1) for gain, _ in plans])
            followed = self.run(f"round_{at}", tables, turn=count)
            seen.append(decisions_of(followed))
            reached[at] = self.hit(followed)[best].mean()
        gain, promise = self.planned(seen)
        scale = float(np.nanmean(reached)) / max(promise, 1e-9)
        prior = known = prior_of(gain, scale=min(scale, 1.0))
        best = np.arange(self.worlds) % IMPROVEMENT_POLICY.greedy == 0
        for at in range(min(CONTROL_POLICY.modelled, rounds), rounds):
            modes = known.drawn(self.worlds, np.random.default_rng([self.seed, at]))
            followed = self.run(f"round_{at}", modes, turn=IMPROVEMENT_POLICY.greedy)
            reached[at] = self.hit(followed)[best].mean()
            known = known.faded(prior).updated(followed, modes, self.hit(followed))
        # The policy, that of the model and the best mode alone are compared in the same worlds.
        last = [known.best(), gain.argmax(axis=-1), np.full_like(known.best(), self.safe)]
        shared = self.used
        again = [
            self.hit(self.run(f"final_{at}", one[None], first=shared)).sum()
            for at, one in enumerate(last)
        ]
        action = last[int(np.argmax(again))]
        fresh = self.hit(self.run("fresh", action[None], worlds=2 * self.worlds))
        return self.dataset(action, constant, each, promised, reached, fresh)

    def planned(
        self, seen: list[Decisions], random: np.random.Generator | None = None
    ) -> tuple[Floats, float]:
        """Return the gains of all modes for what was seen, or drawn from it, and the promise."""
        probability = transitions(
            seen, classes=len(self.classes), modes=self.modes.size, random=random
        )
        target = self.classes.index(self.wanted.target)
        plan = value_iteration(probability, target=target, periods=self.wanted.periods)
        start = self.classes.index(all_single(self.modes.study.assembly.blocks))
        return gains(probability, plan), float(plan.value[-1, start, 0])

    def hit(self, found: Arrays) -> Floats:
        """Return which worlds are in the target at the deadline, as 0 and 1."""
        target = self.classes.index(self.wanted.target)
        return np.asarray(found["after"][:, -1] == target, dtype=np.float64)

    def run(
        self, name: str, tables: Integers, *, worlds: int | None = None, first: int | None = None,
        **how: Any,
    ) -> Arrays:  # fmt: skip
        """Return what worlds did; they are new ones unless the number of the first is given."""
        count = self.worlds if worlds is None else worlds
        begin = self.used if first is None else first
        self.used = max(self.used, begin + count)
        rules = Rules(tables.astype(np.int16), self.safe, self.wanted.dwell)
        work = Worlds(
            self.modes, self.classes, self.wanted, rules, self.seed, begin, **how
        )  # fmt: skip
        units = grid(world=np.arange(begin, begin + count)).units(CONTROL_POLICY.unit)
        return self.sweeps.run(name, work, units)

    def dataset(
        self, action: Integers, constant: Floats, each: int, promised: Floats, reached: Floats,
        fresh: Floats,
    ) -> xr.Dataset:  # fmt: skip
        """Return the policy as a dataset."""
        share = CONTROL_POLICY.confidence
        low, high = proportion_interval(fresh.sum(), fresh.size, confidence=share)
        wanted, modes = self.wanted, self.modes
        flow = modes.flows[0]
        data = {
            "action": (("phase", "class", "age"), action.astype(np.int32)),
            "flow": ("mode", modes.flow.astype(np.int32)),
            "flow_scale": ("mode", modes.flow_scale),
            "force_std": (("mode", "draw"), modes.force_std),
            "drag_coefficient": (("mode", "draw"), modes.drag_coefficient),
            "constant_reached": ("mode", constant / each),
            "promised": ("round", promised),
            "round_reached": ("round", reached),
            **{
                name: (("field", "y", "x"), np.stack([one[name].values for one in modes.flows]))
                for name in ("u", "v", "flag")
            },
        }
        coords = {
            "phase": ("phase", wanted.every_s * np.array(PROCESS_POLICY.phase_starts)),
            "class": ("class", np.array(self.classes, dtype=object)),
            "age": ("age", wanted.every_s * np.array(PROCESS_POLICY.age_starts)),
            "mode": ("mode", np.array(modes.name, dtype=object)),
            "y": ("y", flow["y"].values),
            "x": ("x", flow["x"].values),
        }
        return build_dataset("control_policy", data, coords, {
            **asdict(wanted),
            "reached": float(fresh.mean()), "reached_low": float(low), "reached_high": float(high),
            "confidence": share, "worlds": int(fresh.size), "worlds_used": self.used,
            "constant_worlds": each, "safe_mode": modes.name[int(constant.argmax())],
            "blocks": modes.study.assembly.blocks,
            "arena": modes.study.tank.to_arena_json(), "block_side_m": modes.study.block.side_m,
            "study": modes.study.to_toml(), "seed": self.seed,
        })  # fmt: skip


def stored_wanted(policy: xr.Dataset) -> Wanted:
    """Return what a policy was planned for.

    Parameters
    ----------
    policy : xarray.Dataset
        A `control_policy`.
    """
    facts = policy.attrs
    names = ("by_s", "every_s", "latency_s", "missed", "dwell_s")
    return Wanted(str(facts["target"]), *(float(facts[name]) for name in names))


def stored_rules(policy: xr.Dataset) -> Rules:
    """Return the rules of a policy.

    Parameters
    ----------
    policy : xarray.Dataset
        A `control_policy`.

    Raises
    ------
    InputError
        When the dataset is of another kind, or its safe mode is none of its modes.
    """
    require_kind(policy, "control_policy", "plan one first (driftwalk control plan)")
    names = [str(name) for name in policy["mode"].values]
    if policy.attrs["safe_mode"] not in names:
        raise InputError(f"the safe mode {policy.attrs['safe_mode']} is none of {names}")
    action = policy["action"].values.astype("int64")
    if not ((action >= 0) & (action < len(names))).all():
        raise InputError(f"the policy chooses modes that are none of its {len(names)}")
    if action.shape != cells_like(policy.sizes["class"]):
        raise InputError(f"the policy has other phases or ages: {action.shape}")
    wanted = stored_wanted(policy)
    return Rules(action[None], names.index(policy.attrs["safe_mode"]), wanted.dwell)


def stored_modes(policy: xr.Dataset) -> Modes:
    """Return the modes of a policy, with their flows.

    Parameters
    ----------
    policy : xarray.Dataset
        A `control_policy`.
    """
    from driftwalk.model import parse_study

    about = {"kind": "flow_field", "schema_version": 1, "arena": policy.attrs["arena"]}
    fields = [policy[["u", "v", "flag"]].isel(field=at) for at in range(policy.sizes["field"])]
    for field in fields:
        field.attrs = dict(about)
    return Modes(
        parse_study(policy.attrs["study"], source="the policy's study"),
        tuple(fields),
        tuple(str(name) for name in policy["mode"].values),
        policy["flow"].values.astype("int64"),
        policy["flow_scale"].values,
        policy["force_std"].values,
        policy["drag_coefficient"].values,
    )
