"""Names of polyominoes, against counts that are known and forms found by brute force."""

from __future__ import annotations

from itertools import pairwise
from typing import Literal

import numpy as np
import pytest
from hypothesis import given, strategies as st
from lattice_runs import NAMED, form

from driftwalk.assembly.lattice.polyomino import polyomino_cells, polyomino_name, polyominoes
from driftwalk.core.errors import InputError

Chirality = Literal["merged", "distinct"]

# OEIS A000105, A000988 and A001168, from one cell on.
FREE = (1, 1, 2, 5, 12, 35, 108, 369)
ONE_SIDED = (1, 1, 2, 7, 18, 60, 196, 704)
FIXED = (1, 2, 6, 19, 63, 216, 760, 2725)
COUNTS: dict[Chirality, tuple[int, ...]] = {"merged": FREE, "distinct": ONE_SIDED}
CHIRALITY = st.sampled_from(["merged", "distinct"])


@st.composite
def shapes(draw: st.DrawFn, most: int = 9) -> list[tuple[int, int]]:
    """Grow a polyomino cell by cell."""
    cells = [(0, 0)]
    for _ in range(draw(st.integers(0, most - 1))):
        x, y = draw(st.sampled_from(cells))
        dx, dy = draw(st.sampled_from([(1, 0), (0, 1), (-1, 0), (0, -1)]))
        if (x + dx, y + dy) not in cells:
            cells.append((x + dx, y + dy))
    return cells


def moved(
    cells: list[tuple[int, int]], unit: complex, shift: complex, *, mirror: bool
) -> np.ndarray:
    """Mirror, turn and shift cells as complex numbers."""
    z = np.array([complex(*cell) for cell in cells])
    z = (z.conj() if mirror else z) * unit + shift
    return np.column_stack([z.real, z.imag]).round().astype(int)


@pytest.mark.parametrize("chirality", COUNTS)
@pytest.mark.parametrize("size", range(1, 9))
def test_number_of_shapes(size: int, chirality: Chirality) -> None:
    names = polyominoes(size, chirality=chirality)
    assert len(names) == len(set(names)) == COUNTS[chirality][size - 1]


@pytest.mark.parametrize("size", range(1, 9))
def test_every_orientation_of_every_shape_makes_up_the_fixed_ones(size: int) -> None:
    orientations = {
        form_of_turned
        for name in polyominoes(size)
        for unit in (1, 1j, -1, -1j)
        for mirror in (False, True)
        for form_of_turned in [
            tuple(sorted(map(tuple, at_origin(moved(cells_of(name), unit, 0, mirror=mirror)))))
        ]
    }
    assert len(orientations) == FIXED[size - 1]


def cells_of(name: str) -> list[tuple[int, int]]:
    return [tuple(cell) for cell in polyomino_cells(name).tolist()]


def at_origin(cells: np.ndarray) -> list[list[int]]:
    return (cells - cells.min(axis=0)).tolist()


@pytest.mark.parametrize("name", NAMED)
def test_small_shapes_have_their_names(name: str) -> None:
    cells = [(int(z.real), int(z.imag)) for z in map(complex, NAMED[name])]
    assert polyomino_name(cells, chirality="distinct") == name
    assert polyomino_name(cells) == {"Z": "S", "J": "L"}.get(name, name)
    assert form(cells_of(name), mirror=False) == form(cells, mirror=False)


def test_a_chiral_shape_of_five_has_a_code_for_each_hand() -> None:
    """The F pentomino, by hand: rows from the top, fewest rows, cells before gaps."""
    f = [(0, 1), (1, 0), (1, 1), (1, 2), (2, 2)]  # .xx / xx. / .x.
    mirrored = [(-x, y) for x, y in f]
    assert polyomino_name(f) == polyomino_name(mirrored) == "xx./.xx/.x."
    names = {polyomino_name(cells, chirality="distinct") for cells in (f, mirrored)}
    # F as drawn turns to .xx/xx./.x., x../xxx/.x., .x./.xx/xx., .x./xxx/..x.
    assert names == {"x../xxx/.x.", "xx./.xx/.x."}
    assert polyomino_name(f, chirality="distinct") == "x../xxx/.x."


