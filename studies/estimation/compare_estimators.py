"""Compare driftwalk's estimation of parameters with sbi and pyABC on the same summaries.

    python studies/estimation/compare_estimators.py OUT.jsonl [--problem run_tumble]
        [--method driftwalk ...] [--recordings 24]
    python studies/estimation/compare_estimators.py OUT.jsonl --table [--recordings 8]

Recordings are simulated by the model itself, ten minutes at 10 Hz in a round arena of 30 cm, with
0.3 mm of stated noise. The logarithms of the true values are drawn evenly from the ranges below,
which are the prior of every method. OUT gets a line of JSON for each recording and method; what is
there is not done again. The budgets of sbi and pyABC are the simulations that driftwalk has made of
the same recording, so driftwalk comes first.
"""

from __future__ import annotations

import argparse
import json
import logging
import os
import platform
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import chdir, contextmanager
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final, NamedTuple
from unittest.mock import patch

import numpy as np
import xarray as xr

sys.path.append(str(Path(__file__).resolve().parents[1] / "likelihood"))

from lines import read_lines

import driftwalk as dw
from driftwalk.calibration.estimation.summaries import (
    SummaryObjective,
    SummaryPlan,
    summarise,
)
from driftwalk.calibration.held_out.candidates import prepare_candidates
from driftwalk.calibration.held_out.held_out_score import even_blocks
from driftwalk.calibration.held_out.recorded import body_motion
from driftwalk.comparison.aspects import form_aspects
from driftwalk.conditions import recorded_conditions
from driftwalk.core.arrays import Floats
from driftwalk.core.progress import ignore_progress
from driftwalk.core.random_streams import world_keys
from driftwalk.model import apply_overrides
from driftwalk.motion import ParticleModel
from driftwalk.schema import Track, build_trajectory
from driftwalk.simulation.backend import Camera

Line = dict[str, Any]


class Problem(NamedTuple):
    """A model, the values that are known, and the ranges of the others, on logarithmic scales."""

    model: str
    known: dict[str, float]
    ranges: dict[str, tuple[float, float]]


PROBLEMS: Final = {
    "run_tumble": Problem(
        "run_tumble",
        {"speed_cv": 0.3, "turn_rate": 0.0},
        {
            "speed": (0.02, 0.06),
            "run_time": (0.5, 8.0),
            "turn_std": (0.3, 2.0),
            "rotational_diffusion": (0.02, 0.5),
        },
    ),
    "two_state": Problem(
        "two_state",
        {},
        {
            "slow_speed": (0.005, 0.02),
            "fast_speed": (0.03, 0.06),
            "speed_cv": (0.1, 0.4),
            "slow_time": (1.0, 4.0),
            "fast_time": (1.5, 6.0),
            "slow_rotational_diffusion": (0.25, 1.0),
            "fast_rotational_diffusion": (0.025, 0.1),
            "turn_std": (0.5, 2.0),
            "relaxation_time": (0.15, 0.6),
        },
    ),
}
"""Ranges in m/s, s, rad and rad2/s; chosen before anything was estimated."""
DURATION_S: Final = 600.0
RATE_HZ: Final = 10.0
NOISE_M: Final = 3e-4
SEED: Final = 61_000
"""Of the recordings, with the problem and the number of each; no other study uses it."""
REFERENCE: Final = 10_000
"""Number of the recording whose conditions the training of NPE has; it is not estimated."""
CONFIDENCE: Final = 0.9
TRAININGS: Final = {"npe": 1, "npe_10": 10}
"""Simulations that train an NPE, in medians of those that driftwalk makes of one recording."""
ROUNDS: Final = 4
"""Of sequential NPE; the budget is the same in all."""
POPULATION: Final = 200
BATCH: Final = 16
DRAWS: Final = 1000


def study_of() -> dw.Study:
    """Return the default study with the noise of the camera."""
    return apply_overrides(dw.Study(), {"observation.position_noise_m": NOISE_M})


def model_of(problem: Problem) -> ParticleModel:
    """Return the model with the ranges of the problem."""
    model = dw.motion_model(problem.model, clearance=0.0, **problem.known, **problem.ranges)
    assert isinstance(model, ParticleModel)
    return model


def truth_of(name: str, number: int) -> dict[str, float]:
    """Return the true values of a recording."""
    random = np.random.default_rng((SEED, sorted(PROBLEMS).index(name), number))
    return {
        parameter: float(low * (high / low) ** random.uniform())
        for parameter, (low, high) in PROBLEMS[name].ranges.items()
    }


