"""The native core's model: its numbers come back, and what it cannot use is refused by name."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from single_block import model, study

import driftwalk as dw
from driftwalk import _core
from driftwalk.simulation.backend import Camera, native_model

NUMBERS = sorted(
    name for name in dir(_core.Model) if not name.startswith("_") and name != "samples"
)
TIMES = [0.0, 1.0]


def test_the_numbers_of_a_study_come_back():
    view = {"field_of_view": {"diameter_m": 0.2, "center_m": [0.01, -0.02]}}
    given = study(
        block={"side_m": 0.02, "mass_kg": 0.01, "strips_per_face": 5},
        forces={"force_interval_s": 0.016},
        observation=view,
    )
    native = native_model(given, dw.tank30_flow(), np.array(TIMES), Camera(1e-4, 0.02, 5e-4))
    assert (native.side, native.mass, native.strips) == (0.02, 0.01, 5)
    assert native.inertia == given.block.inertia_kg_m2
    assert native.depth == given.wetted_depth_m
    assert (native.time_step, native.steps_per_interval) == (0.008, 2)
    assert native.radius == given.tank.radius_m
    assert native.restitution == given.tank.wall_restitution
    assert (native.position_noise, native.orientation_noise) == (1e-4, 0.02)
    assert native.position_quantum == 5e-4
    assert (native.view_radius, native.view_x, native.view_y) == (0.1, 0.01, -0.02)
    assert native.samples == 2


def test_the_law_of_forces_of_a_study_comes_back():
    paper = native_model(study(), dw.tank30_flow(), np.array(TIMES), Camera())
    names = (
        *("added_mass_share", "linear_drag", "displaced_mass", "force_memory"),
        *("drag_power", "drag_speed"),
    )
    assert [getattr(paper, name) for name in names] == [0.0, 0.0, 0.0, 0.0, 2.0, 0.03]
    floating = study(
        block={"mass_kg": 0.02},
        forces={
            "added_mass_share": 0.5,
            "linear_drag_kg_s": "5g/s",
            "pressure_gradient": True,
            "force_memory_s": "100ms",
            "drag_power": 1.5,
            "drag_speed_m_s": "1cm/s",
        },
    )
    native = native_model(floating, dw.tank30_flow(), np.array(TIMES), Camera())
    assert [getattr(native, name) for name in names] == [0.5, 0.005, 0.02, 0.1, 1.5, 0.01]


@pytest.mark.parametrize("name", NUMBERS)
def test_no_number_may_be_something_else(name: str):
    missing = "is missing or not a number"
    whole = name in ("strips", "steps_per_interval")
    for value in (None, "3", *([2.5] if whole else [])):
        with pytest.raises(TypeError, match=f"^{name} {missing}"):
            model(times=TIMES, **{name: value})
    if not whole:
        for value in (np.nan, np.inf):
            with pytest.raises(ValueError, match=rf"^{name} \[.+\] must be .*, not (nan|inf)"):
                model(times=TIMES, **{name: value})


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"depth": 0.0}, r"depth \[m\] must be finite and positive, not 0"),
        ({"added_mass_share": -0.1}, r"added_mass_share \[1\] must be finite and not negative"),
        ({"linear_drag": -1e-9}, r"linear_drag \[kg/s\] must be finite and not negative"),
        ({"displaced_mass": -0.01}, r"displaced_mass \[kg\] must be finite and not negative"),
        ({"force_memory": -0.01}, r"force_memory \[s\] must be finite and not negative"),
        ({"friction": -0.1}, r"friction \[1\] must be finite and not negative, not -0.1"),
        ({"strips": 0}, r"strips \[1\] must be from 1 to 64, not 0"),
        ({"strips": 65}, r"strips \[1\] must be from 1 to 64, not 65"),
        ({"restitution": 1.01}, r"restitution \[1\] must be from 0 to 1, not 1.01"),
        ({"edges": np.zeros((4, 2))}, "edges and view_edges must have shape"),
        ({"u": np.zeros((2, 3, 3))}, "u and v must have the same shape"),
        ({"frame_time": np.zeros(2)}, "one time per frame"),
        ({"sample_time": np.zeros(0)}, "at least one sample"),
    ],
)
def test_what_the_core_cannot_use_is_refused(change: dict[str, Any], sentence: str):
    with pytest.raises(ValueError, match=sentence):
        model(times=TIMES, **change)


def test_a_number_that_no_model_has_is_refused():
    with pytest.raises(TypeError, match=r"no other numbers than side, mass, .*view_y$"):
        model(times=TIMES, widht=1.0)
