"""The table next to a figure holds the numbers that were given to be drawn."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes

from driftwalk.figures.write import write_drawn_data, write_figures
from driftwalk.plot.parts.style import new_figure

X = np.array([0.0, 1.0, 3.0])
Y = np.array([1 / 3, np.pi, -2.0])
FIELD = np.array([[0.1, 0.2, 0.3], [0.4, np.nan, 0.6]])


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def table(draw, tmp_path: Path) -> list[dict[str, str]]:
    figure = new_figure(width_mm=90.0, height_mm=60.0)
    ax = figure.add_subplot()
    ax.set_xlabel("x (cm)")
    ax.set_ylabel("y (cm)")
    draw(ax)
    figure.draw_without_rendering()
    write_drawn_data(figure, tmp_path / "a.csv")
    return rows_of(tmp_path / "a.csv")


def numbers(rows: list[dict[str, str]], *names: str) -> np.ndarray:
    return np.array([[float(row[name] or "nan") for name in names] for row in rows])


@pytest.mark.parametrize(
    ("draw", "names", "expected"),
    [
        (lambda ax: ax.plot(X, Y), "x y", np.column_stack([X, Y])),
        (lambda ax: ax.scatter(X, Y, c=X), "x y value", np.column_stack([X, Y, X])),
        (lambda ax: ax.quiver(X, Y, Y, X), "x y dx dy", np.column_stack([X, Y, Y, X])),
        (
            lambda ax: ax.bar(X, [1.0, 2.0, 3.0], width=0.5),
            "x y dx dy",
            [[-0.25, 0.0, 0.5, 1.0], [0.75, 0.0, 0.5, 2.0], [2.75, 0.0, 0.5, 3.0]],
        ),
        (
            lambda ax: ax.pcolormesh([0.0, 1.0, 2.0, 3.0], [0.0, 2.0, 4.0], FIELD),
            "x y value",
            [
                *([0.5, 1.0, 0.1], [1.5, 1.0, 0.2], [2.5, 1.0, 0.3]),
                *([0.5, 3.0, 0.4], [1.5, 3.0, np.nan], [2.5, 3.0, 0.6]),
            ],
        ),
        (
            lambda ax: ax.imshow(FIELD, extent=(0.0, 3.0, 0.0, 4.0), origin="lower"),
            "x y value",
            [
                *([0.5, 1.0, 0.1], [1.5, 1.0, 0.2], [2.5, 1.0, 0.3]),
                *([0.5, 3.0, 0.4], [1.5, 3.0, np.nan], [2.5, 3.0, 0.6]),
            ],
        ),
        (
            lambda ax: ax.imshow(FIELD, extent=(0.0, 3.0, 0.0, 4.0), origin="upper"),
            "x y value",
            [
                *([0.5, 3.0, 0.1], [1.5, 3.0, 0.2], [2.5, 3.0, 0.3]),
                *([0.5, 1.0, 0.4], [1.5, 1.0, np.nan], [2.5, 1.0, 0.6]),
            ],
        ),
    ],
)
def test_numbers_are_those_that_were_given(draw, names, expected, tmp_path) -> None:
    rows = table(draw, tmp_path)
    np.testing.assert_array_equal(numbers(rows, *names.split()), np.asarray(expected))
    assert {(row["x_axis"], row["y_axis"]) for row in rows} == {("x (cm)", "y (cm)")}


def test_contours_carry_their_level(tmp_path) -> None:
    """On a plane that rises along x the contour at 0.5 is the line x = 0.5."""
    grid = np.linspace(0.0, 1.0, 5)
    height = np.tile(grid, (5, 1))
    rows = table(lambda ax: ax.contour(grid, grid, height, levels=[0.3, 0.5]), tmp_path)
    found = numbers(rows, "x", "value")
    assert set(found[:, 1]) == {0.3, 0.5}
    np.testing.assert_allclose(found[:, 0], found[:, 1], atol=1e-12)


def test_what_is_placed_in_the_axes_and_not_in_the_data_is_left_out(tmp_path) -> None:
    def draw(ax: Axes) -> None:
        ax.plot(X, Y, label="seen")
        ax.plot([0.0, 1.0], [0.5, 0.5], transform=ax.transAxes)
        ax.legend()

    rows = table(draw, tmp_path)
    assert len(rows) == 3
    assert {row["label"] for row in rows} == {"seen"}


@pytest.mark.slow
def test_figures_without_the_table_say_nothing_of_one(tmp_path) -> None:
    def make():
        figure = new_figure(width_mm=90.0, height_mm=60.0)
        figure.add_subplot().plot(X, Y)
        return figure

    write_figures({"a": make}, tmp_path / "one", ["svg"])
    write_figures({"a": make}, tmp_path / "two", ["svg", "csv"])
    assert sorted(path.name for path in (tmp_path / "two").iterdir()) == ["a.csv", "a.svg"]
    assert "drawn numbers" not in (tmp_path / "one" / "a.svg").read_text()
    assert "drawn numbers are in a.csv" in (tmp_path / "two" / "a.svg").read_text()
