"""The joint distribution of step length and turning angle, binned for pictures."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError

Floats = npt.NDArray[np.float64]

BINS = 32


def step_length_edges(*step_length: npt.ArrayLike, bins: int = BINS) -> Floats:
    """Return bin edges for step lengths [m]: from 0 over 99.95 % of all that are given.

    Parameters
    ----------
    *step_length : array_like
        Step lengths [m] of one or more motions.
    bins : int
        Number of bins.

    Examples
    --------
    >>> step_length_edges([0.0, 1.0], bins=2).size
    3
    """
    pooled = np.concatenate([np.asarray(lengths, dtype=np.float64) for lengths in step_length])
    if pooled.size == 0:
        raise InputError("bin edges need at least one step length")
    # The few longest steps would leave most bins empty.
    limit = float(np.quantile(pooled, 0.9995))
    return np.linspace(0.0, limit if limit > 0 else 1.0, bins + 1)


def turning_angle_edges(*, bins: int = BINS) -> Floats:
    """Return bin edges for turning angles [rad]: from -pi to pi.

    Parameters
    ----------
    bins : int
        Number of bins.

    Examples
    --------
    >>> turning_angle_edges(bins=2).round(3).tolist()
    [-3.142, 0.0, 3.142]
    """
    return np.linspace(-np.pi, np.pi, bins + 1)


def joint_density(
    step_length: npt.ArrayLike,
    turning_angle: npt.ArrayLike,
    *,
    step_length_edge: npt.ArrayLike,
    turning_angle_edge: npt.ArrayLike | None = None,
) -> Floats:
    """Return the fraction of steps in every bin of step length and turning angle.

    Parameters
    ----------
    step_length, turning_angle : array_like, shape (n,)
        Steps [m], [rad].
    step_length_edge : array_like, shape (bins + 1,)
        Edges [m], increasing. Longer steps count in the last bin.
    turning_angle_edge : array_like, shape (bins + 1,), optional
        Edges [rad]; default: 32 bins from -pi to pi.

    Returns
    -------
    ndarray, shape (bins of length, bins of angle)
        Fractions; they add up to 1.

    Examples
    --------
    >>> joint_density([0.1, 0.9], [0.0, 0.1], step_length_edge=[0, 0.5, 1]).sum()
    np.float64(1.0)
    """
    length = np.asarray(step_length, dtype=np.float64)
    angle = np.asarray(turning_angle, dtype=np.float64)
    if length.shape != angle.shape or length.ndim != 1 or length.size == 0:
        raise InputError(
            f"step_length {length.shape} and turning_angle {angle.shape} must be of one size, "
            "not empty"
        )
    angle_edge = turning_angle_edges() if turning_angle_edge is None else turning_angle_edge
    rows, columns = (
        _bins(values, np.asarray(edges, dtype=np.float64))
        for values, edges in ((length, step_length_edge), (angle, angle_edge))
    )
    shape = (np.size(step_length_edge) - 1, np.size(angle_edge) - 1)
    counts = np.bincount(rows * shape[1] + columns, minlength=shape[0] * shape[1])
    density: Floats = counts.reshape(shape) / length.size
    return density


def _bins(values: Floats, edges: Floats) -> npt.NDArray[np.int64]:
    """Return the bin of every value; what lies outside counts in the nearest bin."""
    if edges.ndim != 1 or edges.size < 2 or (np.diff(edges) <= 0).any():
        raise InputError("bin edges must increase, and be at least two")
    return np.clip(np.searchsorted(edges, values, side="right") - 1, 0, edges.size - 2)
