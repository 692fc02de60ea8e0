"""The outcome classes of a setting over time beside those of the reference, in Chromium."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from command_line import FLOW, here
from page_server import served

import driftwalk as dw
from browser.all_kinds import page_of
from browser.conftest import PHONE, Visit
from browser.pictures import drawn_share, path_points, pixels
from driftwalk.core.files.rundir import RunDirectory
from driftwalk.page.sections.sensitivity import sensitivity_sections

pytestmark = pytest.mark.browser

SIZE = ("--blocks", "3", "--runs", "40", "--realisations", "2", "--duration", "60s")
MAP = ("--vary", "drag-coefficient=0.2:1:0.4", "--vary", "force-std=0.2mN:1mN:0.4mN")
SHAPE = (3, 3)
NAMES = ("I3", "L3", "2+1", "1+1+1")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the run directory of a small sensitivity analysis, without figures."""
    folder = tmp_path_factory.mktemp("sensitivity") / "run"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("driftwalk.figures.write_figures", lambda *tables, **more: [])
        done = here("sensitivity", "--flow", FLOW, *SIZE, *MAP, "--threads", "1", "-o", folder)
    assert done.code == 0, done.err
    return folder


@pytest.fixture(scope="module")
def found(run: Path) -> xr.Dataset:
    return xr.load_dataset(run / "sensitivity.nc", engine="h5netcdf")


@pytest.fixture(scope="module")
def report(run: Path) -> Path:
    path = run.parent / "report.html"
    dw.write_report(dw.report_page(run), path)
    return path


@pytest.fixture
def page(visit: Callable[..., Visit], report: Path) -> Iterator[Any]:
    """Open the report; nothing but the file itself may be asked for."""
    one = visit(report.as_uri())
    yield one.open(report.as_uri())
    assert one.requests == [report.as_uri()]


def click_cell(page: Any, row: int, column: int) -> None:
    """Click into the middle of a cell of the map, and wait until its setting is shown."""
    page.locator(".map-figure").scroll_into_view_if_needed()
    area = page.locator(".map-figure svg image").first.bounding_box()
    x = area["x"] + area["width"] * (column + 0.5) / SHAPE[1]
    y = area["y"] + area["height"] * (SHAPE[0] - row - 0.5) / SHAPE[0]
    page.mouse.click(x, y)
    page.wait_for_selector(f'[data-part=l1-map][data-shown="{row},{column}"]')


def shares_of(found: xr.Dataset, row: int, column: int) -> np.ndarray:
    """Return the shares of a setting, (class, time)."""
    one = found.isel(drag_coefficient=column, force_std=row)
    return (one["count_over_time"] / one["runs"]).transpose("class_over_time", "time").values


def table_of(page: Any) -> tuple[list[str], np.ndarray]:
    """Return heads and numbers of the table of shares, opened with the keyboard."""
    details = page.locator(".setting-times details")
    details.locator("summary").focus()
    page.keyboard.press("Enter")
    details.locator("tbody tr").first.wait_for()
    heads = details.locator("thead th").all_inner_texts()
    rows = details.locator("tbody tr").evaluate_all(
        "rows => rows.map((row) => [...row.cells].map((cell) => cell.textContent))"
    )
    numbers = [[float(re.sub(r"[^0-9.]", "", cell)) for cell in row] for row in rows]
    return heads, np.array(numbers)


def assert_areas_are(chart: Any, shares: np.ndarray) -> None:
    """Check that the areas of a chart are these shares on top of each other, to half a pixel."""
    areas = chart.locator("path.area")
    assert areas.count() == len(shares)
    drawn = [path_points(areas.nth(index)) for index in range(len(shares))]
    times = shares.shape[1]
    # An area goes along one of its borders and back along the other.
    borders = [(points[:times, 1], points[times:, 1][::-1]) for points in drawn]
    assert all(len(points) == 2 * times for points in drawn)
    floor = max(float(border.max()) for pair in borders for border in pair)
    height = floor - min(float(border.min()) for pair in borders for border in pair)
    for (one, other), share in zip(borders, shares, strict=True):
        np.testing.assert_allclose(np.abs(one - other) / height, share, rtol=0, atol=1 / height)


