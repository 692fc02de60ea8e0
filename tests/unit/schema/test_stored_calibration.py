"""A calibration in a file is the one in memory, and one of an earlier version is read as a current
one."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from every_kind import every_kind

import driftwalk as dw
from driftwalk.calibration.refuse import require_searchable
from driftwalk.core.errors import ConfigurationError, FormatError, InputError
from driftwalk.motion import motion_model
from driftwalk.page.run_page import dataset_page
from driftwalk.schema import check_dataset
from driftwalk.schema.answers.calibration_facts import (
    calibration_facts,
    calibration_parts,
    facts_of,
)
from driftwalk.schema.answers.fit_facts import fitted_value
from driftwalk.schema.calibration import is_block, stored_parameters
from driftwalk.schema.check import unknown_names
from driftwalk.schema.earlier import current_form
from driftwalk.schema.stores.netcdf import open_netcdf

OLD = Path(__file__).resolve().parents[2] / "data" / "old_datasets"
FILES = ("calibration_version_1.nc", "calibration_of_a_function_version_1.nc")
FORMS = ("calibration", "calibration of one parameter", "calibration of two parameters")
PROVENANCE = {"kind", "schema_version", "recording_name", "simulated_recording", "study"}


def as_stored(path: Path) -> xr.Dataset:
    """Return a file as plain xarray reads it, without driftwalk."""
    with xr.open_dataset(path, engine="h5netcdf") as dataset:
        return dataset.load()


def stored(dataset: xr.Dataset, folder: Path) -> xr.Dataset:
    path = folder / "calibration.nc"
    path.write_bytes(bytes(dataset.to_netcdf(engine="h5netcdf")))
    return open_netcdf(path)


def test_a_model_with_the_block_s_parameters_is_not_the_block() -> None:
    dims = ("drag_coefficient", "force_std")
    found = xr.Dataset({"ks_distance": (dims, np.ones((2, 3)))}, attrs={"kind": "calibration"})
    assert is_block(found)
    assert not is_block(found.assign_attrs(model="ode_model"))


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMS)
def test_what_is_stored_is_what_is_in_memory(form: str, tmp_path: Path) -> None:
    found = every_kind(form)
    xr.testing.assert_identical(stored(found, tmp_path), found)
    assert calibration_facts(stored(found, tmp_path)) == calibration_facts(found)


@pytest.mark.slow
def test_the_answer_has_units_and_a_verdict() -> None:
    found = every_kind("calibration")
    assert dict(zip(found["parameter"].values, found["unit"].values, strict=True)) == {
        "drag_coefficient": "1",
        "force_std": "N",
    }
    low, high = (found["interval"].sel(bound=bound) for bound in ("lower", "upper"))
    assert ((low <= found["estimate"]) & (found["estimate"] <= high)).all()
    every = found["force_interval"]
    assert every.attrs["units"] == "s"
    assert found["force_noise_intensity"] == pytest.approx(
        fitted_value(found, "force_std") ** 2 * float(every)
    )
    ratio = float(found["optimum_ks_distance"] / found["noise_floor"])
    assert found["distance_to_floor_ratio"] == pytest.approx(ratio)
    upper = float(found["noise_floor_upper"])
    near = found["optimum_ks_distance"] <= max(2.0 * float(found["noise_floor"]), upper)
    assert found["explained"].dtype == bool
    assert bool(found["explained"]) == bool(near)
    assert any("does not explain" in text for text in found["warning"].values) != bool(near)
    assert set(found.attrs) == PROVENANCE
    with pytest.raises(InputError, match="the calibration has no viscosity: it has drag_coeff"):
        fitted_value(found, "viscosity")


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMS[1:])
def test_a_model_of_the_user_answers_under_its_own_names(form: str) -> None:
    found = every_kind(form)
    facts = calibration_facts(found)
    assert set(found.attrs) == {*PROVENANCE, "model", "model_source_sha256"}
    for place, one in enumerate(stored_parameters(found)):
        assert (found["parameter"].values[place], found["unit"].values[place]) == (
            one.name,
            one.unit,
        )
        assert facts[one.key] == fitted_value(found, one.name)
        assert facts[f"{one.key}_interval"] == found["interval"].values[place].tolist()
        assert facts[f"coarse_{one.key}"] in found[one.name].values


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("name", FILES)
def test_version_1_is_read_as_a_current_one(name: str) -> None:
    old, found = as_stored(OLD / name), open_netcdf(OLD / name)
    assert (old.attrs["schema_version"], found.attrs["schema_version"]) == (1, 3)
    assert check_dataset(found, "calibration") is found
    assert unknown_names(found) == []
    assert Path(found.encoding["source"]) == OLD / name
    for variable in old.variables:
        np.testing.assert_array_equal(found[variable].values, old[variable].values)
    xr.testing.assert_identical(current_form(old), found)


@pytest.mark.parametrize("form", FORMS)
def test_version_2_had_as_many_replicates_of_every_setting(form: str) -> None:
    counts = ["replicate_count", "refined_replicate_count"]
    old = every_kind(form).drop_vars(counts).assign_attrs(schema_version=2)
    found = current_form(old)
    assert check_dataset(found, "calibration") is found
    for prefix in ("", "refined_"):
        most = found[f"{prefix}ks_distance_replicate"].shape[-1]
        assert (found[f"{prefix}replicate_count"] == most).all()


@pytest.mark.slow
@pytest.mark.parametrize("name", FILES)
def test_nothing_that_version_1_said_is_lost(name: str) -> None:
    old, facts = as_stored(OLD / name), facts_of(open_netcdf(OLD / name))
    for key, value in old.attrs.items():
        if key == "warnings":
            assert facts[key] == json.loads(value)
        elif key != "schema_version":
            assert np.atleast_1d(facts[key]).tolist() == np.atleast_1d(value).tolist(), key


@pytest.mark.parametrize(("ratio", "upper", "explained"), [(1.9, 0.0, True), (2.1, 0.0, False)])
def test_the_verdict_of_version_1_is_that_of_its_numbers(
    ratio: float, upper: float, explained: bool
) -> None:
    old = as_stored(OLD / FILES[0])
    said = {"ks_distance": ratio * old.attrs["noise_floor"], "noise_floor_upper": upper}
    assert bool(current_form(old.assign_attrs(said))["explained"]) == explained
    far_but_usual = old.assign_attrs({**said, "noise_floor_upper": 1.0})
    assert bool(current_form(far_but_usual)["explained"])


@pytest.mark.slow
def test_a_calibration_from_the_beginning_of_version_1_is_read() -> None:
    """The verdict's numbers were not among the first attributes, nor were the halves."""
    old = as_stored(OLD / FILES[0])
    for key in list(old.attrs):
        if key.startswith(("first_half", "second_half", "noise_floor_upper", "far_")):
            del old.attrs[key]
    found = current_form(old)
    assert not {"explained", "first_half_estimate", "noise_floor_upper"} & set(found.variables)
    assert fitted_value(found, "force_std") == old.attrs["force_std_N"]


