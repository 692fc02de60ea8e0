"""A flow of several layers in the innovations filter, against filters written another way."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from dense_innovations import (
    NODES,
    WAVY,
    Floats,
    dense_filter,
    difficult_track,
    linear_coefficients,
    make_filter,
    make_track,
    run_filter,
    slope,
)
from test_pose_filter import difficult_poses

from driftwalk import _core

NAMES = ("innovation", "covariance", "state", "whitened", "jacobian")
OTHER = 0.03 * np.random.default_rng(9).standard_normal(WAVY.shape)
FLOATING = {"water_acceleration": 1.0, "water_spin": 1.0}


def waves(time: Floats) -> Floats:
    """Strengths of two layers, (2, n)."""
    return np.stack([1.0 + 0.3 * np.cos(0.8 * time), np.sin(1.7 * time)])


def of_layers(track: dict[str, Any], *layers: Floats, **changes: Any) -> dict[str, Floats]:
    return run_filter(track, np.concatenate(layers), sensitivities=True, **changes)


@pytest.mark.parametrize("orientation", ["given", "none", "state"])
@pytest.mark.parametrize("law", [{}, FLOATING, {"force_memory": 0.3}, {"drag_power": 1.6}])
def test_shares_of_one_flow_are_that_flow(orientation: str, law: dict[str, float]) -> None:
    """Strengths that add up to that of one layer, however they change, and equal coefficients."""
    track = difficult_poses() if orientation == "state" else difficult_track()
    whole = 1.0 + 0.2 * np.sin(0.9 * track["time"])
    share = 0.5 + 0.4 * np.sin(2.3 * track["time"])
    options = {"orientation": orientation} | law
    one = of_layers(track, WAVY, strength=whole[None], **options)
    two = of_layers(track, WAVY, WAVY, strength=np.stack([share, whole - share]), **options)
    by_one, by_other, drag = np.split(two["jacobian"], [2 * NODES, 4 * NODES], axis=1)
    # The derivative by a flow that both layers hold is the sum of those by the layers.
    two["jacobian"] = np.hstack([by_one + by_other, drag])
    # Equal to rounding until the filter slips, whose decision rounding may turn.
    for name in NAMES:
        values, want = two[name], one[name]
        # Derivatives that have become as good as zero are set to zero.
        scale = np.nanmax(np.abs(want), axis=None if name == "jacobian" else 0)
        assert np.array_equal(np.isnan(values), np.isnan(want)), name
        assert np.nanmax(np.abs(values - want) / scale) < 1e-7, name


@pytest.mark.parametrize("orientation", ["given", "none"])
def test_filter_is_the_dense_one(orientation: str) -> None:
    track = difficult_track()
    strength = waves(track["time"])
    got = of_layers(track, WAVY, OTHER, strength=strength, orientation=orientation)
    want = dense_filter(
        track,
        np.stack([WAVY, OTHER]),
        orientation=orientation,
        largest=0.05,
        strength=strength,
    )
    assert np.array_equal(got["used"].astype(bool), want["used"])
    for name in NAMES:
        scale = np.nanmax(np.abs(want[name]))
        # The bend of the drag is found by differences there.
        np.testing.assert_allclose(
            got[name], want[name], rtol=1e-8, atol=1e-8 * scale, err_msg=name
        )


@pytest.mark.parametrize("orientation", ["given", "state"])
def test_prediction_moves_with_the_coefficients_as_its_jacobian_says(orientation: str) -> None:
    """What is left out is of first order in the interval: ten times shorter, ten times less."""
    worst = []
    both = np.concatenate([WAVY, OTHER])
    for interval in (0.02, 0.002):
        track = make_track(np.array([0.0, interval]))
        options = {"orientation": orientation, "strength": np.array([[1.1, 1.2], [0.4, 0.7]])}
        got = of_layers(track, WAVY, OTHER, **options, **FLOATING)
        d = got["innovation"].shape[1]
        S = np.zeros((d, d))
        S[np.tril_indices(d)] = got["covariance"][1]
        S = S + np.tril(S, -1).T
        jacobian = (np.linalg.cholesky(S) @ got["jacobian"][d:])[:, :-1]
        for first in (0, 2 * NODES):
            size = np.abs(jacobian[:, first : first + 2 * NODES]).max(axis=0)
            touched = first + np.flatnonzero(size > 0)
            assert 40 < touched.size < NODES

            def prediction(change: Floats, at=touched, track=track, options=options) -> Floats:
                coefficients = both.ravel().copy()
                coefficients[at] += change
                found = run_filter(track, coefficients.reshape(both.shape), **options, **FLOATING)
                return -found["innovation"][1]

            want = slope(prediction, np.zeros(touched.size), 1e-4)
            error = np.abs(jacobian[:, touched] - want).max(axis=1)
            worst.append(error / np.abs(want).max(axis=1))
    assert np.all(np.array(worst[:2]) < 0.2), worst
    assert np.all(np.array(worst[2:]) < 0.02), worst


def test_water_that_changes_pushes_with_its_acceleration() -> None:
    """Without drag, two uniform layers accelerate a floating block by their own rates."""
    time = np.linspace(0.0, 2.0, 21)
    track = make_track(time)
    layers = [linear_coefficients(np.zeros((2, 2)), one) for one in ((0.1, 0.02), (-0.03, 0.2))]
    rates = np.array([[0.5], [-0.2]])
    strength = np.array([[1.0], [0.4]]) + rates * time
    options = {"drag_coefficient": 1e-9, "noise_intensity": 1e-5}
    still = run_filter(track, 0.0 * WAVY, **options)
    pushed = of_layers(track, *layers, strength=strength, **options, **FLOATING)
    acceleration = 0.5 * np.array([0.1, 0.02]) - 0.2 * np.array([-0.03, 0.2])
    # A body in water at rest, seen from a frame that accelerates as the water does.
    frame = {**track, "x": track["x"] - 0.5 * acceleration[0] * time**2}
    frame["y"] = track["y"] - 0.5 * acceleration[1] * time**2
    want = run_filter(frame, 0.0 * WAVY, **options)["innovation"][1:]
    np.testing.assert_allclose(pushed["innovation"][1:], want, atol=1e-8)
    assert np.abs(still["innovation"][1:] - want).max() > 1e-4


def test_sums_are_the_products_of_the_derivatives() -> None:
    track = difficult_poses()
    strength = waves(track["time"])
    # A layer that is not there for a while has no derivatives then.
    strength[1, 60:110] = 0.0
    options = {"strength": strength, "orientation": "state"}
    whole = of_layers(track, WAVY, OTHER, **options)
    jacobian = whole["jacobian"].reshape(160, 3, -1)
    right = np.random.default_rng(8).standard_normal((160, 3, 2))
    both = np.concatenate([WAVY, OTHER])
    got = make_filter(track, both, sensitivities=True, **options).sums(
        np.ones(160, np.uint8), right
    )
    information = np.einsum("kai,kaj->ij", jacobian, jacobian, optimize=True)
    products = np.einsum("kac,kai->ci", right, jacobian, optimize=True)
    size = np.sqrt(np.diag(information))
    counts = np.flatnonzero(size > 0.01 * size.max())
    assert np.count_nonzero(counts >= 2 * NODES) > 40
    part = np.ix_(counts, counts)
    relative = np.abs(got["information"] - information)[part] / np.outer(size, size)[part]
    assert relative.max() < 3e-3
    assert np.abs(got["products"] - products)[:, counts].max() < 1e-3 * np.abs(products).max()


def test_instruction_sets_give_the_same_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    track = difficult_poses()
    found = []
    for name in _core.available_instruction_sets():
        monkeypatch.setenv("DRIFTWALK_INSTRUCTION_SET", name)
        options = {"strength": waves(track["time"]), "orientation": "state"} | FLOATING
        found.append(of_layers(track, WAVY, OTHER, **options))
    for other in found[1:]:
        for name, values in other.items():
            assert values.tobytes() == found[0][name].tobytes(), name


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"strength": None}, "several layers need their strengths"),
        ({"strength": np.ones((1, 21))}, "shape"),
        ({"strength": np.ones((2, 20))}, "differ in length"),
        ({"strength": np.full((2, 21), np.nan)}, "finite"),
        ({"coefficients": np.zeros((3, *WAVY.shape[1:])), "strength": None}, "must have shape"),
    ],
)
def test_refuses(changes: dict[str, Any], message: str) -> None:
    track = make_track(np.linspace(0.0, 2.0, 21))
    options = {"coefficients": np.concatenate([WAVY, OTHER]), "strength": waves(track["time"])}
    with pytest.raises(ValueError, match=message):
        make_filter(track, **(options | changes))
