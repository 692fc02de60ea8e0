"""A numpydoc docstring as Markdown."""

from __future__ import annotations

import re
import textwrap
from typing import Final

ENTRIES: Final = (
    "Parameters",
    "Other Parameters",
    "Attributes",
    "Returns",
    "Yields",
    "Raises",
    "Warns",
)
"""Sections that list entries: a head line and an indented description each."""
_HEAD: Final = re.compile(r"^(\w[\w ]*)\n-{3,}\n", re.MULTILINE)


def sections_of(docstring: str) -> dict[str, str]:
    """Return the sections by their headings; what comes before the first one is under ``""``."""
    parts = _HEAD.split(textwrap.dedent(docstring).strip() + "\n")
    return {
        "": parts[0].strip(),
        **dict(zip(parts[1::2], map(str.rstrip, parts[2::2]), strict=True)),
    }


def entries_of(section: str) -> list[tuple[str, str]]:
    """Return the entries of a section: the head line, and the description without its indent."""
    found: list[tuple[str, list[str]]] = []
    for line in section.splitlines():
        if line and not line.startswith(" "):
            found.append((line, []))
        elif found:
            found[-1][1].append(line)
    return [(head, textwrap.dedent("\n".join(lines)).strip()) for head, lines in found]


def as_markdown(docstring: str) -> str:
    """Return a docstring as Markdown: its text, an example, then each section under a bold name.

    Examples keep their prompts, in blocks that are marked ``pycon``; `make doctest` runs them.
    """
    parts = []
    sections = sections_of(docstring)
    for name in sorted(sections, key=lambda one: ("", "Examples", one).index(one)):
        section = sections[name]
        if not name:
            parts.append(_text(section))
        elif name in ENTRIES:
            parts.append(f"**{name}**\n\n" + "\n".join(map(_entry, entries_of(section))))
        elif name == "Examples":
            parts.append(f"**{name}**\n\n{_examples(section)}")
        else:
            parts.append(f"**{name}**\n\n{_text(section)}")
    return "\n\n".join(parts)


def _text(text: str) -> str:
    """Return running text with code as Markdown writes it."""
    return re.sub(r"``(.+?)``", r"`\1`", text, flags=re.DOTALL).replace("::\n", ":\n")


def _entry(entry: tuple[str, str]) -> str:
    head, description = entry
    name, colon, kind = head.partition(" : ")
    shown = f"**`{name}`** : {_kind(kind)}" if colon else f"`{head}`"
    if not description:
        return f"- {shown}"
    return f"- {shown}\\\n{textwrap.indent(_text(description), '  ')}"


def _kind(kind: str) -> str:
    """Return a type as code, and the words after it (``optional``, a shape) as words."""
    kind = kind.replace("``", "`")
    words = re.search(r"((?:, (?:optional|shape \(.*\)|default.*|\d+))+)$", kind)
    code, rest = (kind[: words.start()], words[0]) if words else (kind, "")
    return f"{code}{rest}" if "`" in code else f"`{code}`{rest}"


def _examples(section: str) -> str:
    """Return examples as blocks of code, with the sentences between them as text."""
    parts = []
    for chunk in re.split(r"\n\s*\n", section):
        block = chunk.startswith((">>>", "..."))
        if block and parts and parts[-1].startswith("```"):
            parts[-1] = parts[-1].removesuffix("\n```") + f"\n\n{chunk}\n```"
        else:
            parts.append(f"```pycon\n{chunk}\n```" if block else _text(chunk))
    return "\n\n".join(parts)
