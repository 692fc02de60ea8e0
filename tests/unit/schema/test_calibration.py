"""Stored calibrations of a model of the user: what they have to hold, who may go on with them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from synthetic_calibration import synthetic_calibration
from user_calibration import one_parameter, two_parameters

from driftwalk.core.errors import FormatError, InputError
from driftwalk.core.provenance import MANIFEST_KIND
from driftwalk.model import Study
from driftwalk.runs import read_found
from driftwalk.schema.check import check_contents
from driftwalk.schema.parameters import is_block, stored_parameters

PLACE = Path("run/calibration.nc")


def stored(calibration: xr.Dataset) -> xr.Dataset:
    return calibration.assign_attrs(study=Study().to_toml())


@pytest.mark.parametrize("make", [one_parameter, two_parameters])
def test_a_calibration_of_a_model_is_sound_under_its_own_names(make):
    found = stored(make())
    assert check_contents(found, PLACE) is found
    assert not is_block(found)


def test_the_block_is_known_however_its_dimensions_are_turned():
    turned = synthetic_calibration(points=3).transpose("force_std", "drag_coefficient", ...)
    assert is_block(turned)
    assert [one.key for one in stored_parameters(turned)] == ["drag_coefficient", "force_std_N"]


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda found: found.drop_vars("speed"), "lacks the variable 'speed'"),
        (lambda found: found.drop_vars("estimate"), "lacks the variable 'estimate'"),
        (lambda found: found.drop_attrs(deep=False).assign_attrs(kind="calibration"),
         "lacks the attribute 'study'"),
        (lambda found: found.assign(duration=((), "long")), "'duration' holds no numbers"),
        (
            lambda found: found.assign(refined_surface=("refined_speed", np.zeros(13))),
            "'refined_surface' lies on",
        ),
        (lambda found: found.assign_attrs(model=3), "'model' is not text"),
    ],
)  # fmt: skip
def test_damage_is_named(damage, message):
    with pytest.raises(FormatError, match=message):
        check_contents(damage(stored(two_parameters())), PLACE)


@pytest.mark.slow
def test_self_assembly_takes_no_calibration_of_another_model(tmp_path):
    folder = tmp_path / "run"
    folder.mkdir()
    stored(two_parameters()).to_netcdf(folder / "calibration.nc", engine="h5netcdf")
    (folder / "flow.nc").write_bytes(b"")
    (folder / "manifest.json").write_text(json.dumps({"kind": MANIFEST_KIND}))
    with pytest.raises(InputError, match="about the model tumble, and self-assembly"):
        read_found(folder).block_study()
