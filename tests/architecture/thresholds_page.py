"""The page of tuned thresholds, made from the policy classes and constants of the source.

``python tests/architecture/thresholds_page.py`` writes its tables again. A policy is a
`NamedTuple` whose name ends with "Policy"; each of its fields has a docstring that says what the
threshold decides and how it was chosen. A constant that decides alone needs no class. The numbers
of the native core are a table that is written by hand; `core_thresholds` reads it.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

from reasons import numeric_constants

ROOT: Final = Path(__file__).resolve().parents[2]
SOURCE: Final = ROOT / "src"
PAGE: Final = ROOT / "docs" / "reference" / "thresholds.md"
BEGIN: Final = "<!-- Made by `python tests/architecture/thresholds_page.py`. -->\n"
CHOSEN: Final = re.compile(
    r"studies/|docs/|\b[Bb]y (hand|eye|convention|definition)\b|[Mm]easured|[Cc]hance|false alarm"
    r"|closed form"
)
"""Words of which every reason of a threshold has one: how it was chosen."""
TUNED: Final = re.compile(r"studies/|docs/|\b[Bb]y hand\b|[Mm]easured|[Cc]hance|false alarm")
"""The same of a constant that is no format, no layout and no law of nature."""
LONGEST: Final = 60
"""Characters of a value that the page shows."""


class Threshold(NamedTuple):
    """A field of a policy."""

    name: str
    value: str
    reason: str


class Policy(NamedTuple):
    """The thresholds of one decision."""

    path: Path
    name: str
    purpose: str
    thresholds: list[Threshold]


def policies() -> Iterator[Policy]:
    """Yield the policies of driftwalk, by file."""
    for path in sorted(SOURCE.rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        if "Policy(NamedTuple)" not in text:
            continue
        lines = text.encode().splitlines(keepends=True)
        for node in ast.parse(text).body:
            if isinstance(node, ast.ClassDef) and node.name.endswith("Policy"):
                purpose = " ".join((ast.get_docstring(node) or "").split())
                yield Policy(path.relative_to(ROOT), node.name, purpose, list(_fields(node, lines)))


def _fields(policy: ast.ClassDef, lines: list[bytes]) -> Iterator[Threshold]:
    for field, after in zip(policy.body, [*policy.body[1:], None], strict=True):
        if isinstance(field, ast.AnnAssign) and field.value is not None:
            documented = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
            reason = " ".join(str(after.value.value).split()) if documented else ""  # type: ignore[union-attr]
            value = " ".join(_written(field.value, lines).split())
            yield Threshold(ast.unparse(field.target), value, reason)


def _written(node: ast.expr, lines: list[bytes]) -> str:
    """Return the source of an expression; `ast.get_source_segment` splits the file each time."""
    own = lines[node.lineno - 1 : node.end_lineno]
    own[-1] = own[-1][: node.end_col_offset]
    own[0] = own[0][node.col_offset :]
    return b"".join(own).decode()


def thresholds_page(page: str) -> str:
    """Return the page with the tables of all policies, and of single constants, below its mark."""
    tables = "".join(_table(one) for one in policies())
    return page[: page.index(BEGIN)] + BEGIN + tables + _single()


class CoreThreshold(NamedTuple):
    """A row of the table of the native core."""

    name: str
    value: str
    path: Path
    reason: str


def core_thresholds(page: str) -> list[CoreThreshold]:
    """Return the rows of the hand-written table, above the mark."""
    row = re.compile(r"^\| `(\w+)` \| ([^|]+?) \| `(\S+\.hpp)` \| (.+) \|$", re.MULTILINE)
    return [
        CoreThreshold(name, value, ROOT / "cpp" / "include" / "driftwalk" / path, reason)
        for name, value, path, reason in row.findall(page[: page.index(BEGIN)])
    ]


def _single() -> str:
    """Return the table of the constants outside of policies that say how they were chosen."""
    rows = "".join(
        f"| `{one.name}` | {one.value} | `{one.path}` | {_in_cell(one.reason)} |\n"
        for one in numeric_constants()
        if TUNED.search(one.reason) and len(one.value) <= LONGEST
    )
    return (
        "\n## Numbers on their own\n\nEach is the only one of its decision.\n\n"
        "| constant | value | in `src/driftwalk` | meaning, and how it was chosen |\n"
        "|---|---|---|---|\n" + rows
    )


def _table(policy: Policy) -> str:
    room = policy.path.relative_to("src/driftwalk").parts[0]
    rows = "".join(
        f"| `{one.name}` | {one.value} | {_in_cell(one.reason)} |\n" for one in policy.thresholds
    )
    return (
        f"\n## {room}: {policy.name}\n\n{policy.purpose} In `{policy.path.as_posix()}`.\n\n"
        "| threshold | value | meaning, and how it was chosen |\n|---|---|---|\n" + rows
    )


def _in_cell(text: str) -> str:
    return text.replace("|", "\\|")


if __name__ == "__main__":
    PAGE.write_text(thresholds_page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
