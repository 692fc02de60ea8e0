"""Measured vectors as a prior of the flow, and frames as a mean with modes: by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.optimize import minimize_scalar
from scipy.stats import ncx2

import driftwalk as dw
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.likelihood import measured_series
from driftwalk.likelihood.check.criteria import agreement_criteria
from driftwalk.likelihood.check.measured import _farthest, _tail
from driftwalk.likelihood.filter.parameters import Amplitudes
from driftwalk.likelihood.measured_flow import MeasuredFlow, _least_squares, measured_flow
from driftwalk.likelihood.measured_series import FLOW_CHANGE, amplitudes_in, compressed
from driftwalk.likelihood.preparation import spline_of
from driftwalk.likelihood.spline import Spline
from driftwalk.model import Study, apply_overrides
from driftwalk.schema import FLAGS, build_flow_field

SPLINE = Spline(-0.06, -0.06, 0.04, 6, 6)
AXIS = np.linspace(-0.05, 0.05, 9)


def vectors(layers: int = 1, seed: int = 1) -> tuple[Floats, Floats]:
    """Return velocities and their errors; some vectors are missing."""
    generator = np.random.default_rng(seed)
    velocity = 0.03 * generator.normal(size=(2 * layers, 9, 9))
    error = generator.uniform(1e-3, 3e-3, velocity.shape)
    missing = generator.random((9, 9)) < 0.1
    velocity[:, missing] = error[:, missing] = np.nan
    return velocity, error


def flow_of(layers: int = 1, *, scale_std: float = 0.0) -> MeasuredFlow:
    velocity, error = vectors(layers)
    solved = [
        _least_squares(SPLINE, AXIS, AXIS, velocity[k : k + 2], error[k : k + 2])
        for k in range(0, 2 * layers, 2)
    ]
    normal, right, own = (np.concatenate([one[k] for one in solved]) for k in range(3))
    rank = sum(one.rank for one in solved)
    return MeasuredFlow(
        AXIS, AXIS, velocity, error, SPLINE, scale_std, "piv.nc", "as stated", normal, right, own,
        rank,
    )  # fmt: skip


def bases() -> Floats:
    """Return all bases at all nodes, shape (nodes, coefficients)."""
    along = SPLINE.design(AXIS, AXIS)
    return np.kron(along[1], along[0])


def test_the_least_squares_are_those_of_every_vector() -> None:
    velocity, error = vectors()
    found = _least_squares(SPLINE, AXIS, AXIS, velocity, error)
    squares, rank = 0.0, 0
    for k in range(2):
        there = np.isfinite(velocity[k]).ravel()
        weight = 1.0 / error[k].ravel()[there]
        rows = bases()[there] * weight[:, None]
        values = velocity[k].ravel()[there] * weight
        solved, _, count, _ = np.linalg.lstsq(rows, values, rcond=1e-6)
        np.testing.assert_allclose(found.normal[k], rows.T @ rows, rtol=1e-9, atol=1e-6)
        np.testing.assert_allclose(found.right[k], rows.T @ values, rtol=1e-9, atol=1e-6)
        off = values - rows @ solved
        squares, rank = squares + float(off @ off), rank + int(count)
        np.testing.assert_allclose(rows @ found.own[k], rows @ solved, rtol=1e-5, atol=1e-5)
    assert found.squares == pytest.approx(squares, rel=1e-6)
    assert found.rank == rank


@pytest.mark.parametrize("layers", [1, 2])
@pytest.mark.parametrize(("scale_std", "determined"), [(0.0, 0.0), (0.2, 0.0), (0.2, 9.0)])
def test_the_deviance_is_that_of_the_best_scale(
    layers: int, scale_std: float, determined: float
) -> None:
    """Half the squares of all vectors, at the k that makes them least with its own prior.

    Gradient and curvature are those of differences along a direction.
    """
    flow = flow_of(layers, scale_std=scale_std)
    generator = np.random.default_rng(3)
    size = 2 * layers * SPLINE.size
    # Near the measured flow, as a fit is.
    at = 0.8 * flow.own.ravel() + 0.01 * generator.normal(size=size)

    def squares(coefficients: Floats, k: float) -> float:
        values = coefficients.reshape(2 * layers, -1) @ bases().T
        off = (flow.velocity.reshape(2 * layers, -1) - k * values) / flow.error.reshape(
            2 * layers, -1
        )
        prior = 0.5 * ((k - 1.0) / scale_std) ** 2 if scale_std else 0.0
        return float(0.5 * np.nansum(off**2)) + prior + determined * math.log(k)

    def best(coefficients: Floats) -> tuple[float, float]:
        if not scale_std:
            return squares(coefficients, 1.0), 1.0
        found = minimize_scalar(
            lambda k: squares(coefficients, k), bounds=(0.3, 3.0), method="bounded",
            options={"xatol": 1e-10},
        )  # fmt: skip
        return float(found.fun), float(found.x)

    value, score, curvature = flow.deviance(at, determined)
    least, k = best(at)
    scale, precision = flow.scale(at, determined)
    assert scale == pytest.approx(k, rel=1e-6)
    if scale_std:
        bend = (squares(at, k + 1e-4) + squares(at, k - 1e-4) - 2.0 * squares(at, k)) / 1e-8
        assert precision == pytest.approx(bend, rel=1e-3)
    else:
        assert precision == math.inf
    exact, _ = best(flow.own.ravel())
    own, _, _ = flow.deviance(flow.own, determined)
    assert value - own == pytest.approx(least - exact, rel=1e-6)
    step = 1e-5 * generator.normal(size=size)
    up, down = (flow.deviance(at + sign * step, determined) for sign in (1, -1))
    assert score @ step == pytest.approx(0.5 * (down[0] - up[0]), rel=1e-4)
    # The curvature leaves out what the residuals bend: at the least squares there are none.
    lowest, _, bent = flow.deviance(flow.own, 0.0)
    up, down = (
        flow.deviance(flow.own + sign * step.reshape(flow.own.shape), 0.0) for sign in (1, -1)
    )
    assert step @ bent @ step == pytest.approx(up[0] + down[0] - 2.0 * lowest, rel=1e-3)
    # What determines coefficients bends upwards, and no direction bends down.
    assert np.linalg.eigvalsh(curvature).min() > -1e-6 * np.abs(curvature).max()
    counted = flow.determined(at, 1e-3 * np.eye(size + 3), determined)
    wanted = 0.0 if not scale_std else min(1e-3 * float(np.trace(curvature)), flow.rank)
    assert counted == pytest.approx(wanted)


def test_a_measured_flow_is_stored_and_said() -> None:
    flow = flow_of(2)
    there = np.isfinite(flow.velocity[0]).sum()
    assert flow.count == there
    assert flow.layers == 2
    size = 1e3 * math.sqrt(float(np.nanmean(flow.error**2)))
    assert flow.sentence.startswith(f"piv.nc: {there} vectors, errors of {size:.2g} mm/s as stated")
    data, words = flow.stored()
    np.testing.assert_array_equal(data["measured_v"][1], flow.velocity[1])
    np.testing.assert_array_equal(data["measured_u_error"][1], flow.error[0])
    assert set(xr.Dataset(data).coords) == {"measured_y", "measured_x"}
    assert words["measured_flow"] == "piv.nc"


def test_modes_are_stored_by_their_number() -> None:
    flow = flow_of(3)
    known = Amplitudes(np.arange(4.0), np.ones((2, 4)), "mirror")
    data, words = replace(flow, amplitudes=known).stored()
    for k, name in enumerate("uv"):
        for end, values in (("", flow.velocity), ("_error", flow.error)):
            dims, found = data[f"measured_{name}_mode{end}"]
            assert dims == ("flow_mode", "measured_y", "measured_x")
            np.testing.assert_array_equal(found, values[[2 + k, 4 + k]])
    assert words["mode_repeat"] == "mirror"


def test_where_two_flows_are_farthest_apart_is_a_measured_node() -> None:
    flow = flow_of()
    flow.velocity[:, 2, 7] = 0.01
    flow.velocity[:, 3, 1] = np.nan
    wanted = np.zeros((2, 9, 9))
    off = np.random.default_rng(2).normal(size=(2, SPLINE.rows, SPLINE.columns))
    wanted[:] = SPLINE.values(off, AXIS, AXIS)
    size = np.where(np.isfinite(flow.velocity[0]), np.hypot(*wanted), -1.0)
    row, column = np.unravel_index(size.argmax(), size.shape)
    x, y, apart = _farthest(flow, off.ravel())
    assert (x, y) == (AXIS[column], AXIS[row])
    assert apart == pytest.approx(size.max())


def test_the_tail_of_a_large_noncentrality_is_normal() -> None:
    for value, dof, shift in ((30.0, 12.0, 3.0), (9.0, 4.5, 20.0)):
        assert _tail(value, dof, shift) == pytest.approx(ncx2.sf(value, dof, shift))
    assert _tail(10_200.0, 50.0, 10_001.0) == pytest.approx(
        ncx2.sf(10_200.0, 50.0, 10_001.0), rel=0.02
    )


FACTS = {
    "measured_flow_p_value": 1e-5,
    "measured_flow_chi_squared": 91.4,
    "measured_flow_expected": 40.2,
    "measured_flow_expected_std": 9.0,
    "measured_flow_farthest_m": [0.03, -0.04],
    "measured_flow_difference_m_s": 0.0123,
    "measured_flow_detectable_m_s": 0.002,
}
SCALED = {
    "measured_flow_scale": 0.9,
    "measured_flow_scale_std": 0.014,
    "measured_flow_scale_p_value": 0.2,
    "measured_flow_scale_detectable": 0.05,
}


def contradictions(facts: dict[str, Any]) -> list[str]:
    """Return what a fit warns of: the findings of the criteria that fail."""
    return [one.sentence for one in agreement_criteria(facts) if one.failed]


def test_a_contradiction_is_said_with_its_place_and_size() -> None:
    assert agreement_criteria({}) == []
    (one,) = agreement_criteria(FACTS)
    assert (one.p_value, one.detectable) == (1e-5, 0.002)
    assert "chi squared of their difference 91, expected 40 ± 9" in one.sentence
    assert "x = 0.03 m, y = -0.04 m, where they are 12 mm/s apart" in one.sentence
    flow, scale = agreement_criteria(FACTS | SCALED)
    assert "10 % too slow for the motion (± 1.4 %)" in scale.sentence
    assert (scale.p_value, scale.detectable) == (0.2, 0.05)
    assert contradictions(FACTS | SCALED) == [flow.sentence]
    fast = agreement_criteria(FACTS | SCALED | {"measured_flow_scale": 1.2})[1]
    assert "20 % too fast" in fast.sentence
    assert contradictions(FACTS | {"measured_flow_p_value": 6e-4}) == []


STUDY = apply_overrides(
    Study(), {"tank.diameter_m": 0.16, "fit.spline_spacing_m": 0.04, "fit.law": "paper"}
)


def frames(
    time: Floats, *, error: float = 1e-3, missing: float = 0.15, modes: int = 2, seed: int = 4
) -> tuple[xr.Dataset, list[Floats], Floats]:
    """Return frames of a flow with modes, its layers on the nodes, and their amplitudes."""
    generator = np.random.default_rng(seed)
    x, y = np.meshgrid(AXIS, AXIS)
    layers = [np.stack([-y, x])]
    layers += [0.4 * np.stack([x, -y]), 0.2 * np.stack([y, x])][:modes]
    amplitude = np.stack([np.ones_like(time), np.sin(0.9 * time), np.cos(2.1 * time)][: modes + 1])
    values = np.einsum("kt,kcyx->ctyx", amplitude, np.stack(layers))
    flag = np.where(generator.random((time.size, 9, 9)) < missing, 2, 1).astype(np.int8)
    u, v = values + error * generator.normal(size=values.shape)
    attrs = {"method": "file", "source": "piv.nc", "cell_size_m": float(AXIS[1] - AXIS[0])}
    field = build_flow_field(AXIS, AXIS, u=u, v=v, flag=flag, time=time, attrs=attrs)
    return field, layers, amplitude


def test_frames_of_a_steady_flow_are_averaged_node_by_node() -> None:
    """A node's spread counts with that of all, as of ten frames; half of them are needed."""
    time = np.arange(12.0)
    field, _, _ = frames(time, modes=0)
    field["flag"].values[:7, 2, 3] = 2
    found = compressed(field, STUDY)
    u, v = (field[name].values for name in "uv")
    seen = field["flag"].values == 1
    rows: list[tuple[int, int, float, float]] = []
    for j in range(9):
        for i in range(9):
            own = seen[:, j, i]
            if own.sum() < 6:
                assert found["flag"].values[j, i] == FLAGS["filled"]
                continue
            assert found["u"].values[j, i] == pytest.approx(u[own, j, i].mean())
            assert found["v"].values[j, i] == pytest.approx(v[own, j, i].mean())
            spread = own.sum() * 0.5 * (u[own, j, i].var() + v[own, j, i].var())
            rows.append((j, i, float(spread), float(own.sum())))
    assert 70 < len(rows) < 81
    pooled = sum(one[2] for one in rows) / sum(one[3] - 1.0 for one in rows)
    for j, i, spread, number in rows:
        variance = (10.0 * pooled + spread) / (10.0 + number - 1.0)
        for name in "uv":
            error = found[f"{name}_standard_error"].values[j, i]
            assert error == pytest.approx(math.sqrt(variance / number), rel=1e-6)
    assert amplitudes_in(found) is None
    assert compressed(found, STUDY) is found


