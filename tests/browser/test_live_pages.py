"""The live pages in Chromium, each with its real server: a run, a tracker, the playground."""

from __future__ import annotations

import contextlib
import itertools
import json
import re
import shutil
import signal
import socketserver
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from command_line import FLOW, RECORDING, end, here, start
from finished_run import write_finished_run
from page_server import PageServer, served
from playwright.sync_api import expect
from ports import held_port
from signals_at_units import after_units, go_on, halted, until_halted

import driftwalk as dw
from browser.conftest import PHONE, Visit
from browser.pictures import drawn_share, pixels
from driftwalk.core.files.rundir import RunDirectory
from driftwalk.schema import build_trajectory
from driftwalk.sweep import grid

pytestmark = pytest.mark.browser

HOSTILE = "<script>document.title='taken'<|script><img src=x onerror=alert(1)>&\"'"
# 441 settings, seven work units: a few seconds.
SWEEP = """\
[calibration]
drag_coefficient_min = 0.2
drag_coefficient_max = 0.6
drag_coefficient_step = 0.02
force_std_min_N = "0.2mN"
force_std_max_N = "1mN"
force_std_step_N = "0.04mN"
replicates = 1
refine = "none"
bootstrap = 0
"""
TRACKED_FRAMES = 160
APART_FRAMES = 80
"""Frames during which the two blocks are certainly apart."""
# A tracker that waits for a line before each frame, until there are no more to come.
FRAME_BY_FRAME = """
import sys
from driftwalk.track import TwoColourDetector
detect = TwoColourDetector.detect
TwoColourDetector.detect = lambda self, image: (sys.stdin.readline(), detect(self, image))[1]
"""
FURTHER = """([progress, href]) => {
  const image = document.querySelector('.map-figure svg image');
  const further = +document.documentElement.dataset.progress > progress;
  return further && image !== null && image.getAttribute('href') !== href;
}"""
A_SECOND = """(name) => new Promise((done) => {
  const tank = document.querySelector('.tank-canvas');
  const [first, began] = [+tank.dataset[name], performance.now()];
  const rate = () => 1e3 * (+tank.dataset[name] - first) / (performance.now() - began);
  setTimeout(() => done(rate()), 1000);
})"""


@pytest.fixture
def port() -> Iterator[int]:
    """Return a port for a server that comes later, or comes back."""
    with held_port() as held:
        yield held


def data(page: Any, name: str) -> str:
    """Return what the document says of itself."""
    return str(page.evaluate("name => document.documentElement.dataset[name] ?? ''", name))


def until_tank(page: Any, name: str, above: float) -> None:
    """Wait until the tank's picture says a number above another one."""
    page.wait_for_function(
        "([name, above]) => +document.querySelector('.tank-canvas').dataset[name] > above",
        arg=[name, above],
    )


def best_of_some_seconds(page: Any, name: str, enough: float) -> float:
    """Return how fast a number of the tank's picture grows [1/s]; other work only slows it down."""
    rates: list[float] = []
    while len(rates) < 20 and max(rates, default=0.0) < enough:
        rates.append(page.evaluate(A_SECOND, name))
    return max(rates)


def wait_for(page: Any, name: str, value: str, *, seconds: float = 20.0) -> None:
    page.wait_for_function(
        "([name, value]) => document.documentElement.dataset[name] === value",
        arg=[name, value],
        timeout=1e3 * seconds,
    )


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[PageServer]:
    """Serve a finished run from a directory with a hostile name."""
    folder = tmp_path_factory.mktemp("hostile") / HOSTILE
    with served("view", write_finished_run(folder)) as started:
        yield started