def simulated(name: str, number: int) -> xr.Dataset:
    """Return a recording of known truth."""
    study, problem = study_of(), PROBLEMS[name]
    time_s = np.arange(int(DURATION_S * RATE_HZ)) / RATE_HZ
    # The body sets out in the middle of the arena, along the first recorded step.
    begun = Track(time_s, 1e-3 * time_s, 0.0 * time_s, np.full(time_s.size, np.nan))
    like = recorded_conditions(
        begun, study, camera=Camera(position_noise=NOISE_M), flow=None, threads=1
    )
    values = {key: np.array([value]) for key, value in truth_of(name, number).items()}
    keys = world_keys(SEED + sorted(PROBLEMS).index(name), trial=np.array([number]), replicate=0)
    seen = model_of(problem).simulate(values, like, keys)
    arena = {"arena": study.tank.to_arena_json(), "simulated": "yes"}
    return build_trajectory(time_s, seen.x[0], seen.y[0], attrs=arena)


class Simulator:
    """The simulations of a recording that driftwalk's estimation makes, and their summaries.

    Parameters
    ----------
    name : str
        A key of `PROBLEMS`.
    number : int
        Of the recording.

    Attributes
    ----------
    recorded : ndarray, shape (summaries,)
        Of the recording.
    """

    def __init__(self, name: str, number: int) -> None:
        motion = body_motion(simulated(name, number), study_of(), flow=None, body=None, threads=1)
        (entry,), _ = prepare_candidates([model_of(PROBLEMS[name])], motion)
        found = {one.name: (one.low, one.high) for one in entry.ranges}
        assert found == PROBLEMS[name].ranges, f"the recording changes the prior: {found}"
        even = even_blocks(entry, motion)
        objective = SummaryObjective(even, motion, store=None, tell=ignore_progress, most=0)
        self.ranges, self.motion = entry.ranges, motion
        self.names = [one.name for one in entry.ranges]
        self.plan: SummaryPlan = objective.plans[0]
        self.recorded: Floats = objective.recorded[0]
        # Not the random numbers of driftwalk's own estimation.
        self._worlds = replace(even, seed=SEED + 1000 + number)
        self._done = 0

    def __call__(self, settings: Floats) -> Floats:
        """Return the summaries of settings in the unit cube, in the recording's own scales."""
        return np.array([summarise(self.plan, x, y) for x, y in self._positions(settings)])

    def as_recordings(self, settings: Floats) -> Floats:
        """Return the summaries of settings, each in the scales that it would have as a recording.

        The last two columns are the logarithms of these scales, its usual step and its largest
        distance from the wall, so that one network can read the summaries of all recordings.
        """
        rows = []
        for x, y in self._positions(settings):
            aspects = form_aspects(self.plan.aspects, x, y, wall=self.plan.wall)
            points = {one.name: one.points for one in aspects}
            unit = float(np.median(points["steps"][:, 0]))
            depth = float(points["wall"][:, 0].max())
            plan = replace(self.plan, unit=unit, depth=depth)
            rows.append([*summarise(plan, x, y), np.log(unit), np.log(depth)])
        return np.array(rows)

    @cached_property
    def recorded_with_scales(self) -> Floats:
        """The recording as `as_recordings` shows simulations."""
        scales = np.log([self.motion.usual_step, self.motion.depth])
        return np.concatenate([self.recorded, scales])

    def _positions(self, settings: Floats) -> Iterator[tuple[Floats, Floats]]:
        """Yield the positions of one simulation of each setting."""
        for first in range(0, len(settings), 256):
            part = settings[first : first + 256]
            seen = self._worlds.simulated(part, 1, stage="tried", first=self._done)
            self._done += len(part)
            yield from zip(seen.x, seen.y, strict=True)


class Answer(NamedTuple):
    """What a method says of a recording."""

    estimate: dict[str, float]
    interval: dict[str, tuple[float, float]]
    simulations: int
    seconds: float
    processor_seconds: float
    more: Line


class Clock:
    """Seconds since it was made, of the wall and of the processor."""

    def __init__(self) -> None:
        self._began, self._used = time.perf_counter(), time.process_time()

    def read(self) -> tuple[float, float]:
        """Return both."""
        return time.perf_counter() - self._began, time.process_time() - self._used


