"""The check of a fit as a whole: worlds of the model pass, others fail for the right reason."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from fit_worlds import DRAG, FORCE_N, coarse_study, fitted, recording

import driftwalk as dw
from driftwalk.core.errors import InputError
from driftwalk.likelihood.check.place import GROUP
from driftwalk.model import apply_overrides
from driftwalk.schema import build_trajectory
from driftwalk.schema.answers.facts import facts_of

CRITERIA = {
    *("autocorrelation", "tails", "outliers", "place", "time and place", "flow strength"),
    *("drag law", "noise by place", "noise by time", "change", "steps"),
}


@pytest.fixture(scope="module")
def track() -> xr.Dataset:
    return recording(600.0)


@pytest.fixture(scope="module")
def fit() -> xr.Dataset:
    return fitted(600.0)


@pytest.fixture(scope="module")
def check(fit: xr.Dataset, track: xr.Dataset) -> xr.Dataset:
    return dw.check_model(fit, track)


def verdict(found: xr.Dataset) -> tuple[str, list[str], set[str]]:
    """Return the verdict, the sentences, and the names of the criteria that failed."""
    failed = found["criterion"].values[found["failed"].values == 1]
    return str(found["verdict"].values), found["verdict_reason"].values.tolist(), set(failed)


def swirl(sign: float) -> xr.Dataset:
    """Return a ring of water that turns at 5 cm/s and drifts inwards."""

    def velocity(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        radius = np.hypot(x, y)
        turn = sign * 0.05 / 0.06 * np.exp(0.5 * (1.0 - (radius / 0.06) ** 2))
        return -turn * y - 0.12 * x, turn * x - 0.12 * y

    return dw.flow_from_function(velocity)


def simulated(flow: xr.Dataset, *, seconds: float = 600.0, seed: int = 1) -> xr.Dataset:
    study = apply_overrides(
        coarse_study(),
        {
            "forces.drag_coefficient": DRAG,
            "forces.force_std_N": FORCE_N,
            "flow.start": "first",
            "observation.position_noise_m": 3e-4,
            "observation.orientation_noise_rad": 0.009,
        },
    )
    time = 0.1 * np.arange(round(10 * seconds) + 1)
    run = dw.simulate(study, flow, sample_time=time, replicates=1, seed=seed)
    pose = (run[name].values[0, :, 0] for name in ("x", "y", "theta"))
    return build_trajectory(time, *pose)


@pytest.mark.slow
def test_the_bundled_recording_is_explained(check: xr.Dataset, fit: xr.Dataset) -> None:
    """Another engine, the same model. False alarm: one in 50."""
    said, reasons, failed = verdict(check)
    assert (said, reasons, failed) == ("explains", [], set())
    assert set(check["criterion"].values) == CRITERIA
    assert (check["p_value"].values >= 0.001).all()
    facts = check.attrs
    assert (facts["kind"], facts["schema_version"]) == ("model_check", 3)
    assert 10.0 < facts["effective_parameters"] < 2 * fit["coefficient"].isel(component=0).size
    assert facts["ks_distance"] < 2.0 * facts["ks_noise_floor"]
    low, high = facts["ks_distance_interval"]
    assert low <= facts["ks_distance"] <= high


@pytest.mark.slow
def test_what_the_fit_says_of_its_innovations_is_said_again(
    check: xr.Dataset, fit: xr.Dataset
) -> None:
    """The fit computes the mean square and the correlation of neighbours by itself."""
    mean = float(check["chi_squared_per_dof"].mean())
    assert mean == pytest.approx(facts_of(fit)["chi_squared_per_dof"])
    weights = check["chi_squared_per_dof"].values
    first = (check["autocorrelation"].sel(lag=1).values * weights).sum() / weights.sum()
    assert first == pytest.approx(facts_of(fit)["autocorrelation"], abs=1e-9)


@pytest.mark.slow
def test_sums_by_place_and_by_time_agree(check: xr.Dataset) -> None:
    count = check["residual_count"].values
    assert count.sum() == check.attrs["samples_used"] == check["part_count"].sum()
    by_place = np.nansum(check["residual"].values * count, axis=(1, 2))
    by_time = (check["part_residual"] * check["part_count"]).sum("part").values
    assert by_place == pytest.approx(by_time)
    known = np.isfinite(check["residual_distance"].values)
    assert (count[known] >= GROUP.fewest_in_cell).all()
    assert (count[~known] < GROUP.fewest_in_cell).all()


@pytest.mark.slow
def test_it_survives_a_file(check: xr.Dataset, tmp_path: Path) -> None:
    check.to_netcdf(tmp_path / "check.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "check.nc", engine="h5netcdf") as stored:
        xr.testing.assert_identical(stored.load(), check)


@pytest.mark.slow
def test_the_seed_moves_the_simulations_alone(
    check: xr.Dataset, fit: xr.Dataset, track: xr.Dataset
) -> None:
    same = dw.check_model(fit, track)
    xr.testing.assert_identical(same, check)
    other = dw.check_model(fit, track, seed=5, replicates=8)
    assert other["autocorrelation"].values == pytest.approx(check["autocorrelation"].values)
    assert other.sizes["drawn_replicate"] == 8
    assert other.attrs["ks_distance"] != check.attrs["ks_distance"]
    assert verdict(other)[0] == "explains"


@pytest.mark.slow
def test_a_world_of_the_model_is_explained() -> None:
    track = simulated(swirl(1.0), seconds=300.0, seed=11)
    assert verdict(dw.check_model(dw.fit_motion(track, coarse_study()), track))[0] == "explains"


@pytest.mark.slow
def test_a_flow_that_is_reversed_half_way_is_found_with_its_time() -> None:
    pair = [swirl(1.0), swirl(1.0), swirl(-1.0), swirl(-1.0)]
    time = xr.DataArray([0.0, 299.9, 300.1, 700.0], dims="time", name="time")
    flow = xr.concat(pair, dim=time, data_vars=["u", "v"], coords="minimal", compat="override")
    track = simulated(flow, seconds=600.0)
    said, reasons, failed = verdict(dw.check_model(dw.fit_motion(track, coarse_study()), track))
    assert said == "does not explain"
    assert "change" in failed
    sentence = next(text for text in reasons if text.startswith("the motion changes"))
    assert "between 0 s and 300 s" in sentence or "between 300 s and 600 s" in sentence


@pytest.mark.slow
def test_errors_of_the_tracker_that_remember_are_found() -> None:
    """Noise with the correlation 0.8 from one sample to the next in place of white noise."""
    generator = np.random.default_rng(3)
    other = recording(200.0)
    for name in ("x", "y"):
        noise = generator.normal(size=other.sizes["time"])
        for k in range(1, noise.size):
            noise[k] = 0.8 * noise[k - 1] + 0.6 * noise[k]
        other[name].values[:, 0] += 5e-4 * noise
    said, reasons, failed = verdict(dw.check_model(dw.fit_motion(other, coarse_study()), other))
    assert said == "does not explain"
    assert "autocorrelation" in failed
    assert any("Ljung-Box statistic" in text and "expected 60" in text for text in reasons)


@pytest.mark.slow
def test_noise_that_is_louder_in_one_half_of_the_tank_is_found() -> None:
    generator = np.random.default_rng(4)
    other = recording(200.0)
    right = other["x"].values[:, 0] > 0.0
    for name in ("x", "y"):
        other[name].values[right, 0] += 6e-4 * generator.normal(size=np.count_nonzero(right))
    said, reasons, failed = verdict(dw.check_model(dw.fit_motion(other, coarse_study()), other))
    assert said == "does not explain"
    assert "noise by place" in failed
    assert any("mean square" in text and "x = " in text for text in reasons)


@pytest.mark.slow
def test_several_recordings_with_holes() -> None:
    first, second = recording(200.0), recording(200.0, "second")
    lost = np.random.default_rng(7).random(first.sizes["time"]) < 0.2
    lost |= (first["time"].values > 100.0) & (first["time"].values < 130.0)
    for name in ("x", "y"):
        first[name].values[lost] = np.nan
    found = dw.check_model(dw.fit_motion([first, second], coarse_study()), [first, second])
    assert verdict(found)[0] == "explains"
    assert np.unique(found["part_recording"].values).tolist() == [0, 1]
    assert found["part_end"].values.max() == pytest.approx(200.0)
    assert found.attrs["ks_distance"] < 0.2


@pytest.mark.slow
def test_without_orientations_the_errors_are_still_white() -> None:
    """Averaged over orientations the drag is wrong for a block that turns, yet leaves no memory."""
    track = recording(200.0)
    track["theta"].values[:] = np.nan
    found = dw.check_model(dw.fit_motion(track, coarse_study()), track)
    assert not verdict(found)[2] & {"autocorrelation", "tails", "outliers"}
    assert np.isfinite(found.attrs["ks_distance"])


def test_what_cannot_be_checked_is_refused() -> None:
    fit, track = fitted(300.0), recording(300.0)
    with pytest.raises(InputError, match="expected a dataset 'fit'"):
        dw.check_model(dw.tank30_flow(), track)
    with pytest.raises(InputError, match="with the recordings that it was fitted to"):
        dw.check_model(fit, track.isel(time=slice(0, 1500)))
    with pytest.raises(InputError, match="replicates must be at least 4"):
        dw.check_model(fit, track, replicates=3)
