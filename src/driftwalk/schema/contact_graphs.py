"""Names of the contact graphs of discs and rectangles, as they stand in outcome classes.

A graph has a name of the literature (chain4, star4, ring4, triangle, paw, diamond) or is called by
its contacts, the discs being letters: ``ab.ac.ad.be``. Of more than 8 discs only chains and rings
have a name, and of others the two counts are said: ``9 discs, 10 contacts``. Of rectangles the same
holds: ``9 rectangles, 10 contacts``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from functools import lru_cache
from itertools import permutations, product
from typing import Final

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
