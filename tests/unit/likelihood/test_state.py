"""The likelihood fit with the angle in the state: the truth, holes, and angles that lie."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from fit_worlds import DRAG, FORCE_N, NOISE_M, coarse_study

import driftwalk as dw
from driftwalk.likelihood.preparation import use_angle
from driftwalk.model import apply_overrides
from driftwalk.schema import body_track, build_trajectory
from driftwalk.schema.answers.facts import facts_of

SECONDS = 600.0
ANGLE_NOISE = np.radians(0.5)


@pytest.fixture(scope="module")
def track() -> xr.Dataset:
    """Ten minutes of the bundled tank, in steps of 2 ms, after 20 s of getting under way."""
    study = apply_overrides(
        coarse_study(),
        {
            "forces.drag_coefficient": DRAG,
            "forces.force_std_N": FORCE_N,
            "simulation.time_step_s": 0.002,
            "observation.position_noise_m": NOISE_M,
            "observation.orientation_noise_rad": ANGLE_NOISE,
            "observation.position_quantum_m": 0.0,
        },
    )
    time = np.arange(0.0, SECONDS + 20.0, 0.1)
    run = dw.simulate(study, dw.tank30_flow(), sample_time=time, replicates=1, seed=11)
    seen = run.isel(replicate=0, body=0, time=slice(200, None))
    return build_trajectory(
        seen["time"].values - 20.0, *(seen[name].values for name in ("x", "y", "theta"))
    )


@pytest.fixture(scope="module")
def fit(track: xr.Dataset) -> xr.Dataset:
    return dw.fit_motion(track, coarse_study(), angle="state")


@pytest.fixture(scope="module")
def holed(track: xr.Dataset) -> xr.Dataset:
    """A fifth of the positions, 100 s and two fifths of the angles are missing."""
    generator = np.random.default_rng(7)
    time = track["time"].values
    lost = (generator.random(time.size) < 0.2) | ((time > 200.0) & (time < 300.0))
    holes = track.copy(deep=True)
    for name in ("x", "y"):
        holes[name].values[lost] = np.nan
    holes["theta"].values[generator.random(time.size) < 0.4] = np.nan
    return holes


@pytest.fixture(scope="module")
def holed_fit(holed: xr.Dataset) -> xr.Dataset:
    return dw.fit_motion(holed, coarse_study(), angle="state")


def turned(track: xr.Dataset, theta: np.ndarray) -> xr.Dataset:
    other = track.copy(deep=True)
    other["theta"].values[:, 0] = theta
    return other


def deviations(fit: xr.Dataset) -> np.ndarray:
    """Return how far C_d, sigma_F and both noises are from the truth, in standard deviations."""
    truth = np.array([DRAG, FORCE_N, NOISE_M, ANGLE_NOISE])
    names = ("drag_coefficient", "force_std_N", "tracking_noise_m", "orientation_noise_rad")
    sd = np.sqrt(np.diag(fit["covariance"].values))[[0, 1, 2, 4]] * (1.0, 0.5, 1.0, 1.0)
    return np.log(np.array([facts_of(fit)[name] for name in names]) / truth) / sd


@pytest.mark.slow
def test_the_truth_is_within_the_errors(fit: xr.Dataset) -> None:
    """4 sd for each of four: once in 4000 runs, if the errors are right."""
    assert fit.attrs["angle"] == "state"
    assert facts_of(fit)["converged"] == "yes"
    assert np.abs(deviations(fit)).max() < 4.0
    sd = np.sqrt(np.diag(fit["covariance"].values))
    # The turning tells of the drag: from the motion alone it is some 8 % in ten minutes.
    assert sd[0] < 0.02
    assert fit["log_parameter"].values.tolist()[3:] == ["ln_force_lever", "ln_orientation_noise"]
    for name in ("force_lever_m", "orientation_noise_rad"):
        low, high = facts_of(fit)[f"{name}_interval"]
        assert low < facts_of(fit)[name] < high


@pytest.mark.slow
def test_a_force_on_the_centre_has_no_lever(fit: xr.Dataset) -> None:
    """What is found, from its prior, is below a hundredth of the block's side."""
    assert facts_of(fit)["force_lever_m"] < 3e-4
    assert np.sqrt(fit["covariance"].values[3, 3]) > 0.3


@pytest.mark.slow
def test_turning_and_motion_agree_on_the_drag(fit: xr.Dataset) -> None:
    assert 0.0 <= facts_of(fit)["angle_disagreement_std"] < 3.0
    low, high = facts_of(fit)["drag_coefficient_angle_given_interval"]
    assert low < facts_of(fit)["drag_coefficient_angle_given"] < high
    assert np.log(high / low) > 2.0 * np.log(
        facts_of(fit)["drag_coefficient_interval"][1]
        / facts_of(fit)["drag_coefficient_interval"][0]
    )
    assert facts_of(fit)["warnings"] == []


@pytest.mark.slow
def test_the_errors_of_prediction_are_white(fit: xr.Dataset) -> None:
    """18,000 numbers: 4 sd of the mean square are 4 %, and the fit takes less than 1 %."""
    assert facts_of(fit)["chi_squared_per_dof"] == pytest.approx(1.0, abs=0.05)
    assert abs(facts_of(fit)["autocorrelation"]) < 4.0 * facts_of(fit)["autocorrelation_std"]
    assert facts_of(fit)["autocorrelation_std"] == pytest.approx(1 / np.sqrt(18_000), rel=0.05)


