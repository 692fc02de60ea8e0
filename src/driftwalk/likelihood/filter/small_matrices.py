"""Cholesky factors of many 2 x 2 or 3 x 3 covariances at once."""

from __future__ import annotations

import numpy as np

from driftwalk.likelihood.spline import Floats


def unpacked(lower: Floats) -> Floats:
    """Return symmetric matrices (D, D, n) from their lower parts (n, D (D + 1) / 2), row by row."""
    count = {3: 2, 6: 3}[lower.shape[1]]
    full = np.empty((count, count, lower.shape[0]))
    for column, (a, b) in enumerate(zip(*np.tril_indices(count), strict=True)):
        full[a, b] = full[b, a] = lower[:, column]
    return full


def factor(lower: Floats) -> Floats:
    """Return the Cholesky factors L (D, D, n), L L' the matrices of which these are lower parts."""
    full = unpacked(lower)
    root = np.zeros_like(full)
    for a in range(len(full)):
        for b in range(a + 1):
            rest = full[a, b] - (root[a, :b] * root[b, :b]).sum(axis=0)
            root[a, b] = np.sqrt(rest) if a == b else rest / root[b, b]
    return root


def forward(root: Floats, right: Floats) -> Floats:
    """Return L^-1 b for n triangular L (D, D, n) and b (D, n), or (D, m, n)."""
    found = np.empty_like(right)
    for a in range(len(root)):
        rest = right[a].copy()
        for b in range(a):
            rest -= root[a, b] * found[b]
        found[a] = rest / root[a, a]
    return found
