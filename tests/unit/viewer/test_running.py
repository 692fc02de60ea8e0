"""Runs under way: what a page shows equals what lies in the run directory, no more and no less."""

from __future__ import annotations

import json
import os
import shutil
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import driftwalk as dw
from driftwalk.core.errors import InputError
from driftwalk.core.files.rundir import RunDirectory
from driftwalk.core.files.shards import ShardStore
from driftwalk.model import Study
from driftwalk.page.html import page_frame
from driftwalk.schema import Parameter
from driftwalk.sweep import grid
from driftwalk.viewer.watch.assembly import RunningSensitivity, _blocks, _items
from driftwalk.viewer.watch.run_page import RunSource
from driftwalk.viewer.watch.shards import StoreReader

DRAG, FORCE = [0.2, 0.3, 0.4], [1e-4, 2e-4, 3e-4, 4e-4]
SEARCH = {
    "calibration.drag_coefficient_min": 0.2,
    "calibration.drag_coefficient_max": 0.4,
    "calibration.drag_coefficient_step": 0.1,
    "calibration.force_std_min_N": 1e-4,
    "calibration.force_std_max_N": 4e-4,
    "calibration.force_std_step_N": 1e-4,
    "calibration.bootstrap": 4,
}
UNITS = grid(drag_coefficient=DRAG, force_std=FORCE).units(5)
RANDOM = np.random.default_rng(1)
DISTANCE = RANDOM.uniform(0.1, 0.9, (12, 2))
EXCERPT = RANDOM.normal(size=(12, 7))


def arrays(unit: Any) -> dict[str, Any]:
    rows = slice(unit.start, unit.stop)
    return {
        "ks_distance": DISTANCE[rows],
        "status": np.zeros((unit.size, 2), np.uint8),
        "pairs": np.full(unit.size, 99),
        "excerpt_x": EXCERPT[rows],
        "excerpt_y": -EXCERPT[rows],
        "step_density": np.full((unit.size, 4, 4), 1 / 16),
        "ks_step_length": np.arange(unit.start, unit.stop)[:, None] + [0.0, 0.5],
        "ks_turning_angle": np.zeros((unit.size, 2)),
    }


@pytest.fixture
def run(tmp_path: Path) -> Iterator[RunDirectory]:
    """Return a calibration that has begun."""
    study = dw.apply_overrides(Study(), SEARCH)
    specification = {
        "study": study.to_dict(),
        "body": None,
        "kind": "calibration",
        "recording_sha256": "0" * 64,
        "flow_sha256": None,
    }
    with RunDirectory(tmp_path / "run", specification=specification) as opened:
        yield opened


def coarse(run: RunDirectory) -> ShardStore:
    return run.store("coarse-x", fingerprint={"axes": [DRAG, FORCE], "replicates": 2})


def page(source: RunSource) -> dict[str, Any]:
    return dict(source.greeting()[0]["page"])


def the_map(source: RunSource) -> dict[str, Any]:
    return next(section for section in page(source)["sections"] if section["id"] == "map")


def by_setting(array: dict[str, Any]) -> np.ndarray:
    """Return values of a map in the order of the settings: the first parameter lies along x."""
    return dw.page.decode_array(array).T


