"""The exported forces, C and Python, number by number against the NumPy twin."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from exported import (
    CompiledForce,
    block_of,
    floating_block_module,
    random_states,
    twin_of,
)
from single_block import BEYOND_PAPER
from twin.block import Floats, drag, force_normals, next_force, push_of_water

from driftwalk.core.random_streams import world_keys
from driftwalk.export.simulators.block import Block
from driftwalk.export.simulators.mujoco import write_module
from driftwalk.export.simulators.parts import Folder

LAWS = {"paper": {}, **{name: BEYOND_PAPER[name] for name in ("power of the drag", "all")}}
SEED, REPLICATE = 5, 7


@pytest.fixture(scope="module")
def code(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Return a function that gives the exported code of a law in a language, made once."""
    made: dict[tuple[str, str], Any] = {}

    def of(law: str, language: str) -> Any:
        if (law, language) not in made:
            folder = tmp_path_factory.mktemp("force")
            if language == "C":
                made[law, language] = CompiledForce(block_of(LAWS[law]), folder)
            else:
                write_module(Folder(folder), block_of(LAWS[law]))
                module = floating_block_module(folder)
                made[law, language] = module.FloatingBlock(folder, seed=SEED, replicate=REPLICATE)
        return made[law, language]

    return of


def twin_push(block: Block, states: Floats) -> Floats:
    """Force [N] and torque [N m] of the twin, shape (3, states)."""
    twin = twin_of(block)
    pose, motion = states.T[:3], states.T[3:]
    coefficient = np.full(len(states), block.study.forces.drag_coefficient)
    return np.stack(drag(twin, coefficient, pose, motion)[:3]) + push_of_water(twin, pose)


@pytest.mark.slow
@pytest.mark.parametrize("language", ["C", "Python"])
@pytest.mark.parametrize("law", LAWS)
def test_the_water_pushes_as_in_the_twin(law: str, language: str, code: Any) -> None:
    """Relative to each force, and for the torque to that of the force at the block's edge."""
    block, states = block_of(LAWS[law]), random_states(200)
    water = code(law, language).water
    found = np.array([water(one) if language == "C" else water(*one) for one in states.tolist()]).T
    expected = twin_push(block, states)
    size = np.hypot(*expected[:2])
    assert np.hypot(*(found - expected)[:2]).max() < 1e-12 * size.max()
    assert (np.hypot(*(found - expected)[:2]) / size).max() < 1e-11
    lever = size * block.study.block.side_m + np.abs(expected[2])
    assert (np.abs(found - expected)[2] / lever).max() < 1e-11


@pytest.mark.parametrize("language", ["C", "Python"])
@pytest.mark.parametrize("law", ["paper", "all"])
def test_the_stochastic_force_is_that_of_the_twin(law: str, language: str, code: Any) -> None:
    """By its address: interval by interval, after a jump, and again from the beginning."""
    block, made = block_of(LAWS[law]), code(law, language)
    twin, key = twin_of(block), world_keys(SEED, trial=0, replicate=REPLICATE)
    last, expected = None, []
    for interval in range(12):
        last = next_force(twin, last, np.stack(force_normals(key, interval)))
        expected.append(block.study.forces.force_std_N * last[:, 0])
    if language == "C":
        made.begin(SEED, REPLICATE)
    order = [0, 1, 2, 3, 3, 9, 11, 4, 0]
    found = [made.stochastic_force(interval) for interval in order]
    wanted = [expected[interval] for interval in order]
    assert np.abs(np.array(found) - np.array(wanted)).max() < 1e-14 * np.abs(wanted).max() * 10


@pytest.mark.parametrize("language", ["C", "Python"])
def test_the_force_of_a_late_interval(language: str, code: Any) -> None:
    """An interval beyond 2**33 has a word of its own in the counter."""
    late, made = 2**35 + 3, code("paper", language)
    if language == "C":
        made.begin(SEED, REPLICATE)
    key = world_keys(SEED, trial=0, replicate=REPLICATE)
    normals = np.stack(force_normals(key, late))[:, 0]
    expected = block_of({}).study.forces.force_std_N * normals
    assert np.allclose(made.stochastic_force(late), expected, rtol=1e-13, atol=0)
