"""Outcome classes: the multiset of shapes that the blocks of a world have formed.

A class is the multiset of the shapes, written with the larger ones first: ``I3+1`` is a row of
three and a single block. Classes are listed by the sizes of their shapes, the largest first, and
then by the shapes. Of discs a shape is a contact graph (`driftwalk.schema.contact_graphs`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import lru_cache
from itertools import combinations_with_replacement, groupby, product

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.lattice.polyomino import (
    Chirality,
    merged_shape,
    polyomino_cells,
    polyomino_name,
    polyominoes,
    require_chirality,
    shape_order,
    shape_size,
)
from driftwalk.core.errors import InputError
from driftwalk.schema.contact_graphs import discs_of
from driftwalk.schema.shapes import MOST_NAMED, counted_assemblies, counted_class

MOST_BLOCKS = 8
"""Blocks up to which all classes are listed; of more, those that occur. Chosen by hand."""


@lru_cache(maxsize=32)
def outcome_classes(blocks: int, *, chirality: Chirality = "merged") -> tuple[str, ...]:
    """List all outcome classes of a number of blocks.

    Parameters
    ----------
    blocks : int
        Number of blocks, 1 to 8.
    chirality : {"merged", "distinct"}
        Whether mirror images are one shape or two.

    Returns
    -------
    tuple of str
        The names, in order.

    Raises
    ------
    InputError
        When the number of blocks is out of range.

    Examples
    --------
    >>> outcome_classes(4)
    ('I', 'O', 'T', 'S', 'L', 'I3+1', 'L3+1', '2+2', '2+1+1', '1+1+1+1')
    >>> len(outcome_classes(4, chirality="distinct"))
    12
    """
    require_chirality(chirality)
    if not 1 <= blocks <= MOST_BLOCKS:
        raise InputError(f"all classes are listed for 1 to {MOST_BLOCKS} blocks, got {blocks}")
    return tuple(
        "+".join(shape for shapes in choice for shape in shapes)
        for sizes in _partitions(blocks, blocks)
        for choice in product(
            *(
                combinations_with_replacement(
                    polyominoes(size, chirality=chirality), len(list(same))
                )
                for size, same in groupby(sizes)
            )
        )
    )


def class_name(shapes: Iterable[str]) -> str:
    """Name the outcome class of some shapes.

    Parameters
    ----------
    shapes : iterable of str
        Names of the shapes, one per assembly, in any order.

    Returns
    -------
    str
        The class.

    Examples
    --------
    >>> class_name(["1", "I3"])
    'I3+1'
    """
    ordered = sorted(shapes, key=lambda one: (-shape_size(one), shape_order(one)))
    many = sum(map(shape_size, ordered)) > MOST_NAMED
    return counted_class(len(ordered)) if many else "+".join(ordered)


def class_shapes(name: str) -> tuple[str, ...]:
    """Return the names of the shapes in a class, the largest first.

    Parameters
    ----------
    name : str
        An outcome class.

    Raises
    ------
    InputError
        When the name is no outcome class.

    Examples
    --------
    >>> class_shapes("2+1+1")
    ('2', '1', '1')
    """
    shapes = tuple(name.split("+"))
    for shape in set(shapes):
        if not discs_of(shape):
            polyomino_cells(shape)
    return shapes


def class_cells(name: str) -> list[npt.NDArray[np.int32]]:
    """Return the cells of each shape in a class, the largest first, to draw them.

    Parameters
    ----------
    name : str
        An outcome class.

    Returns
    -------
    list of numpy.ndarray of int32, shape (cells, 2)
        As `polyomino_cells` gives them.

    Raises
    ------
    InputError
        When the name is no outcome class.

    Examples
    --------
    >>> [cells.tolist() for cells in class_cells("2+1")]
    [[[0, 0], [1, 0]], [[0, 0]]]
    """
    return [polyomino_cells(shape) for shape in name.split("+")]


def merge_chirality(name: str) -> str:
    """Return the class, or the shape, in which mirror images count as one.

    Parameters
    ----------
    name : str
        An outcome class or a shape of either chirality.

    Raises
    ------
    InputError
        When the name is no outcome class.

    Examples
    --------
    >>> merge_chirality("Z"), merge_chirality("J+S")
    ('S', 'S+L')
    """
    return class_name(merged_shape(shape) for shape in class_shapes(name))


def target_class(
    target: str, blocks: Iterable[int], *, chirality: Chirality | None, vary_blocks: bool = False
) -> str:
    """Return a target as runs name it.

    Parameters
    ----------
    target : str
        An outcome class, its shapes in any order.
    blocks : iterable of int
        Numbers of blocks of the runs.
    chirality : {"merged", "distinct"} or None
        Of the runs; None for discs.
    vary_blocks : bool
        Whether runs may have more blocks than the target.

    Raises
    ------
    InputError
        When it is no outcome class, or has another number of blocks than the runs.

    Examples
    --------
    >>> target_class("1+J", [5], chirality="merged")
    'L+1'
    """
    try:
        name = class_name(class_shapes(target.strip()))
        if chirality == "merged":
            name = merge_chirality(name)
        own = sum(map(shape_size, class_shapes(name)))
    except InputError as error:
        raise InputError(f"target {target}: {error}") from error
    for number in sorted(set(blocks)):
        if number > MOST_NAMED:
            raise InputError(
                f"a tank of {number} blocks has no named classes, which a yield needs: take up to "
                f"{MOST_NAMED}"
            )
        if number < own or (number > own and not vary_blocks):
            raise InputError(f"target {target} has {own} blocks, and the runs have {number}")
    return name


def world_class(
    cell: npt.ArrayLike, assembly: npt.ArrayLike, *, chirality: Chirality = "merged"
) -> str:
    """Name the outcome class of one world.

    Parameters
    ----------
    cell : array_like of int, shape (blocks, 2)
        Cell of each block on the lattice of its assembly.
    assembly : array_like of int, shape (blocks,)
        Which assembly each block belongs to: any label.
    chirality : {"merged", "distinct"}
        As in `outcome_classes`.

    Returns
    -------
    str
        The class.

    Raises
    ------
    InputError
        When the members of an assembly are no polyomino, or the shapes disagree.

    Examples
    --------
    >>> world_class([(0, 0), (1, 0), (0, 0), (0, 1)], [0, 0, 2, 0])
    'L3+1'
    """
    cells, labels = np.asarray(cell), np.asarray(assembly)
    if labels.size > MOST_NAMED:
        return counted_class(np.unique(labels).size)
    if labels.ndim != 1 or cells.shape != (labels.size, 2):
        raise InputError(
            f"a world has cells (blocks, 2) and assemblies (blocks,), got {cells.shape} and "
            f"{labels.shape}"
        )
    return class_name(
        polyomino_name(cells[labels == label], chirality=chirality) for label in np.unique(labels)
    )


def sort_classes(names: Iterable[str]) -> tuple[str, ...]:
    """Return classes without repetition in the order of `outcome_classes`.

    Parameters
    ----------
    names : iterable of str
        Outcome classes of any number of blocks.

    Returns
    -------
    tuple of str
        The classes, those with the largest shapes first.

    Examples
    --------
    >>> sort_classes(["1+1+1", "L3", "2+1", "L3"])
    ('L3', '2+1', '1+1+1')
    """
    return tuple(sorted(set(names), key=_class_order))


def listed_classes(
    occurred: Iterable[str], blocks: int, *, chirality: Chirality | None
) -> tuple[str, ...]:
    """Return the classes that a dataset lists: all up to 8 blocks, else those that occurred.

    Those that occurred too where there is no chirality, of discs.
    """
    if blocks <= MOST_BLOCKS and chirality is not None:
        return outcome_classes(blocks, chirality=chirality)
    return sort_classes(occurred)


def listed_shapes(
    occurred: Iterable[str], blocks: int, *, chirality: Chirality | None
) -> tuple[str, ...]:
    """Return the shapes that a dataset lists, the smallest first, by the same rule."""
    if blocks <= MOST_BLOCKS and chirality is not None:
        sizes = range(1, blocks + 1)
        return tuple(name for size in sizes for name in polyominoes(size, chirality=chirality))
    return tuple(sorted(set(occurred), key=shape_order))


def _class_order(name: str) -> tuple[list[int], list[tuple[int, int, str, str]]]:
    if counted := counted_assemblies(name):
        return [counted], []
    shapes = name.split("+")
    return [-shape_size(shape) for shape in shapes], [shape_order(shape) for shape in shapes]


def _partitions(total: int, largest: int) -> Iterator[tuple[int, ...]]:
    """Give the ways to write a number as a sum, those with the largest summands first."""
    if total == 0:
        yield ()
    for first in range(min(total, largest), 0, -1):
        for rest in _partitions(total - first, first):
            yield (first, *rest)
