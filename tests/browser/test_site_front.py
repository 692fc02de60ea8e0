"""The front page of the site and a report: what they weigh, when they show, and who can read them.

The front page is rendered from its template without Sphinx, with the files next to it.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import jinja2
import pytest
from made_up_fit import made_up_check, made_up_fit
from playwright.sync_api import expect
from synthetic_calibration import bundled_recording

import driftwalk as dw
from browser.all_kinds import page_of
from browser.conftest import DESKTOP, PHONE, Visit
from browser.first_motion import LOOP, require_soon
from browser.readable import faults
from driftwalk.page.run_page import in_chapters
from driftwalk.page.sections.fit import fit_sections

pytestmark = pytest.mark.browser

ROOT = Path(__file__).resolve().parents[2]
SITE, BUILT = ROOT / "docs" / "site", ROOT / "build" / "site"
SORTS = (
    *("docs/index.html", "README.html", "docs/gallery/index.html", "docs/gallery/plot_03_fit.html"),
    *("docs/explanation/likelihood.html", "docs/reference/commands/fit.html"),
    *("docs/reference/python/names.html", "docs/reference/python/likelihood/fit_motion.html"),
)
"""A page of each sort: contents, text, gallery, equations, a command, Python names and one name."""
FRONT_BYTES, REPORT_BYTES, PAGE_BYTES = 150_000, 700_000, 1_500_000
"""The front page with all that it loads; a report of a short recording, program included; a page
of the site with its pictures and the program that sets its equations."""
FIRST_PAINT_MS = 1500
"""On a machine that does other things too; an idle one needs a tenth of it."""

FIRST_PAINT = (
    """() => performance.getEntriesByName("first-contentful-paint")[0]?.startTime ?? null"""
)


@pytest.fixture(scope="module")
def front(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    shutil.copytree(SITE / "static", folder / "_static")
    template = jinja2.Template((SITE / "theme" / "front.html").read_text(encoding="utf-8"))
    loop = (SITE / "theme" / "loop.svg").read_text(encoding="utf-8")
    page = folder / "index.html"
    page.write_text(template.render(loop=loop, playground=True, release="0"), encoding="utf-8")
    return page


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    fit = made_up_fit()
    sections = fit_sections(
        fit, recordings=[bundled_recording(rows=300)], check=made_up_check("the flow changes")
    )
    path = tmp_path_factory.mktemp("report") / "report.html"
    dw.write_report(page_of(in_chapters(sections, fit, "tank")), path)
    return path


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("viewport", [DESKTOP, PHONE], ids=["desktop", "phone"])
def test_the_front_page(
    visit: Callable[..., Visit], front: Path, viewport: dict[str, int], scheme: str
) -> None:
    one = visit(front.parent.as_uri(), viewport=viewport, color_scheme=scheme)
    one.page.goto(front.as_uri())
    check_readable(one.page)
    names = {Path(url).name for url in one.requests}
    assert sorted(names) == ["front.css", "front.js", "index.html", "logo.svg", "pages.js"]
    loaded = (front, *(front.parent / "_static" / name for name in names if name != front.name))
    assert sum(path.stat().st_size for path in loaded) < FRONT_BYTES


def test_the_loop_moves_at_once(browser: Any, front: Path) -> None:
    require_soon(browser, front.as_uri(), LOOP)


def test_the_loop_can_be_held_and_stands_still_for_those_who_ask(
    visit: Callable[..., Visit], front: Path
) -> None:
    page = visit(front.parent.as_uri()).page
    page.goto(front.as_uri())
    running = "document.getAnimations().filter((a) => a.playState === 'running').length"
    assert page.evaluate(running) > 10
    page.get_by_role("button", name="Pause").press("Enter")
    assert page.evaluate(running) == 0
    calm = visit(front.parent.as_uri(), reduced_motion="reduce").page
    calm.goto(front.as_uri())
    assert calm.evaluate(running) == 0


def test_the_colours_of_the_front_page_can_be_chosen(
    visit: Callable[..., Visit], front: Path
) -> None:
    """The choice is kept, by the name that the theme of the other pages has for it."""
    page = visit(front.parent.as_uri(), color_scheme="light").page
    page.goto(front.as_uri())
    ground = "getComputedStyle(document.body).backgroundColor"
    light = page.evaluate(ground)
    page.locator("#colours").press("Enter")
    assert page.evaluate(ground) != light
    page.reload()
    assert page.evaluate("localStorage.getItem('theme')") == "dark"
    assert page.evaluate(ground) != light
    expect(page.locator("#colours")).to_have_accessible_name("Colours: dark. Switch to light")


@pytest.mark.parametrize("viewport", [DESKTOP, PHONE], ids=["desktop", "phone"])
@pytest.mark.parametrize("keys", ["Control+k", "/"])
def test_keys_lead_to_the_search(
    visit: Callable[..., Visit], front: Path, keys: str, viewport: dict[str, int]
) -> None:
    """On the front page, and on a page of the built site where there is one."""
    built = BUILT / "docs" / "how-to" / "fit.html"
    for page_file in (front, *([built] if built.exists() else [])):
        page = visit("file://", viewport=viewport).page
        page.goto(page_file.as_uri())
        page.keyboard.press(keys)
        field = page.locator("input[name=q]")
        expect(field).to_be_focused()
        expect(field).to_be_in_viewport()
        expect(field).to_have_attribute("aria-keyshortcuts", "Control+K /")
        page.keyboard.type("a/b")
        expect(field).to_have_value("a/b")


def test_four_doors_lead_to_pages_that_are_there(visit: Callable[..., Visit], front: Path) -> None:
    page = visit(front.parent.as_uri()).page
    page.goto(front.as_uri())
    doors = page.locator(".doors h3 a")
    assert doors.count() == 4
    made = ("docs/gallery", "docs/reference/python", "docs/reference/commands", "playground.html")
    for link in page.locator("a[href]").all():
        target = str(link.get_attribute("href")).partition("#")[0]
        if target and not target.startswith(made):
            assert (ROOT / target).with_suffix(".md").is_file(), target


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_page_of_each_sort_of_the_built_site(visit: Callable[..., Visit], scheme: str) -> None:
    """After `make site`: what they weigh, and who can read them, at both widths."""
    if not (BUILT / "index.html").exists():
        pytest.skip("no site: run `make site`")
    one = visit(BUILT.as_uri(), color_scheme=scheme)
    for place in SORTS:
        before = len(one.requests)
        one.page.goto((BUILT / place).as_uri())
        assert version("driftwalk") in (one.page.locator(".sidebar-brand").text_content() or "")
        crumbs = one.page.get_by_role("navigation", name="Breadcrumbs").get_by_role("link")
        assert crumbs.count() >= (0 if place == SORTS[0] else 2), place
        loaded = {unquote(urlsplit(url).path) for url in one.requests[before:]}
        assert sum(Path(path).stat().st_size for path in loaded) < PAGE_BYTES, place
        for viewport in (DESKTOP, PHONE):
            one.page.set_viewport_size(viewport)
            check_readable(one.page)


def test_a_search_of_the_built_site_opened_from_a_file(visit: Callable[..., Visit]) -> None:
    """A browser refuses to fetch a file, so the theme's preview of each hit must not ask for it."""
    if not (BUILT / "index.html").exists():
        pytest.skip("no site: run `make site`")
    one = visit(BUILT.as_uri(), viewport=PHONE)
    one.page.goto(f"{BUILT.as_uri()}/search.html?q=drag")
    one.page.locator("ul.search a").nth(5).wait_for()
    assert one.page.locator("ul.search .context").count() == 0
    check_readable(one.page)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_report_begins_with_its_answer(
    visit: Callable[..., Visit], report: Path, scheme: str
) -> None:
    one = visit(report.as_uri(), viewport={"width": 1280, "height": 900}, color_scheme=scheme)
    page = one.page
    page.goto(report.as_uri())
    page.wait_for_selector("html[data-ready=yes]")
    assert report.stat().st_size < REPORT_BYTES
    # On the first screen: verdict, numbers and the picture.
    for part in (".verdict", ".numbers", ".answer-picture svg"):
        box = page.locator(part).first.bounding_box()
        assert box is not None
        assert box["y"] + box["height"] < 900, part
    assert page.locator("details.chapter[open]").count() == 0
    check_readable(page)
    page.locator("details.chapter > summary").first.press("Enter")
    page.wait_for_selector("details.chapter[open] .body *")
    one.open(report.as_uri())
    check_readable(page)


def test_a_link_into_a_chapter_opens_it(visit: Callable[..., Visit], report: Path) -> None:
    page = visit(report.as_uri(), viewport=PHONE).page
    page.goto(f"{report.as_uri()}#check")
    page.wait_for_selector("#check td[data-column]")
    assert page.locator("details.chapter[open]").count() == 1
    assert page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
    # On a phone each cell names its column, and none is beyond the edge.
    for cell in page.locator("#check td").all():
        box = cell.bounding_box()
        assert box is not None
        assert box["x"] + box["width"] <= PHONE["width"]


def check_readable(page: Any) -> None:
    """Check contrast, names and width of what is shown, and when it was first painted."""
    assert faults(page) == []
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    painted = page.evaluate(FIRST_PAINT)
    assert painted is None or painted < FIRST_PAINT_MS
