"""The NumPy twin of the self-assembly kernel: the same rules, written plainly, for tests.

One world at a time, float64, the same random numbers as the native core. Drag, random numbers and
the algebra of impulses are those of the one-block twin (`twin.block`). It is
slow and is no product: results come from the native core, which is held against these pages. The
two agree to rounding until a collision amplifies it, and in distribution after.

    body      a rigid assembly of blocks on a lattice
    wall      assemblies against the wall
    contacts  blocks against blocks: overlap, impulses, shifts
    latch     which faces join, and the body that they make
    bonds     which bonds break, and the bodies that they leave
    pull      forces between blocks at a distance

The twin decides cases that the rules leave open:

* Steps of events, of the first contact and of the end count completed steps: time = step * dt.
* A world is complete by a merge. A world of one block has none and runs to its last step; so does
  every world that is sampled, and `end_step` is then the last step. * The start is taken as it is:
what overlaps or stands beyond the wall is settled in the first step. * An overlapping pair counts
as touched whether or not an impulse was needed, as at the wall. Assemblies that only the separation
moves keep their drag memory: no impulse changed their motion.
* Pairs collide one after another, each with both its passes of impulses, as a block at the wall.
  Of two contact points the later one, counter-clockwise on its block, comes first.
* Further rounds at the wall, and rounds of the separation, move what is beyond their tolerance and
  leave the rest.
* A merged assembly is shifted inward by its outermost corner, one at a time; so are, four corners
  at most, two assemblies that the separation has just pushed apart.
* The separation only shifts for 10 rounds; for 30 more it turns as well, by impulses of position at
  the contact points.
* An assembly that overlaps or is outside by more than 0.1 mm even then, or after the rounds at the
  wall, is jammed: it returns to its place before the step, at rest, and so do assemblies that
  overlap it there. No merge may therefore overlap a third assembly where it was before the step.
* Where two axes of overlap are equally deep the first of (first block's x, y, second block's x, y)
  is the normal; the face of its owner is the reference face.
* The lattice of a merged assembly is the staying one's, cells not renumbered.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.lattice.joined_faces import FaceTable
from driftwalk.assembly.pull.force_tables import BlockPull, block_pull
from driftwalk.core.errors import InputError
from driftwalk.simulation.backend import wall_edges
from twin.block import TwinModel, drag, force_normals, next_force, push_of_water
from twin.body import Assembly, Floats, Shape, cross, single_block, wrapped
from twin.bonds import CLOSING, JOINING, Bonds, break_bonds, faces_between
from twin.contacts import collide, overlapping_pairs, separate
from twin.faces import Faces
from twin.latch import Joined, Latch, Latching, candidates, latch_once
from twin.pull import pull_of_blocks
from twin.wall import Wall, meet_wall

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

HiddenFaceDrag = Literal["none", "full"]


@dataclass(frozen=True)
class Rules:
    """All that the worlds of a study have in common, SI units."""

    model: TwinModel
    wall: Wall
    bounds: Floats  # low x, high x, low y, high y of the arena
    latch: Latch
    drag_coefficient: float
    hidden_face_drag: HiddenFaceDrag
    block_restitution: float
    block_friction: float
    pull: BlockPull | None = None

    @property
    def shape(self) -> Shape:
        """The block, with the mass that it carries along."""
        return Shape(self.model.side, float(self.model.moved[0]), self.model.width)


class Event(NamedTuple):
    """Two faces joined at the end of a step; side 0 stayed, side 1 was moved."""

    step: int
    blocks: tuple[int, int]
    faces: tuple[int, int]
    kind: int = JOINING


@dataclass
class World:
    """Blocks in a tank; `step` counts the completed time steps."""

    rules: Rules
    assemblies: list[Assembly]
    step: int = 0
    events: list[Event] = field(default_factory=list)
    first_contact_step: int = -1
    bonds: Bonds | None = None

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return sum(body.size for body in self.assemblies)

    @property
    def complete(self) -> bool:
        """Whether a merge has left one assembly."""
        return len(self.assemblies) == 1 and bool(self.events) and self.bonds is None

    def gather(self, name: str) -> npt.NDArray[Any]:
        """Return `pose`, `cell`, `quarter` or `assembly` (lowest block), one entry per block."""
        of: dict[str, Any] = {
            "pose": lambda body: body.block_poses(),
            "cell": lambda body: body.cells.astype(np.int32),
            "quarter": lambda body: body.quarters.astype(np.int32),
            "assembly": lambda body: np.full(body.size, min(body.blocks), dtype=np.int32),
        }
        order = np.argsort([block for body in self.assemblies for block in body.blocks])
        return np.asarray(np.concatenate([of[name](body) for body in self.assemblies])[order])


def assemble_reference(
    study: Study,
    flow: xr.Dataset,
    *,
    start: npt.ArrayLike,
    key: int,
    drag_coefficient: float,
    force_std: float,
    steps: int,
    latching: Latching,
    connector_distance: float,
    connector_axis: float,
    hidden_face_drag: HiddenFaceDrag,
    block_restitution: float,
    block_friction: float,
    faces: FaceTable | None = None,
    sample_every: int = 0,
    bond_rate: float = 0.0,
    relatch_clearance: float = 1.25,
) -> dict[str, Any]:
    """Simulate the self-assembly of one world.

    Parameters
    ----------
    study : Study
        Block, tank, water, the two times, what [forces] adds to the paper's law, and
        [interaction], without fixed poles; the rest is not read.
    flow : xarray.Dataset
        A steady `flow_field`.
    start : array_like, shape (blocks, 3)
        Poses at the start [m, m, rad]; the blocks are at rest.
    key : int
        Random key of the world, 64 bits.
    drag_coefficient, force_std : float
        C_d [1] and sigma_F [N].
    steps : int
        Time steps, at least 0.
    latching : {"none", "collision", "connector"}
        When faces join: never, on contact, within the connector's tolerances.
    connector_distance, connector_axis : float
        Tolerances of a connector [m], [rad].
    hidden_face_drag : {"none", "full"}
        Whether faces inside an assembly feel the water.
    block_restitution, block_friction : float
        Of collisions between blocks [1].
    faces : FaceTable, optional
        Rules of typed faces.
    sample_every : int, optional
        Steps between samples of the path; 0: none, and a complete world ends early.
    bond_rate, relatch_clearance : float
        Rate at which each bond breaks [1/s], 0: never, and the distance of the centres of what
        has parted from which it latches again [side].

    Returns
    -------
    dict
        The entries of the native core's row: ``event_step`` (E,), ``event_block`` and
        ``event_face`` (E, 2), ``event_count``, ``first_contact_step``, ``end_step``, ``pose``
        (blocks, 3), ``cell`` (blocks, 2), ``quarter`` and ``assembly`` (blocks,); with samples
        also ``sample_pose`` (S, blocks, 3) and ``sample_assembly`` (S, blocks). E is blocks - 1,
        at least 1; what did not happen is -1.

    Raises
    ------
    InputError
        When the flow changes in time.

    Examples
    --------
    >>> import driftwalk as dw
    >>> run = assemble_reference(
    ...     dw.Study(), dw.uniform_flow(0.0, 0.0), start=[[-0.0149, 0, 0], [0.0149, 0, 0]], key=1,
    ...     drag_coefficient=0.45, force_std=0.0, steps=1, latching="collision",
    ...     connector_distance=0.0, connector_axis=0.0, hidden_face_drag="none",
    ...     block_restitution=0.5, block_friction=0.0)
    >>> run["event_count"], run["event_block"].tolist(), run["event_face"].tolist()
    (1, [[0, 1]], [[0, 2]])
    """
    rules = make_rules(
        study,
        flow,
        latch=Latch(
            latching,
            connector_distance,
            connector_axis,
            None if faces is None else Faces(faces, faces.first_kinds(len(start)).tolist()),
        ),
        drag_coefficient=drag_coefficient,
        hidden_face_drag=hidden_face_drag,
        block_restitution=block_restitution,
        block_friction=block_friction,
    )
    world = start_world(rules, np.asarray(start, dtype=np.float64))
    if bond_rate > 0:
        world.bonds = Bonds(key, bond_rate, relatch_clearance)
    samples = [world.gather("pose")]
    sample_assemblies = [world.gather("assembly")]
    force: Floats | None = None
    for step in range(steps):
        if world.complete and not sample_every:
            break
        interval, within = divmod(step, rules.model.steps_per_interval)
        if within == 0 or force is None:
            force = next_force(rules.model, force, block_normals(key, interval, world.blocks))
        advance(world, force_std * force)
        if sample_every and world.step % sample_every == 0:
            samples.append(world.gather("pose"))
            sample_assemblies.append(world.gather("assembly"))
    row = _row(world)
    if sample_every:
        row["sample_pose"] = np.stack(samples).astype(np.float32)
        row["sample_assembly"] = np.stack(sample_assemblies)
    return row


def make_rules(
    study: Study,
    flow: xr.Dataset,
    *,
    latch: Latch,
    drag_coefficient: float,
    hidden_face_drag: HiddenFaceDrag,
    block_restitution: float,
    block_friction: float,
) -> Rules:
    """Return the rules of a study's worlds; parameters as of `assemble_reference`."""
    if "time" in flow["u"].dims:
        raise InputError("the NumPy twin needs a steady flow; take one frame, flow.isel(time=0)")
    tank = study.tank
    radius = tank.radius_m or 0.0
    x, y = np.array(tank.corners_m or [(-radius, -radius), (radius, radius)]).T
    wall = Wall(
        radius, wall_edges(tank), tank.wall_restitution, tank.wall_friction, tank.bounce_speed_m_s
    )
    model = TwinModel(
        side=study.block.side_m,
        width=study.block.width_m,
        mass=study.block.mass_kg,
        depth=study.wetted_depth_m,
        strips=study.block.strips_per_face,
        water_density=study.water.density_kg_m3,
        radius=wall.radius,
        restitution=wall.restitution,
        friction=wall.friction,
        bounce_speed=wall.bounce_speed,
        time_step=study.time_step_s,
        steps_per_interval=round(study.forces.force_interval_s / study.time_step_s),
        flow_x=np.asarray(flow["x"].values, dtype=np.float64),
        flow_y=np.asarray(flow["y"].values, dtype=np.float64),
        flow_u=np.asarray(flow["u"].values, dtype=np.float64),
        flow_v=np.asarray(flow["v"].values, dtype=np.float64),
        added_mass_share=study.forces.added_mass_share,
        displaced_mass=study.displaced_mass_kg if study.forces.pressure_gradient else 0.0,
        linear_drag=study.forces.linear_drag_kg_s,
        drag_power=study.forces.drag_power,
        drag_speed=study.forces.drag_speed_m_s,
        force_memory=study.forces.force_memory_s,
    )
    return Rules(
        model,
        wall,
        np.array([x.min(), x.max(), y.min(), y.max()]),
        latch,
        drag_coefficient,
        hidden_face_drag,
        block_restitution,
        block_friction,
        block_pull(study),
    )


