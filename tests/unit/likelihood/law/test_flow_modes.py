"""Modes of the flow in time: closed forms, slopes of the likelihood, and a flow that alternates."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from euler_blocks import (
    DEPTH_M,
    DRAG,
    FORCE_INTERVAL_S,
    MASS_KG,
    SIDE_M,
    euler_recordings,
    stirred,
)
from fit_worlds import coarse_study, fitted, recording

import driftwalk as dw
from driftwalk.core.errors import InputError
from driftwalk.flow.arena import outline_of
from driftwalk.flow.grid import make_grid
from driftwalk.likelihood.check import replicates
from driftwalk.likelihood.filter.filter_pass import Passes, Sums
from driftwalk.likelihood.filter.parameters import Body, Point
from driftwalk.likelihood.filter.series import layer_strengths, mode_amplitudes, series_of
from driftwalk.likelihood.fitted_modes import mode_variables, moving_fields, stored_frames
from driftwalk.likelihood.law import flow_modes
from driftwalk.likelihood.law.flow_modes import modes_at
from driftwalk.likelihood.law.shape_changes import ShapeChange
from driftwalk.likelihood.newton import Mode, ModeSearch
from driftwalk.likelihood.preparation import prepare
from driftwalk.likelihood.prior import Prior, Weights
from driftwalk.likelihood.spline import lay_spline
from driftwalk.likelihood.start import first_point, first_weights
from driftwalk.model import Study, apply_overrides
from driftwalk.schema import body_track

PERIOD, SHARE = 20.0, 0.3


@pytest.fixture(scope="module")
def passes() -> Passes:
    study = coarse_study()
    series = series_of([body_track(recording(60.0))], study, "state")
    spline = lay_spline(outline_of(study.tank.to_arena()), side=0.03, spacing=0.03)
    return Passes(series, Body(study, "state"), spline, layers=2)


@pytest.fixture(scope="module")
def point(passes: Passes) -> Point:
    layers = np.random.default_rng(1).normal(
        0.0, 0.01, (2, 2, passes.spline.rows, passes.spline.columns)
    )
    return Point(
        layers,
        math.log(0.5),
        math.log(2e-3),
        math.log(2.5e-4),
        math.log(3e-3),
        math.log(0.012),
        opened={"mode_frequency": 0.05, "mode_phase": 0.4},
    )


def test_amplitudes_are_waves_of_unit_rms_in_quadrature(point: Point) -> None:
    time = np.linspace(0.0, 200.0, 4000, endpoint=False)
    both = replace(point, coefficients=np.zeros((3, 2, 4, 4)))
    np.testing.assert_allclose(
        mode_amplitudes(time, both) @ mode_amplitudes(time, both).T / time.size,
        np.eye(2),
        atol=1e-9,
    )
    one = mode_amplitudes(time, point)
    np.testing.assert_allclose(one[0], math.sqrt(2.0) * np.cos(0.1 * np.pi * time + 0.4))


def test_the_strength_of_the_flow_is_that_of_all_layers(passes: Passes, point: Point) -> None:
    series = passes.series[0]
    growing = replace(point, opened={**point.opened, "strength_trend": 0.2})
    plain, changed = (layer_strengths(series, one) for one in (point, growing))
    assert plain is not None
    assert changed is not None
    np.testing.assert_allclose(changed, plain * (1.2 - 0.4 * series.time / series.span))


def test_the_score_of_frequency_and_phase_is_the_slope_of_the_likelihood(
    passes: Passes, point: Point
) -> None:
    sums = passes.sums(point)
    assert sums.score.size == point.coefficients.size + 1 + 4 + 2
    assert np.array_equal(sums.information, sums.information.T)
    for place, step in ((-2, 1e-6), (-1, 1e-3)):
        change = np.zeros(sums.score.size)
        change[place] = step
        apart = [passes.sums(point.moved(sign * change)).deviance for sign in (1, -1)]
        slope = -(apart[0] - apart[1]) / (2.0 * step)
        assert sums.score[place] == pytest.approx(slope, rel=5e-3, abs=0.5)


def test_the_prior_of_the_modes_has_a_weight_of_its_own(passes: Passes, point: Point) -> None:
    prior, weights = Prior(passes), Weights(1e-3, 2.0, modes=5.0)
    size = point.coefficients.size
    count = size + 1 + len(point.extras)
    none = Sums(0.0, np.zeros(count), np.zeros((count, count)), 0)
    zero = replace(point, coefficients=0.0 * point.coefficients)
    with_flow, without = (prior.add(none, one, weights) for one in (point, zero))
    precision = with_flow.information[:size, :size]
    flat = point.coefficients.ravel()
    assert with_flow.deviance - without.deviance == pytest.approx(0.5 * flat @ precision @ flat)
    half = size // 2
    np.testing.assert_allclose(precision[half:, half:], 5.0 * precision[:half, :half])
    assert prior.log_determinant(weights, 4) == pytest.approx(np.linalg.slogdet(precision)[1])
    # The fixed point of the evidence: where the data say nothing of the modes, their prior stays.
    covariance = np.linalg.inv(with_flow.information + np.diag([*np.zeros(size), *np.ones(7)]))
    scale = prior.updated(weights, point, covariance).modes / weights.modes
    assert scale == pytest.approx(0.1)


def test_replicates_are_in_the_flow_with_its_modes(passes: Passes, point: Point) -> None:
    series, spline = passes.series[0], passes.spline
    mean = dw.uniform_flow(0.02, -0.01)
    frames = replicates._in_frames(mean, series, point, spline)
    assert frames.attrs["repeat"] == "loop"
    assert float(frames["time"][-1]) == pytest.approx(20.0)
    time, x, y = 3.0, frames["x"].values, frames["y"].values
    want = (
        mean["u"].values
        + math.sqrt(2.0)
        * math.cos(0.1 * math.pi * time + 0.4)
        * (spline.values(point.coefficients[1], x, y)[0])
    )
    # Between frames the flow is linear in time.
    found = frames["u"].interp(time=time).values
    assert np.abs(found - want).max() < 0.02 * np.abs(want).max()


def line(frequency: float, p_value: float) -> ShapeChange:
    candidates = (frequency,) if math.isfinite(frequency) else ()
    return ShapeChange(frequency, p_value, 600.0 * frequency, 100.0, candidates)


@pytest.mark.parametrize(
    ("found", "wanted", "said"),
    [
        (line(0.02, 0.3), "auto", ""),
        (None, "auto", ""),
        (line(0.02, 0.3), "1", flow_modes.NO_LINE),
        (line(math.nan, 1e-40), "auto", flow_modes.NO_SOLUTION),
    ],
)
def test_without_a_line_there_are_no_modes(
    found: ShapeChange | None, wanted: Any, said: str
) -> None:
    none: Any = object()
    modes = modes_at(none, none, found, wanted)
    assert modes.start is None
    assert modes.unsettled.startswith(said)
    assert bool(modes.unsettled) == bool(said)


def test_modes_of_two_recordings_are_refused() -> None:
    study = apply_overrides(coarse_study(), {"fit.flow_modes": "auto"})
    with pytest.raises(InputError, match="one recording in one flow"):
        dw.likelihood.check_fit([recording(60.0), recording(60.0, "second")], study)


class Tried:
    """Searches of modes whose evidences and deviances are stated; None where one breaks down."""

    def __init__(
        self, patch: pytest.MonkeyPatch, steady: float, one: float | None, both: float | None
    ) -> None:
        self.begun: list[tuple[int, Any, float]] = []
        self.ends: dict[int, float | None] = {2: one, 3: both}
        patch.setattr(flow_modes, "evidence_of", lambda mode, _: mode.deviance)
        patch.setattr(flow_modes, "with_layers", lambda search, layers: self.of(layers))
        self.steady = self.mode(np.full((2, 1, 3), 0.1), {}, steady)
        self.search: Any = SearchOf()

    def mode(self, coefficients: Any, opened: dict[str, float], evidence: float) -> Mode:
        at = Point(coefficients, -0.7, -9.0, -8.0, opened=opened)
        return Mode(at, Weights(1.0, 2.0), np.eye(1), 1, 1, True, evidence)

    def of(self, layers: int) -> Any:
        def find(point: Any, weights: Weights, *, held: Any) -> Mode | None:
            self.begun.append((layers, point, weights.modes))
            end = self.ends[layers]
            if end is None:
                return None
            opened = {**point.opened}
            moved = point.coefficients.copy()
            if layers == 3:
                # An ellipse whose larger axis is 4 at 30 degrees.
                first, second = np.array([1.0, 2.0, 2.0]), np.array([2.0, -1.0, 0.0])
                axis = np.deg2rad(30.0)
                moved[1, 0] = 4.0 / 3.0 * math.cos(axis) * first - 0.1 * math.sin(axis) * second
                moved[2, 0] = 4.0 / 3.0 * math.sin(axis) * first + 0.1 * math.cos(axis) * second
            return self.mode(moved, opened, end)

        return SimpleNamespace(prior=None, coarse=lambda: SimpleNamespace(find=find))

    def found(self, wanted: Any, *candidates: float) -> Any:
        found = ShapeChange(candidates[0], 1e-40, 12.0, 100.0, candidates)
        return modes_at(self.search, self.steady, found, wanted)


@dataclass(frozen=True)
class SearchOf:
    prior: Any = None
    iterations: int = 30


@pytest.mark.parametrize(
    ("one", "both", "wanted", "layers"),
    [
        (20.0, 22.9, "auto", 2),  # two modes need more evidence than one
        (20.0, 23.1, "auto", 3),
        (None, 23.1, "auto", 3),
        (12.9, 12.9, "auto", 1),  # and any of them more than a steady flow
        (13.1, 13.1, "auto", 2),
        (0.0, 0.0, "2", 3),
        (0.0, 0.0, "1", 2),
        (None, 40.0, "1", 1),
        (40.0, None, "auto", 1),
    ],
)
def test_modes_are_taken_by_their_evidence(
    monkeypatch: pytest.MonkeyPatch, one: float | None, both: float | None, wanted: Any, layers: int
) -> None:
    tried = Tried(monkeypatch, 10.0, one, both)
    found = tried.found(wanted, 0.05)
    assert (1 if found.start is None else found.start.point.layers) == layers
    assert (found.start is None) == (layers == 1)
    assert bool(found.unsettled) == (layers == 1)
    number, point, weakness = tried.begun[0]
    assert number == 3
    assert point.opened == {"mode_frequency": 0.05}
    assert weakness == flow_modes.FLOW_MODES.weakness
    np.testing.assert_array_equal(point.coefficients[0], tried.steady.point.coefficients)
    assert not point.coefficients[1:].any()
    if found.start is not None:
        names = {"mode_frequency"} if layers == 3 else {"mode_frequency", "mode_phase"}
        assert set(found.start.point.opened) == names


def test_one_mode_begins_with_the_larger_axis_of_two(monkeypatch: pytest.MonkeyPatch) -> None:
    """u cos(wt) + v sin(wt) along one axis at 30 degrees is 4 cos(wt - 30 degrees) of its shape."""
    tried = Tried(monkeypatch, 10.0, 40.0, 40.0)
    tried.found("auto", 0.05)
    number, point, _ = tried.begun[1]
    assert number == 2
    shape = point.coefficients[1, 0].ravel()
    phase = point.opened["mode_phase"]
    size = 4.0 / 3.0 * np.array([1.0, 2.0, 2.0])
    for turned in (0.0, 1.0, 2.5):
        wanted = size * math.cos(turned - math.radians(30.0))
        assert shape * math.cos(turned + phase) == pytest.approx(wanted)


def test_of_several_lines_the_one_that_comes_nearest_is_taken(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    deviances = {0.1: 30.0, 0.2: 20.0, 0.3: None}
    monkeypatch.setattr(
        flow_modes,
        "_both",
        lambda search, steady, one: (
            None if deviances[one] is None else SimpleNamespace(deviance=deviances[one])
        ),
    )
    nothing: Any = None
    assert flow_modes._best_of(SearchOf(), nothing, (0.1, 0.2, 0.3)) == 0.2  # type: ignore[arg-type]
    assert flow_modes._best_of(SearchOf(), nothing, (0.3, 0.3)) is None  # type: ignore[arg-type]
    assert flow_modes._best_of(SearchOf(), nothing, (0.3,)) == 0.3  # type: ignore[arg-type]
    assert flow_modes._best_of(SearchOf(), nothing, ()) is None  # type: ignore[arg-type]


@pytest.mark.slow
def test_a_steady_flow_stays_what_it_is() -> None:
    fit = dw.fit_motion(
        recording(300.0), apply_overrides(coarse_study(), {"fit.flow_modes": "auto"})
    )
    assert "flow_modes_unsettled" not in fit.attrs
    assert np.array_equal(fit["estimate"].values, fitted(300.0)["estimate"].values)
    assert np.array_equal(fit["coefficient"].values, fitted(300.0)["coefficient"].values)


@pytest.mark.slow
def test_eddies_that_alternate_are_found() -> None:
    """Two eddies of opposite sense on a stirred flow, strong in turn: one mode."""

    def velocity(x: np.ndarray, y: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        u, v = stirred(x, y, 1.0)
        weight = SHARE * math.sin(2.0 * math.pi * time / PERIOD)
        # Mirrored at x = 0 and turned: it has no part in common with the mean.
        mirrored_u, mirrored_v = stirred(-x, y, 1.0)
        return u + weight * mirrored_u, v - weight * mirrored_v

    (made,) = euler_recordings(velocity, worlds=1, seconds=600.0, seed=3)
    study = apply_overrides(
        Study(),
        {
            "tank.diameter_m": 0.32,
            "block.side_m": SIDE_M,
            "block.mass_kg": MASS_KG,
            "block.depth_m": DEPTH_M,
            "forces.force_interval_s": FORCE_INTERVAL_S,
            "fit.spline_spacing_m": 0.04,
        },
    )
    # Every second sample, for speed.
    ready = prepare([made.isel(time=slice(None, None, 2))], study, "state", None)
    search = ModeSearch(ready.passes, Prior(ready.passes), study.fit.iterations)
    spline = ready.passes.spline
    steady = search.find(first_point(ready), first_weights(ready.tracks, spline))
    assert steady is not None
    assert math.exp(steady.point.log_drag) < 0.8 * DRAG
    found = modes_at(search, steady, line(1.003 / PERIOD, 1e-40), "auto")
    assert found.start is not None
    point = found.start.point
    assert point.layers == 2
    assert point.opened["mode_frequency"] == pytest.approx(1.0 / PERIOD, rel=1e-3)
    assert math.exp(point.log_drag) == pytest.approx(DRAG, rel=0.06)
    # The flow of a fit is a series over one period, whose mean is the mean flow.
    grid = make_grid(outline_of(study.tank.to_arena()), cells=50, cell_size=None)
    x, y = grid.nodes()
    seen = np.where(np.hypot(x, y) < 0.07, 9.0, 0.0).reshape(grid.shape)
    data = mode_variables(point, ready.series[0], spline, grid, seen)
    assert float(data["mode_share"][1][0]) == pytest.approx(SHARE / math.sqrt(2.0), rel=0.3)
    u, v = spline.values(point.mean_coefficients, grid.x, grid.y)
    fit = xr.Dataset({**data, "u": (("y", "x"), u), "v": (("y", "x"), v)})
    found_frames = stored_frames(fit)
    assert found_frames is not None
    assert found_frames.time[-1] == pytest.approx(PERIOD, rel=1e-3)
    frames = moving_fields(fit, found_frames, {"u": u, "v": v})
    np.testing.assert_allclose(frames["u"][:-1].mean(axis=0), u, atol=1e-9)
