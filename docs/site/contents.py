"""The table of contents of the site: the links of the front page, by its headings.

The front page lists every page for readers of the repository. The site takes the list from there,
so that none is kept twice.
"""

from __future__ import annotations

import re
from pathlib import PurePosixPath
from typing import Any

FRONT = "docs/index"
GALLERY = ("Gallery", ["docs/gallery/index"])
PROJECT = ("Project", ["README", "CHANGELOG", "CONTRIBUTING", "studies/*/README"])
BELOW = {
    "docs/reference/python": ("Rooms", ["docs/reference/python/*"]),
    "docs/reference/commands/index": ("Commands", ["docs/reference/commands/*"]),
}
"""Pages with pages of their own."""
HEADING = re.compile(r"^## (.+)$")
LINK = re.compile(r"\]\(([^)#:]+)\.md\)")


def add_contents(_app: Any, name: str, source: list[str]) -> None:
    """Append hidden tables of contents to a page (the event `source-read` of Sphinx)."""
    tables = contents_of(source[0]) if name == FRONT else []
    if name in BELOW:
        tables.append(BELOW[name])
    source[0] += "".join(_table(title, pages) for title, pages in tables)


def contents_of(text: str) -> list[tuple[str, list[str]]]:
    r"""Return the sections of the front page: titles, and their pages from the root of the sources.

    Every page stands once, where it is linked first.

    Examples
    --------
    >>> contents_of("[a](how/a.md)\n## Why\n[b](b.md), [a](how/a.md#x), [c](../C.md)")[:3:2]
    [('Start here', ['docs/how/a']), ('Why', ['docs/b', 'C'])]
    """
    sections: list[tuple[str, list[str]]] = [("Start here", [])]
    seen: set[str] = set()
    for line in re.sub(r"\]\(\s+", "](", text).replace("\n  ", " ").splitlines():
        if heading := HEADING.match(line):
            sections.append((heading[1], []))
        for link in LINK.findall(line):
            page = _from_root(link)
            if page not in seen:
                seen.add(page)
                sections[-1][1].append(page)
    return [*sections[:1], GALLERY, *sections[1:], PROJECT]


def _from_root(link: str) -> str:
    """Return a link of the front page as a path from the root, without `..`."""
    parts: list[str] = []
    for part in (PurePosixPath(FRONT).parent / link).parts:
        if part == "..":
            parts.pop()
        else:
            parts.append(part)
    return "/".join(parts)


def _table(title: str, pages: list[str]) -> str:
    entries = "\n".join(f"/{page}" for page in pages)
    options = f":hidden:\n:glob:\n:maxdepth: 1\n:caption: {title}"
    return f"\n\n```{{toctree}}\n{options}\n\n{entries}\n```\n"
