"""A flow in frames beyond its last one, against closed forms: the way of what it carries."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from kernel_worlds import assemble, keys, random_starts
from single_block import MASS, flow_arrays, model, one_world, swirl

from driftwalk import _core

Floats = npt.NDArray[np.float64]

FRAMES = np.array([0.0, 1.0, 2.0, 3.0])
SPEEDS = np.array([0.01, 0.04, -0.02, 0.03])
"""Of a uniform stream along x at the frames [m/s]."""


def speed_at(time: Floats, repeat: str) -> Floats:
    """Return the stream's speed, written down without a look at the kernel."""
    period = FRAMES[-1]
    if repeat == "loop":
        # The last frame leads to the first within a second: a period has four.
        return np.interp(time % 4.0, [*FRAMES, 4.0], [*SPEEDS, SPEEDS[0]])
    if repeat == "mirror":
        time = period - np.abs(time % (2.0 * period) - period)
    return np.interp(time, FRAMES, SPEEDS)


def way_of(time: Floats, start: float, repeat: str) -> Floats:
    """Return the way [m] of something that moves as the water does."""
    fine = start + np.arange(0.0, time[-1] + 5e-4, 1e-3)
    speed = speed_at(fine, repeat)
    way = np.concatenate([[0.0], np.cumsum(0.5e-3 * (speed[1:] + speed[:-1]))])
    return np.interp(time, fine - start, way)


def stream(repeat: str, time: Floats, **changes: Any) -> _core.Model:
    ones, zeros = flow_arrays(lambda x, y: (1 + 0 * x, 0 * y))
    frames, speeds = FRAMES, SPEEDS
    if repeat == "loop":
        frames, speeds = np.append(FRAMES, 4.0), np.append(SPEEDS, SPEEDS[0])
    return model(
        times=time,
        radius=2.0,
        u=np.ascontiguousarray(speeds[:, None, None] * ones),
        v=np.ascontiguousarray(speeds[:, None, None] * zeros),
        frame_time=frames,
        flow_repeat=repeat,
        **changes,
    )


@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("start", [0.0, 1.37, 3.6, -2.2])
@pytest.mark.parametrize("repeat", ["loop", "mirror", "hold"])
def test_a_weightless_tracer_goes_the_way_of_the_water(
    repeat: str, start: float, precision: str
) -> None:
    time = np.arange(0.0, 14.01, 0.1)
    tracer = _core.Particle(kind="inertial", states=0, contact="slide", carried=True)
    table = np.zeros((3, 6 + tracer.columns))
    table[:, 8] = 1.0  # a memory of 1 s, of no velocity of its own
    x, y, _, _ = _core.simulate(
        stream(repeat, time), table, keys(3), threads=1, precision=precision, particle=tracer,
        flow_start=np.array([0.0, start, 9.0]),
    )  # fmt: skip
    for world, begin in enumerate((0.0, start, 9.0)):
        # Speeds are kept to half of 0.04 / 32767 m/s, over 14 s.
        np.testing.assert_allclose(x[world], way_of(time, begin, repeat), atol=1.2e-5)
    assert np.abs(y).max() < 1e-9


@pytest.mark.fast_cases(4)
@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("start", [0.0, 4.4])
@pytest.mark.parametrize("repeat", ["loop", "mirror", "hold"])
def test_a_body_without_drag_is_pushed_by_the_water_that_speeds_up(
    repeat: str, start: float, precision: str
) -> None:
    # It displaces its own mass: dv/dt = du/dt, whose sign turns where the series runs backwards.
    time = np.arange(0.0, 14.01, 0.1)
    native = stream(repeat, time, displaced_mass=MASS)
    world = one_world(vx=float(speed_at(np.array([start]), repeat)[0]))
    world[:, 6] = 0.0
    x, _, _, _ = _core.simulate(
        native, world, keys(1), threads=1, precision=precision, flow_start=np.array([start])
    )
    # At each of 14 frames the rate jumps, by up to 0.11 m/s^2: an error of dt^2 times that.
    np.testing.assert_allclose(x[0], way_of(time, start, repeat), atol=1.5e-4)


