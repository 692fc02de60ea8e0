"""Runs through the public door: seeds, starts, status, camera, tanks, errors."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest
from single_block import (
    corner_positions,
    model,
    one_world,
    random_worlds,
    run,
    still,
    study,
    swirl,
    wrapped,
)

import driftwalk as dw
from driftwalk import _core
from driftwalk.core.errors import InputError
from driftwalk.core.random_streams import world_keys
from driftwalk.schema import build_flow_field, build_trajectory
from driftwalk.simulation import Start

QUIET = {"force_std_N": 0.0}
STILL = dw.uniform_flow(0.0, 0.0)


def _same(a, b) -> None:
    for left, right in zip(a, b, strict=True):
        np.testing.assert_array_equal(left, right)


# --- the same bits whatever runs beside -----------------------------------------------------------


@pytest.mark.parametrize("precision", ["single", "double"])
def test_batch_size_order_and_threads_do_not_matter(precision: str) -> None:
    worlds = random_worlds(37, force=1e-3)
    keys = world_keys(9, trial=0, replicate=np.arange(37))
    native = model(swirl, times=np.arange(31) * 0.1, position_noise=1e-4, orientation_noise=0.02)
    whole = run(native, worlds, keys=keys, precision=precision)
    for threads in (2, 3, 8):
        _same(whole, run(native, worlds, keys=keys, precision=precision, threads=threads))
    order = np.random.default_rng(1).permutation(37)
    shuffled = run(native, worlds[order], keys=keys[order], precision=precision)
    _same([values[order] for values in whole], shuffled)
    for first, last in ((0, 1), (5, 8), (11, 37)):
        part = run(native, worlds[first:last], keys=keys[first:last], precision=precision)
        _same([values[first:last] for values in whole], part)


def test_instruction_sets_give_the_same_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    worlds = random_worlds(35, force=2e-3)
    native = model(swirl, times=np.arange(101) * 0.1, friction=0.3, position_noise=1e-4)
    results = {}
    for name in _core.available_instruction_sets():
        monkeypatch.setenv("DRIFTWALK_INSTRUCTION_SET", name)
        assert _core.instruction_set() == name
        results[name] = run(native, worlds, precision="single")
    assert "baseline" in results
    for result in results.values():
        _same(results["baseline"], result)


@pytest.mark.slow
def test_instruction_set_of_a_fresh_process() -> None:
    code = (
        "import hashlib, driftwalk as dw; from driftwalk import _core;"
        "run = dw.simulate(dw.Study(), dw.vortex_flow(0.5), sample_time=[0, 1, 5], replicates=9);"
        "print(_core.instruction_set(), hashlib.sha256(run.x.values.tobytes()).hexdigest())"
    )
    printed = {}
    for name in {"baseline", _core.available_instruction_sets()[-1]}:
        environment = {**os.environ, "DRIFTWALK_INSTRUCTION_SET": name}
        out = subprocess.run(
            [sys.executable, "-c", code],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
        chosen, digest = out.stdout.split()
        assert chosen == name
        printed[name] = digest
    assert len(set(printed.values())) == 1


def test_unknown_instruction_set_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DRIFTWALK_INSTRUCTION_SET", "mmx")
    with pytest.raises(ValueError, match="mmx is unknown: use baseline, avx2 or avx512"):
        run(model(times=[0.0]), one_world(), precision="single")


def test_seeds_and_replicates() -> None:
    flow, time = dw.vortex_flow(0.5), [0.0, 0.5, 2.0]
    many = dw.simulate(study(), flow, sample_time=time, seed=4, replicates=50)
    again = dw.simulate(study(), flow, sample_time=time, seed=4, replicates=50)
    few = dw.simulate(study(), flow, sample_time=time, seed=4, replicates=1)
    other = dw.simulate(study(), flow, sample_time=time, seed=5, replicates=50)
    np.testing.assert_array_equal(many.x, again.x)
    np.testing.assert_array_equal(many.x[:1], few.x)
    assert not np.isclose(many.x.values, other.x.values, atol=1e-6).all(axis=1).any()
    assert len(np.unique(many.x.values[:, -1, 0])) == 50


# --- starts ---------------------------------------------------------------------------------------


def test_start_is_the_first_sample() -> None:
    start = Start(0.03, -0.04, 0.5, 0.02, 0.01, 0.3)
    out = dw.simulate(study(forces=QUIET), STILL, sample_time=[0.0, 0.01], start=start)
    np.testing.assert_allclose(out.x.values.ravel()[0], 0.03, atol=1e-8)
    np.testing.assert_allclose(out.y.values.ravel()[0], -0.04, atol=1e-8)
    np.testing.assert_allclose(out.theta.values.ravel()[0], 0.5, atol=1e-7)
    np.testing.assert_allclose(out.x.values.ravel()[1], 0.03 + 0.02 * 0.01, rtol=2e-3)


@pytest.mark.parametrize("turns", [-3, 1, 2, 40])
@pytest.mark.parametrize("backend", ["cpu", "reference"])
def test_start_angle_of_many_turns_is_the_same_orientation(turns: int, backend: str) -> None:
    def paths(theta: float):
        start = Start(0.05, 0.02, theta, 0.02, 0.0, 0.4)
        flow = dw.vortex_flow(0.4)
        time = [0.0, 0.5, 1.0]
        return dw.simulate(
            study(forces=QUIET), flow, sample_time=time, start=start, backend=backend
        )

    near, far = paths(0.5), paths(0.5 + 2 * np.pi * turns)
    np.testing.assert_allclose(near.x, far.x, atol=1e-6)
    np.testing.assert_allclose(wrapped(near.theta - far.theta), 0.0, atol=1e-4)


@pytest.mark.parametrize(
    "tank",
    [
        {"diameter_m": 0.12},
        {"shape": "rectangle", "width_m": 0.2, "height_m": 0.06},
        {"shape": "polygon", "vertices_m": ((-0.1, -0.06), (0.14, -0.06), (-0.02, 0.12))},
    ],
)
def test_random_start_is_inside_and_stays_inside(tank: dict) -> None:
    chosen = study(tank=tank, forces={"force_std_N": 3e-3})
    flow = dw.uniform_flow(0.03, 0.02, arena={"shape": "circle", "diameter_m": 0.3})
    out = dw.simulate(chosen, flow, sample_time=np.arange(200) * 0.05, replicates=20)
    assert not out.status.any()
    x, y = corner_positions(out.x.values[..., 0], out.y.values[..., 0], out.theta.values[..., 0])
    outline = chosen.tank
    if outline.radius_m is not None:
        outside = np.hypot(x, y).max() - outline.radius_m
    else:
        from driftwalk.simulation.backend import wall_edges

        edges = wall_edges(outline)
        outside = max((x * a + y * b - d).max() for a, b, d in edges)
    assert outside < 1e-6
    assert outside > -0.005, "no corner ever came near the wall"


def test_recorded_start_recovers_the_motion() -> None:
    time = np.arange(60) * 0.1
    x, y = 0.02 + 0.03 * time - 0.002 * time**2, -0.05 + 0.01 * time
    theta = 3.0 + 0.2 * time  # passes pi
    recording = build_trajectory(time, x, y, theta=wrapped(theta))
    start = _recorded(recording)
    np.testing.assert_allclose(start[:2], [0.02, -0.05], atol=1e-12)
    np.testing.assert_allclose(wrapped(start.theta - 3.0), 0.0, atol=1e-12)
    np.testing.assert_allclose(start[3:], [0.03, 0.01, 0.2], atol=1e-10)


def _recorded(recording):
    from driftwalk.schema import body_track

    return dw.conditions.recorded_start(body_track(recording))


def test_recorded_start_without_orientation_draws_one_per_world() -> None:
    time = np.arange(30) * 0.1
    start = _recorded(build_trajectory(time, 0.01 * time, 0 * time))
    assert np.isnan(start.theta)
    assert start.omega == 0.0
    out = dw.simulate(study(), STILL, sample_time=[0.0], start=start, replicates=30)
    assert len(np.unique(out.theta)) == 30


# --- camera ---------------------------------------------------------------------------------------


def test_quantised_positions_are_multiples_of_the_quantum() -> None:
    native = model(swirl, times=np.arange(101) * 0.1, position_quantum=1e-4)
    exact = model(swirl, times=np.arange(101) * 0.1)
    worlds = random_worlds(5)
    for precision in ("single", "double"):
        rounded, plain = (run(m, worlds, precision=precision) for m in (native, exact))
        for k in (0, 1):
            units = rounded[k].astype(np.float64) / 1e-4
            assert np.abs(units - np.round(units)).max() < 1e-3
            assert np.abs(rounded[k] - plain[k]).max() < 0.5001e-4
        np.testing.assert_array_equal(rounded[2], plain[2])


def test_rounding_hides_no_failure_and_takes_any_quantum() -> None:
    worlds = np.vstack([one_world(np.nan), one_world(0.05)])
    for precision in ("single", "double"):
        x = run(model(times=[0.0, 0.1], position_quantum=1e-4), worlds, precision=precision)[0]
        assert np.isnan(x[0]).all()
        fine = run(model(times=[0.0, 0.1], position_quantum=1e-13), worlds, precision=precision)[0]
        np.testing.assert_allclose(fine[1], 0.05, atol=1e-8)


def test_orientation_stays_within_half_a_turn_at_any_noise() -> None:
    native = model(times=np.arange(2000) * 0.01, orientation_noise=3.2)
    theta = run(native, one_world(theta=3.0), precision="single")[2]
    assert np.abs(theta).max() <= np.pi + 1e-6


def test_noise_does_not_disturb_the_motion() -> None:
    worlds, time = random_worlds(6), np.arange(31) * 0.1
    clean = run(model(swirl, times=time), worlds)
    noisy = run(model(swirl, times=time, position_noise=1e-3, orientation_noise=0.1), worlds)
    for k in (0, 1):
        difference = noisy[k] - clean[k]
        assert 0.7e-3 < difference.std() < 1.3e-3
        assert np.abs(difference).max() < 6e-3
    assert not np.array_equal(noisy[0] - clean[0], noisy[1] - clean[1])


@pytest.mark.parametrize(
    ("view", "sees"),
    [
        (
            {"shape": "circle", "diameter_m": 0.1, "center_m": (0.05, 0.0)},
            lambda x, y: np.hypot(x - 0.05, y) <= 0.05,
        ),
        (
            {"shape": "rectangle", "width_m": 0.2, "height_m": 0.1, "center_m": (0.0, -0.03)},
            lambda x, y: (np.abs(x) <= 0.1) & (np.abs(y + 0.03) <= 0.05),
        ),
        (
            {"shape": "polygon", "vertices_m": ((0.0, 0.0), (0.2, 0.0), (0.0, 0.2))},
            lambda x, y: (x >= 0) & (y >= 0) & (x + y <= 0.2),
        ),
    ],
)
def test_samples_outside_the_field_of_view_are_missing(view: dict, sees) -> None:
    flow, time = dw.vortex_flow(0.5), np.arange(100) * 0.1
    forces = {"force_std_N": 3e-3}
    whole = dw.simulate(study(forces=forces), flow, sample_time=time, replicates=10)
    seen = dw.simulate(
        study(forces=forces, observation={"field_of_view": view}),
        flow,
        sample_time=time,
        replicates=10,
    )
    inside = sees(whole.x.values.astype(float), whole.y.values.astype(float))
    assert 0.01 < inside.mean() < 0.99
    for name in ("x", "y", "theta"):
        np.testing.assert_array_equal(seen[name], np.where(inside, whole[name], np.nan))


def test_simulate_like_has_the_time_stamps_and_gaps_of_the_recording() -> None:
    time = np.delete(np.arange(100) * 0.1 + 5.0, [20, 21, 22, 60])
    recording = build_trajectory(time, 0.001 * (time - 5), 0 * time, theta=0 * time)
    like = dw.simulate_like(study(), dw.vortex_flow(0.5), recording, seed=3)
    np.testing.assert_allclose(like.time, time - 5.0, atol=1e-12)
    # The same world without the gaps passes through the same places.
    start = _recorded(recording)
    full = dw.simulate(
        study(), dw.vortex_flow(0.5), sample_time=np.arange(100) * 0.1, start=start, seed=3
    )
    kept = np.delete(np.arange(100), [20, 21, 22, 60])
    np.testing.assert_allclose(like.x[0], full.x[0, kept], atol=1e-6)


@pytest.mark.parametrize("samples", [1, 2, 50])
def test_a_study_can_leave_out_the_gaps_of_the_recording(samples: int) -> None:
    time = np.arange(samples) * 0.1
    kept = time if samples < 50 else np.delete(time, [7, 8, 30])
    recording = build_trajectory(kept, 0.01 * kept, 0 * kept, theta=0 * kept)
    like = dw.simulate_like(study(observation={"gaps": "none"}), STILL, recording)
    np.testing.assert_allclose(like.time, time, atol=1e-12)


def test_equal_frames_are_a_steady_flow() -> None:
    steady = dw.jets_flow(jet_speed=0.05)
    frames = build_flow_field(
        steady.x.values,
        steady.y.values,
        u=np.stack([steady.u.values] * 3),
        v=np.stack([steady.v.values] * 3),
        flag=np.stack([steady.flag.values] * 3),
        time=[0.0, 0.3, 2.0],
    )
    for backend in ("cpu", "reference"):
        common = {"sample_time": np.arange(20) * 0.1, "replicates": 4, "backend": backend}
        a, b = (dw.simulate(study(), flow, **common) for flow in (steady, frames))
        np.testing.assert_array_equal(a.x, b.x)


# --- status ---------------------------------------------------------------------------------------


def test_status_of_a_world_at_rest_and_of_one_that_moves() -> None:
    time = np.arange(101) * 0.1
    rest = dw.simulate(study(forces=QUIET), STILL, sample_time=time)
    noisy = dw.simulate(
        study(forces=QUIET, observation={"position_noise_m": 1e-3}), STILL, sample_time=time
    )
    moving = dw.simulate(study(), STILL, sample_time=time)
    assert rest.status.item() == noisy.status.item() == 4
    assert moving.status.item() == 0
    assert rest.status.attrs["flag_meanings"].split() == ["non_finite", "escaped", "no_motion"]
    np.testing.assert_array_equal(rest.status.attrs["flag_masks"], [1, 2, 4])


@pytest.mark.parametrize("precision", ["single", "double"])
def test_a_world_that_fails_leaves_the_others_alone(precision: str) -> None:
    worlds = random_worlds(20)
    native = model(swirl, times=np.arange(51) * 0.1)
    sound = run(native, worlds, precision=precision)
    worlds[3, 7] = 1e308 if precision == "double" else 1e38  # a force beyond the number type
    worlds[9, 0] = np.nan
    failed = run(native, worlds, precision=precision)
    assert failed[3][3] & 1
    assert failed[3][9] & 1
    others = np.setdiff1d(np.arange(20), [3, 9])
    assert not failed[3][others].any()
    for k in range(3):
        np.testing.assert_array_equal(failed[k][others], sound[k][others])


@pytest.mark.parametrize("duration", [20.0, pytest.param(300.0, marks=pytest.mark.slow)])
def test_stable_over_the_whole_box_of_parameters(duration: float) -> None:
    drag, force = np.meshgrid(np.linspace(0, 4, 9), np.linspace(0, 4e-3, 9))
    worlds = random_worlds(2 * drag.size)
    worlds[:, 6], worlds[:, 7] = np.tile(drag.ravel(), 2), np.tile(force.ravel(), 2)
    x, y, theta, status = run(
        model(swirl, times=np.arange(0, duration, 0.1)), worlds, precision="single"
    )
    assert not status.any()
    assert np.isfinite(x).all()
    assert np.isfinite(theta).all()
    corner_x, corner_y = corner_positions(x, y, theta)
    # Samples between steps lie on the chord, within the circle; what is left is rounding.
    assert np.hypot(corner_x, corner_y).max() < 0.15 + 1e-6
    assert np.hypot(np.diff(x), np.diff(y)).max() < 0.2, "faster than 2 m/s"


# --- errors ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "times", [[], [0.0, 0.0], [0.1, 0.0], [-0.1, 0.0], [0.0, np.nan], [0.0, np.inf], [[0.0, 1.0]]]
)
def test_sampling_times_that_make_no_sense_are_refused(times: list) -> None:
    with pytest.raises(InputError, match="sampling times"):
        dw.simulate(study(), STILL, sample_time=times)


def test_unknown_backend_is_refused() -> None:
    with pytest.raises(InputError, match=r"backend.*cuda"):
        dw.simulate(study(), STILL, sample_time=[0.0], backend="cuda")  # type: ignore[arg-type]


def test_no_replicates_are_refused() -> None:
    with pytest.raises(InputError, match="replicates"):
        dw.simulate(study(), STILL, sample_time=[0.0], replicates=0)


def test_frames_out_of_order_are_refused() -> None:
    shape = (2, STILL.sizes["y"], STILL.sizes["x"])
    flow = build_flow_field(
        STILL.x.values,
        STILL.y.values,
        u=np.zeros(shape),
        v=np.zeros(shape),
        flag=np.ones(shape),
        time=[1.0, 0.0],
    )
    with pytest.raises(InputError, match="do not increase"):
        dw.simulate(study(), flow, sample_time=[0.0])


def test_wrong_shapes_are_refused() -> None:
    native = model(still, times=[0.0])
    with pytest.raises(ValueError, match=r"shape \(n, 8\)"):
        _core.simulate(
            native, np.zeros((2, 7)), np.zeros(2, np.uint64), threads=1, precision="single"
        )
    with pytest.raises(ValueError, match=r"shape \(n, 8\)"):
        _core.simulate(
            native, np.zeros((2, 8)), np.zeros(3, np.uint64), threads=1, precision="single"
        )
