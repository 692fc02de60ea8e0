"""The page of tuned thresholds, made from the policy classes of the source.

``python tests/architecture/thresholds_page.py`` writes its tables again. A policy is a
`NamedTuple` whose name ends with "Policy"; each of its fields has a docstring that says what the
threshold decides and how it was chosen.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

ROOT: Final = Path(__file__).resolve().parents[2]
SOURCE: Final = ROOT / "src"
PAGE: Final = ROOT / "docs" / "reference" / "thresholds.md"
BEGIN: Final = "<!-- Made by `python tests/architecture/thresholds_page.py`. -->\n"


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
    """Return the page with the tables of all policies below its mark."""
    return page[: page.index(BEGIN)] + BEGIN + "".join(_table(one) for one in policies())


def _table(policy: Policy) -> str:
    room = policy.path.relative_to("src/driftwalk").parts[0]
    head = f"\n## {room}: {policy.name}\n\n{policy.purpose} In `{policy.path.as_posix()}`.\n\n"
    rows = (
        f"| `{one.name}` | {one.value} | {one.reason.replace('|', chr(92) + '|')} |\n"
        for one in policy.thresholds
    )
    return (
        head
        + "| threshold | value | meaning, and how it was chosen |\n|---|---|---|\n"
        + "".join(rows)
    )


if __name__ == "__main__":
    PAGE.write_text(thresholds_page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
