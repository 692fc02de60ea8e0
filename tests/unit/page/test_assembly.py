"""The pages of self-assembly and its sensitivity hold the numbers of their datasets."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
import xarray as xr
from page_reading import numbers_of, part_of, values
from synthetic_assembly import (
    ARENA,
    assembly_path,
    class_times,
    components,
    distribution,
    one_axis,
    sensitivity,
)

from driftwalk.page.sections.assembly import assembly_sections, l1_and_chance
from driftwalk.page.sections.outcomes import cells_of, sizes_section
from driftwalk.page.sections.replay import MOST_POSES
from driftwalk.page.sections.sensitivity import sensitivity_sections
from driftwalk.plot.parts.outcome_classes import class_cells


def made_up_assembly(path: xr.Dataset) -> xr.Dataset:
    """Return what `assembly` says of the runs of a path: two blocks join at 60 s, and so on."""
    runs, blocks = path.sizes["run"], path.sizes["block"]
    time = np.array([[60.0 * k + 20.0 * run for k in range(1, blocks)] for run in range(runs)])
    return xr.Dataset(
        {
            "event_count": ("run", np.full(runs, blocks - 1)),
            "event_time": (("run", "event"), time),
            "event_block": (("run", "event", "side"), np.tile([0, 1], (runs, blocks - 1, 1))),
            "event_class": (("run", "event"), np.tile(np.arange(blocks - 1), (runs, 1))),
            "drag_coefficient": ("run", np.full(runs, 0.45)),
            "force_std": ("run", np.full(runs, 0.55e-3)),
        },
        coords={
            "run": np.arange(runs),
            "block": np.arange(blocks),
            "class": np.array(["2+1+1", "I3+1", "I"], dtype=object),
        },
        attrs={"kind": "assembly", "drawn": "drag_coefficient force_std flow"},
    )


@pytest.fixture(scope="module")
def sections() -> list[dict[str, Any]]:
    path = assembly_path()
    found = distribution().assign_attrs(duration_s=300.0, force_interval_s=0.016, left_out=3)
    return assembly_sections(
        distribution=found,
        distribution_drawn=distribution(seed=2),
        class_times=class_times(),
        assembly=made_up_assembly(path),
        assembly_drawn=made_up_assembly(path),
        path=path,
    )


def test_warnings_of_the_fit_stand_on_the_page_of_what_was_simulated_from_it() -> None:
    said = "of the fit: does not explain: the flow changes"
    found = distribution().assign_attrs(warnings=json.dumps([said]), left_out=3)
    items = part_of(assembly_sections(distribution=found), "warnings")["items"]
    assert items[0] == said
    assert len(items) == 2


def test_shares_and_intervals_are_those_of_both_distributions(
    sections: list[dict[str, Any]],
) -> None:
    part = part_of(sections, "classes")
    assert [one["name"] for one in part["series"]] == ["parameters found", "parameters drawn"]
    for series, seed in zip(part["series"], (1, 2), strict=True):
        found = distribution(seed=seed)
        items = {item["class"]: item for item in series["items"]}
        assert list(items) == found["class"].values.tolist()
        for name, item in items.items():
            row = found.sel({"class": name})
            assert item["count"] == int(row["count"])
            for key, variable in (
                ("share", "proportion"),
                ("low", "interval_low"),
                ("high", "interval_high"),
            ):
                assert item[key] == float(row[variable])
    assert part["confidence"] == 0.95
    assert part["runs"] == 1000


def test_sketches_are_the_cells_of_the_shapes() -> None:
    assert cells_of("T") == [[0, 1], [1, 0], [1, 1], [2, 1]]
    assert cells_of("L3+1") == class_cells("L3+1").tolist()
    assert cells_of("xx/xx") == cells_of("O")
    assert cells_of("<script>") == []


def test_every_block_of_a_class_has_its_cell(sections: list[dict[str, Any]]) -> None:
    for item in part_of(sections, "classes")["series"][0]["items"]:
        assert len(item["cells"]) == 4
        assert item["cells"] == class_cells(item["class"]).tolist()


def test_of_many_classes_the_rare_ones_are_summed() -> None:
    found = distribution(7)
    part = part_of(assembly_sections(distribution=found), "classes")
    items = part["series"][0]["items"]
    assert len(items) <= 21
    assert items[-1]["class"] == "other"
    assert items[-1]["cells"] == []
    assert sum(item["count"] for item in items) == 1000
    assert sum(item["share"] for item in items) == pytest.approx(1.0)
    assert part["series"][0]["name"] == "runs"


def test_the_words_have_the_numbers_and_their_uncertainty(sections: list[dict[str, Any]]) -> None:
    part = part_of(sections, "summary")
    text, facts = " ".join(part["paragraphs"]), distribution().attrs
    assert "4 blocks were simulated in 1000 runs of 5 min" in text
    assert "C_d = 0.45 and σ_F = 0.55 mN redrawn every 16 ms" in text
    share = f"{100 * facts['complete']:.3g} % ({100 * facts['complete_low']:.3g} % to "
    assert share in text
    assert "no recording has settled" in text
    complete = numbers_of(part)["complete: one assembly"]
    assert (complete["value"], complete["low"], complete["high"]) == tuple(
        facts[name] for name in ("complete", "complete_low", "complete_high")
    )
    assert part_of(sections, "warnings")["items"] == [
        "3 runs (parameters found) broke down and are left out; use a smaller time step"
    ]


def test_how_far_the_two_sets_are_apart(sections: list[dict[str, Any]]) -> None:
    """The distance by definition; the average by chance beside simulated pairs, within 5 %."""
    first, second = distribution(), distribution(seed=2)
    exact = float(np.abs(first["proportion"] - second["proportion"]).sum())
    pooled = (first["proportion"].values + second["proportion"].values) / 2
    drawn = np.random.default_rng(3).multinomial(1000, pooled, size=(2, 4000)) / 1000
    by_chance = np.abs(drawn[0] - drawn[1]).sum(axis=1).mean()
    apart, chance = l1_and_chance(first, second)
    assert apart == pytest.approx(exact)
    assert chance == pytest.approx(by_chance, rel=0.05)
    text = " ".join(part_of(sections, "summary")["paragraphs"])
    assert f"is {exact:.3g} (0: identical, 2: nothing in common); by chance alone" in text


def test_drawn_parameters_are_named() -> None:
    drawn = distribution(seed=2).assign_attrs(drawn="drag_coefficient force_std flow")
    made = assembly_sections(distribution=distribution(), distribution_drawn=drawn)
    text = " ".join(part_of(made, "summary")["paragraphs"])
    assert "its own drag coefficient, stochastic force and flow, drawn from" in text


def test_classes_over_time(sections: list[dict[str, Any]]) -> None:
    part, times = part_of(sections, "class-times"), class_times()
    assert values(part["time"]).tolist() == times["time"].values.tolist()
    for one in part["classes"]:
        exact = times["proportion"].sel({"class": one["class"]}).values
        np.testing.assert_allclose(values(one["share"]), exact, rtol=1e-6)
    survival = part_of(sections, "survival")
    for one, name in zip(survival["series"], ("first_contact", "completion"), strict=True):
        np.testing.assert_allclose(values(one["y"]), times[name].values, rtol=1e-6)


def test_the_replay_has_the_poses_and_what_joined_when(sections: list[dict[str, Any]]) -> None:
    part, path = part_of(sections, "replay"), assembly_path()
    assert part["side"] == 0.03
    assert part["arena"] == json.loads(ARENA)
    np.testing.assert_allclose(values(part["time"]), path["time"].values, atol=1e-4)
    for index, run in enumerate(part["runs"]):
        one = path.isel(run=index).transpose("block", "time")
        assert run["name"] == f"run {index}"
        for name in "xy":
            np.testing.assert_allclose(
                values(run[name]), one[name].values, rtol=0, atol=0.5001 * run[name]["step"]
            )
        turned = np.angle(np.exp(1j * (values(run["theta"]) - one["theta"].values)))
        assert np.abs(turned).max() < 1.01e-3
        np.testing.assert_array_equal(values(run["assembly"]), one["assembly"].values)
        times = [60.0 * k + 20.0 * index for k in (1, 2, 3)]
        assert [event["time"] for event in run["events"]] == times
        assert run["events"][0] == {"time": times[0], "blocks": [0, 1], "class": "2+1+1"}
        assert run["classes"][0] == {"time": 0.0, "class": "1+1+1+1"}
        assert run["classes"][-1] == {"time": times[-1], "class": "I"}


def test_the_replay_of_rectangles_has_their_sides_and_of_discs_no_headings() -> None:
    path = assembly_path().assign_attrs(block_shape="rectangle", block_width_m=0.02)
    part = part_of(assembly_sections(path=path), "replay")
    assert (part["side"], part["width"]) == (0.03, 0.02)
    assert np.isfinite(values(part["runs"][0]["theta"])).all()
    path = assembly_path().assign_attrs(block_shape="disc")
    part = part_of(assembly_sections(path=path), "replay")
    assert part["width"] is None
    assert np.isnan(values(part["runs"][0]["theta"])).all()


def test_a_run_has_the_number_by_which_it_is_asked_for() -> None:
    path = assembly_path().isel(run=slice(1, 2)).assign_coords(run=[7])
    (run,) = part_of(assembly_sections(path=path), "replay")["runs"]
    assert run["name"] == "run 7"


@pytest.mark.parametrize("wrong", [-1, 3])
def test_an_event_without_a_class_costs_the_replay(wrong: int) -> None:
    """In a damaged file; a class of -1 is what stands where there is no event."""
    path = assembly_path()
    assembly = made_up_assembly(path)
    assembly["event_class"].values[0, 0] = wrong
    made = assembly_sections(path=path, assembly=assembly)
    assert f"an event of the assembly has class {wrong}, of 3" in part_of(made, "replay")["reason"]


def test_a_long_path_of_many_blocks_is_thinned() -> None:
    path = assembly_path(runs=4, samples=3001, blocks=64)
    part = part_of(assembly_sections(path=path), "replay")
    run = part["runs"][0]
    poses = len(part["runs"]) * np.prod(run["x"]["shape"])
    assert 0.5 * MOST_POSES < poses <= 1.1 * MOST_POSES
    every = round(3000 / (run["x"]["shape"][1] - 1))
    np.testing.assert_allclose(
        values(run["x"]), path["x"].values[0, ::every].T, atol=0.5001 * run["x"]["step"]
    )
    assert run["events"] == []


def test_drawn_parameters_are_shown(sections: list[dict[str, Any]]) -> None:
    part = part_of(sections, "drawn")
    assert values(part["series"][0]["x"]).tolist() == [0.55e-3, 0.55e-3]
    assert values(part["series"][0]["y"]).tolist() == [0.45, 0.45]
    assert "its own flow" in part["note"]


def test_a_run_that_has_just_begun_has_empty_sections() -> None:
    assert [part["kind"] for part in assembly_sections()] == ["empty"]
    made = assembly_sections(distribution=distribution(), path=assembly_path().drop_vars("theta"))
    assert part_of(made, "replay")["reason"] == "the assembly_path holds no theta"


def test_the_map_of_distances_and_the_shares_of_each_setting() -> None:
    study = sensitivity(points=(5, 4))
    made = sensitivity_sections(sensitivity=study, components=components(study))
    part = part_of(made, "l1")
    assert (part["x"]["name"], part["y"]["name"]) == ("drag_coefficient", "force_std")
    assert part["y"]["values"] == study["force_std"].values.tolist()
    assert "redrawn every 16 ms" in part["y"]["label"]
    shown = study.transpose("force_std", "drag_coefficient", ...)
    np.testing.assert_allclose(values(part["value"]), shown["l1_distance"], rtol=1e-6)
    np.testing.assert_allclose(values(part["shares"]), shown["proportion"], rtol=1e-6)
    assert part["classes"] == study["class"].values.tolist()
    assert part["cells"] == [cells_of(name) for name in part["classes"]]
    assert part["reference"] == {"x": 0.45, "y": 0.55e-3}
    assert part["noise"] == 0.18
    complete = part_of(made, "complete")
    np.testing.assert_allclose(values(complete["value"]), shown["complete"], rtol=1e-6)


def test_the_biplot_keeps_scores_and_the_direction_of_loadings() -> None:
    study = sensitivity(points=(5, 4))
    found = components(study)
    part = part_of(sensitivity_sections(sensitivity=study, components=found), "biplot")
    score = found["score"].values.reshape(20, -1)
    np.testing.assert_allclose(values(part["points"]["x"]), score[:, 0], rtol=1e-6)
    np.testing.assert_allclose(values(part["points"]["y"]), score[:, 1], rtol=1e-6)
    shares = found["explained_variance_ratio"].values[:2]
    assert [axis["share"] for axis in part["axes"]] == pytest.approx(shares)
    loading = found["loading"].values
    factors = [
        arrow["x"] / loading[k, 0] for k, arrow in enumerate(part["arrows"]) if loading[k, 0]
    ]
    np.testing.assert_allclose(factors, factors[0])
    assert [arrow["cells"] for arrow in part["arrows"]] == [
        cells_of(arrow["name"]) for arrow in part["arrows"]
    ]
    drag, force = float(study["drag_coefficient"][2]), 1e3 * float(study["force_std"][1])
    name = part["points"]["names"][2 * 4 + 1]
    assert name == f"drag coefficient {drag:.4g}, stochastic force {force:.4g} mN"
    distance = values(part["points"]["values"]["l1_distance"])
    np.testing.assert_allclose(distance, study["l1_distance"].values.ravel(), rtol=1e-6)


def test_other_axes_are_drawn_as_points() -> None:
    numbers = one_axis("blocks", [3, 4, 5])
    part = part_of(sensitivity_sections(sensitivity=numbers), "l1")
    assert part["kind"] == "lines"
    assert values(part["series"][0]["x"]).tolist() == [3.0, 4.0, 5.0]
    np.testing.assert_allclose(values(part["series"][0]["y"]), numbers["l1_distance"].values)
    words = one_axis("latching", np.array(["collision", "connector"]))
    part = part_of(sensitivity_sections(sensitivity=words), "l1")
    assert part["note"] == "Latching: 1: collision, 2: connector."
    assert part["marks"] == [{"label": "by chance, 95 %", "x": None, "y": 0.18}]


def test_a_study_of_three_axes_has_a_map_for_each_value_of_the_third() -> None:
    study = sensitivity(points=(3, 4))
    both = study.expand_dims(latching=np.array(["collision", "connector"], dtype=object))
    made = sensitivity_sections(sensitivity=both)
    assert part_of(made, "l1")["title"] == "Distance to the reference, latching collision"
    part = part_of(made, "l1-2")
    np.testing.assert_allclose(values(part["value"]), study["l1_distance"].values.T, rtol=1e-6)


def test_distances_that_are_not_to_be_had_are_counted() -> None:
    study = sensitivity(points=(3, 4))
    distance = study["l1_distance"].copy()
    distance[0, 0] = np.nan
    made = sensitivity_sections(sensitivity=study.assign(l1_distance=distance))
    assert part_of(made, "warnings")["items"] == ["1 setting cannot be compared with the reference"]
    assert np.isnan(values(part_of(made, "l1")["value"])[0, 0])
    above = int((distance.values > 0.18).sum())
    assert f"{above} of 11 settings" in " ".join(part_of(made, "summary")["paragraphs"])
    assert part_of(made, "biplot")["kind"] == "empty"


def test_sobol_indices_are_those_of_the_dataset() -> None:
    found = xr.Dataset(
        {
            name: (("output", "input"), base + np.arange(6.0).reshape(3, 2) / 10)
            for name, base in (
                ("first_order", 0.0), ("first_order_half_width", 1.0),
                ("total_order", 2.0), ("total_order_half_width", 3.0),
            )
        },
        coords={
            "output": np.array(["complete", "I", "O"], dtype=object),
            "input": np.array(["drag_coefficient", "force_std"], dtype=object),
        },
    ).assign(variance=("output", [1.0, 0.5, 0.7]))  # fmt: skip
    rows = part_of(sensitivity_sections(sobol=found), "sobol")["rows"]
    assert rows[0] == ["complete", "drag coefficient", 0.0, 1.0, 2.0, 3.0]
    assert rows[3][:2] == ["I", "stochastic force"]
    assert rows[3][2:] == pytest.approx([0.3, 1.3, 2.3, 3.3])
    assert len(rows) == 6


@pytest.mark.parametrize(
    ("ends", "said"),
    [
        ([(7, 7), (8, 8), (9, 12)], "Sizes that share a point, at their geometric mean: 9 to 12."),
        ([(8, 8), (9, 16), (17, 20)], "geometric mean: 9 to 16, 17 to 20."),
        ([(1, 1), (2, 2)], "At the end of the runs. Means"),
    ],
)
def test_the_sizes_name_the_groups_that_are_there(ends: list[tuple[int, int]], said: str) -> None:
    """The last group ends at the number of blocks, not at a power of two that no run can reach."""
    low, high = zip(*ends, strict=True)
    share = ("size", np.full(len(ends), 0.2))
    names = ("block_share", "block_share_low", "block_share_high")
    sizes = xr.Dataset(
        dict.fromkeys(names, share) | {"size_to": ("size", list(high))},
        coords={"size": list(low)},
        attrs={"confidence": 0.9},
    )
    assert said in sizes_section({"parameters found": sizes})["note"]
