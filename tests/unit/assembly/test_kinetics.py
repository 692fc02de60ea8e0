"""Kinetics against closed forms, matrix exponentials, and other libraries."""

from __future__ import annotations

import math
import re
import statistics
from itertools import product

import numpy as np
import pytest
import scipy.linalg
import scipy.stats
import xarray as xr
from chain_runs import CLASSES, RATES, chain_runs, rate_matrix

import driftwalk as dw
from driftwalk.assembly.chains.hidden import (
    FORMS,
    Form,
    Model,
    fit,
    log_likelihood,
    passage,
    shares,
)
from driftwalk.assembly.chains.histories import histories
from driftwalk.assembly.chains.mixing import holm, mixing_tests, score
from driftwalk.assembly.chains.transition_rates import (
    _other_blocks,
    completion,
    empirical_shares,
    spread_of_known,
)
from driftwalk.core.errors import InputError
from driftwalk.schema.answers.kinetics import kinetics_answer
from driftwalk.schema.answers.parts import lines_of

CHAIN, SEMI = FORMS[:2]
HIDDEN = Form("2 hidden states", 1, 2)


def model_of(matrix: np.ndarray, form: Form = CHAIN, speeds: tuple[float, ...] = (1.0,)) -> Model:
    """Return a model with the rates of a generator, times the speed of each hidden state."""
    size, states = matrix.shape[0], len(speeds)
    hazard = np.maximum(matrix, 0.0)[:, None, :, None] * np.array(speeds)
    start = np.zeros((size, states))
    start[CLASSES.index("1+1+1+1")] = 1.0 / states
    step = np.full((states, states), 0.2 / max(states - 1, 1))
    np.fill_diagonal(step, 0.8 if states > 1 else 1.0)
    return Model(form, np.zeros((size, 0)), hazard, start, np.repeat(step[None], size, axis=0))


def expanded(model: Model) -> np.ndarray:
    """Return the generator of a model of one bin over (class, hidden state)."""
    size, states = model.start.shape
    matrix = np.zeros((size, states, size, states))
    for i, z, j, y in product(range(size), range(states), range(size), range(states)):
        matrix[i, z, j, y] = model.hazard[i, 0, j, z] * model.switch[j, z, y]
    flat = matrix.reshape(size * states, -1)
    return flat - np.diag(flat.sum(axis=1))


@pytest.mark.slow
def test_rates_are_counts_over_times() -> None:
    found = dw.kinetics(chain_runs(60, 3, duration=200.0), seed=2)
    runs = chain_runs(60, 3, duration=200.0)
    apart = np.nan_to_num(runs["event_time"].values[:, 0], nan=200.0)
    joined = int(np.isfinite(runs["event_time"].values[:, 0]).sum())
    one = found.sel(transition="1+1+1+1 -> 2+1+1").isel(source=0)
    assert int(one["count"]) == joined
    assert float(one["rate"]) == pytest.approx(joined / apart.sum(), rel=1e-12)
    assert float(one["rate_standard_error"]) == pytest.approx(joined**0.5 / apart.sum())
    if found.attrs["chosen"] == "Markov chain":
        assert one["hazard"].item() == pytest.approx(float(one["rate"]), rel=1e-9)
    # 60 runs: 12 parts of the time in the class, and the spread of the counts in them.
    first = runs["event_time"].values[:, 0]
    when = np.cumsum(apart)[np.isfinite(first)]
    parts = np.bincount(np.minimum(12 * when / apart.sum(), 11).astype(int), minlength=12)
    wider = scipy.stats.t.ppf(0.95, 11) / scipy.stats.norm.ppf(0.95)
    fewer = max(1.0, parts.var(ddof=1) / parts.mean() * wider**2)
    low, high = (float(one[name]) * apart.sum() for name in ("rate_low", "rate_high"))
    assert scipy.stats.gamma.sf(low / fewer, joined / fewer) == pytest.approx(0.95)
    assert scipy.stats.gamma.cdf(high / fewer, joined / fewer + 1) == pytest.approx(0.95)


@pytest.mark.parametrize("speeds", [(1.0,), (3.0, 0.3)])
def test_shares_are_those_of_the_matrix_exponential(speeds: tuple[float, ...]) -> None:
    model = model_of(rate_matrix(), speeds=speeds)
    time, course = shares(model, 300.0, steps=300)
    generator, begin = expanded(model), model.start.ravel()
    for at in (1, 20, 100, 300):
        exact = (begin @ scipy.linalg.expm(generator * time[at])).reshape(model.start.shape)
        assert np.abs(course[at] - exact.sum(axis=1)).max() < 2e-3
    assert np.allclose(course.sum(axis=1), 1.0)


