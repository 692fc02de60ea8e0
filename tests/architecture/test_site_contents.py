"""The table of contents of the site holds every page once."""

from __future__ import annotations

import importlib.util
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def contents_of(text: str) -> list[tuple[str, list[str]]]:
    """Return what `docs/site/contents.py` makes of a front page."""
    place = ROOT / "docs" / "site" / "contents.py"
    spec = importlib.util.spec_from_file_location("site_contents", place)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    found: list[tuple[str, list[str]]] = module.contents_of(text)
    return found


def test_a_page_stands_where_it_is_linked_first() -> None:
    text = "[a](how-to/a.md)\n## Why\n[b](b.md), [a](how-to/a.md#x), [c](../C.md), [d](\n  e/d.md)"
    start, _gallery, why, _project = contents_of(text)
    assert start == ("Start here", ["docs/how-to/a"])
    assert why == ("Why", ["docs/b", "C", "docs/e/d"])


def test_every_page_is_in_the_contents_once() -> None:
    front = ROOT / "docs" / "index.md"
    count = Counter(
        page for _, pages in contents_of(front.read_text(encoding="utf-8")) for page in pages
    )
    assert max(count.values()) == 1
    made = ("docs/gallery", "docs/reference/python", "docs/reference/commands")
    for path in (ROOT / "docs").rglob("*.md"):
        place = path.relative_to(ROOT)
        if path != front and not any(place.is_relative_to(folder) for folder in made):
            assert str(path.relative_to(ROOT).with_suffix("")) in count
