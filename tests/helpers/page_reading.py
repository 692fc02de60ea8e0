"""Reading pages in tests: arrays by the documented rule, sections by name, the HTML by a parser."""

from __future__ import annotations

import base64
import json
import struct
import zlib
from html.parser import HTMLParser
from typing import Any

import numpy as np


def values(part: Any) -> np.ndarray:
    """Decode an array of a page number by number, as docs/reference/page-data.md says."""
    if isinstance(part, list):
        return np.array(part, dtype=np.float64)
    content = zlib.decompress(base64.b64decode(part["data"]))
    stored = struct.unpack(f"<{int(np.prod(part['shape']))}f", content)
    return part["offset"] + np.array(stored, dtype=np.float64).reshape(part["shape"])


def part_of(sections: Any, id: str) -> dict[str, Any]:
    """Return the section of that name, of a page or a list of sections."""
    listed = sections["sections"] if isinstance(sections, dict) else sections
    found = [part for part in listed if part["id"] == id]
    assert len(found) == 1, [part["id"] for part in listed]
    return found[0]


def numbers_of(section: dict[str, Any], key: str = "numbers") -> dict[str, Any]:
    """Return the numbers of a summary, or the facts of a recording, by their label."""
    return {number["label"]: number for number in section[key]}


class Document(HTMLParser):
    """What a browser would see of a report: its elements, and the text in each."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[tuple[str, str]] = []
        self._open: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        self._open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        while self._open and self._open.pop() != tag:
            pass

    def handle_data(self, data: str) -> None:
        if data.strip():
            self.texts.append((self._open[-1] if self._open else "", data))

    def tags(self) -> list[str]:
        return [tag for tag, _ in self.elements]

    def text_of(self, tag: str) -> list[str]:
        return [text for name, text in self.texts if name == tag]


def page_in(text: str) -> dict[str, Any]:
    """Return the page data that a document holds."""
    document = Document(text)
    scripts = [attrs for tag, attrs in document.elements if tag == "script"]
    assert [attrs.get("id") for attrs in scripts] == ["driftwalk-page", None]
    assert scripts[0]["type"] == "application/json"
    return json.loads(document.text_of("script")[0], parse_constant=_refuse)


def _refuse(name: str) -> None:
    raise AssertionError(f"{name} is no JSON")
