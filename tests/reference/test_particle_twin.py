"""The kernels of self-propelled particles against their NumPy twin, and float against double."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
import pytest
import xarray as xr
from twin.particle import Floats, Keys, Path, Scene, simulate_inertial, simulate_switching

from driftwalk import _core
from driftwalk.core.random_streams import world_keys
from driftwalk.flow import flow_from_function, uniform_flow
from driftwalk.model import Tank
from driftwalk.motion.family.columns import (
    ParticleTable,
    State,
    inertial_table,
    switching_table,
)
from driftwalk.simulation.backend import Camera, native_scene, wall_edges

STEP = 0.02
COUNT = 12
RANGE = 0.02
CIRCLE = Tank(diameter_m=0.3)
SQUARE = Tank(shape="rectangle", width_m=0.3, height_m=0.3)
WEDGE = Tank(shape="polygon", vertices_m=((-0.15, -0.12), (0.2, -0.1), (0.02, 0.18)))


@dataclass(frozen=True)
class Case:
    """A kind of particle, and what surrounds it."""

    states: tuple[State, ...] = ()
    shared: dict[str, Any] = field(default_factory=dict)
    tank: Tank = CIRCLE
    reflects: bool = False
    carried: bool = False
    others: Floats | None = None


def spread(low: float, high: float) -> Floats:
    """Return another number for every world."""
    return np.linspace(low, high, COUNT)


RUN = State(
    spread(0.01, 0.03), 0.4, dwell=1.3, rotational_diffusion=spread(0.05, 0.5), turn_std=1.0
)


def moving_others(steps: int) -> Floats:
    """Return the places of two other bodies: one on a circle, one that is lost and found again."""
    turn = np.arange(steps) * STEP
    first = np.column_stack([0.04 * np.cos(turn), 0.04 * np.sin(turn)])
    second = np.column_stack([-0.05 + 0.002 * turn, 0.01 * turn % 0.08])
    second[(turn > 2.0) & (turn < 6.0)] = np.nan
    return np.ascontiguousarray(np.stack([first, second], axis=1))


STEADY = State(spread(0.01, 0.05), rotational_diffusion=0.3)
THREE = (
    State(
        0.04, dwell=0.8, dwell_cv=0.4, turn_std=0.3,
        next=(0.0, spread(0.1, 0.9), spread(0.9, 0.1)),
    ),
    State(0.01, 0.5, dwell=1.5, rotational_diffusion=1.0, next=(0.5, 0.25, 0.25)),
    State(0.02, dwell=spread(0.2, 3.0), turn_rate=1.0, next=(0.7, 0.3, 0.0)),
)  # fmt: skip

SWITCHING: dict[str, Case] = {
    "active": Case((State(0.02, rotational_diffusion=0.4, turn_rate=spread(-1.0, 1.0)),)),
    "run and tumble": Case((RUN,)),
    "run and rest": Case((RUN, State(0.0, dwell=spread(0.1, 2.0), dwell_cv=0.3))),
    "burst and coast": Case(
        (
            State(
                0.05,
                0.5,
                dwell=0.707,
                dwell_cv=spread(0.0, 2.0),
                relaxation_time=0.4,
                coasting=True,
                turn_std=0.8,
            ),
        )
    ),
    "reversals": Case((State(0.03, dwell=0.6, reversal_share=spread(0.0, 1.0), turn_std=0.2),)),
    "turn rates": Case((State(0.03, dwell=2.0, turn_rate=0.5, turn_rate_std=spread(0.0, 2.0)),)),
    "relaxing": Case(
        (State(0.005, 0.5, dwell=1.0, relaxation_time=spread(0.05, 2.0)), State(0.05, dwell=0.5))
    ),
    "three states": Case(THREE),
    "slow": Case((STEADY,), {"slow_std": spread(0.0, 1.0), "slow_time": spread(0.5, 20.0)}),
    "stroke": Case((STEADY,), {"stroke": spread(0.0, 4.0), "stroke_frequency": spread(0.3, 9.0)}),
    "neighbours": Case(
        (RUN, State(0.0, dwell=0.5)),
        {"neighbour_push": spread(0.0, 3.0), "neighbour_range": spread(0.002, 0.06)},
        # Shorter than the run: then they stand still.
        others=moving_others(700),
    ),
    "diffusion": Case((STEADY,), {"diffusion": spread(0.0, 1e-5), "clearance": 0.02}),
}
WALLS: dict[str, dict[str, Any]] = {
    "plain": {},
    "turn": {"wall_turn": spread(0.5, 8.0)},
    "follow": {"wall_follow": spread(0.5, 8.0)},
    "slowing": {"wall_slowing": spread(0.1, 0.9)},
    "gap": {"wall_turn": 4.0, "wall_gap": spread(0.0, 0.03)},
    "all": {
        "wall_turn": 2.0,
        "wall_follow": spread(1.0, 4.0),
        "wall_slowing": 0.3,
        "wall_gap": 0.01,
    },
}


@cache
def water() -> xr.Dataset:
    """Return a curved flow of a few cm/s that reaches beyond every tank here."""

    def velocity(x: Floats, y: Floats) -> tuple[Floats, Floats]:
        return -0.2 * y + 0.01 * np.sin(40 * y), 0.2 * x + 0.01 * np.cos(40 * x)

    return flow_from_function(velocity, arena=Tank(diameter_m=0.5).to_arena())


def table_of(case: Case) -> ParticleTable:
    if case.states:
        return switching_table(case.states, {"wall_range": RANGE, **case.shared}, worlds=COUNT)
    return inertial_table(case.shared, worlds=COUNT)


def starts(count: int = COUNT) -> Floats:
    """Return x, y, theta, vx, vy, omega of worlds well inside every tank, and three at a wall."""
    rng = np.random.default_rng(3)
    rows = np.zeros((count, 6))
    rows[:, :2] = rng.uniform(-0.05, 0.05, (count, 2))
    rows[:, 2] = rng.uniform(-7.0, 7.0, count)
    rows[:, 3:5] = rng.normal(0.0, 0.03, (count, 2))
    rows[:3, :3] = [[0.05, -0.09, -1.2], [0.1, -0.09, -0.5], [-0.1, -0.1, -2.3]]
    return rows


def scene_of(case: Case) -> Scene:
    """Return the twin's form of what surrounds the particles."""
    flow = water() if case.carried else None
    grid = {} if flow is None else {f"flow_{name}": flow[name].values for name in "xyuv"}
    return Scene(
        STEP,
        case.tank.extent_m[0],
        radius=case.tank.radius_m or 0.0,
        edges=wall_edges(case.tank),
        reflects=case.reflects,
        others=case.others,
        **grid,
    )


