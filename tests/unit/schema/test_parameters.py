"""Parameters: what their ranges give, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from driftwalk.core.errors import ConfigurationError
from driftwalk.core.grid import grid_values
from driftwalk.model import Calibration
from driftwalk.schema import Parameter
from driftwalk.schema.parameters import unit_suffix


def test_grid_values_are_the_decimals_of_the_study() -> None:
    assert grid_values(0.0, 0.3, 0.1) == (0.0, 0.1, 0.2, 0.3)
    assert grid_values(0.45, 0.45, 0.1) == (0.45,)
    assert grid_values(0.0, 0.25, 0.1) == (0.0, 0.1, 0.2)


def test_a_linear_parameter_has_the_axis_of_the_study() -> None:
    study = Calibration()
    drag = Parameter("drag_coefficient", "1", 0.0, 2.0, step=0.05)
    assert drag.values == drag.coordinates == study.drag_coefficients


def test_a_step_that_is_left_open_divides_the_range_into_forty() -> None:
    speed = Parameter("speed", "m/s", 0.0, 0.1)
    assert len(speed.values) == 41
    assert speed.values[-1] == 0.1
    assert speed.refined_step == pytest.approx(speed.step / 5)
    rate = Parameter("rate", "1/s", 0.01, 10.0, scale="log")
    assert np.diff(np.log(rate.values)) == pytest.approx(np.full(40, np.log(1000.0) / 40))


def test_words_come_from_the_name_unless_they_are_given() -> None:
    plain = Parameter("turn_rate", "1/s", 0.0, 5.0)
    assert (plain.label, plain.symbol, plain.key) == ("turn rate", "turn rate", "turn_rate_per_s")
    named = Parameter("force_std", "N", 0.0, 1.0, label="stochastic force", symbol="sigma_F")
    assert (named.label, named.symbol, named.key) == ("stochastic force", "sigma_F", "force_std_N")


@pytest.mark.parametrize(
    ("unit", "suffix"),
    [("1", ""), ("m/s", "m_s"), ("1/s", "per_s"), ("N^2 s", "N2_s"), ("rad2 s-1", "rad2_s_1")],
)
def test_units_become_part_of_a_key(unit: str, suffix: str) -> None:
    assert unit_suffix(unit) == suffix


@settings(deadline=None)
@given(st.floats(1e-9, 1e9), st.floats(1.0, 1e6))
def test_coordinates_lead_back_to_the_values(low: float, ratio: float) -> None:
    for scale in ("linear", "log"):
        one = Parameter("one", "1", low, low * ratio, scale=scale)
        np.testing.assert_allclose(one.to_value(one.to_coordinate(one.values)), one.values)
        assert np.all(np.asarray(one.values) <= one.high * (1 + 1e-9))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"name": "turn rate"}, "Python takes as a keyword"),
        ({"name": "lambda"}, "Python takes as a keyword"),
        ({"low": 2.0}, "below its beginning 2"),
        ({"low": float("nan")}, "not finite"),
        ({"low": 0.0, "scale": "log"}, "above 0, got 0"),
        ({"scale": "square"}, "one of linear, log, got 'square'"),
        ({"step": -0.1}, "a step is below 0"),
        ({"step": 1e-9}, "more than 1000000 values"),
    ],
)
def test_what_is_no_parameter_is_refused(wrong: dict[str, object], message: str) -> None:
    right = {"name": "speed", "unit": "m/s", "low": 0.1, "high": 1.0}
    with pytest.raises(ConfigurationError, match=message):
        Parameter(**{**right, **wrong})
