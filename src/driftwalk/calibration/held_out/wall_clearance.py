"""The distance from the wall at contact: maximum likelihood of an edge behind camera noise."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats


class ClearancePolicy(NamedTuple):
    """How the distance at contact is deconvolved from the noise of the camera."""

    nearest_share: float = 0.01
    """The nearest samples may be tracking errors: this share is not trusted to be near the wall;
    chosen by hand."""
    outward: float = 20.0
    """How far outwards of them the contact is looked for, in noises; chosen by hand."""
    inward: float = 10.0
    """How far inwards of them distances are looked at, in noises; chosen by hand."""
    least_blur: float = 3e-4
    """Noise of a recording without any, in parts of its largest distance: contact is then found to
    a tenth of that; chosen by hand."""
    blurs: tuple[float, ...] = (
        *(0.8, 0.85, 0.9, 0.95, 1.0, 1.05, 1.1, 1.15, 1.2), 1.35, 1.6, 2.0, 2.8, 4.0,
    )  # fmt: skip
    """Noises that are tried, in estimated ones: the estimate has an error, and a body that turns
    touches the wall at more than one distance; chosen by hand."""
    rounds: int = 200
    """Of expectation maximisation for the weights; measured: the estimate stays the same with
    1000."""


_CLEARANCE: Final = ClearancePolicy()


class Clearance(NamedTuple):
    """Distance of the recorded point from the wall at contact."""

    distance: float
    """[m], 0 or more."""
    std: float
    """Its standard error [m]; 0 where it is stated."""


def estimate_clearance(from_wall: Floats, noise: float) -> Clearance:
    """Return the distance at contact that explains recorded distances from the wall.

    The true distances are a mixture: some samples at contact, others inwards of it with a density
    that rises or falls linearly; tracking errors lie anywhere. The camera blurs all by its noise.
    Weights and blur are those of largest likelihood for each distance at contact; mean and standard
    error are those of this profile.

    Parameters
    ----------
    from_wall : ndarray
        Recorded distances from the wall [m].
    noise : float
        Standard deviation of a position, per axis [m].

    Examples
    --------
    >>> random = np.random.default_rng(1)
    >>> true = np.maximum(0.015, 0.015 + random.uniform(-0.01, 0.05, 9000))
    >>> found = estimate_clearance(true + 3e-4 * random.normal(size=true.size), 3e-4)
    >>> round(found.distance, 4), found.std < 2e-5
    (0.015, True)
    """
    share = _CLEARANCE.nearest_share
    least, nearest = np.quantile(from_wall, [0.1 * share, share])
    blur = max(noise, _CLEARANCE.least_blur * float(np.max(from_wall)))
    low = max(float(least), float(nearest) - _CLEARANCE.outward * blur) - 4.0 * blur
    high = float(nearest) + _CLEARANCE.inward * blur
    edges = np.linspace(low, high, round((high - low) / blur * 4.0) + 1)
    counts = np.histogram(from_wall, edges)[0].astype(np.float64)
    tried = np.arange(low + 2.0 * blur, nearest + 4.0 * blur, 0.25 * blur)
    # Mean and standard deviation of the profile, on finer and finer grids.
    for _ in range(3):
        profile = np.max([_profile(tried, blur * by, edges, counts) for by in _CLEARANCE.blurs], 0)
        likely = np.exp(profile - profile.max())
        mean = float(np.average(tried, weights=likely))
        std = float(np.sqrt(np.average((tried - mean) ** 2, weights=likely)))
        reach = 4.0 * max(std, 0.5 * float(tried[1] - tried[0]))
        tried = np.linspace(mean - reach, mean + reach, 25)
    return Clearance(max(mean, 0.0), std)


def _profile(contacts: Floats, blur: float, edges: Floats, counts: Floats) -> Floats:
    """Return the log-likelihood of each distance at contact, at its best weights."""
    from scipy.special import ndtr

    at = (edges - contacts[:, None]) / blur
    density = np.exp(-0.5 * at**2) / np.sqrt(2.0 * np.pi)
    far = at[:, -1:]
    # Integrals of the blurred densities up to each edge: contact, level, rising, falling, errors.
    level = at * ndtr(at) + density
    rising = 0.5 * ((at**2 + 1.0) * ndtr(at) + at * density)
    below = np.broadcast_to(at - at[:, :1], at.shape)
    parts = np.diff(
        np.stack([ndtr(at), level, rising, far * level - rising, below], axis=1), axis=2
    )
    parts = np.maximum(parts, 0.0) + 1e-12
    parts /= parts.sum(axis=2, keepdims=True)
    shares = counts / counts.sum()
    weights = np.full((contacts.size, parts.shape[1]), 1.0 / parts.shape[1])
    for _ in range(_CLEARANCE.rounds):
        mixed = np.einsum("ck,ckb->cb", weights, parts)
        weights = weights * np.einsum("ckb,cb->ck", parts, shares / mixed)
    mixed = np.einsum("ck,ckb->cb", weights, parts)
    return np.asarray(np.log(mixed) @ counts)
