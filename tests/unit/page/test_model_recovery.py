"""The page on a recovery study of a motion model: its parts hold what the dataset holds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from model_recovery_worlds import VALUES, lost, made_up, made_up_recovery
from page_reading import values

from driftwalk.page.run_page import dataset_page
from driftwalk.page.sections.recovery import model_recovery_sections


@pytest.fixture(scope="module")
def found() -> xr.Dataset:
    return made_up_recovery(lost(made_up(), 3, 1, "too short"))


@pytest.fixture(scope="module")
def sections(found: xr.Dataset) -> dict[str, dict[str, Any]]:
    return {part["id"]: part for part in model_recovery_sections(found)}


def test_the_page_has_a_title_and_every_section(found: xr.Dataset) -> None:
    page = dataset_page(found)
    assert page["title"] == "Recovery study of a motion model"
    kinds = {part["id"]: part["kind"] for part in page["sections"]}
    assert "empty" not in kinds.values()
    estimates = [f"estimates-{number}" for number in (1, 2, 3)]
    assert list(kinds) == ["summary", "warnings", "errors", *estimates]


def test_the_table_has_a_row_for_each_parameter(
    found: xr.Dataset, sections: dict[str, dict[str, Any]]
) -> None:
    rows = sections["errors"]["rows"]
    assert [row[0] for row in rows] == [name.replace("_", " ") for name in VALUES]
    medians = [f"{100 * one:.1f} %" for one in found["median_error"].values]
    assert [row[2] for row in rows] == medians
    calibrated = int((found["status"] == 0).sum())
    shares = found["determined_share"].values
    assert [row[3] for row in rows] == [
        f"{round(share * calibrated)} of {calibrated}" for share in shares
    ]
    assert [row[5] for row in rows] == found["meaning"].values.tolist()


def test_every_estimate_is_drawn_once(
    found: xr.Dataset, sections: dict[str, dict[str, Any]]
) -> None:
    for index in range(3):
        drawn = [values(one["y"]) for one in sections[f"estimates-{index + 1}"]["series"]]
        shown = np.sort(np.concatenate([one[np.isfinite(one)] for one in drawn]))
        estimate = found["estimate"].values[:, index]
        assert shown == pytest.approx(np.sort(estimate[np.isfinite(estimate)]), rel=1e-6)


def test_a_recording_that_was_not_calibrated_is_said(
    sections: dict[str, dict[str, Any]],
) -> None:
    assert "1 of 12 recordings could not be calibrated: too short" in str(sections["warnings"])


def test_what_is_missing_is_said() -> None:
    assert [part["kind"] for part in model_recovery_sections(xr.Dataset())] == ["empty"]
    found = made_up_recovery().drop_vars("interval")
    kinds = {part["id"]: part["kind"] for part in model_recovery_sections(found)}
    assert (kinds["estimates-1"], kinds["errors"], kinds["summary"]) == (
        *("empty", "empty", "summary"),
    )