@pytest.mark.slow
@given(shapes(), CHIRALITY, st.integers(0, 3), st.booleans())
def test_name_does_not_depend_on_place_turn_mirror_and_order(
    cells: list[tuple[int, int]], chirality: Chirality, turn: int, mirror: bool
) -> None:
    flipped = mirror and chirality == "merged"
    other = moved(cells, 1j**turn, complex(-7, 12), mirror=flipped)
    order = np.random.default_rng(turn).permutation(len(cells))
    assert polyomino_name(other[order], chirality=chirality) == polyomino_name(
        cells, chirality=chirality
    )


@given(shapes(6), shapes(6), CHIRALITY)
def test_same_name_means_same_form(
    one: list[tuple[int, int]], other: list[tuple[int, int]], chirality: Chirality
) -> None:
    mirror = chirality == "merged"
    same_form = form(one, mirror=mirror) == form(other, mirror=mirror)
    names = [polyomino_name(cells, chirality=chirality) for cells in (one, other)]
    assert (names[0] == names[1]) == same_form


@pytest.mark.parametrize("chirality", COUNTS)
@pytest.mark.parametrize("size", range(1, 8))
def test_names_that_differ_are_of_forms_that_differ(size: int, chirality: Chirality) -> None:
    names = polyominoes(size, chirality=chirality)
    forms = {form(cells_of(name), mirror=chirality == "merged") for name in names}
    assert len(forms) == len(names)
    assert [polyomino_name(polyomino_cells(name), chirality=chirality) for name in names] == list(
        names
    )


@pytest.mark.slow
@given(shapes(30))
def test_a_code_shows_the_cells(cells: list[tuple[int, int]]) -> None:
    name = polyomino_name(cells)
    if len(cells) <= 4:
        assert name in NAMED
        return
    rows = name.split("/")
    shown = [(x, -y) for y, row in enumerate(rows) for x, mark in enumerate(row) if mark == "x"]
    assert len(rows) <= len(rows[0])
    assert form(shown, mirror=True) == form(cells, mirror=True)


def test_mirror_images_stand_side_by_side() -> None:
    names = polyominoes(5, chirality="distinct")
    merged = [polyomino_name(polyomino_cells(name)) for name in names]
    assert list(dict.fromkeys(merged)) == list(polyominoes(5))
    runs = 1 + sum(a != b for a, b in pairwise(merged))
    assert runs == len(polyominoes(5))


@pytest.mark.parametrize(
    ("cells", "says"),
    [
        ([(0, 0), (1, 1)], "not joined edge to edge"),
        ([(0, 0), (0, 0)], "twice"),
        ([(0.5, 0.0)], "whole numbers"),
        ([], "shape"),
        ([0, 1], "shape"),
    ],
)
def test_cells_that_are_no_shape(cells: list[object], says: str) -> None:
    with pytest.raises(InputError, match=says):
        polyomino_name(cells)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["", "x", "Q", "x.x", "xx/x", ".....", "xxx./x..x", "x/x/x/x/x"])
def test_a_name_that_no_shape_has(name: str) -> None:
    with pytest.raises(InputError, match="no shape is called"):
        polyomino_cells(name)


@pytest.mark.parametrize("size", [0, 11])
def test_sizes_that_are_not_listed(size: int) -> None:
    with pytest.raises(InputError, match="1 to 10 cells"):
        polyominoes(size)


def test_chirality_is_one_of_two_words() -> None:
    with pytest.raises(InputError, match="'left'"):
        polyomino_name([(0, 0)], chirality="left")  # type: ignore[arg-type]
