"""Chromium for the browser tests: found on the machine, nothing is downloaded.

``DRIFTWALK_CHROMIUM`` names another one. Without any the tests are skipped, and say so; with
``DRIFTWALK_REQUIRE_BROWSER=1``, as in CI, they fail. Screenshots go to ``DRIFTWALK_SCREENSHOTS``
where that is set.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from finished_run import write_finished_run

from browser.readable import faults

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    # In a container shared memory may be 64 MB, and a browser that lacks it crashes.
    "--disable-dev-shm-usage",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
DESKTOP = {"width": 1440, "height": 900}
PATIENCE_MS = 20_000
"""How long a page may take to show something."""
PHONE = {"width": 390, "height": 844}


@pytest.fixture(scope="session")
def launch() -> Iterator[Callable[[], Browser]]:
    """Return a function that starts Chromium."""
    found = os.environ.get("DRIFTWALK_CHROMIUM") or shutil.which("chromium")
    if found is None:
        words = "no Chromium: install Debian's 'chromium', or name one in DRIFTWALK_CHROMIUM"
        if os.environ.get("DRIFTWALK_REQUIRE_BROWSER") == "1":
            pytest.fail(words)
        pytest.skip(words)
    from playwright.sync_api import expect, sync_playwright

    expect.set_options(timeout=PATIENCE_MS)
    with sync_playwright() as playwright:
        yield lambda: playwright.chromium.launch(executable_path=found, args=ARGUMENTS)


@pytest.fixture(scope="session")
def running(launch: Callable[[], Browser]) -> Iterator[list[Browser]]:
    """Return a list that ends with the browser that all tests share."""
    browsers = [launch()]
    yield browsers
    browsers[-1].close()


@pytest.fixture
def browser(launch: Callable[[], Browser], running: list[Browser]) -> Browser:
    """Return Chromium; a new one after a test in which it crashed, so that the others still run."""
    if not running[-1].is_connected():
        running.append(launch())
    return running[-1]


class Visit:
    """A page in a browser of its own, and everything that it asked for or complained about."""

    def __init__(self, page: Page, allowed: str | tuple[str, ...]) -> None:
        self.page = page
        self.requests: list[str] = []
        self.refused: list[str] = []
        self.complaints: list[str] = []
        self._allowed = allowed
        page.context.route("**/*", self._decide)
        page.on("console", self._hear)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("websocket", lambda socket: self.requests.append(socket.url))

    def _decide(self, route: Any) -> None:
        url = route.request.url
        self.requests.append(url)
        if url.startswith(self._allowed):
            route.continue_()
        else:
            self.refused.append(url)
            route.abort()

    def _hear(self, message: Any) -> None:
        # A server that is restarted is part of some tests.
        if message.type == "error" and "ERR_CONNECTION" not in message.text:
            self.complaints.append(message.text)

    def open(self, address: str) -> Page:
        """Open an address and wait until everything has been drawn, all chapters too."""
        self.page.goto(address)
        self.page.wait_for_selector("html[data-ready=yes]")
        if self.page.locator(".open-all").count():
            self.page.locator(".open-all").click()
            self.page.wait_for_selector("html[data-opened=yes]")
            self.page.evaluate("scrollTo(0, 0)")
        return self.page


@pytest.fixture
def visit(browser: Browser) -> Iterator[Callable[..., Visit]]:
    """Return a function that opens a browser of its own; only what is allowed is loaded.

    At the end no page may have asked for anything else, nor complained; and everyone can read it,
    name its controls and reach them.
    """
    visits: list[Visit] = []

    def start(
        allowed: str | tuple[str, ...], *, viewport: dict[str, int] = DESKTOP, **options: Any
    ) -> Visit:
        context = browser.new_context(viewport=viewport, **options)
        context.set_default_timeout(PATIENCE_MS)
        visits.append(Visit(context.new_page(), allowed))
        return visits[-1]

    yield start
    unfit = [fault for one in visits for fault in faults(one.page)]
    for one in visits:
        one.page.context.close()
    assert unfit == []
    assert [url for one in visits for url in one.refused] == []
    assert [words for one in visits for words in one.complaints] == []


@pytest.fixture
def picture() -> Callable[..., None]:
    """Return a function that saves a picture of a page where ``DRIFTWALK_SCREENSHOTS`` is set."""
    folder = os.environ.get("DRIFTWALK_SCREENSHOTS")

    def take(page: Page, name: str, *, whole: bool = True) -> None:
        if folder:
            page.screenshot(path=Path(folder) / f"{name}.png", full_page=whole)

    return take


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the run directory of a finished calibration."""
    return write_finished_run(tmp_path_factory.mktemp("finished") / "run")