def native(
    case: Case, times: Floats, *, keys: Keys, rows: Floats, precision: str = "double"
) -> tuple[Floats, ...]:
    """Return x, y, theta and status from the core."""
    flow = water() if case.carried else uniform_flow(0.0, 0.0, arena=case.tank.to_arena())
    model = native_scene(case.tank, None, flow, times, Camera(), time_step=STEP)
    table = table_of(case)
    particle = _core.Particle(
        kind=table.kind,
        states=table.states,
        contact="reflect" if case.reflects else "slide",
        carried=case.carried,
        neighbours=case.others,
    )
    worlds = np.ascontiguousarray(np.hstack([rows, table.columns]))
    return _core.simulate(model, worlds, keys, threads=1, precision=precision, particle=particle)


def twin(case: Case, steps: int, *, keys: Keys, rows: Floats) -> Path:
    """Return the path from the twin."""
    scene, table = scene_of(case), table_of(case)
    z = rows[:, 0] + 1j * rows[:, 1]
    if case.states:
        return simulate_switching(scene, table, key=keys, z=z, heading=rows[:, 2], steps=steps)
    velocity = rows[:, 3] + 1j * rows[:, 4]
    return simulate_inertial(scene, table, key=keys, z=z, velocity=velocity, steps=steps)


def agree(case: Case, seed: int = 5) -> Path:
    """Hold 20 s of the core in double precision against the twin, and return the twin's path.

    Rounding is 1e-16 of a few cm a step, over 1000 steps; a bout that began a step earlier in one
    of them would put them 1e-4 m apart.
    """
    steps = 1000
    keys = world_keys(seed, trial=0, replicate=np.arange(COUNT))
    x, y, theta, status = native(case, np.arange(steps + 1) * STEP, keys=keys, rows=starts())
    path = twin(case, steps, keys=keys, rows=starts())
    assert not (status & ~np.uint32(4)).any()
    assert np.abs(x + 1j * y - path.z.T).max() < 1e-9
    # Not at time 0: a bout that ends in the first step has turned the core's heading already.
    apart = np.exp(1j * theta) - np.exp(1j * path.heading.T)
    assert np.abs(apart[:, 1:]).max() < 1e-7
    return path


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize("name", SWITCHING)
def test_a_switching_particle_moves_as_its_twin(name: str) -> None:
    path = agree(SWITCHING[name])
    assert np.abs(path.z[-1] - path.z[0]).max() > 0.02, "no world moved"