def test_a_hostile_name_is_only_text(server: PageServer, visit: Callable[..., Visit]) -> None:
    one = visit(f"http://127.0.0.1:{server.port}/")
    dialogs: list[str] = []
    one.page.on("dialog", lambda dialog: (dialogs.append(dialog.message), dialog.dismiss()))
    page = one.open(server.address)
    assert page.locator(".subtitle").inner_text() == HOSTILE
    assert page.locator("img").count() == 0
    assert HOSTILE in page.title()
    assert dialogs == []
    # Nothing but the page, the front end and its WebSocket was asked for.
    names = {url.partition("?")[0].rpartition("/")[2] for url in one.requests}
    assert names == {"", "driftwalk.js", "driftwalk.css", "ws"}


@pytest.mark.parametrize(("size", "name"), [(None, "desktop"), (PHONE, "phone")])
def test_a_finished_run(
    server: PageServer,
    visit: Callable[..., Visit],
    picture: Callable[..., None],
    size: dict[str, int] | None,
    name: str,
) -> None:
    one = visit(f"http://127.0.0.1:{server.port}/", **({} if size is None else {"viewport": size}))
    page = one.open(server.address)
    wait_for(page, "finished", "yes")
    assert drawn_share(pixels(page.locator(".map-figure svg"))) > 0.3
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    picture(page, f"run-{name}")


def test_the_page_follows_a_sweep_from_begin_to_end(
    visit: Callable[..., Visit],
    picture: Callable[..., None],
    tmp_path: Path,
) -> None:
    """The sweep halts after each unit until the page was looked at: no machine is too fast."""
    study, run = tmp_path / "study.toml", tmp_path / "run"
    study.write_text(SWEEP)
    words = ("calibrate", RECORDING, "--flow", FLOW, "--study", study, "--threads", 1, "-o", run)
    begun = start(*words, before=after_units(signal.SIGSTOP, 1, 2, 3, 4, 5))
    with halted(begun) as sweep, served("view", run) as server:
        page = visit(f"http://127.0.0.1:{server.port}/").open(server.address)
        map_image = page.locator(".map-figure svg image").first
        seen, pictures = [], []
        for _ in range(4):
            map_image.wait_for()
            seen.append(float(data(page, "progress")))
            pictures.append(map_image.get_attribute("href"))
            go_on(sweep)
            until_halted(sweep)
            # The words about a unit come before its picture.
            page.wait_for_function(FURTHER, arg=[seen[-1], pictures[-1]])
        assert data(page, "finished") == "no"
        picture(page, "sweep-under-way", whole=False)
        go_on(sweep)
        assert end(sweep).code == 0
        wait_for(page, "progress", "1")
        # It went up all the time, from the beginning, and the map with it.
        assert 0.0 < seen[0] < 0.3
        assert all(np.diff(seen) > 0)
        assert len(set(pictures)) == len(pictures)
        found = xr.load_dataset(run / "calibration.nc", engine="h5netcdf")
        page.wait_for_selector("#manifest")
        shown = page.locator("[data-part=map]")
        row, column = (int(shown.get_attribute(f"data-{name}")) for name in ("row", "column"))
        value = float(shown.get_attribute("data-value"))
        assert value == np.float32(found["ks_distance"][column, row])


def test_class_proportions_fill_as_runs_end(visit: Callable[..., Visit], tmp_path: Path) -> None:
    study = dw.apply_overrides(dw.Study(), {"assembly.blocks": 2, "assembly.runs": 40})
    specification = {
        "study": study.to_dict(),
        "flow_sha256": "0",
        "calibration_sha256": None,
        "kind": "assembly",
    }
    with RunDirectory(tmp_path / "run", specification=specification) as run:
        store, units = run.store("fixed"), grid(run=np.arange(40)).units(20)
        with served("view", run.path) as server:
            page = visit(f"http://127.0.0.1:{server.port}/").open(server.address)
            assert data(page, "progress") == "0"
            section = page.locator("#classes")
            for unit, together in zip(units, (15, 5), strict=True):
                joined = np.arange(20) < together
                store.write(
                    unit,
                    {
                        "status": np.zeros(20),
                        "cell": np.stack([[0 * joined, 0 * joined], [1 * joined, 0 * joined]]).T,
                        "assembly": np.stack([0 * joined, np.where(joined, 0, 1)], axis=1),
                    },
                )
                share = 100.0 * (0.75 if unit is units[0] else 0.5)
                expect(section).to_contain_text(f"{share:.3g} %")
            wait_for(page, "progress", "0.95")
            assert "40" in section.inner_text()


