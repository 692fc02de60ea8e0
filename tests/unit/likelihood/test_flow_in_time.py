"""The flow of a fit whose strength changes: its frames against the formula, and who takes them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
import xarray as xr
from fit_worlds import fitted

import driftwalk as dw
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.filter.series import Series
from driftwalk.likelihood.fitted_modes import strength_variables
from driftwalk.runs import read_found
from driftwalk.schema.answers.force_law import flow_in_time

SECONDS = 300.0
GROWING = {"strength_trend": -0.2, "strength_1": -0.05, "strength_6": 0.05}
PULSING = {"pulse_cosine": 0.1, "pulse_sine": 0.2, "pulse_frequency": 0.05}


def fit_with(numbers: Mapping[str, float], seconds: float = SECONDS) -> xr.Dataset:
    """Return the fit of the bundled recording as if its flow had changed so."""
    time = np.arange(0.0, seconds + 0.05, 0.1)
    none = np.zeros(time.size)
    series = Series(time, none, none, none, none, none.astype(np.uint8), span=seconds)
    point = Point(np.zeros((2, 4, 4)), 0.0, 0.0, 0.0, opened=numbers)
    data, words = strength_variables(point, series)
    return fitted(SECONDS).assign(data).assign_attrs(words)


def growth(time: np.ndarray, seconds: float = SECONDS) -> np.ndarray:
    """Return the strength of `GROWING`: a line by 40 %, and two cosines."""
    turn = np.pi * time / seconds
    line = 1.0 - 0.2 * (1.0 - 2.0 * time / seconds)
    return np.asarray(line - 0.05 * np.cos(turn) + 0.05 * np.cos(6.0 * turn))


def pulses(time: np.ndarray) -> np.ndarray:
    phase = 2.0 * np.pi * 0.05 * time
    return np.asarray(0.1 * np.cos(phase) + 0.2 * np.sin(phase))


def strength(flow: xr.Dataset, fit: xr.Dataset, time: Any) -> np.ndarray:
    """Return the velocity of a node over that of the mean flow, as a simulation meets it."""
    at = {"x": 20, "y": 30}
    found = flow["v"].isel(at).interp(time=time) / fit["v"].isel(at)
    return np.asarray(found.values)


def test_a_growing_flow_is_met_as_it_was_fitted() -> None:
    fit, time = fit_with(GROWING), np.linspace(0.0, SECONDS, 977)
    flow = dw.fitted_flow(fit)
    assert strength(flow, fit, time) == pytest.approx(growth(time), abs=2e-3)
    assert (flow.attrs["repeat"], flow["time"].values[-1]) == ("hold", SECONDS)
    assert flow.sizes["time"] == 71
    said = flow_in_time(fit)
    assert said is not None
    assert "71 frames from 0 to 300 s; strength 0.767 to 1.3 of the mean" in said
    assert "stays as in the first and the last frame" in said


def test_pulses_are_one_period_that_begins_again() -> None:
    fit, time = fit_with(PULSING), np.linspace(0.0, 20.0, 977)
    flow = dw.fitted_flow(fit)
    assert strength(flow, fit, time) == pytest.approx(1.0 + pulses(time), abs=5e-3)
    assert (flow.attrs["repeat"], flow.sizes["time"]) == ("loop", 17)
    assert flow["time"].values[-1] == pytest.approx(20.0)
    assert str(flow_in_time(fit)).startswith("17 frames of one period, 20 s, which begins again")


def test_pulses_do_not_stop_with_the_recording_where_the_flow_grows_too() -> None:
    seconds = SECONDS - 5.0  # the recording ends at the height of a pulse
    fit = fit_with(GROWING | PULSING, seconds)
    flow, time = dw.fitted_flow(fit), np.linspace(0.0, seconds, 977)
    expected = growth(time, seconds) + pulses(time)
    assert strength(flow, fit, time) == pytest.approx(expected, abs=7e-3)
    last = float(flow["time"][-1])
    assert seconds < last < seconds + 20.0 / 16.0 + 0.01
    assert strength(flow, fit, last) == pytest.approx(growth(np.array(seconds), seconds), abs=1e-9)


def test_pulses_that_are_too_fast_are_left_out_and_named() -> None:
    fit, time = fit_with({**GROWING, **PULSING, "pulse_frequency": 1.0}), np.linspace(0, 300.0, 99)
    assert strength(dw.fitted_flow(fit), fit, time) == pytest.approx(growth(time), abs=2e-3)
    said = flow_in_time(fit)
    assert said is not None
    assert "without pulses: the strength of the flow changes too fast" in said
    assert any("4801 frames would be needed" in text for text in read_found(fit).warnings)


def test_a_flow_with_modes_has_their_strength() -> None:
    fit, time = fit_with(GROWING), np.linspace(0.0, SECONDS, 77)
    turn = np.linspace(0.0, 80.0, 33)
    wave = np.cos(2.0 * np.pi * turn / 80.0)
    plane = ("flow_mode", "y", "x")
    fit = fit.assign(
        u_mode=(plane, fit["u"].values[None]),
        v_mode=(plane, 0.3 * fit["v"].values[None]),
        mode_amplitude=(("flow_mode", "mode_time"), wave[None]),
    ).assign_coords(mode_time=turn)
    flow = dw.fitted_flow(fit)
    during = time[time < 290.0]
    expected = growth(during) * (1.0 + 0.3 * np.cos(2.0 * np.pi * during / 80.0))
    # Linear between 71 frames, nineteen in a period.
    assert strength(flow, fit, during) == pytest.approx(expected, abs=7e-3)
    assert strength(flow, fit, SECONDS) == pytest.approx(1.3, abs=1e-9)


def test_a_steady_flow_has_no_frames() -> None:
    fit = fit_with({"drag_power": 1.9})
    assert "time" not in dw.fitted_flow(fit).dims
    assert flow_in_time(fit) is None
    for fit in (fit_with(GROWING), fit_with(PULSING)):
        mean = dw.fitted_flow(fit, interval=0)
        xr.testing.assert_equal(mean, dw.fitted_flow(fitted(SECONDS)))


def test_what_needs_a_steady_flow_takes_the_mean_and_says_so() -> None:
    study = dw.Study()
    flow, lacks = read_found(fit_with(GROWING)).mean_flow(study)
    assert "time" not in flow.dims
    assert "changes in time, and is taken with its mean" in str(lacks)
    assert read_found(fitted(SECONDS)).mean_flow(study)[1] is None
