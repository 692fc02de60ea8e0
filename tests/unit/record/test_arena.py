"""The arena: given, placed and fitted; the circle of the centres."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from driftwalk.core.errors import FormatError, InputError
from driftwalk.record import fit_circle, load, save_trajectory, tank_radius_bound
from driftwalk.record.arena import place_arena


def disc(count: int = 4000, *, sector: float = 2 * np.pi, seed: int = 0) -> tuple[np.ndarray, ...]:
    """Uniform positions in a disc of radius 0.12 m about (0.4, -0.7), with 0.3 mm noise."""
    random = np.random.default_rng(seed)
    radius = 0.12 * np.sqrt(random.uniform(size=count))
    angle = random.uniform(0.0, sector, count)
    noise = random.normal(0.0, 3e-4, (2, count))
    return 0.4 + radius * np.cos(angle) + noise[0], -0.7 + radius * np.sin(angle) + noise[1]


def test_circle_of_a_disc() -> None:
    fit = fit_circle(*disc())
    assert (fit.center_x, fit.center_y) == pytest.approx((0.4, -0.7), abs=1e-3)
    assert fit.radius == pytest.approx(0.12, rel=0.02)
    assert fit.coverage == 1.0


def test_circle_is_not_moved_by_tracking_errors() -> None:
    x, y = disc()
    random = np.random.default_rng(1)
    spoiled = random.choice(x.size, 30, replace=False)
    x[spoiled] += random.uniform(0.2, 3.0, 30)  # all to one side
    fit = fit_circle(x, y)
    assert (fit.center_x, fit.center_y) == pytest.approx((0.4, -0.7), abs=1.5e-3)
    assert fit.radius == pytest.approx(0.12, rel=0.02)
    assert fit.astray >= 28


def test_circle_of_a_body_that_saw_two_thirds_of_the_tank() -> None:
    fit = fit_circle(*disc(sector=4 * np.pi / 3))
    assert (fit.center_x, fit.center_y) == pytest.approx((0.4, -0.7), abs=3e-3)
    assert fit.radius == pytest.approx(0.12, rel=0.03)
    assert 0.6 < fit.coverage < 0.75


def test_circle_moves_and_grows_with_the_positions() -> None:
    x, y = disc(500)
    small, large = fit_circle(x, y), fit_circle(3.0 * x + 1.0, 3.0 * y)
    assert large.radius == pytest.approx(3.0 * small.radius, rel=1e-4)
    assert large.center_x == pytest.approx(3.0 * small.center_x + 1.0, rel=1e-4)


@pytest.mark.parametrize(("x", "message"), [(np.zeros(50), "never moves"), (np.zeros(5), "20")])
def test_circle_that_cannot_be_fitted(x: np.ndarray, message: str) -> None:
    with pytest.raises(InputError, match=message):
        fit_circle(x, x)


def test_bound_of_the_tank_agrees_with_corners_on_the_wall() -> None:
    tank, side = 0.15, 0.03
    reach = np.sqrt(tank**2 - (side / 2) ** 2) - side / 2  # a face flat on the wall
    corner = np.hypot(reach + side / 2, side / 2)
    assert corner == pytest.approx(tank)
    assert tank_radius_bound(reach, side) == pytest.approx(tank)
    # No orientation lets the centre reach farther out.
    turn = np.linspace(0.0, np.pi / 2, 400)
    corners = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]]) * side / 2
    for angle in turn:
        rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        placed = corners @ rotation.T + [reach + 1e-6, 0.0]
        assert np.hypot(*placed.T).max() > tank


def test_a_circle_given_is_placed_at_the_origin_if_it_holds_the_positions() -> None:
    x, y = disc()
    placed = place_arena("circle:30cm", x - 0.4, y + 0.7)
    assert placed.arena == {"shape": "circle", "diameter_m": 0.3, "center_m": [0.0, 0.0]}
    assert placed.origin == (0.0, 0.0)
    assert placed.found["by"] == "origin of the file"


def test_a_circle_given_is_placed_by_fit_elsewhere_and_where_it_is_said() -> None:
    x, y = disc()
    placed = place_arena("circle:0.3", x, y)
    assert placed.origin == pytest.approx((0.4, -0.7), abs=1e-3)
    assert placed.found["by"] == "fit"
    given = place_arena("circle:0.3@0.5,-0.6", x, y)
    assert given.origin == (0.5, -0.6)
    assert given.found["samples_outside"] > 0
    assert "outside the arena" in given.notes[0]


def test_fit_says_what_the_circle_is() -> None:
    x, y = disc()
    centers = place_arena("fit", x, y)
    assert centers.arena["diameter_m"] == pytest.approx(2 * fit_circle(x, y).radius)
    assert centers.found["radius_is"] == "of the centres"
    assert "never reaches the rim" in centers.notes[0]
    bound = place_arena("fit", x, y, block_side=0.03)
    expected = 2 * tank_radius_bound(fit_circle(x, y).radius, 0.03)
    assert bound.arena["diameter_m"] == pytest.approx(expected)
    partly = place_arena("fit", *disc(sector=1.5))
    assert "uncertain" in partly.notes[1]


def test_a_rectangle() -> None:
    random = np.random.default_rng(2)
    x, y = random.uniform(1.0, 1.4, 5000), random.uniform(2.0, 2.2, 5000)
    placed = place_arena("rect:40cmx0.2", x, y)
    assert (placed.arena["width_m"], placed.arena["height_m"]) == (0.4, 0.2)
    assert placed.origin == pytest.approx((1.2, 2.1), abs=1e-3)


def test_a_polygon_is_shifted_to_its_centroid(tmp_path: Path) -> None:
    outline = tmp_path / "outline.csv"
    outline.write_text("x_m,y_m\n1,1\n3,1\n3,2\n1,2\n1,1\n")
    recording = tmp_path / "a.csv"
    recording.write_text("t,x,y\n0,2,1.5\n1,2.5,1.5\n")
    dataset = load(recording, tank=f"polygon:{outline}")
    arena = json.loads(dataset.attrs["arena"])
    np.testing.assert_allclose(arena["vertices_m"], [[-1, -0.5], [1, -0.5], [1, 0.5], [-1, 0.5]])
    np.testing.assert_allclose(dataset["x"].values[:, 0], [0.0, 0.5])
    assert json.loads(dataset.attrs["origin_shift_m"]) == [2.0, 1.5]
    outline.write_text("x_m,y_m\n1,1\n3,1\n")
    with pytest.raises(FormatError, match="at least three"):
        load(recording, tank=f"polygon:{outline}")


@pytest.mark.parametrize(
    "text", ["", "disc:3", "circle", "circle:", "circle:-1", "circle:a", "rect:1", "circle:1@2"]
)
def test_an_arena_that_cannot_be_read(text: str) -> None:
    with pytest.raises(InputError, match="`tank"):
        place_arena(text, *disc(100))


def test_shifts_add_up_over_conversions(tmp_path: Path) -> None:
    x, y = disc(200)
    rows = "\n".join(
        f"{i},{a!r},{b!r}" for i, (a, b) in enumerate(zip(x.tolist(), y.tolist(), strict=True))
    )
    (tmp_path / "a.csv").write_text("t,x,y\n" + rows + "\n")
    once = load(tmp_path / "a.csv", tank="circle:0.3@0.4,-0.7")
    again = load(save_trajectory(once, tmp_path / "a.nc"), tank="circle:0.3@0.01,0.02")
    assert json.loads(again.attrs["origin_shift_m"]) == pytest.approx([0.41, -0.68])
    np.testing.assert_allclose(again["x"].values[:, 0], x - 0.41, atol=1e-12)
