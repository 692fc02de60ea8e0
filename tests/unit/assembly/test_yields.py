"""The largest yield: its runs against `assemble`, its selection against known chances."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from small_sensitivity import FLOW, small

import driftwalk as dw
from driftwalk.assembly import check_yield, class_at, maximise_yield, proportion_interval
from driftwalk.assembly.runs.run import assemble
from driftwalk.assembly.sensitivity.settings import FIRST_TRIALS
from driftwalk.assembly.yields.arms import reaches
from driftwalk.assembly.yields.selection import Tally, compass_search, halving, tell_apart
from driftwalk.core.errors import InputError

FEW: dict[str, Any] = {"target": "1+2", "by": 8.0, "runs": 160, "fresh_runs": 30}


def chances(*shares: float, seed: int = 1) -> Tally:
    """Return a tally of arms with known chances, on shared uniform numbers."""
    uniform = np.random.default_rng(seed).random(100_000)

    def sample(arms: Sequence[int], runs: range) -> Any:
        one = uniform[runs.start : runs.stop]
        return np.array([one < shares[arm] for arm in arms])

    return Tally(sample)


@pytest.mark.slow
def test_every_run_is_one_of_assemble() -> None:
    """Exact: the same random numbers, the classes at two times by `class_at`."""
    study = small()
    axes = {"flow_scale": [0.5, 1.0], "force_std": [2e-4, 1e-3]}
    found = maximise_yield(study, FLOW, axes=axes, **FEW)
    assert found.attrs["target"] == "2+1"
    double = FLOW.assign({name: 0.5 * FLOW[name] for name in ("u", "v")})
    for row in range(4):
        one = found.isel(setting=row)
        flow = double if one["flow_scale"] == 0.5 else FLOW
        for kind, trial in (("", FIRST_TRIALS.choice), ("fresh_", FIRST_TRIALS.fresh)):
            if not (runs := int(one[f"{kind}runs"])):
                continue
            by_hand = assemble(
                study, flow, runs=runs, trial=trial, force_std=float(one["force_std"]),
                seed=study.sensitivity.seed,
            )  # fmt: skip
            names = by_hand["class"].values
            count = int((names[class_at(by_hand, 8.0)] == "2+1").sum())
            if kind:
                assert float(one["fresh_yield"]) == count / runs
                low, _ = proportion_interval(count, runs, confidence=study.assembly.confidence)
                assert float(one["fresh_yield_low"]) == float(low)
                last = (names[by_hand["outcome"].values] == "2+1").mean()
                assert float(one["share"][-1]) == last
            else:
                assert int(one["reached"]) == count
    best = found.isel(setting=found.attrs["best"])
    assert str(best["standing"].values) == "best"
    assert int(best["fresh_runs"]) == 30


@pytest.mark.slow
def test_blocks_and_tanks_are_settings_and_threads_change_nothing() -> None:
    given = FEW | {"target": "2", "axes": {"blocks": [2, 3], "tank_diameter": [0.28, 0.3]}}
    one, two = (maximise_yield(small(), FLOW, threads=n, **given) for n in (1, 2))
    assert one.identical(two)
    assert set(one["blocks"].values.tolist()) == {2, 3}
    assert reaches("2+1", "2")
    assert not reaches("I3", "2")


def test_halving_keeps_the_better_half_within_its_budget() -> None:
    tally = chances(0.1, 0.9, 0.5, 0.4, 0.3)
    rounds = halving(tally, range(5), 600)
    assert max(rounds, key=lambda arm: rounds[arm]) == 1
    assert sorted(rounds.values()) == [1, 1, 2, 3, 4]
    assert tally.runs <= 600
    # Shared numbers: the arm with the larger chance succeeds wherever the other one does.
    assert tally.difference(1, 2).mean > 0.0


def test_arms_far_apart_are_worse_and_equal_ones_alike() -> None:
    tally = chances(0.50, 0.499, 0.3)
    halving(tally, range(3), 600)
    found = tell_apart(tally, range(3), indifference=0.02, confidence=0.9, budget=60_000)
    assert {found.best, *found.alike} == {0, 1}
    assert found.within == 0.02
    short = chances(0.50, 0.45, seed=3)
    halving(short, range(2), 100)
    found = tell_apart(short, range(2), indifference=0.001, confidence=0.9, budget=200)
    assert found.alike
    assert found.within > 0.001
    assert short.runs <= 300


@pytest.mark.slow
def test_the_best_is_called_worse_no_more_often_than_stated() -> None:
    """Equal arms with numbers of their own: 4 sd of 200 at the rate of 5 % are 12 more."""
    wrong = 0
    for seed in range(200):
        random = np.random.default_rng(seed)
        tally = Tally(lambda arms, runs, r=random: r.random((len(arms), len(runs))) < 0.3)
        tally.extend([0, 1, 2], 50)
        found = tell_apart(tally, range(3), indifference=0.04, confidence=0.9, budget=20_000)
        wrong += len(found.alike) < 2
    assert wrong <= 22


def test_a_compass_search_climbs_a_smooth_hill() -> None:
    """The top at (0.7, 0.2); steps of 1/4 to 1/32 leave no more than 0.1 on either axis."""
    places: list[Any] = []
    uniform = np.random.default_rng(2).random(20_000)

    def arm_at(place: Any) -> int:
        known = [k for k, one in enumerate(places) if np.array_equal(one, place)]
        if not known:
            places.append(place)
        return known[0] if known else len(places) - 1

    def sample(arms: Sequence[int], runs: range) -> Any:
        heights = [0.8 - ((places[arm] - [0.7, 0.2]) ** 2).sum() for arm in arms]
        return np.array([uniform[runs.start : runs.stop] < height for height in heights])

    tally = Tally(sample)
    end = compass_search(tally, np.array([0.1, 0.9]), arm_at, budget=40_000)
    assert np.abs(places[end] - [0.7, 0.2]).max() < 0.1
    assert tally.runs <= 40_000


def test_a_compass_search_ends_where_its_neighbours_are_one_setting() -> None:
    tally = chances(0.5)
    assert compass_search(tally, np.array([0.5]), lambda place: 0, budget=10_000) == 0
    assert tally.runs == 0


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"target": "T"}, "target T has 4 blocks, and the runs have 3"),
        ({"target": "q"}, "target q: "),
        ({"by": 400.0}, "by: 400 s does not lie within the runs, which last 10 s"),
        ({"by": 0.0}, "does not lie within"),
        ({"axes": None}, "nothing varies"),
        ({"axes": {"colour": [1]}}, "there is no 'colour'"),
        ({"ranges": {"colour": (0, 1)}}, "'colour' has no range"),
        ({"ranges": {"blocks": (2, 4)}}, "'blocks' has no range"),
        ({"ranges": {"force_std": (1e-4, 1e-3)}}, "force_std has values and a range"),
        ({"ranges": {"flow_scale": (2.0, 1.0)}}, "the lower one first"),
        ({"ranges": {"flow_scale": (1.0, 1.0001)}}, "flow_scale from 1 to 1.0001 is too narrow"),
        ({"runs": 30}, "2 settings need at least 40 runs, got 30"),
        ({"runs": 0}, "runs must be at least 1"),
        ({"indifference": 2.0}, "indifference must lie between 0 and 1"),
        ({"axes": {"blocks": [3, 400]}}, "at blocks = 400"),
    ],
)
def test_what_cannot_be_is_refused(changed: dict[str, Any], said: str) -> None:
    given = FEW | {"axes": {"force_std": [2e-4, 1e-3]}} | changed
    with pytest.raises(InputError, match=said):
        check_yield(small(), FLOW, **given)


def test_flow_fields_are_settings() -> None:
    flows = {"still": dw.uniform_flow(0.0, 0.0), "own": FLOW}
    assert check_yield(small(), FLOW, axes={"flow": flows, "glued": ["x"]}, **FEW) == 2