@pytest.mark.parametrize(("row", "column"), [(0, 0), (2, 1)])
def test_a_click_shows_the_setting_over_time_beside_the_reference(
    page: Any, found: xr.Dataset, row: int, column: int
) -> None:
    click_cell(page, row, column)
    charts = page.locator(".setting-times svg.plot")
    assert charts.count() == 2
    expected = [shares_of(found, row, column), found["reference_over_time"].values.T]
    for index in range(2):
        assert drawn_share(pixels(charts.nth(index))) > 0.1
        assert_areas_are(charts.nth(index), expected[index])
    # The check can fail: the other one's shares are not taken for these.
    with pytest.raises(AssertionError):
        assert_areas_are(charts.nth(0), expected[1])
    heads, numbers = table_of(page)
    names = [str(name) for name in found["class_over_time"].values]
    assert heads == ["time", *(head for name in names for head in (name, f"{name}, reference"))]
    np.testing.assert_allclose(numbers[:, 0], found["time"], rtol=5e-3)
    for index in range(2):
        np.testing.assert_allclose(numbers[:, 1 + index :: 2] / 100, expected[index].T, atol=6e-4)


def test_the_pointer_reads_both_at_one_time(page: Any, found: xr.Dataset) -> None:
    click_cell(page, 1, 2)
    cover = page.locator(".setting-times rect.cover").nth(1)
    cover.scroll_into_view_if_needed()
    box = cover.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 20)
    words = page.locator(".setting-times .readout").inner_text()
    assert "30 s" in words
    middle = [shares_of(found, 1, 2)[:, 50], found["reference_over_time"].values[50]]
    for place, name in enumerate(found["class_over_time"].values.tolist()):
        both = [float(100 * share[place]) for share in middle]
        told = re.search(rf"(?:^|\s){re.escape(name)} ([\d.]+) %, ([\d.]+) %", words)
        assert (told is None) == (max(both) == 0), words
        if told is not None:
            assert [float(told[1]), float(told[2])] == pytest.approx(both, abs=0.06)


def test_the_keyboard_selects_a_setting(page: Any, found: xr.Dataset) -> None:
    click_cell(page, 1, 1)
    page.locator(".map-figure").focus()
    page.keyboard.press("ArrowUp")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Enter")
    page.wait_for_selector('[data-part=l1-map][data-shown="2,2"]')
    assert_areas_are(page.locator(".setting-times svg.plot").first, shares_of(found, 2, 2))
    # A table that is open stays open for the next setting, with its numbers.
    table_of(page)
    click_cell(page, 0, 2)
    last_row = page.locator(".setting-times details[open] tbody tr").last.inner_text()
    ends = [float(cell.strip(" %")) for cell in last_row.split("\t")[1::2]]
    np.testing.assert_allclose(ends, 100 * shares_of(found, 0, 2)[:, -1], atol=0.06)
    click_cell(page, 2, 2)
    label = page.locator(".setting-times svg.plot").first.get_attribute("aria-label")
    last = 100 * shares_of(found, 2, 2)[0, -1]
    assert f"{found['class_over_time'].values[0]} ends at {last:.3g} %" in label


@pytest.mark.parametrize(
    ("name", "options"),
    [("desktop", {}), ("phone", {"viewport": PHONE}), ("dark", {"color_scheme": "dark"})],
)
def test_it_fits_every_screen_and_theme(
    visit: Callable[..., Visit],
    report: Path,
    picture: Callable[..., None],
    name: str,
    options: dict[str, Any],
) -> None:
    page = visit(report.as_uri(), **options).open(report.as_uri())
    click_cell(page, 2, 0)
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    for chart in page.locator(".setting-times svg.plot").all():
        box = chart.bounding_box()
        assert box["width"] >= 240
        assert drawn_share(pixels(chart)) > 0.1
    picture(page, f"sensitivity-{name}")


