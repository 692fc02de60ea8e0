"""Names of polyominoes and of contact graphs, as they stand in the outcome classes of datasets.

A shape has a short name ("L3") or is called by its rows from the top, as seen from above with y up:
``x`` for a cell and ``.`` for none, joined by ``/``.

A contact graph of discs or rectangles has a name of the literature (chain4, star4, ring4, triangle,
paw, diamond) or is called by its contacts, the discs being letters: ``ab.ac.ad.be``. Of more than 8
discs only chains and rings have a name, and of others the two counts are said: ``9 discs, 10
contacts``. Rectangles are counted alike: ``9 rectangles, 10 contacts``.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator
from functools import lru_cache
from itertools import permutations, product
from typing import Final

Cell = tuple[int, int]
Cells = tuple[Cell, ...]

STEPS: Final = ((1, 0), (0, 1), (-1, 0), (0, -1))
"""From a cell to its neighbour at each face, in the order of the faces."""

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


def joins_of_cells(cells: Collection[Cell]) -> int:
    """Return how many pairs of cells lie next to each other.

    Examples
    --------
    >>> joins_of_cells({(0, 0), (1, 0), (0, 1), (1, 1)})
    4
    """
    return sum(((x + 1, y) in cells) + ((x, y + 1) in cells) for x, y in cells)


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


Contacts = tuple[tuple[int, int], ...]

MOST_DISCS: Final = 8
"""Discs up to which a graph is named by more than its two counts; chosen by hand."""
_LETTERS: Final = "abcdefgh"
_NAMED: Final = {"triangle": "ab.ac.bc", "paw": "ab.ac.ad.bc", "diamond": "ab.ac.ad.bc.bd"}
_NAMES: Final = {code: name for name, code in _NAMED.items()}
_FAMILY: Final = re.compile(r"(chain|star|ring)(\d+)")
_COUNTS: Final = re.compile(r"(\d+) (?:discs|rectangles), (\d+) contacts")
_CODE: Final = re.compile(r"[a-h]{2}(\.[a-h]{2})+")


def counted_graph(discs: int, contacts: int, noun: str = "discs") -> str:
    """Return the name of a graph of more than 8 discs or rectangles (`noun`)."""
    return f"{discs} {noun}, {contacts} contacts"


def graph_name(discs: int, contacts: Iterable[tuple[int, int]], noun: str = "discs") -> str:
    """Return the name of a connected contact graph, the same however its discs are numbered.

    Parameters
    ----------
    discs : int
        Number of discs.
    contacts : iterable of (int, int)
        Pairs of discs that touch, by index from 0.
    noun : str
        What they are: "discs" or "rectangles".

    Examples
    --------
    >>> graph_name(4, [(0, 1), (2, 1), (1, 3)]), graph_name(3, [(0, 1), (1, 2), (2, 0)])
    ('star4', 'triangle')
    >>> graph_name(5, [(0, 1), (1, 2), (2, 3), (2, 4)])
    'ab.ac.ad.be'
    """
    return _name(discs, tuple(sorted({(min(pair), max(pair)) for pair in contacts})), noun)


@lru_cache(maxsize=1 << 14)
def _name(discs: int, contacts: Contacts, noun: str) -> str:
    if discs <= 2:
        return str(discs)
    degrees = [sum(disc in pair for pair in contacts) for disc in range(discs)]
    is_tree = len(contacts) == discs - 1
    if is_tree and max(degrees) == 2:
        return f"chain{discs}"
    if is_tree and max(degrees) == discs - 1:
        return f"star{discs}"
    if discs > 3 and set(degrees) == {2}:
        return f"ring{discs}"
    if discs > MOST_DISCS:
        return counted_graph(discs, len(contacts), noun)
    first = min(_numberings(discs, contacts))
    code = ".".join(_LETTERS[one] + _LETTERS[other] for one, other in first)
    return _NAMES.get(code, code)


def _numberings(discs: int, contacts: Contacts) -> Iterator[Contacts]:
    """Yield the contacts under every numbering that has discs with more contacts first.

    Discs whose surroundings differ are never mixed: that leaves few numberings.
    """
    near = [[b if a == disc else a for a, b in contacts if disc in (a, b)] for disc in range(discs)]
    rank = [-len(others) for others in near]
    for _ in range(discs):
        seen = [(rank[disc], sorted(rank[one] for one in near[disc])) for disc in range(discs)]
        rank = [sorted(seen).index(one) for one in seen]
    alike = [[disc for disc in range(discs) if rank[disc] == one] for one in sorted(set(rank))]
    for orders in product(*map(permutations, alike)):
        place = {disc: number for number, disc in enumerate(disc for one in orders for disc in one)}
        ends = (sorted((place[a], place[b])) for a, b in contacts)
        yield tuple(sorted((low, high) for low, high in ends))


def contacts_of(name: str) -> Contacts:
    """Return the contacts of a graph from its name; none of a name that says no graph.

    Examples
    --------
    >>> contacts_of("star4"), contacts_of("triangle"), contacts_of("T")
    (((0, 1), (0, 2), (0, 3)), ((0, 1), (0, 2), (1, 2)), ())
    """
    if family := _FAMILY.fullmatch(name):
        word, discs = family[1], int(family[2])
        chain = tuple((disc, disc + 1) for disc in range(discs - 1))
        if word == "star":
            return tuple((0, disc) for disc in range(1, discs))
        return (*chain, (0, discs - 1)) if word == "ring" else chain
    code = _NAMED.get(name, name)
    if not _CODE.fullmatch(code):
        return ()
    return tuple((_LETTERS.index(pair[0]), _LETTERS.index(pair[1])) for pair in code.split("."))


def discs_of(name: str) -> int:
    """Return the number of discs in a graph from its name; 0 of a name that is no graph's.

    Examples
    --------
    >>> discs_of("ring5"), discs_of("ab.ac.ad.be"), discs_of("9 discs, 10 contacts"), discs_of("T")
    (5, 5, 9, 0)
    """
    if counts := _COUNTS.fullmatch(name):
        return int(counts[1])
    return 1 + max((max(pair) for pair in contacts_of(name)), default=-1)


def graph_order(name: str) -> tuple[int, int, str, str]:
    """Return what graphs are sorted by: discs, contacts, and names before codes."""
    counts = _COUNTS.fullmatch(name)
    contacts = int(counts[2]) if counts else len(contacts_of(name))
    return discs_of(name), contacts, "code" if _CODE.fullmatch(name) else "", name