def test_a_heading_is_that_of_the_sample() -> None:
    # Turning at 5 rad/s, seen at the ends of steps and between them.
    case = Case((State(0.02, turn_rate=5.0),))
    keys = world_keys(5, trial=0, replicate=np.arange(COUNT))
    times = np.array([0.0, 0.5, 1.0, 1.25, 3.0]) * STEP
    *_, theta, _ = native(case, times, keys=keys, rows=starts())
    turned = np.angle(np.exp(1j * (theta - starts()[:, 2:3])))
    np.testing.assert_allclose(turned, np.tile(5.0 * times, (COUNT, 1)), atol=1e-4)


@pytest.mark.parametrize("angle", [10.0, 20.0, 40.0, 60.0])
@pytest.mark.parametrize("reflects", [False, True])
def test_a_particle_stays_in_a_sharp_corner(angle: float, reflects: bool) -> None:
    # Straight on into the tip of a triangle that is as long as it is high.
    half = np.tan(np.deg2rad(angle / 2))
    tip = Tank(shape="polygon", vertices_m=((0.1, 0.0), (-0.1, 0.2 * half), (-0.1, -0.2 * half)))
    case = Case((State(0.05, rotational_diffusion=0.01),), {}, tip, reflects)
    rows = np.zeros((COUNT, 6))
    rows[:, 0] = -0.05
    keys = world_keys(5, trial=0, replicate=np.arange(COUNT))
    x, y, _, status = native(case, np.arange(601) * STEP, keys=keys, rows=rows)
    assert not (status & ~np.uint32(4)).any()
    outside = [(x * nx + y * ny - far).max() for nx, ny, far in wall_edges(tip)]
    assert max(outside) < 1e-6 * tip.extent_m[0]
    assert x.max() > 0.09, "no particle came to the tip"


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize("reflects", [False, True])
@pytest.mark.parametrize("tank", [CIRCLE, SQUARE], ids=["circle", "square"])
@pytest.mark.parametrize("name", WALLS)
def test_the_wall_acts_as_in_the_twin(name: str, tank: Tank, reflects: bool) -> None:
    shared = {"clearance": spread(0.0, 0.02), **WALLS[name]}
    case = Case((STEADY,), shared, tank, reflects)
    path = agree(case)
    clearance = np.tile(shared["clearance"], len(path.z))
    distance, _ = scene_of(case).wall(path.z.ravel(), clearance)
    near = (distance.reshape(path.z.shape) < RANGE).any(axis=0)
    assert near.sum() > COUNT // 2, "few worlds came near the wall"


def test_a_corner_holds_a_particle_as_in_the_twin() -> None:
    # Straight on into the corner of the square, where two edges bring it back at once.
    case = Case((State(0.1, rotational_diffusion=1e-3),), {"clearance": 0.01}, SQUARE)
    keys = world_keys(1, trial=0, replicate=np.arange(COUNT))
    rows = np.zeros((COUNT, 6))
    rows[:, 2] = np.pi / 4
    x, y, *_ = native(case, np.arange(201) * STEP, keys=keys, rows=rows)
    path = twin(case, 200, keys=keys, rows=rows)
    assert np.abs(x + 1j * y - path.z.T).max() < 1e-12
    np.testing.assert_allclose(np.stack([x, y])[..., -1], 0.14, atol=1e-12)


@pytest.mark.fast_cases(3)
@pytest.mark.parametrize("reflects", [False, True])
@pytest.mark.parametrize("tank", [CIRCLE, SQUARE, WEDGE], ids=["circle", "square", "wedge"])
@pytest.mark.parametrize("carried", [False, True])
def test_an_inertial_particle_moves_as_its_twin(tank: Tank, reflects: bool, carried: bool) -> None:
    shared = {
        "clearance": 0.01,
        "speed_std": spread(0.01, 0.04),
        "memory_time": spread(0.05, 5.0),
        "turn_rate": spread(-2.0, 2.0),
    }
    agree(Case((), shared, tank, reflects, carried))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["active", "run and rest", "diffusion"])
