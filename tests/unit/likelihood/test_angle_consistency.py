"""The spin of a block against the vorticity of the water, in flows of known vorticity."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from fit_worlds import coarse_study

from driftwalk.core.errors import InputError
from driftwalk.likelihood.angle_consistency import _vorticity, spin_correlation
from driftwalk.likelihood.check import run
from driftwalk.likelihood.filter.series import Series
from driftwalk.likelihood.spline import Spline
from driftwalk.schema import build_trajectory

SPLINE = Spline(-0.1, -0.08, 0.02, 13, 11)


def coefficients_of(u: Any, v: Any) -> np.ndarray:
    """Return coefficients whose surface is near a flow: of a quadratic but for a constant."""
    # The spline of coefficient (j, i) has its middle one cell to the left of cell i.
    x = SPLINE.origin_x + SPLINE.spacing * (np.arange(SPLINE.columns) - 1.0)
    y = SPLINE.origin_y + SPLINE.spacing * (np.arange(SPLINE.rows) - 1.0)
    at_x, at_y = np.meshgrid(x, y)
    return np.stack([u(at_x, at_y), v(at_x, at_y)])


def places(count: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    return random.uniform(-0.07, 0.07, count), random.uniform(-0.05, 0.05, count)


def test_the_vorticity_of_quadratic_flows_is_exact() -> None:
    """Cubic splines hold quadratics but for a constant; a central difference is exact for them."""
    x, y = places(20)
    rigid = coefficients_of(lambda x, y: -0.7 * y, lambda x, y: 0.7 * x)
    assert _vorticity(rigid, SPLINE, x, y) == pytest.approx(1.4)
    bent = coefficients_of(lambda x, y: 3.0 * y**2 + x, lambda x, y: 2.0 * x**2 - y)
    assert _vorticity(bent, SPLINE, x, y) == pytest.approx(4.0 * x - 6.0 * y)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_spin_with_the_water_has_the_correlation_1(sign: float) -> None:
    """And one that is counted the other way round -1; what is left out or missing counts not."""
    flow = coefficients_of(lambda x, y: -2.0 * y**2, lambda x, y: 5.0 * x**2)
    series = []
    for seed in range(2):
        x, y = places(60, seed)
        omega = 0.5 * sign * (10.0 * x + 4.0 * y)
        excluded = np.zeros(60, np.uint8)
        excluded[5], omega[5] = 1, 1e3
        x[6], omega[6] = np.nan, -1e3
        series.append(Series(0.1 * np.arange(60), x, y, 0 * x, omega, excluded))
    passes: Any = SimpleNamespace(series=series, spline=SPLINE)
    assert spin_correlation(flow, passes) == pytest.approx(sign)
    # Of independent numbers it is the mean of the products over both sizes.
    for one in series:
        one.omega[:5] *= -1.0
    seen = [np.isfinite(one.x) & (one.excluded == 0) for one in series]
    spin = np.concatenate([one.omega[some] for one, some in zip(series, seen, strict=True)])
    water = np.concatenate(
        [(10.0 * one.x + 4.0 * one.y)[some] for one, some in zip(series, seen, strict=True)]
    )
    wanted = (spin @ water) / np.sqrt((spin @ spin) * (water @ water))
    assert abs(wanted) < 0.95
    assert spin_correlation(flow, passes) == pytest.approx(wanted)
    still = np.zeros_like(flow)
    assert spin_correlation(still, passes) == 0.0


def test_negated_orientations_are_counted_the_other_way_round(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """In the recordings to which a fit of a block that turns against the water is repeated."""
    time = np.arange(5.0)
    asked: list[xr.Dataset] = []

    def fit(recordings: list[xr.Dataset], *_: Any, **__: Any) -> xr.Dataset:
        asked.extend(recordings)
        raise InputError("the recordings are enough")

    monkeypatch.setattr(run, "fit_motion", fit)
    monkeypatch.setattr(run, "described", lambda one: one)
    attrs = {"kind": "fit", "study": coarse_study().to_toml(), "angle": "state"}
    before = xr.Dataset({"spin_correlation": -0.5}, {"warning": ("warning", [])}, attrs)
    recorded = build_trajectory(time, 0.1 * time, 0.2 * time, 0.3 * time)
    run._with_angle_tried(before, xr.Dataset(), [recorded], body=None)
    (found,) = asked
    assert found["theta"].values.ravel().tolist() == pytest.approx((-0.3 * time).tolist())
    assert found["x"].values.ravel().tolist() == pytest.approx((0.1 * time).tolist())
