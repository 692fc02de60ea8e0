"""The NumPy twin of the native core: the same model, written plainly, for reading and for tests.

Same equations, same random numbers, float64, one face and contact at a time, vectorised over worlds
and strips only. It is slow and is no product: results come from the native core, which is held
against this page. The two agree to rounding as long as a path is not chaotic, and in distribution
after. The twin of the self-assembly kernel takes its drag, random numbers and impulses from here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from driftwalk.core.random_streams import Purpose

Floats = npt.NDArray[np.float64]

_MULTIPLIERS = (np.uint64(0xD2511F53), np.uint64(0xCD9E8D57))
_WEYL = (np.uint64(0x9E3779B9), np.uint64(0xBB67AE85))
_LOW = np.uint64(0xFFFFFFFF)


@dataclass(frozen=True)
class TwinModel:
    """Everything the twin needs, SI units."""

    side: float
    mass: float
    depth: float
    strips: int
    water_density: float
    radius: float
    restitution: float
    friction: float
    bounce_speed: float
    time_step: float
    steps_per_interval: int
    flow_x: Floats
    flow_y: Floats
    flow_u: Floats
    flow_v: Floats
    added_mass_share: float = 0.0
    displaced_mass: float = 0.0
    linear_drag: float = 0.0
    drag_power: float = 2.0
    drag_speed: float = 0.03
    force_memory: float = 0.0
    width: float | None = None  # second side of a rectangle

    @property
    def half(self) -> Floats:
        """Half of both sides [m], along the block's own x and y."""
        return np.array([self.side, self.width or self.side]) / 2

    @property
    def inertia(self) -> float:
        """Moment of inertia about the vertical [kg m^2]."""
        return self.mass * float((self.half**2).sum()) / 3

    @property
    def turning(self) -> float:
        """Mean squared distance of the sides from the centre [m^2]; of a rectangle, its strips'."""
        if self.width is None:
            return self.side**2 / 3
        squares = [((self.half[face] ** 2 + self.places(face) ** 2).mean()) for face in (0, 1)]
        return float(np.average(squares, weights=self.half[::-1]))

    def places(self, face: int) -> Floats:
        """Return the middles of the strips along a face [m], shape (strips,)."""
        return self.half[1 - face % 2] * ((2 * np.arange(self.strips) + 1) / self.strips - 1)

    @property
    def moved(self) -> Floats:
        """Mass, mass and moment of inertia of all that moves with the block, shape (3,)."""
        return (1 + self.added_mass_share) * np.array([self.mass, self.mass, self.inertia])


def philox(
    key: npt.NDArray[np.uint64], counter: tuple[int, npt.ArrayLike, int, int]
) -> list[Floats]:
    """Return the four words of Philox 4x32-10 for every key, as uint64 arrays below 2**32."""
    c0, c1, c2, c3 = (np.full(key.shape, word, dtype=np.uint64) for word in counter)
    k0, k1 = key & _LOW, key >> np.uint64(32)
    for _ in range(10):
        first, second = _MULTIPLIERS[0] * c0, _MULTIPLIERS[1] * c2
        c0, c1, c2, c3 = (
            (second >> np.uint64(32)) ^ c1 ^ k0,
            second & _LOW,
            (first >> np.uint64(32)) ^ c3 ^ k1,
            first & _LOW,
        )
        k0, k1 = (k0 + _WEYL[0]) & _LOW, (k1 + _WEYL[1]) & _LOW
    return [c0, c1, c2, c3]  # type: ignore[list-item]


def normal_pair(word0: Floats, word1: Floats) -> tuple[Floats, Floats]:
    """Return two standard normals per pair of words (Box-Muller, 24-bit uniforms)."""
    first, second = word0.astype(np.uint64), word1.astype(np.uint64)
    uniform = ((first >> np.uint64(8)).astype(np.float64) + 1.0) * 2.0**-24
    quadrant = (second >> np.uint64(30)).astype(np.float64)
    rest = ((second >> np.uint64(8)) & np.uint64(0x3FFFFF)).astype(np.float64) * 2.0**-22 - 0.5
    radius = np.sqrt(-2.0 * np.log(uniform))
    angle = (quadrant + rest) * (np.pi / 2.0)
    return radius * np.cos(angle), radius * np.sin(angle)


