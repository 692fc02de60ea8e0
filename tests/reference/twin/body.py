"""Rigid assemblies of squares or rectangles, for the NumPy twin of the self-assembly kernel."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

NEIGHBOURS: Ints = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
"""Cell beyond face 0 .. 3 of a cell at the origin."""


def cross(a: Floats, b: Floats) -> Floats:
    """Return a x b of vectors in the plane, along the last axis."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def turned(vectors: Floats, angle: float) -> Floats:
    """Return vectors (..., 2) turned by an angle [rad]."""
    cosine, sine = np.cos(angle), np.sin(angle)
    x, y = vectors[..., 0], vectors[..., 1]
    found = np.empty(vectors.shape)
    found[..., 0] = cosine * x - sine * y
    found[..., 1] = sine * x + cosine * y
    return found


def wrapped(angle: float) -> float:
    """Return an angle in (-pi, pi]."""
    return float(np.pi - np.mod(np.pi - angle, 2 * np.pi))


@dataclass(frozen=True)
class Shape:
    """Constants of all blocks: side a [m], mass m [kg] and a rectangle's second side [m].

    Squares latch on a lattice, rectangles as they lie.
    """

    side: float
    mass: float
    width: float | None = None

    @property
    def on_lattice(self) -> bool:
        """Whether blocks are squares."""
        return self.width is None

    @property
    def half(self) -> Floats:
        """Half of both sides [m], along the block's own x and y."""
        return np.array([self.side, self.width or self.side]) / 2

    @property
    def inertia(self) -> float:
        """Moment of inertia about the vertical [kg m^2]."""
        return self.mass * float((self.half**2).sum()) / 3


@dataclass(eq=False)
class Assembly:
    """Blocks that move as one, on a square lattice or as they lie.

    Member k is block ``blocks[k]``; it sits in cell ``cells[k]`` and its own frame is the
    assembly's, turned by ``quarters[k]`` quarter turns. Off the lattice, where both are zero,
    ``laid[k]`` is its pose in the frame of the centre of mass. Pose and motion are the centre of
    mass's; `drag` is the last step's drag acceleration, `before` the pose at the start of the step.
    All four are (x, y, angle) in SI units and change; members and places stay: a merge makes a new
    assembly.
    """

    shape: Shape
    blocks: list[int]
    cells: Ints
    quarters: Ints
    pose: Floats
    motion: Floats = field(default_factory=lambda: np.zeros(3))
    drag: Floats = field(default_factory=lambda: np.zeros(3))
    before: Floats = field(init=False)
    laid: Floats | None = None

    def __post_init__(self) -> None:
        self.before = self.pose.copy()

    @property
    def size(self) -> int:
        """Number of blocks."""
        return len(self.blocks)

    @property
    def mass(self) -> float:
        """Mass M [kg]."""
        return self.shape.mass * self.size

    @cached_property
    def offsets(self) -> Floats:
        """Members from the centre of mass in the assembly's frame [m], shape (n, 2)."""
        if self.laid is not None:
            return self.laid[:, :2]
        return np.asarray(self.shape.side * (self.cells - self.cells.mean(axis=0)))

    @cached_property
    def turns(self) -> Floats:
        """Angles of the members' sides in the assembly's frame [rad]: 0 on the lattice."""
        return np.zeros(self.size) if self.laid is None else self.laid[:, 2]

    @cached_property
    def inertia(self) -> float:
        """Moment of inertia about the centre of mass [kg m^2]."""
        about_own = self.shape.inertia * self.size
        return about_own + self.shape.mass * float((self.offsets**2).sum())

    @cached_property
    def inverse_mass(self) -> Floats:
        """(1/M, 1/M, 1/I)."""
        return np.array([1 / self.mass, 1 / self.mass, 1 / self.inertia])

    @cached_property
    def hidden(self) -> npt.NDArray[np.bool_]:
        """Which faces, in the assembly's frame, a member covers, shape (n, 4)."""
        occupied = {(int(x), int(y)) for x, y in self.cells}
        return np.array(
            [
                [(int(x + dx), int(y + dy)) in occupied for dx, dy in NEIGHBOURS]
                for x, y in self.cells
            ]
        )

    def take_back(self) -> None:
        """Put it back to where it was at the start of the step, at rest."""
        self.pose = self.before.copy()
        self.motion, self.drag = np.zeros(3), np.zeros(3)

    def arms(self, angle: float | None = None) -> Floats:
        """Return the members from the centre of mass [m], shape (n, 2), at an angle or its own."""
        return turned(self.offsets, self.pose[2] if angle is None else angle)

    def centres(self) -> Floats:
        """Return the positions of the members [m], shape (n, 2)."""
        return np.asarray(self.pose[:2] + self.arms())

    def centre_of(self, block: int) -> Floats:
        """Return the position of a member [m]."""
        return np.asarray(self.centres()[self.blocks.index(block)])

    def face_normal(self, block: int, face: int) -> Floats:
        """Return the outward normal of a member's face 0 .. 3, on the lattice as the assembly's."""
        turn = self.turns[self.blocks.index(block)]
        return turned(np.array([1.0, 0.0]), self.pose[2] + turn + face * np.pi / 2)

    def block_poses(self) -> Floats:
        """Return the poses of the members [m, m, rad], shape (n, 3)."""
        turns = self.turns + self.quarters * np.pi / 2
        angles = [wrapped(self.pose[2] + turn) for turn in turns]
        return np.column_stack([self.centres(), angles])


def single_block(shape: Shape, block: int, pose: Floats) -> Assembly:
    """Return a block at rest, an assembly of its own."""
    x, y, theta = pose
    return Assembly(
        shape,
        [block],
        np.zeros((1, 2), dtype=np.int64),
        np.zeros(1, dtype=np.int64),
        np.array([x, y, wrapped(theta)]),
    )