def start_world(rules: Rules, start: Floats) -> World:
    """Return blocks at rest at poses (blocks, 3) [m, m, rad]."""
    return World(rules, [single_block(rules.shape, k, pose) for k, pose in enumerate(start)])


def block_normals(key: int, interval: int, blocks: int) -> Floats:
    """Return the two standard normals of every block in a force interval, shape (blocks, 2)."""
    keys = np.full(blocks, key, dtype=np.uint64)
    return np.stack(force_normals(keys, interval, np.arange(blocks)), axis=1)


def advance(world: World, force: Floats) -> None:
    """Take one time step under the stochastic forces (blocks, 2) [N] on the blocks."""
    world.step += 1
    integrate(world, force)
    for body in world.assemblies:
        if meet_wall(world.rules.wall, body):
            body.drag = np.zeros(3)
    if world.bonds is not None:
        for kind, blocks, faces in break_bonds(world, world.bonds):
            world.events.append(Event(world.step, blocks, faces, kind))
    settle(world)


def integrate(world: World, force: Floats) -> None:
    """Move the assemblies by one time step, free of contacts."""
    dt = world.rules.model.time_step
    noises = [_acceleration(body, force) for body in world.assemblies]
    aheads, middles = [], []
    for body, noise in zip(world.assemblies, noises, strict=True):
        aheads.append(body.motion + dt / 2 * (body.drag + noise))
        middles.append(body.pose + dt / 4 * (body.motion + aheads[-1]))
    drags = drag_sums(world, middles, aheads)
    for body, noise, ahead, (acceleration, stiffness) in zip(
        world.assemblies, noises, aheads, drags, strict=True
    ):
        mean = ahead + dt / 2 * (acceleration - body.drag) / (1 + dt / 2 * stiffness)
        after = 2 * mean - body.motion
        body.before = body.pose
        body.pose = body.pose + dt * mean
        body.pose[2] = wrapped(body.pose[2])
        body.drag = (after - body.motion) / dt - noise
        body.motion = after


