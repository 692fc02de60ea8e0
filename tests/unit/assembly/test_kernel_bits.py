"""The self-assembly kernel gives the same bits however it is asked, and refuses what it cannot do.

Batches, instruction sets and steady flows are tested in C++ (cpp/tests/test_assemble.cpp).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from kernel_worlds import assemble, keys, random_starts
from single_block import BEYOND_PAPER, NODES, flow_arrays, model, numbers_of, swirl

from driftwalk import _core


def changing_model(times: Any, **changes: Any) -> _core.Model:
    """A swirl that turns round within a second."""
    u, v = flow_arrays(swirl)
    factor = np.array([1.0, 0.2, -1.0])[:, None, None]
    return model(
        swirl, times=times, nodes=NODES, u=factor * u, v=factor * v,
        frame_time=np.array([0.0, 0.31, 1.0]), steps_per_interval=2, **changes,
    )  # fmt: skip


@pytest.mark.parametrize("law", ["paper", *BEYOND_PAPER])
@pytest.mark.parametrize("precision", ["single", "double"])
def test_one_block_in_a_changing_flow_is_the_one_block_kernel(precision: str, law: str) -> None:
    steps = 150
    numbers = numbers_of(BEYOND_PAPER.get(law, {}))
    native = changing_model(np.arange(steps + 1) * 0.01, **numbers)
    start, own_keys = random_starts(native, 1, 21)
    table = np.zeros((len(start), 8))
    table[:, :3], table[:, 6], table[:, 7] = start[:, 0], 0.8, 1e-3
    x, y, theta, _ = _core.simulate(native, table, own_keys, threads=1, precision=precision)
    run = assemble(
        native, start, own_keys, steps=steps, drag=0.8, force=1e-3, sample_every=1,
        precision=precision,
    )  # fmt: skip
    path = run["sample_pose"][:, :, 0]
    for axis, expected in enumerate((x, y, theta)):
        np.testing.assert_array_equal(path[..., axis], expected.astype(np.float32))
    np.testing.assert_array_equal(run["pose"][:, 0], np.stack([x, y, theta])[:, :, -1].T)


def test_every_world_sees_a_changing_flow_from_its_beginning() -> None:
    # More worlds than lanes, of very different lengths: complete ones wait for the others.
    native = changing_model([0.0])
    start, own_keys = random_starts(native, 3, 90, seed=2)
    start[::2] = 0.0
    start[::2, :, 0] = 0.0301 * np.arange(3)  # these join within a few steps
    options: dict[str, Any] = {"steps": 300, "drag": 2.0, "force": 1e-3}
    together = assemble(native, start, own_keys, threads=2, **options)
    assert (together["end_step"][::2] < 10).all()
    assert (together["end_step"][1::2] == 300).any()
    for world in range(0, 90, 7):
        one = slice(world, world + 1)
        alone = assemble(native, start[one], own_keys[one], **options)
        for name in ("pose", "end_step", "event_step", "event_face", "first_contact_step"):
            np.testing.assert_array_equal(alone[name][0], together[name][world], err_msg=name)


@pytest.mark.parametrize("rows", [2, 5])
@pytest.mark.parametrize("precision", ["single", "double"])
def test_faces_left_out_have_the_bits_of_faces_that_add_nothing(precision: str, rows: int) -> None:
    # Blocks that join within a few steps. A share of the drag on hidden faces that rounding takes
    # away has sums over all faces.
    column, row = np.divmod(np.arange(rows * (rows + 1)), rows)
    start = np.zeros((18, column.size, 3))
    start[..., 0], start[..., 1] = 0.0301 * (column - 2.5), 0.0301 * (row - 2.0)
    options: dict[str, Any] = {"steps": 200, "force": 2e-3, "precision": precision}
    options |= {"latching": "collision", "sample_every": 20}
    left_out, nothing = (
        assemble(model(swirl, times=[0.0]), start, keys(18), hidden_face_drag=share, **options)
        for share in ("none", 1e-30)
    )
    labels = left_out["sample_assembly"]
    assert (labels[:, 5] == 0).mean() > 0.5
    for name in ("sample_pose", "event_step", "event_block"):
        np.testing.assert_array_equal(left_out[name], nothing[name], err_msg=name)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"latching": "glue"}, "latching"),
        ({"hidden_face_drag": 1.5}, "hidden_share must be from 0 to 1"),
        ({"stirring_length": -0.1}, "stirring_length must be finite"),
        ({"precision": "quad"}, "quad must be double or single"),
        ({"steps": 0}, "steps"),
        ({"sample_every": -1}, "sample_every"),
    ],
)
def test_what_is_no_option_is_refused(change: dict[str, Any], words: str) -> None:
    native = model(swirl, times=[0.0])
    with pytest.raises(ValueError, match=words):
        assemble(native, np.zeros((1, 2, 3)), keys(1), **{"steps": 1, **change})


def test_worlds_of_another_shape_are_refused() -> None:
    native = model(swirl, times=[0.0])
    with pytest.raises(ValueError, match="shape"):
        assemble(native, np.zeros((1, 2, 2)), keys(1), steps=1)
    with pytest.raises(ValueError, match="one entry per world"):
        assemble(native, np.zeros((2, 2, 3)), keys(1), steps=1)
    with pytest.raises(ValueError, match="2000"):
        assemble(native, np.zeros((1, 2001, 3)), keys(1), steps=1)


def test_no_worlds_give_no_rows() -> None:
    run = assemble(model(swirl, times=[0.0]), np.zeros((0, 2, 3)), keys(0), steps=5)
    assert run["pose"].shape == (0, 2, 3)
    assert run["block_steps"] == 0
