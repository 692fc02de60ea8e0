"""The classes of every setting over time on a page: the numbers of the dataset, packed and back."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
import xarray as xr
from page_reading import part_of, values
from synthetic_assembly import one_axis, outcome_classes, sensitivity, with_courses

import driftwalk as dw
from driftwalk.page.sections import sensitivity_maps as page_sensitivity_times
from driftwalk.page.sections.outcomes import cells_of
from driftwalk.page.sections.sensitivity import sensitivity_sections


@pytest.fixture(scope="module")
def study() -> xr.Dataset:
    return with_courses(sensitivity(points=(4, 3)))


def test_every_setting_has_its_numbers(study: xr.Dataset) -> None:
    found = part_of(sensitivity_sections(sensitivity=study), "l1")["over_time"]
    json.dumps(found, allow_nan=False)
    assert found["classes"] == study["class_over_time"].values.tolist()
    assert found["cells"] == [cells_of(name) for name in found["classes"]]
    np.testing.assert_array_equal(values(found["time"]), study["time"])
    np.testing.assert_array_equal(
        values(found["runs"]), study["runs"].transpose("force_std", "drag_coefficient")
    )
    count, known = values(found["count"]), values(found["reference"])
    # By hand: setting by setting, class by class, as the page has its axes.
    for row in range(3):
        for column in range(4):
            one = study.isel(drag_coefficient=column, force_std=row)
            for place, name in enumerate(found["classes"]):
                course = one["count_over_time"].sel(class_over_time=name)
                np.testing.assert_array_equal(count[row, column, place], course)
    for place, name in enumerate(found["classes"]):
        course = study["reference_over_time"].sel(class_over_time=name)
        np.testing.assert_allclose(known[place], course, atol=1e-7)
    np.testing.assert_array_equal(dw.page.decode_array(found["count"]), count)


def test_axes_in_another_order_are_the_same_map(study: xr.Dataset) -> None:
    turned = study.transpose("class_over_time", "force_std", "time", ...)
    made = [part_of(sensitivity_sections(sensitivity=one), "l1") for one in (study, turned)]
    assert made[0]["over_time"] == made[1]["over_time"]


def test_rare_classes_are_summed_with_what_is_summed_already() -> None:
    """Five blocks, a class of the dataset being "other" itself: shares add up, nothing twice."""
    names = outcome_classes(5)
    study = with_courses(sensitivity(5, points=(3, 3)))
    # The first class moves to the end, and is the sum of what the study has left out.
    listed = [*names[1:], "other"]
    count = np.roll(study["count_over_time"].values, -1, axis=-1)
    study = study.drop_vars("reference_over_time").assign_coords(class_over_time=listed)
    study["count_over_time"] = (study["count_over_time"].dims, count)
    found = part_of(sensitivity_sections(sensitivity=study), "l1")["over_time"]
    assert found["reference"] is None
    assert found["classes"][-1] == "other"
    assert found["classes"].count("other") == 1
    assert len(found["classes"]) <= 21
    assert found["cells"][-1] == []
    shares = values(found["count"])
    np.testing.assert_array_equal(shares.sum(axis=2), np.full((3, 3, 11), 1000))
    shown = [listed.index(name) for name in found["classes"][:-1]]
    exact = np.moveaxis(count[..., shown], -1, 2).swapaxes(0, 1)
    np.testing.assert_array_equal(shares[:, :, :-1], exact)


@pytest.mark.parametrize(
    ("axis", "along", "names"),
    [
        ("blocks", [3, 4, 5], ["number of blocks 3", "number of blocks 4", "number of blocks 5"]),
        ("tank_diameter", [0.25, 0.3], ["tank diameter 25 cm", "tank diameter 30 cm"]),
        ("latching", ["collision", "none"], ["latching collision", "latching none"]),
    ],
)
def test_settings_on_no_map_are_chosen_by_their_names(
    axis: str, along: list[Any], names: list[str]
) -> None:
    study = with_courses(one_axis(axis, along))
    made = sensitivity_sections(sensitivity=study)
    part = part_of(made, "times")
    assert part["kind"] == "setting_times"
    assert part["settings"] == names
    count = values(part["over_time"]["count"])
    exact = study["count_over_time"].transpose(axis, "class_over_time", "time")
    np.testing.assert_array_equal(count[0], exact)


def test_words_of_two_axes_are_one_list() -> None:
    study = sensitivity(points=(2, 3))
    both = with_courses(
        study.rename(drag_coefficient="latching").assign_coords(
            latching=np.array(["collision", "none"], dtype=object)
        )
    )
    part = part_of(sensitivity_sections(sensitivity=both), "times")
    count = values(part["over_time"]["count"])[0]
    assert len(part["settings"]) == len(count) == 6
    for place, name in enumerate(part["settings"]):
        row, column = divmod(place, 3)
        assert name.startswith(f"latching {['collision', 'none'][row]}, stochastic force ")
        one = both["count_over_time"].isel(latching=row, force_std=column)
        np.testing.assert_array_equal(count[place], one.transpose("class_over_time", "time"))


def test_of_more_than_twelve_parts_the_first_are_shown_and_the_rest_named() -> None:
    """Lines along numbers have no note of their own, to which that could be added."""
    study = sensitivity(points=(2, 3)).rename(drag_coefficient="latching")
    study = study.assign_coords(latching=np.array(["collision", "none"], dtype=object))
    blocks = np.arange(3, 17)
    many = with_courses(study).map(
        lambda one: one.expand_dims(blocks=blocks) if "latching" in one.dims else one
    )
    made = sensitivity_sections(sensitivity=many)
    assert len([part for part in made if part["id"].startswith("l1")]) == 12
    assert part_of(made, "l1-12")["note"] == "More are in the file."
    times = [part for part in made if part["kind"] == "setting_times"]
    assert len(times) == 12
    assert times[2]["title"] == "Outcome classes over time, number of blocks 5"


def test_maps_without_end_have_fewer_times(
    study: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every second time, every fifth, ... : the first and the last stay, and so do the numbers."""
    size = study["count_over_time"].size
    for most, every in ((size, 1), (size - 1, 2), (size // 4, 5), (1, 10)):
        monkeypatch.setattr(page_sensitivity_times, "MOST_COUNTS", most)
        found = part_of(sensitivity_sections(sensitivity=study), "l1")["over_time"]
        thinned = study.isel(time=slice(None, None, every))
        np.testing.assert_array_equal(values(found["time"]), thinned["time"])
        assert values(found["time"])[-1] == 300.0
        plane = ("force_std", "drag_coefficient", "class_over_time", "time")
        exact = thinned["count_over_time"].transpose(*plane)
        np.testing.assert_array_equal(values(found["count"]), exact)