@pytest.mark.parametrize("missing", [0.0, 0.15])
def test_frames_of_a_flow_that_changes_are_a_mean_and_its_modes(missing: float) -> None:
    """What they give together is the flow, to the errors of the frames over the root of them."""
    time = np.arange(0.0, 40.0, 0.5)
    field, layers, amplitude = frames(time, missing=missing)
    found = compressed(field, STUDY, duration=30.0)
    known = amplitudes_in(found)
    assert known is not None
    np.testing.assert_allclose(known.time, time)
    assert known.value.shape == (2, 80)
    assert (known.value**2).mean(axis=1) == pytest.approx([1.0, 1.0])
    true = np.einsum("kt,kcyx->ctyx", amplitude, np.stack(layers))
    made = np.stack([found[name].values for name in "uv"])[:, None] + np.stack(
        [np.einsum("mt,myx->tyx", known.value, found[f"{name}_mode"].values) for name in "uv"]
    )
    # Three layers of 80 frames at each node, and amplitudes of 162 vectors.
    assert np.sqrt(((made - true) ** 2).mean()) < 1.2e-3 * math.sqrt(3.0 / 80.0 + 2.0 / 162.0)
    # The larger mode comes first, and the errors are those of as many frames as were seen.
    sizes = [np.sqrt((found["u_mode"].values[k] ** 2).mean()) for k in range(2)]
    assert sizes[0] > 1.5 * sizes[1]
    number = (field["flag"].values == 1).sum(axis=0)
    for name, count in (("u_standard_error", number), ("v_standard_error", number)):
        ratio = found[name].values / (1e-3 / np.sqrt(count))
        assert ratio.mean() == pytest.approx(1.0, abs=0.05)
    for k in range(2):
        ratio = found["u_mode_error"].values[k] / (1e-3 / np.sqrt(number))
        assert ratio.mean() == pytest.approx(1.0, abs=0.05)


