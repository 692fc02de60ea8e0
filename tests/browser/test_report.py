"""The report opened from a file, with the network cut off."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from synthetic_calibration import bundled_recording, synthetic_calibration

import driftwalk as dw
from browser.all_kinds import every_kind, page_of, with_texts
from browser.conftest import PHONE, Visit
from browser.pictures import assert_same_path, drawn_share, path_points, pixels
from driftwalk.page.sections.map import map_section
from driftwalk.schema.parameters import BLOCK

pytestmark = pytest.mark.browser

CELLS = [(0, 0), (4, 1), (2, 3)]


@pytest.fixture(scope="module")
def report(finished: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the report of the finished run."""
    path = tmp_path_factory.mktemp("report") / "report.html"
    dw.write_report(dw.report_page(finished), path)
    return path


@pytest.fixture(scope="module")
def calibration(finished: Path) -> xr.Dataset:
    """Return what the run found, on (y, x): the drag lies along x."""
    found = xr.load_dataset(finished / "calibration.nc", engine="h5netcdf")
    return found.transpose("force_std", "drag_coefficient", ...)


@pytest.fixture
def page(visit: Callable[..., Visit], report: Path) -> Any:
    """Open the report; nothing but the file itself may be asked for."""
    one = visit(report.as_uri())
    yield one.open(report.as_uri())
    assert one.requests == [report.as_uri()]


def click_cell(page: Any, row: int, column: int, shape: tuple[int, int]) -> None:
    """Click into the middle of a cell of the map."""
    page.locator(".map-figure").first.scroll_into_view_if_needed()
    area = page.locator(".map-figure svg image").first.bounding_box()
    rows, columns = shape
    x = area["x"] + area["width"] * (column + 0.5) / columns
    y = area["y"] + area["height"] * (rows - row - 0.5) / rows
    page.mouse.click(x, y)


@pytest.mark.parametrize(("row", "column"), CELLS)
def test_a_click_shows_the_setting_s_own_motion(
    page: Any, calibration: xr.Dataset, finished: Path, row: int, column: int
) -> None:
    click_cell(page, row, column, calibration["ks_distance"].shape)
    page.wait_for_selector(f'.map-setting[data-shown="{row},{column}"]')
    shown = page.locator("[data-part=map]")
    said = {name: float(shown.get_attribute(f"data-{name}")) for name in ("value", "x", "y")}
    assert said["value"] == np.float32(calibration["ks_distance"][row, column])
    assert said["x"] == float(calibration["drag_coefficient"][column])
    assert said["y"] == float(calibration["force_std"][row])
    # The recording's excerpt is the first of the two pictures, the setting's the second.
    trails = page.locator(".map-setting .excerpt .trail")
    assert trails.count() == 2
    excerpt = [calibration[f"excerpt_{axis}"].values[row, column] for axis in "xy"]
    assert_same_path(path_points(trails.nth(1)), *excerpt)
    recorded = xr.load_dataset(finished / "recording.nc", engine="h5netcdf", decode_times=False)
    beginning = recorded.sel(time=slice(None, recorded["time"].values[0] + 30.0))
    path = [beginning[axis].values[:, 0] for axis in "xy"]
    assert_same_path(path_points(trails.nth(0)), *path)
    for index in range(2):
        assert drawn_share(pixels(page.locator(".map-setting .excerpt svg").nth(index))) > 0.005


def test_settings_differ(page: Any, calibration: xr.Dataset) -> None:
    """The check above can fail: another setting's path is not taken for this one's."""
    click_cell(page, 0, 0, calibration["ks_distance"].shape)
    page.wait_for_selector('.map-setting[data-shown="0,0"]')
    points = path_points(page.locator(".map-setting .excerpt .trail").nth(1))
    other = [calibration[f"excerpt_{axis}"].values[1, 1] for axis in "xy"]
    with pytest.raises(AssertionError):
        assert_same_path(points, *other)


