"""Comparing two motions: the dataset of `compare`, and the joint density."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import driftwalk
from driftwalk.comparison import (
    compare,
    joint_density,
    ks_distance,
    step_length_edges,
    steps,
    turning_angle_edges,
)
from driftwalk.core.errors import InputError
from driftwalk.schema import build_trajectory


def random_walk(
    seed: int, *, n: int = 1500, spread: float = 0.3, interval: float = 0.1
) -> xr.Dataset:
    """A correlated random walk with independent steps of about 1 cm."""
    rng = np.random.default_rng(seed)
    heading = np.cumsum(rng.normal(scale=spread, size=n))
    length = rng.gamma(4.0, 0.0025, size=n)
    return build_trajectory(
        np.arange(n) * interval, *np.cumsum(length * [np.cos(heading), np.sin(heading)], axis=1)
    )


def points(dataset: xr.Dataset) -> np.ndarray:
    return np.column_stack([dataset["step_length"], dataset["turning_angle"]])


class TestCompare:
    def test_numbers_are_those_of_the_parts(self) -> None:
        a, b = random_walk(1), random_walk(2, spread=0.5)
        result = compare(a, b, permutations=99)
        assert result["ks_distance"].item() == ks_distance(points(steps(a)), points(steps(b)))
        assert result["score"].item() == 1 - result["ks_distance"].item()
        assert result["pairs"].values.tolist() == [1498, 1498]
        assert result["p_value"].item() == 0.01
        assert result["ks_distance"].item() > result["noise_floor"].item()
        assert result["mode"].values.tolist() == ["exact", "exact"]
        assert result.attrs["step_interval_s"] == pytest.approx(0.1)
        assert json.loads(result.attrs["warnings"]) == []

    def test_one_motion_twice(self) -> None:
        a = random_walk(3)
        with pytest.warns(driftwalk.ComparisonWarning, match="share a coordinate"):
            result = compare(a, a, permutations=0)
        assert result["ks_distance"].item() == 0.0
        assert result["ks_quadrant"].item() == -1
        assert np.isnan(result["p_value"].item())
        assert result.attrs["permutations"] == 0

    @pytest.mark.false_alarm(5e-3)
    def test_another_realisation_is_near_the_noise_floor(
        self, fresh_seed: Callable[[int], int]
    ) -> None:
        """The smallest p-value of 199 permutations comes once in 200 times.

        Over 40 seeds the ratio was 1.05 +- 0.19, from 0.75 to 1.53: 5 sd.
        """
        runs = random_walk(fresh_seed(4)), random_walk(fresh_seed(5))
        result = compare(*runs, permutations=199)
        assert result["p_value"].item() > 1 / 200
        assert 0.1 < result["ks_distance"].item() / result["noise_floor"].item() < 2.0

    def test_both_are_taken_at_the_longer_interval(self) -> None:
        result = compare(random_walk(6), random_walk(7, interval=0.2), permutations=0)
        assert result.attrs["step_interval_s"] == pytest.approx(0.2)
        assert result["pairs"].values.tolist() == [748, 1498]

    def test_too_short_for_a_test_is_said_and_not_fatal(self) -> None:
        result = compare(random_walk(8, n=20), random_walk(9, n=20))
        assert np.isnan(result["p_value"].item())
        assert "no significance test" in json.loads(result.attrs["warnings"])[0]

    def test_too_short_for_steps_is_fatal(self) -> None:
        with pytest.raises(InputError, match="at least three samples"):
            compare(random_walk(10, n=2), random_walk(11))

    def test_densities_share_their_bins(self) -> None:
        result = compare(random_walk(12), random_walk(13), permutations=0)
        assert result["step_density"].shape == (2, 32, 32)
        np.testing.assert_allclose(result["step_density"].sum(axis=(1, 2)), 1.0)
        assert result["step_length_edge"].size == result["turning_angle_edge"].size == 33

    @pytest.mark.slow
    def test_it_can_be_stored_and_read(self, tmp_path: Path) -> None:
        result = compare(random_walk(14), random_walk(15), permutations=19)
        result.to_netcdf(tmp_path / "comparison.nc", engine="h5netcdf")
        with xr.open_dataset(tmp_path / "comparison.nc", engine="h5netcdf") as stored:
            xr.testing.assert_equal(stored.load(), result)

    def test_the_stage_is_called_as_the_function(self) -> None:
        called = driftwalk.compare(random_walk(16), random_walk(17), permutations=0)
        assert called.attrs["kind"] == "comparison"


def test_two_runs_of_the_simulated_tank(shared_data: Callable[[str], Path]) -> None:
    """The same parameters, another seed: closer than a run at another step interval."""
    folder = shared_data("tank30-ode-a")
    runs = []
    for name in ("recording.csv", "recording_second_seed.csv"):
        time, x, y, _ = np.loadtxt(folder / name, delimiter=",", skiprows=1).T
        runs.append(build_trajectory(time, x, y))
    result = compare(*runs, permutations=49)
    assert result["pairs"].values.tolist() == [17999, 17999]
    assert result["ks_distance"].item() < 0.06
    assert result["tied_fraction"].item() < 0.01
    slower = points(steps(runs[0], step_interval=0.2))
    assert ks_distance(points(steps(runs[0])), slower) > 0.5


class TestJointDensity:
    def test_equals_the_histogram_of_numpy(self) -> None:
        rng = np.random.default_rng(1)
        length, angle = rng.gamma(2.0, size=500), rng.uniform(-np.pi, np.pi, size=500)
        edges = np.linspace(0, length.max() + 1e-9, 33)
        expected, _, _ = np.histogram2d(length, angle, bins=(edges, turning_angle_edges()))
        density = joint_density(length, angle, step_length_edge=edges)
        np.testing.assert_array_equal(density, expected / 500)

    def test_what_lies_beyond_counts_in_the_last_bin(self) -> None:
        density = joint_density([0.1, 7.0], [0.0, np.pi], step_length_edge=[0.0, 0.5, 1.0])
        assert density.shape == (2, 32)
        assert density[1, 31] == 0.5
        assert density.sum() == 1.0

    def test_edges_reach_over_nearly_all_lengths(self) -> None:
        lengths = np.r_[np.linspace(0, 1, 10_000), 50.0]
        edges = step_length_edges(lengths, lengths)
        assert edges.size == 33
        assert edges[0] == 0.0
        assert 0.99 < edges[-1] < 1.01

    @pytest.mark.parametrize(
        ("length", "angle", "edges", "message"),
        [
            ([], [], [0, 1], "not empty"),
            ([1.0], [1.0, 2.0], [0, 1], "of one size"),
            ([1.0], [1.0], [1, 0], "must increase"),
            ([1.0], [1.0], [1], "at least two"),
        ],
    )
    def test_what_cannot_be_binned(
        self, length: list[float], angle: list[float], edges: list[float], message: str
    ) -> None:
        with pytest.raises(InputError, match=message):
            joint_density(length, angle, step_length_edge=edges)
