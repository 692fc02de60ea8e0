"""The NumPy twin of the kernels of self-propelled particles: the same equations, written plainly.

Same random numbers, float64, headings as angles, vectorised over worlds only. Points and velocities
are complex numbers. The numbers of a model come from the core's table by their names. Within a step
of dt a particle, in this order,

    ends its bout when the bout's time is over, and begins the next one;
    relaxes to the speed of its bout, exactly over the step;
    turns, and moves along the heading that it has after half the turn;
    is brought back to the wall where it left the arena.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.random_streams import Purpose
from driftwalk.motion.family.columns import INERTIAL, SHARED, STATE, ParticleTable
from twin.block import flow_at, normal_pair, philox

Floats = npt.NDArray[np.float64]
Points = npt.NDArray[np.complex128]
Keys = npt.NDArray[np.uint64]
Mask = npt.NDArray[np.bool_]
Touched = Callable[[Points, Mask], None]

FIRST = 1 << 62
"""Where the draws of the first bout stand: no step has this number."""
FARTHEST_RANGES = 12.0
"""A wall that is farther off than so many ranges is not felt."""
MOST_ROUNDS = 16


@dataclass(frozen=True)
class Scene:
    """What surrounds the particles, SI units.

    The wall is a circle, or at radius 0 edges: rows of an outward normal and a distance from the
    origin. Without a flow the water does not carry.
    """

    time_step: float
    width: float
    """Of the arena; contact is rounded by a millionth of it."""
    radius: float = 0.0
    edges: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    reflects: bool = False
    flow_x: Floats | None = None
    flow_y: Floats | None = None
    flow_u: Floats | None = None
    flow_v: Floats | None = None
    others: Floats | None = None
    """Where other bodies are at every step, shape (steps, bodies, 2); NaN where one is not."""

    def water(self, z: Points) -> Points:
        """Return the water's velocity at points."""
        if self.flow_u is None:
            return np.zeros_like(z)
        u, v = flow_at(self, z.real, z.imag)  # type: ignore[arg-type]
        return np.asarray(u + 1j * v)

    def wall(self, z: Points, clearance: Floats) -> tuple[Floats, Points]:
        """Return the distance from contact with the nearest wall, and its outward normal."""
        if self.radius > 0:
            return self.radius - clearance - np.abs(z), np.exp(1j * np.angle(z))
        normals = self.edges[:, 0] + 1j * self.edges[:, 1]
        across = self.edges[:, 2, None] - clearance - (z * normals[:, None].conj()).real
        nearest = np.argmin(across, axis=0)
        return across[nearest, np.arange(z.size)], normals[nearest]


class Path(NamedTuple):
    """Positions and headings after 0 .. steps time steps, shape (steps + 1, worlds)."""

    z: Points
    heading: Floats


# --- random numbers -------------------------------------------------------------------------------


class Numbers:
    """All random numbers of worlds, drawn before the first step: [step] gives four rows of them.

    The row that stands after those of the steps is for the first bout.
    """

    def __init__(self, key: Keys, steps: int) -> None:
        index = np.append(np.arange(steps), FIRST)
        self.motion = _normals(key, Purpose.MOTION, index)
        self.bout = _normals(key, Purpose.BOUT, index)
        self.bout_uniforms = _uniforms(key, Purpose.BOUT, index)
        self.first = steps


def _words(key: Keys, purpose: Purpose, index: npt.NDArray[np.int64], draw: int) -> list[Floats]:
    every = np.broadcast_to(key, (index.size, key.size))
    low, high = (index & 0xFFFFFFFF)[:, None], (index >> 32)[:, None]
    return philox(every, (low, draw, high, purpose))  # type: ignore[arg-type]


def _normals(key: Keys, purpose: Purpose, index: npt.NDArray[np.int64]) -> Floats:
    """Return four standard normals of a purpose at positions of its stream."""
    words = _words(key, purpose, index, 0)
    pairs = (*normal_pair(words[0], words[1]), *normal_pair(words[2], words[3]))
    return np.stack(pairs, axis=1)


