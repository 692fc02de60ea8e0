"""Outcome classes: their number, their order, and that of a world."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest
from hypothesis import given, strategies as st
from lattice_runs import form, random_run, raw_arrays

from driftwalk.assembly.outcomes.outcome_classes import (
    class_cells,
    class_name,
    class_shapes,
    merge_chirality,
    outcome_classes,
    sort_classes,
    world_class,
)
from driftwalk.core.errors import InputError

Chirality = Literal["merged", "distinct"]
SHAPES: dict[Chirality, tuple[int, ...]] = {
    "merged": (1, 1, 2, 5, 12, 35, 108, 369),
    "distinct": (1, 1, 2, 7, 18, 60, 196, 704),
}
PUBLISHED: dict[Chirality, tuple[int, ...]] = {
    "merged": (1, 2, 4, 10, 24, 68),
    "distinct": (1, 2, 4, 12, 32, 103),
}
FOUR = "I O T S L I3+1 L3+1 2+2 2+1+1 1+1+1+1"
FOUR_DISTINCT = "I O T S Z L J I3+1 L3+1 2+2 2+1+1 1+1+1+1"


def multisets(shapes: tuple[int, ...], total: int) -> int:
    """Return the coefficient of x^total in the product of (1 - x^n)^-shapes[n]."""
    series = [1] + [0] * total
    for size, count in enumerate(shapes, start=1):
        for _ in range(count):
            for power in range(size, total + 1):
                series[power] += series[power - size]
    return series[total]


@pytest.mark.parametrize("chirality", SHAPES)
@pytest.mark.parametrize("blocks", range(1, 9))
def test_number_of_classes(blocks: int, chirality: Chirality) -> None:
    names = outcome_classes(blocks, chirality=chirality)
    assert len(names) == len(set(names)) == multisets(SHAPES[chirality], blocks)
    assert (len(names),) == PUBLISHED[chirality][blocks - 1 : blocks] or blocks > 6
    sizes = {sum(len(cells) for cells in class_cells(name)) for name in names[:: max(1, blocks)]}
    assert sizes == {blocks}


def test_order_for_four_blocks() -> None:
    assert outcome_classes(4) == tuple(FOUR.split())
    assert outcome_classes(4, chirality="distinct") == tuple(FOUR_DISTINCT.split())


def test_order_for_few_blocks() -> None:
    assert outcome_classes(1) == ("1",)
    assert outcome_classes(2) == ("2", "1+1")
    assert outcome_classes(3) == ("I3", "L3", "2+1", "1+1+1")


@pytest.mark.parametrize("chirality", SHAPES)
@pytest.mark.parametrize("blocks", [5, 6, 7])
def test_partitions_with_large_shapes_come_first(blocks: int, chirality: Chirality) -> None:
    names = outcome_classes(blocks, chirality=chirality)
    partitions = [tuple(len(cells) for cells in class_cells(name)) for name in names]
    assert partitions == sorted(partitions, reverse=True)
    assert names[-1] == "+".join("1" * blocks)


@pytest.mark.parametrize("chirality", SHAPES)
@pytest.mark.parametrize("blocks", [4, 6, 7])
def test_sorting_gives_the_order_of_the_list(blocks: int, chirality: Chirality) -> None:
    names = outcome_classes(blocks, chirality=chirality)
    shuffled = [names[i] for i in np.random.default_rng(1).permutation(len(names))]
    assert sort_classes([*shuffled, *shuffled[:3]]) == names


@pytest.mark.parametrize("blocks", [4, 5, 6])
def test_merged_classes_are_those_of_the_mirrored_shapes(blocks: int) -> None:
    distinct = outcome_classes(blocks, chirality="distinct")
    for name in distinct:
        merged = merge_chirality(name)
        assert sorted(form(c, mirror=True) for c in class_cells(name)) == sorted(
            form(c, mirror=True) for c in class_cells(merged)
        )
    assert {merge_chirality(name) for name in distinct} == set(outcome_classes(blocks))
    assert all(merge_chirality(name) == name for name in outcome_classes(blocks))


def test_names_of_shapes_in_any_order_make_one_class() -> None:
    assert class_name(["1", "2", "I3", "1"]) == "I3+2+1+1"
    assert class_name(["xxxxx", "L", "O"]) == "xxxxx+O+L"
    assert class_shapes("I3+2+1+1") == ("I3", "2", "1", "1")


@given(st.integers(1, 4), st.sampled_from(["merged", "distinct"]), st.integers(0, 2**32))
def test_class_of_a_world(blocks: int, chirality: Chirality, seed: int) -> None:
    """The cells may be anywhere, the labels anything, and the blocks in any order."""
    rng = np.random.default_rng(seed)
    run = random_run(blocks, rng, stop=1.0)
    world = raw_arrays([run], blocks)
    cell, assembly = world["cell"][0], world["assembly"][0]
    shift = rng.integers(-20, 20, (blocks, 2))[assembly]
    labels = rng.permutation(100)[assembly]
    order = rng.permutation(blocks)
    found = world_class((cell + shift)[order], labels[order], chirality=chirality)
    assert found == run.worlds[-1].small_class(mirror=chirality == "merged")


@pytest.mark.parametrize("name", ["", "I3+", "Q", "2+xx/x"])
def test_a_name_that_no_class_has(name: str) -> None:
    for function in (class_cells, class_shapes, merge_chirality):
        with pytest.raises(InputError, match="no shape is called"):
            function(name)


@pytest.mark.parametrize("blocks", [0, 9])
def test_numbers_of_blocks_that_are_not_listed(blocks: int) -> None:
    with pytest.raises(InputError, match="1 to 8 blocks"):
        outcome_classes(blocks)


def test_a_world_of_other_shapes_is_refused() -> None:
    with pytest.raises(InputError, match="blocks"):
        world_class([(0, 0), (1, 0)], [0])
