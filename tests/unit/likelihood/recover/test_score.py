"""A fit held beside its truth: every number of the score, worked out another way."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr
from fit_worlds import DRAG, FORCE_N, NOISE_M, fitted, recording

import driftwalk as dw
from driftwalk.core.errors import InputError
from driftwalk.likelihood import score as scoring
from driftwalk.likelihood.interval_inflation import strips_error
from driftwalk.likelihood.score import block_flow
from driftwalk.schema import FLAGS, build_trajectory
from driftwalk.schema.answers.facts import facts_of

R, SIDE = 0.15, 0.03


@pytest.fixture(scope="module")
def track() -> xr.Dataset:
    return recording(300.0)


@pytest.fixture(scope="module")
def fit() -> xr.Dataset:
    return fitted(300.0)


def scored(fit: xr.Dataset, **changes: object) -> dict[str, object]:
    truth: dict[str, object] = {
        "drag_coefficient": DRAG,
        "force_std": FORCE_N,
        "tracking_noise": NOISE_M,
        "flow": dw.tank30_flow(),
    }
    return dw.score_fit(fit, **{**truth, **changes})


@pytest.mark.slow
def test_the_parameters_are_held_beside_the_truth(fit: xr.Dataset) -> None:
    """The standard deviations by the fit's own covariance of (ln C_d, ln q, ln r)."""
    score = scored(fit)
    sd = np.sqrt(np.diag(fit["covariance"].values))[:3] * (1.0, 0.5, 1.0)
    truths = {"drag_coefficient": DRAG, "force_std_N": FORCE_N, "tracking_noise_m": NOISE_M}
    for (name, truth), width in zip(truths.items(), sd, strict=True):
        value = facts_of(fit)[name]
        assert score[name] == value
        assert score[f"{name}_true"] == truth
        assert score[f"{name}_sd"] == pytest.approx(width, rel=1e-6)
        assert score[f"{name}_error"] == pytest.approx((value - truth) / truth)
        assert score[f"{name}_z"] == pytest.approx(np.log(value / truth) / width, rel=1e-6)
        assert [score[f"{name}_low"], score[f"{name}_high"]] == facts_of(fit)[f"{name}_interval"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["drag_coefficient", "force_std", "tracking_noise"])
@pytest.mark.parametrize(
    ("sds", "covered"), [(1.6, True), (1.7, False), (-1.6, True), (-1.7, False)]
)
def test_a_90_percent_interval_reaches_1_645_standard_deviations(
    fit: xr.Dataset, name: str, sds: float, covered: bool
) -> None:
    key = {"force_std": "force_std_N", "tracking_noise": "tracking_noise_m"}.get(name, name)
    plain = scored(fit)
    sd = float(plain[f"{key}_sd"])  # type: ignore[arg-type]
    # The interval of C_d begins lower by what eight strips leave out.
    lower = 1.0 - strips_error(8) if name == "drag_coefficient" and sds < 0.0 else 1.0
    truth = facts_of(fit)[key] * math.exp(sds * sd) * lower
    score = scored(fit, **{name: truth})
    assert score[f"{key}_covered"] is covered
    assert score[f"{key}_z"] == pytest.approx(-sds - math.log(lower) / sd)


@pytest.mark.slow
def test_the_flow_error_by_brute_force(fit: xr.Dataset, track: xr.Dataset) -> None:
    """Cell by cell, sample by sample, point by point of the block."""
    score = scored(fit, recordings=track)
    estimated, truth = dw.fitted_flow(fit), dw.tank30_flow()
    x, y = (track[name].values[:, 0] for name in ("x", "y"))
    total, size, cells = 0.0, 0.0, 0
    points = [(i - 2.5) / 6 * SIDE for i in range(6)]
    for row in range(50):
        for column in range(50):
            left, low = -R + 0.006 * column, -R + 0.006 * row
            here = (x >= left) & (x < left + 0.006) & (y >= low) & (y < low + 0.006)
            free = np.hypot(x, y) < R - SIDE / math.sqrt(2.0) - 0.002
            if np.count_nonzero(here & free) < 3:
                continue
            cells += 1
            places = [
                (
                    left + 0.003 + math.cos(turn) * a - math.sin(turn) * b,
                    low + 0.003 + math.sin(turn) * a + math.cos(turn) * b,
                )
                for turn in (0.0, math.pi / 8, math.pi / 4, 3 * math.pi / 8)
                for a in points
                for b in points
            ]
            means = [
                np.mean(
                    [dw.flow.bilinear(one, [px for px, _ in places], [py for _, py in places])],
                    axis=-1,
                )
                for one in (estimated, truth)
            ]
            total += float(((means[0] - means[1]) ** 2).sum())
            size += float((means[1] ** 2).sum())
    assert cells > 100
    assert score["flow_cells"] == cells
    assert score["flow_error"] == pytest.approx(math.sqrt(total / size), rel=1e-9)


