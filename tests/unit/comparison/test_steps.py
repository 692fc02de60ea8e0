"""Steps: by hand, against a plain NumPy loop, and the plan on gaps, jitter and bad clocks."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from hypothesis import given, reject, settings, strategies as st

from driftwalk.comparison import ComparisonWarning, apply_steps, plan_steps, steps
from driftwalk.core.errors import InputError
from driftwalk.schema import build_trajectory
from driftwalk.schema.trajectory import check_steps


def pairs_by_loop(x: np.ndarray, y: np.ndarray, triples: list[tuple[int, int, int]]) -> np.ndarray:
    """Length and angle of each triple of sample numbers, with the C library's functions."""
    pairs = []
    for i, j, k in triples:
        ux, uy, vx, vy = x[j] - x[i], y[j] - y[i], x[k] - x[j], y[k] - y[j]
        if math.hypot(ux, uy) == 0 or math.hypot(vx, vy) == 0:
            continue
        turn = math.atan2(vy, vx) - math.atan2(uy, ux)
        turn = math.pi - (math.pi - turn) % (2 * math.pi)
        pairs.append((math.hypot(vx, vy), turn))
    return np.array(pairs).reshape(-1, 2)


def test_a_path_by_hand() -> None:
    # East 2, north 3, west 1, a half turn to east 2, rest, north 1.
    plan = plan_steps(np.arange(7) * 0.1)
    result = apply_steps(plan, [0, 2, 2, 1, 3, 3, 3], [0, 0, 3, 3, 3, 3, 4])
    np.testing.assert_allclose(result.step_length, [3, 1, 2])
    np.testing.assert_allclose(result.turning_angle, [np.pi / 2, np.pi / 2, np.pi])
    assert result.turning_angle[2] == np.pi
    assert (result.zero_length, result.missing) == (2, 0)
    assert result.pair.tolist() == [0, 1, 2]


@settings(deadline=None, max_examples=40)
@given(seed=st.integers(0, 10_000), grid=st.sampled_from([0.0, 0.5]))
def test_random_paths_equal_the_loop(seed: int, grid: float) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 300))
    x, y = rng.normal(size=(2, n)).cumsum(axis=1)
    if grid:
        x, y = np.round(x / grid) * grid, np.round(y / grid) * grid
    result = apply_steps(plan_steps(np.arange(n) / 30), x, y)
    expected = pairs_by_loop(x, y, [(i, i + 1, i + 2) for i in range(n - 2)])
    np.testing.assert_allclose(result.step_length, expected[:, 0], rtol=1e-14)
    difference = np.abs(result.turning_angle - expected[:, 1])
    # Close to the cut the loop's subtraction may come out on the other side.
    assert (np.minimum(difference, 2 * np.pi - difference) < 1e-12).all()
    assert result.step_length.size + result.zero_length == n - 2
    assert ((result.turning_angle > -np.pi) & (result.turning_angle <= np.pi)).all()


def test_float32_positions_are_read_as_they_are() -> None:
    rng = np.random.default_rng(1)
    x, y = rng.normal(size=(2, 50)).astype(np.float32)
    plan = plan_steps(np.arange(50.0))
    single = apply_steps(plan, x, y)
    double = apply_steps(plan, x.astype(np.float64), y.astype(np.float64))
    np.testing.assert_array_equal(single.step_length, double.step_length)
    np.testing.assert_array_equal(single.turning_angle, double.turning_angle)


def test_missing_positions_are_left_out_and_counted() -> None:
    x = np.arange(8.0) ** 2
    x[3] = np.nan
    result = apply_steps(plan_steps(np.arange(8.0)), x, np.zeros(8))
    assert (result.missing, result.zero_length) == (3, 0)
    assert result.pair.tolist() == [0, 4, 5]


def test_a_plan_refuses_another_number_of_samples() -> None:
    with pytest.raises(InputError, match="made for 5 samples, got x \\(4,\\)"):
        apply_steps(plan_steps(np.arange(5.0)), np.zeros(4), np.zeros(4))


