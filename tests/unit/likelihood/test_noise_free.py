"""Tracks without the noise of a camera get some; others stay as they are."""

from __future__ import annotations

import numpy as np
import pytest

import driftwalk as dw
from driftwalk.likelihood.preparation import AngleUse, prepare
from driftwalk.likelihood.recording_artifacts.noise_free import with_least_noise
from driftwalk.record import estimate_tracking_noise
from driftwalk.schema import Track, body_track
from driftwalk.schema.answers.facts import facts_of

SIDE = 0.03


def walk(noise_m: float, noise_rad: float, *, seed: int, intensity: float = 1e-7) -> Track:
    """Return a velocity that walks at random, seen with noise: 3000 samples at 10 Hz."""
    random = np.random.default_rng(seed)
    velocity = np.cumsum(np.sqrt(0.1 * intensity) * random.standard_normal((2, 3000)), axis=1)
    x, y = 0.1 * np.cumsum(velocity, axis=1) + noise_m * random.standard_normal((2, 3000))
    time = 0.1 * np.arange(3000)
    return Track(time, x, y, 0.3 * time + noise_rad * random.standard_normal(3000))


def test_a_seen_track_stays_as_it_is() -> None:
    track = body_track(dw.tank30_recording())
    found, added = with_least_noise(track, side=SIDE, number=0)
    assert found is track
    assert added == (0.0, 0.0)


def test_noise_that_lacks_is_made_up_for() -> None:
    track = walk(2e-5, 0.0, seed=1)
    found, added = with_least_noise(track, side=SIDE, number=3)
    # 0.09 mm and 0.005 rad together with what was there; estimates are good to 4 %.
    total = estimate_tracking_noise(found)
    assert total.position_noise_m == pytest.approx(9e-5, rel=0.12)
    assert total.orientation_noise_rad == pytest.approx(0.005, rel=0.12)
    assert added.position_noise_m == pytest.approx(np.sqrt(9e-5**2 - 2e-5**2), rel=0.03)
    for axis in ("x", "y", "theta"):
        change = getattr(found, axis) - getattr(track, axis)
        assert change.std() == pytest.approx(added[axis == "theta"], rel=0.06)
        assert abs(np.corrcoef(change[1:], change[:-1])[0, 1]) < 0.08
    again, _ = with_least_noise(track, side=SIDE, number=3)
    other, _ = with_least_noise(track, side=SIDE, number=4)
    np.testing.assert_array_equal(again.x, found.x)
    assert abs(np.corrcoef(other.x - track.x, found.x - track.x)[0, 1]) < 0.08


def test_a_motion_too_rough_to_tell_stays_as_it_is() -> None:
    # Its random motion hides noise of half a millimetre: nothing says that there is none.
    track = walk(0.0, 0.01, seed=2, intensity=1.0)
    assert estimate_tracking_noise(track).position_noise_standard_error_m > 1e-5
    assert with_least_noise(track, side=SIDE, number=0)[1] == (0.0, 0.0)


def test_a_column_that_is_only_filled_stays_so() -> None:
    track = walk(0.0, 0.0, seed=1)._replace(theta=np.full(3000, 0.3))
    found, added = with_least_noise(track, side=SIDE, number=0)
    assert added.position_noise_m > 0.0
    assert added.orientation_noise_rad == 0.0
    assert (found.theta == 0.3).all()


def test_a_seen_track_keeps_an_exact_orientation() -> None:
    track = walk(3e-4, 0.0, seed=1)
    assert with_least_noise(track, side=SIDE, number=0)[0] is track


@pytest.mark.parametrize(
    ("shape", "angle", "gets"),
    [
        ("square", "auto", True), ("square", "none", False),
        ("disc:3cm", "auto", True), ("disc:3cm", "none", True),
    ],
)  # fmt: skip
def test_a_square_whose_orientation_is_not_used_gets_none(
    shape: str, angle: AngleUse, gets: bool
) -> None:
    recording = dw.tank30_recording("without_noise").isel(time=slice(0, 400))
    study = dw.apply_overrides(dw.Study(), {"block.shape": shape})
    ready = prepare([recording], study, angle, None)
    assert (ready.added.position_noise_m > 0.0) is gets
    filled = recording.assign(theta=0.0 * recording["theta"])
    assert (prepare([filled], study, angle, None).added.position_noise_m > 0.0) is (
        shape != "square"
    )


@pytest.mark.slow
def test_a_recording_without_noise_is_explained() -> None:
    """Of the other engine. As it is: σ_F 4 % low, beyond its interval, and rejected."""
    recording = dw.tank30_recording("without_noise")
    study = dw.apply_overrides(dw.Study(), {"forces.force_interval_s": 0.016})
    fit = dw.fit_motion(recording, study)
    check = dw.check_model(fit, recording)
    assert check["verdict"].item() == "explains"
    # The C_d of the engine's steps of 16 ms, and its force.
    for name, truth in (("drag_coefficient", 0.395), ("force_std", 0.612e-3)):
        low, high = fit["interval"].sel(parameter=name).values
        assert low <= truth <= high
        assert high < 1.06 * low
    facts = facts_of(fit)
    assert facts["added_position_noise_m"] == pytest.approx(9e-5, rel=0.01)
    assert facts["tracking_noise_m"] == pytest.approx(9e-5, rel=0.03)
    assert any("almost no camera noise" in str(one) for one in fit["warning"].values)
