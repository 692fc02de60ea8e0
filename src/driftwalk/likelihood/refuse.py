"""Recordings that cannot be fitted, and the remedies: too short, at rest, or at the wall."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from driftwalk.conditions import recorded_camera
from driftwalk.core.errors import InputError
from driftwalk.likelihood.length import length_advice
from driftwalk.likelihood.start import typical_speed

if TYPE_CHECKING:
    from driftwalk.model import Study
    from driftwalk.schema import Track

FEWEST_SAMPLES: Final = 100
"""Positions, or intervals between them, that a flow needs at least."""
LEAST_MOTION: Final = 0.1
"""A body that stays within this part of its side is at rest: it has seen one place of the flow."""
LEAST_MOTION_IN_NOISES: Final = 3.0
"""Standard deviation of the positions of a moving body, in tracking noises."""
KEPT: Final = 0.99
"""Share of the positions that tells how far a body goes: single jumps of the tracker do not."""
MOST_AT_OWN_WALL: Final = 0.9
"""Share of the intervals at the wall of a tank that was fitted to the positions themselves."""
MOST_COEFFICIENTS: Final = 4400
"""Limit for all flows together: about six flows in the paper's tank."""


def require_length(track: Track, study: Study, *, where: str) -> None:
    """Refuse a recording with too few positions.

    Raises
    ------
    InputError
        With how long to record for the precision that the study asks for.
    """
    if track.time.size < FEWEST_SAMPLES:
        raise InputError(
            f"{where}the recording has {track.time.size} positions of this body; the fit needs "
            f"{FEWEST_SAMPLES} at least. {length_advice(study.fit.drag_coefficient_precision)}"
        )


def require_motion(track: Track, study: Study, *, where: str) -> None:
    """Refuse a body that does not move, or no further than its tracker is noisy.

    Raises
    ------
    InputError
        With how far it goes and where it is.
    """
    from driftwalk.model import apply_overrides

    tail = 0.5 * (1.0 - KEPT)
    width = max(float(np.ptp(np.quantile(axis, (tail, 1.0 - tail)))) for axis in (track.x, track.y))
    scatter = max(float(track.x.std()), float(track.y.std()))
    # The study may say what the tracker's noise should be; this is what it is.
    measured = apply_overrides(study, {"observation.position_noise_m": "estimate"})
    noise = recorded_camera(track, measured, position_quantum=0.0).position_noise
    at_rest = width < LEAST_MOTION * study.block.side_m
    if at_rest or scatter < LEAST_MOTION_IN_NOISES * noise:
        place = f"({np.median(track.x):.3f}, {np.median(track.y):.3f}) m"
        why = (
            f"less than a tenth of its side of {1e3 * study.block.side_m:g} mm"
            if at_rest
            else f"no more than the tracking noise of {1e3 * noise:.2g} mm would show"
        )
        raise InputError(
            f"{where}the body never moves: it stays within {1e3 * width:.2g} mm around {place}, "
            f"{why}, and there is nothing to fit; check the units, the body (`body`) and the time "
            "that is kept (`start`, `stop` of `load`)"
        )
    if typical_speed([track]) == 0.0:
        raise InputError(
            f"{where}the body rests in 99 % of the recording, at the same position to the last "
            "digit, and there is no motion to fit; check the body (`body`) and the time that is "
            "kept (`start`, `stop` of `load`)"
        )


def require_own_arena(study: Study, *, intervals: int, near_wall: int, where: str) -> None:
    """Refuse a tank that was fitted to the positions and then excludes nearly all of them.

    Parameters
    ----------
    study : Study
        The block and the tank, a fitted circle.
    intervals, near_wall : int
        Intervals between samples: all, and those at the wall.
    where : str
        Beginning of the message.

    Raises
    ------
    InputError
        With the sizes of both, and what to state instead.
    """
    if near_wall <= MOST_AT_OWN_WALL * intervals:
        return
    raise InputError(
        f'{where}`tank="fit"` found a tank {1e3 * max(study.tank.extent_m):.3g} mm across, in '
        f"which a block of {1e3 * study.block.side_m:.3g} mm is at the wall in {near_wall} of "
        f"{intervals} intervals: the body stays in a region too small to find the tank from. State "
        'the tank with `tank="circle:D"`, and check the scale and the side of the block'
    )


def require_usable(
    usable: int, *, intervals: int, near_wall: int, tank: str, longest_gap: float, where: str
) -> None:
    """Refuse when too few intervals are left after those at the wall and in gaps.

    Parameters
    ----------
    usable, intervals, near_wall : int
        Intervals between samples that can be used, all of them, and those at the wall.
    tank : str
        The tank in words.
    longest_gap : float
        Longest interval that is predicted over [s].
    where : str
        The subject, to begin the message with.

    Raises
    ------
    InputError
        With what was left out, and why.
    """
    if usable >= FEWEST_SAMPLES:
        return
    advice = (
        "check size and place of the tank, and record where the block stays away from the wall"
        if near_wall > intervals / 2
        else "check the tank, or record for longer"
    )
    left_out = (
        f"all {intervals} intervals are at the wall of the tank (a {tank})"
        if near_wall == intervals
        else f"only {usable} of {intervals} intervals can be used, at least {FEWEST_SAMPLES} are "
        f"needed: {near_wall} are at the wall of the tank (a {tank}), the others are longer than "
        f"{longest_gap:g} s or have no orientation near"
    )
    raise InputError(f"{where}{left_out}; {advice}")


def require_size(flows: int, coefficients: int) -> None:
    """Refuse more flows than can be fitted together in sensible memory and time.

    Parameters
    ----------
    flows : int
        Number of flows.
    coefficients : int
        Coefficients of one flow.

    Raises
    ------
    InputError
        With the memory and the time that they would take.
    """
    total = flows * coefficients
    if flows == 1 or total <= MOST_COEFFICIENTS:
        return
    # Half a dozen matrices of doubles; inverse and factors take some 3 n^3 operations in each of
    # about twenty steps.
    memory = 6 * 8 * total**2 / 1e9
    minutes = 20 * 3 * float(total) ** 3 / 3e10 / 60
    raise InputError(
        f"{flows} flows of {coefficients} coefficients are too many to fit together: they would "
        f"take about {memory:.1f} GB and {minutes:.0f} min, {MOST_COEFFICIENTS // coefficients} "
        "can be fitted; set knots further apart (`fit.spline_spacing_m`), give flows that come "
        "back the same name (`fit.flow_labels`), or fit parts of the recording (`start`, `stop` "
        "of `load`)"
    )
