"""Study files with comments: the template, and the table of the reference page."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from typing import Final

from driftwalk.model.section import (
    Quantity,
    Section,
    description_of,
    is_list,
    item_quantity_of,
    quantity_of,
    quoted,
    toml_text,
    words_of,
)
from driftwalk.model.study import Study

_HEAD = """\
# Study file of driftwalk. Every parameter is here with its default; a line that starts with
# "# key =" is a parameter that is not set. SI units; a number may also be text with a unit, such
# as "0.55mN", "16ms" or "30cm". A key that you leave out has its default; an unknown key is an
# error.
"""


_SHORT_HEAD = """\
# Study file of driftwalk: the block and the tank. Each "# key =" line shows the default, which is
# the paper's. Where yours differs, take the "# " away, before the name in [ ] too, and write your
# value: in SI units, or text with a unit, such as "3cm" or "11.6g". A key that you leave out has
# its default.
"""
FIRST: Final = {"block": ("side_m", "mass_kg"), "tank": ("diameter_m", "wall_friction")}
"""Parameters that no two tanks share, and that every result depends on."""


def study_template(study: Study | None = None) -> str:
    """Return a study file that lists every parameter with its unit, range and meaning.

    Parameters
    ----------
    study : Study, optional
        The values to write; the defaults when left out.

    Examples
    --------
    >>> study_template().splitlines()[5]
    '# The floating block.'
    """
    chosen = study if study is not None else Study()
    parts = [_HEAD]
    for name in Study.model_fields:
        lines = [*_comment(description_of(Study, name)), f"[{name}]"]
        section = getattr(chosen, name)
        for key in type(section).model_fields:
            lines += _commented_parameter(section, key)
        parts.append("\n".join(lines) + "\n")
    return "\n".join(parts)


def short_study_template() -> str:
    """Return a study file with what differs from tank to tank; it states nothing yet.

    All of its lines are comments, so that a table can be written below them.

    Examples
    --------
    >>> print(short_study_template().splitlines()[5])
    # [block]
    """
    parts = [_SHORT_HEAD]
    for name, keys in FIRST.items():
        section = getattr(Study(), name)
        lines = [f"# [{name}]"]
        for key in keys:
            meaning, *_ = description_of(type(section), key).partition(". ")
            lines += [*_comment(meaning.rstrip(".") + "."), f"# {key} = {_value(section, key)}"]
        parts.append("\n".join(lines) + "\n")
    return "\n".join(parts)


def _value(section: Section, key: str) -> str:
    """Return the value of a parameter, or one that could stand there."""
    value = getattr(section, key)
    return _example(type(section), key) if value is None else toml_text(value)


def parameter_table(name: str) -> str:
    """Return the parameters of one section as a Markdown table.

    Parameters
    ----------
    name : str
        Name of the section.

    Examples
    --------
    >>> parameter_table("steps").splitlines()[0]
    '| key | default | values | meaning |'
    """
    section = getattr(Study(), name)
    rows = ["| key | default | values | meaning |", "|---|---|---|---|"]
    for key in type(section).model_fields:
        value = getattr(section, key)
        default = f"`{toml_text(value)}`" if value is not None else "not set"
        accepted = _accepted(type(section), key).replace("|", "\\|")
        meaning = description_of(type(section), key)
        rows.append(f"| `{key}` | {default} | {accepted} | {meaning} |")
    return "\n".join(rows)


def _commented_parameter(section: Section, key: str) -> Iterator[str]:
    kind = type(section)
    value = getattr(section, key)
    accepted = _accepted(kind, key)
    description = description_of(kind, key)
    yield ""
    yield from _comment(f"{description} [{accepted}]" if accepted else description)
    yield f"{key} = {toml_text(value)}" if value is not None else f"# {key} = {_example(kind, key)}"


def _example(kind: type[Section], key: str) -> str:
    """Return a value to stand in the place of one that is not set."""
    example = (kind.model_fields[key].examples or [""])[0]
    return example if isinstance(example, str) and example[:1] in "{[" else toml_text(example)


def _accepted(kind: type[Section], key: str) -> str:
    """Return unit, range and words of a parameter, in short."""
    quantity = quantity_of(kind, key) or item_quantity_of(kind, key)
    words = words_of(kind, key)
    if kind.model_fields[key].annotation is bool:
        return "true or false"
    parts = [_number_text(quantity)] if quantity is not None else []
    if words:
        parts.append(quoted(words))
    text = ", or ".join(parts)
    return f"list of {text}" if text and is_list(kind, key) else text


def _number_text(quantity: Quantity) -> str:
    name = "whole number" if quantity.whole else quantity.unit if quantity.unit != "1" else "number"
    limits = quantity.range_text()
    return f"{name}, {limits}" if limits else name


def _comment(text: str) -> list[str]:
    return textwrap.wrap(
        text, 96, initial_indent="# ", subsequent_indent="# ", break_long_words=False
    )