@pytest.mark.slow
def test_shares_of_a_semi_markov_chain_are_those_of_simulated_runs() -> None:
    """5,000 runs with Weibull sojourns: within 4 standard errors, false alarms below 1 %."""
    runs = chain_runs(5_000, 5, shape=0.6)
    found = histories([runs], classes=CLASSES)
    time, course = shares(fit(found, SEMI), 300.0)
    seen = empirical_shares(histories([chain_runs(5_001, 6, shape=0.6)], classes=CLASSES), time)
    spread = np.sqrt(np.maximum(seen * (1.0 - seen), 1e-4) * 2.0 / 5_000)
    # Ten bins do not follow the singular hazard at zero: the first seconds are left out.
    assert (np.abs(course - seen) < 4.0 * spread + 0.004)[20:].all()


def test_likelihood_is_the_sum_over_hidden_paths() -> None:
    model = model_of(rate_matrix(), HIDDEN, (2.0, 0.4))
    runs = histories([chain_runs(6, 1, duration=120.0)], classes=CLASSES)
    scores = log_likelihood(runs, model)
    for run in range(runs.runs):
        own = np.flatnonzero(runs.run == run)
        total = 0.0
        for path in product(range(2), repeat=own.size):
            weight = 0.5
            for k, (row, z) in enumerate(zip(own, path, strict=True)):
                state, target = runs.state[row], runs.target[row]
                weight *= model.switch[state, path[k - 1], z] if k else 1.0
                weight *= np.exp(-model.hazard[state, 0, :, z].sum() * runs.duration[row])
                weight *= model.hazard[state, 0, target, z] if target >= 0 else 1.0
            total += weight
        assert scores[run] == pytest.approx(np.log(total), rel=1e-10)


@pytest.mark.slow
def test_the_likelihood_rises_to_that_of_the_truth() -> None:
    runs = histories([chain_runs(400, 2, memory=0.1)], classes=CLASSES)
    early, late = (fit(runs, HIDDEN, iterations=n) for n in (3, 200))
    assert log_likelihood(runs, late).sum() > log_likelihood(runs, early).sum()
    one = fit(runs, CHAIN)
    assert log_likelihood(runs, late).sum() > log_likelihood(runs, one).sum() + 20.0
    rates = late.hazard[CLASSES.index("1+1+1+1"), 0, CLASSES.index("2+1+1")]
    # Half of the runs are as fast as the truth, the others ten times slower.
    assert rates.max() == pytest.approx(0.03, rel=0.35)
    assert rates.min() == pytest.approx(0.003, rel=0.5)


def test_committor_and_passage_time_solve_the_linear_equations() -> None:
    matrix, target = rate_matrix(), CLASSES.index("T")
    way = passage(model_of(matrix), target)
    ways = 0.012 / 0.018 * 0.02 / 0.028
    assert way.committor[CLASSES.index("1+1+1+1")] == pytest.approx(ways, rel=1e-9)
    assert way.committor[CLASSES.index("O")] == 0.0
    assert way.committor[target] == pytest.approx(1.0)
    assert way.passage_time[target] == 0.0
    expected = 1 / 0.03 + 1 / 0.018 + 1 / 0.028
    assert way.passage_time[CLASSES.index("1+1+1+1")] == pytest.approx(expected, rel=1e-9)


def test_passage_with_partings_and_hidden_states_solves_the_generator() -> None:
    rates = {**RATES, ("2+2", "2+1+1"): 0.01}
    model = model_of(rate_matrix(rates), HIDDEN, (3.0, 0.3))
    target = CLASSES.index("T")
    model.hazard[CLASSES.index("L3+1"), 0, target] = [0.001, 0.05]
    generator = expanded(model)
    inside = np.repeat(np.arange(len(CLASSES)) == target, 2)
    moving = ~inside & ~np.isclose(np.diag(generator), 0.0)
    reach, time = np.where(inside, 1.0, 0.0), np.zeros(inside.size)
    own = generator[np.ix_(moving, moving)]
    reach[moving] = np.linalg.solve(own, -generator[np.ix_(moving, inside)].sum(axis=1))
    time[moving] = np.linalg.solve(own, -reach[moving])
    way, at = passage(model, target), CLASSES.index("1+1+1+1")
    # Both hidden states are as likely at the start.
    first = slice(2 * at, 2 * at + 2)
    assert way.committor[at] == pytest.approx(reach[first].mean(), rel=1e-9)
    assert way.passage_time[at] == pytest.approx(time[first].mean() / reach[first].mean(), rel=1e-9)


def test_the_spread_is_that_of_the_samples_that_have_a_number() -> None:
    values = np.random.default_rng(3).normal(30.0, 4.0, (50, 4))
    values[7, 1] = values[4:, 2] = values[:, 3] = np.nan
    whole, but_one, four, none = spread_of_known(values)
    assert whole == values.std(axis=0, ddof=1)[0]
    assert but_one == pytest.approx(statistics.stdev(v for v in values[:, 1] if not math.isnan(v)))
    assert math.isnan(four)
    assert math.isnan(none)