@pytest.mark.slow
def test_without_the_recording_about_the_same_cells_count(
    fit: xr.Dataset, track: xr.Dataset
) -> None:
    exact, about = scored(fit, recordings=track), scored(fit)
    assert about["flow_cells"] == pytest.approx(exact["flow_cells"], rel=0.5)
    assert about["flow_error"] == pytest.approx(exact["flow_error"], rel=0.4)


@pytest.mark.slow
def test_a_flow_that_is_a_tenth_too_strong_is_off_by_a_tenth(
    fit: xr.Dataset, track: xr.Dataset
) -> None:
    estimated = dw.fitted_flow(fit)
    truth = estimated.assign(u=estimated["u"] / 1.1, v=estimated["v"] / 1.1)
    score = scored(fit, flow=truth, recordings=[track])
    assert score["flow_error"] == pytest.approx(0.1)
    assert score["flow_point_error"] == pytest.approx(0.1)
    exact = scored(fit, flow=estimated, recordings=[track])
    assert exact["flow_error"] == 0.0
    assert exact["flow_z_rms"] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.slow
def test_a_block_averages_a_parabola_by_its_second_moment() -> None:
    """Mean of y^2 over a square of side a is y0^2 + a^2/12 at any angle; midpoints: (1 - 1/36)."""
    flow = dw.flow_from_function(lambda x, y: (y**2, 0.0 * x), cells=2000)
    found = block_flow(flow, [0.0, 0.02], [0.0, 0.05], side=SIDE)
    spread = SIDE**2 / 12 * (1 - 1 / 36)
    assert found[:, 0] == pytest.approx([spread, 0.05**2 + spread], rel=1e-3)
    assert found[:, 1] == pytest.approx([0.0, 0.0], abs=1e-15)


@pytest.mark.slow
@pytest.mark.parametrize("wrong", [0.0, -1.0, math.nan, math.inf])
def test_a_truth_has_to_be_positive(fit: xr.Dataset, wrong: float) -> None:
    with pytest.raises(InputError, match="the true force_std_N is"):
        scored(fit, force_std=wrong)


@pytest.mark.slow
def test_what_is_no_fit_is_refused(track: xr.Dataset) -> None:
    with pytest.raises(InputError, match="expected a dataset 'fit'"):
        scored(track)


@pytest.mark.parametrize(
    ("turns", "covered"), [(1.6, True), (-1.6, True), (1.7, False), (-1.7, False)]
)
def test_a_parameter_is_held_beside_its_truth(
    monkeypatch: pytest.MonkeyPatch, turns: float, covered: bool
) -> None:
    """An interval of 90 % of a normal logarithm reaches 1.645 standard deviations."""
    sd, value = 0.1, 0.5
    ends = [value * math.exp(sign * 1.6448536 * sd) for sign in (-1, 1)]
    facts = {"drag_coefficient": value, "drag_coefficient_interval": ends, "confidence": 0.9}
    monkeypatch.setattr(scoring, "facts_of", lambda _: facts)
    truth = value * math.exp(turns * sd)
    found = scoring._parameter_score(xr.Dataset(), "drag_coefficient", truth, 0)
    assert found["drag_coefficient_sd"] == pytest.approx(sd)
    assert found["drag_coefficient_z"] == pytest.approx(-turns)
    assert found["drag_coefficient_error"] == pytest.approx((value - truth) / truth)
    assert found["drag_coefficient_covered"] is covered
    assert found["drag_coefficient_true"] == truth
    with pytest.raises(InputError, match=r"the true drag_coefficient is -1\.0"):
        scoring._parameter_score(xr.Dataset(), "drag_coefficient", -1.0, 0)


def test_the_force_of_a_flow_is_that_of_its_interval(monkeypatch: pytest.MonkeyPatch) -> None:
    facts = {"force_std_N": 1.0, "force_std_N_interval": [0.9, 1.1], "confidence": 0.9}
    monkeypatch.setattr(scoring, "facts_of", lambda _: facts)
    monkeypatch.setattr(
        scoring,
        "fitted_intervals",
        lambda _: dw.likelihood.flow_intervals.Intervals((9.0, 20.0), (1, 0, 1), ("A", "B")),
    )
    fit = xr.Dataset(
        {
            f"flow_force_std{end}": ("flow", [one, 10 * one])
            for end, one in (("", 2.0), ("_low", 1.5), ("_high", 2.5))
        }
    )
    for interval, wanted in ((0, 20.0), (1, 2.0), (2, 20.0)):
        found = scoring._parameter_score(fit, "force_std_N", 2.0, interval)
        assert found["force_std_N"] == wanted
        assert found["force_std_N_high"] == 1.25 * wanted


