"""Scores of worlds against the same done one at a time with the public functions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from single_block import model, random_worlds, run, swirl

import driftwalk as dw
from driftwalk import _core
from driftwalk.comparison import apply_steps, plan_steps
from driftwalk.core.random_streams import world_keys

WORLDS = 21
TIME = np.delete(np.arange(150) * 0.1, [40, 41, 90])
KEYS = world_keys(2, trial=0, replicate=np.arange(WORLDS))
PLAN = plan_steps(TIME)
REFERENCE = np.random.default_rng(5).normal([0.004, 0.0], [0.002, 0.8], (90, 2))
LENGTH_LIMIT, ANGLE_LIMIT, BINS = 0.006, 2.0, 16


def _native(**changes: Any) -> _core.Model:
    return model(swirl, times=TIME, position_noise=2e-4, **changes)


def _score(worlds: np.ndarray, native: _core.Model | None = None, **changes: Any) -> dict[str, Any]:
    options: dict[str, Any] = {
        "left": PLAN.left,
        "weight": PLAN.weight,
        "triple": PLAN.triple,
        "reference": REFERENCE,
        "bins": BINS,
        "length_limit": LENGTH_LIMIT,
        "angle_limit": ANGLE_LIMIT,
        "excerpt": 30,
        "keep_steps": True,
        "threads": 1,
    }
    return _core.score(native or _native(), worlds, KEYS[: len(worlds)], **{**options, **changes})


def _steps_one_by_one(worlds: np.ndarray, native: _core.Model | None = None) -> list[np.ndarray]:
    x, y, _, _ = run(native or _native(), worlds, keys=KEYS[: len(worlds)], precision="single")
    applied = (apply_steps(PLAN, a, b) for a, b in zip(x, y, strict=True))
    return [np.column_stack([found.step_length, found.turning_angle]) for found in applied]


def test_distances_are_those_of_the_simulated_paths() -> None:
    worlds = random_worlds(WORLDS)
    scored = _score(worlds)
    assert not scored["status"].any()
    for world, steps in enumerate(_steps_one_by_one(worlds)):
        assert scored["pairs"][world] == len(steps) == PLAN.pairs
        assert scored["ks_distance"][world] == dw.ks_distance(REFERENCE, steps)
        compared = dw.comparison.ks_compare(REFERENCE, steps)
        place = compared.place
        got = [scored[f"ks_{key}"][world] for key in ("step_length", "turning_angle", "quadrant")]
        assert got == [place.x, place.y, place.quadrant]
        np.testing.assert_array_equal(scored["step_length"][world], steps[:, 0])
        np.testing.assert_array_equal(scored["turning_angle"][world], steps[:, 1])


def test_densities_are_histograms_of_the_steps() -> None:
    worlds = random_worlds(WORLDS)
    density = _score(worlds)["step_density"]
    edges = [
        np.linspace(0, LENGTH_LIMIT, BINS + 1),
        np.linspace(-ANGLE_LIMIT, ANGLE_LIMIT, BINS + 1),
    ]
    beyond = 0
    for world, steps in enumerate(_steps_one_by_one(worlds)):
        # A step beyond the limits counts in the last bin on its side.
        length = np.minimum(steps[:, 0], LENGTH_LIMIT)
        angle = np.clip(steps[:, 1], -ANGLE_LIMIT, ANGLE_LIMIT)
        beyond += np.sum(length < steps[:, 0]) + np.sum(angle != steps[:, 1])
        expected = np.histogram2d(length, angle, bins=edges)[0] / len(steps)
        np.testing.assert_allclose(density[world], expected, atol=1e-6)
        assert density[world].sum() == pytest.approx(1.0, abs=1e-5)
    assert beyond > 10


def test_excerpts_are_the_first_samples() -> None:
    worlds = random_worlds(WORLDS)
    x, y, _, _ = run(_native(), worlds, keys=KEYS, precision="single")
    scored = _score(worlds)
    np.testing.assert_array_equal(scored["excerpt_x"], x[:, :30])
    np.testing.assert_array_equal(scored["excerpt_y"], y[:, :30])
    assert _score(worlds, excerpt=10_000)["excerpt_x"].shape == (WORLDS, TIME.size)


def test_threads_and_instruction_sets_do_not_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    worlds = random_worlds(WORLDS)
    first = _score(worlds)
    others = [_score(worlds, threads=threads) for threads in (2, 8)]
    for name in _core.available_instruction_sets():
        monkeypatch.setenv("DRIFTWALK_INSTRUCTION_SET", name)
        others.append(_score(worlds))
    for other in others:
        assert other.keys() == first.keys()
        for key, values in first.items():
            np.testing.assert_array_equal(other[key], values, err_msg=key)


def test_only_what_is_asked_for_comes_back() -> None:
    plain = _score(random_worlds(3), reference=None, bins=0, excerpt=0, keep_steps=False)
    assert sorted(plain) == ["pairs", "status"]


def test_a_world_without_motion_is_as_far_as_can_be() -> None:
    worlds = random_worlds(5)
    worlds[2] = [0, 0, 0, 0, 0, 0, 0.45, 0]
    native = model(times=TIME, position_noise=2e-4)
    scored = _score(worlds, native)
    assert scored["status"][2] == 4
    assert scored["ks_distance"][2] == 1.0
    assert (scored["ks_distance"][[0, 1, 3, 4]] < 1.0).all()


def test_unseen_samples_form_no_steps() -> None:
    worlds = random_worlds(WORLDS)
    native = _native(view_radius=0.07, view_x=0.02, view_y=0.0)
    scored = _score(worlds, native)
    steps = _steps_one_by_one(worlds, native)
    assert ((scored["pairs"] > 0) & (scored["pairs"] < PLAN.pairs)).sum() > 5
    assert (scored["pairs"] == 0).any()
    for world, found in enumerate(steps):
        assert scored["pairs"][world] == len(found)
        expected = dw.ks_distance(REFERENCE, found) if len(found) else 1.0
        assert scored["ks_distance"][world] == expected


def test_matrix_of_distances_is_the_pairwise_one() -> None:
    scored = _score(random_worlds(WORLDS))
    length, angle, pairs = scored["step_length"], scored["turning_angle"], scored["pairs"].copy()
    pairs[1], pairs[2], pairs[7] = 60, 0, 0
    tables = [(length[:4], angle[:4], pairs[:4]), (length[4:], angle[4:], pairs[4:])]
    matrix = _core.ks_matrix(*tables[0], *tables[1], threads=2)
    assert matrix.shape == (4, WORLDS - 4)
    for row in range(4):
        for column in range(0, WORLDS - 4, 3):
            a, b = (
                np.column_stack([t[0][i, : t[2][i]], t[1][i, : t[2][i]]])
                for t, i in zip(tables, (row, column), strict=True)
            )
            expected = dw.ks_distance(a, b) if len(a) and len(b) else 1.0
            assert matrix[row, column] == expected
    np.testing.assert_array_equal(matrix, _core.ks_matrix(*tables[0], *tables[1], threads=1))


def test_tables_of_different_shapes_are_refused() -> None:
    table = np.zeros((2, 3))
    count = np.array([3, 3])
    with pytest.raises(ValueError, match="do not match"):
        _core.ks_matrix(table, table[:, :2].copy(), count, table, table, count, threads=1)
