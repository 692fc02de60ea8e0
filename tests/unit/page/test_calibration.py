"""The page of a calibration holds the numbers of the dataset, and says what is missing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from page_reading import numbers_of, part_of, values
from synthetic_calibration import answered, bundled_recording, synthetic_calibration

from driftwalk.core.errors import InputError
from driftwalk.page.sections.calibration import calibration_sections
from driftwalk.page.sections.map import map_section
from driftwalk.schema.answers.verdict import Verdict, verdict_of, verdict_variables

SAMPLES = 51


@pytest.fixture(scope="module")
def calibration() -> xr.Dataset:
    """Return the synthetic calibration with excerpts, and with places for every replicate."""
    generator = np.random.default_rng(5)
    found = synthetic_calibration()
    plane = ("drag_coefficient", "force_std")
    shape = tuple(found.sizes[name] for name in plane)
    walk = generator.normal(0.0, 1e-3, (2, *shape, SAMPLES)).cumsum(axis=-1)
    places = generator.uniform(-0.01, 0.01, (2, *shape, 4))
    return found.assign(
        excerpt_x=((*plane, "excerpt_sample"), walk[0]),
        excerpt_y=((*plane, "excerpt_sample"), walk[1]),
        excerpt_time=("excerpt_sample", 0.1 * np.arange(SAMPLES)),
        ks_step_length=((*plane, "replicate"), np.abs(places[0])),
        ks_turning_angle=((*plane, "replicate"), places[1]),
    ).assign_attrs(kind="calibration", confidence=0.9, recording_pairs=17999, step_interval_s=0.1)


def on_map(calibration: xr.Dataset, name: str) -> np.ndarray:
    """Return a variable on (y, x) of the map: the drag lies along x."""
    return calibration[name].transpose("force_std", "drag_coefficient", ...).values


@pytest.fixture(scope="module")
def sections(calibration: xr.Dataset) -> list[dict[str, Any]]:
    return calibration_sections(calibration, recording=bundled_recording(rows=1000))


@pytest.mark.slow
def test_the_map_is_that_of_the_dataset(
    calibration: xr.Dataset, sections: list[dict[str, Any]]
) -> None:
    part = part_of(sections, "map")
    assert part["x"]["values"] == calibration["drag_coefficient"].values.tolist()
    assert part["y"]["values"] == calibration["force_std"].values.tolist()
    assert part["y"]["unit"] == "N"
    assert "redrawn every 16 ms" in part["y"]["label"]
    distance = on_map(calibration, "ks_distance")
    # Bit for bit.
    np.testing.assert_array_equal(values(part["value"]), distance.astype(np.float32))
    np.testing.assert_allclose(
        values(part["standard_error"]), on_map(calibration, "ks_distance_standard_error"), rtol=1e-6
    )
    status = on_map(calibration, "status")
    np.testing.assert_array_equal(values(part["status"]), status)
    assert part["statuses"] == {
        "1": "no motion (D = 1)",
        "2": "not finite",
        "4": "too few steps",
    }
    row, column = np.unravel_index(
        np.argmin(np.where((status == 0) & np.isfinite(distance), distance, 9.0)), status.shape
    )
    assert part["best"] == {
        "x": calibration["drag_coefficient"].values[column],
        "y": calibration["force_std"].values[row],
        "value": distance[row, column],
    }
    assert part["found"] == {"x": 0.39, "y": 0.61e-3}
    assert part["noise_floor"] == 0.032
    assert part["region"]["confidence"] == 0.9
    assert part["region"]["x"] == calibration["region_drag_coefficient"].values.tolist()
    refined = calibration["refined_ks_distance"].values
    np.testing.assert_allclose(values(part["refined"]["value"]), refined.T, rtol=1e-6)


def test_a_click_shows_what_is_kept_of_the_setting(
    calibration: xr.Dataset, sections: list[dict[str, Any]]
) -> None:
    cells = part_of(sections, "map")["cells"]
    for name in ("excerpt_x", "excerpt_y", "density"):
        kept = {"density": "step_density"}.get(name, name)
        exact = on_map(calibration, kept)
        assert cells[name]["step"] <= np.ptp(exact) / 2000
        np.testing.assert_allclose(
            values(cells[name]), exact, rtol=0, atol=0.5001 * cells[name]["step"]
        )
    assert values(cells["excerpt_time"]).tolist() == calibration["excerpt_time"].values.tolist()
    distance = on_map(calibration, "ks_distance_replicate")
    mean = on_map(calibration, "ks_distance")
    for name in ("ks_step_length", "ks_turning_angle"):
        found = values(cells[name])
        for index in np.ndindex(mean.shape):
            if not np.isfinite(mean[index]):
                continue
            nearest = min(range(4), key=lambda k: abs(distance[index][k] - mean[index]))
            expected = on_map(calibration, name)[index][nearest]
            assert found[index] == pytest.approx(expected, rel=1e-6)


def test_the_recording_stands_beside_the_cells(
    calibration: xr.Dataset, sections: list[dict[str, Any]]
) -> None:
    beside = part_of(sections, "map")["recording"]
    np.testing.assert_allclose(
        values(beside["density"]), calibration["recording_step_density"], rtol=1e-6
    )
    assert beside["step_length_edges"] == calibration["step_length_edge"].values.tolist()
    assert beside["turning_angle_edges"] == calibration["turning_angle_edge"].values.tolist()
    recording = bundled_recording(rows=SAMPLES)
    for name in "xy":
        np.testing.assert_allclose(
            values(beside[f"excerpt_{name}"]), recording[name].values[:, 0], rtol=1e-6
        )


def test_a_cell_without_distance_and_cause_was_not_computed(calibration: xr.Dataset) -> None:
    distance = calibration["ks_distance"].copy()
    distance[3, 4] = np.nan
    part = map_section(calibration.assign(ks_distance=distance))
    assert values(part["status"])[4, 3] == 8
    assert part["statuses"]["8"] == "not computed"
    assert np.isnan(values(part["value"])[4, 3])


def test_several_causes_are_all_named(calibration: xr.Dataset) -> None:
    status = calibration["status"].copy()
    status[5, 5] = 6
    part = map_section(calibration.assign(status=status))
    assert part["statuses"]["6"] == "not finite, too few steps"


def test_a_map_in_which_everything_failed_has_no_best_cell(calibration: xr.Dataset) -> None:
    part = map_section(calibration.assign(status=calibration["status"] * 0 + 2))
    assert part["best"] is None


def test_the_summary_has_the_answer_with_its_uncertainty(
    sections: list[dict[str, Any]],
) -> None:
    part = part_of(sections, "summary")
    shown = numbers_of(part)
    drag, force = shown["drag coefficient"], shown["stochastic force"]
    assert (drag["value"], drag["low"], drag["high"]) == (0.39, 0.34, 0.44)
    assert (force["value"], force["low"], force["high"]) == (0.61e-3, 0.53e-3, 0.70e-3)
    assert drag["confidence"] == 0.9
    assert force["note"] == "redrawn every 16 ms"
    assert shown["noise intensity"]["value"] == pytest.approx(0.61e-3**2 * 0.016)
    text = " ".join(part["paragraphs"])
    assert text.startswith("The recording was simulated: it is not a measurement.")
    for words in (
        "C_d = 0.39 (90 % interval 0.34 to 0.44)",
        "σ_F = 0.61 mN (90 % interval 0.53 mN to 0.7 mN), redrawn every 16 ms",
        "289 settings",
        "4 runs each",
        "17999 pairs of steps of 100 ms",
        "1.28 times it.",
    ):
        assert words in text


@pytest.mark.parametrize(
    ("verdict", "words"),
    [
        (verdict_of([], []), "explains. A small distance does not prove that the model is right."),
        (verdict_of(["D is far"], []), "does not explain: D is far."),
        (None, "not checked: it takes a refined map and a bootstrap."),
    ],
)
def test_the_verdict_is_the_stored_one(
    calibration: xr.Dataset, verdict: Verdict | None, words: str
) -> None:
    plain = calibration.drop_vars(["verdict", "verdict_reason"], errors="ignore")
    made = calibration_sections(
        plain if verdict is None else plain.assign(verdict_variables(verdict))
    )
    assert f"Verdict: {words}" in " ".join(part_of(made, "summary")["paragraphs"])


def test_a_real_recording_is_not_called_simulated(calibration: xr.Dataset) -> None:
    made = calibration_sections(calibration.assign_attrs(simulated_recording="no"))
    assert "simulated:" not in " ".join(part_of(made, "summary")["paragraphs"])


def test_warnings_of_the_calibration_are_shown(calibration: xr.Dataset) -> None:
    texts = ["the flow is thin", "<img src=x onerror=alert(1)>"]
    made = calibration_sections(answered(calibration, {"warnings": texts}))
    assert part_of(made, "warnings")["items"] == texts


def test_profiles_go_through_the_optimum(
    calibration: xr.Dataset, sections: list[dict[str, Any]]
) -> None:
    for name, other, best in (
        ("drag_coefficient", "force_std", 0.61e-3),
        ("force_std", "drag_coefficient", 0.39),
    ):
        part = part_of(sections, f"profile-{name.replace('_', '-')}")
        line = calibration.sel({other: best}, method="nearest")
        mean = next(one for one in part["series"] if one["style"] == "line")
        assert values(mean["x"]).tolist() == calibration[name].values.tolist()
        exact, error = (line[key].values for key in ("ks_distance", "ks_distance_standard_error"))
        np.testing.assert_allclose(values(mean["y"]), exact)
        np.testing.assert_allclose(values(mean["low"]), exact - error)
        np.testing.assert_allclose(values(mean["high"]), exact + error)
        each = next(one for one in part["series"] if one["style"] == "points")
        replicates = line["ks_distance_replicate"].transpose(name, "replicate").values
        np.testing.assert_allclose(values(each["y"]), replicates.ravel(), rtol=1e-6)
        marks = {mark["label"]: mark for mark in part["marks"]}
        assert marks["noise floor"] == {"label": "noise floor", "x": None, "y": 0.032}
        assert marks["optimum"]["y"] == 0.041


def test_the_bootstrap_and_the_closed_region(
    calibration: xr.Dataset, sections: list[dict[str, Any]]
) -> None:
    part = part_of(sections, "bootstrap")
    cloud, region = part["series"]
    np.testing.assert_allclose(
        values(cloud["x"]), calibration["bootstrap_drag_coefficient"], rtol=1e-6
    )
    np.testing.assert_allclose(values(cloud["y"]), calibration["bootstrap_force_std"], rtol=1e-6)
    assert values(region["x"])[0] == values(region["x"])[-1]
    assert len(values(region["x"])) == calibration.sizes["region_vertex"] + 1
    assert part["marks"] == [{"label": "estimate", "x": 0.39, "y": 0.61e-3}]


@pytest.mark.slow
def test_halves_are_shown_where_they_are(calibration: xr.Dataset) -> None:
    assert part_of(calibration_sections(calibration), "validation")["kind"] == "empty"
    halves = {
        "first_half_drag_coefficient": 0.4,
        "first_half_force_std_N": 6e-4,
        "second_half_ks_distance": 0.05,
        "second_half_noise_floor": 0.03,
    }
    made = calibration_sections(answered(calibration, halves))
    rows = dict(part_of(made, "validation")["rows"])
    assert rows["σ_F (mN), first half"] == pytest.approx(0.6)
    assert rows["KS distance to the second half"] == 0.05
    assert "0.05 from the second" in " ".join(part_of(made, "summary")["paragraphs"])


def test_without_a_bootstrap_there_is_no_interval_and_that_is_said(
    calibration: xr.Dataset,
) -> None:
    names = [name for name in calibration.variables if str(name).startswith(("boot", "region"))]
    bare = calibration.drop_vars([*names, "interval"])
    made = calibration_sections(bare)
    assert part_of(made, "bootstrap")["kind"] == "empty"
    assert part_of(made, "map")["region"] is None
    assert "C_d = 0.39 (no interval)" in " ".join(part_of(made, "summary")["paragraphs"])


def test_what_is_missing_costs_only_its_section(calibration: xr.Dataset) -> None:
    made = calibration_sections(calibration.drop_vars("ks_distance"))
    reason = "the calibration holds no ks_distance"
    assert [part_of(made, id)["reason"] for id in ("map", "profiles")] == [reason, reason]
    assert part_of(made, "bootstrap")["kind"] == "lines"


def test_a_fault_of_the_program_is_not_swallowed(
    calibration: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*arguments: object) -> None:
        raise AttributeError("a fault")

    monkeypatch.setattr("driftwalk.page.sections.calibration.map_section", fail)
    with pytest.raises(AttributeError, match="a fault"):
        calibration_sections(calibration)


def test_no_map_at_all_is_refused() -> None:
    with pytest.raises(InputError, match="holds no ks_distance"):
        map_section(xr.Dataset(attrs={"kind": "calibration"}))
