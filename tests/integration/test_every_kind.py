"""What the stages make passes the check of its kind, in memory and after it was stored."""

from __future__ import annotations

import pytest
import xarray as xr
from every_kind import FORMS, every_kind
from unknown_names import unknown_names

from driftwalk.core.errors import InputError
from driftwalk.schema.check import check_dataset
from driftwalk.schema.kinds import KINDS
from driftwalk.schema.stores.netcdf import open_netcdf

# What needs a search, a fit or many runs of blocks.
COSTLY = (
    *("model_calibration", "model_calibration whose summaries are hardly matched"),
    *("calibration", "calibration of one parameter"),
    *("calibration of two parameters", "model_comparison", "model_check", "recovery"),
    *("model_recovery", "fit", "fit of several flows", "fit with the angle in the state"),
    *(
        "flow_field of a fit",
        "assembly",
        "assembly_sizes",
        "kinetics",
        "outcome_posterior",
        "yield",
        "classification with blocks hidden",
        "fit with a measured flow",
        "fit with a measured series",
        "fit with modes of the flow",
        "fit of glued blocks",
        "fit of free bodies",
        "fit of a flawed recording",
        "fit that estimates the wall",
        "model_check with a measured flow",
        "model_check with a measured series",
        "model_check of a flawed recording",
    ),
)


def costly(form: str) -> list[pytest.MarkDecorator]:
    return [pytest.mark.slow] if form in COSTLY else []


def test_every_kind_is_made() -> None:
    assert {form.split()[0] for form in FORMS} == set(KINDS)


@pytest.mark.parametrize("form", [pytest.param(form, marks=costly(form)) for form in FORMS])
def test_it_is_what_its_schema_says(form: str, tmp_path) -> None:
    made = every_kind(form)
    assert made.attrs["kind"] == form.split()[0]
    assert check_dataset(made) is made
    assert [name for name in unknown_names(made) if name.startswith(("var", "dim"))] == []
    path = tmp_path / "a.nc"
    path.write_bytes(made.to_netcdf(engine="h5netcdf"))
    stored = open_netcdf(path)
    check_dataset(stored)
    xr.testing.assert_equal(stored, made)


@pytest.mark.slow
@pytest.mark.parametrize(
    "form",
    [
        *("assembly", "recovery", "sensitivity", "model_check", "model_comparison"),
        *("model_calibration", "model_recovery"),
    ],
)
def test_every_variable_of_it_is_needed(form: str) -> None:
    """Each variable that is always there is missed, and its units are looked at."""
    made = every_kind(form)
    for variable in KINDS[made.attrs["kind"]].variables:
        if variable.when:
            continue
        with pytest.raises(InputError, match=f"'{variable.name}' is missing"):
            check_dataset(made.drop_vars(variable.name))
        other = made.copy()
        other[variable.name].attrs["units"] = "furlong"
        with pytest.raises(InputError, match=f"'{variable.name}' has the units 'furlong'"):
            check_dataset(other)
