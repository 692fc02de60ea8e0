"""Take screenshots of a page: ``python shots.py page.html FOLDER``. For development only."""

from __future__ import annotations

import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

FLAGS = [
    f"--{name}"
    for name in (
        "no-sandbox",
        "disable-gpu",
        "disable-quic",
        "no-first-run",
        "disable-background-networking",
        "disable-component-update",
        "disable-sync",
    )
]


def main() -> None:
    """Write one picture per section, size and theme."""
    page_file, folder = Path(sys.argv[1]).resolve(), Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=FLAGS)
        for name, width, height, scheme in (
            ("wide", 1440, 900, "light"), ("wide-dark", 1440, 900, "dark"),
            ("narrow", 390, 844, "light"), ("narrow-dark", 390, 844, "dark"),
        ):  # fmt: skip
            context = browser.new_context(
                viewport={"width": width, "height": height}, color_scheme=scheme
            )
            page = context.new_page()
            page.on("console", lambda message: print(message.type, message.text))
            page.on("pageerror", lambda error: print("error", error))
            page.goto(page_file.as_uri())
            page.wait_for_selector('html[data-ready="yes"]')
            wide = page.evaluate("document.documentElement.scrollWidth")
            if wide > width:
                print(f"{name}: the page is {wide} px wide")
            page.screenshot(path=folder / f"{name}.png")
            page.screenshot(path=folder / f"{name}-full.png", full_page=True)
            context.close()
        browser.close()


if __name__ == "__main__":
    main()
