"""The playground's tank in the form of a tracker's stream, so that one page can watch both."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from driftwalk.assembly import LiveTank
from driftwalk.core.arrays import Floats

if TYPE_CHECKING:
    from driftwalk.assembly.live_world import LiveEvent


def hello_line(tank: LiveTank) -> dict[str, Any]:
    """Return the first line of a tank's stream, with everything needed to draw the tank.

    Parameters
    ----------
    tank : LiveTank
        The tank; ``image`` is null, since there is no camera.

    Examples
    --------
    >>> import driftwalk as dw
    >>> hello_line(dw.LiveTank(dw.Study(), dw.uniform_flow(0.0, 0.0)))["block_side_m"]
    0.03
    """
    study = tank.study
    return {
        "type": "hello",
        "format": "driftwalk live",
        "version": 1,
        "source": "playground",
        "markers": "simulated",
        "tank": study.tank.to_arena(),
        "block_side_m": study.block.side_m,
        "block_width_m": study.block.width_m,
        "body_count": None,
        "observed": True,
        "image": None,
    }


def frame_line(tank: LiveTank, number: int, events: Sequence[LiveEvent]) -> dict[str, Any]:
    """Return the line of a moment.

    Parameters
    ----------
    tank : LiveTank
        The tank.
    number : int
        Number of the frame.
    events : sequence of LiveEvent
        Joinings and partings since the last frame.
    """
    x, y, theta, assembly = tank.x, tank.y, shown_angles(tank), tank.assembly
    columns = (x, y, theta, tank.vx, tank.vy, tank.omega)
    bodies = [
        {
            "id": str(block),
            "seen": True,
            "x_m": values[0],
            "y_m": values[1],
            "theta_rad": values[2] if math.isfinite(values[2]) else None,
            "column_px": None,
            "row_px": None,
            "vx_m_s": values[3],
            "vy_m_s": values[4],
            "omega_rad_s": values[5],
            "ambiguous": 0.0,
        }
        for block, values in enumerate(zip(*(c.tolist() for c in columns), strict=True))
    ]
    outcome = tank.outcome
    side = tank.study.block.side_m
    joined = joined_faces(x, y, theta, assembly, side=side) if tank.has_lattice else None
    return {
        "type": "frame",
        "frame": number,
        "time_s": tank.time,
        "bodies": bodies,
        "joined": joined and [[str(a), face, str(b), other] for a, face, b, other in joined],
        "outcome": outcome,
        "possible": [outcome],
        "hidden": [],
        "events": [_event(event, joined or []) for event in events],
        "dropped_frames": 0,
        "latency_s": 0.0,
    }


def shown_angles(tank: LiveTank) -> Floats:
    """Return the orientations of the blocks [rad]; NaN of discs, which have none and no faces."""
    return np.full(tank.blocks, np.nan) if tank.study.block.is_round else tank.theta


def joined_faces(
    x: Floats, y: Floats, theta: Floats, assembly: npt.NDArray[np.int32], *, side: float
) -> list[tuple[int, int, int, int]]:
    """Return the faces that lie on one another within assemblies.

    Parameters
    ----------
    x, y, theta : ndarray, shape (blocks,)
        Poses [m, m, rad].
    assembly : ndarray of int, shape (blocks,)
        Equal numbers are joined.
    side : float
        Side of a block [m].

    Returns
    -------
    list of tuple
        Block, its face, other block, its face; face 0 is a block's +x side, 1 +y, 2 -x, 3 -y.

    Examples
    --------
    >>> still = np.zeros(2)
    >>> joined_faces(np.array([0.0, 0.03]), still, still, np.zeros(2, np.int32), side=0.03)
    [(0, 0, 1, 2)]
    """
    first, second = np.nonzero(np.triu(assembly[:, None] == assembly[None, :], 1))
    east, north = x[second] - x[first], y[second] - y[first]
    # Joined faces lie on one another but for rounding.
    near = np.abs(np.hypot(east, north) - side) < 0.01 * side
    first, second, toward = first[near], second[near], np.arctan2(north, east)[near]
    faces = _face(toward - theta[first]), _face(toward + np.pi - theta[second])
    rows = zip(first.tolist(), faces[0].tolist(), second.tolist(), faces[1].tolist(), strict=True)
    return list(rows)


def _face(angle: Floats) -> npt.NDArray[np.int64]:
    """Return the face that looks into a direction of a block's own frame [rad]."""
    return np.rint(angle / (0.5 * np.pi)).astype(np.int64) % 4


def _event(event: LiveEvent, joined: Sequence[tuple[int, int, int, int]]) -> dict[str, Any]:
    pairs = {(a, b): [face, other] for a, face, b, other in joined}
    first, second = event.blocks
    # Blocks that have been taken out since then have no faces any more.
    faces = pairs.get((first, second)) or pairs.get((second, first), [])[::-1]
    return {
        "time_s": event.time,
        "kind": "split" if event.is_parting else "join",
        "bodies": [str(block) for block in event.blocks],
        "faces": faces,
        "outcome": event.outcome,
    }
