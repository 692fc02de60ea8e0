"""The KS statistic word for word by its definition, in plain NumPy: slow, and independent."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Points = npt.NDArray[np.float64]


def integer_difference(origins: Points, a: Points, b: Points, *, ties: str = "strict") -> int:
    """Largest |m c_a - n c_b| over origins and quadrants."""
    choices = [(False, False)] if ties == "strict" else [(i, j) for i in (0, 1) for j in (0, 1)]
    largest = 0
    for x, y in origins:
        for in_x, in_y in choices:
            for across in (-1, 1):
                for along in (-1, 1):
                    counts = []
                    for sample in (a, b):
                        dx, dy = across * (sample[:, 0] - x), along * (sample[:, 1] - y)
                        inside_x = dx >= 0 if in_x else dx > 0
                        inside_y = dy >= 0 if in_y else dy > 0
                        counts.append(int((inside_x & inside_y).sum()))
                    largest = max(largest, abs(len(b) * counts[0] - len(a) * counts[1]))
    return largest


def differences(a: Points, b: Points, *, ties: str = "strict") -> tuple[int, int]:
    """D1 and D2 in units of 1 / (n m)."""
    return integer_difference(a, a, b, ties=ties), integer_difference(b, a, b, ties=ties)


def peacock(a: Points, b: Points) -> int:
    """Largest |m c_a - n c_b| over every cut between pooled coordinates and all quadrants."""
    largest = 0
    pooled = np.concatenate([a, b])
    for x in np.unique(pooled[:, 0]):
        for y in np.unique(pooled[:, 1]):
            counts = []
            for sample in (a, b):
                left, below = sample[:, 0] <= x, sample[:, 1] <= y
                counts.append([int((i & j).sum()) for i in (left, ~left) for j in (below, ~below)])
            for in_a, in_b in zip(*counts, strict=True):
                largest = max(largest, abs(len(b) * in_a - len(a) * in_b))
    return largest
