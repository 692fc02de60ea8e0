"""Blocks in the tank: corners, colours and strips."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_hex
from matplotlib.patches import Circle
from synthetic_assembly import assembly_end, assembly_path

from driftwalk.core.errors import InputError
from driftwalk.plot.parts.style import PALETTE
from driftwalk.plot.tank import (
    block_corners,
    plot_blocks,
    plot_film_strip,
)


@pytest.fixture(scope="module")
def path():
    return assembly_path()


def squares(ax) -> PolyCollection:
    return next(artist for artist in ax.collections if isinstance(artist, PolyCollection))


def centers(ax) -> np.ndarray:
    return np.array([outline.vertices[:4].mean(axis=0) for outline in squares(ax).get_paths()])


def test_corners_are_turned_about_the_middle_by_complex_numbers(path) -> None:
    corners = block_corners(path)
    assert corners.shape == (2, 301, 4, 4, 2)
    middle = 100 * (path["x"].values + 1j * path["y"].values)
    own = 1.5 * np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j])
    expected = middle[..., None] + np.exp(1j * path["theta"].values)[..., None] * own
    np.testing.assert_allclose(corners[..., 0] + 1j * corners[..., 1], expected, atol=1e-9)


def test_order_of_the_dimensions_does_not_matter(path) -> None:
    turned = path.transpose("block", "time", "run")
    one, other = (centers(plot_blocks(data, run=1, time=90.0)) for data in (path, turned))
    np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(("time", "sample"), [(0.0, 0), (99.9, 99), (100.0, 100), (None, 300)])
def test_the_last_sample_up_to_the_moment_is_drawn(path, time, sample) -> None:
    ax = plot_blocks(path, run=1, time=time)
    expected = 100 * np.column_stack([path[name].values[1, sample] for name in "xy"])
    np.testing.assert_allclose(centers(ax), expected, atol=1e-9)
    assert ax.get_title(loc="left") == f"t = {sample} s"


def test_blocks_of_one_assembly_have_one_colour(path) -> None:
    ax = plot_blocks(path, time=100.0)
    colors = [to_hex(color, keep_alpha=False).upper() for color in squares(ax).get_facecolor()]
    labels = path["assembly"].values[0, 100]
    assert labels.tolist() == [0, 0, 2, 3]
    assert colors == [PALETTE[label].upper() for label in labels]


def test_wall_of_the_tank_is_drawn_in_cm(path) -> None:
    (wall,) = [p for p in plot_blocks(path).patches if isinstance(p, Circle)]
    assert wall.get_radius() == pytest.approx(15.0)


def test_end_of_the_runs_is_drawn_from_an_assembly_dataset(path) -> None:
    ax = plot_blocks(assembly_end(path), run=1)
    np.testing.assert_allclose(centers(ax), centers(plot_blocks(path, run=1)))
    with pytest.raises(InputError, match="leave out time"):
        plot_blocks(assembly_end(path), time=3.0)


def test_strip_shows_equally_spaced_moments(path) -> None:
    panels = plot_film_strip(path, run=1, count=7)
    assert [ax.get_title(loc="left") for ax in panels] == [
        f"t = {time} s" for time in (0, 50, 100, 150, 200, 250, 300)
    ]
    for ax, sample in zip(panels, range(0, 301, 50), strict=True):
        expected = 100 * np.column_stack([path[name].values[1, sample] for name in "xy"])
        np.testing.assert_allclose(centers(ax), expected, atol=1e-9)


def test_what_cannot_be_drawn_is_refused(path) -> None:
    for wrong, message in (
        (lambda: plot_blocks(path, run=2), "run=2: the dataset has 2 runs"),
        (lambda: plot_blocks(path, time=301.0), "lasts from 0 s to 300 s"),
        (lambda: plot_blocks(path.assign_attrs(kind="trajectory")), "got trajectory"),
        (lambda: plot_blocks(path.drop_vars("theta")), "lacks theta"),
        (lambda: plot_film_strip(assembly_end(path)), "dataset 'assembly_path', got assembly"),
        (lambda: plot_film_strip(path, count=1), "at least 2 moments"),
        (lambda: plot_film_strip(path, [1], count=2), "got 1 axes, expected 2"),
    ):
        with pytest.raises(InputError, match=message):
            wrong()
    bare = path.copy()
    del bare.attrs["block_side_m"]
    with pytest.raises(InputError, match="block_side_m"):
        plot_blocks(bare)
