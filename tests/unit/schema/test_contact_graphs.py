from itertools import combinations, permutations

import numpy as np
import pytest

from driftwalk.schema.shapes import contacts_of, discs_of, graph_name

Contacts = tuple[tuple[int, int], ...]
# Connected graphs up to isomorphism, https://oeis.org/A001349.
NUMBER = {2: 1, 3: 2, 4: 6, 5: 21}
FAMILIES = {
    "chain3": [(0, 1), (1, 2)],
    "triangle": [(0, 1), (1, 2), (0, 2)],
    "chain4": [(0, 1), (1, 2), (2, 3)],
    "star4": [(0, 1), (0, 2), (0, 3)],
    "ring4": [(0, 1), (1, 2), (2, 3), (0, 3)],
    "paw": [(0, 1), (1, 2), (0, 2), (2, 3)],
    "diamond": [(0, 1), (1, 2), (2, 3), (0, 3), (0, 2)],
    "star5": [(4, 0), (4, 1), (4, 2), (4, 3)],
    "ring6": [(k, (k + 1) % 6) for k in range(6)],
    "chain12": [(k, k + 1) for k in range(11)],
}


def connected(discs: int, contacts: Contacts) -> bool:
    reached = {0}
    for _ in range(discs):
        reached |= {b for pair in contacts for b in pair if reached & set(pair)}
    return len(reached) == discs


def all_connected(discs: int) -> list[Contacts]:
    pairs = list(combinations(range(discs), 2))
    chosen = (kept for n in range(len(pairs) + 1) for kept in combinations(pairs, n))
    return [contacts for contacts in chosen if connected(discs, contacts)]


def least(discs: int, contacts: Contacts) -> Contacts:
    """Try every numbering: the canonical form by brute force."""
    return min(
        tuple(sorted(tuple(sorted((order[a], order[b]))) for a, b in contacts))
        for order in permutations(range(discs))
    )


@pytest.mark.parametrize("discs", NUMBER)
def test_a_name_is_of_one_graph_up_to_isomorphism(discs: int) -> None:
    form_of: dict[str, Contacts] = {}
    for contacts in all_connected(discs):
        name = graph_name(discs, contacts)
        if discs <= 4:
            assert form_of.setdefault(name, least(discs, contacts)) == least(discs, contacts)
        assert discs_of(name) == discs or name == "2"
        form_of.setdefault(name, contacts)
    # As many names as graphs: with 5 discs no two graphs share one, if renumbering keeps it.
    assert len(form_of) == NUMBER[discs]


@pytest.mark.parametrize("discs", [5, 6, 7, 8])
def test_renumbering_keeps_the_name(discs: int) -> None:
    rng = np.random.default_rng(discs)
    for _ in range(20):
        tree = [(k, int(rng.integers(k))) for k in range(1, discs)]
        more = [tuple(rng.choice(discs, 2, replace=False).tolist()) for _ in range(rng.integers(3))]
        name = graph_name(discs, [*tree, *more])
        order = rng.permutation(discs).tolist()
        assert graph_name(discs, [(order[a], order[b]) for a, b in [*tree, *more]]) == name
        assert graph_name(discs, contacts_of(name)) == name


@pytest.mark.parametrize("name", FAMILIES)
def test_graphs_have_the_names_of_the_literature(name: str) -> None:
    contacts = FAMILIES[name]
    discs = 1 + max(max(pair) for pair in contacts)
    assert graph_name(discs, contacts) == name
    assert discs_of(name) == discs
    assert graph_name(discs, contacts_of(name)) == name


def test_of_many_discs_the_counts_are_said() -> None:
    contacts = [(k, k + 1) for k in range(9)] + [(0, 2), (3, 5)]
    assert graph_name(10, contacts) == "10 discs, 11 contacts"
    assert discs_of("10 discs, 11 contacts") == 10
    assert [discs_of(name) for name in ("T", "xxx/x.x", "1", "other")] == [0, 0, 0, 0]
