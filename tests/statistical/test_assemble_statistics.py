"""Distributions in self-assembly. Under a new seed each check fails falsely at most once in 1e5
runs; the markers add them up."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from kernel_worlds import BOX, assemble, keys
from scipy import stats
from single_block import INERTIA, MASS, RADIUS, SIDE, Floats, model, still

from driftwalk import _core

FALSE_ALARM = 1e-5
FORCE, STEP = 1e-3, 0.01


def _is_variance(sample: Floats, variance: float) -> bool:
    low, high = stats.chi2.ppf([FALSE_ALARM / 2, 1 - FALSE_ALARM / 2], sample.size)
    return bool(low < np.sum(sample**2) / variance < high)


@pytest.mark.false_alarm(6 * FALSE_ALARM)
@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize(
    "cells",
    [
        [[0, 0]],
        [[0, 0], [1, 0]],
        [[0, 0], [1, 0], [2, 0]],
        [[0, 0], [1, 0], [0, 1]],
        [[0, 0], [1, 0], [0, 1], [1, 1]],
    ],
    ids=["1", "2", "I3", "L3", "O"],
)
def test_force_on_an_assembly_is_that_on_its_blocks(
    cells: list[list[int]], precision: str, fresh_seed: Callable[[int], int]
) -> None:
    # C_d = 0. Blocks side by side latch in the first step. From then on the velocity gains e dt in
    # a step, e of variance sigma^2 / (n m^2), the spin eps dt of variance sigma^2 sum r^2 / I^2:
    # the second difference of the position is (e2 + e3) dt^2 / 2, two independent draws.
    count, worlds = len(cells), 3000
    native = model(still, times=[0.0], radius=5.0, nodes=np.arange(-1, 2) * 5.0)
    start = np.zeros((worlds, count, 3))
    start[:, :, :2] = SIDE * np.array(cells)
    poses = []
    for steps in (1, 2, 3):
        run = assemble(
            native, start, keys(worlds, fresh_seed(1)), steps=steps, drag=0.0, force=FORCE,
            sample_every=steps, precision=precision,
        )  # fmt: skip
        assert (run["assembly"] == 0).all()
        poses.append(run["pose"])
    bend = poses[2] - 2 * poses[1] + poses[0]
    centre = bend[:, :, :2].mean(axis=1)
    variance = STEP**4 / 2 * FORCE**2 / (count * MASS**2)
    # Positions in single precision are rounded to about 2 nm, against steps of some micrometres.
    for axis in (0, 1):
        assert _is_variance(centre[:, axis], variance)
        assert stats.kstest(centre[:, axis] / np.sqrt(variance), "norm").pvalue > FALSE_ALARM
    assert abs(stats.pearsonr(*centre.T).statistic) < 4.5 / np.sqrt(worlds)
    arms = SIDE * (np.array(cells) - np.mean(cells, axis=0))
    turned = bend[:, 0, 2]
    if count == 1:
        assert not turned.any()
        return
    inertia = count * INERTIA + MASS * np.sum(arms**2)
    assert _is_variance(turned, STEP**4 / 2 * FORCE**2 * np.sum(arms**2) / inertia**2)


@pytest.mark.false_alarm(7 * FALSE_ALARM)
def test_blocks_of_a_world_are_pushed_independently(fresh_seed: Callable[[int], int]) -> None:
    worlds = 4000
    native = model(still, times=[0.0], radius=5.0, nodes=np.arange(-1, 2) * 5.0)
    start = np.zeros((worlds, 3, 3))
    start[:, :, 0] = [-1.0, 0.0, 1.0]
    run = assemble(
        native, start, keys(worlds, fresh_seed(1)), steps=1, drag=0.0, force=FORCE,
        latching="none", precision="double",
    )  # fmt: skip
    moved = (run["pose"] - start)[:, :, :2].reshape(worlds, 6)
    for column in moved.T:
        assert _is_variance(column, (STEP**2 / 2 * FORCE / MASS) ** 2)
    correlation = np.corrcoef(moved.T) - np.eye(6)
    assert np.abs(correlation).max() < 5.0 / np.sqrt(worlds)


def _corners(r: Floats, turn: Floats) -> Floats:
    """Distance from the centre of a circle of the farthest corner of a block at (r, 0)."""
    around = turn[..., None] + np.pi / 4 + np.arange(4) * np.pi / 2
    half = SIDE / np.sqrt(2)
    x, y = r[..., None] + half * np.cos(around), half * np.sin(around)
    return np.asarray(np.hypot(x, y).max(axis=-1))


@pytest.mark.false_alarm(3 * FALSE_ALARM)
def test_one_block_starts_anywhere_in_a_circle_with_equal_chance(
    fresh_seed: Callable[[int], int],
) -> None:
    native = model(still, times=[0.0])
    start, placed = _core.place_blocks(native, blocks=1, key=keys(20_000, fresh_seed(1)), threads=2)
    assert (placed == 1).all()
    x, y, theta = start[:, 0].T
    for angle in (theta, np.arctan2(y, x)):
        assert stats.kstest(angle, stats.uniform(-np.pi, 2 * np.pi).cdf).pvalue > FALSE_ALARM
    # At distance r the share of orientations that fit, times the circle's circumference.
    r = (np.arange(1000) + 0.5) * RADIUS / 1000
    turn = (np.arange(200) + 0.5) * np.pi / 400
    fits = (_corners(r[:, None] + 0 * turn, turn + 0 * r[:, None]) <= RADIUS).mean(axis=1)
    cumulated = np.concatenate([[0.0], np.cumsum(r * fits)])
    distance = np.hypot(x, y)
    share = np.interp(distance, np.arange(1001) * RADIUS / 1000, cumulated / cumulated[-1])
    assert stats.kstest(share, "uniform").pvalue > FALSE_ALARM
    # Without the share of orientations it would not be: the check can tell.
    plain = (distance / (RADIUS - SIDE / 2)) ** 2
    assert stats.kstest(plain, "uniform").pvalue < 1e-9


@pytest.mark.false_alarm(2 * FALSE_ALARM)
def test_one_block_starts_anywhere_in_a_box_with_equal_chance(
    fresh_seed: Callable[[int], int],
) -> None:
    # Given its orientation a block fits in a smaller box: in it, both coordinates are uniform.
    native = model(still, times=[0.0], radius=0.0, edges=BOX)
    start, _ = _core.place_blocks(native, blocks=1, key=keys(20_000, fresh_seed(2)), threads=2)
    x, y, theta = start[:, 0].T
    reach = SIDE / 2 * (np.abs(np.cos(theta)) + np.abs(np.sin(theta)))
    across, up = 0.5 + x / (2 * (0.12 - reach)), 0.5 + y / (2 * (0.1 - reach))
    table = np.histogram2d(across, up, bins=10, range=[[0, 1], [0, 1]])[0]
    assert table.sum() == 20_000
    assert stats.chisquare(table.ravel()).pvalue > FALSE_ALARM
    # And the orientation has a density in proportion to the room that it leaves.
    grid = -np.pi + (np.arange(4000) + 0.5) * np.pi / 2000
    extent = SIDE / 2 * (np.abs(np.cos(grid)) + np.abs(np.sin(grid)))
    cumulated = np.concatenate([[0.0], np.cumsum((0.12 - extent) * (0.1 - extent))])
    share = np.interp(theta, np.linspace(-np.pi, np.pi, 4001), cumulated / cumulated[-1])
    assert stats.kstest(share, "uniform").pvalue > FALSE_ALARM