@pytest.mark.slow
@pytest.mark.parametrize("lost", ["drag_coefficient", "force_std_N_interval", "warnings", "study"])
def test_version_1_without_its_answer_is_damaged(lost: str, tmp_path: Path) -> None:
    old = as_stored(OLD / FILES[0])
    del old.attrs[lost]
    path = tmp_path / "calibration.nc"
    path.write_bytes(bytes(old.to_netcdf(engine="h5netcdf")))
    with pytest.raises(FormatError, match="damaged: its calibration of schema version 1") as caught:
        open_netcdf(path)
    assert caught.value.path == path


@pytest.mark.slow
def test_stages_and_pages_take_version_1_as_xarray_reads_it() -> None:
    old, found = as_stored(OLD / FILES[0]), open_netcdf(OLD / FILES[0])
    options = {"like": dw.tank30_recording().isel(time=slice(0, 600)), "flow": dw.tank30_flow()}
    both = [dw.simulate(one, **options) for one in (old, found)]
    xr.testing.assert_identical(*both)
    pages = [json.dumps(dataset_page(one)["sections"]) for one in (old, found)]
    assert pages[0] == pages[1]


@pytest.mark.parametrize("form", FORMS)
def test_flat_facts_and_variables_are_each_other_s_inverse(form: str) -> None:
    found = every_kind(form)
    parts = calibration_parts(calibration_facts(found), stored_parameters(found))
    made = xr.Dataset(parts.data, parts.coords)
    for name in made.variables:
        np.testing.assert_array_equal(made[name].values, found[name].values)
    assert parts.attrs == found.attrs


@pytest.mark.parametrize("name", ["estimate", "duration", "noise_floor", "parameter", "status"])
def test_a_parameter_with_the_name_of_an_answer_is_refused(name: str) -> None:
    model = motion_model(lambda scene, **values: None, **{name: (0.0, 1.0)})
    with pytest.raises(ConfigurationError, match=f"'{name}', a name that a calibration uses"):
        require_searchable(model)
