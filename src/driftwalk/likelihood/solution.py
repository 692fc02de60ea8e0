"""Fits that have no solution: found where they break down, and said in one sentence."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.core.errors import InputError

if TYPE_CHECKING:
    from driftwalk.likelihood.spline import Floats
    from driftwalk.schema import Track

BREAKDOWN = (np.linalg.LinAlgError, ArithmeticError, ValueError)
"""Errors of a search that diverges: a matrix that is not positive definite, a parameter that
is no longer a number, the root of a negative variance, a value that the filter refuses."""


@contextmanager
def solved() -> Iterator[None]:
    """Turn every way in which a search breaks down into one error for people.

    Raises
    ------
    InputError
        When the search within it breaks down.
    """
    try:
        with np.errstate(all="ignore"):
            yield
    except InputError:
        raise
    except BREAKDOWN as error:
        raise InputError(
            "the fit has no solution for this recording: the motion does not follow the model at "
            "all, or the tank, the block or the units are wrong"
        ) from error


def cholesky(information: Floats) -> Any:
    """Return scipy's Cholesky factor of an information matrix.

    Raises
    ------
    numpy.linalg.LinAlgError
        When it is not positive definite, or holds a value that is not finite.
    """
    from scipy.linalg import cho_factor

    if not np.isfinite(information).all():
        raise np.linalg.LinAlgError("the information matrix is not finite")
    return cho_factor(information, check_finite=False)


def require_noise_below_motion(noise: float, tracks: Sequence[Track]) -> None:
    """Refuse a solution that takes the whole motion for tracking noise.

    Parameters
    ----------
    noise : float
        Fitted tracking noise [m].
    tracks : sequence of Track
        The recordings.

    Raises
    ------
    InputError
        When the positions scatter less than the noise alone would make them.
    """
    scatter = max(float(axis.std()) for track in tracks for axis in (track.x, track.y))
    if noise > scatter:
        raise InputError(
            "the fit has no solution for this recording: it attributes the whole "
            f"motion to tracking noise ({1e3 * noise:.3g} mm, while the positions "
            f"scatter by {1e3 * scatter:.3g} mm); "
            "the motion does not follow the model, or the tank, the block or the units are wrong"
        )
