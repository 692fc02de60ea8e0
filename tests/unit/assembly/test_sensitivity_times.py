"""Outcome classes over time of every setting, against the events and the paths of the same runs.

The oracles are plain: `assemble` of one setting with the same random numbers, and a loop over its
runs and their events; the labels of the blocks along the paths of the same runs.
"""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest
import small_sensitivity
import xarray as xr
from hypothesis import given, settings, strategies as st
from small_sensitivity import FLOW, REALISATIONS, RUNS, by_hand

import driftwalk as dw
from driftwalk.assembly.runs.run import assembly_path
from driftwalk.assembly.sensitivity import settings as engine, times as times

AXES = {"drag_coefficient": [0.2, 1.0], "force_std": [5e-4, 2e-3]}


def small(**assembly: Any) -> dw.Study:
    """Return a study of three blocks and few short runs, in a tank a little wider."""
    return small_sensitivity.small(tank={"diameter_m": 0.18}, assembly=assembly)


@pytest.fixture(scope="module")
def study() -> dw.Study:
    return small()


@pytest.fixture(scope="module")
def reference(study: dw.Study) -> xr.Dataset:
    return dw.sensitivity_reference(study, FLOW)


@pytest.fixture(scope="module")
def found(study: dw.Study, reference: xr.Dataset) -> xr.Dataset:
    return dw.sensitivity_map(study, FLOW, axes=AXES, reference=reference)


def classes_by_loop(runs: xr.Dataset, moment: float) -> Counter[str]:
    """Count the runs in each class at a time: run by run, event by event."""
    names = [str(name) for name in runs["class"].values]
    count: Counter[str] = Counter()
    for run in range(runs.sizes["run"]):
        now = "+".join(["1"] * runs.sizes["block"])
        for event in range(int(runs["event_count"][run])):
            if float(runs["event_time"][run, event]) <= moment:
                now = names[int(runs["event_class"][run, event])]
        count[now] += 1
    return count


def kept(one: xr.Dataset, at: int, variable: str = "count_over_time") -> Counter[str]:
    names = [str(name) for name in one["class_over_time"].values]
    return Counter(dict(zip(names, one[variable].values[at].tolist(), strict=True)))


@pytest.mark.slow
def test_every_setting_has_the_classes_of_its_runs_at_every_time(
    study: dw.Study, found: xr.Dataset
) -> None:
    assert found["count_over_time"].dims == (*AXES, "time", "class_over_time")
    np.testing.assert_allclose(found["time"], np.linspace(0.0, 10.0, 101), rtol=0, atol=1e-9)
    assert found["time"].attrs["units"] == "s"
    for drag in AXES["drag_coefficient"]:
        for force in AXES["force_std"]:
            one = found.sel(drag_coefficient=drag, force_std=force)
            alone = by_hand(study, int(one["trial"]), drag_coefficient=drag, force_std=force)
            for at, moment in enumerate(found["time"].values.tolist()):
                assert +kept(one, at) == classes_by_loop(alone, moment)
    # The settings differ over time, so that one taken for another would show.
    flat = found["count_over_time"].values.reshape(4, -1)
    assert len(np.unique(flat, axis=0)) == 4


def test_the_paths_of_the_runs_have_as_many_assemblies(study: dw.Study, found: xr.Dataset) -> None:
    one = found.isel(drag_coefficient=1, force_std=1)
    path = assembly_path(
        study, FLOW, runs=range(RUNS), sample_interval=0.1, seed=5, trial=int(one["trial"]),
        drag_coefficient=1.0, force_std=2e-3,
    )  # fmt: skip
    np.testing.assert_array_equal(path["time"], one["time"])
    seen = set()
    for at in range(path.sizes["time"]):
        labels = path["assembly"].values[:, at]
        number = Counter(len(set(row.tolist())) for row in labels)
        seen |= set(number)
        told: Counter[int] = Counter()
        for name, runs in kept(one, at).items():
            told[name.count("+") + 1] += runs
        assert +told == number
    assert seen == {1, 2, 3}


def test_they_end_with_the_outcomes_and_begin_with_single_blocks(found: xr.Dataset) -> None:
    over_time = found["count_over_time"]
    assert (over_time.sum("class_over_time") == found["runs"]).all()
    assert (over_time.isel(time=0).sel(class_over_time="1+1+1") == RUNS).all()
    for name in found["class_over_time"].values:
        last = over_time.isel(time=-1).sel(class_over_time=name, drop=True)
        np.testing.assert_array_equal(last, found["count"].sel({"class": name}))


@pytest.mark.slow
def test_the_reference_is_all_its_realisations(
    study: dw.Study, reference: xr.Dataset, found: xr.Dataset
) -> None:
    each = [by_hand(study, (2 << 32) + number) for number in range(REALISATIONS)]
    for at in range(0, 101, 4):
        moment = float(reference["time"][at])
        total = sum((classes_by_loop(one, moment) for one in each), Counter())
        assert +kept(reference, at) == total
        for name, share in kept(found, at, "reference_over_time").items():
            assert share == pytest.approx(total[name] / (RUNS * REALISATIONS))


def test_other_numbers_of_blocks_and_rules(study: dw.Study, reference: xr.Dataset) -> None:
    axes = {"latching": ["collision", "none"], "blocks": [2, 4]}
    found = dw.sensitivity_map(small(), FLOW, axes=axes, reference=reference)
    for blocks in axes["blocks"]:
        for latching in axes["latching"]:
            one = found.sel(blocks=blocks, latching=latching)
            changed = {"assembly.blocks": blocks, "assembly.latching": latching}
            alone = by_hand(dw.apply_overrides(study, changed), int(one["trial"]))
            for at in (0, 33, 100):
                assert +kept(one, at) == classes_by_loop(alone, float(found["time"][at]))