def test_map_fills_as_units_are_finished(run: RunDirectory) -> None:
    source = RunSource(run.path)
    assert page(source)["state"]["progress"] == 0.0
    assert np.isnan(by_setting(the_map(source)["value"])).all()
    store, done = coarse(run), 0
    for unit in UNITS:
        store.write(unit, arrays(unit))
        done += unit.size
        kinds = [content["type"] for content in source.look()]
        assert kinds == ["section", "state"]
        value = by_setting(the_map(source)["value"]).reshape(-1)
        np.testing.assert_allclose(value[:done], DISTANCE.mean(axis=1)[:done])
        assert np.isnan(value[done:]).all()
        assert page(source)["state"]["progress"] == pytest.approx(0.26 * 0.9 * done / 12)
        assert source.look() == []
    error = DISTANCE.std(axis=1, ddof=1) / np.sqrt(2)
    np.testing.assert_allclose(
        by_setting(the_map(source)["standard_error"]).reshape(-1), error, rtol=1e-6
    )
    best = int(DISTANCE.mean(axis=1).argmin())
    assert the_map(source)["best"]["x"] == DRAG[best // 4]
    assert the_map(source)["best"]["y"] == FORCE[best % 4]


def test_units_may_come_in_any_order(run: RunDirectory) -> None:
    source, store = RunSource(run.path), coarse(run)
    for unit in reversed(UNITS):
        store.write(unit, arrays(unit))
        source.look()
    np.testing.assert_allclose(
        by_setting(the_map(source)["value"]).reshape(-1), DISTANCE.mean(axis=1)
    )


def test_a_page_opened_late_shows_what_is_there(run: RunDirectory) -> None:
    store = coarse(run)
    for unit in UNITS:
        store.write(unit, arrays(unit))
    assert page(RunSource(run.path))["state"]["progress"] == pytest.approx(0.26 * 0.9)


def test_a_setting_without_numbers_is_as_far_as_can_be(run: RunDirectory) -> None:
    source, store = RunSource(run.path), coarse(run)
    broken = arrays(UNITS[0])
    broken["ks_distance"] = np.full((5, 2), np.nan)
    store.write(UNITS[0], broken)
    source.look()
    np.testing.assert_array_equal(by_setting(the_map(source)["value"]).reshape(-1)[:5], np.ones(5))


def test_a_cell_gives_its_own_excerpt(run: RunDirectory) -> None:
    source, store = RunSource(run.path), coarse(run)
    store.write(UNITS[0], arrays(UNITS[0]))
    source.look()
    assert source._running is not None
    found = source._running.cell(3, 0)
    np.testing.assert_allclose(dw.page.decode_array(found["excerpt_x"]), EXCERPT[3], rtol=1e-6)
    np.testing.assert_allclose(dw.page.decode_array(found["excerpt_y"]), -EXCERPT[3], rtol=1e-6)
    assert dw.page.decode_array(found["density"]).sum() == pytest.approx(1.0)
    # Both replicates are as far from their mean; the first is taken.
    assert found["ks_step_length"] == 3.0


@pytest.mark.parametrize(("row", "column"), [(3, 2), (0, -1), (0, 3), (4, 0), (0, 10**9)])
def test_a_cell_that_is_not_there_is_empty(run: RunDirectory, row: int, column: int) -> None:
    source, store = RunSource(run.path), coarse(run)
    store.write(UNITS[0], arrays(UNITS[0]))
    source.look()
    assert source._running is not None
    assert set(source._running.cell(row, column).values()) == {None}


def test_replicates_that_some_settings_get_count_as_progress(run: RunDirectory) -> None:
    store = coarse(run)
    for unit in UNITS:
        store.write(unit, arrays(unit))
    axes = [DRAG, FORCE]
    more = run.store(
        "more-coarse-x", fingerprint={"axes": axes, "replicates": 4, "chosen": [3, 7, 8, 9]}
    )
    source = RunSource(run.path)
    shown = the_map(source)["value"]
    halves = grid(setting=np.arange(4)).units(2)
    for share, unit in zip((0.95, 1.0), halves, strict=True):
        more.write(unit, {"ks_distance": np.full((2, 2), 0.5)})
        assert [content["type"] for content in source.look()] == ["state"]
        assert page(source)["state"]["progress"] == pytest.approx(0.26 * share)
        assert the_map(source)["value"] == shown
    assert page(source)["state"]["words"] == "map: done, the next step is under way"
    # Of the refined map they are like one more window: half of what was left.
    fine = [[0.25, 0.3], [1e-4, 2e-4]]
    refined = run.store("refined-x", fingerprint={"axes": fine, "replicates": 2})
    for unit in grid(drag_coefficient=fine[0], force_std=fine[1]).units(2):
        refined.write(unit, {"ks_distance": np.full((2, 2), 0.5)})
    source.look()
    assert page(source)["state"]["progress"] == pytest.approx(0.26 + 0.34 * 0.5)
    rest = {"axes": fine, "replicates": 4, "chosen": [1, 2]}
    run.store("more-refined-x", fingerprint=rest).write(
        halves[0], {"ks_distance": np.full((2, 2), 0.5)}
    )
    source.look()
    assert page(source)["state"]["progress"] == pytest.approx(0.26 + 0.34 * 0.75)
    assert dw.page.decode_array(the_map(source)["refined"]["value"]).size == 4


def test_refined_map_and_bootstrap(run: RunDirectory) -> None:
    source, store = RunSource(run.path), coarse(run)
    for unit in UNITS:
        store.write(unit, arrays(unit))
    fine = grid(drag_coefficient=[0.25, 0.3], force_std=[1e-4, 2e-4]).units(2)
    refined = run.store(
        "refined-x", fingerprint={"axes": [[0.25, 0.3], [1e-4, 2e-4]], "replicates": 2}
    )
    refined.write(fine[0], {"ks_distance": np.array([[0.1, 0.3], [0.5, 0.7]])})
    source.look()
    part = the_map(source)["refined"]
    assert part["x"] == [0.25, 0.3]
    np.testing.assert_allclose(by_setting(part["value"]), [[0.2, 0.6], [np.nan, np.nan]], rtol=1e-6)
    assert page(source)["state"]["progress"] == pytest.approx(0.26 + 0.34 * 0.25)
    repeats = run.store("bootstrap-x", fingerprint={"count": 4})
    unit = grid(recording=np.arange(4)).units(2)[1]
    estimates = {"drag_coefficient": np.array([0.3, 0.4]), "force_std": np.array([1e-4, 2e-4])}
    repeats.write(unit, {**estimates, "excess": np.zeros((2, 3))})
    # A section more: the page is sent anew.
    assert [content["type"] for content in source.look()] == ["page"]
    lines = next(s for s in page(source)["sections"] if s["id"] == "bootstrap")
    cloud = lines["series"][0]
    assert cloud["x"] == pytest.approx([0.3, 0.4])
    assert cloud["y"] == pytest.approx([1e-4, 2e-4])
    assert page(source)["state"]["progress"] == pytest.approx(0.6 + 0.2 * 0.5)


@pytest.mark.parametrize("count", [1, 2])
def test_the_map_of_a_users_model_fills_under_its_own_names(tmp_path: Path, count: int) -> None:
    parameters = (
        Parameter("tumble_rate", "1/s", 0.1, 10.0, step=1.0, scale="log"),
        Parameter("speed", "m/s", 0.0, 0.2, step=0.1, label="speed of a run"),
    )[:count]
    described = [parameter.describe() for parameter in parameters]
    specification = {
        "study": Study().to_dict(),
        "body": None,
        "kind": "calibration",
        "recording_sha256": "0" * 64,
        "flow_sha256": None,
        "model": {"name": "tumble", "parameters": described},
    }
    axes = {parameter.name: parameter.coordinates for parameter in parameters}
    unit = grid(**axes).units(2)[0]
    with RunDirectory(tmp_path / "run", specification=specification) as opened:
        source = RunSource(opened.path)
        assert the_map(source)["kind"] == ("lines" if count == 1 else "map")
        found = opened.store(
            "coarse-x", fingerprint={"axes": list(map(list, axes.values())), "replicates": 2}
        )
        found.write(unit, {"ks_distance": np.array([[0.1, 0.3], [0.5, 0.7]])})
        repeats = opened.store("bootstrap-x", fingerprint={"count": 4})
        estimates = {parameter.name: np.array([-0.5, 0.1]) for parameter in parameters}
        again = grid(recording=np.arange(4)).units(2)[0]
        repeats.write(again, {**estimates, "excess": np.zeros((2, 1 + count))})
        source.look()
        part = the_map(source)
        lines = next(s for s in page(source)["sections"] if s["id"] == "bootstrap")
    if count == 1:
        assert part["x"] == {"label": "tumble rate", "unit": "1/s", "log": True}
        assert part["series"][0]["x"] == pytest.approx([0.1, 1.0, 10.0])
        assert part["series"][0]["y"][:2] == pytest.approx([0.2, 0.6])
        assert lines["series"][0]["x"] == pytest.approx([10**-0.5, 10**0.1])
    else:
        assert (part["x"]["label"], part["y"]["label"]) == ("tumble rate", "speed of a run")
        assert part["x"]["values"] == pytest.approx([0.1, 1.0, 10.0])
        assert by_setting(part["value"]).ravel()[:2] == pytest.approx([0.2, 0.6])
        assert lines["series"][0]["x"] == pytest.approx([10**-0.5, 10**0.1])


def test_damaged_and_foreign_shards_are_no_units(run: RunDirectory) -> None:
    store = coarse(run)
    for unit in UNITS[:2]:
        store.write(unit, arrays(unit))
    path = store.folder / f"{UNITS[0].id}.npz"
    path.write_bytes(path.read_bytes()[:-100])
    (store.folder / "<script>.npz").write_bytes(b"x")
    (store.folder / "00000000-99999999.npz").write_bytes(b"")
    reader = StoreReader(store.folder)
    assert [unit.start for unit in reader.new_units()] == [5]
    assert reader.new_units() == []


def test_assembly_counts_the_classes_of_finished_runs(tmp_path: Path) -> None:
    study = dw.apply_overrides(Study(), {"assembly.blocks": 3, "assembly.runs": 8})
    row, pair, apart = [(0, 0), (1, 0), (2, 0)], [(0, 0), (1, 0), (0, 0)], [(0, 0)] * 3
    cells = [row, pair, apart, row, row, pair, apart, row]
    labels = {str(row): [0, 0, 0], str(pair): [0, 0, 2], str(apart): [0, 1, 2]}
    specification = {
        "study": study.to_dict(),
        "flow_sha256": "0",
        "calibration_sha256": None,
        "kind": "assembly",
    }
    with RunDirectory(tmp_path / "run", specification=specification) as opened:
        source = RunSource(opened.path)
        store = opened.store("fixed")
        status = np.array([0, 0, 0, 0, 0, 0, 0, 1])
        for unit in grid(run=np.arange(8)).units(4):
            part = cells[unit.start : unit.stop]
            store.write(
                unit,
                {
                    "status": status[unit.start : unit.stop],
                    "cell": np.array(part, np.int32),
                    "assembly": np.array([labels[str(cell)] for cell in part], np.int32),
                },
            )
            source.look()
        section = page(source)["sections"][0]
        items = {item["class"]: item["count"] for item in section["series"][0]["items"]}
        # The run whose numbers were lost has no outcome, but it has ended.
        assert items == Counter({"I3": 3, "2+1": 2, "1+1+1": 2})
        assert section["runs"] == 8
        low, high = dw.assembly.proportion_interval(3, 7, confidence=1 - 0.1 / 3)
        first = section["series"][0]["items"][0]
        assert (first["low"], first["high"]) == pytest.approx((float(low), float(high)))
        assert first["cells"] == [[0, 0], [1, 0], [2, 0]]


def kept(counts: list[dict[str, int]]) -> dict[str, np.ndarray]:
    """Return what a unit of a sensitivity keeps, with outcomes that stand from the first time."""
    courses = [{name: [[0], [runs]] for name, runs in one.items()} for one in counts]
    return {
        name: np.array([json.dumps(one).encode() for one in texts])
        for name, texts in (("count", counts), ("courses", courses))
    }


def test_sensitivity_fills_its_map(tmp_path: Path) -> None:
    chosen = {
        "sensitivity.drag_coefficient": [0.2, 0.3],
        "sensitivity.force_std_N": [1e-4, 2e-4, 3e-4],
        "sensitivity.reference_realisations": 2,
    }
    study = dw.apply_overrides(Study(), chosen)
    specification = {
        "study": study.to_dict(),
        "flow_sha256": "0",
        "flows_sha256": {},
        "kind": "sensitivity",
    }
    with RunDirectory(tmp_path / "run", specification=specification) as opened:
        source = RunSource(opened.path)
        reference, settings = opened.store("reference"), opened.store("map")
        for unit in grid(setting=np.arange(2)).units(2):
            reference.write(unit, kept([{"2": 6, "1+1": 4}, {"2": 4, "1+1": 6}]))
        unit = grid(setting=np.arange(6)).units(4)[0]
        settings.write(unit, kept([{"2": 5, "1+1": 5}, {"2": 10}, {"1+1": 10}, {"2": 8, "1+1": 2}]))
        source.look()
        section = page(source)["sections"][0]
        # Eq. 5 by hand: the pooled reference is one half each.
        np.testing.assert_allclose(
            by_setting(section["value"]),
            [[0.0, 1.0, 1.0], [0.6, np.nan, np.nan]],
            rtol=1e-6,
        )
        assert section["classes"] == ["2", "1+1"]
        gone = [np.nan, np.nan]
        np.testing.assert_allclose(
            dw.page.decode_array(section["shares"]).swapaxes(0, 1),
            [[[0.5, 0.5], [1.0, 0.0], [0.0, 1.0]], [[0.8, 0.2], gone, gone]],
            rtol=1e-6,
        )
        assert section["y"]["name"] == "force_std"
        assert section["x"]["values"] == [0.2, 0.3]
        assert page(source)["state"]["words"] == "6 of 8 settings"


def test_a_setting_of_a_running_sensitivity_has_its_classes_over_time(tmp_path: Path) -> None:
    """Cells and values against the shards by hand; nothing of a setting that is not there yet."""
    chosen = {
        "assembly.blocks": 2,
        "assembly.duration_s": 50.0,
        "sensitivity.latching": ["collision", "none"],
        "sensitivity.drag_coefficient": [0.2, 0.3],
        "sensitivity.force_std_N": [1e-4, 2e-4, 3e-4],
        "sensitivity.reference_realisations": 2,
    }
    study = dw.apply_overrides(Study(), chosen)
    specification = {
        "study": study.to_dict(),
        "flow_sha256": "0",
        "flows_sha256": {},
        "kind": "sensitivity",
    }

    def courses(*joined: tuple[int, int]) -> dict[str, np.ndarray]:
        """Return what a unit keeps: how many runs of ten join, and at which of the times."""
        kept = [{"2": [[at], [runs]], "1+1": [[0, at], [10, -runs]]} for runs, at in joined]
        counts = [{"2": runs, "1+1": 10 - runs} for runs, _ in joined]
        return {
            name: np.array([json.dumps(one).encode() for one in texts])
            for name, texts in (("count", counts), ("courses", kept))
        }

    with RunDirectory(tmp_path / "run", specification=specification) as opened:
        running = RunningSensitivity(opened.path, specification)
        settings = opened.store("map")
        settings.write(
            grid(setting=np.arange(12)).units(5)[0], courses(*[(k, 10 * k) for k in range(1, 6)])
        )
        running.look()
        alone = running.cell(2, 0)["over_time"]
        assert alone["reference"] is None
        opened.store("reference").write(
            grid(setting=np.arange(2)).units(2)[0], courses((4, 50), (8, 50))
        )
        running.look()
        for row, column, runs, at in ((0, 0, 1, 10), (2, 0, 3, 30), (1, 1, 5, 50)):
            found = running.cell(row, column)["over_time"]
            json.dumps(found, allow_nan=False)
            assert found["classes"] == ["2", "1+1"]
            assert found["cells"][0] == [[0, 0], [1, 0]]
            time = dw.page.decode_array(found["time"])
            np.testing.assert_allclose(time, 0.5 * np.arange(101))
            expected = np.where(np.arange(101) >= at, runs, 0)
            np.testing.assert_array_equal(
                dw.page.decode_array(found["count"])[0, 0], [expected, 10 - expected]
            )
            assert found["runs"] == [[10]]
            # Twelve of twenty runs of the reference have joined from half of the time on.
            both = np.where(np.arange(101) >= 50, 0.6, 0.0)
            np.testing.assert_allclose(
                dw.page.decode_array(found["reference"]), [both, 1.0 - both], atol=1e-7
            )
        for row, column in ((2, 1), (0, 2), (3, 0), (0, -1), (-1, 0), (10**9, 10**9)):
            assert running.cell(row, column)["over_time"] is None


def test_a_kind_without_pictures_says_so(tmp_path: Path) -> None:
    specification = {"kind": "fit", "study": {}, "recordings_sha256": []}
    with RunDirectory(tmp_path / "run", specification=specification) as opened:
        source = RunSource(opened.path)
        assert page(source)["sections"][0]["kind"] == "empty"
        assert page(source)["state"]["progress"] is None


def test_a_run_that_vanishes_and_comes_back(run: RunDirectory) -> None:
    source = RunSource(run.path)
    aside = run.path.with_name("aside")
    run.path.rename(aside)
    said = source.look()
    assert "no longer there" in said[0]["state"]["words"]
    assert source.look() == []
    aside.rename(run.path)
    assert [content["type"] for content in source.look()] == ["page"]
    assert source.look() == []


def age(run: RunDirectory, duration_s: float) -> None:
    """Let everything in a run be older."""
    past = time.time() - duration_s
    for path in (*run.path.rglob("*"), run.path, *run.path.glob(".*"), *run.path.glob(".*/*")):
        os.utime(path, (past, past))


@pytest.mark.parametrize("study", [5, None, [], "x", {"tank": 5}, {"no such part": {}}])
def test_a_damaged_record_ends_nothing_and_is_told(run: RunDirectory, study: Any) -> None:
    source = RunSource(run.path)
    record = run.path / ".run.json"
    whole = record.read_text()
    content = json.loads(whole)
    content["specification"]["study"] = study
    record.write_text(json.dumps(content))
    (told,) = source.look()
    assert "cannot be read" in told["state"]["words"]
    assert "changed or damaged" in told["state"]["words"]
    assert source.look() == []
    del content["specification"]["study"]
    record.write_text(json.dumps(content))
    assert source.look() == []
    record.write_text(whole)
    assert [content["type"] for content in source.look()] == ["page"]
    assert page(source)["state"]["words"] == "map: 0 %"


@pytest.mark.parametrize(
    ("duration_s", "ago"),
    [
        *((0.0, None), (50.0, None), (65.0, "1 min ago"), (200.0, "3 min ago")),
        *((7100.0, "118 min ago"), (7300.0, "2 h ago"), (4e5, "4 days ago")),
    ],
)
def test_a_killed_run_says_since_when_nothing_came(
    run: RunDirectory, duration_s: float, ago: str | None
) -> None:
    coarse(run).write(UNITS[0], arrays(UNITS[0]))
    age(run, duration_s)
    state = page(RunSource(run.path))["state"]
    assert state["progress"] == pytest.approx(0.26 * 0.9 * 5 / 12)
    assert state["words"].startswith("map: 38 %")
    if ago is None:
        assert state["words"] == "map: 38 %"
    else:
        assert f"the last result came {ago} (" in state["words"]


def test_a_run_that_goes_on_is_no_longer_quiet(run: RunDirectory) -> None:
    store = coarse(run)
    store.write(UNITS[0], arrays(UNITS[0]))
    age(run, 500.0)
    source = RunSource(run.path)
    assert "8 min ago" in page(source)["state"]["words"]
    assert source.look() == []
    store.write(UNITS[1], arrays(UNITS[1]))
    assert [content["type"] for content in source.look()] == ["section", "state"]
    assert page(source)["state"]["words"] == "map: 75 %"


def test_a_finished_run_that_cannot_be_shown_is_read_once(
    run: RunDirectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    run.write("calibration.nc", b"damaged")
    run.finish({"kind": "driftwalk manifest", "manifest_version": 1})
    source = RunSource(run.path)
    assert "cannot be read" in page(source)["state"]["words"]
    looked = []

    def report_page(folder: Path, **_: Any) -> dict[str, Any]:
        looked.append(folder)
        return page_frame("report", "Calibration")

    monkeypatch.setattr("driftwalk.page.report_page", report_page)
    assert source.look() == source.look() == []
    assert looked == []
    # Another file in its place is looked at.
    (run.path / "calibration.nc").write_bytes(b"restored")
    assert [content["type"] for content in source.look()] == ["page"]
    assert source.look() == []
    assert len(looked) == 1


def test_a_one_by_one_search(run: RunDirectory, tmp_path: Path) -> None:
    one = {name: 0.3 for name in SEARCH if "drag" in name} | {
        name: 2e-4 for name in SEARCH if "force" in name
    }
    study = dw.apply_overrides(Study(), {**one, "calibration.bootstrap": 0})
    specification = {**run.specification, "study": study.to_dict()}
    with RunDirectory(tmp_path / "one", specification=specification) as opened:
        source = RunSource(opened.path)
        assert page(source)["state"] == {"finished": False, "progress": 0.0, "words": "map: 0 %"}
        store = opened.store("coarse-x", fingerprint={"axes": [[0.3], [2e-4]], "replicates": 2})
        unit = grid(drag_coefficient=[0.3], force_std=[2e-4]).units(5)[0]
        store.write(unit, arrays(unit))
        source.look()
        assert page(source)["state"]["words"] == "map: 90 %"
        found = by_setting(the_map(source)["value"])
        np.testing.assert_allclose(found, [[DISTANCE[0].mean()]], rtol=1e-6)


def test_a_folder_with_any_name_and_no_right_to_write(run: RunDirectory, tmp_path: Path) -> None:
    coarse(run).write(UNITS[0], arrays(UNITS[0]))
    odd = tmp_path / "ünï 日本 #1?a=b&c%41%2e <b>"
    shutil.copytree(run.path, odd)
    before = sorted((path, path.stat().st_mtime_ns) for path in odd.rglob("*"))
    for path in (odd, odd / ".shards", *odd.glob(".shards/*")):
        path.chmod(0o500)
    try:
        source = RunSource(odd)
        assert source.look() == []
        assert page(source)["subtitle"] == odd.name
        assert np.isfinite(by_setting(the_map(source)["value"])).sum() == 5
        # Looking changes nothing; for root no folder is read-only, so this is what is checked.
        assert sorted((path, path.stat().st_mtime_ns) for path in odd.rglob("*")) == before
    finally:
        for path in (odd, odd / ".shards", *odd.glob(".shards/*")):
            path.chmod(0o700)


def test_another_version_is_refused(run: RunDirectory) -> None:
    record = run.path / ".run.json"
    text = record.read_text()
    record.write_text(text.replace(dw.__version__, "99.1.2"))
    with pytest.raises(InputError, match=r"driftwalk 99\.1\.2, this is"):
        RunSource(run.path)
    record.write_text("{")
    with pytest.raises(InputError, match="expected JSON"):
        RunSource(run.path)


def test_what_is_no_run_is_refused(tmp_path: Path, run: RunDirectory) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "file").write_text("x")
    for name, words in (
        ("nowhere", "there is no such directory"),
        ("file", "is a file, expected a run directory; .* by 'driftwalk report file'$"),
        ("empty", "holds no run of driftwalk$"),
        ("", "there are runs in it: run"),
    ):
        with pytest.raises(InputError, match=words):
            RunSource(tmp_path / name)


def test_counted_classes_under_way() -> None:
    counts = Counter({"37 assemblies": 3, "70 assemblies": 1})
    assert _blocks(counts) == 0
    assert [one["class"] for one in _items(counts, 0.9)] == ["37 assemblies", "70 assemblies"]
