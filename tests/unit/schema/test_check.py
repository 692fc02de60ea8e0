"""What a dataset has to be to pass the check of its kind, and what is said where it is not."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from unknown_names import unknown_names

from driftwalk.core.errors import FormatError, InputError
from driftwalk.schema import build_dataset, check_dataset, described
from driftwalk.schema.check import check_contents
from driftwalk.schema.description import Variable
from driftwalk.schema.stores.netcdf import netcdf_bytes, open_netcdf
from driftwalk.schema.trajectory import build_steps, require_increasing


def steps() -> xr.Dataset:
    return build_steps([0.01, 0.02], [0.1, -0.2], time=[0.0, 0.1])


def map_of(*axes: str) -> xr.Dataset:
    """Return Sobol' indices by any outputs."""
    names = ("first_order", "total_order")
    parts = [f"{name}{end}" for name in names for end in ("", "_half_width", "_corrected")]
    shape = (2,) * len(axes)
    return build_dataset(
        "sobol_indices",
        {
            **{name: ((*axes, "input"), np.zeros((*shape, 3))) for name in parts},
            **{name: (axes, np.zeros(shape)) for name in ("variance", "noise_share")},
        },
        {"input": ("input", np.array(["a", "b", "c"], dtype=object))},
        {
            **{"samples": 8, "confidence": 0.9, "seed": 1},
            **{"pure_noise_first_order_half_width": 0.5, "pure_noise_total_order": 1.0},
        },
    )


def test_a_sound_dataset_comes_back() -> None:
    found = steps()
    assert check_dataset(found, "steps") is found
    # Variables and attributes of one's own do not matter.
    assert check_dataset(found.assign(mine=("step", [1, 2])).assign_attrs(mine="yes"))


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda one: one.drop_attrs(deep=False), "not a dataset of driftwalk: it has no attribute"),
        (lambda one: one.assign_attrs(kind="paces"), "no kind of dataset is called 'paces': there"),
        (
            lambda one: one.assign_attrs(schema_version=9),
            "has version 9, and this driftwalk reads 1",
        ),
        (lambda one: one.drop_vars("turning_angle"), "the variable 'turning_angle' is missing"),
        (lambda one: one.rename_dims(step="pace"), "lies on (pace), expected (step)"),
        (
            lambda one: one.assign(step_length=("step", ["a", "b"], {"units": "m"})),
            "'step_length' holds <U1, expected numbers",
        ),
        (
            lambda one: one.assign(step_length=one["step_length"].assign_attrs(units="mm")),
            "'step_length' has the units 'mm', expected 'm'",
        ),
    ],
)
def test_what_is_wrong_is_said_in_one_sentence(spoil, said: str) -> None:
    with pytest.raises(InputError, match=re.escape(said)) as caught:
        check_dataset(spoil(steps()))
    assert "\n" not in str(caught.value)


def test_another_kind_is_refused() -> None:
    with pytest.raises(InputError, match="not of the kind trajectory, but steps"):
        check_dataset(steps(), "trajectory")


@pytest.mark.parametrize("axes", [(), ("output",), ("tank", "output")])
def test_axes_of_a_map_are_free(axes: tuple[str, ...]) -> None:
    assert map_of(*axes)["first_order"].dims == (*axes, "input")


def test_free_axes_stand_in_front() -> None:
    found = map_of("output")
    turned = found.assign(first_order=found["first_order"].transpose("input", "output"))
    with pytest.raises(InputError, match=r"lies on \(input, output\), expected \(\.\.\., input\)"):
        check_dataset(turned)


def test_a_dimension_in_brackets_may_be_absent() -> None:
    u = Variable("u", "[time] y x", "m s-1", "flow velocity x")
    assert u.lies_on(("y", "x"))
    assert u.lies_on(("time", "y", "x"))
    assert not u.lies_on(("x", "y"))
    assert not u.lies_on(("y",))


def test_units_names_and_flags_are_put_on() -> None:
    bare = steps()
    for name in bare.variables:
        bare[name].attrs = {}
    found = described(bare)
    assert found["step_length"].attrs == {"units": "m", "long_name": "step length"}
    # The dataset that was given stays as it was.
    assert bare["step_length"].attrs == {}


def test_names_that_no_schema_has_are_found() -> None:
    own = steps().assign(mine=("turn", [1])).assign_attrs(by="me")
    assert unknown_names(own) == ["variable mine", "dimension turn", "attribute by"]
    assert unknown_names(map_of("tank")) == []


@pytest.mark.parametrize("version", [0, 2, "one"])
def test_a_file_of_another_version_is_refused_in_words(version: int | str, tmp_path: Path) -> None:
    other = steps().assign_attrs(schema_version=version)
    said = f"is of another schema version: its steps has version {version}, and this driftwalk"
    with pytest.raises(FormatError, match=said):
        check_contents(other, Path("a.nc"))
    path = tmp_path / "a.nc"
    path.write_bytes(netcdf_bytes(other))
    with pytest.raises(FormatError, match=said) as caught:
        open_netcdf(path)
    assert caught.value.path == path


def test_unsigned_times_that_go_backwards_are_refused() -> None:
    with pytest.raises(InputError, match="time does not increase at sample 2"):
        require_increasing(np.array([0, 2, 1, 3], np.uint64))


def test_a_file_of_another_program_need_not_state_a_version(tmp_path: Path) -> None:
    other = steps()
    del other.attrs["schema_version"]
    (tmp_path / "a.nc").write_bytes(netcdf_bytes(other))
    assert open_netcdf(tmp_path / "a.nc").equals(other)
    with pytest.raises(InputError, match="the attribute 'schema_version' is missing"):
        check_dataset(other)
