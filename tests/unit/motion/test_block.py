"""The block's fused native path against simulating and comparing world by world."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import driftwalk as dw
from driftwalk.comparison import StepDistance
from driftwalk.conditions import recorded_conditions
from driftwalk.core.errors import InputError
from driftwalk.core.random_streams import world_keys
from driftwalk.model import apply_overrides
from driftwalk.motion import BlockModel, score_worlds
from driftwalk.schema import body_track
from driftwalk.simulation.backend import Camera

VALUES = {
    "drag_coefficient": np.array([0.0, 0.2, 0.4, 0.4, 0.8]),
    "force_std": np.array([0.0, 2e-4, 6e-4, 6e-4, 1e-3]),
}
KEYS = world_keys(1, trial=[0, 1, 2, 2, 3], replicate=[0, 0, 0, 1, 0])


class Unfused:
    """The block without its native score."""

    def __init__(self, block):
        self.block = block

    def __getattr__(self, name):
        if name == "score":
            raise AttributeError(name)
        return getattr(self.block, name)


@pytest.fixture(scope="module")
def track():
    return body_track(dw.tank30_recording().isel(time=slice(0, 900)))


@pytest.mark.parametrize("view", [None, {"shape": "circle", "diameter_m": 0.2}])
@pytest.mark.parametrize("details", ["none", "steps", "all"])
def test_the_fused_path_gives_the_bits_of_the_plain_one(track, details, view):
    study = apply_overrides(dw.Study(), {"observation.field_of_view": view} if view else {})
    camera = Camera(position_noise=3e-4, orientation_noise=0.01, position_quantum=1e-4)
    like = recorded_conditions(track, study, camera=camera, flow=dw.tank30_flow(), threads=2)
    reference = StepDistance().prepare(track)
    block = BlockModel(study)
    fused = score_worlds(block, VALUES, like, KEYS, reference, details=details)
    plain = score_worlds(Unfused(block), VALUES, like, KEYS, reference, details=details)
    assert plain.keys() == fused.keys()
    for name, values in fused.items():
        if name in ("step_length", "turning_angle"):
            for world, count in enumerate(fused["pairs"]):
                np.testing.assert_array_equal(plain[name][world, :count], values[world, :count])
        else:
            np.testing.assert_array_equal(plain[name], values, err_msg=name)
    assert fused["ks_distance"].min() < 0.3


def test_a_block_without_water_is_refused(track):
    like = recorded_conditions(track, dw.Study(), camera=Camera())
    with pytest.raises(InputError, match="need a flow field"):
        BlockModel(dw.Study()).simulate(VALUES, like, KEYS)


def test_other_conditions_get_a_core_of_their_own(track):
    study = dw.Study()
    likes = [
        recorded_conditions(track, study, camera=Camera(noise), flow=dw.tank30_flow(), threads=1)
        for noise in (0.0, 1e-3, 0.0)
    ]
    block = BlockModel(study)
    first, noisy, again = (block.simulate(VALUES, like, KEYS).x for like in likes)
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, noisy)
    copied = pickle.loads(pickle.dumps(block))
    np.testing.assert_array_equal(copied.simulate(VALUES, likes[0], KEYS).x, first)
