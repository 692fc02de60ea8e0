"""Properties of filled flow fields."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from driftwalk.flow.arena import outline_of
from driftwalk.flow.cell_means import fill_velocity
from driftwalk.flow.grid import make_grid

ARENAS = st.one_of(
    st.builds(
        lambda d, x, y: {"shape": "circle", "diameter_m": d, "center_m": [x, y]},
        st.floats(0.05, 3.0),
        st.floats(-1.0, 1.0),
        st.floats(-1.0, 1.0),
    ),
    st.builds(
        lambda w, h: {"shape": "rectangle", "width_m": w, "height_m": h},
        st.floats(0.1, 2.0),
        st.floats(0.1, 2.0),
    ),
    st.builds(
        lambda n, turn: {
            "shape": "polygon",
            "vertices_m": [
                [np.cos(turn + 2 * np.pi * k / n), np.sin(turn + 2 * np.pi * k / n)]
                for k in range(n)
            ],
        },
        st.integers(3, 9),
        st.floats(0.0, 1.0),
    ),
)


@pytest.mark.slow
@settings(deadline=None, max_examples=60)
@given(
    arena=ARENAS,
    cells=st.integers(2, 25),
    share=st.floats(0.0, 0.9),
    seed=st.integers(0, 2**32 - 1),
)
def test_no_filled_speed_exceeds_the_largest_known_one(
    arena: dict[str, object], cells: int, share: float, seed: int
) -> None:
    outline = outline_of(arena)
    grid = make_grid(outline, cells=cells)
    rng = np.random.default_rng(seed)
    known = rng.random(grid.shape) < share
    known[rng.integers(grid.y.size), rng.integers(grid.x.size)] = True
    velocity = rng.normal(size=(*grid.shape, 2)) * 10.0 ** rng.uniform(-6, 3)
    filled = fill_velocity(grid, velocity, known=known, outline=outline)
    assert np.isfinite(filled).all()
    speed = np.hypot(filled[..., 0], filled[..., 1])
    assert speed.max() <= np.hypot(*velocity[known].T).max() * (1.0 + 1e-7)
    np.testing.assert_array_equal(filled[known], velocity[known])


@pytest.mark.slow
@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 2**32 - 1), quarter=st.integers(1, 3))
def test_turning_tank_and_field_turns_the_filled_field(seed: int, quarter: int) -> None:
    outline = outline_of({"shape": "circle", "diameter_m": 0.3})
    grid = make_grid(outline, cells=12)
    rng = np.random.default_rng(seed)
    velocity = rng.normal(size=(12, 12, 2))
    known = rng.random((12, 12)) < 0.2
    known[6, 6] = True

    def turned(field: np.ndarray) -> np.ndarray:
        # A counter-clockwise quarter turn of rows that run upwards is np.rot90 the other way.
        for _ in range(quarter):
            field = np.rot90(field, -1)
            if field.ndim == 3:
                field = np.stack([-field[..., 1], field[..., 0]], axis=-1)
        return field

    plain = fill_velocity(grid, velocity, known=known, outline=outline)
    other = fill_velocity(grid, turned(velocity), known=turned(known), outline=outline)
    np.testing.assert_allclose(other, turned(plain), atol=1e-7)
