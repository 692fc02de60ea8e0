"""Steps along tracks: from one sample to the next of the same body, never across a gap."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Steps:
    """Steps of many bodies, in order of body and time; n of them."""

    body: Indices
    """Number of the body, shape (n,)."""
    first: Indices
    """Number of the sample at which the step begins, shape (n,): in a row, one more each."""
    time: Array
    """Middle of the step in time [s], shape (n,)."""
    interval: Array
    """Duration [s], shape (n,)."""
    position: Array
    """Middle of the step [m], shape (n, 2)."""
    velocity: Array
    """Velocity [m/s], shape (n, 2)."""

    def select(self, chosen: Mask) -> Steps:
        """Return some of the steps."""
        return Steps(
            self.body[chosen],
            self.first[chosen],
            self.time[chosen],
            self.interval[chosen],
            self.position[chosen],
            self.velocity[chosen],
        )

    @property
    def goes_on(self) -> Mask:
        """Whether each step but the last ends where the next one begins, shape (n - 1,)."""
        same = self.body[1:] == self.body[:-1]
        return np.asarray(same & (np.diff(self.first) == 1))


@dataclass(frozen=True)
class FoundSteps:
    """The steps of a recording, and how many pairs of samples are none."""

    steps: Steps
    across_gaps: int
    """Pairs of samples with a gap between."""
    ambiguous: int
    """Pairs between which the tracker could have exchanged identities."""


def track_steps(trajectory: xr.Dataset) -> FoundSteps:
    """Return the steps of all bodies of a recording.

    An interval longer than 1.5 times the median one of all tracks is a gap, as for
    `local_quadratic`. Where the tracker says that identities could have been exchanged
    (``ambiguous``), there is no step.

    Parameters
    ----------
    trajectory : xarray.Dataset
        A `trajectory`.

    Raises
    ------
    InputError
        When there is no step.

    Examples
    --------
    >>> from driftwalk.schema import build_trajectory
    >>> two = build_trajectory([0.0, 1.0, 2.0], [[0, 5], [1, 5], [2, np.nan]], np.zeros((3, 2)))
    >>> track_steps(two).steps.velocity[:, 0].tolist()
    [1.0, 1.0, 0.0]
    """
    x, y = (trajectory[name].values.T for name in ("x", "y"))
    body, row = np.nonzero(np.isfinite(x) & np.isfinite(y))
    time, position = trajectory["time"].values[row], np.column_stack([x[body, row], y[body, row]])
    first = np.flatnonzero(body[1:] == body[:-1])
    if first.size == 0:
        raise InputError(
            "no body has two positions, and a velocity needs two: is each row a separate body? "
            "Name the column of the identities with `columns`"
        )
    interval = np.diff(time)[first]
    near = interval <= 1.5 * float(np.median(interval))
    sure = np.ones(first.size, dtype=bool)
    if "ambiguous" in trajectory:
        unsure = (trajectory["ambiguous"].values.T > 0.0)[body, row]
        sure = ~(unsure[first] | unsure[first + 1])
    steps = Steps(
        body[first],
        first,
        0.5 * (time[first] + time[first + 1]),
        interval,
        0.5 * (position[first] + position[first + 1]),
        (position[first + 1] - position[first]) / interval[:, None],
    )
    return FoundSteps(
        steps.select(near & sure),
        across_gaps=int(np.count_nonzero(~near)),
        ambiguous=int(np.count_nonzero(near & ~sure)),
    )


def step_noise(steps: Steps) -> float:
    """Estimate the position noise of many tracks, too short for an estimate each.

    The fourth divided difference of five positions in a row, at their own times, holds next to
    nothing of a smooth path. Scaled to weights whose squares add up to one, it has the variance r²
    of white noise r per axis. The median size says r, and false links hardly change it.

    Parameters
    ----------
    steps : Steps
        Steps as `track_steps` returns them.

    Returns
    -------
    float
        Standard deviation per axis [m]; NaN where there are too few samples in a row.

    Examples
    --------
    >>> from driftwalk.schema import build_trajectory
    >>> noise = np.random.default_rng(1).normal(0.0, 3e-4, (2, 5, 1000))
    >>> x = 0.01 * np.arange(5)[:, None] + noise[0]
    >>> r = step_noise(track_steps(build_trajectory(np.arange(5) * 0.1, x, noise[1])).steps)
    >>> round(r, 4)
    0.0003
    """
    if steps.time.size < 4:
        return math.nan
    in_a_row = np.lib.stride_tricks.sliding_window_view(steps.goes_on, 3).all(axis=1)
    # With fewer fourth differences the noise is not known.
    if np.count_nonzero(in_a_row) < 50:
        return math.nan
    window = np.flatnonzero(in_a_row)[:, None] + np.arange(4)
    interval = steps.interval[window]
    time = _from_zero(interval)
    position = _from_zero(steps.velocity[window] * interval[..., None])
    # A sample's distance to itself is no factor.
    apart = time[:, :, None] - time[:, None, :] + np.eye(time.shape[1])
    weight = 1.0 / apart.prod(axis=2)
    weight /= np.sqrt(np.sum(weight**2, axis=1, keepdims=True))
    return 1.4826 * float(np.median(np.abs(np.einsum("nk,nki->ni", weight, position))))


def _from_zero(changes: Array) -> Array:
    """Return the sums of changes along axis 1, with a zero in front."""
    return np.concatenate([np.zeros_like(changes[:, :1]), np.cumsum(changes, axis=1)], axis=1)