def test_a_click_near_the_optimum_shows_that_setting(
    visit: Callable[..., Visit], picture: Callable[..., None], tmp_path: Path
) -> None:
    """The right side follows tab, click and keys, and says that the motion is a neighbour's."""
    found = synthetic_calibration()
    sections = [map_section(found.assign(excerpts(found)), bundled_recording(rows=400))]
    path = tmp_path / "report.html"
    dw.write_report(page_of(sections), path)
    page = visit(path.as_uri()).open(path.as_uri())
    page.get_by_text("near the optimum").click()
    shown = page.locator("[data-part=map]")
    page.wait_for_selector("[data-part=map][data-view=refined]")
    fine = found["refined_ks_distance"].values.T
    rows, columns = fine.shape
    began = page.locator(".map-setting h3").inner_text()

    def said() -> tuple[float, float, float]:
        x, y, value = (float(shown.get_attribute(f"data-{name}")) for name in ("x", "y", "value"))
        return x, y, value

    # First what was found, then what is clicked.
    off = abs(found["refined_force_std"].values - sections[0]["found"]["y"])
    assert said()[1] == float(found["refined_force_std"][int(off.argmin())])
    row, column = rows - 2, 1
    click_cell(page, row, column, (rows, columns))
    page.wait_for_selector(f'.map-setting[data-shown="{row},{column}"]')
    picked = zip(BLOCK, (column, row), strict=True)
    drag, force = (float(found[f"refined_{name}"][k]) for name, k in picked)
    assert said() == pytest.approx((drag, force, fine[row, column]), rel=1e-6)
    assert page.locator(".map-setting h3").inner_text() != began
    assert page.locator(".map-figure .selected").count() == 2
    words = page.locator(".map-setting").inner_text()
    near = [
        int(abs(found[name].values - at).argmin())
        for name, at in zip(BLOCK, (drag, force), strict=True)
    ]
    assert "nearest setting of the whole box" in words
    assert f" = {float(found[BLOCK[0]][near[0]]):.4g}, " in words.split("whole box")[1]
    trail = path_points(page.locator(".map-setting .excerpt .trail").nth(1))
    excerpt = excerpts(found)
    assert_same_path(trail, *(excerpt[f"excerpt_{axis}"][1][tuple(near)] for axis in "xy"))
    picture(page, "near-the-optimum")
    page.locator(".map-figure").focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Enter")
    page.wait_for_selector(f'.map-setting[data-shown="{row},{column + 1}"]')
    page.get_by_text("whole box").first.click()
    page.wait_for_selector("[data-part=map][data-view=whole]")
    assert "nearest setting" not in page.locator(".map-setting").inner_text()


def excerpts(found: xr.Dataset) -> dict[str, Any]:
    """Return paths of every setting of a made-up calibration, in the tank."""
    plane = ("drag_coefficient", "force_std")
    steps = np.random.default_rng(2).normal(0.0, 2e-3, (2, *(found.sizes[n] for n in plane), 60))
    paths = dict(zip(("excerpt_x", "excerpt_y"), steps.cumsum(axis=-1), strict=True))
    kept = {name: ((*plane, "excerpt_sample"), path) for name, path in paths.items()}
    return {**kept, "excerpt_time": ("excerpt_sample", 0.1 * np.arange(60))}


def test_the_keyboard_does_the_same(page: Any, calibration: xr.Dataset) -> None:
    figure = page.locator(".map-figure")
    figure.focus()
    before = page.locator("[data-part=map]").get_attribute("data-row")
    page.keyboard.press("ArrowDown" if before != "0" else "ArrowUp")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Enter")
    page.wait_for_function(
        "before => document.querySelector('[data-part=map]').dataset.row !== before", arg=before
    )
    shown = page.locator("[data-part=map]")
    row, column = (int(shown.get_attribute(f"data-{name}")) for name in ("row", "column"))
    value = float(shown.get_attribute("data-value"))
    assert value == np.float32(calibration["ks_distance"][row, column])