@pytest.mark.slow
def test_a_block_that_is_seen_for_two_seconds_at_a_time_has_its_drag() -> None:
    """Four recordings of 20 minutes, each seen for 2.1 of every 8.5 s; 2 sd of the mean are 5 %.

    Where nothing was expected of the velocity behind a gap, C_d was 8 % too large in these four, as
    the noise of the two samples that give it looks like drag.
    """
    time = 0.1 * np.arange(12001)
    study = apply_overrides(
        coarse_study(),
        {
            "forces.drag_coefficient": DRAG,
            "forces.force_std_N": FORCE_N,
            "observation.position_noise_m": NOISE_M,
            "observation.orientation_noise_rad": ANGLE_NOISE,
        },
    )
    run = dw.simulate(study, dw.tank30_flow(), sample_time=time, replicates=4, seed=5)
    seen = time % 8.5 < 2.1 - 1e-6
    found = []
    for number in range(4):
        pose = (run[name].values[number, :, 0].astype(float) for name in ("x", "y", "theta"))
        track = build_trajectory(time, *(np.where(seen, one, np.nan) for one in pose))
        found.append(dw.fit_motion(track, coarse_study())["estimate"].values[0])
    assert np.mean(found) == pytest.approx(DRAG, rel=0.05)


@pytest.mark.slow
def test_holes_and_missing_angles_leave_the_truth_within_the_errors(
    holed: xr.Dataset, holed_fit: xr.Dataset, fit: xr.Dataset
) -> None:
    assert np.abs(deviations(holed_fit)).max() < 4.0
    assert facts_of(holed_fit)["samples"] == int(np.isfinite(holed["x"].values).sum())
    # Less is known, of the angle's noise the most.
    ratio = np.sqrt(np.diag(holed_fit["covariance"].values) / np.diag(fit["covariance"].values))
    assert ratio[[0, 1, 2, 4]] == pytest.approx(np.full(4, 1.5), abs=0.45)


@pytest.mark.slow
def test_missing_angles_are_no_errors_of_prediction(holed_fit: xr.Dataset) -> None:
    """Some 10,000 numbers are there; counted as zeros, missing angles would make it 0.87."""
    assert facts_of(holed_fit)["chi_squared_per_dof"] == pytest.approx(1.0, abs=0.06)


@pytest.mark.slow
def test_turns_of_the_recorded_angle_do_not_matter(track: xr.Dataset) -> None:
    """A tracker may count turns or not, and which side of the square it follows is its own."""
    short = track.isel(time=slice(0, 1000))
    theta = short["theta"].values[:, 0]
    other = turned(short, np.unwrap(theta) + 0.5 * np.pi + 8.0 * np.pi)
    fits = [facts_of(dw.fit_motion(one, coarse_study(), angle="state")) for one in (short, other)]
    for name in ("drag_coefficient", "force_std_N", "orientation_noise_rad"):
        assert fits[1][name] == pytest.approx(fits[0][name], rel=1e-6)


@pytest.mark.slow
def test_an_angle_of_the_wrong_side_is_noticed(track: xr.Dataset) -> None:
    """A tracker that takes the diagonal for a side: the diagonal meets the water otherwise."""
    short = track.isel(time=slice(0, 4000))
    lie = turned(short, short["theta"].values[:, 0] + np.pi / 4)
    found = dw.fit_motion(lie, coarse_study(), angle="state")
    assert facts_of(found)["angle_disagreement_std"] > 3.0
    assert any("one drag law" in one for one in facts_of(found)["warnings"])


@pytest.mark.slow
def test_an_angle_that_comes_late_shows_in_the_lever(track: xr.Dataset, fit: xr.Dataset) -> None:
    """Late by 0.3 s the turning has no cause in the flow, so it takes a force off the centre."""
    short = track.isel(time=slice(0, 4000))
    late = turned(short, np.roll(short["theta"].values[:, 0], 3))
    found = dw.fit_motion(late, coarse_study(), angle="state")
    assert (
        facts_of(found)["force_lever_m_interval"][0]
        > 2.0 * facts_of(fit)["force_lever_m_interval"][1]
    )


def test_half_of_the_angles_make_it_the_default(track: xr.Dataset) -> None:
    theta = track["theta"].values[:, 0].copy()
    for share, used in ((0.0, "state"), (0.45, "state"), (0.55, "none"), (1.0, "none")):
        blind = theta.copy()
        blind[: int(share * theta.size)] = np.nan
        recording = turned(track, blind)
        assert use_angle([recording], [body_track(recording)], dw.Study(), "auto") == used


@pytest.mark.slow
@pytest.mark.parametrize("angle", [0.0, 0.3])
def test_a_column_that_is_only_filled_is_no_orientation(track: xr.Dataset, angle: float) -> None:
    short = track.isel(time=slice(0, 600)).copy(deep=True)
    short["theta"].values[:] = angle
    assert dw.fit_motion(short, coarse_study()).attrs["angle"] == "none"
    with pytest.raises(dw.core.errors.InputError, match="the same in every row"):
        dw.fit_motion(short, coarse_study(), angle="state")


@pytest.mark.slow
def test_an_angle_that_is_off_warns_of_the_lever(track: xr.Dataset) -> None:
    """Five degrees: some 0.4 mm, where the true angle gives 0.06 mm."""
    assert not any("from its centre" in one for one in warnings_in(track))
    wrong = turned(track, track["theta"].values[:, 0] + np.deg2rad(8.0))
    assert any("from its centre" in one for one in warnings_in(wrong))


def warnings_in(recording: xr.Dataset) -> list[str]:
    """Return the warnings of a fit that takes the camera as it is."""
    exact = apply_overrides(coarse_study(), {"fit.camera": "exact"})
    fit = dw.fit_motion(recording, exact, angle="state")
    return list(facts_of(fit)["warnings"])
