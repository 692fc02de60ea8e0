"""Floating bodies in stirred tanks: rigid bodies in plain NumPy, many tanks at once.

Places, velocities and forces are complex numbers. The drag is integrated along each half of a face
by two Gauss points, where driftwalk has four strips. Steps of a millisecond take velocities first,
then places, then contacts with the wall; the force of the water is that in the middle of five.
Nothing here comes from driftwalk. The body is the square block, a disc, or two blocks glued
together (`bodies.py` of the study of bodies).
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt
from flows import AXIS, Flow
from ranges import (
    DENSITY_KG_M3,
    DEPTH_M,
    FORCE_INTERVAL_S,
    MASS_KG,
    RADIUS_M,
    REFERENCE_M_S,
    SAMPLE_S,
    SETTLING_S,
    SIDE_M,
)

Floats = npt.NDArray[np.float64]
Complexes = npt.NDArray[np.complex128]

STEP_S: Final = 1e-3
EVERY: Final = 5
"""Steps for which the force of the water is held."""
HOLD: Final = round(FORCE_INTERVAL_S / STEP_S)
PERIOD: Final = round(SAMPLE_S / STEP_S)
CHUNK: Final = 5000
"""Steps for which forces and weights are drawn at once: whole intervals and samples."""
BOUNCE_M_S: Final = 0.01
"""Slower contacts do not bounce."""
_gauss = 1.0 / np.sqrt(3.0)
_along = 0.5 * SIDE_M * (1.0 + 0.5j * np.array([-1 - _gauss, -1 + _gauss, 1 - _gauss, 1 + _gauss]))
POINTS: Final[Complexes] = np.concatenate([_along * 1j**k for k in range(4)])
"""Two Gauss points of each half of the four faces, in the block's own frame. The windward part of a
face of a turning block ends in its middle, so a pure spin has its exact drag."""
NORMALS: Final[Complexes] = np.repeat(1j ** np.arange(4), 4)
WIDTHS: Final[Floats] = np.full(16, 0.25 * SIDE_M)
CORNERS: Final[Complexes] = 0.5 * SIDE_M * (1.0 + 1j) * 1j ** np.arange(4)
_places, _weights = np.polynomial.legendre.leggauss(3)
INNER: Final[Complexes] = 0.5 * SIDE_M * np.add.outer(_places, 1j * _places).ravel()
"""3 x 3 Gauss points of the area, for means of the water's acceleration over the block. Of 2 x 2
points the moment is 5 to 20 % off in eddies as small as the block."""
SHARES: Final[Floats] = 0.25 * np.outer(_weights, _weights).ravel()
"""What they count."""


class Body(NamedTuple):
    """A rigid body, in its own frame about its centre of mass; all tanks of a call have it."""

    points: Complexes
    """Of the drag along its sides."""
    normals: Complexes
    widths: Floats
    corners: Complexes
    inner: Complexes
    """Points with the second moments of its area."""
    reach_m: float
    """Of its farthest point."""
    square_m2: float
    """Its moment of inertia is mass x this square / divisor."""
    divisor: float
    mass_kg: float = MASS_KG
    radius_m: float = 0.0
    """Of a disc: no corners, and its spin is not in the force of the water."""
    members: Complexes = np.zeros(1, dtype=np.complex128)
    """Where stochastic forces act."""
    shares: Floats = np.full(4, 0.25)
    """What the inner points count."""

    @property
    def per_inertia(self) -> float:
        """Mass over moment of inertia."""
        return self.divisor / self.square_m2


SQUARE: Final = Body(
    POINTS, NORMALS, WIDTHS, CORNERS, INNER, SIDE_M / np.sqrt(2.0), SIDE_M**2, 6.0, shares=SHARES
)


@dataclass
class Tanks:
    """Parameters of the bodies, one for each tank, and their flows."""

    flow: list[Flow]
    seed: list[int]
    start: Complexes
    drag_coefficient: Floats
    force_std: Floats
    """On each member, in the force interval [N]."""
    added_mass: Floats
    """As a share of the mass, of the moment of inertia too."""
    floating: npt.NDArray[np.bool_]
    """Whether the water's acceleration pushes the block."""
    drag_power: Floats
    force_memory: Floats
    """[s]; 0 is a white force."""
    growth: Floats
    """Of the flow's strength a second."""
    pulse: Floats
    pulse_period: Floats
    friction: Floats
    restitution: Floats
    velocity: Complexes | None = None
    """At the start, 0 where it is not given."""
    angle: Floats | None = None
    spin: Floats | None = None
    body: Body = SQUARE
    correlation: Floats | None = None
    """Of the forces on any two members of the body, 0 where it is not given."""

    def only(self, kept: npt.NDArray[np.intp]) -> Tanks:
        """Return some of the tanks."""
        values = {}
        for one in fields(self):
            value = getattr(self, one.name)
            if isinstance(value, np.ndarray):
                values[one.name] = value[kept]
            elif one.name in ("flow", "seed"):
                values[one.name] = [value[k] for k in kept]
            else:
                values[one.name] = value
        return Tanks(**values)