def test_a_running_analysis_shows_the_settings_that_are_there(
    visit: Callable[..., Visit],
    picture: Callable[..., None],
    found: xr.Dataset,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Its server is asked for a setting; the reference is what there is of it so far."""
    study = dw.model.parse_study(found.attrs["study"])
    flow = dw.load_flow(FLOW)
    specification = {
        "study": study.to_dict(),
        "flow_sha256": "0",
        "flows_sha256": {},
        "kind": "sensitivity",
    }
    with RunDirectory(tmp_path / "run", specification=specification) as opened:
        store = opened.store("map")
        reference = dw.sensitivity_reference(study, flow, store=opened.store("reference"))
        monkeypatch.setattr(
            "driftwalk.assembly.sensitivity.settings.settings_per_unit", lambda *_: 4
        )
        with pytest.raises(KeyboardInterrupt):
            dw.sensitivity_map(study, flow, reference=reference, store=store, progress=stop_at(8))
        with served("view", opened.path) as server:
            page = visit(f"http://127.0.0.1:{server.port}/").open(server.address)
            for row, column in ((1, 0), (2, 1)):
                click_cell(page, row, column)
                charts = page.locator(".setting-times svg.plot")
                assert_areas_are(charts.nth(0), shares_of(found, row, column))
                assert_areas_are(charts.nth(1), found["reference_over_time"].values.T)
                bars = page.locator(".map-setting svg.classes").get_attribute("aria-label")
                ends = 100 * found["proportion"].values[column, row]
                told = (f"{n} {share:.3g} %" for n, share in zip(NAMES, ends, strict=True))
                assert bars == f"Outcomes of this setting: {', '.join(told)}"
            picture(page, "sensitivity-under-way")
            click_cell(page, 2, 2)
            shown = page.locator("[data-part=l1-map]")
            assert "has no outcomes yet" in shown.inner_text()
            assert shown.locator("svg.classes, .setting-times svg").count() == 0


def test_settings_on_no_map_are_chosen_from_a_list(
    visit: Callable[..., Visit], picture: Callable[..., None], tmp_path: Path
) -> None:
    """Words along an axis: each setting by its name, with the keyboard."""
    study = dw.Study(
        assembly={"blocks": 2, "duration_s": 20.0},
        sensitivity={"runs": 20, "reference_realisations": 2, "latching": ["none", "collision"]},
    )
    found = dw.sensitivity_map(study, dw.load_flow(FLOW), threads=1)
    path = tmp_path / "words.html"
    sections = sensitivity_sections(sensitivity=found)
    dw.write_report(page_of(sections), path)
    one = visit(path.as_uri())
    page = one.open(path.as_uri())
    shown = page.locator("section[data-kind=setting_times]")
    choice = shown.get_by_role("combobox", name="Setting")
    names = choice.locator("option").all_inner_texts()
    assert names == ["latching none", "latching collision"]
    choice.focus()
    for setting, key in ((0, "Home"), (1, "ArrowDown")):
        page.keyboard.press(key)
        shown.locator(f'[data-shown="{setting}"]').wait_for()
        counts = found["count_over_time"].isel(latching=setting) / 20
        share = counts.transpose("class_over_time", "time").values
        assert_areas_are(shown.locator("svg.plot").nth(0), share)
        assert_areas_are(shown.locator("svg.plot").nth(1), found["reference_over_time"].values.T)
    picture(page, "sensitivity-words")


def stop_at(settings: int) -> Callable[[int, int], None]:
    """Return a progress that interrupts when so many settings are done."""

    def told(done: int, _: int) -> None:
        if done >= settings:
            raise KeyboardInterrupt

    return told