def _uniforms(key: Keys, purpose: Purpose, index: npt.NDArray[np.int64]) -> Floats:
    """Return four uniforms in (0, 1] of 24 bits, drawn at the same positions as the normals."""
    words = np.stack(_words(key, purpose, index, 1), axis=1).astype(np.uint64)
    return ((words >> np.uint64(8)).astype(np.float64) + 1.0) * 2.0**-24


# --- the wall -------------------------------------------------------------------------------------


def stay_inside(
    scene: Scene, clearance: Floats, came_from: Points, z: Points, touched: Touched
) -> Points:
    """Return the points, those beyond the wall brought back; `touched` hears of each contact.

    Reflected points come in as far as they were out. Where that leads beyond another edge, and
    where they do not bounce, they come to the contact with the nearest edge until all are clear;
    those that never are go back to where they came from.
    """
    for turn in range(MOST_ROUNDS):
        distance, normal = scene.wall(z, clearance)
        beyond = distance < -1e-6 * scene.width
        if not beyond.any():
            break
        back = 2 if scene.reflects and turn == 0 else 1
        z = z + np.where(beyond, back * distance, 0.0) * normal
        touched(normal, beyond)
    return np.where(scene.wall(z, clearance)[0] < -1e-6 * scene.width, came_from, z)


def outward(velocity: Points, normal: Points) -> Floats:
    """Return the outward part of velocities, 0 where they point inwards."""
    return np.maximum((velocity * normal.conj()).real, 0.0)


# --- a velocity that forgets ----------------------------------------------------------------------


def simulate_inertial(
    scene: Scene, table: ParticleTable, *, key: Keys, z: Points, velocity: Points, steps: int
) -> Path:
    """Return the path of particles whose velocity relaxes to that of the water and is stirred."""
    clearance, std, memory, rate = table.columns.T
    assert INERTIAL == ("clearance", "speed_std", "memory_time", "turn_rate")
    dt = scene.time_step
    kept = np.exp(-dt / memory)
    contact = 2.0 if scene.reflects else 1.0
    # Means of both ends diffuse too far over long times: s^2 dt / 2 coth(dt / 2 tau) for s^2 tau.
    way = np.sqrt(np.tanh(dt / (2 * memory)) / (dt / (2 * memory)))
    numbers = Numbers(key, steps)
    path = [(z, np.angle(velocity))]
    for step in range(steps):
        first, second, *_ = numbers.motion[step]
        stirred = std * np.sqrt(1 - kept**2) * (first + 1j * second)
        after = velocity * kept * np.exp(1j * rate * dt) + stirred
        came_from, z = z, z + (way * (velocity + after) / 2 + scene.water(z)) * dt
        velocity = after

        def touched(normal: Points, beyond: Mask) -> None:
            nonlocal velocity
            lost = np.where(beyond, contact * outward(velocity, normal), 0.0)
            velocity = velocity - lost * normal

        z = stay_inside(scene, clearance, came_from, z, touched)
        path.append((z, np.angle(velocity)))
    return Path(*(np.stack(column) for column in zip(*path, strict=True)))


# --- a heading, and states that take turns --------------------------------------------------------


class Columns:
    """The table of switching particles by name, one number per world."""

    def __init__(self, table: ParticleTable) -> None:
        shared, rest = np.split(table.columns.T, [len(SHARED)])
        blocks = rest.reshape(table.states, len(STATE) + table.states, -1)
        self.shared = dict(zip(SHARED, shared, strict=True))
        self.states = dict(zip(STATE, np.swapaxes(blocks, 0, 1), strict=False))
        self.start_shares = self.states["start_share"]
        self.chances = blocks[:, len(STATE) :]
        """Shape (states, states that follow, worlds)."""

    def of(self, name: str, state: npt.NDArray[np.int64]) -> Floats:
        """Return a number of the state that each world is in."""
        return np.asarray(self.states[name][state, np.arange(state.size)])


def picked(chances: Floats, uniform: Floats) -> npt.NDArray[np.int64]:
    """Return which entry of the first axis a uniform picks, chances laid one after the other."""
    return np.asarray((uniform > np.cumsum(chances, axis=0)[:-1]).sum(axis=0))