def _acceleration(body: Assembly, force: Floats) -> Floats:
    """Return the acceleration of an assembly (x, y, angle) by forces on its blocks' centres."""
    own = force[body.blocks]
    torque = cross(body.arms(), own).sum()
    return np.array([*own.sum(axis=0), torque]) * body.inverse_mass


def drag_sums(
    world: World, poses: list[Floats], motions: list[Floats]
) -> list[tuple[Floats, Floats]]:
    """Return drag acceleration and damping rate [1/s] (x, y, angle) of each assembly."""
    rules, model = world.rules, world.rules.model
    arms = [body.arms(pose[2]) for body, pose in zip(world.assemblies, poses, strict=True)]
    columns = []
    for body, pose, motion, arm in zip(world.assemblies, poses, motions, arms, strict=True):
        low_x, high_x, low_y, high_y = rules.bounds
        x, y = (
            np.clip(pose[0] + arm[:, 0], low_x, high_x),
            np.clip(pose[1] + arm[:, 1], low_y, high_y),
        )
        vx, vy = motion[0] - motion[2] * arm[:, 1], motion[1] + motion[2] * arm[:, 0]
        columns.append([x, y, pose[2] + body.turns, vx, vy, np.full_like(x, motion[2])])
    members = np.concatenate(columns, axis=1)
    hidden = np.concatenate([body.hidden for body in world.assemblies]).T
    coefficient = np.full(members.shape[1], rules.drag_coefficient)
    force_x, force_y, torque, conductance = drag(
        model,
        coefficient,
        members[:3],
        members[3:],
        hidden if rules.hidden_face_drag == "none" else None,
    )
    pushed = push_of_water(model, members[:3])
    force_x, force_y, torque = force_x + pushed[0], force_y + pushed[1], torque + pushed[2]
    if rules.pull is not None:
        sizes = [body.size for body in world.assemblies]
        owner = np.repeat(np.arange(len(sizes)), sizes)
        typed = rules.latch.faces
        pole = None if typed is None else np.concatenate([typed.poles(b) for b in world.assemblies])
        force_x, force_y, torque = np.stack([force_x, force_y, torque]) + pull_of_blocks(
            rules.pull, *_drifted(world), hidden, owner, world.step - 1,
            None if pole is None else pole.T,
        )  # fmt: skip
    sums, first = [], 0
    for body, arm in zip(world.assemblies, arms, strict=True):
        own = slice(first, first + body.size)
        first += body.size
        force = np.stack([force_x[own], force_y[own]], axis=1)
        turning = (torque[own] + cross(arm, force)).sum()
        spread = model.turning + (arm**2).sum(axis=1)
        damping = np.array([conductance[own].sum()] * 2 + [(conductance[own] * spread).sum()])
        acceleration = np.array([*force.sum(axis=0), turning]) * body.inverse_mass
        sums.append((acceleration, damping * body.inverse_mass))
    return sums


