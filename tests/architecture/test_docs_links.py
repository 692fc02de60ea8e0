"""Links between the pages lead somewhere: the file is there, and so is the heading."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
# Pages that the site makes have tests of their own.
MADE = tuple(ROOT / "docs" / name for name in ("reference/python", "reference/commands", "gallery"))
PAGES = sorted(
    page
    for page in (*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"))
    if not set(MADE) & set(page.parents)
)
CODE = re.compile(r"```.*?```|`[^`\n]*`", re.DOTALL)
LINK = re.compile(r"\]\(([^)]+)\)")


def links_of(text: str) -> list[str]:
    """Return the targets of all links outside of code; one broken over two lines is joined."""
    found = LINK.findall(CODE.sub("", text))
    return ["".join(target.split()) for target in found if "://" not in target]


def anchors_of(text: str) -> set[str]:
    """Return the anchors of the headings, as code hosts make them."""
    headings = re.findall(r"^#+ +(.+)$", re.sub(r"```.*?```", "", text, flags=re.DOTALL), re.M)
    kept = (re.sub(r"[^\w\- ]", "", heading.lower()) for heading in headings)
    return {heading.strip().replace(" ", "-") for heading in kept}


def broken_links(page: Path, text: str) -> list[str]:
    wrong = []
    for link in links_of(text):
        path, _, anchor = link.partition("#")
        target = page if not path else (page.parent / path).resolve()
        there = target.exists() and target.is_relative_to(ROOT)
        if not there or (anchor and anchor not in anchors_of(target.read_text(encoding="utf-8"))):
            wrong.append(link)
    return wrong


def test_reading_of_links_and_headings() -> None:
    text = "# How do I?\n[a](b.md) [c](d.md#e\n) [f](https://g.h) `[i](j)`\n## [tank] and x_m\n"
    assert links_of(text) == ["b.md", "d.md#e"]
    assert anchors_of(text) == {"how-do-i", "tank-and-x_m"}


def test_a_broken_link_is_found() -> None:
    text = "# Here\n[a](nowhere.md) [b](README.md) [c](ARCHITECTURE.md#no-such-heading) [d](../x)"
    wrong = ["nowhere.md", "ARCHITECTURE.md#no-such-heading", "../x"]
    assert broken_links(ROOT / "README.md", text) == wrong


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_link_leads_somewhere(page: Path) -> None:
    assert not broken_links(page, page.read_text(encoding="utf-8"))


def test_every_page_can_be_reached_from_the_front_page() -> None:
    reached: set[Path] = set()
    ahead = [ROOT / "README.md"]
    while ahead:
        page = ahead.pop()
        if page in reached or page.suffix != ".md" or not page.is_file():
            continue
        reached.add(page)
        targets = (link.partition("#")[0] for link in links_of(page.read_text(encoding="utf-8")))
        ahead += [(page.parent / target).resolve() for target in targets if target]
    assert not sorted(str(page.relative_to(ROOT)) for page in set(PAGES) - reached)