def test_the_page_comes_back_when_the_server_does(
    visit: Callable[..., Visit], finished: Path, port: int
) -> None:
    one = visit(f"http://127.0.0.1:{port}/")
    with served("view", finished, port=port) as server:
        page = one.open(server.address)
        wait_for(page, "connection", "open")
    wait_for(page, "connection", "lost")
    # What was there stays readable meanwhile.
    assert page.locator("section[data-kind=map]").is_visible()
    with served("view", finished, port=port):
        wait_for(page, "connection", "open")
        assert page.locator("section[data-kind=map]").is_visible()


def test_a_page_becomes_that_of_another_server_on_its_port(
    visit: Callable[..., Visit], finished: Path, port: int
) -> None:
    """The playground is ended and a run is viewed in its place; the tab was open all the time."""
    one = visit(f"http://127.0.0.1:{port}/")
    with served("play", "--blocks", 2, port=port) as server:
        page = one.open(server.address)
        until_tank(page, "frames", 2)
    with served("view", finished, port=port):
        page.locator("section[data-kind=map]").wait_for()
        assert page.locator("h1").inner_text() == "Calibration"
        assert page.locator("canvas.tank-canvas").count() == 0


def test_a_run_that_is_taken_away_is_not_called_running(
    visit: Callable[..., Visit], finished: Path, tmp_path: Path
) -> None:
    run, aside = tmp_path / "run", tmp_path / "aside"
    shutil.copytree(finished, run)
    with served("view", run) as server:
        page = visit(f"http://127.0.0.1:{server.port}/").open(server.address)
        wait_for(page, "finished", "yes")
        run.rename(aside)
        words = page.locator(".head .state")
        expect(words).to_have_text("the run is no longer there; the page waits for it")
        # What was there can still be read.
        assert page.locator("section[data-kind=map]").is_visible()
        aside.rename(run)
        wait_for(page, "finished", "yes")
        expect(words).to_be_hidden()


def test_browsers_that_go_away_leave_the_server_well(
    server: PageServer, browser: Any, visit: Callable[..., Visit]
) -> None:
    for wait in ("commit", "domcontentloaded", "load") * 3:
        context = browser.new_context()
        context.new_page().goto(server.address, wait_until=wait)
        context.close()
    page = visit(f"http://127.0.0.1:{server.port}/").open(server.address)
    wait_for(page, "finished", "yes")
    assert server.process.poll() is None


@pytest.fixture(scope="module")
def playground() -> Iterator[PageServer]:
    """Serve the playground."""
    with served("play", "--blocks", 3) as started:
        yield started


def turn(page: Any, name: str, share: float) -> None:
    """Move a slider to a share of its way, as a hand would."""
    slider = page.locator(f"input[name={name}]")
    slider.scroll_into_view_if_needed()
    box = slider.bounding_box()
    page.mouse.click(box["x"] + box["width"] * share, box["y"] + box["height"] / 2)


def test_a_slider_changes_the_picture(
    playground: PageServer, visit: Callable[..., Visit], picture: Callable[..., None]
) -> None:
    page = visit(f"http://127.0.0.1:{playground.port}/").open(playground.address)
    canvas = page.locator("canvas.tank-canvas")
    until_tank(page, "frames", 20)
    assert canvas.get_attribute("data-blocks") == "3"
    assert drawn_share(pixels(canvas)) > 0.1

    page.click("[data-action=pause]")
    page.wait_for_selector("[data-action=run]")
    still = pixels(canvas)
    page.wait_for_timeout(300)
    # Paused: the same to the last pixel.
    assert np.array_equal(pixels(canvas), still)
    page.click("[data-action=run]")
    page.wait_for_selector("[data-action=pause]")

    turn(page, "blocks", 0.4)
    until_tank(page, "blocks", 6)
    assert np.abs(pixels(canvas) - still).max() > 0.2
    turn(page, "speed", 0.9)
    # Much faster than real time, whatever else the machine does.
    assert best_of_some_seconds(page, "time", 3.0) > 3.0
    page.wait_for_selector("[data-steps]")
    picture(page, "play-desktop")


