"""Warnings of inputs that a calibration takes for right: the wall, the recording's own flow."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from driftwalk.calibration.goodness_of_fit import GoodnessOfFit
from driftwalk.flow.arena import outline_of
from driftwalk.motion import BlockModel, MotionModel
from driftwalk.schema import Track

if TYPE_CHECKING:
    from driftwalk.model import Study


class WallWarningPolicy(NamedTuple):
    """When a recording is near a wall often enough for its friction to count. Chosen by hand."""

    notable_share: float = 0.05
    """Share of the samples near the wall above which a warning is given."""
    reach_m: float = 0.002
    """How far a block may move from one sample to the next [m]."""


WALL_WARNING: Final = WallWarningPolicy()


def wall_warning(track: Track, study: Study) -> str | None:
    """Return a warning where the block is often at a wall whose properties were not stated.

    A calibration by steps simulates the contacts with the wall. Where the friction of the wall is 1
    and the study says 0, C_d comes out a third too small.

    Examples
    --------
    >>> import driftwalk as dw
    >>> time, zero = np.arange(5.0), np.zeros(5)
    >>> wall_warning(Track(time, zero, zero, zero), dw.Study()) is None
    True
    """
    tank = study.tank
    if not (tank.is_default("wall_restitution") and tank.is_default("wall_friction")):
        return None
    reach = study.block.side_m / math.sqrt(2.0) + WALL_WARNING.reach_m
    near = outline_of(tank.to_arena()).depth(track.x, track.y) < reach
    share = float(np.mean(near))
    if share <= WALL_WARNING.notable_share:
        return None
    return (
        f"the block may touch the wall in {share:.0%} of the samples, and the study takes the "
        f"default wall (restitution {tank.wall_restitution:g}, friction {tank.wall_friction:g}): a "
        "wrong friction can move C_d by a third; the likelihood fit estimates both from the "
        "contacts (`estimate_wall`): state them (`tank.wall_restitution`, `tank.wall_friction`)"
    )


def own_flow_warning(model: MotionModel, quality: GoodnessOfFit | None) -> str | None:
    """Return what to do where a block is not explained in a flow from its own recording.

    Such a flow is too slow where the block seldom was, and its inward part near the wall is half of
    the true one (docs/validation.md); C_d and sigma_F make up for that.

    Examples
    --------
    >>> import driftwalk as dw
    >>> own_flow_warning(BlockModel(dw.Study()), None) is None
    True
    """
    if not isinstance(model, BlockModel) or quality is None or quality.explained:
        return None
    return (
        "the flow was taken from the recording itself, and the parameters make up for its errors: "
        "for a body that drifts, fit flow and parameters together (driftwalk fit) or give a "
        "measured flow; for one that moves by itself, compare models (driftwalk compare-models)"
    )
