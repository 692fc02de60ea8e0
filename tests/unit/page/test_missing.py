"""A dataset that lacks anything gives a page all the same, with what is missing said."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import xarray as xr
from made_up_fit import made_up_check, made_up_fit
from recovery_worlds import synthetic_recovery
from synthetic_assembly import (
    assembly_path,
    class_times,
    components,
    distribution,
    sensitivity,
    with_courses,
)
from synthetic_calibration import bundled_recording, synthetic_calibration

from driftwalk.page.sections.assembly import assembly_sections
from driftwalk.page.sections.calibration import calibration_sections
from driftwalk.page.sections.fit import fit_sections
from driftwalk.page.sections.recovery import recovery_sections
from driftwalk.page.sections.sensitivity import sensitivity_sections

PLANE = ("drag_coefficient", "force_std")


def with_excerpts(calibration: xr.Dataset) -> xr.Dataset:
    """Return a calibration with what is kept of every setting, a place for each replicate."""
    shape = tuple(calibration.sizes[name] for name in PLANE)
    walk = ((*PLANE, "excerpt_sample"), np.ones((*shape, 3)))
    place = ((*PLANE, "replicate"), np.ones((*shape, 4)))
    return calibration.assign(
        excerpt_x=walk,
        excerpt_y=walk,
        excerpt_time=("excerpt_sample", [0.0, 0.1, 0.2]),
        ks_step_length=place,
        ks_turning_angle=place,
    )


STUDY = with_courses(sensitivity(points=(3, 3)))
RECORDING = bundled_recording(rows=100)
CASES: dict[str, tuple[xr.Dataset, Callable[[xr.Dataset], list[dict[str, Any]]]]] = {
    "calibration": (
        with_excerpts(synthetic_calibration(points=5)),
        lambda one: calibration_sections(one, recording=RECORDING),
    ),
    "fit": (made_up_fit(), fit_sections),
    "check": (made_up_check(), lambda one: fit_sections(made_up_fit(), check=one)),
    "distribution": (distribution(), lambda one: assembly_sections(distribution=one)),
    "class_times": (class_times(), lambda one: assembly_sections(class_times=one)),
    "path": (assembly_path(samples=31), lambda one: assembly_sections(path=one)),
    "sensitivity": (STUDY, lambda one: sensitivity_sections(sensitivity=one)),
    "components": (
        components(STUDY),
        lambda one: sensitivity_sections(sensitivity=STUDY, components=one),
    ),
    "recovery": (synthetic_recovery(recordings=3), recovery_sections),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_any_one_variable_or_attribute_may_be_missing(name: str) -> None:
    dataset, make = CASES[name]
    whole = make(dataset)
    assert not [part for part in whole if part["kind"] == "empty" and "holds no" in part["reason"]]
    for variable in dataset.variables:
        made = make(dataset.drop_vars([variable]))
        json.dumps(made, allow_nan=False)
        assert len(made) >= 1
    for attribute in dataset.attrs:
        poorer = dataset.copy()
        del poorer.attrs[attribute]
        json.dumps(make(poorer), allow_nan=False)


@pytest.mark.parametrize("name", CASES)
def test_hostile_attributes_are_text_or_left_out(name: str) -> None:
    dataset, make = CASES[name]
    for attribute, value in dataset.attrs.items():
        if isinstance(value, str):
            json.dumps(make(dataset.assign_attrs({attribute: "</script><b>"})), allow_nan=False)
