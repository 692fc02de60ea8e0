"""The paper's law keeps its bits: a change that adds to the law of forces changes nothing without.

The fingerprints were taken before any other law was there, those in double precision when its
sine, cosine, logarithm and exponential became driftwalk's own. Flow and starts are made of sums and
products alone, which are the same on every machine, as the kernels are.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest
from kernel_worlds import assemble, keys
from single_block import NODES, Floats, model, random_worlds, run

from driftwalk import _core

TIMES = np.arange(41) * 0.1


def turning(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """A curved flow of some 5 cm/s that no block follows."""
    return 0.4 * x * x - 0.35 * y - 0.1 * x, 0.35 * x - 0.5 * x * y - 0.1 * y


def water(frames: int) -> _core.Model:
    if frames == 1:
        return model(turning, times=TIMES, friction=0.2, steps_per_interval=2)
    x, y = np.meshgrid(NODES, NODES)
    u, v = turning(x, y)
    return model(
        times=TIMES,
        friction=0.2,
        steps_per_interval=2,
        u=np.stack([u, 0.3 * u, -v]),
        v=np.stack([v, -0.4 * v, u]),
        frame_time=np.array([0.0, 1.5, 3.0]),
    )


def fingerprint(parts: Iterable[Any]) -> str:
    digest = hashlib.sha256()
    for part in parts:
        digest.update(np.ascontiguousarray(part).tobytes())
    return digest.hexdigest()[:16]


@pytest.mark.parametrize(
    ("frames", "precision", "expected"),
    [
        (1, "single", "8df7cbabb1d9917a"),
        (1, "double", "373df66112628558"),
        (3, "single", "33c2967bb9e513bc"),
        (3, "double", "41aa6f6cc645a1da"),
    ],
)
def test_simulated_paths_keep_their_bits(frames: int, precision: str, expected: str) -> None:
    worlds = random_worlds(40)
    assert fingerprint(run(water(frames), worlds, precision=precision)) == expected


@pytest.mark.parametrize(
    ("frames", "precision", "expected"),
    [
        (1, "single", "e4e78ede06b4c816"),
        (1, "double", "9b747fcd23562887"),
        (3, "single", "c2fc0a34806c9150"),
        (3, "double", "81cfd3614cfaafd7"),
    ],
)
def test_assemblies_keep_their_bits(frames: int, precision: str, expected: str) -> None:
    start = np.zeros((20, 3, 3))
    start[:, :, 0] = [-0.05, 0.0, 0.05]
    start[:, :, 1] = np.arange(20)[:, None] * 0.001
    start[:, :, 2] = np.arange(20)[:, None] * 0.05
    found = assemble(
        water(frames), start, keys(20), steps=300, force=1e-3, latching="collision",
        precision=precision,
    )  # fmt: skip
    assert found["event_count"].any()
    names = ("pose", "event_step", "event_face", "first_contact_step", "assembly", "end_step")
    assert fingerprint(found[name] for name in names) == expected
