"""Polyominoes: shapes of unit squares joined edge to edge; names and enumeration.

A shape is called by its canonical code: its rows from the top, ``x`` for a cell and ``.`` for none,
joined by ``/``. Of all the ways to turn it (and, with chirality "merged", to mirror it) the code is
that of the fewest rows, and among those the one with cells the earliest. Shapes of up to four cells
have shorter names: 1, 2, I3, L3, I, O, T, S, L, and with chirality "distinct" Z and J, as seen from
above with y up.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Final, Literal, get_args

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError
from driftwalk.schema.shapes import (
    NAMED_SHAPES,
    STEPS,
    Cell,
    Cells,
    cells_of_shape,
    counts_of_shape,
    discs_of,
    graph_order,
    moved_to_origin,
)

Chirality = Literal["merged", "distinct"]

LARGEST: Final = 10
"""Largest size of which all shapes are listed: there are 4655, and four times more per cell; chosen
by hand."""

_MIRRORED: Final = frozenset({"Z", "J"})
# Cells before gaps, and wide shapes before narrow ones.
_BY_CELLS: Final = str.maketrans("x/.", "012")


def polyomino_name(cells: npt.ArrayLike, *, chirality: Chirality = "merged") -> str:
    """Name the shape of some cells of the square lattice.

    Parameters
    ----------
    cells : array_like of int, shape (n, 2)
        Columns and rows (ix, iy), y up, in any order and at any place.
    chirality : {"merged", "distinct"}
        Whether mirror images are one shape (free polyominoes) or two (one-sided ones).

    Returns
    -------
    str
        A name such as "L3", or for five cells and more a code such as "xxx/x.x".

    Raises
    ------
    InputError
        When there is no cell, one stands there twice, or they are not joined edge to edge.

    Examples
    --------
    >>> polyomino_name([(0, 0), (0, 1), (1, 1), (0, 2)])
    'T'
    >>> polyomino_name([(0, 0), (1, 0), (1, 1), (2, 1)], chirality="distinct")
    'S'
    """
    require_chirality(chirality)
    array = np.asarray(cells)
    if array.ndim != 2 or array.shape[1] != 2 or not len(array) or array.dtype.kind not in "iu":
        raise InputError(
            f"cells are pairs of whole numbers, shape (n, 2), got shape {array.shape} of "
            f"{array.dtype}"
        )
    return name_of(moved_to_origin(tuple(map(tuple, array.tolist()))), chirality)


def polyomino_cells(name: str) -> npt.NDArray[np.int32]:
    """Return the cells of a shape, as it is usually drawn.

    Parameters
    ----------
    name : str
        As `polyomino_name` gives it, with either chirality.

    Returns
    -------
    numpy.ndarray of int32, shape (n, 2)
        Columns and rows (ix, iy), y up, the least of each 0, sorted.

    Raises
    ------
    InputError
        When no shape has this name.

    Examples
    --------
    >>> polyomino_cells("L3").tolist()
    [[0, 0], [0, 1], [1, 0]]
    """
    cells = cells_of_shape(name)
    words: tuple[Chirality, ...] = get_args(Chirality) if _is_connected(cells) else ()
    if name not in {name_of(cells, chirality) for chirality in words}:
        raise InputError(
            f"no shape is called '{name}': the names are {', '.join(NAMED_SHAPES)}, and for five "
            "cells and more rows such as xxx/x.x"
        )
    return np.array(cells, dtype=np.int32)


@lru_cache(maxsize=64)
def polyominoes(size: int, *, chirality: Chirality = "merged") -> tuple[str, ...]:
    """List all shapes of a number of cells.

    Parameters
    ----------
    size : int
        Number of cells, 1 to 10.
    chirality : {"merged", "distinct"}
        As in `polyomino_name`.

    Returns
    -------
    tuple of str
        The names, in the order of all lists of driftwalk: I O T S L for four cells; for five and
        more those with fewer rows first, mirror images side by side.

    Raises
    ------
    InputError
        When the size is out of range.

    Examples
    --------
    >>> polyominoes(4)
    ('I', 'O', 'T', 'S', 'L')
    >>> polyominoes(4, chirality="distinct")
    ('I', 'O', 'T', 'S', 'Z', 'L', 'J')
    """
    require_chirality(chirality)
    if not 1 <= size <= LARGEST:
        raise InputError(f"all shapes are listed for 1 to {LARGEST} cells, got {size}")
    if size == 1:
        return ("1",)
    found = {
        name_of(moved_to_origin((*cells, new)), chirality)
        for name in polyominoes(size - 1, chirality=chirality)
        for cells in [cells_of_shape(name)]
        for new in neighbours(cells)
    }
    return tuple(sorted(found, key=shape_order))


@lru_cache(maxsize=1 << 16)
def shape_order(name: str) -> tuple[int, int, str, str]:
    """Return what shapes are sorted by: their size, then their place among shapes of that size."""
    if name in NAMED_SHAPES:
        return shape_size(name), list(NAMED_SHAPES).index(name), "", ""
    if discs_of(name):
        return graph_order(name)
    if any(counts := counts_of_shape(name)):
        return *counts, "", ""
    both = merged_shape(name), name
    merged, own = (code.translate(_BY_CELLS) for code in both)
    return shape_size(name), name.count("/"), merged, own


@lru_cache(maxsize=1 << 16)
def shape_size(name: str) -> int:
    """Return the number of cells of a shape, or of discs of a contact graph."""
    return discs_of(name) or counts_of_shape(name)[0] or NAMED_SHAPES.get(name, name).count("x")


@lru_cache(maxsize=1 << 16)
def merged_shape(name: str) -> str:
    """Return the name of a shape when mirror images count as one; of discs they do anyway."""
    if discs_of(name) or any(counts_of_shape(name)):
        return name
    return name_of(cells_of_shape(name), "merged")


@lru_cache(maxsize=1 << 16)
def name_of(cells: Cells, chirality: Chirality) -> str:
    """Name a shape given as `moved_to_origin` returns it; fast for one that came before."""
    if len(set(cells)) < len(cells):
        raise InputError("a cell is given twice")
    if not _is_connected(cells):
        raise InputError("the cells are not joined edge to edge")
    code = _canonical_code(cells, chirality)
    # Shapes of up to four cells have short names.
    return _short_names(chirality).get(code, code) if len(cells) <= 4 else code


def require_chirality(chirality: str) -> None:
    """Refuse a word that is no chirality."""
    if chirality not in get_args(Chirality):
        raise InputError(f"chirality is 'merged' or 'distinct', got '{chirality}'")


@lru_cache(maxsize=2)
def _short_names(chirality: Chirality) -> dict[str, str]:
    """Return the names of the small shapes by their canonical codes."""
    return {
        _canonical_code(cells_of_shape(name), chirality): name
        for name in NAMED_SHAPES
        if chirality == "distinct" or name not in _MIRRORED
    }


def _canonical_code(cells: Cells, chirality: Chirality) -> str:
    codes = [_code(turned) for turned in orientations(cells, chirality)]
    fewest = min(code.count("/") for code in codes)
    # Of codes with the same rows, "x" counts for more than ".".
    return max(code for code in codes if code.count("/") == fewest)


def orientations(cells: Cells, chirality: Chirality) -> Iterator[Cells]:
    """Give cells in all ways to turn them, and to mirror them where that is merged."""
    mirrored = [tuple((-x, y) for x, y in cells)] if chirality == "merged" else []
    for turned in (cells, *mirrored):
        for _ in range(4):
            yield turned
            turned = tuple((-y, x) for x, y in turned)


def _code(cells: Cells) -> str:
    xs, ys = zip(*cells, strict=True)
    left, top = min(xs), max(ys)
    rows = [["."] * (max(xs) - left + 1) for _ in range(top - min(ys) + 1)]
    for x, y in cells:
        rows[top - y][x - left] = "x"
    return "/".join(map("".join, rows))


def neighbours(cells: Cells) -> set[Cell]:
    """Return the cells that share an edge with some cells and are none of them."""
    return {(x + dx, y + dy) for x, y in cells for dx, dy in STEPS} - set(cells)


def put_beside(cells: list[Cell], one: Cell, other: Cell, face: int, turn: int) -> list[Cell]:
    """Return cells turned by quarters about one of them, which comes to a face of another cell."""
    (east, north), (cosine, sine) = STEPS[face], STEPS[turn]
    x0, y0 = other[0] + east, other[1] + north
    away = [(x - one[0], y - one[1]) for x, y in cells]
    return [(x0 + cosine * x - sine * y, y0 + sine * x + cosine * y) for x, y in away]


def _is_connected(cells: Cells) -> bool:
    left, ahead = set(cells), list(cells[:1])
    while ahead:
        cell = ahead.pop()
        if cell in left:
            left.remove(cell)
            ahead += neighbours((cell,)) & left
    return bool(cells) and not left
