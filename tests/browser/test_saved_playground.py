"""The saved playground in Chromium: from one file, offline, fast enough, with the native bits."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser_tank import PRELUDE, TRACE, Move, moved_in_browser, require_same_bits
from playwright.sync_api import expect

import driftwalk as dw
from browser.conftest import PHONE, Visit
from browser.first_motion import TANK, require_soon
from browser.pictures import pixels
from browser.readable import reached_by_tab
from driftwalk.cli.main import main
from driftwalk.datasets import tank30_flow
from driftwalk.page.html import WORKER, bundle_file
from driftwalk.viewer import PlaySource, save_playground

pytestmark = pytest.mark.browser

LOCAL = ("file://", "blob:")
MOST_BYTES = 1_500_000
"""Of the file as a server would send it, compressed."""
MOVING = "() => +(document.querySelector('.tank-canvas')?.dataset.time ?? 0) > 0"
WATCH_DRAWING = """() => {
  const [ask, took] = [requestAnimationFrame.bind(window), (window.drawing = [])];
  window.requestAnimationFrame = (draw) => ask((now) => {
    const began = performance.now();
    draw(now);
    took.push(performance.now() - began);
  });
}"""
STEPPING = (
    PRELUDE
    + """
  const tank = new LocalTank(model, given.values);
  return Array.from({ length: 300 }, () => {
    const began = performance.now();
    tank.advance(20 / 60);
    tank.outcome(tank.read());
    return performance.now() - began;
  });
}"""
)
"""What the worker does for each picture at 20 times real time, 60 times a second [ms]."""
FRAME_MS = 1000.0 / 60.0
SPEED = """() => new Promise((done) => {
  const tank = document.querySelector('.tank-canvas');
  const [time, began] = [+tank.dataset.time, performance.now()];
  setTimeout(() => done([
    1e3 * (+tank.dataset.time - time) / (performance.now() - began), +tank.dataset.rate]), 2000);
})"""


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Save the playground of the bundled example."""
    path = tmp_path_factory.mktemp("saved") / "tank.html"
    assert main(["play", "--save", str(path)]) == 0
    return path


def test_the_file_is_small_and_moves_at_once(
    saved: Path, browser: Any, visit: Callable[..., Visit], picture: Callable[..., None]
) -> None:
    assert len(gzip.compress(saved.read_bytes())) < MOST_BYTES
    require_soon(browser, saved.as_uri(), TANK)
    one = visit(LOCAL)
    page = one.open(saved.as_uri())
    page.wait_for_function(MOVING)
    assert {url.split(":")[0] for url in one.requests} <= {"file", "blob"}
    page.wait_for_selector("[data-steps]")
    picture(page, "saved-playground-desktop")


@pytest.mark.study
def test_twenty_times_real_time_with_16_blocks(saved: Path, visit: Callable[..., Visit]) -> None:
    """In every run: that it moves, and how soon."""
    page = visit(LOCAL).open(f"{saved.as_uri()}#blocks=16&speed=20&latching=none")
    page.wait_for_function(MOVING)
    best = [0.0, 0.0]
    # Other work on the machine only slows it down.
    for _ in range(15):
        best = [max(pair) for pair in zip(best, page.evaluate(SPEED), strict=True)]
        if best[0] >= 19.0 and best[1] >= 55.0:
            break
    assert best[0] >= 19.0
    assert best[1] >= 55.0


def test_a_picture_of_16_blocks_takes_less_than_its_share_of_a_second(
    saved: Path, browser: Any, visit: Callable[..., Visit]
) -> None:
    """At 60 pictures a second and 20 times real time; other work on the machine waits in between.

    The step runs in a worker, next to the drawing: their sum is more than either has to hold.
    """
    one = visit(LOCAL)
    one.page.add_init_script(f"({WATCH_DRAWING})()")
    page = one.open(f"{saved.as_uri()}#blocks=16&speed=20&latching=none")
    page.wait_for_function("() => window.drawing.length >= 200")
    drawing = float(np.median(page.evaluate("window.drawing")[20:]))
    worker = browser.new_page()
    worker.add_script_tag(content=bundle_file(WORKER))
    study = dw.Study(assembly={"blocks": 16, "latching": "none"})
    given = moved_in_browser(PlaySource(study, tank30_flow()), [])
    stepping = float(np.median(worker.evaluate(STEPPING, given)[20:]))
    worker.close()
    print(f"median of a picture: step {stepping:.1f} ms, drawing {drawing:.1f} ms")
    assert stepping > 0.0
    assert stepping + drawing < FRAME_MS


def test_the_bits_are_those_of_the_native_core(browser: Any) -> None:
    study = dw.Study(assembly={"blocks": 4}, forces={"force_std_N": 8e-4})
    moves = [Move(10.0), Move(5.0, {"blocks": 6, "drag_coefficient": 0.5})]
    page = browser.new_page()
    page.add_script_tag(content=bundle_file(WORKER))
    found = page.evaluate(TRACE, moved_in_browser(PlaySource(study, tank30_flow()), moves))
    page.close()
    require_same_bits(dw.LiveTank(study, tank30_flow()), moves, found)


