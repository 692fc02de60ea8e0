"""The pages of a fit, its check and a recovery study hold the numbers of their datasets."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from made_up_fit import made_up_check, made_up_fit
from page_reading import numbers_of, part_of, values
from recovery_worlds import TRUTH, synthetic_recovery
from synthetic_calibration import bundled_recording

from driftwalk.likelihood.check.criteria import MISFITS
from driftwalk.page.run_page import in_chapters
from driftwalk.page.sections.check import LOOKS_FOR
from driftwalk.page.sections.fit import fit_sections
from driftwalk.page.sections.recovery import recovery_sections
from driftwalk.schema.answers.facts import facts_of
from driftwalk.schema.answers.fit import checked_parts
from driftwalk.schema.answers.parts import Table


@pytest.fixture(scope="module")
def sections() -> list[dict[str, Any]]:
    recordings = [bundled_recording(rows=300), bundled_recording(rows=200)]
    return fit_sections(
        made_up_fit(), recordings=recordings, check=made_up_check("the flow changes in time")
    )


def test_the_answer_of_a_fit_with_its_uncertainty(sections: list[dict[str, Any]]) -> None:
    part, fit = part_of(sections, "summary"), made_up_fit()
    shown = numbers_of(part)
    for label, name in (
        ("drag coefficient", "drag_coefficient"),
        ("stochastic force", "force_std_N"),
        ("noise intensity", "force_noise_intensity_N2_s"),
        ("tracking noise", "tracking_noise_m"),
    ):
        one = shown[label]
        assert one["value"] == facts_of(fit)[name]
        assert [one["low"], one["high"]] == list(facts_of(fit)[f"{name}_interval"])
        assert one["confidence"] == 0.9
    text = " ".join(part["paragraphs"])
    for words in (
        "2 recordings; 10 min; 990 of 1000 samples used; 1 % of the intervals at the wall",
        "Verdict: does not explain: The flow changes in time.",
        "KS distance of 0.05 to the real one, and of 0.02 among themselves",
    ):
        assert words in text


def test_the_warnings_of_a_fit_have_a_section(sections: list[dict[str, Any]]) -> None:
    assert part_of(sections, "warnings")["items"] == ["the block was rarely in the middle"]


def test_each_recording_has_a_section(sections: list[dict[str, Any]]) -> None:
    first, second = (part_of(sections, f"recording-1-of-{k}") for k in (1, 2))
    assert second["title"] == "The recording (2 of 2)"
    noise = numbers_of(first, "facts")["tracking noise"]
    assert (noise["value"], noise["note"]) == (3e-4, "estimated by the fit")
    assert numbers_of(second, "facts")["positions"]["value"] == 200


def test_every_flow_of_a_fit_has_a_section() -> None:
    fit = made_up_fit(flows=("on", "<b>off</b>"))
    made = fit_sections(fit)
    assert [part_of(made, f"flow-{k}")["title"] for k in (1, 2)] == [
        "The flow on",
        "The flow <b>off</b>",
    ]
    np.testing.assert_allclose(values(part_of(made, "flow-2")["u"]), fit["u"].values[1], rtol=1e-6)


def test_the_check_of_a_fit(sections: list[dict[str, Any]]) -> None:
    check = made_up_check()
    rows = part_of(sections, "check")["rows"]
    assert [[*row[:1], *row[2:]] for row in rows] == [
        ["autocorrelation", 0.5, "0.09: autocorrelation at one lag"],
        ["flow_change: failed", 0.0001, "0.01: relative change"],
    ]
    assert rows[0][1] == LOOKS_FOR["autocorrelation"]
    band, x, _ = part_of(sections, "check-innovations")["series"]
    np.testing.assert_allclose(values(band["low"]), -0.002 - 0.0196)
    np.testing.assert_allclose(values(x["y"]), check["autocorrelation"].values[0])
    place = part_of(sections, "check-place")
    np.testing.assert_allclose(values(place["value"]), check["residual_distance"], rtol=1e-6)
    assert place["limits"] == [0.0, pytest.approx(float(check["residual_distance"].max()))]
    noise = part_of(sections, "check-noise")
    off = (check["noise_ratio"] - 1.0) / 0.05
    np.testing.assert_allclose(values(noise["value"]), off, rtol=1e-5, atol=1e-6)
    assert noise["diverging"] is True
    time = part_of(sections, "check-flow-time")["series"][0]
    assert values(time["x"]).tolist() == [30.0, 90.0, 150.0, 210.0]
    np.testing.assert_allclose(values(time["high"]) - values(time["y"]), 0.0196)
    speed = part_of(sections, "check-drag-speed")["series"][0]
    np.testing.assert_allclose(values(speed["x"]), [0.01, 0.035])
    for name, unit in (("step-length", "1/m"), ("turning-angle", "1/rad")):
        part = part_of(sections, f"check-{name}")
        assert (part["y"]["label"], part["y"]["unit"]) == ("density", unit)
        simulated, real = part["series"]
        assert values(simulated["x"]).size == values(simulated["y"]).size + 1
        assert values(simulated["low"]).tolist() == [0.9] * 6
        assert values(real["y"]).tolist() == [1.0] * 6


def test_a_criterion_that_was_excused_is_marked() -> None:
    """On the page and in the answer: its p value alone would contradict the verdict."""
    check = made_up_check()
    check["failed"].values[1] = 0
    part = part_of(fit_sections(None, check=check), "check")
    table = checked_parts(made_up_fit(), check)[-1]
    assert isinstance(table, Table)
    for rows in (part["rows"], table.rows):
        assert [row[0] for row in rows] == ["autocorrelation", "flow_change: small"]
    assert "'small'" in part["note"]


def test_a_tenth_that_the_fit_absorbed_has_no_point() -> None:
    check = made_up_check()
    assert "absorbed" not in str(
        part_of(fit_sections(None, check=check), "check-flow-time")["note"]
    )
    check["flow_change"].values[1] = check["flow_change_std"].values[1] = np.nan
    part = part_of(fit_sections(None, check=check), "check-flow-time")
    assert "A tenth without a point" in part["note"]
    assert np.isnan(values(part["series"][0]["y"])[1])


def test_a_cell_beyond_chance_says_how_often_chance_gives_one() -> None:
    """The limit is a level of 95 %, so one right model in twenty has a cell beyond it."""
    note = part_of(fit_sections(None, check=made_up_check()), "check-place")["note"]
    assert "below 3.8 in 95 % of recordings" in note
    assert "no evidence against the model" in note
    assert "Chance alone stays below" not in note


def test_the_answer_comes_first_with_its_picture_and_the_next_step(
    sections: list[dict[str, Any]],
) -> None:
    fit = made_up_fit()
    made = in_chapters(sections, fit, "tank")
    chapters = [part["chapter"] for part in made]
    assert chapters[:2] == [None, None]
    assert None not in chapters[2:]
    # Each chapter is one piece, and nothing is lost.
    pieces = [
        name for name, before in zip(chapters, [0, *chapters], strict=False) if name != before
    ]
    assert len(pieces) == len(set(pieces))
    assert sorted(part["id"] for part in made) == sorted(part["id"] for part in sections)
    answer = part_of(made, "summary")
    assert part_of(made, answer["picture"])["kind"] == "flow"
    verdict = fit.assign(verdict="explains", verdict_reason=("verdict_reason", np.array([], "U1")))
    (step,) = part_of(in_chapters(sections, verdict, "tank"), "summary")["next"]
    assert "`driftwalk assemble tank -o four`" in step
    (step,) = part_of(
        in_chapters(sections, verdict.assign(verdict="does not explain"), "tank"), "summary"
    )["next"]
    assert "Do not use the numbers yet" in step


def test_every_test_of_a_check_says_what_it_looks_for() -> None:
    assert LOOKS_FOR.keys() == MISFITS.keys()


def test_a_fit_that_was_not_checked_says_so() -> None:
    made = fit_sections(made_up_fit())
    assert part_of(made, "check")["kind"] == "empty"
    assert "Verdict: not checked." in part_of(made, "summary")["paragraphs"]


def test_a_check_without_simulated_recordings_says_why() -> None:
    check = made_up_check().drop_vars(["step_length_edge", "turning_angle_edge"])
    check = check.assign_attrs(ks_distance=np.nan, ks_left_out="the steps are too few")
    made = fit_sections(made_up_fit(), check=check)
    assert "the steps are too few" in part_of(made, "check-step-length")["reason"]
    text = " ".join(part_of(made, "summary")["paragraphs"])
    assert "There is no KS distance: the steps are too few." in text
    assert "finds many faults, but not all" in text


def test_a_recovery_study_beside_its_truth() -> None:
    study = synthetic_recovery(recordings=6)
    made = recovery_sections(study)
    for name, truth in (
        ("drag_coefficient", TRUTH["drag_coefficient"]),
        ("force_std", TRUTH["force_std_N"]),
        ("tracking_noise", TRUTH["tracking_noise_m"]),
    ):
        part = part_of(made, f"estimates-{name.replace('_', '-')}")
        assert part["marks"] == [{"label": "truth", "x": None, "y": truth}]
        kept, out = part["series"][:2]
        exact = study[name].values[0, 0]
        np.testing.assert_allclose(values(kept["y"])[1:], exact[1:])
        assert np.isnan(values(kept["y"])[0])
        assert out["name"] == "10 min, angle given, left out of the summary"
        np.testing.assert_allclose(values(out["y"])[0], exact[0])
        np.testing.assert_allclose(values(kept["low"])[1:], study[f"{name}_low"].values[0, 0, 1:])
    rows = part_of(made, "errors")["rows"]
    assert len(rows) == (3 + 1) * 2 * 2, "three parameters and the flow"
    first = study.sel(parameter="drag_coefficient", duration=600.0, angle="given")
    assert rows[0][:3] == ["10 min", "given", "C_d"]
    assert rows[0][3] == f"{100 * float(first['median_absolute_error']):.1f} %"
    used = int(first["used"].sum())
    assert rows[0][7].startswith(f"{round(float(first['coverage']) * used)} of {used} (")
    assert {len(row) for row in rows} == {8}
    warnings = part_of(made, "warnings")["items"]
    at_the_wall = [text for text in warnings if "1 of 6 recordings have more than" in text]
    assert len(at_the_wall) == 4
    assert all("left out of the summary" in text for text in at_the_wall)
    shown = numbers_of(part_of(made, "summary"))
    assert shown["length needed, angle given"]["value"] == float(
        study["needed_duration"].sel(angle="given")
    )


def test_runs_that_have_just_begun_are_empty() -> None:
    assert [part["kind"] for part in fit_sections(None)] == ["empty"]
    assert [part["kind"] for part in recovery_sections(None)] == ["empty"]