@contextmanager
def counted() -> Iterator[list[int]]:
    """Count the worlds that are simulated meanwhile."""
    count, simulate = [0], ParticleModel.simulate

    def counting(self: ParticleModel, values: Any, like: Any, keys: Any) -> Any:
        count[0] += keys.size
        return simulate(self, values, like, keys)

    with patch.object(ParticleModel, "simulate", counting):
        yield count


def by_driftwalk(name: str, number: int) -> Answer:
    """Calibrate as `driftwalk calibrate --model` does; its check of the model counts apart."""
    recording, marks, clock = simulated(name, number), {}, Clock()
    with counted() as worlds:

        def tell(stage: str, _done: int, _most: int) -> None:
            marks.setdefault(stage, (worlds[0], *clock.read()))

        found = dw.calibration.calibrate(
            recording, model_of(PROBLEMS[name]), study=study_of(), threads=1, tell=tell
        )
        tell("end", 1, 1)
    names = found["parameter"].values.tolist()
    return Answer(
        dict(zip(names, found["estimate"].values.tolist(), strict=True)),
        {
            parameter: (float(low), float(high))
            for parameter, (low, high) in zip(names, found["interval"].values, strict=True)
        },
        *marks["judged"],
        {
            "estimate_from": found.attrs["estimate_from"],
            "determined": dict(zip(names, found["determined"].values.tolist(), strict=True)),
            "with_check": {"simulations": marks["end"][0], "seconds": marks["end"][1]},
        },
    )


def values_of(
    simulator: Simulator, quantiles: Sequence[Floats]
) -> tuple[dict[str, float], dict[str, tuple[float, float]]]:
    """Return medians and intervals of 5, 50 and 95 % quantiles in the unit cube."""
    estimate, interval = {}, {}
    for one, (low, middle, high) in zip(simulator.ranges, quantiles, strict=True):
        estimate[one.name] = float(one.value_at(middle))
        interval[one.name] = (float(one.value_at(low)), float(one.value_at(high)))
    return estimate, interval


QUANTILES: Final = (0.5 - CONFIDENCE / 2.0, 0.5, 0.5 + CONFIDENCE / 2.0)


def new_npe(parameters: int, seed: int) -> tuple[Any, Any]:
    """Return a trainer with the defaults of sbi, and its prior."""
    import torch
    from sbi.inference import NPE
    from sbi.utils import BoxUniform

    torch.set_num_threads(1)
    torch.manual_seed(seed)
    prior = BoxUniform(torch.zeros(parameters), torch.ones(parameters))
    return NPE(prior=prior, show_progress_bars=False), prior


def tensor(values: Floats) -> Any:
    """Return an array as sbi wants it."""
    import torch

    return torch.as_tensor(np.asarray(values), dtype=torch.float32)


class Features(NamedTuple):
    """Summaries as a network gets them, without those that hardly ever vary."""

    used: np.ndarray
    low: Floats
    high: Floats

    @classmethod
    def of(cls, seen: Floats) -> Features:
        """Return the features of simulations; values end where sbi warns of outliers."""
        first, third = np.quantile(seen, (0.25, 0.75), axis=0)
        reach = 10.0 * (third - first)
        return cls(reach > 0.0, first - reach, third + reach)

    def __call__(self, seen: Floats) -> Any:
        """Return summaries as sbi wants them."""
        return tensor(np.clip(seen, self.low, self.high)[..., self.used])


class Training(NamedTuple):
    """A network that was trained once for all recordings."""

    posterior: Any
    features: Features
    line: Line


class Trainings:
    """Trains the amortised networks of a problem, when they are asked for."""

    def __init__(self, name: str, budget: int) -> None:
        self.name, self.budget = name, budget
        self._found: dict[str, Training] = {}

    @cached_property
    def simulations(self) -> tuple[Floats, Floats, tuple[float, float]]:
        """Settings, their summaries, and seconds and processor time; networks share them."""
        count = self.budget * max(TRAININGS.values())
        simulator = Simulator(self.name, REFERENCE)
        settings = np.random.default_rng(SEED).uniform(size=(count, len(simulator.names)))
        clock = Clock()
        seen = simulator.as_recordings(settings)
        return settings, seen, clock.read()

    def __call__(self, method: str) -> Training:
        """Return the network of a method."""
        if method not in self._found:
            settings, seen, simulating = self.simulations
            count, clock = self.budget * TRAININGS[method], Clock()
            features = Features.of(seen[:count])
            trainer, _ = new_npe(settings.shape[1], SEED)
            trainer.append_simulations(tensor(settings[:count]), features(seen[:count]))
            trainer.train()
            training, training_processor = clock.read()
            share = count / len(seen)
            line = {
                "problem": self.name,
                "training": method,
                "simulations": count,
                "simulating_seconds": share * simulating[0],
                "training_seconds": training,
                "processor_seconds": share * simulating[1] + training_processor,
                "epochs": int(trainer.summary["epochs_trained"][-1]),
            }
            self._found[method] = Training(trainer.build_posterior(), features, line)
        return self._found[method]