def test_a_rectangle_is_drawn_with_its_sides_and_as_it_lies(
    visit: Callable[..., Visit], tmp_path: Path
) -> None:
    """One at rest, pixel by pixel, against where its pose and its sides put it."""
    study = dw.Study(
        block={"shape": "rectangle:10x3cm"}, forces={"force_std_N": 0.0}, assembly={"blocks": 1}
    )
    source = PlaySource(study, dw.uniform_flow(0.0, 0.0))
    page = visit(LOCAL).open(save_playground(source, tmp_path / "one.html").as_uri())
    page.wait_for_function(MOVING)
    seen = pixels(page.locator("canvas.tank-canvas"))
    # The tank of 30 cm, and 3 % on each side.
    place = (np.indices(seen.shape[:2]) + 0.5) / len(seen) * 0.318 - 0.159
    tank = source.tank
    away = (place[1] - tank.x) + 1j * (-place[0] - tank.y)
    own = away * np.exp(-1j * tank.theta)
    expected = (np.abs(own.real) < 0.05) & (np.abs(own.imag) < 0.015)
    inside = np.hypot(*place) < 0.14
    drawn = (np.abs(seen - seen[len(seen) // 20, len(seen) // 2]).max(axis=2) > 0.05) & inside
    # The outline is a pixel wide; a square or a mirrored turn shares less than half.
    assert (drawn & expected).sum() > 0.9 * (drawn | expected & inside).sum()


def test_a_link_has_the_settings(saved: Path, visit: Callable[..., Visit]) -> None:
    hostile = "&speed=<b>&force_std=1e9&latching=sideways&seed=-4"
    page = visit(LOCAL).open(f"{saved.as_uri()}#blocks=7&drag_coefficient=0.5{hostile}")
    canvas = page.locator("canvas.tank-canvas")
    expect(canvas).to_have_attribute("data-blocks", "7")
    expect(page.locator("label", has_text="drag coefficient")).to_contain_text("0.5")
    expect(page.locator("label", has_text="speed")).to_contain_text("1 ×")
    # By the keyboard: one step more.
    page.locator("input[name=blocks]").focus()
    page.keyboard.press("ArrowRight")
    expect(canvas).to_have_attribute("data-blocks", "8")
    page.click("[data-action=restart]")
    page.wait_for_function("() => location.hash.includes('seed=2')")
    again = visit(LOCAL).open(page.url)
    expect(again.locator("canvas.tank-canvas")).to_have_attribute("data-blocks", "8")
    # A value that is none of the link's is none of the page's.
    assert "force_std" not in page.url


def test_outcomes_are_counted(saved: Path, visit: Callable[..., Visit]) -> None:
    page = visit(LOCAL).open(saved.as_uri())
    page.click("[data-action=count]")
    page.wait_for_function("() => +document.querySelector('[data-done]')?.dataset.done >= 20")
    counts = json.loads(page.locator("[data-done]").get_attribute("data-counts") or "{}")
    assert sum(counts.values()) >= 20
    assert set(counts) <= {"I", "O", "T", "S", "L", "I3+1", "L3+1", "2+2", "2+1+1", "1+1+1+1"}
    expect(page.get_by_role("img", name="Shares of the outcome classes")).to_be_visible()
    page.locator("input[name=blocks]").focus()
    page.keyboard.press("ArrowRight")
    expect(page.get_by_text("The settings have changed since then.")).to_be_visible()


def test_the_table_of_outcomes_stays_open_and_focused_as_the_counts_go_on(
    saved: Path, visit: Callable[..., Visit]
) -> None:
    page = visit(LOCAL).open(saved.as_uri())
    page.wait_for_selector("[data-steps]")
    page.click("[data-action=count]")
    page.wait_for_selector("[data-done]")
    page.click("[data-done] summary")
    page.evaluate("document.querySelector('[data-done] details').dataset.before = ''")
    page.evaluate("document.querySelector('[data-action=count]').click()")
    page.wait_for_selector("[data-done] details:not([data-before])")
    assert page.evaluate("document.activeElement.matches('[data-done] details[open] > summary')")
    page.wait_for_selector("[data-done] table")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_keyboard_leads_to_every_control(
    saved: Path, visit: Callable[..., Visit], scheme: str
) -> None:
    """With outcomes counted and the link shown; that all can be read is checked of every visit."""
    page = visit(LOCAL, color_scheme=scheme).open(saved.as_uri())
    page.wait_for_selector("[data-steps]")
    page.click("[data-action=count]")
    page.click("[data-action=link]")
    page.wait_for_selector("[data-done]")
    names = {str(one.get_attribute("name")) for one in page.locator("input").all()}
    words = {one.inner_text().strip() for one in page.locator("button[data-action]").all()}
    assert names | words <= reached_by_tab(page)


def test_nothing_is_cut_off_on_a_phone(
    saved: Path, visit: Callable[..., Visit], picture: Callable[..., None]
) -> None:
    page = visit(LOCAL, viewport=PHONE).open(saved.as_uri())
    page.wait_for_function(MOVING)
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    picture(page, "saved-playground-phone")