def force_normals(
    key: npt.NDArray[np.uint64], interval: int, body: npt.ArrayLike = 0
) -> tuple[Floats, Floats]:
    """Return the two standard normals of a force interval; one Philox block serves two.

    `body` is the block's number within its world, one for all keys or one for each.
    """
    words = philox(key, (interval >> 1 & 0xFFFFFFFF, body, interval >> 33, Purpose.FORCE))
    half = 2 * (interval & 1)
    return normal_pair(words[half], words[half + 1])


def next_force(model: TwinModel, last: Floats | None, normals: Floats) -> Floats:
    """Return the force of an interval, over sigma_F, from the last one and fresh normals.

    A force that remembers keeps a part of the last one. The first has the spread of all others.
    """
    if model.force_memory == 0:
        return normals
    kept = np.exp(-model.steps_per_interval * model.time_step / model.force_memory)
    if last is None:
        return np.asarray(np.sqrt((1 - kept) / (1 + kept)) * normals)
    return np.asarray(kept * last + (1 - kept) * normals)


def flow_at(model: TwinModel, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return the bilinear flow [m/s] at points [m], the edge's value beyond the grid."""
    return _bilinear(model, (model.flow_u, model.flow_v), x, y)


def water_acceleration(model: TwinModel, pose: Floats) -> Floats:
    """Return (u . grad) u averaged over a block, and its spin, shape (3, worlds).

    The averages are those of the 3 x 3 Gauss points of the block.
    """
    dx, dy = (axis[1] - axis[0] for axis in (model.flow_x, model.flow_y))
    nodes = [
        model.flow_u * np.gradient(values, dx, axis=1)
        + model.flow_v * np.gradient(values, dy, axis=0)
        for values in (model.flow_u, model.flow_v)
    ]
    x, y, theta = pose
    total = np.zeros((3, x.size))
    places, weights = np.polynomial.legendre.leggauss(3)
    for across, first in zip(model.half[0] * places, weights / 2, strict=True):
        for along, second in zip(model.half[1] * places, weights / 2, strict=True):
            arm_x = across * np.cos(theta) - along * np.sin(theta)
            arm_y = across * np.sin(theta) + along * np.cos(theta)
            u, v = _bilinear(model, (nodes[0], nodes[1]), x + arm_x, y + arm_y)
            spin = model.mass / model.inertia * (arm_x * v - arm_y * u)
            total += first * second * np.stack([u, v, spin])
    return total


def push_of_water(model: TwinModel, pose: Floats) -> Floats:
    """Return the force [N] and torque [N m] of the water's own acceleration, shape (3, worlds)."""
    if model.displaced_mass == 0:
        return np.zeros((3, pose.shape[1]))
    own = np.array([1, 1, model.inertia / model.mass]) * model.displaced_mass
    added = model.added_mass_share * np.array([model.mass, model.mass, model.inertia])
    return np.asarray((own + added)[:, None] * water_acceleration(model, pose))


def _bilinear(
    model: TwinModel, nodes: tuple[Floats, Floats], x: Floats, y: Floats
) -> tuple[Floats, Floats]:
    dx = (model.flow_x[-1] - model.flow_x[0]) / (model.flow_x.size - 1)
    dy = (model.flow_y[-1] - model.flow_y[0]) / (model.flow_y.size - 1)
    column = np.clip((x - model.flow_x[0]) / dx, 0, model.flow_x.size - 1)
    row = np.clip((y - model.flow_y[0]) / dy, 0, model.flow_y.size - 1)
    i = np.minimum(column.astype(int), model.flow_x.size - 2)
    j = np.minimum(row.astype(int), model.flow_y.size - 2)
    fx, fy = column - i, row - j
    step = max(np.abs(values).max() for values in nodes) / 32767 or 1.0
    parts = []
    for values in nodes:
        a, b, c, d = (
            np.round(values[row, column] / step) * step
            for row, column in ((j, i), (j, i + 1), (j + 1, i), (j + 1, i + 1))
        )
        parts.append((a * (1 - fx) + b * fx) * (1 - fy) + (c * (1 - fx) + d * fx) * fy)
    return parts[0], parts[1]


def drag(
    model: TwinModel,
    drag_coefficient: Floats,
    pose: Floats,
    motion: Floats,
    hidden: npt.NDArray[np.bool_] | None = None,
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return force x, y [N], torque [N m] and conductance [kg/s], summed face by face (Eq. 2).

    A face that is `hidden`, shape (4, worlds), adds nothing to any of them.
    """
    x, y, theta = pose
    vx, vy, omega = motion
    force_x, force_y, torque, conductance = (np.zeros_like(x) for _ in range(4))
    for face in range(4):
        half, offset = model.half[face % 2], model.places(face)[:, None]
        width = 2 * model.half[1 - face % 2] / model.strips
        scale = 0.5 * model.water_density * drag_coefficient * width * model.depth
        angle = theta + face * np.pi / 2
        normal_x, normal_y = np.cos(angle), np.sin(angle)
        arm_x = half * normal_x - offset * normal_y
        arm_y = half * normal_y + offset * normal_x
        u, v = flow_at(model, x + arm_x, y + arm_y)
        relative_x = u - (vx - omega * arm_y)
        relative_y = v - (vy + omega * arm_x)
        facing = np.maximum(0.0, -(normal_x * relative_x + normal_y * relative_y))
        speed = np.maximum(np.hypot(relative_x, relative_y) / model.drag_speed, 1e-9)
        own = scale * facing * speed ** (model.drag_power - 2.0)
        own += model.linear_drag * width / (4 * model.half.sum())
        if hidden is not None:
            own = np.where(hidden[face], 0.0, own)
        strip_x, strip_y = own * relative_x, own * relative_y
        force_x += strip_x.sum(axis=0)
        force_y += strip_y.sum(axis=0)
        torque += (arm_x * strip_y - arm_y * strip_x).sum(axis=0)
        conductance += own.sum(axis=0)
    return force_x, force_y, torque, conductance


def simulate_reference(
    model: TwinModel,
    *,
    drag_coefficient: Floats,
    force_std: Floats,
    key: npt.NDArray[np.uint64],
    pose: Floats,
    motion: Floats,
    steps: int,
) -> Floats:
    """Return the poses after 0 .. steps time steps, shape (steps + 1, 3, worlds)."""
    pose, motion = pose.astype(np.float64), motion.astype(np.float64)
    before = np.zeros_like(motion)
    per_mass = 1 / model.moved[:, None]
    dt = model.time_step
    spread = np.array([1.0, 1.0, model.turning])[:, None]
    pose, motion, _ = meet_circle(model, pose, motion)
    path = [pose]
    noise = np.zeros_like(motion)
    force: Floats | None = None
    for step in range(steps):
        if step % model.steps_per_interval == 0:
            normals = np.stack(force_normals(key, step // model.steps_per_interval))
            force = next_force(model, force, normals)
            noise[:2] = force * force_std * per_mass[0]
        ahead = motion + dt / 2 * (before + noise)
        middle = pose + dt / 4 * (motion + ahead)
        force_x, force_y, torque, conductance = drag(model, drag_coefficient, middle, ahead)
        pushed = np.stack([force_x, force_y, torque]) + push_of_water(model, middle)
        acceleration = pushed * per_mass
        damping = 1 + dt / 2 * spread * per_mass * conductance
        mean = ahead + dt / 2 * (acceleration - before) / damping
        after = 2 * mean - motion
        before = (after - motion) / dt - noise
        pose, motion = pose + dt * mean, after
        pose, motion, touched = meet_circle(model, pose, motion)
        before = np.where(touched, 0.0, before)
        pose = np.stack([pose[0], pose[1], np.pi - np.mod(np.pi - pose[2], 2 * np.pi)])
        path.append(pose)
    return np.stack(path)


def meet_circle(
    model: TwinModel, pose: Floats, motion: Floats
) -> tuple[Floats, Floats, npt.NDArray[np.bool_]]:
    """Resolve the impacts on a circular wall, one world at a time; say which worlds touched it."""
    pose, motion = pose.copy(), motion.copy()
    touched = np.zeros(pose.shape[1], dtype=bool)
    for world in range(pose.shape[1]):
        corners = _corner_arms(model, pose[2, world])
        distance = np.hypot(*(pose[:2, world, None] + corners))
        order = np.argsort(-distance)
        if not distance[order[0]] > model.radius:
            continue
        touched[world] = True
        contacts = [_contact(model, pose[:2, world], corners[:, k]) for k in order[:2]]
        motion[:, world] = _resolve(model, contacts, motion[:, world])
        for _, arm in contacts:
            normal, depth = _normal(model, pose[:2, world], arm)
            pose[:2, world] -= normal * max(depth, 0.0)
    return pose, motion, touched


def _corner_arms(model: TwinModel, theta: float) -> Floats:
    angles = theta + np.pi / 4 + np.arange(4) * np.pi / 2
    return np.asarray(model.side / np.sqrt(2) * np.stack([np.cos(angles), np.sin(angles)]))


def _normal(model: TwinModel, centre: Floats, arm: Floats) -> tuple[Floats, float]:
    corner = centre + arm
    distance = float(np.hypot(*corner))
    return corner / distance, distance - model.radius


def _contact(model: TwinModel, centre: Floats, arm: Floats) -> tuple[Floats, Floats]:
    normal, depth = _normal(model, centre, arm)
    return np.array([*normal, depth]), arm


def _jacobian(direction: Floats, arm: Floats) -> Floats:
    return np.array([direction[0], direction[1], arm[0] * direction[1] - arm[1] * direction[0]])


def _resolve(model: TwinModel, contacts: list[tuple[Floats, Floats]], motion: Floats) -> Floats:
    return resolve_contacts(
        normals=np.array([_jacobian(contact[:2], arm) for contact, arm in contacts]),
        tangents=np.array([_jacobian(np.array([-c[1], c[0]]), arm) for c, arm in contacts]),
        depths=np.array([contact[2] for contact, _ in contacts]),
        inverse_mass=np.array([1.0, 1.0, model.mass / model.inertia]),
        motion=motion,
        restitution=model.restitution,
        friction=model.friction,
        bounce_speed=model.bounce_speed,
    )


def resolve_contacts(
    *,
    normals: Floats,
    tangents: Floats,
    depths: Floats,
    inverse_mass: Floats,
    motion: Floats,
    restitution: float,
    friction: float,
    bounce_speed: float,
) -> Floats:
    """Return the motion after the impulses of one or two contacts.

    Row k of `normals` times the motion is the speed at which contact k closes, row k of `tangents`
    the speed at which it slides; contacts of positive depth can push.
    """
    speeds = normals @ motion
    active = (depths > 0) & (speeds > 0)
    bounce = np.where(speeds > bounce_speed, restitution, 0.0)
    wanted = np.where(active, speeds * (1 + bounce), 0.0)
    pushes = _normal_impulses(normals, inverse_mass, wanted, bool(active.all()))
    for row, push in zip(normals, pushes, strict=True):
        motion = motion - inverse_mass * row * push
    for row, push in zip(tangents, pushes, strict=True):
        motion = _rub(friction, row, inverse_mass, motion, push)
    for depth, row, tangent in zip(depths, normals, tangents, strict=True):
        left = max(float(row @ motion), 0.0) if depth > 0 else 0.0
        push = left / float(row @ (inverse_mass * row))
        motion = motion - inverse_mass * row * push
        motion = _rub(friction, tangent, inverse_mass, motion, push)
    return motion


def _normal_impulses(rows: Floats, inverse_mass: Floats, wanted: Floats, joint: bool) -> Floats:
    matrix = (rows * inverse_mass) @ rows.T
    # Two contacts at one point are one: on some processors their matrix is exactly singular.
    if joint and np.linalg.det(matrix) != 0.0:
        both = np.linalg.solve(matrix, wanted)
        if (both > 0).all():
            return np.asarray(both)
    alone = wanted / np.diag(matrix)
    return np.where(np.arange(alone.size) == np.argmax(alone), alone, 0.0)


def _rub(friction: float, row: Floats, inverse_mass: Floats, motion: Floats, push: float) -> Floats:
    stop = -float(row @ motion) / float(row @ (inverse_mass * row))
    limit = friction * push
    return np.asarray(motion + inverse_mass * row * min(max(stop, -limit), limit))
