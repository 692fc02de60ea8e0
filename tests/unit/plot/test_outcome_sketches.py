"""Sketches of outcome classes: the squares that are drawn are the cells of the shapes."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from matplotlib.offsetbox import AnnotationBbox
from matplotlib.patches import Rectangle
from synthetic_assembly import outcome_classes

from driftwalk.core.errors import InputError
from driftwalk.plot.parts.outcome_classes import (
    GAP,
    class_cells,
    draw_sketches_below,
    is_class,
    name_text,
    shape_cells,
    sketch_box,
    sketch_size,
)
from driftwalk.plot.parts.style import axes_or_new

# As seen from above with y upwards; written by hand: (column, row) from the lower left.
TETROMINOES = {
    "I": {(0, 0), (1, 0), (2, 0), (3, 0)},
    "O": {(0, 0), (1, 0), (0, 1), (1, 1)},
    "T": {(0, 1), (1, 1), (2, 1), (1, 0)},
    "S": {(0, 0), (1, 0), (1, 1), (2, 1)},
    "Z": {(0, 1), (1, 1), (1, 0), (2, 0)},
    "L": {(0, 2), (0, 1), (0, 0), (1, 0)},
    "J": {(1, 2), (1, 1), (1, 0), (0, 0)},
}
ALL_CLASSES = [
    (name, blocks, chirality)
    for blocks, chirality in ((2, "merged"), (4, "merged"), (4, "distinct"), (6, "merged"))
    for name in outcome_classes(blocks, chirality)
]


def turns(cells) -> list[frozenset[tuple[int, int]]]:
    """Return the four turned copies of a set of cells, at the origin."""
    found = []
    points = [(int(x), int(y)) for x, y in cells]
    for _ in range(4):
        points = [(-y, x) for x, y in points]
        low = [min(point[axis] for point in points) for axis in (0, 1)]
        found.append(frozenset((x - low[0], y - low[1]) for x, y in points))
    return found


def components(corners) -> list[list[tuple[float, float]]]:
    """Return the squares grouped by whether they share a whole side."""
    rest = [tuple(corner) for corner in corners]
    groups = []
    while rest:
        group, ahead = [], [rest.pop()]
        while ahead:
            one = ahead.pop()
            group.append(one)
            near = [other for other in rest if abs(np.subtract(one, other)).sum() < 1.0 + 1e-6]
            near = [other for other in near if min(abs(np.subtract(one, other))) < 1e-6]
            rest = [other for other in rest if other not in near]
            ahead += near
        groups.append(group)
    return groups


@pytest.mark.parametrize("name", TETROMINOES)
def test_tetrominoes_look_as_drawn_by_hand(name) -> None:
    assert {tuple(cell) for cell in shape_cells(name)} == TETROMINOES[name]


def test_a_code_is_read_from_the_top() -> None:
    assert {tuple(cell) for cell in shape_cells("xxx/.x.")} == TETROMINOES["T"]


@pytest.mark.parametrize("orientation", ["wide", "tall"])
@pytest.mark.parametrize(("name", "blocks", "chirality"), ALL_CLASSES)
def test_sketch_of_every_class_shows_its_shapes(name, blocks, chirality, orientation) -> None:
    corners = class_cells(name, orientation=orientation)
    assert len(corners) == blocks
    assert corners.min(axis=0).tolist() == [0.0, 0.0]
    drawn = components(corners)
    shapes = [frozenset(map(tuple, shape_cells(shape).tolist())) for shape in name.split("+")]
    assert len(drawn) == len(shapes)
    for group in drawn:
        found = turns(np.round(np.subtract(group, np.min(group, axis=0))))
        match = next(shape for shape in shapes if shape in found)
        shapes.remove(match)


def test_turning_never_mirrors() -> None:
    s, z = (turns(class_cells(name, orientation="tall")) for name in "SZ")
    assert not set(s) & set(z)


@pytest.mark.parametrize("orientation", ["wide", "tall"])
@settings(deadline=None, max_examples=60)
@given(st.lists(st.sampled_from(["I", "O", "L3", "I3", "2", "1"]), min_size=1, max_size=9))
def test_shapes_of_a_class_keep_their_distance(orientation, shapes) -> None:
    corners = class_cells("+".join(shapes), orientation=orientation)
    groups = components(corners)
    assert len(groups) == len(shapes)
    for index, group in enumerate(groups):
        for other in groups[:index]:
            apart = np.abs(np.subtract(np.array(group)[:, None], np.array(other)[None]))
            assert apart.max(axis=2).min() >= 1.0 + GAP - 1e-6


def test_packing_is_compact() -> None:
    assert sketch_size(class_cells("1+1+1+1")).tolist() == pytest.approx([2.6, 2.6])
    assert sketch_size(class_cells("I", orientation="tall")).tolist() == [1.0, 4.0]
    assert sketch_size(class_cells("I3+1", orientation="tall")).tolist() == pytest.approx([2.6, 3])


@pytest.mark.parametrize("name", ["", "K", "x/xx", "...", "xx-", "I3+", "4"])
def test_other_names_are_refused(name) -> None:
    assert not is_class(name)
    with pytest.raises(InputError, match="is not a shape"):
        class_cells(name)


def test_box_holds_one_square_per_block_at_its_cell() -> None:
    box = sketch_box("L3+1", cell_pt=4.0, height_pt=20.0)
    squares = [artist for artist in box.get_children() if isinstance(artist, Rectangle)]
    height = 4.0 * sketch_size(class_cells("L3+1"))[1]
    expected = 4.0 * class_cells("L3+1") + np.array([0.0, 20.0 - height])
    assert [square.get_xy() for square in squares] == [pytest.approx(xy) for xy in expected]
    assert {(square.get_width(), square.get_height()) for square in squares} == {(4.0, 4.0)}


def test_only_names_that_can_be_read_are_written() -> None:
    assert [name_text(name) for name in ("T", "other", "xx./.xx", "xxxxx+1")] == [
        "T",
        "other",
        "",
        "",
    ]


@pytest.mark.parametrize(("blocks", "chirality"), [(2, "merged"), (4, "distinct"), (5, "merged")])
def test_sketches_below_an_axis_lie_under_their_ticks_and_apart(blocks, chirality) -> None:
    names = [*outcome_classes(blocks, chirality)[:20], "other"]
    ax = axes_or_new(None)
    ax.set_xlim(-0.5, len(names) - 0.5)
    depth = draw_sketches_below(ax, range(len(names)), names)
    figure = ax.figure
    figure.draw_without_rendering()
    boxes = [artist for artist in ax.artists if isinstance(artist, AnnotationBbox)]
    assert len(boxes) == len(names)
    floor = ax.get_window_extent().y0
    extents = [box.get_window_extent() for box in boxes]
    for position, extent in enumerate(extents):
        middle = ax.transData.transform((position, 0.0))[0]
        assert (extent.x0 + extent.x1) / 2 == pytest.approx(middle, abs=1.0)
        assert floor > extent.y1
        assert extent.y0 >= floor - depth * figure.dpi / 72.0
    for left, right in pairwise(extents):
        assert left.x1 <= right.x0 + 0.5


def test_numbers_of_positions_and_names_must_agree() -> None:
    with pytest.raises(InputError, match="2 positions for 1 classes"):
        draw_sketches_below(axes_or_new(None), [0, 1], ["I"])
