"""Outcome classes: the multiset of shapes that the blocks of a world have formed.

A class is the multiset of the shapes, written with the larger ones first: ``I3+1`` is a row of
three and a single block. Classes are listed by the sizes of their shapes, the largest first, and
then by the shapes. The names of shapes and of contact graphs are those of
`driftwalk.schema.shapes`.

**Kinds of blocks** make coloured polyominoes. A shape is written with the kinds of its blocks, row
by row from the top as the shape is drawn: ``T:ABAA`` has the bar A B A and an A below. Of the ways
to lay the shape on its drawing the one with the kinds first in the alphabet counts. Faces do not
count, only kinds.

**Discs and rectangles** latch as they lie, so the shape of an assembly is its contact graph: which
of its bodies touch, however they are numbered. Assemblies are rigid: the poses at the end say what
touched all along.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from itertools import combinations_with_replacement, groupby, product
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.lattice.polyomino import (
    Chirality,
    merged_shape,
    name_of,
    orientations,
    polyomino_cells,
    polyominoes,
    require_chirality,
    shape_order,
    shape_size,
)
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.model import Study, parse_study
from driftwalk.schema.check import require_kind
from driftwalk.schema.shapes import (
    MOST_NAMED,
    Cell,
    counted_assemblies,
    counted_class,
    discs_of,
    graph_name,
    moved_to_origin,
)

if TYPE_CHECKING:
    import xarray as xr


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
    if labels.ndim != 1 or cells.shape != (labels.size, 2) or cells.dtype.kind not in "iu":
        raise InputError(
            "a world has whole cells (blocks, 2) and assemblies (blocks,), got "
            f"{cells.dtype} {cells.shape} and {labels.shape}"
        )
    require_chirality(chirality)
    members: dict[int, list[Cell]] = {}
    for label, (column, row) in zip(labels.tolist(), cells.tolist(), strict=True):
        members.setdefault(label, []).append((column, row))
    # In plain numbers: a live tank of 64 blocks is named in every frame.
    return class_name(name_of(moved_to_origin(tuple(own)), chirality) for own in members.values())


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


def kind_classes(assembly: xr.Dataset) -> dict[str, int]:
    """Count the runs by outcome class with the kinds of the blocks, the most frequent first.

    Parameters
    ----------
    assembly : xarray.Dataset
        An `assembly` of blocks of several kinds, ``[assembly] binding`` of its study.

    Returns
    -------
    dict of str to int
        Number of runs by class, such as ``"2:AB+1:A+1:B"``; names of several letters are parted by
        commas. Runs without an outcome are left out.

    Raises
    ------
    InputError
        When the dataset is of another kind, or its blocks are all of one.

    Examples
    --------
    >>> import driftwalk as dw
    >>> kinds = [{"name": n, "count": 1, "faces": ["N", "S", "N", "S"]} for n in "AB"]
    >>> study = dw.Study(assembly={"blocks": 2, "binding": {"kinds": kinds}})
    >>> found = dw.assembly.assemble(study, dw.uniform_flow(0.0, 0.0), runs=3, duration=0.1)
    >>> dw.assembly.kind_classes(found)
    {'1:A+1:B': 3}
    """
    require_kind(assembly, "assembly")
    if "kind" not in assembly:
        raise InputError(
            "the blocks are all of one kind: outcome_distribution counts their classes"
        )
    settings = parse_study(assembly.attrs["study"]).assembly
    names = [kind.name for kind in settings.binding.kinds] if settings.binding is not None else []
    whole = (assembly[name].values for name in ("outcome", "cell", "kind", "assembly"))
    found = Counter[str]()
    for outcome, cell, kind, label in zip(*whole, strict=True):
        if outcome < 0:
            continue
        shapes = []
        for one in np.unique(label):
            own = label == one
            cells = tuple(map(tuple, cell[own].tolist()))
            kinds = tuple(names[place] for place in kind[own])
            shapes.append(_coloured(cells, kinds, settings.chirality))
        found["+".join(sorted(shapes, key=_order))] += 1
    return dict(found.most_common())


@lru_cache(maxsize=1 << 16)
def _coloured(cells: tuple[Cell, ...], kinds: tuple[str, ...], chirality: Chirality) -> str:
    name = name_of(moved_to_origin(cells), chirality)
    drawn = sorted(map(tuple, polyomino_cells(name).tolist()))
    ways = []
    for turned in orientations(cells, chirality):
        low = min(x for x, _ in turned), min(y for _, y in turned)
        placed = {
            (x - low[0], y - low[1]): kind for (x, y), kind in zip(turned, kinds, strict=True)
        }
        if sorted(placed) == drawn:
            ways.append([placed[at] for at in sorted(placed, key=lambda at: (-at[1], at[0]))])
    parted = "," if any(len(kind) > 1 for kind in kinds) else ""
    return f"{name}:{parted.join(min(ways))}"


def _order(shape: str) -> tuple[int, tuple[int, int, str, str], str]:
    name, _, kinds = shape.partition(":")
    return -shape_size(name), shape_order(name), kinds


class BodyContactPolicy(NamedTuple):
    """When discs, or rectangles, of one assembly touch."""

    gap: float = 0.01
    """Gap up to which two bodies of an assembly are a contact, in diameters or longer sides; chosen
    by hand: two discs close it within a time step. The native core has the same for what a removed
    one leaves."""


BODY_CONTACT: Final = BodyContactPolicy()


def overlap_depth(
    first: Floats, second: Floats, *, side: float, width: float | None = None
) -> Floats:
    """Return how deep rectangles overlap [m], negative where they are apart, shape (n,).

    By the separating axes (Gottschalk, Lin and Manocha 1996): the smallest over the four face
    directions.

    Parameters
    ----------
    first, second : ndarray, shape (n, 3)
        Poses [m, m, rad].
    side : float
        Length along the own x [m].
    width : float, optional
        Along the own y [m]; default: squares.
    """
    turn = second[:, 2] - first[:, 2]
    half = np.array([side, side if width is None else width]) / 2.0
    same, turned = np.abs(np.cos(turn)), np.abs(np.sin(turn))
    reach = half[:, None] * (1.0 + same) + half[::-1, None] * turned
    along = np.stack([first[:, 2], first[:, 2], second[:, 2], second[:, 2]])
    along += np.array([0.0, 0.5, 0.0, 0.5])[:, None] * np.pi
    apart = second[:, :2] - first[:, :2]
    reached = np.abs(np.cos(along) * apart[:, 0] + np.sin(along) * apart[:, 1])
    return np.asarray((np.tile(reach, (2, 1)) - reached).min(axis=0))


def contact_pairs(
    places: Floats, *, diameter: float, width: float | None = None
) -> list[tuple[int, int]]:
    """Return the pairs of bodies that touch, if they are of one assembly, the lower first.

    Parameters
    ----------
    places : ndarray, shape (n, 2 or more)
        Columns x and y of the centres [m]; of rectangles the third is theta [rad].
    diameter : float
        Of a disc, or length of a rectangle along its own x [m].
    width : float, optional
        Of a rectangle, along its own y [m]; default: discs.
    """
    from scipy.spatial import cKDTree

    # A broken world has lost some of its bodies.
    seen = np.flatnonzero(np.isfinite(places[:, : 2 if width is None else 3]).all(axis=1))
    longest = max(diameter, width or 0.0)
    # Beyond a diagonal and the gap, and rounding, none touch.
    reach = math.hypot(diameter, width or 0.0) + 2.0 * BODY_CONTACT.gap * longest
    pairs = seen[cKDTree(places[seen, :2]).query_pairs(reach, output_type="ndarray")]
    first, second = places[pairs[:, 0]], places[pairs[:, 1]]
    if width is None:
        touch = np.hypot(*(second - first)[:, :2].T) <= diameter * (1.0 + BODY_CONTACT.gap)
    else:
        depth = overlap_depth(first, second, side=diameter, width=width)
        touch = depth >= -BODY_CONTACT.gap * longest
    return [(a, b) for a, b in pairs[touch].tolist()]


def disc_class(
    places: Floats,
    assembly: Sequence[int] | npt.NDArray[np.int32],
    *,
    diameter: float,
    width: float | None = None,
) -> str:
    """Name the outcome class of a world of discs, or of rectangles.

    Parameters
    ----------
    places, diameter, width
        As in `contact_pairs`.
    assembly : sequence of int, shape (n,)
        Which assembly each body belongs to: any label.

    Returns
    -------
    str
        Names of the contact graphs (`driftwalk.schema.shapes`), joined by ``+``.

    Examples
    --------
    >>> row = np.array([[0.0, 0.0], [0.04, 0.0], [0.08, 0.0], [0.2, 0.0]])
    >>> disc_class(row, [0, 0, 0, 3], diameter=0.04)
    'chain3+1'
    """
    labels = np.asarray(assembly)
    if labels.size > MOST_NAMED:
        return counted_class(np.unique(labels).size)
    pairs = contact_pairs(places, diameter=diameter, width=width)
    noun = "discs" if width is None else "rectangles"
    shapes = []
    for label in np.unique(labels):
        own = np.flatnonzero(labels == label).tolist()
        place = {body: index for index, body in enumerate(own)}
        met = [(place[a], place[b]) for a, b in pairs if a in place and b in place]
        shapes.append(graph_name(len(own), met, noun))
    return class_name(shapes)


def state_class(state: Mapping[str, npt.NDArray[Any]], study: Study) -> str:
    """Name the outcome class of a world of the native core, by its lattice or by its contacts."""
    if study.block.has_lattice:
        chirality = study.assembly.chirality
        return world_class(state["cell"], state["assembly"], chirality=chirality)
    return disc_class(state["pose"], state["assembly"], **study.block.contact_size)
