"""The page on a calibration of many parameters: its tables hold what the dataset holds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from every_kind import every_kind

from driftwalk.page.run_page import dataset_page
from driftwalk.page.sections.motion_models import model_calibration_sections


@pytest.fixture(scope="module")
def found() -> xr.Dataset:
    return every_kind("model_calibration")


@pytest.fixture(scope="module")
def sections(found: xr.Dataset) -> dict[str, dict[str, Any]]:
    return {part["id"]: part for part in model_calibration_sections(found)}


@pytest.mark.slow
def test_the_page_has_a_title_and_every_section(found: xr.Dataset) -> None:
    page = dataset_page(found)
    assert page["title"] == "Calibration of a motion model"
    kinds = {part["id"]: part["kind"] for part in page["sections"]}
    assert "empty" not in kinds.values()
    assert list(kinds) == ["summary", "warnings", "values", "draws", "aspects", "checks"]


@pytest.mark.slow
def test_the_values_have_a_row_for_each_parameter(
    found: xr.Dataset, sections: dict[str, dict[str, Any]]
) -> None:
    rows = sections["values"]["rows"]
    assert [row[0] for row in rows] == found["parameter"].values.tolist()
    known = [row[3] == "yes" for row in rows]
    assert known == [row[1] != "not determined" for row in rows]
    assert known == found["determined"].values.tolist()
    assert all(row[2].count(" to ") == 1 for row in rows)


@pytest.mark.slow
def test_no_interval_is_a_dash(found: xr.Dataset) -> None:
    open_values = found.assign(interval=np.nan * found["interval"])
    (values,) = (part for part in model_calibration_sections(open_values) if part["id"] == "values")
    assert [row[2] for row in values["rows"]] == ["–"] * 3


@pytest.mark.slow
def test_the_draws_rise_to_one_about_the_estimate(
    found: xr.Dataset, sections: dict[str, dict[str, Any]]
) -> None:
    drawn = sections["draws"]["series"]
    assert [one["name"] for one in drawn] == found["parameter"].values.tolist()


@pytest.mark.slow
def test_the_aspects_have_the_distances(
    found: xr.Dataset, sections: dict[str, dict[str, Any]]
) -> None:
    rows = sections["aspects"]["rows"]
    assert [row[1] for row in rows] == found["held_out_distance"].values.tolist()
    assert [row[3] for row in rows] == found["own_distance"].values.tolist()
