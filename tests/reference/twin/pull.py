"""Forces between blocks at a distance, for the NumPy twin: pair after pair, face after face.

Radial forces are those of the core's tables, linear in the squared distance within their cells.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.pull.force_tables import BlockPull, RadialForce, cell_start
from twin.body import Floats, cross


@lru_cache
def nodes(force: RadialForce) -> tuple[Floats, Floats]:
    """Return squared distances [m²] and the attraction over the distance there [N/m]."""
    cells, first = force.cells()
    return cell_start(first + np.arange(len(cells))), cells[:, 0]


def strength(force: RadialForce, squared: npt.ArrayLike) -> Floats:
    """Return the attraction over the distance [N/m] at squared distances [m²]."""
    return np.interp(squared, *nodes(force))


def share_in_step(pull: BlockPull, squared: float, step: int) -> float:
    """Return the share of a force of faces that acts in a step: of its near and distant parts."""
    every, start, end = pull.tables.stepping
    part = np.clip((squared - start) / (end - start), 0.0, 1.0)
    near = 1.0 - 3.0 * part**2 + 2.0 * part**3
    return float(near + (every * (1.0 - near) if step % every == every // 2 else 0.0))


def pull_of_blocks(
    pull: BlockPull,
    members: Floats,
    motions: Floats,
    hidden: npt.NDArray[np.bool_],
    body: Floats,
    step: int,
    pole: npt.NDArray[np.int_] | None = None,
) -> Floats:
    """Return force x, y [N] and torque [N m] on each block, about its centre, shape (3, n).

    Parameters
    ----------
    pull : BlockPull
        Of the study; without fixed poles.
    members, motions : ndarray, shape (3, n)
        Pose of the block in the axes of its assembly; velocity.
    hidden : ndarray of bool, shape (4, n)
        Joined faces, in the assembly's frame.
    body : ndarray, shape (n,)
        The assembly of each block.
    step : int
        Number of the time step.
    pole : ndarray of int, shape (4, n), optional
        Poles of the faces, in the assembly's frame: like ones repel; default: all attract.
    """
    found = np.zeros_like(members)
    centres = members[:2].T
    turns = members[2] + np.arange(4)[:, None] * np.pi / 2
    levers = pull.lever * np.stack([np.cos(turns), np.sin(turns)], axis=-1)  # (4, n, 2)
    for a, b in np.argwhere(np.triu(body[:, None] != body)):
        way = centres[b] - centres[a]
        force = np.zeros(2)
        if pull.centres is not None:
            force += strength(pull.centres, way @ way) * way
        if pull.resistance is not None:
            parting = (motions[:2, b] - motions[:2, a]) @ way
            force += strength(pull.resistance, way @ way) * parting * way
        for i in np.flatnonzero(~hidden[:, a]) if pull.faces is not None else ():
            for j in np.flatnonzero(~hidden[:, b]):
                apart = way + levers[j, b] - levers[i, a]
                one = strength(pull.faces, apart @ apart) * apart
                one *= share_in_step(pull, apart @ apart, step)
                if pole is not None:
                    one = -pole[i, a] * pole[j, b] * one
                force += one
                found[2, a] += cross(levers[i, a], one)
                found[2, b] -= cross(levers[j, b], one)
        found[:2, a] += force
        found[:2, b] -= force
    return found
