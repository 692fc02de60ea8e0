"""Breakdown of a search: fits that have no solution, as one error for people."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.likelihood.refuse import LIMIT

if TYPE_CHECKING:
    from driftwalk.likelihood.spline import Floats
    from driftwalk.schema import Track

BREAKDOWN = (np.linalg.LinAlgError, ArithmeticError, ValueError)
"""Errors of a search that diverges: a matrix that is not positive definite, a parameter that
is no longer a number, the root of a negative variance, a value that the filter refuses."""


@contextmanager
def solved(wall_share: float = 0.0) -> Iterator[None]:
    """Turn every way in which a search breaks down into one error for people."""
    try:
        with np.errstate(all="ignore"):
            yield
    except InputError:
        raise
    except BREAKDOWN as error:
        raise InputError(
            f"the fit has no solution for this recording: {_reason(wall_share)}"
        ) from error


def _reason(wall_share: float) -> str:
    """Return why a search may break down, and what to do."""
    if wall_share > LIMIT.most_wall_share:
        return (
            f"{wall_share:.0%} of the intervals are at the wall and were left out, and the motion "
            "in the others does not follow the model; record where the body stays away from the "
            "wall, or check the tank, the side of the block and the units"
        )
    return (
        "the motion does not follow the model at all, or the tank, the block or the units are wrong"
    )


def cholesky(information: Floats) -> Any:
    """Return scipy's Cholesky factor of an information matrix."""
    from scipy.linalg import cho_factor

    if not np.isfinite(information).all():
        raise np.linalg.LinAlgError("the information matrix is not finite")
    return cho_factor(information, check_finite=False)


def require_noise_below_motion(
    noise: float, tracks: Sequence[Track], wall_share: float = 0.0
) -> None:
    """Refuse a solution that takes the whole motion for tracking noise."""
    scatter = max(float(axis.std()) for track in tracks for axis in (track.x, track.y))
    if noise > scatter:
        raise InputError(
            "the fit has no solution for this recording: it attributes the whole "
            f"motion to tracking noise ({1e3 * noise:.3g} mm, while the positions "
            f"scatter by {1e3 * scatter:.3g} mm); {_reason(wall_share)}"
        )