def by_npe(training: Training, simulator: Simulator) -> Answer:
    """Ask a trained network for a recording's parameters."""
    clock = Clock()
    asked = training.features(simulator.recorded_with_scales)
    draws = training.posterior.sample((DRAWS,), x=asked, show_progress_bars=False)
    estimate, interval = values_of(simulator, np.quantile(draws.numpy(), QUANTILES, axis=0).T)
    return Answer(estimate, interval, 0, *clock.read(), {})


def by_sequential_npe(simulator: Simulator, budget: int, seed: int) -> Answer:
    """Train a network for one recording, each round on settings that the last one proposes."""
    clock = Clock()
    trainer, proposal = new_npe(len(simulator.names), seed)
    features = None
    for _ in range(ROUNDS):
        settings = proposal.sample((budget // ROUNDS,)).numpy().astype(np.float64)
        seen = simulator(settings)
        # Later rounds have to have the features of the first.
        features = features or Features.of(seen)
        trainer.append_simulations(tensor(settings), features(seen), proposal=proposal)
        trainer.train()
        proposal = trainer.build_posterior().set_default_x(features(simulator.recorded))
    draws = proposal.sample((DRAWS,), show_progress_bars=False).numpy()
    estimate, interval = values_of(simulator, np.quantile(draws, QUANTILES, axis=0).T)
    return Answer(estimate, interval, ROUNDS * (budget // ROUNDS), *clock.read(), {})


def batch_sampler(simulator: Simulator) -> Any:
    """Return a sampler of pyABC that simulates 16 particles at once.

    The simulations of driftwalk take half as long in batches. Each particle waits where its model
    asks for a simulation, until all of a batch do; those after the last that is needed are dropped.
    """
    from greenlet import greenlet
    from pyabc.sampler import Sampler

    class Batches(Sampler):
        """Particles in batches, in the order in which they are drawn."""

        def sample_until_n_accepted(self, n: int, simulate_one: Any, *_: Any, **__: Any) -> Any:
            """Return particles until enough are accepted."""
            sample, self.nr_evaluations_ = self._create_empty_sample(), 0
            while sample.n_accepted < n:
                particles = [greenlet(simulate_one) for _ in range(BATCH)]
                settings = np.array([one.switch() for one in particles])
                for one, seen in zip(particles, simulator(settings), strict=True):
                    found = one.switch(seen)
                    if sample.n_accepted < n:
                        sample.append(found)
                self.nr_evaluations_ += BATCH
            return sample

    return Batches()


def by_pyabc(simulator: Simulator, budget: int, seed: int, *, learned: bool) -> Answer:
    """Run ABC-SMC until the generation that reaches the budget.

    With learned summaries, a linear regression of the parameters on the summaries takes their place
    from 40 % of the budget on.
    """
    import pyabc
    from greenlet import getcurrent
    from pyabc.predictor import LinearPredictor
    from pyabc.sumstat import PredictorSumstat
    from pyabc.util import EventIxs
    from pyabc.weighted_statistics import weighted_quantile

    logging.getLogger("ABC").setLevel(logging.WARNING)
    np.random.seed(seed)  # noqa: NPY002
    clock = Clock()

    def model(parameters: Any) -> dict[str, Floats]:
        setting = [parameters[one] for one in simulator.names]
        return {"summaries": getcurrent().parent.switch(setting)}

    learn = EventIxs(sims=int(0.4 * budget))
    sumstat = PredictorSumstat(LinearPredictor(), fit_ixs=learn) if learned else None
    search = pyabc.ABCSMC(
        model,
        pyabc.Distribution(**{one: pyabc.RV("uniform", 0.0, 1.0) for one in simulator.names}),
        pyabc.AdaptivePNormDistance(p=1, sumstat=sumstat),
        population_size=POPULATION,
        sampler=batch_sampler(simulator),
    )
    search.new("sqlite://", {"summaries": simulator.recorded})
    history = search.run(max_total_nr_simulations=budget)
    settings, weights = history.get_distribution(m=0)
    quantiles = [
        [weighted_quantile(settings[one].to_numpy(), weights, alpha=part) for part in QUANTILES]
        for one in simulator.names
    ]
    more = {
        "generations": history.max_t + 1,
        "effective": float(1.0 / np.sum(weights**2)),
    }
    return Answer(
        *values_of(simulator, np.array(quantiles)),
        history.total_nr_simulations,
        *clock.read(),
        more,
    )


PYABC: Final = {
    "pyabc": (1, False),
    "pyabc_4": (4, False),
    "pyabc_learned": (1, True),
    "pyabc_learned_4": (4, True),
}
"""Simulations of pyABC, in those that driftwalk made, and whether summaries are learned."""
METHODS: Final = ("driftwalk", *TRAININGS, "sequential_npe", *PYABC)


def answer_of(
    name: str, number: int, method: str, budget: int, trainings: Trainings | None
) -> Answer:
    """Return the answer of a method."""
    if method == "driftwalk":
        return by_driftwalk(name, number)
    simulator = Simulator(name, number)
    if trainings is not None and method in TRAININGS:
        return by_npe(trainings(method), simulator)
    if method == "sequential_npe":
        return by_sequential_npe(simulator, budget, SEED + number)
    times, learned = PYABC[method]
    return by_pyabc(simulator, times * budget, SEED + number, learned=learned)


def processor_name() -> str:
    """Return what computes."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        return platform.machine()
    return "Zen 5" if "cpu family\t: 26" in text else platform.machine()


def rounded(value: Any) -> Any:
    """Return numbers with five digits."""
    if isinstance(value, dict):
        return {key: rounded(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(one) for one in value]
    return float(f"{value:.5g}") if isinstance(value, float) else value


def line_of(name: str, number: int, method: str, answer: Answer) -> Line:
    """Return the line of an answer."""
    line = {
        "problem": name,
        "recording": number,
        "method": method,
        "truth": truth_of(name, number),
        **answer._asdict(),
        "processor": processor_name(),
    }
    return rounded(line | line.pop("more"))


def main() -> None:
    """Do what is not done yet, or print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--problem", choices=PROBLEMS, default="run_tumble")
    parser.add_argument("--method", action="append", choices=METHODS)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--recordings", type=int, default=24)
    parser.add_argument("--table", action="store_true", help="print the tables of what is done")
    given = parser.parse_args()
    numbers = range(given.first, given.first + given.recordings)
    if given.table:
        lines = read_lines(given.out)
        print_tables([one for one in lines if one.get("recording", given.first) in numbers])
        return
    out = given.out.resolve()
    # The networks write logs where they are.
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        trainings = None
        for method in given.method or METHODS:
            if method in TRAININGS and trainings is None:
                trainings = Trainings(
                    given.problem, int(np.median([*budgets_of(out, given.problem).values()]))
                )
            run_method(out, given.problem, method, numbers, trainings)


def budgets_of(out: Path, name: str) -> dict[int, int]:
    """Return how many simulations driftwalk has made of each recording."""
    return {
        one["recording"]: one["simulations"]
        for one in read_lines(out)
        if one["problem"] == name and one.get("method") == "driftwalk"
    }


def run_method(
    out: Path, name: str, method: str, numbers: Sequence[int], trainings: Trainings | None
) -> None:
    """Estimate the recordings by one method, those that are not done yet."""
    lines = [one for one in read_lines(out) if one["problem"] == name]
    done = {one["recording"] for one in lines if one.get("method") == method}
    budgets = budgets_of(out, name)
    trained = {one["training"] for one in lines if "training" in one}
    for number in numbers:
        if number in done:
            continue
        if method not in ("driftwalk", *TRAININGS) and number not in budgets:
            raise SystemExit(f"recording {number} has no budget yet: run --method driftwalk first")
        answer = answer_of(name, number, method, budgets.get(number, 0), trainings)
        new = [line_of(name, number, method, answer)]
        if trainings is not None and method in TRAININGS and method not in trained:
            trained.add(method)
            new.insert(0, rounded(trainings(method).line))
        with out.open("a", encoding="utf-8") as file:
            file.writelines(json.dumps(one) + "\n" for one in new)
        told = f"{answer.simulations} simulations, {answer.seconds:.1f} s"
        print(f"{name} {number} {method}: {told}", flush=True)


class Entry(NamedTuple):
    """One parameter of one recording, in logarithms."""

    error: float
    width: float
    """Of the interval; NaN where there is none."""
    held: bool
    score: float
    """Interval score (Gneiting and Raftery 2007): the width, and 20 times what truths are out."""


def entries_of(lines: Sequence[Line], name: str) -> list[Entry]:
    """Return the entries of a parameter."""
    found = []
    for line in lines:
        truth = float(np.log(line["truth"][name]))
        low, high = (float(np.log(one)) for one in line["interval"][name])
        missed = max(low - truth, truth - high, 0.0)
        found.append(
            Entry(
                float(np.log(line["estimate"][name])) - truth,
                high - low,
                low <= truth <= high,
                high - low + 2.0 / (1.0 - CONFIDENCE) * missed,
            )
        )
    return found


def chance_of(held: int, count: int) -> str:
    """Return the 95 % interval of a share (Clopper and Pearson 1934)."""
    from scipy.stats import binomtest

    found = binomtest(held, count).proportion_ci(0.95, method="exact")
    return f"{100 * found.low:.0f} to {100 * found.high:.0f} %"


def cells_of(entries: Sequence[Entry]) -> list[str]:
    """Return error, bias, coverage, width and score of entries."""
    errors = np.array([one.error for one in entries])
    there = [one for one in entries if np.isfinite(one.width)]
    held = sum(one.held for one in there)
    bias = f"{100 * errors.mean():+.1f}"
    if errors.size > 1:
        bias += f" ± {100 * errors.std(ddof=1) / np.sqrt(errors.size):.1f}"
    return [
        f"{100 * np.median(np.abs(np.expm1(errors))):.1f} %",
        f"{bias} %",
        f"{held} of {len(there)} ({chance_of(held, len(there))})",
        f"{100 * np.median([one.width for one in there]):.1f} %",
        f"{np.mean([one.score for one in there]):.3f}",
    ]


def table_of(cells: Sequence[Sequence[str]]) -> str:
    """Return a table, its head first."""
    rows = [cells[0], ["---"] * len(cells[0]), *cells[1:]]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


MEASURES: Final = ("median error", "bias", "truth in the 90 % interval", "width", "score")


def print_tables(lines: Sequence[Line]) -> None:
    """Print a table of all methods, and one of each parameter, for each problem."""
    for name in dict.fromkeys(one["problem"] for one in lines):
        own = [one for one in lines if one["problem"] == name]
        answers = [one for one in own if "method" in one]
        trained = {one["training"]: one for one in own if "training" in one}
        methods = list(dict.fromkeys(one["method"] for one in answers))
        by_method = {key: [one for one in answers if one["method"] == key] for key in methods}
        costs = ("simulations", "seconds", "processor time (s)")
        overall = [["method", "recordings", *MEASURES, *costs]]
        each = [["parameter", "method", *MEASURES]]
        for method, these in by_method.items():
            names = list(these[0]["truth"])
            entries = [entry for one in names for entry in entries_of(these, one)]
            cost = cost_of(these, trained.get(method))
            overall.append([method, str(len(these)), *cells_of(entries), *cost])
        for parameter in PROBLEMS[name].ranges:
            each += [
                [parameter, method, *cells_of(entries_of(these, parameter))]
                for method, these in by_method.items()
            ]
        print(f"{name}\n\n{table_of(overall)}\n\n{table_of(each)}\n")
        for method, one in trained.items():
            print(f"{method}: {json.dumps(one)}")


def cost_of(lines: Sequence[Line], training: Line | None) -> list[str]:
    """Return simulations and seconds of a recording, and of the training for all of them."""
    wall, used, simulations = (
        float(np.median([one[key] for one in lines]))
        for key in ("seconds", "processor_seconds", "simulations")
    )
    if training is None:
        return [f"{simulations:,.0f}", f"{wall:.1f}", f"{used:.1f}"]
    once = training["simulating_seconds"] + training["training_seconds"]
    return [
        f"{training['simulations']:,} once",
        f"{once:.0f} once, {wall:.2f} each",
        f"{training['processor_seconds']:.0f} once, {used:.2f} each",
    ]


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    main()
