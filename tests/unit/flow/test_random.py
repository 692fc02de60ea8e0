"""Random tank flows: the two families by their formulas, written another way."""

from __future__ import annotations

import math

import numpy as np
import pytest
import xarray as xr

from driftwalk.core.errors import InputError
from driftwalk.flow import random_tank_flow

CIRCLE = {"shape": "circle", "diameter_m": 0.3}


def nodes(flow: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    x, y = np.meshgrid(flow["x"].values, flow["y"].values)
    return x, y


@pytest.mark.parametrize("seed", range(5))
def test_swirl_by_its_formula_in_metres(seed: int) -> None:
    flow = random_tank_flow(seed, arena=CIRCLE)
    x, y = nodes(flow)
    r = np.hypot(x, y)
    g = np.random.default_rng(seed)
    rate = g.uniform(0.25, 0.6) * g.choice([-1, 1])
    sink = g.uniform(0.05, 0.25)
    total = (-y + 1j * x) * rate * np.exp(-((r / 0.14) ** 4)) - sink * (x + 1j * y)
    for _ in range(4):
        at = g.uniform(0, 2 * np.pi)
        heading = at + np.pi + g.uniform(-0.8, 0.8)
        width, top = g.uniform(0.02, 0.04), g.uniform(0.03, 0.08)
        away = np.abs(x + 1j * y - 0.13 * np.exp(1j * at))
        total += top * np.exp(-((away / width) ** 2) / 2) * np.exp(1j * heading)
    assert flow["u"].values == pytest.approx(total.real, abs=1e-12)
    assert flow["v"].values == pytest.approx(total.imag, abs=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_eddies_are_free_of_divergence_but_for_the_sink(seed: int) -> None:
    """A sink at rate s per second: the divergence is -2 s everywhere, s from 0.1 to 0.3."""
    flow = random_tank_flow(seed, family="eddies", arena=CIRCLE)
    step = float(flow["x"].values[1] - flow["x"].values[0])
    u, v = flow["u"].values, flow["v"].values
    across = (u[2:-2, :-4] - 8 * u[2:-2, 1:-3] + 8 * u[2:-2, 3:-1] - u[2:-2, 4:]) / (12 * step)
    up = (v[:-4, 2:-2] - 8 * v[1:-3, 2:-2] + 8 * v[3:-1, 2:-2] - v[4:, 2:-2]) / (12 * step)
    divergence = across + up
    sink = -0.5 * divergence.mean()
    assert 0.1 <= sink <= 0.3
    # Central differences of fourth order: what remains is their own error.
    assert np.abs(divergence + 2 * sink).max() < 0.01
    # Without the sink the speed is what was drawn.
    x, y = nodes(flow)
    inside = np.hypot(x, y) <= 0.15
    speed = math.sqrt(np.mean(((u + sink * x) ** 2 + (v + sink * y) ** 2)[inside]))
    assert 0.0399 < speed < 0.0701


@pytest.mark.parametrize("family", ["swirl", "eddies"])
def test_the_tank_gives_the_lengths(family: str) -> None:
    """Twice the tank, somewhere else: the same picture, the same speeds."""
    small = random_tank_flow(3, family=family, arena=CIRCLE)  # type: ignore[arg-type]
    arena = {"shape": "circle", "diameter_m": 0.6, "center_m": [1.0, -2.0]}
    large = random_tank_flow(3, family=family, arena=arena)  # type: ignore[arg-type]
    assert large["x"].values == pytest.approx(1.0 + 2 * small["x"].values)
    assert large["y"].values == pytest.approx(-2.0 + 2 * small["y"].values)
    for name in ("u", "v"):
        assert large[name].values == pytest.approx(small[name].values, abs=1e-9)


@pytest.mark.parametrize("family", ["swirl", "eddies"])
def test_same_seed_same_flow_and_the_speed_asked_for(family: str) -> None:
    one, same, other = (
        random_tank_flow(seed, family=family, speed=0.04)  # type: ignore[arg-type]
        for seed in (1, 1, 2)
    )
    assert one.equals(same)
    assert not np.allclose(one["u"].values, other["u"].values)
    x, y = nodes(one)
    inside = np.hypot(x, y) <= 0.15
    squares = (one["u"].values ** 2 + one["v"].values ** 2)[inside]
    assert math.sqrt(squares.mean()) == pytest.approx(0.04)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"family": "laminar"}, "family must be one of swirl, eddies"),
        ({"speed": 0.0}, "must be positive"),
        ({"speed": math.nan}, "must be positive"),
        ({"arena": {"shape": "star"}}, "shape 'star'"),
    ],
)
def test_refusals(options: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        random_tank_flow(1, **options)
    with pytest.raises(InputError, match="from 0 on"):
        random_tank_flow(-1)