class TestPlan:
    def test_regular_clock(self) -> None:
        plan = plan_steps(np.arange(100) / 30)
        assert plan.mode == "exact"
        assert (plan.pairs, plan.points, plan.gaps, plan.irregular) == (98, 100, 0, 0)
        assert plan.step_interval == pytest.approx(1 / 30, rel=1e-8)
        np.testing.assert_array_equal(plan.left, np.arange(100))
        np.testing.assert_array_equal(plan.weight, 0.0)
        np.testing.assert_array_equal(plan.triple, np.arange(98))
        np.testing.assert_array_equal(plan.time, np.arange(1, 99) / 30)
        assert (plan.left.dtype, plan.weight.dtype, plan.triple.dtype) == (
            np.int32,
            np.float64,
            np.int32,
        )

    def test_no_pair_reaches_over_a_gap(self) -> None:
        time = np.delete(np.arange(60) * 0.1, [20, 40, 41])
        plan = plan_steps(time)
        assert (plan.mode, plan.gaps, plan.irregular) == ("exact", 2, 2)
        first = plan.left[plan.triple]
        for offset in (0, 1):
            duration = time[first + offset + 1] - time[first + offset]
            np.testing.assert_allclose(duration, 0.1)
        assert plan.pairs == 18 + 17 + 16

    def test_jitter_within_the_tolerance_stays_exact(self) -> None:
        time = np.round(np.arange(300) / 30, 3)  # 33 and 34 ms
        plan = plan_steps(time)
        assert (plan.mode, plan.pairs, plan.irregular) == ("exact", 298, 0)

    def test_jitter_beyond_the_tolerance_interpolates(self) -> None:
        rng = np.random.default_rng(2)
        time = np.arange(500) * 0.1 + rng.uniform(-0.02, 0.02, 500)
        plan = plan_steps(time, step_interval=0.1)
        assert plan.mode == "interpolated"
        assert plan.pairs > 400
        straight = apply_steps(plan, 3 * time, -4 * time)
        np.testing.assert_allclose(straight.step_length, 0.5, rtol=1e-9)
        np.testing.assert_allclose(straight.turning_angle, 0.0, atol=1e-9)
        middle = plan.left[plan.triple + 1]
        weight = plan.weight[plan.triple + 1]
        right = np.minimum(middle + 1, 499)
        np.testing.assert_allclose(
            plan.time, (1 - weight) * time[middle] + weight * time[right], atol=1e-9
        )

    def test_interpolation_bridges_one_and_a_half_intervals_only(self) -> None:
        rng = np.random.default_rng(3)
        time = np.cumsum(rng.choice([0.05, 0.1, 0.3], p=[0.4, 0.5, 0.1], size=400))
        plan = plan_steps(time, step_interval=0.1)
        assert plan.mode == "interpolated"
        between = plan.weight > 0
        width = time[plan.left[between] + 1] - time[plan.left[between]]
        assert width.max() <= 0.15 + 1e-9
        for k in (0, 1):
            points = [
                (1 - plan.weight[i]) * time[plan.left[i]]
                + plan.weight[i] * time[min(plan.left[i] + 1, 399)]
                for i in plan.triple + k
            ]
            following = [
                (1 - plan.weight[i]) * time[plan.left[i]]
                + plan.weight[i] * time[min(plan.left[i] + 1, 399)]
                for i in plan.triple + k + 1
            ]
            np.testing.assert_allclose(np.subtract(following, points), 0.1, atol=1e-9)

    def test_a_multiple_takes_samples_that_do_not_overlap(self) -> None:
        plan = plan_steps(np.arange(20) * 0.1, step_interval=0.3)
        assert plan.mode == "exact"
        assert plan.left[plan.triple].tolist() == [0, 3, 6, 9, 12]
        np.testing.assert_array_equal(plan.left, [0, 3, 6, 9, 12, 15, 18])

    def test_a_multiple_starts_anew_after_a_gap(self) -> None:
        time = np.delete(np.arange(42) * 0.1, 20)
        plan = plan_steps(time, step_interval=0.2)
        assert plan.mode == "exact"
        used = time[plan.left]
        assert used[used > 2].min() == pytest.approx(2.1)
        first = plan.left[plan.triple]
        np.testing.assert_allclose(time[plan.left[plan.triple + 1]] - time[first], 0.2)
        np.testing.assert_allclose(time[plan.left[plan.triple + 2]] - time[first], 0.4)

    def test_no_multiple_interpolates(self) -> None:
        plan = plan_steps(np.arange(41) * 0.1, step_interval=0.25)
        assert plan.mode == "interpolated"
        assert plan.points == 17
        assert sorted(set(plan.weight.round(9))) == [0.0, 0.5]
        assert plan.left[-1] == 40

    @pytest.mark.parametrize(
        ("time", "options", "message"),
        [
            ([0.0, 0.1], {}, "at least three samples"),
            ([0.0, 0.1, 0.1, 0.2], {}, "time does not increase at sample 2"),
            ([0.0, 0.2, 0.1], {}, "sort the recording first"),
            ([0.0, np.nan, 0.1], {}, "time does not increase"),
            ([0.0, 0.1, np.inf], {}, "not a finite number"),
            ([0.0, 0.1, 0.2], {"step_interval": 0.0}, "must be a positive time"),
            ([0.0, 0.1, 0.2], {"step_interval": np.nan}, "must be a positive time"),
            ([0.0, 0.1, 0.2], {"step_interval": 0.2}, "no three positions are 0.2 s apart"),
            ([0.0, 0.1, 0.2], {"step_interval": 0.04}, "no three positions are 0.04 s apart"),
            ([0.0, 0.1, 1e9], {"step_interval": 0.07}, "choose a longer one"),
        ],
    )
    def test_bad_clocks(self, time: list[float], options: dict[str, float], message: str) -> None:
        with pytest.raises(InputError, match=message):
            plan_steps(time, **options)

    @pytest.mark.slow
    @settings(deadline=None, max_examples=60)
    @given(data=st.data())
    def test_every_pair_is_made_of_three_positions_an_interval_apart(
        self, data: st.DataObject
    ) -> None:
        intervals = data.draw(
            st.lists(
                st.sampled_from([0.1, 0.1, 0.1, 0.101, 0.2, 0.06, 1.0]), min_size=2, max_size=80
            )
        )
        wanted = data.draw(st.sampled_from([None, 0.1, 0.2, 0.25]))
        time = np.r_[0.0, np.cumsum(intervals)]
        try:
            plan = plan_steps(time, step_interval=wanted)
        except InputError:
            reject()
        right = np.minimum(plan.left + 1, time.size - 1)
        point = (1 - plan.weight) * time[plan.left] + plan.weight * time[right]
        assert (plan.triple >= 0).all()
        assert plan.triple.max() + 2 < plan.points
        assert ((plan.weight >= 0) & (plan.weight < 1)).all()
        for k in (0, 1):
            duration = point[plan.triple + k + 1] - point[plan.triple + k]
            np.testing.assert_allclose(duration, plan.step_interval, rtol=0.0501)
        if plan.mode == "exact":
            assert not plan.weight.any()


