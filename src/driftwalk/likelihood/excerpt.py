"""Excerpts of the recordings of a fit, on which a search costs a part of the time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from driftwalk.likelihood.filter_pass import Passes, Series

LAW_SAMPLES: Final = 3000
"""Laws are compared on so many samples from the beginning of the recordings."""
NEAR_SAMPLES: Final = 3600
"""A search comes near its end on so many samples,"""
PIECE_SAMPLES: Final = 300
"""in pieces of so many from all over the recordings,"""
WORTH_FACTOR: Final = 2.5
"""where the recordings have more than so many times as many."""


def beginning(passes: Passes) -> Sequence[Series]:
    """Return the first series, with some `LAW_SAMPLES` samples together; all with several flows."""
    total = sum(one.time.size for one in passes.series)
    if passes.flows > 1 or total <= 1.2 * LAW_SAMPLES:
        return passes.series
    found, count = [], 0
    for one in passes.series:
        if count >= LAW_SAMPLES:
            break
        found.append(one.part(0, LAW_SAMPLES - count))
        count += found[-1].time.size
    return found


def pieces(passes: Passes) -> Sequence[Series] | None:
    """Return pieces of the recordings; nothing where those are too short for it.

    The pieces come from all over the recordings, so that they show as much of the tank as those.
    """
    total = sum(one.time.size for one in passes.series)
    found = []
    for one in passes.series:
        size = one.time.size
        count = max(round(NEAR_SAMPLES * size / total / PIECE_SAMPLES), 1)
        if count * PIECE_SAMPLES >= size:
            found.append(one)
            continue
        ends = np.linspace(0, size - PIECE_SAMPLES, count)
        firsts = ends if count > 1 else [0.5 * (size - PIECE_SAMPLES)]
        found += [one.part(int(first), int(first) + PIECE_SAMPLES) for first in firsts]
    # Each recording gives a piece, so of many short ones little is left out.
    few = sum(one.time.size for one in found)
    return found if WORTH_FACTOR * few <= total else None
