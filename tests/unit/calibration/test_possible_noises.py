"""Noises that a recording's camera may have: one, around an estimate, or below a bound."""

from __future__ import annotations

import numpy as np
import pytest
from self_propelled import moving

import driftwalk as dw
from driftwalk.conditions import possible_noises, recorded_camera
from driftwalk.record import estimate_tracking_noise, noise_bound
from driftwalk.schema import Track, body_track

JERKS = {
    "speed": 0.078, "speed_cv": 0.72, "run_time": 0.135, "run_time_cv": 0.74, "rest_time": 0.19,
    "rest_time_cv": 0.95, "turn_std": 3.03, "rotational_diffusion": 0.8,
}  # fmt: skip
"""A body that rests and jerks within two samples, as small robots do that walk on loose legs."""
NOISE = 8e-5


def noises(track: Track, study: dw.Study, *, quantum: float) -> tuple[float, ...]:
    camera = recorded_camera(track, study, position_quantum=quantum)
    return possible_noises(track, study, camera)


def jerking(seed: int) -> Track:
    model = dw.motion_model("run_rest")
    return body_track(moving(model, JERKS, 600.0, seed=seed, noise=NOISE))


def test_a_stated_noise_is_the_only_one():
    study = dw.apply_overrides(dw.Study(), {"observation.position_noise_m": 4e-4})
    assert noises(jerking(1), study, quantum=0.0) == (4e-4,)


def test_around_a_clear_estimate_the_logarithm_is_normal():
    track = body_track(dw.tank30_recording())
    estimate = estimate_tracking_noise(track)
    nominal = recorded_camera(track, dw.Study(), position_quantum=0.0).position_noise
    logs = np.log(np.array(noises(track, dw.Study(), quantum=0.0)) / nominal)
    doubt = max(estimate.position_noise_standard_error_m / nominal, 0.05)
    assert logs.mean() == pytest.approx(0.0, abs=1e-12)
    assert logs.std() == pytest.approx(doubt, rel=1e-3)


@pytest.mark.slow
def test_an_estimate_of_zero_gives_way_to_noises_that_include_the_true_one():
    """Jerks hide the noise from the estimate; none of 20 recordings may exclude the truth."""
    tracks = [jerking(seed) for seed in range(20)]
    unclear = [
        track
        for track in tracks
        if estimate_tracking_noise(track).position_noise_m
        <= 2.0 * estimate_tracking_noise(track).position_noise_standard_error_m
    ]
    assert len(unclear) > 10
    for track in unclear:
        found = noises(track, dw.Study(), quantum=0.0)
        assert 0.0 < min(found) < NOISE < max(found) < noise_bound(track).position_noise_m


def test_unclear_noises_have_a_normal_variance_between_zero_and_the_bound():
    """The oracle draws variances and rejects those outside; 2e5 draws know a part to 0.1 %."""
    track = jerking(1)
    estimate = estimate_tracking_noise(track)
    assert estimate.position_noise_m == 0.0
    bound = noise_bound(track).position_noise_m
    spread = estimate.position_noise_standard_error_m**2
    drawn = spread * np.random.default_rng(1).standard_normal(1_000_000)
    drawn = drawn[(drawn > 0.0) & (drawn < bound**2)]
    found = sorted(noises(track, dw.Study(), quantum=0.0))
    below = [(drawn < noise**2).mean() for noise in found]
    # Of a normal distribution these parts lie below -1.363, -0.3775, 0.3775 and 1.363.
    np.testing.assert_allclose(below, [0.0864, 0.3529, 0.6471, 0.9136], atol=0.005)


def test_what_rounding_adds_is_taken_away_again():
    track, quantum = jerking(1), 1e-4
    whole = np.array(noises(track, dw.Study(), quantum=0.0))
    rounded = np.array(noises(track, dw.Study(), quantum=quantum))
    np.testing.assert_allclose(rounded**2, np.maximum(whole**2 - quantum**2 / 12.0, 0.0))


def test_positions_without_noise_or_motion_have_none():
    time = np.arange(200) * 0.1
    line = Track(time, 0.01 * time, 0.0 * time, np.full(200, np.nan))
    found = noises(line, dw.Study(), quantum=0.0)
    assert max(found) < 1e-9