class TestDataset:
    def test_counts_and_units(self) -> None:
        time = np.delete(np.arange(200) * 0.1, [50, 51])
        rng = np.random.default_rng(4)
        x, y = rng.normal(size=(2, 198)).cumsum(axis=1) * 1e-3
        dataset = check_steps(steps(build_trajectory(time, x, y)))
        assert dataset["step_length"].attrs["units"] == "m"
        assert dataset["turning_angle"].attrs["units"] == "rad"
        assert dataset.attrs["mode"] == "exact"
        assert dataset.attrs["gaps"] == 1
        assert dataset.attrs["pairs"] == dataset.sizes["step"] == 48 + 146
        assert dataset.attrs["step_interval_s"] == pytest.approx(0.1)
        assert json.loads(dataset.attrs["warnings"]) == []
        np.testing.assert_allclose(dataset["time"].values[0], 0.1)

    def test_a_missing_sample_is_a_gap(self) -> None:
        x = np.arange(100.0) ** 1.5
        x[10] = np.nan
        dataset = steps(build_trajectory(np.arange(100) * 0.1, x, np.sin(x)))
        assert dataset.attrs["gaps"] == 1
        assert dataset.attrs["samples"] == 99
        assert dataset.sizes["step"] == 8 + 87

    def test_a_body_is_chosen_by_name(self) -> None:
        rng = np.random.default_rng(5)
        x, y = rng.normal(size=(2, 30, 2))
        trajectory = build_trajectory(np.arange(30.0), x, y, body=["left", "right"])
        expected = apply_steps(plan_steps(np.arange(30.0)), x[:, 1], y[:, 1]).step_length
        np.testing.assert_array_equal(steps(trajectory, body="right")["step_length"], expected)
        with pytest.raises(InputError, match="name one with `body`"):
            steps(trajectory)

    def test_many_steps_of_zero_length_name_a_longer_interval(self) -> None:
        x = np.cumsum(np.tile([1.0, 1.0, 1.0, 0.0], 50)) * 1e-3
        trajectory = build_trajectory(np.arange(200) * 0.1, x, np.zeros(200))
        with pytest.warns(ComparisonWarning, match="a step_interval of 0.2 s or more") as caught:
            dataset = steps(trajectory)
        assert caught[0].filename == __file__
        assert dataset.attrs["zero_length"] == 99
        assert json.loads(dataset.attrs["warnings"]) == [str(caught[0].message)]
        assert steps(trajectory, step_interval=0.2).attrs["zero_length"] == 0

    def test_a_body_at_rest_has_no_steps(self) -> None:
        trajectory = build_trajectory(np.arange(20.0), np.zeros(20), np.zeros(20))
        with pytest.raises(InputError, match="does not move at a step_interval of 1 s: name a lon"):
            steps(trajectory)

    def test_a_body_that_moves_too_rarely_is_told_how_to_go_on(self) -> None:
        x = np.repeat(np.arange(60.0), 3) * 1e-3  # moves every third sample only
        trajectory = build_trajectory(np.arange(180) * 0.1, x, np.zeros(180))
        with pytest.raises(InputError, match=r"name a step_interval of 0.4 s or more"):
            steps(trajectory)
