"""Orientation and turning rate of a track, smoothed: inputs of the likelihood fit."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

ORIENTED_SHARE: Final = 0.5
"""Share of the samples with an orientation from which on the fit uses orientations by default, and
the search for dropped frames does. Chosen by hand: the majority."""
WINDOW: Final = 5
"""Samples of a parabola: the five nearest in time, so that gaps and uneven clocks are no case."""


class Angle(NamedTuple):
    """Smoothed orientation at every sample of a track, shapes (n,)."""

    theta: Floats
    """Orientation [rad], unwrapped."""
    omega: Floats
    """Turning rate [rad/s]."""
    known: npt.NDArray[np.bool_]
    """Where orientations are near enough in time to tell."""


def no_angle(count: int) -> Angle:
    """Return the substitute for the orientation of a track that has none."""
    return Angle(np.zeros(count), np.zeros(count), np.ones(count, dtype=bool))


def smooth_angle(time: Floats, theta: Floats, *, longest_gap: float) -> Angle:
    """Fit a parabola to the five orientations nearest in time to each sample.

    Examples
    --------
    >>> time = np.arange(20) * 0.1
    >>> smooth_angle(time, np.angle(np.exp(2j * time)), longest_gap=1.0).omega.round(6)[[0, 10]]
    array([2., 2.])
    """
    seen = np.isfinite(theta)
    if np.count_nonzero(seen) < WINDOW:
        return Angle(np.zeros(time.size), np.zeros(time.size), np.zeros(time.size, dtype=bool))
    at, turned = time[seen], np.unwrap(theta[seen])
    first, reach = _windows(at)
    value, rate = _parabolas(at, turned, first)
    near = reach <= longest_gap
    known = np.zeros(time.size, dtype=bool)
    if near.any():
        known = _distance(time, at[near]) <= longest_gap
        at, value, rate = at[near], value[near], rate[near]
    return Angle(np.interp(time, at, value), np.interp(time, at, rate), known)


def _windows(time: Floats) -> tuple[npt.NDArray[np.intp], Floats]:
    """Return for each sample the window of five that reaches least far from it, and how far."""
    index = np.arange(time.size)
    # The centred window comes first, so that it is taken among equals.
    firsts = np.stack([index + offset for offset in (-2, -1, -3, 0, -4)])
    whole = (firsts >= 0) & (firsts <= time.size - WINDOW)
    inside = np.where(whole, firsts, 0)
    reach = np.maximum(time - time[inside], time[inside + WINDOW - 1] - time)
    # 1e-9: rounding of the clock is no reason to leave the middle.
    reach = np.where(whole, np.round(reach, 9), np.inf)
    best = reach.argmin(axis=0)
    return firsts[best, index], reach[best, index]


def _parabolas(time: Floats, values: Floats, first: npt.NDArray[np.intp]) -> tuple[Floats, Floats]:
    """Return value and slope at each sample of the parabola through its window."""
    members = first[:, None] + np.arange(WINDOW)
    apart = time[members] - time[:, None]
    scale = np.abs(apart).max(axis=1)
    tau = apart / scale[:, None]
    terms = np.stack([np.ones_like(tau), tau, tau**2], axis=-1)
    rise = values[members] - values[:, None]
    normal = np.einsum("nwa,nwb->nab", terms, terms)
    moments = np.einsum("nwa,nw->na", terms, rise)
    found = np.linalg.solve(normal, moments[..., None])[..., 0]
    return values + found[:, 0], found[:, 1] / scale


def _distance(time: Floats, others: Floats) -> Floats:
    """Return the time from each sample to the nearest of the others."""
    after = np.clip(np.searchsorted(others, time), 1, max(others.size - 1, 1))
    right = others[np.minimum(after, others.size - 1)]
    return np.minimum(np.abs(time - others[after - 1]), np.abs(right - time))