def flow_field(strength: float, *, error: float = 0.0, cells: int = 20) -> xr.Dataset:
    """Return a flow (s y, s x) with errors that are stated, and offsets of as much in places."""
    axis = np.linspace(-0.095, 0.095, cells)
    x, y = np.meshgrid(axis, axis)
    off = error * np.where((np.arange(cells)[:, None] + np.arange(cells)) % 2, 1.0, -1.0)
    flag = np.full(x.shape, FLAGS["measured"])
    flag[0] = FLAGS["filled"]
    data = {
        "u": strength * y + off,
        "v": strength * x - off,
        "u_standard_error": np.full(x.shape, max(0.5 * error, 1e-9)),
        "v_standard_error": np.full(x.shape, max(error, 1e-9)),
        "flag": flag,
    }
    return xr.Dataset(
        {name: (("y", "x"), values) for name, values in data.items()}, {"x": axis, "y": axis}
    )


def test_the_error_of_a_flow_is_that_of_its_nodes() -> None:
    """Errors of twice and once what is stated: the mean of 4 and 1. A block averages them out."""
    cells = np.zeros((20, 20), dtype=bool)
    cells[6:14, 6:14] = True
    truth = flow_field(0.5)
    found = scoring._flow_score(flow_field(0.5, error=1e-3), truth, cells, side=0.03)
    assert found["flow_cells"] == 64
    assert found["flow_z_rms"] == pytest.approx(math.sqrt(2.5))
    at = truth["x"].values[6:14]
    size = 0.5 * math.sqrt((at[:, None] ** 2 + at**2).sum())
    assert found["flow_point_error"] == pytest.approx(1e-3 * math.sqrt(2.0) * 8.0 / size)
    assert found["flow_error"] < 0.2 * found["flow_point_error"]
    strong = scoring._flow_score(flow_field(0.6), truth, cells, side=0.03)
    assert strong["flow_error"] == pytest.approx(0.2)
    assert strong["flow_point_error"] == pytest.approx(0.2)
    nothing = scoring._flow_score(truth, truth, np.zeros((20, 20), dtype=bool), side=0.03)
    assert nothing["flow_cells"] == 0
    assert math.isnan(nothing["flow_error"])


def test_nodes_whose_neighbours_are_measured_count() -> None:
    """Within 15 mm of a node, with nodes 10 mm apart, are those one step away on either axis."""
    flow = flow_field(0.5)
    flow["flag"].values[10, 10] = FLAGS["outside"]
    found = scoring._surrounded(flow, radius=0.015)
    wanted = np.zeros((20, 20), dtype=bool)
    for row in range(20):
        for column in range(20):
            near = [
                (row + j, column + i)
                for j in range(-2, 3)
                for i in range(-2, 3)
                if math.hypot(i, j) * 0.01 <= 0.015
            ]
            wanted[row, column] = all(
                0 <= j < 20 and 0 <= i < 20 and flow["flag"].values[j, i] == FLAGS["measured"]
                for j, i in near
            )
    np.testing.assert_array_equal(found, wanted)


def test_cells_with_three_samples_away_from_the_wall_are_visited(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Sample by sample, in the flow that is asked for."""
    intervals = dw.likelihood.flow_intervals.Intervals((30.0, 60.0), (0, 1, 0), ("A", "B"))
    monkeypatch.setattr(scoring, "fitted_intervals", lambda _: intervals)
    time = 0.1 * np.arange(1000)
    x, y = 0.08 * np.cos(0.21 * time), 0.07 * np.sin(0.17 * time)
    x[7] = np.nan
    track = build_trajectory(time, x, y)
    arena: Any = dw.Study(tank={"diameter_m": 0.2}).tank.to_arena_json()
    fit = xr.Dataset(attrs={"arena": arena})
    flow = flow_field(0.5)
    for interval, inside in (
        (0, (time < 30.0) | (time >= 60.0)),
        (1, (time >= 30.0) & (time < 60.0)),
    ):
        found = scoring._visited_cells(flow, fit, [track], interval, 0.02)
        count = np.zeros((20, 20))
        for k in np.flatnonzero(inside):
            if math.hypot(x[k], y[k]) < 0.1 - 0.02 / math.sqrt(2.0) - 0.002:
                row, column = (round((at[k] + 0.095) / 0.01) for at in (y, x))
                count[row, column] += 1
        assert count.max() >= 3
        np.testing.assert_array_equal(found, count >= 3)


def test_a_block_averages_a_parabola_of_a_coarse_field() -> None:
    """As above, of a field with 1 mm between its nodes; its own parabola is off by 1/4 of mm^2."""
    flow = dw.flow_from_function(lambda x, y: (y**2, 0.0 * x), cells=300)
    found = block_flow(flow, [0.0], [0.02], side=SIDE)
    spread = SIDE**2 / 12 * (1 - 1 / 36)
    assert found[0, 0] == pytest.approx(0.02**2 + spread, rel=2e-3)
    assert found[0, 1] == pytest.approx(0.0, abs=1e-15)