def test_every_section_is_drawn(page: Any, picture: Callable[..., None]) -> None:
    for section in page.locator("section[data-kind]").all():
        words = section.inner_text()
        assert "cannot be shown" not in words, words
        figures = section.locator("svg[role=img], canvas[role=img]")
        if section.get_attribute("data-kind") in ("map", "trajectory", "flow", "lines"):
            assert figures.count() >= 1
        for figure in figures.all():
            if figure.is_visible():
                assert figure.get_attribute("aria-label")
                assert drawn_share(pixels(figure)) > 0.002
    picture(page, "report-desktop")


def test_on_a_phone_nothing_is_cut_off(
    visit: Callable[..., Visit], report: Path, picture: Callable[..., None]
) -> None:
    one = visit(report.as_uri(), viewport=PHONE)
    page = one.open(report.as_uri())
    width = page.evaluate("document.documentElement.scrollWidth")
    assert width <= PHONE["width"]
    picture(page, "report-phone")


def test_a_tap_reads_what_a_pointer_reads(
    visit: Callable[..., Visit], report: Path, picture: Callable[..., None]
) -> None:
    """A finger that taps does not move, and has left the chart before the click comes."""
    one = visit(report.as_uri(), viewport=PHONE, has_touch=True, is_mobile=True)
    page = one.open(report.as_uri())
    for kind in ("flow", "map", "lines"):
        section = page.locator(f"section[data-kind={kind}]").first
        cover = section.locator("svg .cover").first
        cover.scroll_into_view_if_needed()
        area = cover.bounding_box()
        assert section.locator(".readout .hint").count() == 1
        page.touchscreen.tap(area["x"] + 0.5 * area["width"], area["y"] + 0.2 * area["height"])
        section.locator(".readout .pair").first.wait_for()
    picture(page, "report-tapped")


def test_the_legend_and_the_table_are_those_of_the_part_shown(
    visit: Callable[..., Visit], tmp_path: Path
) -> None:
    """Near the optimum no best cell of the whole box is drawn, and the values are others."""
    found = synthetic_calibration()
    path = tmp_path / "report.html"
    dw.write_report(page_of([map_section(found)]), path)
    page = visit(path.as_uri()).open(path.as_uri())
    plot = page.locator(".map-plot")
    page.get_by_text("Values as a table").click()
    rows = plot.locator("tbody tr")
    for view, best, name in (
        ("near the optimum", 0, "refined_force_std"),
        ("whole box", 1, "force_std"),
    ):
        page.get_by_text(view, exact=True).first.click()
        page.wait_for_function(
            "count => document.querySelectorAll('.map-plot tbody tr').length === count",
            arg=found.sizes[name],
        )
        assert rows.count() == found.sizes[name]
        assert plot.locator(".legend").get_by_text("best cell").count() == best
        assert plot.locator("svg.plot .best").count() == best


def test_the_label_of_a_colour_bar_stays_in_its_picture(
    visit: Callable[..., Visit], tmp_path: Path
) -> None:
    """A long one has two lines: on a phone the bar is shorter than the words."""
    long = {"label": "distance from zero (standard deviations)", "unit": "1"}
    sections = [one | long for one in every_kind() if one["kind"] == "image_grid"]
    path = tmp_path / "report.html"
    dw.write_report(page_of(sections), path)
    page = visit(path.as_uri(), viewport=PHONE).open(path.as_uri())
    picture = page.locator("svg.plot").bounding_box()
    lines = page.locator(".colour-bar .label")
    assert lines.all_text_contents() == ["distance from zero", "(standard deviations)"]
    for line in lines.all():
        box = line.bounding_box()
        assert box["y"] >= picture["y"]
        assert box["y"] + box["height"] <= picture["y"] + picture["height"]
        assert box["x"] + box["width"] <= PHONE["width"]


