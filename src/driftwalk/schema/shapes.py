"""Names of polyominoes, as they stand in the outcome classes of datasets.

A shape has a short name ("L3") or is called by its rows from the top, as seen from above with y up:
``x`` for a cell and ``.`` for none, joined by ``/``.
"""

from __future__ import annotations

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


LONGEST_CLASS: Final = 40
"""Letters of a class that a line of text has room for: every one of up to 8 blocks has fewer."""


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
