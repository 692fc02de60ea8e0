"""Where a search begins: numbers that go with the units of a recording, and a first flow."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from fit_worlds import coarse_study, recording

from driftwalk.likelihood import start
from driftwalk.likelihood.preparation import prepare, spline_of
from driftwalk.likelihood.prior import PRIOR
from driftwalk.likelihood.spline import Spline, penalties
from driftwalk.likelihood.start import INITIAL_VALUES, first_point, first_points, first_weights
from driftwalk.schema import Track, body_track

SPLINE = Spline(-0.06, -0.06, 0.04, 6, 6)


def track(length: float = 1.0, time: float = 1.0) -> Track:
    """Return a noisy circle in other units of length and time."""
    noise = np.random.default_rng(1).normal(size=(3, 400))
    at = 0.1 * np.arange(400)
    return Track(
        time * at,
        length * (0.05 * np.cos(0.8 * at) + 3e-4 * noise[0]),
        length * (0.05 * np.sin(0.8 * at) + 3e-4 * noise[1]),
        0.8 * at + 0.01 * noise[2],
    )


@pytest.mark.parametrize(("length", "time"), [(1.0, 1.0), (3.0, 1.0), (1.0, 2.0)])
def test_the_weights_are_those_of_a_flow_of_the_body_s_speed(length: float, time: float) -> None:
    """The roughness is that of second derivatives over an area, the size that of velocities.

    In the exponent both are numbers: in other units the weights go with the inverse of the penalty.
    """
    wide = Spline(-0.06 * length, -0.06 * length, 0.04 * length, 6, 6)
    plain, changed = first_weights([track()], SPLINE), first_weights([track(length, time)], wide)
    flow = np.random.default_rng(2).normal(size=36)
    for name, before, after in zip(
        ("roughness", "size"), penalties(SPLINE), penalties(wide), strict=True
    ):
        own = getattr(plain, name) * flow @ before @ flow
        other = getattr(changed, name) * (length / time) ** 2 * (flow @ after @ flow)
        assert other == pytest.approx(own, rel=1e-6)
    # A flow of the body's speed everywhere has the weight of a few coefficients by its size.
    speed = 0.05 * 0.8
    assert 0.1 < plain.size * speed**2 * np.ones(36) @ penalties(SPLINE)[1] @ np.ones(36) < 10.0


def ready(one: Track, *, side: float = 0.03, angle: str = "state") -> Any:
    study = coarse_study()
    block = study.block.model_copy(update={"side_m": side})
    return SimpleNamespace(
        study=study.model_copy(update={"block": block}), tracks=[one], angle=angle, measured=None
    )


def test_the_first_noises_go_with_the_units(monkeypatch: pytest.MonkeyPatch) -> None:
    """q has m^2/s^3, r m; the angle has none."""
    monkeypatch.setattr(start, "_first_coefficients", lambda *_: np.zeros((2, 6, 6)))
    plain = first_point(ready(track()))
    long = first_point(ready(track(2.0), side=0.06))
    slow = first_point(ready(track(1.0, 3.0)))
    assert plain.log_drag == math.log(PRIOR.drag)
    for other, length, time in ((long, 2.0, 1.0), (slow, 1.0, 3.0)):
        shift = math.log(length**2 / time**3)
        assert other.log_intensity - plain.log_intensity == pytest.approx(shift, abs=1e-6)
    assert long.log_noise - plain.log_noise == pytest.approx(math.log(2.0), abs=0.02)
    assert math.exp(plain.log_noise) == pytest.approx(3e-4, rel=0.2)
    assert plain.log_angle_noise is not None
    assert math.exp(plain.log_angle_noise) == pytest.approx(0.01, rel=0.2)
    assert plain.log_lever is not None
    assert long.log_lever is not None
    assert long.log_lever - plain.log_lever == pytest.approx(math.log(2.0))
    # Rather too large than too small: a tenth of U^3 / a.
    speed = 0.05 * 0.8
    assert 0.05 < math.exp(plain.log_intensity) * 0.03 / speed**3 < 0.3
    without = first_point(ready(track(), angle="none"))
    assert without.log_lever is without.log_angle_noise is None


def test_a_noise_that_nothing_tells_is_a_thousandth_of_the_steps() -> None:
    assert start._log_noise([math.nan, 2e-4, 4e-4], 1e-5) == pytest.approx(math.log(3e-4))
    assert start._log_noise([math.nan], 1e-5) == math.log(1e-5)
    assert start._log_noise([1e-6], 1e-5) == math.log(1e-5)


def test_a_floating_body_begins_with_other_forces(monkeypatch: pytest.MonkeyPatch) -> None:
    """And with the flow that the body follows."""
    asked: list[str] = []

    def coefficients(_: Any, study: Any) -> np.ndarray:
        asked.append(study.flow.inertia)
        return np.full((2, 6, 6), float(len(asked)))

    monkeypatch.setattr(start, "_first_coefficients", coefficients)
    found = first_points(ready(track()))
    assert asked[1] == "none" != asked[0]
    assert (found.paper.coefficients == 1.0).all()
    for one, factor in zip(found.floating, INITIAL_VALUES.floating_intensity_factors, strict=True):
        assert (one.coefficients == 2.0).all()
        apart = one.log_intensity - found.paper.log_intensity
        assert apart == pytest.approx(math.log(factor))
        assert one.log_noise == found.paper.log_noise


def test_a_smooth_flow_goes_through_what_was_measured() -> None:
    """With sums of products of a linear flow at many places the spline is that flow there."""
    axis = np.linspace(-0.05, 0.05, 30)
    along = SPLINE.design(axis, axis)
    basis = np.kron(along[1], along[0])
    x, y = (one.ravel() for one in np.meshgrid(axis, axis))
    right = np.stack([basis.T @ (-0.7 * y), basis.T @ (0.7 * x)])
    found = start._smooth(basis.T @ basis, right, SPLINE)
    values = SPLINE.values(found, axis, axis)
    np.testing.assert_allclose(values[0].ravel(), -0.7 * y, atol=2e-4)
    np.testing.assert_allclose(values[1].ravel(), 0.7 * x, atol=2e-4)


def test_each_flow_begins_with_the_longest_stretch_in_it(monkeypatch: pytest.MonkeyPatch) -> None:
    study = coarse_study()
    made = prepare([recording(60.0)], study, "state", None)
    whole = body_track(recording(60.0))
    parts = [Track(*(axis[a:b] for axis in whole)) for a, b in ((0, 100), (100, 300), (300, 600))]
    intervals = SimpleNamespace(steady=False, labels=("A", "B"))
    several: Any = SimpleNamespace(
        intervals=intervals,
        places=[(0, 0), (1, 0), (0, 0)],
        parts=parts,
        measured=None,
        passes=SimpleNamespace(spline=SPLINE),
    )
    splines: list[Spline] = []

    def coefficients(one: Track, _: Any, spline: Spline, *__: Any) -> np.ndarray:
        splines.append(spline)
        return np.full((2, 1, 1), float(one.time.size))

    monkeypatch.setattr(start, "_flow_coefficients", coefficients)
    found = start._first_coefficients(several, study)
    assert found[:, 0, 0, 0].tolist() == [300.0, 200.0]
    steady = start._first_coefficients(made, study)
    assert steady[0, 0, 0] == whole.time.size
    assert splines == [SPLINE, SPLINE, spline_of(study)]
