"""The self-assembly kernel at the ends of its ranges: finite, inside, and nothing in anything."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from kernel_worlds import (
    BOX,
    TRIANGLE,
    assemble,
    deepest_overlap,
    farthest_outside,
    random_starts,
)
from single_block import model, swirl

TANKS: dict[str, dict[str, Any]] = {
    "circle": {"radius": 0.15},
    "box": {"radius": 0.0, "edges": BOX},
    "triangle": {"radius": 0.0, "edges": TRIANGLE},
}
# A tenth of a millimetre, and the rounding of sampled poses.
MOST = 1.001e-4


def outside(poses: Any, tank: dict[str, Any]) -> float:
    return farthest_outside(poses, radius=tank["radius"], edges=tank.get("edges"))


@pytest.mark.parametrize("latching", ["none", "collision", "connector"])
@pytest.mark.parametrize("hidden", ["none", "full"])
def test_the_whole_box_of_parameters_stays_finite(latching: str, hidden: str) -> None:
    # Corners and edges of the box, then anywhere in it, 20 s at the default step of 10 ms.
    native = model(swirl, times=[0.0])
    ends = list(itertools.product([0.0, 0.05, 1.0, 4.0], [0.0, 1e-4, 1e-3, 4e-3]))
    rng = np.random.default_rng(4)
    inner = np.column_stack([rng.uniform(0, 4, 48), rng.uniform(0, 4e-3, 48)])
    drag, force = np.concatenate([ends, ends, inner]).T
    start, own_keys = random_starts(native, 8, len(drag), seed=9)
    run = assemble(
        native, start, own_keys, steps=2000, drag=drag, force=force, latching=latching,
        hidden_face_drag=hidden, sample_every=20,
    )  # fmt: skip
    poses = run["sample_pose"]
    assert not run["status"].any()
    assert np.isfinite(poses).all()
    assert np.isfinite(run["pose"]).all()
    assert np.abs(poses[..., 2]).max() < np.pi + 1e-6
    assert -1e-3 < outside(poses, TANKS["circle"]) < MOST
    assert deepest_overlap(poses) < MOST
    # 4 mN on 11.6 g for 10 ms is 3.5 mm/s: a path of steps that small is no jump.
    assert np.abs(np.diff(poses[..., :2], axis=1)).max() < 0.3


@pytest.mark.parametrize("tank", TANKS)
def test_nothing_is_in_anything_after_any_step(tank: str) -> None:
    native = model(swirl, times=[0.0], **TANKS[tank])
    for latching in ("none", "connector"):
        start, own_keys = random_starts(native, 16, 12, seed=3)
        run = assemble(
            native, start, own_keys, steps=250, drag=np.resize([0.0, 0.45, 4.0], len(start)),
            force=np.resize([4e-3, 0.55e-3], len(start)), latching=latching, sample_every=1,
        )  # fmt: skip
        assert not run["status"].any()
        assert deepest_overlap(run["sample_pose"]) < MOST
        assert -1e-3 < outside(run["sample_pose"], TANKS[tank]) < MOST


@pytest.mark.slow
@pytest.mark.parametrize("latching", ["none", "collision", "connector"])
@pytest.mark.parametrize(
    ("tank", "blocks"), [("circle", 24), ("circle", 33), ("box", 20), ("triangle", 20)]
)
def test_jams_leave_nothing_in_anything(tank: str, blocks: int, latching: str) -> None:
    # Strong flow and force press a third of the tank's area of blocks against each other.
    def torrent(x: Any, y: Any) -> tuple[Any, Any]:
        u, v = swirl(x, y)
        return 4 * u, 4 * v

    for velocity, friction in ((swirl, 0.0), (torrent, 1.0)):
        native = model(velocity, times=[0.0], friction=friction, **TANKS[tank])
        start, own_keys = random_starts(native, blocks, 16, seed=5)
        assert len(start) > 2
        run = assemble(
            native, start, own_keys, steps=500, drag=np.resize([0.0, 0.45, 4.0], len(start)),
            force=np.resize([4e-3, 1e-3], len(start)), latching=latching, sample_every=1,
            block_friction=friction, hidden_face_drag="full",
        )  # fmt: skip
        assert not run["status"].any()
        assert np.abs(run["sample_pose"][..., 2]).max() < np.pi + 1e-6
        for world in run["sample_pose"]:
            assert deepest_overlap(world) < MOST
            assert -1e-3 < outside(world, TANKS[tank]) < MOST


def test_an_assembly_as_long_as_the_tank_is_wide_does_not_turn_into_its_walls() -> None:
    # Five blocks in line, 15 cm, between walls 15.24 cm apart: pushes alone cannot put it inside.
    edges = np.array([[0.0, -1.0, 0.0762], [1.0, 0.0, 0.2], [0.0, 1.0, 0.0762], [-1.0, 0.0, 0.2]])
    native = model(swirl, times=[0.0], radius=0.0, edges=edges)
    start = np.zeros((8, 5, 3))
    start[..., 1] = 0.03 * np.arange(-2, 3)
    run = assemble(
        native, start, np.arange(1, 9, dtype=np.uint64), steps=3000, drag=1.0, force=4e-3,
        sample_every=5,
    )  # fmt: skip
    assert (run["event_count"] == 4).all()
    assert -1e-3 < farthest_outside(run["sample_pose"], edges=edges) < MOST
    # 15 cm cos(T) + 3 cm sin(T) = 15.24 cm at T = 0.11: so far it does turn.
    assert 0.05 < np.abs(run["sample_pose"][..., 2]).max() < 0.12
    assert np.ptp(run["sample_pose"][..., 0]) > 1e-3