def test_frames_that_are_hardly_seen_are_left_out() -> None:
    time = np.arange(0.0, 40.0, 0.5)
    field, *_ = frames(time)
    field["flag"].values[11, :5] = 2
    found = compressed(field, STUDY)
    known = amplitudes_in(found)
    assert known is not None
    np.testing.assert_allclose(known.time, np.delete(time, 11))


@pytest.mark.parametrize(("share", "steady"), [(0.04, True), (0.06, False)])
def test_a_change_below_a_twentieth_is_none(share: float, steady: bool) -> None:
    """As a root mean square over time and place, over the flow."""
    time = np.arange(0.0, 40.0, 0.5)
    x, y = np.meshgrid(AXIS, AXIS)
    wave = np.sqrt(2.0) * np.sin(2.0 * np.pi * time / 10.0)
    factor = 1.0 + share * wave
    u, v = (factor[:, None, None] * one for one in (-y, x))
    flag = np.ones(u.shape, dtype=np.int8)
    attrs = {"method": "file", "source": "piv.nc", "cell_size_m": 0.0125}
    noise = 1e-5 * np.random.default_rng(1).normal(size=(2, *u.shape))
    field = build_flow_field(
        AXIS, AXIS, u=u + noise[0], v=v + noise[1], flag=flag, time=time, attrs=attrs
    )
    assert ("amplitude" not in compressed(field, STUDY)) is steady


