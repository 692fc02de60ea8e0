"""A fit in a file is the one in memory."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from fit_worlds import coarse_study, recording

import driftwalk as dw
from driftwalk.core.errors import InputError
from driftwalk.schema import check_dataset
from driftwalk.schema.answers.facts import facts_of, fit_parts, fitted_value
from driftwalk.schema.stores.netcdf import open_netcdf


@pytest.fixture(scope="module")
def fit() -> xr.Dataset:
    return dw.fit_motion(recording(120.0), coarse_study("auto"), angle="state")


def stored(dataset: xr.Dataset, folder: Path) -> xr.Dataset:
    path = folder / "fit.nc"
    path.write_bytes(bytes(dataset.to_netcdf(engine="h5netcdf")))
    return open_netcdf(path)


@pytest.mark.slow
def test_what_is_stored_is_what_is_in_memory(fit: xr.Dataset, tmp_path: Path) -> None:
    xr.testing.assert_identical(stored(fit, tmp_path), fit)
    assert facts_of(stored(fit, tmp_path)) == facts_of(fit)


@pytest.mark.slow
@pytest.mark.parametrize("count", [0, 1, 2])
def test_warnings_are_kept_however_many_there_are(
    fit: xr.Dataset, count: int, tmp_path: Path
) -> None:
    texts = ["C_d is known to 15 % only", "der Block lief am Rand – „immer“"][:count]
    told = fit.drop_vars("warning").assign_coords(warning=("warning", np.array(texts, np.str_)))
    found = stored(told, tmp_path)
    xr.testing.assert_identical(found, told)
    assert facts_of(found)["warnings"] == texts
    check_dataset(found)


def test_the_answer_has_units_and_verdicts(fit: xr.Dataset) -> None:
    assert dict(zip(fit["parameter"].values, fit["unit"].values, strict=True)) == {
        "drag_coefficient": "1",
        "force_std": "N",
        "force_noise_intensity": "N2 s",
        "tracking_noise": "m",
        "force_lever": "m",
        "orientation_noise": "rad",
    }
    low, high = (fit["interval"].sel(bound=bound) for bound in ("lower", "upper"))
    assert ((low < fit["estimate"]) & (fit["estimate"] < high)).all()
    force, every = fitted_value(fit, "force_std"), float(fit["force_interval"])
    assert fitted_value(fit, "force_noise_intensity") == pytest.approx(force**2 * every)
    assert fit["converged"].dtype == bool
    assert bool(fit["converged"]) is True
    assert set(fit.attrs) == {
        *("kind", "schema_version", "arena", "angle", "source", "simulated_recording", "study"),
        *("force_law", "force_law_stated", "drag_law", "drag_law_stated"),
    }
    with pytest.raises(InputError, match="the fit has no viscosity: it has drag_coefficient"):
        fitted_value(fit, "viscosity")


def test_flat_facts_and_variables_are_each_other_s_inverse(fit: xr.Dataset) -> None:
    data, coords, _ = fit_parts(facts_of(fit))
    made = xr.Dataset(data, coords)
    for name in made.variables:
        np.testing.assert_array_equal(made[name].values, fit[name].values)
