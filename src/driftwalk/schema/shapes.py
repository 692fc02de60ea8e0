"""Names of polyominoes, as they stand in the outcome classes of datasets.

A shape has a short name ("L3") or is called by its rows from the top, as seen from above with y up:
``x`` for a cell and ``.`` for none, joined by ``/``.
"""

from __future__ import annotations

import re
from typing import Final

from driftwalk.schema.contact_graphs import discs_of

Cell = tuple[int, int]
Cells = tuple[Cell, ...]

NAMED_SHAPES: Final[dict[str, str]] = {
    "1": "x",
    "2": "xx",
    "I3": "xxx",
    "L3": "x./xx",
    "I": "xxxx",
    "O": "xx/xx",
    "T": "xxx/.x.",
    "S": ".xx/xx.",
    "Z": "xx./.xx",
    "L": "x./x./xx",
    "J": ".x/.x/xx",
}
"""As people draw them. The order is that of all lists."""


MOST_NAMED: Final = 64
"""Blocks up to which the class of a world names its shapes; of more it is their number. Chosen by
hand: runs of as many hardly ever end in the same shapes."""
MOST_CELLS_NAMED: Final = 8
"""Cells up to which a shape of so many blocks has a name of its own; chosen by hand."""
_SHAPE_COUNTS: Final = re.compile(r"(\d+) blocks, (\d+) joins")
_ASSEMBLIES: Final = re.compile(r"(\d+) assembl(?:y|ies)")
LONGEST_CLASS: Final = 40
"""Letters of a class that a line of text has room for: every one of up to 8 blocks has fewer."""


def counted_shape(blocks: int, joins: int) -> str:
    """Return the name of a large shape: its blocks, and how many pairs of them lie side by side."""
    return f"{blocks} blocks, {joins} joins"


def counts_of_shape(name: str) -> tuple[int, int]:
    """Return blocks and joins of a shape that is named by them, zeros of any other.

    Examples
    --------
    >>> counts_of_shape(counted_shape(20, 31)), counts_of_shape("T")
    ((20, 31), (0, 0))
    """
    found = _SHAPE_COUNTS.fullmatch(name)
    return (int(found[1]), int(found[2])) if found else (0, 0)


def counted_class(assemblies: int) -> str:
    """Return the outcome class of many blocks: how many assemblies they make."""
    return "1 assembly" if assemblies == 1 else f"{assemblies} assemblies"


def all_single(blocks: int) -> str:
    """Name the class in which every block is alone."""
    return counted_class(blocks) if blocks > MOST_NAMED else "+".join(["1"] * blocks)


def counted_assemblies(name: str) -> int:
    """Return how many assemblies a counted class says, 0 of a class that names its shapes.

    Examples
    --------
    >>> counted_assemblies("12 assemblies"), counted_assemblies("2+2")
    (12, 0)
    """
    counted = _ASSEMBLIES.fullmatch(name)
    return int(counted[1]) if counted else 0


def is_one_assembly(name: str) -> bool:
    """Return whether all blocks of an outcome class are in one assembly.

    Examples
    --------
    >>> [is_one_assembly(name) for name in ("T", "2+2", "1 assembly", "12 assemblies")]
    [True, False, True, False]
    """
    return counted_assemblies(name) == 1 or not (counted_assemblies(name) or "+" in name)


def short_class(name: str) -> str:
    """Return the name of an outcome class; of a long one the sizes of its shapes.

    Parameters
    ----------
    name : str
        Shapes joined by ``+``.

    Examples
    --------
    >>> short_class("I3+1")
    'I3+1'
    >>> short_class("/".join(["xxxxxxxxx"] * 5) + "+2+1+1+1")
    'sizes 45+2+3×1'
    """
    if len(name) <= LONGEST_CLASS:
        return name
    sizes = [
        discs_of(shape) or NAMED_SHAPES.get(shape, shape).count("x") for shape in name.split("+")
    ]
    times = {size: sizes.count(size) for size in sizes}
    return "sizes " + "+".join(f"{n}×{size}" if n > 1 else f"{size}" for size, n in times.items())


def cells_of_shape(name: str) -> Cells:
    """Return the cells of a shape from its name or its rows; none when it is neither.

    Parameters
    ----------
    name : str
        One of `NAMED_SHAPES`, or rows such as ``xxx/.x.``.

    Returns
    -------
    tuple of (int, int)
        Column and row of every cell, y up, the least of each 0, sorted.

    Examples
    --------
    >>> cells_of_shape("L3"), cells_of_shape("other")
    (((0, 0), (0, 1), (1, 0)), ())
    """
    code = NAMED_SHAPES.get(name, name)
    rows = code.split("/")
    if set(code) - set("x./") or len({len(row) for row in rows}) > 1 or "x" not in code:
        return ()
    return moved_to_origin(
        tuple(
            (x, -y) for y, row in enumerate(rows) for x, letter in enumerate(row) if letter == "x"
        )
    )


def moved_to_origin(cells: Cells) -> Cells:
    """Return the cells sorted, the least column and the least row being 0."""
    left = min(x for x, _ in cells)
    bottom = min(y for _, y in cells)
    return tuple(sorted((x - left, y - bottom) for x, y in cells))
