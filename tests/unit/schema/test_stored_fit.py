"""A fit in a file is the one in memory, and one of an earlier version is read as a current one."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from fit_worlds import coarse_study, recording

import driftwalk as dw
from driftwalk.core.errors import FormatError, InputError
from driftwalk.schema import check_dataset
from driftwalk.schema.answers.facts import facts_of, fit_parts, fitted_value
from driftwalk.schema.check import unknown_names
from driftwalk.schema.earlier import current_form
from driftwalk.schema.kinds.fit_numbers import PARAMETERS
from driftwalk.schema.stores.netcdf import open_netcdf

OLD = Path(__file__).resolve().parents[2] / "data" / "old_datasets"
FITS = ("fit_version_1.nc", "fit_of_several_flows_version_1.nc")


@pytest.fixture(scope="module")
def fit() -> xr.Dataset:
    return dw.fit_motion(recording(120.0), coarse_study("auto"), angle="state")


def as_stored(path: Path) -> xr.Dataset:
    """Return a file as plain xarray reads it, without driftwalk."""
    with xr.open_dataset(path, engine="h5netcdf") as dataset:
        return dataset.load()


def stored(dataset: xr.Dataset, folder: Path) -> xr.Dataset:
    path = folder / "fit.nc"
    path.write_bytes(bytes(dataset.to_netcdf(engine="h5netcdf")))
    return open_netcdf(path)


def test_what_is_stored_is_what_is_in_memory(fit: xr.Dataset, tmp_path: Path) -> None:
    xr.testing.assert_identical(stored(fit, tmp_path), fit)
    assert facts_of(stored(fit, tmp_path)) == facts_of(fit)


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


@pytest.mark.parametrize("name", FITS)
def test_a_fit_of_version_1_is_read_as_a_current_one(name: str) -> None:
    old, found = as_stored(OLD / name), open_netcdf(OLD / name)
    assert (old.attrs["schema_version"], found.attrs["schema_version"]) == (1, 2)
    assert check_dataset(found, "fit") is found
    assert unknown_names(found) == []
    assert found["warning"].values.tolist() == json.loads(old.attrs["warnings"])
    assert bool(found["converged"]) == (old.attrs["converged"] == "yes")
    assert found["wall_share"] == old.attrs["wall_share"]
    assert found["samples"] == old.attrs["samples"]
    for parameter, declared in PARAMETERS.items():
        key = declared.key
        if key in old.attrs:
            assert fitted_value(found, parameter) == old.attrs[key]
            ends = found["interval"].sel(parameter=parameter).values
            np.testing.assert_array_equal(ends, old.attrs[f"{key}_interval"])
    np.testing.assert_array_equal(found["covariance"].values, old["covariance"].values)
    np.testing.assert_array_equal(found["u"].values, old["u"].values)


def test_nothing_that_version_1_said_is_lost() -> None:
    for name in FITS:
        old, facts = as_stored(OLD / name), facts_of(open_netcdf(OLD / name))
        for key, value in old.attrs.items():
            if key == "warnings":
                assert facts[key] == json.loads(value)
            elif key != "schema_version":
                expected = np.atleast_1d(value).tolist()
                assert np.atleast_1d(facts[key]).tolist() == expected, key


def test_stages_take_a_fit_of_version_1_as_xarray_reads_it() -> None:
    old, found = as_stored(OLD / FITS[0]), open_netcdf(OLD / FITS[0])
    xr.testing.assert_identical(dw.fitted_flow(old), dw.fitted_flow(found))
    switched = as_stored(OLD / FITS[1])
    assert dw.fitted_flow(switched, interval=1).attrs["flow_label"] == "B"


def test_a_current_fit_and_other_datasets_stay_as_they_are(fit: xr.Dataset) -> None:
    assert current_form(fit) is fit
    other = xr.Dataset(attrs={"kind": "fit of another program", "schema_version": 1})
    assert current_form(other) is other


@pytest.mark.parametrize("lost", ["drag_coefficient_interval", "confidence", "warnings"])
def test_a_fit_of_version_1_without_its_answer_is_damaged(lost: str, tmp_path: Path) -> None:
    old = as_stored(OLD / FITS[0])
    del old.attrs[lost]
    path = tmp_path / "fit.nc"
    path.write_bytes(bytes(old.to_netcdf(engine="h5netcdf")))
    with pytest.raises(FormatError, match="is damaged: its fit of schema version 1") as caught:
        open_netcdf(path)
    assert caught.value.path == path


def test_a_fit_from_the_beginning_of_version_1_is_read() -> None:
    """The share of the tank that was visited was not among the first attributes."""
    old = as_stored(OLD / FITS[0])
    del old.attrs["visited_share"]
    found = current_form(old)
    assert "visited_share" not in found
    assert fitted_value(found, "drag_coefficient") == old.attrs["drag_coefficient"]
    xr.testing.assert_identical(dw.fitted_flow(found), dw.fitted_flow(open_netcdf(OLD / FITS[0])))


def test_flat_facts_and_variables_are_each_other_s_inverse(fit: xr.Dataset) -> None:
    data, coords, _ = fit_parts(facts_of(fit))
    made = xr.Dataset(data, coords)
    for name in made.variables:
        np.testing.assert_array_equal(made[name].values, fit[name].values)


def test_a_check_of_version_1_is_read_as_a_current_one() -> None:
    path = OLD / "model_check_version_1.nc"
    old, found = as_stored(path), open_netcdf(path)
    assert (old.attrs["schema_version"], found.attrs["schema_version"]) == (1, 2)
    assert check_dataset(found, "model_check") is found
    assert unknown_names(found) == []
    assert bool(found["explained"]) == (old.attrs["explained"] == "yes")
    assert found["finding"].values.tolist() == json.loads(old.attrs["findings"])
    told = old.assign_attrs(explained="no", findings='["the flow changes", "the errors are white"]')
    assert not bool(current_form(told)["explained"])
    assert current_form(told)["finding"].values.tolist()[0] == "the flow changes"
