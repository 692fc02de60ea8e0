"""The page on compared motion models: its tables and chart hold what the dataset holds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from every_kind import every_kind

from driftwalk.page.run_page import dataset_page
from driftwalk.page.sections.motion_models import model_sections


@pytest.fixture(scope="module")
def comparison() -> xr.Dataset:
    return every_kind("model_comparison")


@pytest.fixture(scope="module")
def sections(comparison: xr.Dataset) -> dict[str, dict[str, Any]]:
    return {part["id"]: part for part in model_sections(comparison)}


@pytest.mark.slow
def test_the_page_has_a_title_and_every_section(comparison: xr.Dataset) -> None:
    page = dataset_page(comparison)
    assert page["title"] == "Comparison of motion models"
    kinds = {part["id"]: part["kind"] for part in page["sections"]}
    assert "empty" not in kinds.values()
    assert list(kinds) == [
        *("summary", "warnings", "ranking", "scores", "verdicts", "aspects", "checks", "values"),
    ]


@pytest.mark.slow
def test_the_summary_says_what_was_found(
    comparison: xr.Dataset, sections: dict[str, dict[str, Any]]
) -> None:
    for text in comparison["finding"].values:
        assert f"{text}." in sections["summary"]["paragraphs"]
    assert sections["summary"]["numbers"][0]["value"] == float(comparison["score"][0])


@pytest.mark.slow
def test_the_ranking_has_a_row_for_each_model(
    comparison: xr.Dataset, sections: dict[str, dict[str, Any]]
) -> None:
    rows = sections["ranking"]["rows"]
    assert [row[0] for row in rows] == comparison["model"].values.tolist()
    scores = [float(row[2].split(" ± ")[0]) for row in rows]
    assert scores == pytest.approx(comparison["score"].values, abs=0.005)
    walks = [row[-1] == "a walk of steps" for row in rows]
    assert walks == comparison["baseline"].values.tolist()


@pytest.mark.slow
def test_summaries_have_a_table_of_the_models_that_were_asked(comparison: xr.Dataset) -> None:
    asked = ~comparison["baseline"].values.astype(bool)
    first = asked & (np.cumsum(asked) == 1)

    def of_asked(*values: float) -> tuple[str, np.ndarray]:
        column = np.full(asked.size, np.nan)
        column[asked] = values
        return "model", column

    matched = comparison.assign(
        asked=("model", asked),
        named=("model", first),
        discrepancy=of_asked(101.0, 812.0),
        discrepancy_median=of_asked(99.0, 98.0),
        discrepancy_q95=of_asked(140.0, 141.0),
        deviance=of_asked(-400.0, 300.0),
    )
    (table,) = (part for part in model_sections(matched) if part["id"] == "summaries")
    names = comparison["model"].values[asked]
    assert table["rows"] == [
        [names[0], 101.0, 99.0, 140.0, 0.0, "yes"],
        [names[1], 812.0, 98.0, 141.0, 700.0, "no"],
    ]


@pytest.mark.slow
def test_the_aspects_end_with_the_recording_itself(
    comparison: xr.Dataset, sections: dict[str, dict[str, Any]]
) -> None:
    rows = sections["aspects"]["rows"]
    assert len(rows) == comparison.sizes["model"] + 2
    assert rows[-2][1:] == comparison["own_distance"].values.tolist()
    assert rows[0][1:] == comparison["held_out_distance"].values[0].tolist()


@pytest.mark.slow
def test_the_values_are_those_of_each_model_alone(
    comparison: xr.Dataset, sections: dict[str, dict[str, Any]]
) -> None:
    rows = sections["values"]["rows"]
    assert len(rows) == int(np.isfinite(comparison["estimate"].values).sum())
    assert {row[0] for row in rows} == {"inertial", "active+wall"}


@pytest.mark.slow
def test_a_part_that_is_missing_costs_its_section(comparison: xr.Dataset) -> None:
    made = model_sections(comparison.drop_vars("check_recorded"))
    kinds = {part["id"]: part["kind"] for part in made}
    assert kinds["checks"] == "empty"
    assert kinds["ranking"] == "table"