def test_bodies_of_a_motion_model(
    visit: Callable[..., Visit], picture: Callable[..., None]
) -> None:
    """A slider for each parameter; the trails fill more of the picture than the dots alone."""
    choices = ("--parameter", "speed=0.02", "--parameter", "turn_rate=-1,1")
    with served("play", "--model", "active", *choices) as started:
        page = visit(f"http://127.0.0.1:{started.port}/").open(started.address)
        canvas = page.locator("canvas.tank-canvas")
        until_tank(page, "frames", 1)
        assert canvas.get_attribute("data-blocks") == "4"
        assert canvas.get_attribute("aria-label") == "The tank: bodies and their trails"
        names = [knob.get_attribute("name") for knob in page.locator("input[type=range]").all()]
        wanted = [f"parameter:{name}" for name in ("speed", "rotational_diffusion", "turn_rate")]
        assert names == [*wanted, "bodies", "speed"]
        page.click("[data-action=pause]")
        page.wait_for_selector("[data-action=run]")
        page.click("[data-action=restart]")
        page.wait_for_selector(".tank-canvas[data-time='0']")
        alone = drawn_share(pixels(canvas))
        page.click("[data-action=run]")
        until_tank(page, "time", 2.0)
        assert drawn_share(pixels(canvas)) > alone
        turn(page, '"parameter:speed"', 0.7)
        expect(page.locator("label", has_text="speed").first).to_contain_text("cm/s")
        turn(page, "bodies", 0.9)
        expect(canvas).to_have_attribute("data-blocks", re.compile("2[0-9]|3[0-2]"))
        picture(page, "play-model-desktop")


@pytest.mark.study
def test_thirty_pictures_a_second_with_64_blocks(visit: Callable[..., Visit]) -> None:
    """In a tank of 1.2 m. In every run: a few blocks, faster than real time."""
    with served("play", "--tank", "1.2m", "--blocks", 64) as started:
        page = visit(f"http://127.0.0.1:{started.port}/").open(started.address)
        until_tank(page, "frames", 10)
        assert best_of_some_seconds(page, "frames", 30.0) >= 30.0


@pytest.mark.study
def test_the_blocks_come_near_the_recording(
    visit: Callable[..., Visit],
) -> None:
    """One block with the parameters of the recording's truth, then with another drag.

    In every run the server's distances are tested (tests/unit/viewer/test_playground.py), and that
    the page shows steps.
    """
    with served("play", "--blocks", 1) as started:
        page = visit(f"http://127.0.0.1:{started.port}/").open(started.address)
        turn(page, "speed", 0.99)
        panel = page.locator("[data-steps]")

        def until_steps(condition: str) -> None:
            page.wait_for_function(
                f"() => +document.querySelector('[data-steps]')?.dataset.steps {condition}",
                timeout=120_000,
            )

        def distance() -> float:
            return float(panel.get_attribute("data-ks-distance"))

        until_steps("> 3000")
        # Independent runs of half an hour are 0.016 apart; five minutes of one, three times that.
        assert distance() < 0.1
        # At rest meanwhile: the steps of the new drag are all that is there, however late it looks.
        page.click("[data-action=pause]")
        page.wait_for_selector("[data-action=run]")
        turn(page, "drag_coefficient", 0.6)
        until_steps("== 0")
        page.click("[data-action=run]")
        until_steps("> 1500")
        assert distance() > 0.3