def test_no_share_is_seen_after_the_recordings_end() -> None:
    """Later only complete runs would be left, and all would be complete."""
    runs = chain_runs(60, 2, duration=100.0)
    seen = empirical_shares(histories([runs], classes=CLASSES), np.array([99.0, 100.0, 101.0]))
    outcome = np.bincount(runs["outcome"].values, minlength=len(CLASSES)) / 60
    assert seen[1] == pytest.approx(outcome)
    assert np.isfinite(seen[0]).all()
    assert np.isnan(seen[2]).all()


@pytest.mark.slow
def test_the_answer_begins_with_the_counted_share_and_time_to_the_target() -> None:
    """Where every run ends, the committor is a share of runs; errors are known within a tenth."""
    # From 2+2, a way to T is taken by one run in fifty: some bootstrap samples have none.
    rates = {**RATES, ("2+2", "T"): 0.0003}
    runs = chain_runs(200, 4, duration=20_000.0, rates=rates)
    found = dw.kinetics(runs, target="T")
    assert found.attrs["chosen"] == "Markov chain"
    reached = runs["outcome"].values == CLASSES.index("T")
    share, text = reached.mean(), "\n".join(lines_of(kinetics_answer(found).parts))
    first = re.match(r"T is reached in (\S+) ± (\S+) % of the runs, after (\S+) ± (\S+) s", text)
    assert first is not None
    percent, error, time, spread = map(float, first.groups())
    # The Markov chain forgets where L3+1 and 2+2 were entered from, and all come from one class.
    assert percent == pytest.approx(100.0 * share, abs=0.06)
    # 50 samples: four standard deviations of the error are 40 % of it.
    assert error == pytest.approx(100.0 * (share * (1.0 - share) / 200) ** 0.5, rel=0.4)
    taken = np.nanmax(runs["event_time"].values[reached], axis=1)
    assert abs(time - taken.mean()) < 3.0 * taken.std(ddof=1) / reached.sum() ** 0.5
    assert spread == pytest.approx(taken.std(ddof=1) / reached.sum() ** 0.5, rel=0.4)
    assert "nan" not in text
    [table] = re.findall(r"from +reaches T.*?\n(.*?)\nverdict", text, re.DOTALL)
    # Classes that no run left, and the target itself, have no row.
    names = [line.split()[0] for line in table.splitlines()]
    assert names == ["L3+1", "2+2", "2+1+1", "1+1+1+1"]


def test_score_is_that_of_the_log_rank_test() -> None:
    random = np.random.default_rng(4)
    lasted = np.round(random.exponential(3.0, 80), 1) + 0.1
    ended, group = random.random(80) < 0.7, np.repeat([0.0, 1.0], 40)
    gain, variance = score(lasted, ended, group)
    halves = [
        scipy.stats.CensoredData(
            uncensored=lasted[(group == g) & ended], right=lasted[(group == g) & ~ended]
        )
        for g in (1.0, 0.0)
    ]
    other = scipy.stats.logrank(*halves)
    # Breslow's variance of ties is a little larger than the hypergeometric one.
    assert gain / variance**0.5 == pytest.approx(other.statistic, rel=0.02)


def test_weibull_shape_is_that_of_scipy() -> None:
    runs = chain_runs(300, 8, shape=0.6, duration=60.0)
    [one] = [t for t in mixing_tests(histories([runs])) if t.name == "sojourn in 1+1+1+1"]
    first = runs["event_time"].values[:, 0]
    data = scipy.stats.CensoredData(
        uncensored=first[np.isfinite(first)], right=np.full(int(np.isnan(first).sum()), 60.0)
    )
    shape, _, _ = scipy.stats.weibull_min.fit(data, floc=0.0)
    assert one.statistic == pytest.approx(shape, rel=1e-3)
    assert one.low < one.statistic < one.high


def test_holm_orders_and_caps() -> None:
    assert holm([]).size == 0
    assert holm([0.5, 0.9]).tolist() == [1.0, 1.0]


def test_recordings_are_histories() -> None:
    recording = xr.Dataset(
        {"outcome": ("time", [1, 1, -1, 0, 0, 1])},
        {"time": [5.0, 6.0, 7.0, 8.0, 9.0, 10.0], "class": ["2", "1+1"]},
        {"kind": "classification", "blocks": 2},
    )
    found = histories([recording, recording])
    assert found.classes == ("1+1", "2")
    assert found.duration.tolist() == [3.0, 2.0, 0.5] * 2
    assert found.target.tolist() == [1, 0, -1] * 2
    assert found.runs == 2