def test_names_in_a_warning_are_set_as_code(visit: Callable[..., Visit], tmp_path: Path) -> None:
    page_data = page_of([one for one in every_kind() if one["kind"] == "warnings"])
    page_data["sections"][0]["items"] = ["state `block.mass_kg` and `tank.diameter_m`", "a ` alone"]
    path = tmp_path / "report.html"
    dw.write_report(page_data, path)
    page = visit(path.as_uri()).open(path.as_uri())
    assert page.locator(".warnings code").all_inner_texts() == ["block.mass_kg", "tank.diameter_m"]
    said = page.locator(".warnings li").all_inner_texts()
    assert said == ["state block.mass_kg and tank.diameter_m", "a ` alone"]


def test_in_the_dark(
    visit: Callable[..., Visit], report: Path, picture: Callable[..., None]
) -> None:
    one = visit(report.as_uri(), color_scheme="dark")
    page = one.open(report.as_uri())
    background = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert max(int(part) for part in re.findall(r"\d+", background)[:3]) < 80
    picture(page, "report-dark")


def test_hostile_words_stay_words(
    visit: Callable[..., Visit], finished: Path, tmp_path: Path
) -> None:
    hostile = "</script><script>document.title='taken'</script><img src=x onerror=alert(1)>"
    page_data = dw.report_page(finished)
    page_data["title"] = hostile
    for section in page_data["sections"]:
        section["title"] = section["note"] = hostile
        section["chapter"] = section["chapter"] and hostile
    path = tmp_path / "report.html"
    dw.write_report(page_data, path)
    one = visit(path.as_uri())
    page = one.open(path.as_uri())
    assert page.title().startswith(hostile)
    assert page.locator("h1").inner_text() == hostile
    assert page.locator("img").count() == 0
    assert np.all([hostile in words for words in page.locator("h2").all_inner_texts()])


HOSTILE = [
    "</script><script>window.taken=1</script>",
    "\"'><img src=x onerror=window.taken=1><svg onload=window.taken=1>",
    "javascript:window.taken=1",
    "<!--<script>{{constructor.constructor('window.taken=1')()}}${window.taken=1}",
    "__proto__",
    "url(http://127.0.0.1:1/x);color:red",
]
INTRUDERS = """() => [...document.querySelectorAll('*')].filter((e) =>
  ['IMG', 'IFRAME', 'OBJECT', 'EMBED', 'BASE', 'FORM', 'VIDEO'].includes(e.tagName)
  || [...e.attributes].some((a) => a.name.startsWith('on')
    || (['href', 'src', 'xlink:href', 'action'].includes(a.name)
      && !/^(#|data:image|blob:)/.test(a.value)))).map((e) => e.outerHTML)"""


@pytest.mark.parametrize("hostile", [False, True])
def test_no_text_of_any_section_becomes_more_than_text(
    visit: Callable[..., Visit], tmp_path: Path, hostile: bool
) -> None:
    """With the page's own policy switched off: nothing but the front end itself stands guard."""
    numbers = itertools.count()
    page_data = page_of(every_kind())
    if hostile:
        # Another number each, so that names that have to differ do.
        page_data = with_texts(
            page_data, lambda: f"{HOSTILE[(n := next(numbers)) % len(HOSTILE)]}{n or ''}"
        )
        assert next(numbers) > 100
    path = tmp_path / "report.html"
    dw.write_report(page_data, path)
    one = visit(path.as_uri(), bypass_csp=True)
    page = one.open(path.as_uri())
    shown = page.locator("section[data-kind]")
    assert shown.count() == len(page_data["sections"])
    assert "cannot be shown" not in page.locator("body").inner_text()
    # Everything that can be pressed, and the map's cells.
    for button in page.locator("button").all():
        if button.is_visible():
            button.click()
    for summary in page.locator("summary").all():
        summary.click()
    click_cell(page, 0, 1, (2, 2))
    page.mouse.move(300, 300)
    assert page.evaluate("window.taken") is None
    assert page.evaluate("Object.keys(Object.prototype)") == []
    assert page.evaluate(INTRUDERS) == []
    assert page.locator("script").count() == 2
    assert one.requests == [path.as_uri()]
