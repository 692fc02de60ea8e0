"""Parameters from outcomes alone: emulator, records, categories, regions, tables of outcomes."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy.special import digamma, polygamma, softmax
from scipy.stats import multinomial, norm

import driftwalk as dw
from driftwalk.assembly import check_outcomes, read_outcomes
from driftwalk.assembly.chains.histories import histories
from driftwalk.assembly.outcome_posterior.emulator import Emulator, log_likelihoods
from driftwalk.assembly.outcome_posterior.infer import emulate, posterior_dataset
from driftwalk.assembly.outcome_posterior.problem import Checked, Emulated, Nodes
from driftwalk.assembly.outcome_posterior.records import (
    BOTH,
    CLASSES,
    JOINS,
    KINDS,
    TIMES,
    Categories,
    Record,
    observed_of,
    records_from_text,
    records_of_events,
    records_of_histories,
    records_to_text,
)
from driftwalk.assembly.outcome_posterior.region import (
    Coverage,
    intervals_of,
    quantiles_of,
    self_check,
    weights_of,
)
from driftwalk.core.errors import FormatError, InputError
from driftwalk.page.sections.outcome_posterior import posterior_summary
from driftwalk.schema import build_trajectory
from driftwalk.schema.answers.outcome_posterior import outcome_posterior_answer
from driftwalk.schema.answers.parts import Row

FLOW = dw.tank30_flow()


def shares_at(point: np.ndarray) -> np.ndarray:
    """Return true shares of three categories that depend smoothly on two parameters."""
    x, y = point.T
    return softmax(np.stack([2.0 * np.sin(3.0 * x), 1.5 * y, 0.0 * x], axis=1), axis=1)


def nodes_of(count: int, runs: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    node = random.random((count, 2))
    return node, random.multinomial(runs, shares_at(node))


def test_the_emulator_is_kriging_of_the_logarithms_of_gamma_variables() -> None:
    node, count = nodes_of(20, 100, 1)
    emulator = Emulator.fitted(node, count)
    point = np.array([[0.2, 0.7], [0.9, 0.1]])
    mean, variance = emulator.predict(point)
    for k in range(3):  # the textbook's formula, with an explicit inverse

        def covariance(a: np.ndarray, b: np.ndarray, k: int = k) -> np.ndarray:
            far = np.sqrt(5.0) * np.linalg.norm((a[:, None] - b[None]) / emulator.length[k], axis=2)
            return 25.0 + emulator.variance[k] * (1 + far + far**2 / 3) * np.exp(-far)

        noise = np.diag(polygamma(1, count[:, k] + 0.5))
        inverse = np.linalg.inv(covariance(node, node) + noise)
        cross = covariance(point, node)
        assert mean[:, k] == pytest.approx(cross @ inverse @ digamma(count[:, k] + 0.5), rel=1e-6)
        left = covariance(point, point) - cross @ inverse @ cross.T
        assert variance[:, k] == pytest.approx(np.diag(left), rel=1e-4, abs=1e-7)


def test_the_emulator_knows_its_error() -> None:
    node, count = nodes_of(40, 200, 2)
    emulator = Emulator.fitted(node, count)
    point = np.random.default_rng(3).random((400, 2))
    mean, variance = emulator.predict(point)
    # The level that all categories share says nothing: differences of two logarithms do.
    error = np.diff(mean, axis=1) - np.diff(np.log(shares_at(point)), axis=1)
    z = error / np.sqrt(variance[:, 1:] + variance[:, :-1])
    assert 0.4 < z.std() < 1.4
    assert np.abs(error).max() < 0.5


def test_a_likelihood_without_error_is_multinomial() -> None:
    count = np.array([[5, 3, 2], [0, 10, 0]])
    mean = np.log(np.array([[0.5, 0.3, 0.2], [0.1, 0.1, 0.8]]))
    found = log_likelihoods(mean, np.full((2, 3), 1e-12), count)
    none = np.array([multinomial(10, np.ones(3) / 3).logpmf(row) + 10 * np.log(3) for row in count])
    for at, share in enumerate(np.exp(mean)):
        wanted = np.array([multinomial(10, share).logpmf(row) for row in count]) - none
        assert found[:, at] == pytest.approx(wanted, rel=1e-5, abs=1e-5)


def test_a_likelihood_is_integrated_over_the_error() -> None:
    mean, variance, count = np.zeros((1, 2)), np.array([[0.3, 0.3]]), np.array([[7, 3]])
    # The difference of the logarithms has twice the variance: one integral.
    at = np.linspace(-8, 8, 20001)
    share = 1.0 / (1.0 + np.exp(-at * np.sqrt(0.6)))
    wanted = np.log(np.trapezoid(share**7 * (1 - share) ** 3 * norm.pdf(at), at))
    assert log_likelihoods(mean, variance, count)[0, 0] == pytest.approx(wanted, abs=0.1)


def test_quantiles_of_a_weighted_sample() -> None:
    point = np.linspace(0.0, 1.0, 2001)[:, None]
    weight = weights_of(norm.logpdf(point[:, 0], 0.5, 0.1))
    wanted = norm.ppf([0.05, 0.5, 0.95], 0.5, 0.1)
    assert quantiles_of(point, weight, np.array([0.05, 0.5, 0.95]))[0] == pytest.approx(
        wanted, abs=1e-3
    )


def test_the_shortest_interval_of_a_posterior_at_an_end_of_its_range_begins_there() -> None:
    point = np.random.default_rng(8).random((4000, 1))
    low, middle, high = intervals_of(point, weights_of(-10.0 * point[:, 0]))[0]
    assert low == 0.0
    # An exponential density that is cut off at 1.
    assert middle == pytest.approx(-np.log(1 - 0.5 * (1 - np.exp(-10.0))) / 10.0, abs=0.01)
    assert high == pytest.approx(-np.log(1 - 0.9 * (1 - np.exp(-10.0))) / 10.0, abs=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(("spread", "power"), [(1.0, (0.8, 1.0)), (0.7, (0.4, 0.7))])
def test_the_self_check_widens_a_likelihood_that_is_too_narrow(
    spread: float, power: tuple[float, float]
) -> None:
    """With a standard deviation of 0.7 in place of 1 the right power is 0.49."""
    random = np.random.default_rng(4)
    point = random.random((4000, 2))
    truth = random.random((200, 2))
    seen = truth + random.normal(0.0, 0.05, truth.shape)

    def level(at: np.ndarray) -> np.ndarray:
        return norm.logpdf(at, seen[:, None], 0.05 * spread).sum(axis=2)

    own = norm.logpdf(truth, seen, 0.05 * spread).sum(axis=1)
    found = self_check(point, truth, level(point[None]), own)
    assert power[0] <= found.power <= power[1]
    assert 0.86 <= found.joint <= 0.97
    wrong = self_check(point, np.roll(truth, 1, axis=0), level(point[None]), own - 50.0)
    assert not wrong.offered


@pytest.fixture(scope="module")
def runs() -> object:
    return dw.assemble(dw.Study(), FLOW, blocks=3, runs=20, duration="30s", seed=3)


def test_records_of_events_and_of_histories_are_the_same(runs) -> None:
    names = [str(name) for name in runs["class"].values]
    time, became = runs["event_time"].values, runs["event_class"].values
    made = records_of_events(time, became, names, blocks=3, end=30.0)
    assert records_of_histories(histories([runs]), 30.0) == made
    assert records_from_text(records_to_text(made)) == made
    assert [one.final for one in made] == [names[k] for k in runs["outcome"].values]
    done = np.array([one.completion for one in made])
    assert np.where(np.isinf(done), np.nan, done) == pytest.approx(
        runs["completion_time"].values, nan_ok=True
    )


def test_each_run_is_in_one_category_of_each_kind(runs) -> None:
    records = observed_of([runs], after=None).records
    assert set(records[0].kinds) == set(KINDS)
    for kind in KINDS:
        categories = Categories.of(kind, [records])
        count = categories.counts(records)
        assert count.sum() == len(records)
        assert count[-1] == 0
        assert (np.diff(count[:-1]) <= 0).all()
    assert len(Categories.of(TIMES, [records]).cuts) == 3
    assert Categories.of(CLASSES, [records]).counts([Record("q")])[-1] == 1
    assert {label[-1] for label in Categories.of(JOINS, [records]).labels[:-1]} <= {0, 1, 2}
    assert Categories.of(BOTH, [records]).labels[-1] == "rest"


def test_classes_are_read_no_later_than_a_run_ends(runs) -> None:
    """Only a run that is one assembly for good keeps its class."""
    whole = np.isfinite(runs["completion_time"].values)
    assert whole.any()
    assert not whole.all()
    first = int(np.flatnonzero(~whole)[0]) + 1
    with pytest.raises(InputError, match=f"run {first} of 20 ends after 30 s, before the final"):
        observed_of([runs], after=60.0)
    assert observed_of([runs], after=None).after == 30.0
    done = runs.isel(run=np.flatnonzero(whole))
    assert len(observed_of([done], after=60.0).records) == whole.sum()
    for breaks, given in ((True, done), (False, done.assign(event_kind=done["event_class"] * 0))):
        with pytest.raises(InputError, match="and could still change"):
            observed_of([given], after=60.0, breaks=breaks)


def test_blocks_of_a_recording_that_came_apart_may_do_so_again() -> None:
    apart, joined = np.full(30, 0.08), np.full(30, 0.03)
    distances = {1: [apart, joined], 3: [apart, joined, apart, joined]}
    for changes, parts in distances.items():
        x = np.concatenate(parts)
        x = np.column_stack([0.0 * x, x])
        recording = build_trajectory(0.1 * np.arange(len(x)), x, 0.0 * x, 0.0 * x)
        found = dw.classify(recording, side=0.03)
        if changes == 1:
            assert observed_of([found], after=60.0).after == 60.0
            continue
        with pytest.raises(InputError, match=r"run 1 of 1 ends after 11\.9 s"):
            observed_of([found], after=60.0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is empty"),
        ("class,count\n", "counts no run"),
        ("class,count\nT,0\n", "counts no run"),
        ("class,count\nT,-3\n", "line 2: count: expected a whole number from 0 on, got '-3'"),
        ("class,count\nT,²\n", "line 2: count: expected a whole number from 0 on, got '²'"),
        ("class,count,completion_time_s\nT,2,41\n", "has the columns count and completion_time_s"),
        ("class,join_times_s,count\nT,9,2\n", "has the columns count and join_times_s"),
        ("class,count\nT,2\nQ9,3\n", "line 3: class Q9: no shape"),
        ("class,count\nT,2,3\n", "3 values in 2 columns"),
        ("shape,count\nT,2\n", "has the columns shape, count"),
        ("class,completion_time_s\nT,\n", "a run of class T has one; it is missing"),
        ("class,completion_time_s\n2+2,5\n", "a run of class 2.2 has no completion time"),
        ("class,join_times_s\nT,9 3 12\n", "expected times in order"),
        ("class,join_times_s\nT,9 -3\n", "expected a time from 0 on"),
    ],
)
def test_a_bad_table_is_refused(tmp_path: Path, text: str, said: str) -> None:
    place = tmp_path / "counts.csv"
    place.write_text(text, encoding="utf-8")
    with pytest.raises(FormatError, match=said):
        read_outcomes(place)


def test_a_row_per_run(tmp_path: Path) -> None:
    place = tmp_path / "runs.csv"
    place.write_text("run,class,completion_time_s,join_times_s\n1,T,41,3 9 41\n2,2+2,,7 8\n")
    assert read_outcomes(place) == [
        Record("T", 41.0, (3.0, 9.0, 41.0)),
        Record("2+2", np.inf, (7.0, 8.0)),
    ]


@pytest.mark.parametrize(
    ("outcomes", "how", "said"),
    [
        ({"T": 3, "2+1": 2}, {}, "the classes T and 2.1 have 4 and 3 blocks"),
        ({"2+1": 2}, {}, "the outcomes have 3 blocks, and the study has 4"),
        ({}, {}, "no run was counted"),
        ({"T": 3}, {"vary": {"drag_coefficient": (0.3, 0.6)}}, "two to four parameters, got 1"),
        ({"T": 3}, {"vary": {"drag": (0.3, 0.6)}}, "there is no 'drag'"),
        (
            {"T": 3},
            {"vary": {"drag_coefficient": (0.6, 0.3), "force_std": (0, 1e-3)}},
            "expected the lowest and the highest value",
        ),
        (
            {"T": 3},
            {"vary": {"drag_coefficient": (-1.0, 0.3), "force_std": (0, 1e-3)}},
            "vary drag_coefficient",
        ),
        ({"T": 3}, {"runs": 3}, "runs: expected at least 20"),
        ([Record("T", 70.0)], {"after": 60.0}, "later than the final classes .60 s"),
    ],
)
def test_a_bad_problem_is_refused(outcomes, how, said: str) -> None:
    with pytest.raises(InputError, match=said):
        check_outcomes(outcomes, FLOW, dw.Study(), **how)


def test_mirror_images_are_one_class() -> None:
    found = check_outcomes({"Z": 2, "J": 1}, FLOW)
    assert {one.final for one in found.observed.records} == {"S", "L"}
    assert found.kinds == (CLASSES,)


def posterior_with(p: float, noise: float = 0.05) -> xr.Dataset:
    """Return a posterior that is normal in C_d and exponential in sigma_F, at its lower end."""
    study = dw.Study(assembly={"blocks": 2, "duration_s": 4.0})
    problem = check_outcomes({"2": 12, "1+1": 8}, FLOW, study)
    node, point = problem.sample(32, 0), problem.sample(4096, 1)
    categories = {CLASSES: Categories(CLASSES, (), ("2", "1+1", "rest"))}
    count = np.random.default_rng(5).multinomial(50, shares_at(node))
    emulators = {CLASSES: Emulator.fitted(node, count)}
    held = Coverage(1.0, 0.9, np.array([0.9, 0.9]), np.array([0.5, 0.5]))
    level = -0.5 * ((point[:, 0] - 0.5) / 0.05) ** 2 - 10.0 * point[:, 1]
    emulated = Emulated(node, categories, emulators, point, {CLASSES: noise})
    checked = Checked(point[:20], dict.fromkeys(KINDS, held), {CLASSES: level}, p)
    return posterior_dataset(problem, emulated, checked)


def test_an_interval_at_an_end_of_its_range_is_a_limit_from_one_side() -> None:
    found = posterior_with(0.5)
    assert found["limit"].values.tolist() == ["both", "upper"]
    assert found["determined"].values.tolist() == [True, False]
    assert found.attrs["verdict"] == "partly determined"
    bound = 0.2e-3 - 1e-4 * np.log(1 - 0.9 * (1 - np.exp(-10.0)))  # 90 % of the exponential
    assert found["interval"].values[1, 1] == pytest.approx(bound, rel=0.01)
    answer = outcome_posterior_answer(found)
    rows = {one.label: one.text for one in answer.parts if isinstance(one, Row)}
    stated = rows["stochastic force σ_F"]
    assert float(stated.split()[1]) == pytest.approx(1e3 * bound, rel=0.01)
    assert re.fullmatch(r"below [.0-9]+ mN \(90 %\)", stated)
    facts = answer.facts["parameters"]["force_std_N"]
    assert facts["interval"][0] is None
    assert facts["interval"][1] == pytest.approx(bound, rel=0.01)
    assert facts["estimate"] is None
    (reason,) = found["reason"].values
    assert "reaches the lower end of its range" in reason
    notes = [one.get("note") for one in posterior_summary(found)["numbers"]]
    assert notes == [None, stated]


def test_outcomes_that_the_model_does_not_explain_give_no_interval() -> None:
    found = posterior_with(0.0)
    assert found.attrs["verdict"] == "cannot tell: the model does not explain the outcomes"
    assert found.attrs["used"] == "none"
    for name in ("interval", "estimate", "width"):
        assert np.isnan(found[name].values).all()
    (reason,) = found["reason"].values
    assert "agree with no setting" in reason
    assert "widen the ranges" in reason  # sigma_F is at its lower end
    assert "inferred from" not in str(outcome_posterior_answer(found).parts)
    assert "Inferred from" not in str(posterior_summary(found))


def test_an_emulator_that_ends_above_its_aim_is_named() -> None:
    assert not [one for one in posterior_with(0.5).reason.values if "emulator" in one]
    found = posterior_with(0.5, noise=0.13)
    assert found.attrs["emulator_noise"] == 0.13
    reason = found["reason"].values[-1]
    assert reason.startswith(
        "the emulator's error is 13 % of the sampling error, and not below 10 %"
    )


@pytest.mark.slow
def test_the_error_of_the_emulator_is_that_of_each_kind_of_data() -> None:
    class Course:
        def simulate(self, name: str, nodes: Nodes) -> list[list[Record]]:
            time = np.random.default_rng(len(nodes.value)).exponential(3.0, (len(nodes.value), 20))
            return [
                [Record("2", t) if t < 4.0 else Record("1+1", np.inf) for t in row] for row in time
            ]

    study = dw.Study(assembly={"blocks": 2, "duration_s": 4.0})
    seen = [Record("2", 1.0), Record("2", 3.0), Record("1+1", np.inf)]
    problem = check_outcomes(seen, FLOW, study)
    found = emulate(problem, Course(), rounds=0)
    assert set(found.noise) == {CLASSES, TIMES, BOTH}
    for kind, noise in found.noise.items():
        mean, variance = found.emulators[kind].predict(found.point)
        own = found.categories[kind].counts(seen)
        weight = weights_of(log_likelihoods(mean, variance, own[None])[0])
        share = softmax(mean, axis=1)
        error = 3 * (share * variance).sum(axis=1) / (share.shape[1] - 1)
        assert noise == pytest.approx(float((weight * error).sum()))
    assert found.noise[CLASSES] != found.noise[TIMES]
