"""What compares laws on held out samples, piece by piece."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from fit_worlds import coarse_study

from driftwalk.flow.arena import outline_of
from driftwalk.likelihood.filter.filter_pass import Passes, log_densities
from driftwalk.likelihood.filter.parameters import Body, Point
from driftwalk.likelihood.filter.series import series_of
from driftwalk.likelihood.law import held_out
from driftwalk.likelihood.law.held_out import LAWS, _Compared
from driftwalk.likelihood.law.search import evidence_of
from driftwalk.likelihood.newton import ModeSearch
from driftwalk.likelihood.prior import Prior, Weights
from driftwalk.likelihood.spline import lay_spline
from driftwalk.model import apply_overrides
from driftwalk.schema import Track

POINT = Point(np.zeros((2, 1, 1)), -0.7, -9.0, -8.0)


def test_the_error_of_a_difference_is_that_of_its_blocks() -> None:
    """Twenty blocks of 50 samples; a block without a prediction does not count."""
    random = np.random.default_rng(1)
    one, other = random.normal(size=(2, 1000))
    one[50:100] = np.nan
    one[3] = np.nan
    found: Any = {"a": _Compared(0.0, one, 0.5), "b": _Compared(0.0, other, 0.5), "c": None}
    means = [np.nanmean((one - other)[k : k + 50]) for k in range(0, 1000, 50) if k != 50]
    wanted = np.std(means, ddof=1) / math.sqrt(19)
    assert held_out._difference_std(found, "a", "b") == pytest.approx(wanted)
    assert held_out._difference_std(found, "b", "b") == 0.0
    assert math.isnan(held_out._difference_std(found, "c", "b"))
    assert math.isnan(held_out._difference_std(found, "a", None))
    few: Any = {"a": _Compared(0.0, np.r_[1.0, np.full(999, np.nan)], 0.5), "b": found["b"]}
    assert math.isnan(held_out._difference_std(few, "a", "b"))


def test_a_law_begins_with_what_was_found_of_everything_else() -> None:
    point = Point(
        POINT.coefficients, -0.7, -9.0, -8.0,
        opened={"linear_share": 0.4, "marker_x": 2e-3},
        fixed={"water_acceleration": 1.0, "water_spin": 1.0, "force_memory": 0.3},
    )  # fmt: skip
    for name, (floating, drag) in LAWS.items():
        start = held_out._start(point, floating=floating, drag=drag)
        assert start.number("water_acceleration") == start.number("water_spin") == float(floating)
        assert ("floating" in name) == floating
        # Departures stay as they were found, and are not searched again.
        assert start.fixed["marker_x"] == 2e-3
        assert start.fixed["force_memory"] == 0.3
        share, power = start.number("linear_share"), start.number("drag_power")
        assert share == {"linear": 1.0, "mixed": 0.3}.get(drag, 0.0)
        assert power == (1.7 if drag == "power" else 2.0)
        assert set(start.opened) == {"mixed": {"linear_share"}, "power": {"drag_power"}}.get(
            drag, set()
        )
        assert start.log_drag == -0.7


@pytest.mark.parametrize("floats", [False, True])
def test_the_other_push_of_the_water_takes_three_times_as_long(floats: bool) -> None:
    point = POINT.with_extra("water_acceleration", float(floats))
    parts = held_out._usual_parts(point)
    assert parts == {name: 1.0 if law[0] == floats else 3.0 for name, law in LAWS.items()}


def test_each_pass_is_told() -> None:
    told: list[tuple[int, int]] = []
    staged: Any = SimpleNamespace(stage=lambda name: lambda done, most: told.append((done, most)))
    estimate: Any = SimpleNamespace(study=SimpleNamespace(fit=SimpleNamespace(iterations=9)))
    passed = held_out._counted(staged, "paper", estimate)
    passed(1.0)
    passed(7.0)
    assert told == [(1, 9), (2, 9)]


def test_a_law_is_fitted_to_seven_tenths_and_predicts_the_rest() -> None:
    """By the same search on those samples, and the filter over all of them."""
    study = apply_overrides(coarse_study(), {"fit.iterations": 4})
    time = 0.1 * np.arange(150)
    noise = 3e-4 * np.random.default_rng(3).normal(size=(2, 150))
    x, y = 0.06 * np.cos(0.4 * time) + noise[0], 0.06 * np.sin(0.4 * time) + noise[1]
    series = series_of([Track(time, x, y, np.full(150, np.nan))], study, "none")
    spline = lay_spline(outline_of(study.tank.to_arena()), side=0.03, spacing=0.06)
    passes = Passes(series, Body(study, "none"), spline)
    flow = np.zeros((2, spline.rows, spline.columns))
    point = Point(flow, math.log(0.5), math.log(1e-3), math.log(3e-4))
    prior, weights = Prior(passes), Weights(0.7, 2e4)
    estimate: Any = SimpleNamespace(
        study=study, passes=passes, prior=prior, point=point, weights=weights
    )
    heard: list[float] = []
    found = held_out._under(estimate, floating=False, drag="linear", passed=heard.append)
    assert found is not None
    first = Passes([series[0].part(0, 105)], passes.body, spline)
    start = Point(
        flow, point.log_drag, point.log_intensity, point.log_noise, fixed={"linear_share": 1.0}
    )
    mode = ModeSearch(first, prior, 4).find(start, weights)
    assert mode is not None
    assert len(heard) == mode.iterations
    assert found.drag == pytest.approx(math.exp(mode.point.log_drag))
    assert found.evidence == pytest.approx(evidence_of(mode, prior))
    densities = log_densities(passes, series[0], mode.point)
    assert found.scores.size == 45
    np.testing.assert_allclose(found.scores, densities[105:])