def _drifted(world: World) -> tuple[Floats, Floats]:
    """Return pose and velocity of every block, half a step ahead without forces, shape (3, n)."""
    poses, motions = [], []
    for body in world.assemblies:
        x, y, angle = body.pose + world.rules.model.time_step / 2 * body.motion
        arm, (vx, vy, spin) = body.arms(angle), body.motion
        one = np.ones(body.size)
        poses.append([x + arm[:, 0], y + arm[:, 1], angle * one])
        motions.append([vx - spin * arm[:, 1], vy + spin * arm[:, 0], spin * one])
    return np.concatenate(poses, axis=1), np.concatenate(motions, axis=1)


def settle(world: World) -> None:
    """Latch, collide and separate what has met."""
    rules = world.rules
    overlapping = bool(overlapping_pairs(world.assemblies))
    if not overlapping and not any(True for _ in candidates(rules.latch, world.assemblies)):
        return
    met = overlapping
    touched: list[Assembly] = []
    bars = None if world.bonds is None else world.bonds.bars
    while joined := latch_once(rules.latch, rules.wall, world.assemblies, bars):
        met = True
        _join(world, joined)
        touched.append(joined.made)
    if met and world.first_contact_step < 0:
        world.first_contact_step = world.step
    for pair in overlapping_pairs(world.assemblies):
        collide(
            pair,
            restitution=rules.block_restitution,
            friction=rules.block_friction,
            bounce_speed=rules.wall.bounce_speed,
        )
        touched += pair.bodies
    separate(rules.wall, world.assemblies)
    for body in touched:
        body.drag = np.zeros(3)


def _join(world: World, joined: Joined) -> None:
    kept = [body for body in world.assemblies if body not in joined.removed]
    world.assemblies = sorted([*kept, joined.made], key=lambda body: body.blocks[0])
    world.events.append(Event(world.step, joined.blocks, joined.faces))
    for pair in [] if world.bonds is None else world.bonds.form(joined.made, world.step):
        if set(pair) != set(joined.blocks):
            faces = faces_between(joined.made, pair)
            world.events.append(Event(world.step, pair, faces, CLOSING))


def _row(world: World) -> dict[str, Any]:
    room = max(world.blocks - 1, 1, len(world.events))
    row: dict[str, Any] = {
        "event_count": len(world.events),
        "event_step": np.full(room, -1, dtype=np.int32),
        "event_block": np.full((room, 2), -1, dtype=np.int32),
        "event_face": np.full((room, 2), -1, dtype=np.int32),
        "first_contact_step": world.first_contact_step,
        "end_step": world.step,
    }
    if world.bonds is not None:
        row["event_kind"] = np.array([event.kind for event in world.events], dtype=np.int32)
    for k, event in enumerate(world.events):
        row["event_step"][k] = event.step
        row["event_block"][k] = event.blocks
        row["event_face"][k] = event.faces
    return row | {name: world.gather(name) for name in ("pose", "cell", "quarter", "assembly")}
