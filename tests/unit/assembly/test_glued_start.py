"""Runs whose blocks start glued together, against the simulation of one such body."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import driftwalk as dw
from driftwalk.assembly import assemble, assembly_path
from driftwalk.assembly.outcomes.distribution import class_at
from driftwalk.assembly.runs.start import glued_cells
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.model import Study
from driftwalk.simulation import simulate

SIDE = 0.03


def glued(shape: str, *, blocks: int = 4, force: float = 4e-3, **more: Any) -> Study:
    return Study(
        tank={"diameter_m": 0.2},
        assembly={"blocks": blocks, "glued": shape, **more},
        forces={"force_std_N": force},
    )


def test_two_dimers_are_joined_from_the_start() -> None:
    found = assemble(glued("xx"), dw.uniform_flow(0.0, 0.0), runs=50, duration=20.0)
    assert (found["event_time"].values[:, :2] == 0.0).all()
    assert (found["event_block"].values[:, :2] == [[0, 1], [2, 3]]).all()
    assert (found["event_face"].values[:, :2] == [0, 2]).all()
    names = {str(found["class"].values[k]) for k in found["outcome"].values}
    # No two dominoes make a T.
    assert names <= {"I", "O", "S", "L", "2+2"}
    assert len(names) > 3
    assert set(found["class"].values[class_at(found, 0.0)]) == {"2+2"}
    assert found.attrs["glued"] == "xx"


@pytest.mark.parametrize("shape", ["xx", "x./xx", "xxx/x.x/..x"])
def test_bodies_move_as_one_and_apart_from_the_wall_as_the_simulated_one(shape: str) -> None:
    """Without a force the centre of a glued body is that of `simulate`, in a flow with shear."""
    cells = shape.count("x")
    study = dw.apply_overrides(
        glued(shape, blocks=2 * cells, force=0.0, latching="none"), {"tank.diameter_m": 0.3}
    )
    flow = dw.tank30_flow()
    path = assembly_path(study, flow, duration=0.5, sample_interval=0.1, backend="reference")
    one = path.isel(run=0, block=slice(0, cells))
    assert (one["assembly"] == 0).all()
    places = np.stack([one["x"].values, one["y"].values], axis=-1)
    apart = np.hypot(*np.moveaxis(places[:, :, None] - places[:, None], -1, 0))
    np.testing.assert_allclose(apart, np.broadcast_to(apart[0], apart.shape), atol=1e-7)
    own = glued_cells(study.assembly)
    assert own is not None
    lattice = SIDE * np.hypot(*np.moveaxis((own[:, None] - own[None]).astype(float), -1, 0))
    np.testing.assert_allclose(apart[0], lattice, atol=1e-7)
    centre = places.mean(axis=1)
    start = {"x_m": float(centre[0, 0]), "y_m": float(centre[0, 1])}
    pose = {**start, "theta_rad": float(one["theta"][0, 0])}
    body = {"block.shape": shape, "block.mass_kg": cells * study.block.mass_kg}
    alone = dw.apply_overrides(
        study, {**body, "simulation.start": pose, "simulation.duration_s": 0.5}
    )
    moved = simulate(alone, flow, replicates=1)
    np.testing.assert_allclose(
        [moved[name].values.ravel()[-1] for name in "xy"], centre[-1], atol=2e-5
    )


@pytest.mark.parametrize(
    ("study", "words"),
    [
        (glued("xx", blocks=5), r"5 blocks make up no two bodies 'xx' or more .*: give 4 blocks"),
        (glued("xx", blocks=2), "2 blocks make up no two bodies"),
        (glued("xx", faces="NSNS"), "where they are squares whose faces have no types"),
        (dw.apply_overrides(glued("xx"), {"block.shape": "disc"}), "where they are squares"),
    ],
)
def test_what_does_not_start_glued(study: Study, words: str) -> None:
    with pytest.raises(InputError, match=words):
        assemble(study, dw.uniform_flow(0.0, 0.0), runs=1, duration=0.1)


def test_a_live_tank_and_given_places_take_single_blocks() -> None:
    still = dw.uniform_flow(0.0, 0.0)
    with pytest.raises(InputError, match="a live tank starts with single blocks"):
        dw.LiveTank(glued("xx"), still)
    with pytest.raises(InputError, match="start: glued blocks start at random places"):
        assemble(glued("xx"), still, runs=1, start=np.zeros((4, 3)))


@pytest.mark.parametrize("shape", ["disc", "x.x", "", "x/.x"])
def test_what_is_no_shape_of_glued_blocks(shape: str) -> None:
    with pytest.raises(ConfigurationError, match="glued"):
        glued(shape)
