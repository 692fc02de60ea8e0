"""The live observer against `classify`, simulated runs, and brute force."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest
import xarray as xr

from driftwalk.assembly import (
    assemble,
    assembly_path,
    class_at,
    classify,
    path_recording,
)
from driftwalk.assembly.lattice.polyomino import polyomino_name
from driftwalk.datasets import tank30_flow
from driftwalk.model import Study
from driftwalk.schema import build_trajectory
from driftwalk.track.observer import AssemblyObserver, observe, possible_classes

RUNS, DURATION = 5, 30.0


@pytest.fixture(scope="module")
def simulated() -> tuple[xr.Dataset, xr.Dataset]:
    study, flow = Study(), tank30_flow()
    told = assemble(study, flow, blocks=4, runs=RUNS, duration=DURATION)
    path = assembly_path(
        study, flow, blocks=4, runs=range(RUNS), duration=DURATION, sample_interval=0.1
    )
    assert (told["event_class"].values >= 0).sum() >= RUNS
    return told, path


def noisy(path: xr.Dataset, run: int, scale: float) -> xr.Dataset:
    recording = path_recording(path, run=run)
    random = np.random.default_rng(run)
    for name, size in (("x", 0.3e-3), ("y", 0.3e-3), ("theta", math.radians(0.5))):
        recording[name] = recording[name] + scale * size * random.normal(size=recording[name].shape)
    return recording


def watched(recording: xr.Dataset, side: float) -> tuple[AssemblyObserver, list, list]:
    names = [str(name) for name in recording["body"].values]
    observer = AssemblyObserver(names, side=side)
    poses = np.stack([recording[name].values for name in ("x", "y", "theta")], axis=-1)
    seen = [
        observer.step(float(time), {n: tuple(p) for n, p in zip(names, row, strict=True)})
        for time, row in zip(recording["time"].values, poses, strict=True)
    ]
    return observer, seen, [event for one in seen for event in one.events]


@pytest.mark.slow
@pytest.mark.parametrize("scale", [0.0, 1.0, 4.0])
def test_live_events_are_those_of_classify(
    simulated: tuple[xr.Dataset, xr.Dataset], scale: float
) -> None:
    """With four times the usual noise, joins flicker: partings and joins again are the same."""
    side = simulated[1].attrs["block_side_m"]
    number = 0
    for run in range(RUNS):
        recording = noisy(simulated[1], run, scale)
        found = classify(recording, side=side)
        observer, seen, told = watched(recording, side)
        events = observer.events()
        assert sorted((e.time, e.kind) for e in told) == sorted((e.time, e.kind) for e in events)
        for kind, word in (("event", "join"), ("split", "split")):
            mine = sorted((e.time, e.bodies, e.faces) for e in events if e.kind == word)
            count = int(found[f"{kind}_count"])
            blocks = found[f"{kind}_block"].values[:count].astype(str)
            faces = found[f"{kind}_face"].values[:count].tolist()
            times = found[f"{kind}_time"].values[:count].tolist()
            theirs = sorted(
                (t, tuple(b), tuple(f)) for t, b, f in zip(times, blocks, faces, strict=True)
            )
            assert mine == theirs
            number += count
        names = found["class"].values
        last = np.searchsorted(recording["time"].values, recording["time"].values[-1] - 0.5)
        assert seen[-1].outcome == names[found["outcome"].values[-1]]
        assert seen[last].outcome in names
    assert number >= RUNS


@pytest.mark.slow
def test_hidden_blocks_leave_the_true_class_possible(
    simulated: tuple[xr.Dataset, xr.Dataset],
) -> None:
    told, path = simulated
    side, time = path.attrs["block_side_m"], path["time"].values
    truth = class_at(told, np.minimum(time, DURATION))
    narrower = []
    for run, hidden in product(range(RUNS), ([1], [0, 3])):
        recording = noisy(path, run, 1.0)
        begin = 120
        for name in ("x", "y", "theta"):
            recording[name].values[begin:, hidden] = np.nan
        found = observe(recording, side=side)
        possible = found["possible"].values
        late = time > time[begin] + 1.2
        assert (found["outcome"].values[late] == -1).all()
        assert (found["outcome"].values[~late] >= 0).sum() > 100
        own = possible[np.arange(time.size), truth[:, run]]
        # A join is dated to the approach, up to a second before the contact.
        clock = told["event_time"].values[run]
        near = ((clock - 1.0 <= time[:, None]) & (time[:, None] <= clock + 0.6)).any(axis=1)
        assert own[~near].all()
        narrower.append(possible[late].mean())
    assert np.mean(narrower) < 0.8


def test_possible_classes_by_brute_force() -> None:
    """Two hidden blocks beside a row of two: all that can be put on a small board by hand."""
    pair = {(0, 0): 0, (1, 0): 0}
    board = [(x, y) for x in range(-2, 4) for y in range(-2, 3) if (x, y) not in pair]
    expected = set()
    for one, other in product(board, board):
        if one == other:
            continue
        cells = {*pair, one, other}
        shapes = []
        while cells:
            part = {cells.pop()}
            while True:
                near = {c for c in cells for p in part if abs(c[0] - p[0]) + abs(c[1] - p[1]) == 1}
                if not near:
                    break
                part |= near
                cells -= near
            shapes.append(polyomino_name(np.array(sorted(part))))
        expected.add("+".join(sorted(shapes, key=lambda s: ("I3 L3 2 1".find(s), s))))
    found = possible_classes([pair], 2, chirality="merged")
    assert {frozenset(name.split("+")) for name in found} == {
        frozenset(name.split("+")) for name in expected
    }


def test_what_does_not_fit_on_a_lattice_is_not_joined_through_a_hidden_block() -> None:
    aside = possible_classes([{(0, 0): 0}, {(0, 0): 1}], 1, chirality="merged")
    assert aside == {"1+1+1", "2+1"}
    between = possible_classes([{(0, 0): 0, (2, 0): 1}], 1, chirality="merged")
    assert between == {"1+1+1", "2+1", "I3"}


def test_too_many_hidden_exclude_nothing() -> None:
    assert len(possible_classes([{(0, 0): 0}], 4, chirality="merged")) > 10
    assert possible_classes([{(i, 0): i for i in range(6)}], 4, chirality="merged") == frozenset()


def test_no_blocks() -> None:
    with pytest.raises(ValueError, match="no block to observe"):
        AssemblyObserver([], side=0.03)


def test_more_than_eight_blocks_with_one_hidden() -> None:
    x = np.tile(0.06 * np.arange(9), (40, 1))
    x[10:, 8] = np.nan
    found = observe(build_trajectory(0.1 * np.arange(40), x, 0 * x, 0 * x), side=0.03)
    last = found["class"].values[found["possible"].values[-1]]
    assert set(last) >= {"+".join("1" * 9), "2+" + "+".join("1" * 7)}