def test_more_modes_than_a_fit_takes_are_refused() -> None:
    time = np.arange(0.0, 60.0)
    x, y = np.meshgrid(AXIS, AXIS)
    shapes = [np.sin((k + 1) * 30.0 * x) * np.cos((k + 2) * 20.0 * y) for k in range(7)]
    waves = [np.sin((k + 1) * 0.37 * time) for k in range(7)]
    u = -y + 0.01 * sum(a[:, None, None] * b for a, b in zip(waves, shapes, strict=True))
    v = x + 0.0 * u
    flag = np.ones(u.shape, dtype=np.int8)
    attrs = {"method": "file", "source": "piv.nc", "cell_size_m": 0.0125}
    field = build_flow_field(AXIS, AXIS, u=u, v=v, flag=flag, time=time, attrs=attrs)
    with pytest.raises(
        InputError, match=rf"in 7 modes, and the fit takes {FLOW_CHANGE.most_modes}"
    ):
        compressed(field, STUDY)


def test_many_frames_become_means_of_a_few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 25 frames and room for ten: eight means of three, and the last frame alone."""
    monkeypatch.setattr(measured_series, "FRAMES", measured_series.FRAMES._replace(most=10))
    time = np.arange(25.0)
    value = np.random.default_rng(1).normal(size=(2, 25))
    flow: Any = xr.Dataset(coords={"time": time}, attrs={"repeat": "none"})
    found = measured_series._on_clock(value, flow)
    assert found.time.tolist() == [*np.arange(1.0, 24.0, 3.0), 24.0]
    for k in range(8):
        assert found.value[:, k] == pytest.approx(value[:, 3 * k : 3 * k + 3].mean(axis=1))
    assert found.value[:, 8].tolist() == value[:, 24].tolist()


def test_errors_of_vectors_come_from_their_scatter_where_none_are_known() -> None:
    """Noise of 2 mm/s on a flow that the spline holds: to a tenth of 60 surplus components."""
    generator = np.random.default_rng(6)
    axis = np.linspace(-0.075, 0.075, 16)
    x, y = np.meshgrid(axis, axis)
    u, v = (one + 2e-3 * generator.normal(size=x.shape) for one in (-0.5 * y, 0.5 * x))
    flag = np.ones(x.shape, dtype=np.int8)
    attrs = {"method": "file", "source": "piv.nc", "cell_size_m": 0.01}
    field = build_flow_field(axis, axis, u=u, v=v, flag=flag, attrs=attrs)
    found = measured_flow(field, STUDY, spline_of(STUDY))
    inside = np.hypot(x, y) <= 0.08
    assert found.count == inside.sum()
    assert "estimated from their scatter" in found.errors
    assert np.nanmean(found.error) == pytest.approx(2e-3, rel=0.3)
    there = np.isfinite(found.velocity[0])
    spline = found.spline
    fitted = np.stack(
        [
            spline.values(found.own[k].reshape(1, spline.rows, spline.columns), axis, axis)[0]
            for k in range(2)
        ]
    )
    off = (found.velocity - fitted)[:, there]
    surplus = off.size - found.rank
    assert float(np.nanmean(found.error)) == pytest.approx(
        math.sqrt(float((off**2).sum()) / surplus)
    )
    # Stated errors that are too small are made larger by how far the vectors scatter.
    small = apply_overrides(STUDY, {"fit.flow_error_m_s": 1e-3})
    stated = measured_flow(field, small, spline_of(small))
    assert float(np.nanmean(stated.error)) == pytest.approx(float(np.nanmean(found.error)))
    assert "as stated, times" in stated.errors
    large = apply_overrides(STUDY, {"fit.flow_error_m_s": 5e-3})
    assert float(np.nanmean(measured_flow(field, large, spline_of(large)).error)) == pytest.approx(
        5e-3
    )
    np.testing.assert_allclose(stated.normal, found.normal, rtol=1e-9)
    np.testing.assert_allclose(stated.right, found.right, rtol=1e-9)


def test_errors_of_the_file_count_where_they_are_above_zero() -> None:
    axis = np.linspace(-0.05, 0.05, 11)
    x, y = np.meshgrid(axis, axis)
    flag = np.ones(x.shape, dtype=np.int8)
    error = np.full(x.shape, 4e-3)
    error[2, 3], error[4, 5], error[6, 6] = 0.0, np.nan, -1.0
    attrs = {"method": "file", "source": "piv.nc", "cell_size_m": 0.01}
    field = build_flow_field(
        axis, axis, u=-y, v=x, flag=flag, u_standard_error=error, v_standard_error=0 * x + 4e-3,
        attrs=attrs,
    )  # fmt: skip
    found = measured_flow(field, STUDY, spline_of(STUDY))
    lacking = np.isnan(found.velocity[0])
    assert lacking[[2, 4, 6], [3, 5, 6]].all()
    assert np.isnan(found.error[:, lacking]).all()
    assert np.nanmin(found.error) == np.nanmax(found.error) == 4e-3
    assert found.count == int((~lacking).sum())
    assert dw.Study().fit.flow_error_m_s == "auto"