@dataclass
class Swimmer:
    """All worlds at once: where they are, and what their bouts are like."""

    z: Points
    heading: Floats
    state: npt.NDArray[np.int64]
    left: Floats
    target: Floats
    speed: Floats
    turn_rate: Floats
    slow: Floats
    phase: Floats


class Entry(NamedTuple):
    """What the beginning of a bout draws; its speed is the target except where it coasts."""

    dwell: Floats
    speed: Floats
    coasts: Mask
    turn: Floats
    turn_rate: Floats


def begun(columns: Columns, state: npt.NDArray[np.int64], numbers: Numbers, step: int) -> Entry:
    """Return what a bout in the given state draws.

    Its time is scale (-ln U)^power; its speed is log-normal about the mean with a given ratio of
    standard deviation to mean, so the logarithm has the variance ln(1 + cv^2).
    """
    uniform = numbers.bout_uniforms[step]
    for_speed, for_turn, for_rate, _ = numbers.bout[step]
    variance = np.log(1 + columns.of("speed_cv", state) ** 2)
    reverses = uniform[2] <= columns.of("reversal_share", state)
    return Entry(
        columns.of("dwell_scale", state)
        * np.maximum(-np.log(uniform[1]), 1e-8) ** columns.of("dwell_power", state),
        columns.of("speed", state) * np.exp(np.sqrt(variance) * for_speed - variance / 2),
        columns.of("coasting", state) > 0,
        columns.of("turn_std", state) * for_turn + np.pi * reverses,
        columns.of("turn_rate", state) + columns.of("turn_rate_std", state) * for_rate,
    )


def start(columns: Columns, numbers: Numbers, z: Points, heading: Floats) -> Swimmer:
    """Return the worlds in their first bout: no turn before it, and at its speed."""
    uniform = numbers.bout_uniforms[numbers.first]
    state = picked(columns.start_shares, uniform[0])
    entry = begun(columns, state, numbers, numbers.first)
    return Swimmer(
        z=z,
        heading=heading,
        state=state,
        left=entry.dwell,
        target=np.where(entry.coasts, 0.0, entry.speed),
        speed=entry.speed,
        turn_rate=entry.turn_rate,
        slow=numbers.motion[numbers.first, 0],
        phase=uniform[3] - 0.5,
    )


def change_bout(columns: Columns, one: Swimmer, numbers: Numbers, step: int) -> None:
    """Begin the next bout where the last one is over.

    Time by which a bout ended before the step did is taken from the next one.
    """
    ended = one.left <= 0
    if not ended.any():
        return
    worlds = np.arange(one.state.size)
    chances = np.moveaxis(columns.chances[one.state, :, worlds], 0, -1)
    following = picked(chances, numbers.bout_uniforms[step, 0])
    one.state = np.where(ended, following, one.state)
    entry = begun(columns, one.state, numbers, step)
    one.left = np.where(ended, one.left + entry.dwell, one.left)
    one.target = np.where(ended, np.where(entry.coasts, 0.0, entry.speed), one.target)
    one.speed = np.where(ended & entry.coasts, entry.speed, one.speed)
    one.turn_rate = np.where(ended, entry.turn_rate, one.turn_rate)
    one.heading = np.where(ended, one.heading + entry.turn, one.heading)


def felt_wall(scene: Scene, columns: Columns, one: Swimmer) -> tuple[Floats, Floats]:
    """Return the rate of turning that the wall makes, and the factor that it puts on the speed."""
    shared = columns.shared
    distance, normal = scene.wall(one.z, shared["clearance"])
    ranges = distance / np.maximum(shared["wall_range"], 1e-6)
    near = np.where(ranges < FARTHEST_RANGES, np.exp(-np.maximum(ranges, 0.0)), 0.0)
    psi = one.heading - np.angle(normal)
    gap = shared["wall_gap"]
    gaps = np.where(gap > 0, np.maximum(distance, 0.0) / np.where(gap > 0, gap, 1.0), 0.0)
    rate = shared["wall_turn"] * (1 - gaps) * np.sin(psi) + shared["wall_follow"] * np.sin(2 * psi)
    return rate * near, 1 - shared["wall_slowing"] * near


