"""Print how large the package is, room by room.

    python tests/architecture/code_size.py [--files]

A code line holds a token: docstrings, comments and blank lines do not count. A constant is an
assignment of numbers at module level. Small files have fewer than 25 code lines, large ones more
than 350; `--files` names them.
"""

from __future__ import annotations

import argparse
import ast
import io
import tokenize
from collections import defaultdict
from pathlib import Path
from typing import Final, NamedTuple

PACKAGE: Final = Path(__file__).resolve().parents[2] / "src" / "driftwalk"
SMALL, LARGE = 25, 350
NO_CODE: Final = {
    *(tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT),
    tokenize.ENDMARKER,
}


class Size(NamedTuple):
    """Counts of one file, or sums over several."""

    files: int
    code: int
    constants: int
    comments: int
    small: int
    large: int


def size_of(text: str) -> Size:
    """Return the counts of the source of one module."""
    tree = ast.parse(text)
    code: set[int] = set()
    comments: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        lines = range(token.start[0], token.end[0] + 1)
        if token.type == tokenize.COMMENT:
            comments.update(lines)
        elif token.type not in NO_CODE:
            code.update(lines)
    for node in ast.walk(tree):
        # Docstrings, and the texts below constants and attributes.
        if isinstance(node, ast.Expr) and _is_text(node.value):
            code.difference_update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    constants = sum(_is_numeric(node) for node in tree.body)
    return Size(1, len(code), constants, len(comments), len(code) < SMALL, len(code) > LARGE)


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def _is_numeric(node: ast.stmt) -> bool:
    """Return whether a statement assigns numbers that are written there."""
    value = node.value if isinstance(node, ast.Assign | ast.AnnAssign) else None
    parts = [] if value is None else list(ast.walk(value))
    if any(isinstance(part, ast.Call) for part in parts):
        return False
    return any(
        isinstance(part, ast.Constant)
        and isinstance(part.value, int | float)
        and not isinstance(part.value, bool)
        for part in parts
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--files", action="store_true", help="name the small and the large files")
    given = parser.parse_args()
    rooms: dict[str, list[Size]] = defaultdict(list)
    marked: list[str] = []
    for path in sorted(PACKAGE.rglob("*.py")):
        place = path.relative_to(PACKAGE)
        size = size_of(path.read_text(encoding="utf-8"))
        rooms[place.parts[0]].append(size)
        # A package needs its `__init__.py`, however little it holds.
        if size.large or (size.small and path.name != "__init__.py"):
            marked.append(f"{size.code:5} {place}")
    rooms["total"] = [size for sizes in rooms.values() for size in sizes]
    print(f"{'room':14}" + "".join(f"{name:>10}" for name in Size._fields))
    for room, sizes in rooms.items():
        sums = (sum(column) for column in zip(*sizes, strict=True))
        print(f"{room:14}" + "".join(f"{count:10}" for count in sums))
    if given.files:
        print("\n".join(marked))


if __name__ == "__main__":
    main()
