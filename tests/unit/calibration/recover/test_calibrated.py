"""What one calibration says of its parameters, of a map and of many alike."""

from __future__ import annotations

import numpy as np
import pytest
from every_kind import DIFFUSE, TUMBLE, every_kind
from scipy.special import ndtri

from driftwalk.calibration.estimation.identifiability import determination
from driftwalk.calibration.recovery_study import calibrated_parameters, interval_half_width
from driftwalk.motion import motion_model
from driftwalk.schema import Parameter

SCALES = [
    Parameter("speed", "m/s", 0.01, 1.0, scale="log"),
    Parameter("turn_rate", "rad/s", -5.0, 5.0),
]


@pytest.mark.parametrize("parameter", SCALES, ids=lambda one: one.scale)
@pytest.mark.parametrize("confidence", [0.8, 0.9, 0.95])
def test_widths_are_those_of_normal_draws(parameter: Parameter, confidence: float) -> None:
    """The draws are evenly spaced quantiles of a normal distribution, so nothing is by chance."""
    draws = (0.7 + 0.03 * ndtri((np.arange(20_001) + 0.5) / 20_001))[:, None]
    wanted = determination(draws, [parameter], confidence=confidence)
    value = float(parameter.value_at(0.7))
    found = interval_half_width(wanted.interval[0], value, parameter, confidence=confidence)
    assert found == pytest.approx(wanted.half_width[0], rel=1e-3)


@pytest.mark.parametrize("parameter", SCALES, ids=lambda one: one.scale)
def test_at_the_end_of_the_range_nothing_is_determined(parameter: Parameter) -> None:
    for shares in ((0.005, 0.5), (0.5, 0.995)):
        ends = parameter.value_at(np.array(shares))
        value = float(parameter.value_at(0.5))
        assert interval_half_width(ends, value, parameter, confidence=0.9) == np.inf
    missing = np.full(2, np.nan)
    assert np.isnan(interval_half_width(missing, 0.1, parameter, confidence=0.9))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("form", "model"),
    [
        ("calibration of one parameter", DIFFUSE),
        ("calibration of two parameters", TUMBLE),
        ("model_calibration", motion_model("inertial")),
    ],
)
def test_the_answer_is_that_of_the_calibration(form: str, model) -> None:
    found = every_kind(form)
    answer = calibrated_parameters(found, model.parameters)
    for index, one in enumerate(model.parameters):
        stored = found.sel(parameter=one.name)
        assert answer["estimate"][index] == float(stored["estimate"])
        assert answer["interval"][index].tolist() == stored["interval"].values.tolist()
    assert answer["half_width"].shape == answer["determined"].shape == (len(model.parameters),)
    if form == "model_calibration":
        assert answer["determined"].tolist() == found["determined"].values.tolist()
        assert answer["range"].tolist() == found["range"].values.tolist()