def test_the_water_carries_a_particle_as_its_twin(name: str) -> None:
    case = SWITCHING[name]
    carried = agree(Case(case.states, case.shared, carried=True))
    still = twin(case, 1000, keys=world_keys(5, trial=0, replicate=np.arange(COUNT)), rows=starts())
    assert np.abs(carried.z - still.z)[-1].min() > 1e-4, "a world was not carried"


# --- single precision -----------------------------------------------------------------------------

EVERYTHING = Case(
    (
        State(
            spread(0.01, 0.05), 0.4, dwell=0.9, dwell_cv=0.6, rotational_diffusion=0.4,
            turn_rate=0.3, turn_rate_std=0.5, turn_std=1.0, reversal_share=0.2,
        ),
        State(0.04, 0.3, dwell=0.7, relaxation_time=0.4, coasting=True, turn_std=0.5),
    ),
    {
        "clearance": 0.01, "diffusion": 1e-7, "slow_std": 0.3, "slow_time": 3.0, "stroke": 0.5,
        "stroke_frequency": 1.3, "wall_turn": 3.0, "wall_follow": 2.0, "wall_slowing": 0.5,
        "wall_gap": 0.02, "neighbour_push": 1.5, "neighbour_range": 0.03,
    },
    carried=True,
    others=moving_others(200),
)  # fmt: skip
FORGETFUL = Case(
    (),
    {"clearance": 0.01, "speed_std": 0.04, "memory_time": spread(0.05, 2.0), "turn_rate": 0.5},
    reflects=True,
    carried=True,
)


@pytest.mark.parametrize("name", [*SWITCHING, "everything", "inertial"])
def test_single_precision_stays_with_double_for_two_seconds(name: str) -> None:
    # 100 steps of positions of 0.1 m, and headings, with 24 bits: 6e-8 each. The two read the flow
    # with weights of 15 bits and of 53: 3e-5 of the 3 cm/s between two nodes.
    case = {**SWITCHING, "everything": EVERYTHING, "inertial": FORGETFUL}[name]
    keys, times = world_keys(4, trial=0, replicate=np.arange(COUNT)), np.arange(11) * 0.2
    single = native(case, times, keys=keys, rows=starts(), precision="single")
    double = native(case, times, keys=keys, rows=starts())
    assert single[0].dtype == np.float32
    assert double[0].dtype == np.float64
    assert np.abs(single[0] - double[0]).max() < 5e-6
    assert np.abs(single[1] - double[1]).max() < 5e-6
    assert np.abs(np.exp(1j * single[2]) - np.exp(1j * double[2]))[:, 1:].max() < 5e-4


def test_single_precision_is_not_double() -> None:
    # Were both backends the same code path, the test above could not fail.
    keys, times = world_keys(4, trial=0, replicate=np.arange(COUNT)), np.array([0.0, 2.0])
    for case in (EVERYTHING, FORGETFUL):
        single, double = (
            native(case, times, keys=keys, rows=starts(), precision=precision)
            for precision in ("single", "double")
        )
        assert (single[0][:, 1] != double[0][:, 1]).all()


def _everywhere(get: Callable[[], tuple[Floats, ...]], monkeypatch: pytest.MonkeyPatch) -> None:
    results = {}
    for name in _core.available_instruction_sets():
        monkeypatch.setenv("DRIFTWALK_INSTRUCTION_SET", name)
        assert _core.instruction_set() == name
        results[name] = get()
    for result in results.values():
        for one, other in zip(results["baseline"], result, strict=True):
            np.testing.assert_array_equal(one.view(np.uint32), other.view(np.uint32))


@pytest.mark.parametrize(
    "case",
    [EVERYTHING, FORGETFUL, Case(THREE, {"wall_turn": 2.0}, WEDGE, reflects=True)],
    ids=["everything", "inertial", "three states"],
)
def test_instruction_sets_give_the_same_bits(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    keys, times = world_keys(4, trial=0, replicate=np.arange(COUNT)), np.arange(101) * 0.1
    _everywhere(
        lambda: native(case, times, keys=keys, rows=starts(), precision="single"), monkeypatch
    )