def test_the_playground_on_a_phone(
    playground: PageServer, visit: Callable[..., Visit], picture: Callable[..., None]
) -> None:
    page = visit(f"http://127.0.0.1:{playground.port}/", viewport=PHONE).open(playground.address)
    until_tank(page, "frames", 5)
    page.wait_for_selector("[data-steps]")
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    picture(page, "play-phone")


@pytest.fixture(scope="module")
def video(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a video of two blocks that meet, and the markers in it."""
    pytest.importorskip("cv2")
    time = 0.1 * np.arange(TRACKED_FRAMES)
    apart = np.maximum(0.06 - 0.003 * time, 0.03)
    x = np.stack([-0.02 + 0 * time, -0.02 + apart], axis=1)
    y = np.stack([0.0005 * time, 0.0005 * time], axis=1)
    theta = np.stack([0 * time, np.full(TRACKED_FRAMES, np.pi / 2)], axis=1)
    place = tmp_path_factory.mktemp("video")
    settings = dw.video_settings("moderate", width_px=480, height_px=360, px_per_m=1100.0)
    dw.write_video(place / "video.mkv", build_trajectory(time, x, y, theta), settings)
    done = here(
        *("markers", "teach", place / "video.mkv", "--tank", "30cm", "--side", "3cm"),
        *("-o", place / "m.toml"),
    )
    assert done.code == 0, done.err
    return place


def test_a_tracker_is_watched(
    visit: Callable[..., Visit],
    picture: Callable[..., None],
    video: Path,
    port: int,
    request: pytest.FixtureRequest,
) -> None:
    """The tracker waits at each frame until it is told to go on: neither side is too fast."""
    with served("view", f"127.0.0.1:{port}") as server:
        page = visit(f"http://127.0.0.1:{server.port}/").open(server.address)
        readout = page.locator(".live-tank .readout")
        expect(readout).to_contain_text("waiting for a tracker")
        tracker = start(
            *("watch", video / "video.mkv", "--markers", video / "m.toml"),
            *("--tank", "30cm", "--bodies", 2, "--side", "3cm", "--live", port),
            before=FRAME_BY_FRAME,
            stdin=subprocess.PIPE,
        )
        request.addfinalizer(tracker.kill)

        def one_frame() -> None:
            tracker.stdin.write("\n")
            tracker.stdin.flush()

        canvas = page.locator("canvas.tank-canvas")
        page.wait_for_selector("input[name=video]:enabled")
        for number in range(6):
            one_frame()
            wait_for(page, "frame", str(number))
        plain = pixels(canvas)
        assert drawn_share(plain) > 0.05
        page.check("input[name=video]")
        for _ in range(APART_FRAMES):
            one_frame()
            page.wait_for_timeout(300)
            if np.abs(pixels(canvas) - plain).mean() > 0.02:
                break
        else:
            raise AssertionError("the camera's picture does not come to lie under the blocks")
        assert data(page, "outcome") == "1+1"
        picture(page, "live-desktop")
        # From here on the tracker goes as fast as it can.
        assert end(tracker).code == 0
        expect(readout).to_contain_text("has ended")
        until_tank(page, "time", 0.1 * (TRACKED_FRAMES - 1) - 0.01)
        assert float(canvas.get_attribute("data-time")) == pytest.approx(
            0.1 * (TRACKED_FRAMES - 1), abs=0.01
        )
        assert data(page, "outcome") == "2"
        assert "joined" in page.locator(".events").inner_text()


@contextlib.contextmanager
def watched(tracker: type[socketserver.StreamRequestHandler]) -> Iterator[PageServer]:
    """Serve the live page of a tracker of the test's own."""
    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), tracker) as listening:
        listening.daemon_threads = True
        threading.Thread(target=listening.serve_forever, daemon=True).start()
        with served("view", f"127.0.0.1:{listening.server_address[1]}") as server:
            yield server
        listening.shutdown()


