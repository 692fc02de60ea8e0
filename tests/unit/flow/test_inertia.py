"""Eq. 4 against the force balance that it solves."""

from __future__ import annotations

import numpy as np
import pytest

from driftwalk.core.errors import InputError
from driftwalk.flow import inertia_correction
from driftwalk.flow.extract import cross_section

BLOCK = {"mass": 0.0116, "area": 9e-4, "water_density": 1000.0, "flow_drag_coefficient": 1.05}


def test_drag_of_the_corrected_flow_accelerates_the_body() -> None:
    acceleration = np.random.default_rng(0).normal(scale=0.2, size=(50, 2))
    passing = inertia_correction(acceleration, **BLOCK)
    speed = np.hypot(*passing.T)[:, None]
    force = 0.5 * 1000.0 * 9e-4 * 1.05 * speed * passing
    np.testing.assert_allclose(force, 0.0116 * acceleration, rtol=1e-12)


def test_no_acceleration_no_correction() -> None:
    np.testing.assert_array_equal(inertia_correction([[0.0, 0.0]], **BLOCK), [[0.0, 0.0]])
    assert np.hypot(*inertia_correction([1e-30, 0.0], **BLOCK)) < 1e-14


def test_missing_acceleration_stays_missing() -> None:
    assert np.isnan(inertia_correction([np.nan, 0.0], **BLOCK)).all()


@pytest.mark.parametrize("name", list(BLOCK))
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_refuses_parameters_that_are_no_positive_number(name: str, value: float) -> None:
    with pytest.raises(InputError, match=name):
        inertia_correction([0.1, 0.0], **{**BLOCK, name: value})


def test_cross_section() -> None:
    assert cross_section(2e-4, None, None) == 2e-4
    assert cross_section(None, 0.03, None) == pytest.approx(9e-4)
    assert cross_section(None, 0.03, 0.0129) == pytest.approx(3.87e-4)
    with pytest.raises(InputError, match="`side`"):
        cross_section(None, None, 0.01)
    with pytest.raises(InputError, match="keep one"):
        cross_section(1e-4, 0.03, None)
