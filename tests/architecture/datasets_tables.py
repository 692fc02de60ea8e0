"""The tables of the page docs/reference/datasets.md, made from the schemas.

``python tests/architecture/datasets_tables.py docs/reference/datasets.md`` writes them again; the
rest of the page stays.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Final

from driftwalk.schema.description import Attribute, Kind, Variable
from driftwalk.schema.kinds import KINDS

_TABLES: Final = re.compile(r"(<!-- schema: (\w+) -->\n).*?(<!-- end of schema -->)", re.S)


def datasets_page(page: str) -> str:
    r"""Return the page with the tables of every kind between its marks.

    Parameters
    ----------
    page : str
        Text in which ``<!-- schema: KIND -->`` and ``<!-- end of schema -->`` stand around each
        place for tables.

    Raises
    ------
    KeyError
        When a mark names no kind.

    Examples
    --------
    >>> page = datasets_page("<!-- schema: steps -->\nold\n<!-- end of schema -->")
    >>> "| `step_length` | (step) | m | step length; above 0 |" in page
    True
    """
    return _TABLES.sub(lambda at: f"{at[1]}{tables(KINDS[at[2]])}{at[3]}", page)


def kinds_on(page: str) -> list[str]:
    """Return the kinds that have tables on a page, in order."""
    return [at[2] for at in _TABLES.finditer(page)]


def tables(kind: Kind) -> str:
    """Return what a dataset of a kind holds: its dimensions, variables and attributes."""
    along = "; ".join(f"{name} ({words})" for name, words in kind.dimensions.items())
    parts = [f"Schema version {kind.version}. Dimensions: {along}."]
    parts.append("| variable | dimensions | unit | |\n|---|---|---|---|")
    parts[-1] += "".join(f"\n{_variable_row(one)}" for one in kind.variables)
    parts.append("| attribute | holds | |\n|---|---|---|")
    parts[-1] += "".join(f"\n{_attribute_row(one)}" for one in kind.attributes)
    return "\n" + "\n\n".join(parts) + "\n\n"


def _variable_row(one: Variable) -> str:
    dims = ", ".join(one.dims.split())
    unit = _unit(one.units)
    words = [one.long_name]
    if one.note:
        words.append(one.note)
    if one.flags:
        words.append(", ".join(f"{value} {name}" for name, value in one.flags.items()))
    if one.holds in ("text", "bool"):
        words.append({"text": "text", "bool": "true or false"}[one.holds])
    return f"| `{one.name}` | ({dims}) | {unit} | {_told(words, one.when)} |"


def _attribute_row(one: Attribute) -> str:
    holds = f"JSON {one.says}" if one.says in ("object", "list") else one.says
    return f"| `{one.name}` | {holds} | {_told([one.meaning], one.when)} |"


def _told(words: list[str], when: str) -> str:
    text = "; ".join(words)
    return f"{text} (*{when}*)" if when else text


def _unit(units: str | None) -> str:
    """Return a unit as a page has it: m/s for "m s-1"."""
    if units is None:
        return ""
    return re.sub(r"^(\w+) (\w+)-1$", r"\1/\2", re.sub(r"^(\w+)-1$", r"1/\1", units))


if __name__ == "__main__":
    _path = Path(sys.argv[1])
    _path.write_text(datasets_page(_path.read_text(encoding="utf-8")), encoding="utf-8")
