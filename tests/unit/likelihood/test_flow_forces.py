"""The stochastic force of each named flow: its derivatives, one world, and many."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from switching_worlds import (
    DRAG,
    FORCES_N,
    NOISE_M,
    START_S,
    SWITCH_S,
    coarse_study,
    true_flows,
    two_settings,
)

import driftwalk as dw
from driftwalk.core.errors import InputError
from driftwalk.likelihood import flow_settings
from driftwalk.likelihood.filter.filter_pass import Passes
from driftwalk.likelihood.filter.parameters import Body, Point
from driftwalk.likelihood.preparation import prepare, spline_of

NAMED = {"switching_times_s": [START_S + SWITCH_S], "flow_labels": ["low", "high"]}
NUMBER = "flow_intensity_1"


@pytest.fixture(scope="module")
def fit() -> xr.Dataset:
    return dw.fit_motion(two_settings(1), coarse_study(**NAMED))


@pytest.mark.slow
def test_the_number_of_a_flow_is_the_q_of_that_flow_alone() -> None:
    """Its score and information are those of ln q in the passes over the second flow alone."""
    study = coarse_study(**NAMED)
    ready = prepare([two_settings(1)], study, None, None)
    spline = spline_of(study)
    passes = Passes(ready.series, Body(study, ready.angle), spline, 2)
    coefficients = 0.05 * np.random.default_rng(2).normal(size=(2, 2, spline.rows, spline.columns))
    logs = np.log([0.4, 6e-7, 3e-4])
    point = Point(coefficients, *logs, opened={NUMBER: 1.2})
    whole = passes.sums(point)
    own = [replace(one, flow=0) for one in passes.series if one.flow == 1]
    second = Point(coefficients[1], logs[0], logs[1] + 1.2, logs[2])
    alone = Passes(own, passes.body, spline).sums(second)
    assert whole.score[-1] == pytest.approx(alone.score[-2], rel=1e-9)
    assert whole.information[-1, -1] == pytest.approx(alone.information[-2, -2], rel=1e-9)
    # Of the likelihood, by a difference.
    up, down = (
        passes.sums(point.with_extra(NUMBER, 1.2 + h), noise="with").deviance for h in (1e-4, -1e-4)
    )
    assert whole.score[-1] == pytest.approx((down - up) / 2e-4, rel=1e-2)


@pytest.mark.slow
def test_each_flow_has_its_force(fit: xr.Dataset) -> None:
    """Half widths of 90 % are 1.64 sd: 4 sd for each of two."""
    force, low, high = (fit[f"flow_force_std{end}"].values for end in ("", "_low", "_high"))
    assert fit["flow"].values.tolist() == ["low", "high"]
    for found, truth, ends in zip(force, FORCES_N, zip(low, high, strict=True), strict=True):
        sd = np.log(ends[1] / ends[0]) / (2.0 * 1.645)
        assert abs(np.log(found / truth)) < 4.0 * sd
    assert float(fit["estimate"].sel(parameter="force_std")) == force[0]
    settings = flow_settings(fit)
    assert list(settings) == ["low", "high"]
    assert settings["high"].study.forces.force_std_N == force[1]
    assert settings["low"].flow.attrs["flow_label"] == "low"
    truth = {"drag_coefficient": DRAG, "tracking_noise": NOISE_M}
    for interval, flow in enumerate(true_flows()):
        given = {"force_std": FORCES_N[interval], "interval": interval, "flow": flow}
        score = dw.score_fit(fit, recordings=two_settings(1), **truth, **given)
        assert score["force_std_N_error"] == pytest.approx(force[interval] / FORCES_N[interval] - 1)
    with pytest.raises(InputError):
        flow_settings(fit.assign(flow_force_std_high=("flow", [np.inf, np.inf])))


@pytest.mark.study
def test_intervals_of_the_forces_hold_them() -> None:
    """Of 48 intervals of 90 %, fewer than 36 hold theirs once in 1000 if they are right."""
    held = 0
    for seed in range(3, 27):
        found = dw.fit_motion(two_settings(seed), coarse_study(**NAMED))
        low, high = found["flow_force_std_low"].values, found["flow_force_std_high"].values
        held += int(((low <= FORCES_N) & (high >= FORCES_N)).sum())
    assert held >= 36