@pytest.mark.slow
def test_many_blocks_have_their_classes_too() -> None:
    """Beyond 8 blocks nobody lists the classes, and a call of the core names its own."""
    wide = dw.apply_overrides(small(blocks=9), {"tank.diameter_m": 0.3})
    found = dw.sensitivity_map(wide, FLOW, axes={"drag_coefficient": [0.2, 1.0]})
    names = found["class_over_time"].values.tolist()
    assert len(names) <= 25
    for drag in (0.2, 1.0):
        one = found.sel(drag_coefficient=drag)
        alone = by_hand(wide, int(one["trial"]), drag_coefficient=drag)
        for at in (0, 20, 100):
            expected = classes_by_loop(alone, float(found["time"][at]))
            now = kept(one, at)
            rest = now.pop("other", 0)
            assert +now == Counter({n: k for n, k in expected.items() if n in names})
            assert rest == sum(k for n, k in expected.items() if n not in names)


def test_runs_that_broke_down_are_left_out(
    study: dw.Study, reference: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = engine.simulate_rows

    def broken(*given: Any) -> Any:
        made = real(*given)
        made["status"][:5] = engine.BROKEN
        return made

    monkeypatch.setattr(engine, "simulate_rows", broken)
    axes = {"drag_coefficient": [0.2]}
    found = dw.sensitivity_map(study, FLOW, axes=axes, reference=reference)
    one = found.isel(drag_coefficient=0)
    assert int(one["left_out"]) == 5
    alone = by_hand(study, int(one["trial"]), drag_coefficient=0.2).isel(run=slice(5, None))
    for at in (0, 50, 100):
        assert +kept(one, at) == classes_by_loop(alone, float(found["time"][at]))
    # Where no run is sound there are no classes, and the map is made all the same.
    monkeypatch.setattr(engine, "BROKEN", 0xFF)
    monkeypatch.setattr(
        engine, "simulate_rows", lambda *given: real(*given) | {"status": np.full(RUNS, 0xFF)}
    )
    none = dw.sensitivity_map(study, FLOW, axes=axes, reference=reference)
    assert (none["count_over_time"] == 0).all()
    assert int(none["runs"].sum()) == 0


def test_a_reference_without_courses_or_of_another_duration(
    study: dw.Study, reference: xr.Dataset
) -> None:
    """One that an earlier version wrote, and one whose times are others: it has no course here."""
    axes = {"drag_coefficient": [0.2]}
    older = reference.drop_dims(["time", "class_over_time"])
    longer = reference.assign_coords(time=2.0 * reference["time"])
    whole = dw.sensitivity_map(study, FLOW, axes=axes, reference=reference)
    for other in (older, longer):
        found = dw.sensitivity_map(study, FLOW, axes=axes, reference=other)
        assert "reference_over_time" not in found
        expected = whole["count_over_time"]
        shared = found["count_over_time"].reindex_like(expected, fill_value=0)
        np.testing.assert_array_equal(shared, expected)


def made_up(rng: np.random.Generator, names: list[str]) -> tuple[dict[str, np.ndarray], str]:
    """Return runs that are in any class at any time, as a table by class and as text."""
    runs = rng.choice(len(names), p=rng.dirichlet(np.full(len(names), 0.2)), size=(40, times.TIMES))
    table = {name: (runs == place).sum(axis=0) for place, name in enumerate(names)}
    table = {name: row for name, row in table.items() if row.any()}
    return table, times.courses_to_text(table)


def test_of_many_classes_the_largest_are_kept_and_the_rest_summed() -> None:
    plan = engine.world_plan(small(blocks=6), FLOW, threads=1)
    names = list(dw.assembly.outcome_classes(6))
    rng = np.random.default_rng(4)
    tables, texts = zip(*(made_up(rng, names) for _ in range(6)), strict=True)
    variables, coordinates = times.map_courses(
        plan, texts, xr.Dataset(), dims={"first": 2, "second": 3}
    )
    assert list(variables) == ["count_over_time"]
    dims, count = variables["count_over_time"]
    assert (dims, count.shape) == (
        ("first", "second", "time", "class_over_time"),
        (2, 3, times.TIMES, 25),
    )
    listed = coordinates["class_over_time"][1].tolist()
    assert listed[-1] == "other"
    assert listed[:-1] == [name for name in names if name in listed]
    largest = {
        name: max(int(table[name].max()) for table in tables if name in table)
        for name in names
        if any(name in table for table in tables)
    }
    outside = [share for name, share in largest.items() if name not in listed]
    assert len(outside) > 5
    assert min(largest[name] for name in listed[:-1]) >= max(outside)
    nothing = np.zeros(times.TIMES, dtype=int)
    for place, table in enumerate(tables):
        rows = count.reshape(6, times.TIMES, 25)[place]
        for column, name in enumerate(listed[:-1]):
            np.testing.assert_array_equal(rows[:, column], table.get(name, nothing))
        rest = sum((row for name, row in table.items() if name not in listed), nothing)
        np.testing.assert_array_equal(rows[:, -1], rest)


@pytest.mark.slow
@settings(max_examples=25)
@given(
    st.dictionaries(
        st.sampled_from(dw.assembly.outcome_classes(4)),
        st.lists(st.integers(0, 10**6), min_size=times.TIMES, max_size=times.TIMES),
    )
)
def test_text_gives_back_what_it_was_made_of(table: dict[str, list[int]]) -> None:
    made = times.courses_to_text({name: np.array(row) for name, row in table.items()})
    again = times.courses_from_text(made)
    assert {name: row.tolist() for name, row in again.items()} == table
