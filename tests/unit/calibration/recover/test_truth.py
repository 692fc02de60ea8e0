"""Recordings of known truth: their camera, gaps and addresses, and which truths are refused."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from self_propelled import moving

import driftwalk as dw
from driftwalk.calibration import ModelRecovery
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.motion import BlockModel

ACTIVE = dw.motion_model("active")
VALUES = {"speed": 0.03, "rotational_diffusion": 0.5, "turn_rate": 0.3}
SHORT = {"recover.durations_s": [60.0]}


def truth(like: xr.Dataset | None = None, **changes: Any) -> ModelRecovery:
    overrides = {key.replace("__", "."): value for key, value in changes.items()}
    study = dw.apply_overrides(dw.Study(), {**SHORT, **overrides})
    return ModelRecovery(study, ACTIVE, VALUES, like=like)


def test_a_recording_has_its_own_random_numbers() -> None:
    known = truth()
    first, again, other = (known.recording(number) for number in (0, 0, 1))
    xr.testing.assert_identical(first, again)
    assert not np.allclose(first["x"], other["x"])
    seeds = {known.search_study(number).calibration.seed for number in range(5)}
    assert len(seeds) == 5


def test_it_is_as_long_and_dense_as_asked() -> None:
    recording = truth(recover__sample_interval_s=0.05, recover__durations_s=[30.0]).recording(0)
    assert recording["time"].values == pytest.approx(0.05 * np.arange(601))
    # A body that has settled moves from the first sample on, at its speed.
    step = np.hypot(*(np.diff(recording[name].values[:2, 0]) for name in ("x", "y")))[0]
    assert step == pytest.approx(VALUES["speed"] * 0.05, rel=0.1)


def test_the_camera_adds_its_noise() -> None:
    """0.3 mm within 11 %: five standard errors of 1202 differences, a false alarm in 10^6."""
    clear, noisy = (
        truth(observation__position_noise_m=noise).recording(0) for noise in (0.0, 3e-4)
    )
    apart = np.concatenate([(noisy[name] - clear[name]).values.ravel() for name in ("x", "y")])
    assert apart.std() == pytest.approx(3e-4, rel=0.11)
    seen = truth(observation__position_noise_m=3e-4).search_study(0).observation
    assert seen.position_noise_m == "estimate"
    known = replace(truth(observation__position_noise_m=3e-4), noise="known")
    assert known.search_study(0).observation.position_noise_m == 3e-4


def test_the_camera_rounds_and_misses_samples() -> None:
    """601 samples, 20 % of them missing: within 5 standard deviations, 49."""
    known = truth(recover__missing_share=0.2, observation__position_quantum_m=1e-3)
    recording = known.recording(0)
    assert abs(int(np.isnan(recording["x"]).sum()) - 120) < 49
    assert np.array_equal(np.isnan(recording["x"]), np.isnan(recording["y"]))
    x = recording["x"].values[np.isfinite(recording["x"].values)] / 1e-3
    assert x == pytest.approx(np.round(x), abs=1e-3)
    assert recording.attrs["position_quantum_m"] == 1e-3


def test_like_a_recording_it_has_its_times_start_and_noise() -> None:
    seen = moving(ACTIVE, VALUES, 60.0, seed=4, noise=5e-4)
    seen["x"][50:70] = np.nan
    known = truth(like=seen)
    recording = known.recording(0)
    kept = np.isfinite(seen["x"].values[:, 0])
    assert recording["time"].values.tolist() == seen["time"].values[kept].tolist()
    assert known.missing_share == pytest.approx(20 / 600)
    assert known.position_noise == pytest.approx(5e-4, rel=0.2)
    away = [float(recording[name][0, 0] - seen[name][0, 0]) for name in ("x", "y")]
    assert np.abs(away).max() < 5e-3


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"speed": 0.03}, "no value for rotational_diffusion"),
        ({**VALUES, "sped": 1.0}, "did you mean 'speed'"),
        ({**VALUES, "speed": -0.1}, "speed is -0.1"),
        ({**VALUES, "speed": 1e9}, "speed is 1e\\+09 m/s, and is searched from 1e-06 to 10"),
        ({**VALUES, "turn_rate": float("nan")}, "turn_rate is nan"),
    ],
)
def test_a_truth_that_is_none_is_refused(values: dict[str, float], message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        ModelRecovery(dw.Study(), ACTIVE, values).check()


def test_other_mistakes_are_refused() -> None:
    with pytest.raises(InputError, match=r"holds 2 lengths"):
        truth(recover__durations_s=[60.0, 120.0]).check()
    with pytest.raises(InputError, match="recovery_study"):
        ModelRecovery(dw.Study(), BlockModel(dw.Study()), {}).check()
    with pytest.raises(ConfigurationError, match="estimated, known"):
        dw.recover_model(ACTIVE, VALUES, noise="stated")  # type: ignore[arg-type]
    closed = dw.motion_model("active", **VALUES)
    with pytest.raises(ConfigurationError, match="leave one open"):
        dw.recover_model(closed, {})
    still = {"speed": 1e-6, "rotational_diffusion": 0.5, "turn_rate": 0.0}
    study = dw.apply_overrides(dw.Study(), {"recover.durations_s": [2.0]})
    with pytest.raises(InputError, match="too short"):
        ModelRecovery(study, ACTIVE, still).check()
