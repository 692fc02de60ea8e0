"""Excerpts of the recordings of a fit, on which a search costs a part of the time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from driftwalk.likelihood.filter.filter_pass import Passes
from driftwalk.likelihood.filter.series import Series


class ExcerptPolicy(NamedTuple):
    """Sizes of the excerpts, in samples."""

    law_samples: int = 3000
    """Laws are compared on this many samples from the beginning of the recordings. Chosen by hand;
    eight floating bodies were ahead by 176 to 365 nats on them (docs/explanation/likelihood.md)."""
    near_samples: int = 3600
    """A search comes near its end on this many samples. Chosen by hand."""
    piece_samples: int = 300
    """The samples come in pieces of this many from all over the recordings. Chosen by hand."""
    worth_factor: float = 2.5
    """A search goes by way of pieces where the recordings have this many times as many samples.
    Chosen by hand."""


EXCERPT: Final = ExcerptPolicy()


def beginning(passes: Passes) -> Sequence[Series]:
    """Return the first 3000 samples or so, in series; all of them where there are several flows."""
    total = sum(one.time.size for one in passes.series)
    if passes.flows > 1 or total <= 1.2 * EXCERPT.law_samples:
        return passes.series
    found, count = [], 0
    for one in passes.series:
        if count >= EXCERPT.law_samples:
            break
        found.append(one.part(0, EXCERPT.law_samples - count))
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
        count = max(round(EXCERPT.near_samples * size / total / EXCERPT.piece_samples), 1)
        if count * EXCERPT.piece_samples >= size:
            found.append(one)
            continue
        ends = np.linspace(0, size - EXCERPT.piece_samples, count)
        firsts = ends if count > 1 else [0.5 * (size - EXCERPT.piece_samples)]
        found += [one.part(int(first), int(first) + EXCERPT.piece_samples) for first in firsts]
    # Each recording gives a piece, so of many short ones little is left out.
    few = sum(one.time.size for one in found)
    return found if EXCERPT.worth_factor * few <= total else None
