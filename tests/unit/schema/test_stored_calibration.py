"""A calibration in a file is the one in memory."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from every_kind import every_kind

from driftwalk.calibration.run import require_searchable
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.motion import motion_model
from driftwalk.schema.answers.facts import (
    calibration_parts,
    facts_of,
    fitted_value,
)
from driftwalk.schema.parameters import is_block, stored_parameters
from driftwalk.schema.stores.netcdf import open_netcdf

FORMS = ("calibration", "calibration of one parameter", "calibration of two parameters")
PROVENANCE = {"kind", "schema_version", "recording_name", "simulated_recording", "study"}


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
    assert facts_of(stored(found, tmp_path)) == facts_of(found)


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
    assert found["verdict"] != ("does not explain" if near else "explains")
    assert set(found.attrs) == PROVENANCE
    with pytest.raises(InputError, match="the calibration has no viscosity: it has drag_coeff"):
        fitted_value(found, "viscosity")


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMS[1:])
def test_a_model_of_the_user_answers_under_its_own_names(form: str) -> None:
    found = every_kind(form)
    facts = facts_of(found)
    assert set(found.attrs) == {*PROVENANCE, "model", "model_source_sha256"}
    for place, one in enumerate(stored_parameters(found)):
        assert (found["parameter"].values[place], found["unit"].values[place]) == (
            one.name,
            one.unit,
        )
        assert facts[one.key] == fitted_value(found, one.name)
        assert facts[f"{one.key}_interval"] == found["interval"].values[place].tolist()
        assert facts[f"coarse_{one.key}"] in found[one.name].values


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMS)
def test_flat_facts_and_variables_are_each_other_s_inverse(form: str) -> None:
    found = every_kind(form)
    parts = calibration_parts(facts_of(found), stored_parameters(found))
    made = xr.Dataset(parts.data, parts.coords)
    for name in made.variables:
        np.testing.assert_array_equal(made[name].values, found[name].values)
    assert parts.attrs == found.attrs


@pytest.mark.parametrize("name", ["estimate", "duration", "noise_floor", "parameter", "status"])
def test_a_parameter_with_the_name_of_an_answer_is_refused(name: str) -> None:
    model = motion_model(lambda scene, **values: None, **{name: (0.0, 1.0)})
    with pytest.raises(ConfigurationError, match=f"'{name}', a name that a calibration uses"):
        require_searchable(model)