class Motion(NamedTuple):
    """True motion at the samples, shape (tanks, samples)."""

    place: Complexes
    velocity: Complexes
    angle: Floats
    spin: Floats
    touched: npt.NDArray[np.bool_]
    """Whether the block touched the wall since the sample before."""


def simulate(tanks: Tanks, seconds: float, *, settling: float = SETTLING_S) -> Motion:
    """Simulate blocks of flows with the same number of modes."""
    water = Water(tanks)
    state = _at_rest(tanks)
    rngs = [np.random.default_rng(seed) for seed in tanks.seed]
    n, first = len(rngs), round(settling / STEP_S)
    steps = first + round(seconds / STEP_S)
    forces = Forces(tanks, rngs)
    touched, kept = np.zeros(n, dtype=bool), []
    gain, spin_gain = np.zeros(n, dtype=complex), np.zeros(n)
    for begin in range(0, steps + 1, CHUNK):
        forces.draw()
        times = (begin + EVERY / 2 + np.arange(0, CHUNK, EVERY)) * STEP_S - settling
        weights = water.weights(times)
        for k in range(0, min(CHUNK, steps + 1 - begin), EVERY):
            step = begin + k
            if step >= first and (step - first) % PERIOD == 0:
                kept.append((state.place.copy(), state.velocity.copy(), state.angle.copy(),
                             state.spin.copy(), touched))  # fmt: skip
                touched = np.zeros(n, dtype=bool)
            if step % HOLD == 0:
                forces.change(k // HOLD)
            push, turn = forces.gains(state.angle)
            gain, spin_gain = by_water(
                state, tanks, water, weights[k // EVERY], gain + push, spin_gain + turn
            )
            touched |= move(state, tanks, gain + push, spin_gain + turn)
    return Motion(*(np.stack(part, axis=1) for part in zip(*kept, strict=True)))


class Forces:
    """The stochastic forces on the members of each body, redrawn every interval."""

    def __init__(self, tanks: Tanks, rngs: list[np.random.Generator]) -> None:
        self.tanks, self.rngs = tanks, rngs
        count, n = tanks.body.members.size, len(rngs)
        share = np.zeros(n) if tanks.correlation is None else tanks.correlation
        # Of unit variance, any two with the correlation.
        both = share[:, np.newaxis, np.newaxis] * np.ones((count, count))
        both[:, np.arange(count), np.arange(count)] = 1.0
        low, vectors = np.linalg.eigh(both)
        self.mixed = vectors * np.sqrt(np.maximum(low, 0.0))[:, np.newaxis]
        self.memory = np.exp(-FORCE_INTERVAL_S / np.maximum(tanks.force_memory, 1e-12))
        self.memory = self.memory[:, np.newaxis]
        at_start = np.sqrt((1 - self.memory) / (1 + self.memory)) * tanks.force_std[:, np.newaxis]
        self.force = at_start * self._members(1)[:, 0]
        self.mass = tanks.body.mass_kg * (1.0 + tanks.added_mass)
        self.draws = self.force[:, np.newaxis]

    def draw(self) -> None:
        """Draw the forces of a chunk of steps."""
        self.draws = self.tanks.force_std[:, np.newaxis, np.newaxis] * self._members(CHUNK // HOLD)

    def change(self, interval: int) -> None:
        """Take the forces of an interval of the chunk."""
        self.force = self.memory * self.force + (1 - self.memory) * self.draws[:, interval]

    def gains(self, angle: Floats) -> tuple[Complexes, Floats]:
        """Return the accelerations that they give."""
        body = self.tanks.body
        push = self.force.sum(axis=1) / self.mass
        if body.members.size == 1:
            return push, np.zeros(angle.size)
        arms = body.members * np.exp(1j * angle)[:, np.newaxis]
        torque = (arms.conj() * self.force).imag.sum(axis=1)
        return push, torque * body.per_inertia / self.mass

    def _members(self, count: int) -> Complexes:
        members = self.tanks.body.members.size
        found = _normal(self.rngs, count * members).reshape(len(self.rngs), count, members)
        return found if members == 1 else np.einsum("nab,ncb->nca", self.mixed, found)


@dataclass
class State:
    """Of all bodies, at one time."""

    place: Complexes
    velocity: Complexes
    angle: Floats
    spin: Floats


class Water:
    """The water of the tanks: modes, and the accelerations that pairs of them make.

    Where it carries blocks, the lattice has twice as many nodes: the spin by the acceleration goes
    with its second derivatives, and came out 2 % off between the nodes of the flow.
    """

    def __init__(self, tanks: Tanks) -> None:
        self.tanks = tanks
        modes = np.stack([flow.modes for flow in tanks.flow])
        self.modes = modes.shape[1]
        self.pairs = [(i, j) for i in range(self.modes) for j in range(i, self.modes)]
        self.carries = bool(tanks.floating.any())
        if self.carries:
            modes = halved(halved(modes, -1), -2)
        self.nodes = modes.shape[-1]
        self.spacing = float(AXIS[-1] - AXIS[0]) / (self.nodes - 1)
        layers = [modes[:, i] for i in range(self.modes)]
        if self.carries:
            layers += [
                self._carried(modes[:, i], modes[:, j])
                + (self._carried(modes[:, j], modes[:, i]) if i != j else 0.0)
                for i, j in self.pairs
            ]
        table = np.stack(layers, axis=-1)
        corners = [table, np.roll(table, -1, 2), np.roll(table, -1, 1)]
        corners.append(np.roll(corners[1], -1, 1))
        self.table = np.stack(corners, axis=3).reshape(-1, 4, table.shape[-1])
        self.base = (np.arange(len(modes)) * self.nodes**2)[:, np.newaxis]

    def _carried(self, by: Complexes, what: Complexes) -> Complexes:
        """Return (u . grad) w at the nodes."""
        return by.real * slope(what, -1, self.spacing) + by.imag * slope(what, -2, self.spacing)

    def weights(self, time: Floats) -> Floats:
        """Return weights and their rates, shape (times, 2, tanks, modes)."""
        t, tanks = time[:, np.newaxis], self.tanks
        turn = 2.0 * np.pi / tanks.pulse_period
        strength = 1.0 + tanks.growth * t + tanks.pulse * np.sin(turn * t)
        rate = tanks.growth + tanks.pulse * turn * np.cos(turn * t)
        period = np.array([flow.period_s for flow in tanks.flow])
        phase, pace = 2.0 * np.pi * t / period, 2.0 * np.pi / period
        shape = [np.ones_like(phase), np.sin(phase), np.cos(phase)][: self.modes]
        change = [np.zeros_like(phase), pace * np.cos(phase), -pace * np.sin(phase)][: self.modes]
        weight = np.stack([strength * part for part in shape], axis=-1)
        rates = [rate * part + strength * moved for part, moved in zip(shape, change, strict=True)]
        return np.stack([weight, np.stack(rates, axis=-1)], axis=1)

    def layers(self, place: Complexes) -> Complexes:
        """Return all layers at places of each tank, shape (tanks, places, layers)."""
        column = np.clip((place.real - AXIS[0]) / self.spacing, 0.0, self.nodes - 1.001)
        row = np.clip((place.imag - AXIS[0]) / self.spacing, 0.0, self.nodes - 1.001)
        i, j = column.astype(np.intp), row.astype(np.intp)
        fx, fy = column - i, row - j
        shares = ((1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy)
        found = self.table.take(self.base + j * self.nodes + i, axis=0)
        return sum(share[..., np.newaxis] * found[:, :, k] for k, share in enumerate(shares))

    def velocity(self, layers: Complexes, weight: Floats) -> Complexes:
        """Return the velocity of the water, from its layers."""
        return np.einsum("npm,nm->np", layers[..., : self.modes], weight)

    def acceleration(self, layers: Complexes, weight: Floats, rate: Floats) -> Complexes:
        """Return its acceleration Du/Dt."""
        total = np.einsum("npm,nm->np", layers[..., : self.modes], rate)
        for k, (i, j) in enumerate(self.pairs):
            both = (weight[:, i] * weight[:, j])[:, np.newaxis]
            total = total + both * layers[..., self.modes + k]
        return total


def by_water(
    state: State, tanks: Tanks, water: Water, weights: Floats, gain: Complexes, spin_gain: Floats
) -> tuple[Complexes, Floats]:
    """Return what the water does to velocity and spin, `EVERY` / 2 steps from now."""
    half = 0.5 * EVERY * STEP_S
    velocity, spin = state.velocity + half * gain, state.spin + half * spin_gain
    place = (state.place + half * velocity)[:, np.newaxis]
    body, turned = tanks.body, np.exp(1j * (state.angle + half * spin))[:, np.newaxis]
    if body.radius_m:
        turned = np.ones_like(turned)
    mass = body.mass_kg * (1.0 + tanks.added_mass)
    arms = body.points * turned
    flow = water.velocity(water.layers(place + arms), weights[0])
    push, torque = drag(tanks, flow, turned, arms, velocity, spin)
    found, turning = push / mass, torque / (mass * body.square_m2 / body.divisor)
    if water.carries:
        arms = body.inner * turned
        here = water.acceleration(water.layers(place + arms), *weights)
        found = found + tanks.floating * (here @ body.shares)
        curl = (arms.conj() * here).imag @ body.shares / (body.square_m2 / body.divisor)
        turning = turning + tanks.floating * curl
    return found, turning


def drag(
    tanks: Tanks, flow: Complexes, turned: Complexes, arms: Complexes, velocity: Complexes,
    spin: Floats,
) -> tuple[Complexes, Floats]:  # fmt: skip
    """Return force and torque of the water on the windward sides."""
    body, turning = tanks.body, spin[:, np.newaxis]
    slip = flow - velocity[:, np.newaxis]
    if not body.radius_m:
        slip = slip - 1j * turning * arms
    facing = np.maximum(-((body.normals * turned).conj() * slip).real, 0.0)
    scale = (0.5 * DENSITY_KG_M3 * DEPTH_M) * tanks.drag_coefficient[:, np.newaxis]
    size = scale * body.widths * facing
    if np.any(tanks.drag_power != 2.0):
        size *= (np.abs(slip) / REFERENCE_M_S + 1e-9) ** (tanks.drag_power[:, np.newaxis] - 2.0)
    along = size * slip
    if body.radius_m:
        rubbing = (arms.conj() * slip).imag - turning * body.radius_m**2
        return along.sum(axis=1), (size * rubbing).sum(axis=1)
    return along.sum(axis=1), (arms.conj() * along).imag.sum(axis=1)


def move(state: State, tanks: Tanks, gain: Complexes, spin_gain: Floats) -> npt.NDArray[np.bool_]:
    """Make `EVERY` steps in place, all at once off the wall; return which blocks touched it."""
    time, twice = EVERY * STEP_S, 0.5 * EVERY * (EVERY + 1) * STEP_S**2
    margin = tanks.body.reach_m + time * np.abs(state.velocity) + 1e-4
    near = np.flatnonzero(np.abs(state.place) > RADIUS_M - margin)
    parts = [part[near] for part in (state.place, state.velocity, state.angle, state.spin)]
    state.place += time * state.velocity + twice * gain
    state.velocity += time * gain
    state.angle += time * state.spin + twice * spin_gain
    state.spin += time * spin_gain
    touched = np.zeros(state.place.size, dtype=bool)
    if not near.size:
        return touched
    some = State(*parts)
    for _ in range(EVERY):
        some.velocity += STEP_S * gain[near]
        some.spin += STEP_S * spin_gain[near]
        some.place += STEP_S * some.velocity
        some.angle += STEP_S * some.spin
        touched[near] |= meet_wall(some, tanks.friction[near], tanks.restitution[near], tanks.body)
    state.place[near], state.velocity[near] = some.place, some.velocity
    state.angle[near], state.spin[near] = some.angle, some.spin
    return touched


def meet_wall(
    state: State, friction: Floats, restitution: Floats, body: Body
) -> npt.NDArray[np.bool_]:
    """Let corners beyond the circle bounce and rub, and put them back; return which did."""
    if body.radius_m:
        arms = (body.radius_m * state.place / np.abs(state.place))[:, np.newaxis]
    else:
        arms = body.corners * np.exp(1j * state.angle)[:, np.newaxis]
    beyond = np.abs(state.place[:, np.newaxis] + arms) > RADIUS_M
    touched = beyond.any(axis=1)
    if touched.any():
        for k, corner in zip(*np.nonzero(beyond), strict=True):
            bounce(
                state, int(k), complex(arms[k, corner]), friction[k], restitution[k],
                body.per_inertia,
            )  # fmt: skip
    return touched


def bounce(
    state: State, k: int, arm: complex, friction: float, restitution: float, per_inertia: float
) -> None:
    """Let one corner of one body meet the wall, by impulses along it and across."""
    place, velocity, spin = complex(state.place[k]), complex(state.velocity[k]), state.spin[k]
    away = abs(place + arm)
    if away <= RADIUS_M:
        return
    normal = (place + arm) / away
    turned = arm.conjugate() * normal
    lever, reach = turned.imag, turned.real
    closing = ((velocity + 1j * spin * arm) * normal.conjugate()).real
    if closing > 0.0:
        share = 1.0 + (restitution if closing > BOUNCE_M_S else 0.0)
        push = closing * share / (1.0 + per_inertia * lever**2)
        velocity -= push * normal
        spin -= push * lever * per_inertia
        sliding = ((velocity + 1j * spin * arm) * normal.conjugate()).imag
        stop = -sliding / (1.0 + per_inertia * reach**2)
        rub = min(max(stop, -friction * push), friction * push)
        velocity += rub * 1j * normal
        spin += rub * reach * per_inertia
    state.place[k] = place - normal * (away - RADIUS_M)
    state.velocity[k], state.spin[k] = velocity, spin


def halved(values: Complexes, axis: int) -> Complexes:
    """Return values with one in the middle of any two along an axis, by cubics of the four nearest.

    At the ends, outside of the tank, it is their mean.
    """
    values = np.moveaxis(values, axis, 0)
    found = np.repeat(values, 2, axis=0)[:-1]
    found[1::2] = 0.5 * (values[1:] + values[:-1])
    found[3:-3:2] = (9.0 * (values[1:-2] + values[2:-1]) - values[:-3] - values[3:]) / 16.0
    return np.moveaxis(found, 0, axis)


def slope(values: Complexes, axis: int, spacing: float) -> Complexes:
    """Return the derivative along an axis, by quartics of the five nearest; at the ends by two."""
    found = np.moveaxis(np.gradient(values, spacing, axis=axis), axis, 0)
    values = np.moveaxis(values, axis, 0)
    inner = 8.0 * (values[3:-1] - values[1:-3]) - values[4:] + values[:-4]
    found[2:-2] = inner / (12.0 * spacing)
    return np.moveaxis(found, 0, axis)


def _at_rest(tanks: Tanks) -> State:
    n = tanks.start.size
    return State(
        tanks.start.astype(complex),
        np.zeros(n, complex) if tanks.velocity is None else tanks.velocity.astype(complex),
        np.zeros(n) if tanks.angle is None else tanks.angle.astype(float),
        np.zeros(n) if tanks.spin is None else tanks.spin.astype(float),
    )


def _normal(rngs: list[np.random.Generator], count: int) -> Complexes:
    return np.stack([rng.normal(size=(count, 2)) @ [1.0, 1j] for rng in rngs])