@pytest.mark.slow
def test_bad_data_say_what_is_wrong() -> None:
    runs = chain_runs(60, 1)
    with pytest.raises(InputError, match="target 2 has 2 blocks, and the runs have 4"):
        dw.kinetics(runs, target="2")
    with pytest.raises(InputError, match="no run was ever in the target I"):
        dw.kinetics(runs, target="I")
    with pytest.raises(InputError, match="target Q"):
        dw.kinetics(runs, target="Q")
    with pytest.raises(InputError, match=r"cannot tell: 5 runs .* record"):
        dw.kinetics(chain_runs(5, 1))
    three = runs.assign_coords({"class": ["I3", "L3", "2+1", "1+1+1", "1+2", "1+2", "1+1+1"]})
    three.attrs = {**runs.attrs, "blocks": 3}
    with pytest.raises(InputError, match="4 and 3 blocks"):
        dw.kinetics(runs, three)
    with pytest.raises(InputError, match="got class_times"):
        dw.kinetics(xr.Dataset(attrs={"kind": "class_times"}))
    with pytest.raises(InputError, match="blocks must be at least 2"):
        dw.kinetics(runs, blocks=1)


@pytest.mark.slow
def test_a_mixed_tank_is_extrapolated_and_another_one_is_not() -> None:
    mixed = dw.kinetics(chain_runs(400, 1), target="T", blocks=6)
    assert mixed.attrs["verdict"] == "well mixed"
    assert mixed.attrs["chosen"] == "Markov chain"
    # 15 pairs in place of 6; three standard errors.
    rate, error = (mixed.attrs[f"other_blocks_rate{end}_per_s"] for end in ("", "_standard_error"))
    assert abs(rate - 0.03 * 15 / 6) < 3.0 * error
    assert abs(float(mixed["committor"].sel({"class": "1+1+1+1"})) - 0.476) < 0.09
    text = repr(mixed)
    assert text.startswith("T is reached in ")
    assert "400 runs of 4 blocks" in text
    other = dw.kinetics(chain_runs(400, 1, memory=0.05), blocks=6)
    assert other.attrs["verdict"] == "waiting times are not exponential, memory across states"
    assert other.attrs["other_blocks_refused"].startswith("no rate for 6 blocks is extrapolated")
    assert "hidden" in other.attrs["chosen"]


def test_histories_go_back_where_blocks_part() -> None:
    """A joining, a parting, and an event that leaves the class as it was."""
    names = ["2", "1+1"]
    runs = xr.Dataset(
        {
            "outcome": ("run", [0, -1]),
            "event_time": (("run", "event"), [[2.0, 5.0, 6.0, 9.0], [1.0, 2.0, np.nan, np.nan]]),
            "event_class": (("run", "event"), [[0, 1, 1, 0], [0, 1, -1, -1]]),
            "end_time": ("run", [10.0, 10.0]),
        },
        {"class": names},
        {"kind": "assembly", "blocks": 2},
    )
    found = histories([runs], classes=names)
    assert found.state.tolist() == [1, 0, 1, 0]
    assert found.duration.tolist() == [2.0, 3.0, 4.0, 1.0]
    assert found.target.tolist() == [0, 1, 0, -1]
    assert 0.0 <= completion(found, fit(found, CHAIN))["completion_ks"] <= 1.0
    cut = found.until(6.0)
    assert cut.duration.tolist() == [2.0, 3.0, 1.0]
    assert cut.target.tolist() == [0, 1, -1]


def test_glued_blocks_start_in_the_class_of_their_bodies() -> None:
    """Two dimers: what is glued at time 0 is no transition."""
    runs = xr.Dataset(
        {
            "outcome": ("run", [0]),
            "event_time": (("run", "event"), [[0.0, 0.0, 4.0]]),
            "event_class": (("run", "event"), [[2, 1, 0]]),
            "end_time": ("run", [5.0]),
        },
        {"class": ["O", "2+2", "2+1+1", "1+1+1+1"]},
        {"kind": "assembly", "blocks": 4},
    )
    found = histories([runs])
    assert found.classes == ("2+2", "O")
    assert found.duration.tolist() == [4.0, 1.0]
    assert found.joins == 1
    assert _other_blocks(found, "well mixed", 6)["other_blocks_refused"].endswith(
        "no run starts with single blocks"
    )


def test_classes_that_count_assemblies_have_no_rates() -> None:
    recording = xr.Dataset(
        {"outcome": ("time", [1, 0])},
        {"time": [0.0, 1.0], "class": ["69 assemblies", "70 assemblies"]},
        {"kind": "classification", "blocks": 70},
    )
    with pytest.raises(InputError, match=r"'70 assemblies' counts .* use at most 64 blocks"):
        histories([recording])