class CarelessTracker(socketserver.StreamRequestHandler):
    """A tracker that sends one of three blocks with a number that is none, and an odd greeting."""

    def handle(self) -> None:
        good = {"seen": True, "x_m": 0.05, "y_m": 0.0, "theta_rad": 0.0}
        bodies = [{**good, "id": "a"}, {**good, "id": "b", "x_m": "?"}, {**good, "id": "c"}]
        hello = {"type": "hello", "format": "driftwalk live", "version": 1, "tank": "round"}
        with contextlib.suppress(OSError):
            self.wfile.write(json.dumps(hello).encode() + b"\n")
            for number in itertools.count():
                frame = {"type": "frame", "frame": number, "time_s": 0.1 * number}
                self.wfile.write(json.dumps({**frame, "bodies": bodies}).encode() + b"\n")
                time.sleep(0.05)


def test_one_odd_block_does_not_cost_the_others(visit: Callable[..., Visit]) -> None:
    with watched(CarelessTracker) as server:
        page = visit(f"http://127.0.0.1:{server.port}/").open(server.address)
        until_tank(page, "frames", 5)
        assert "2 of 2" in page.locator(".live-side").inner_text()
        assert "The tank is not drawn: 'tank'" in page.locator(".live-tank .readout").inner_text()
        left_out = page.locator(".live-tank .fault")
        expect(left_out).to_contain_text("frames (x_m is not a number)", timeout=10_000)
        assert drawn_share(pixels(page.locator("canvas.tank-canvas"))) > 0.0005


class OddTracker(socketserver.StreamRequestHandler):
    """A tracker every word of which is hostile."""

    def handle(self) -> None:
        def say(**content: Any) -> None:
            self.wfile.write(json.dumps(content).encode() + b"\n")

        with contextlib.suppress(OSError):
            say(
                **{"type": "hello", "format": "driftwalk live", "version": 1, "source": HOSTILE},
                **{"markers": HOSTILE, "tank": {"shape": "circle", "diameter_m": 0.3}},
                **{"block_side_m": 0.03, "body_count": 2, "observed": True, "note": HOSTILE},
                image={
                    **{"width_px": 64, "height_px": 48, "lens": None, "words": HOSTILE},
                    "homography_px_to_m": [0.005, 0, -0.16, 0, -0.005, 0.12, 0, 0, 1],
                },
            )
            for number in itertools.count():
                bodies = [
                    {
                        **{"id": f"{HOSTILE}{body}", "seen": True, "x_m": 0.04 * body, "y_m": 0.0},
                        **{"theta_rad": 0.0, "column_px": None, "row_px": None, "ambiguous": 0.0},
                    }
                    for body in range(2)
                ]
                names = [body["id"] for body in bodies]
                event = {"time_s": 0.0, "kind": HOSTILE, "bodies": names, "outcome": HOSTILE}
                say(
                    **{"type": "frame", "frame": number, "time_s": 0.1 * number, "bodies": bodies},
                    **{"joined": [[names[0], 0, names[1], 2]], "outcome": HOSTILE},
                    **{"possible": [HOSTILE, "2"], "hidden": [HOSTILE], "dropped_frames": 0},
                    **{"events": [{**event, "faces": [0, 2]}], "latency_s": 0.0},
                    jpeg_base64='" onerror="window.taken=1',
                )
                time.sleep(0.05)


def test_the_words_of_a_tracker_are_only_text(visit: Callable[..., Visit]) -> None:
    """With the page's own policy switched off: nothing but the front end itself stands guard."""
    with watched(OddTracker) as server:
        one = visit(f"http://127.0.0.1:{server.port}/", bypass_csp=True)
        dialogs: list[str] = []
        one.page.on("dialog", lambda dialog: (dialogs.append(dialog.message), dialog.dismiss()))
        page = one.open(server.address)
        until_tank(page, "frames", 5)
        assert HOSTILE in page.locator("body").inner_text()
        assert page.evaluate("[window.taken, document.title.includes('taken')]") == [
            None,
            False,
        ]
        assert page.locator("img").count() == 0
        assert page.locator("script").count() == 2
        assert dialogs == []
