"""Sections of a study as TOML."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

from driftwalk.model.section import Section


def write_toml(sections: Mapping[str, Section]) -> str:
    """Return named sections as TOML without comments and without the keys that are not set."""
    parts = []
    for name, section in sections.items():
        lines = [f"{key} = {toml_text(value)}" for key, value in _set_values(section)]
        parts.append("\n".join([f"[{name}]", *lines]))
    return "\n\n".join(parts) + "\n"


def toml_text(value: Any) -> str:
    """Return a value as TOML; its strings are JSON's, but for the delete character."""
    if isinstance(value, Section):
        inner = ", ".join(f"{key} = {toml_text(item)}" for key, item in _set_values(value))
        return f"{{ {inner} }}" if inner else "{}"
    if isinstance(value, (tuple, list)):
        return "[" + ", ".join(toml_text(item) for item in value) + "]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value)


def _set_values(section: Section) -> Iterator[tuple[str, Any]]:
    for key in type(section).model_fields:
        value = getattr(section, key)
        if value is not None:
            yield key, value