def turning(**changes: Any) -> _core.Model:
    u, v = flow_arrays(swirl)
    factor = np.array([1.0, 0.2, -1.0, 1.0])[:, None, None]
    return model(
        swirl, u=factor * u, v=factor * v, frame_time=np.array([0.0, 0.31, 0.8, 1.0]),
        steps_per_interval=2, flow_repeat="loop", **changes,
    )  # fmt: skip


@pytest.mark.parametrize("precision", ["single", "double"])
def test_worlds_with_their_own_moments_have_the_same_bits_in_any_batch(precision: str) -> None:
    native = turning(times=np.arange(31) * 0.1, displaced_mass=MASS)
    starts = np.linspace(0.0, 0.97, 37)
    worlds = np.repeat(one_world(), 37, axis=0)
    worlds[:, 7] = 1e-3
    options: dict[str, Any] = {"precision": precision}
    one = _core.simulate(native, worlds, keys(37), threads=1, flow_start=starts, **options)
    many = _core.simulate(native, worlds, keys(37), threads=3, flow_start=starts, **options)
    for first, second in zip(one, many, strict=True):
        np.testing.assert_array_equal(first, second)
    for world in (0, 5, 36):
        part = slice(world, world + 1)
        alone = _core.simulate(
            native, worlds[part], keys(37)[part], threads=1, flow_start=starts[part], **options
        )
        np.testing.assert_array_equal(alone[0][0], one[0][world])


@pytest.mark.parametrize("precision", ["single", "double"])
def test_blocks_with_their_own_moments_have_the_same_bits_in_any_batch(precision: str) -> None:
    native = turning(times=[0.0])
    start, own_keys = random_starts(native, 3, 60, seed=4)
    moments = np.linspace(0.0, 0.97, len(start))
    options: dict[str, Any] = {"steps": 200, "drag": 2.0, "force": 1e-3, "precision": precision}
    one = assemble(native, start, own_keys, flow_start=moments, **options)
    many = assemble(native, start, own_keys, flow_start=moments, threads=3, **options)
    shared = assemble(native, start, own_keys, **options)
    np.testing.assert_array_equal(one["pose"], many["pose"])
    np.testing.assert_array_equal(one["event_step"], many["event_step"])
    assert (one["pose"][1:] != shared["pose"][1:]).any()
    for world in range(0, len(start), 11):
        part = slice(world, world + 1)
        alone = assemble(native, start[part], own_keys[part], flow_start=moments[part], **options)
        np.testing.assert_array_equal(alone["pose"][0], one["pose"][world])


def test_an_own_moment_is_a_series_that_begins_earlier() -> None:
    u, v = flow_arrays(swirl)
    factor = np.array([1.0, 0.2, -1.0])[:, None, None]
    frames = np.array([0.0, 1.0, 2.5])
    both = [
        _core.simulate(
            model(
                swirl, times=np.arange(20) * 0.1, u=factor * u, v=factor * v,
                frame_time=frames - shift,
            ),
            one_world(), keys(1), threads=1, precision="double", flow_start=np.array([0.5 - shift]),
        )[0]
        for shift in (0.0, 0.5)
    ]  # fmt: skip
    np.testing.assert_allclose(*both, rtol=1e-12)


def test_wrong_words_and_sizes_are_refused() -> None:
    with pytest.raises(ValueError, match="hold, loop or mirror"):
        model(times=[0.0], flow_repeat="again")
    with pytest.raises(ValueError, match="one entry per world"):
        _core.simulate(
            model(times=[0.0]), one_world(), keys(1), threads=1, precision="single",
            flow_start=np.zeros(2),
        )  # fmt: skip