def pushed_off(scene: Scene, columns: Columns, z: Points, step: int) -> Points:
    """Return the velocity at which other bodies push, over the speed of the one that is pushed."""
    if scene.others is None:
        return np.zeros_like(z)
    reach = np.maximum(columns.shared["neighbour_range"], 1e-6)
    total = np.zeros_like(z)
    for x, y in scene.others[min(step, len(scene.others) - 1)]:
        if np.isfinite(x):
            off = z - (x + 1j * y)
            ranges = np.abs(off) / reach
            near = np.where(ranges < FARTHEST_RANGES, np.exp(-ranges), 0.0)
            total = total + columns.shared["neighbour_push"] * near * np.exp(1j * np.angle(off))
    return total


def simulate_switching(
    scene: Scene, table: ParticleTable, *, key: Keys, z: Points, heading: Floats, steps: int
) -> Path:
    """Return the path of particles that swim along a heading and switch between states."""
    columns, numbers = Columns(table), Numbers(key, steps)
    one = start(columns, numbers, z, heading)
    path = [(one.z, one.heading)]
    for step in range(steps):
        _step(scene, columns, one, numbers, step)
        path.append((one.z, one.heading))
    return Path(*(np.stack(column) for column in zip(*path, strict=True)))


def _step(scene: Scene, columns: Columns, one: Swimmer, numbers: Numbers, step: int) -> None:
    dt, shared = scene.time_step, columns.shared
    for_turn, for_slow, *for_place = numbers.motion[step]
    one.left = one.left - dt
    change_bout(columns, one, numbers, step)
    diffusion = columns.of("rotational_diffusion", one.state)
    relaxation = columns.of("relaxation_time", one.state)
    off = one.speed - one.target
    # The mean within the step, at a heading that wavers on its way: a factor 1 - D dt / 4.
    mean = (one.target + off * mean_over(dt, relaxation)) * np.exp(-diffusion * dt / 4)
    one.speed = one.target + off * kept_over(dt, relaxation)
    kept = kept_over(dt, shared["slow_time"])
    one.slow = kept * one.slow + np.sqrt(1 - kept**2) * for_slow
    one.phase = one.phase + shared["stroke_frequency"] * dt
    wall_rate, wall_factor = felt_wall(scene, columns, one)
    speed = (
        mean
        * np.exp(shared["slow_std"] * one.slow - shared["slow_std"] ** 2 / 2)
        * (1 + shared["stroke"] * np.cos(2 * np.pi * one.phase))
        * wall_factor
    )
    turn = (one.turn_rate + wall_rate) * dt + np.sqrt(2 * diffusion * dt) * for_turn
    jitter = np.sqrt(2 * shared["diffusion"] * dt) * (for_place[0] + 1j * for_place[1])
    along = np.exp(1j * (one.heading + turn / 2)) + pushed_off(scene, columns, one.z, step)
    moved = (speed * along + scene.water(one.z)) * dt + jitter
    one.heading = one.heading + turn

    def touched(normal: Points, beyond: Mask) -> None:
        # Sliding along the wall does not turn the heading.
        if scene.reflects:
            ahead = np.exp(1j * one.heading)
            thrown = ahead - 2 * outward(ahead, normal) * normal
            one.heading = np.where(beyond, np.angle(thrown), one.heading)

    one.z = stay_inside(scene, shared["clearance"], one.z, one.z + moved, touched)


def kept_over(dt: float, time: Floats) -> Floats:
    """Return the share of a number that is left after a step if it relaxes over a time.

    A time of 0 leaves nothing.
    """
    return np.where(time > 0, np.exp(-dt / np.where(time > 0, time, 1.0)), 0.0)


def mean_over(dt: float, time: Floats) -> Floats:
    """Return the mean within a step of what begins at 1 and relaxes to 0; 0 for a time of 0."""
    z = dt / np.where(time > 0, time, 1.0)
    return np.where(time > 0, -np.expm1(-z) / z, 0.0)
