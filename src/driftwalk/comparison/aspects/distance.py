"""Distance of two motions in each aspect, and its noise floor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from driftwalk.comparison.aspects.form import Aspect
from driftwalk.comparison.aspects.plan import FEWEST_POINTS
from driftwalk.comparison.ks import KsReference
from driftwalk.core.errors import InputError
from driftwalk.core.processors import map_in_threads

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

BLOCKS: Final = 20
"""Blocks of time into which a recording is cut."""
HALVINGS: Final = 16
"""Random halves of the blocks from which the floor is taken."""


@dataclass(frozen=True, eq=False)
class AspectReference:
    """The aspects of a recording, ready for comparison.

    Attributes
    ----------
    names : tuple of str
        Names of the aspects.
    floor : ndarray, shape (aspects,)
        Distance of the recording from itself: between random halves of its blocks of time, over
        the square root of 2, for a half has half the points.
    """

    names: tuple[str, ...]
    floor: Floats
    _native: tuple[KsReference, ...]

    def distances(
        self, motions: Sequence[Sequence[Aspect]], *, threads: int = 1
    ) -> npt.NDArray[np.float64]:
        """Return the KS distance of each motion in each aspect, shape (motions, aspects).

        1 where a motion has no point.

        Parameters
        ----------
        motions : sequence of sequences of Aspect
            Each with the aspects of the reference, in its order.
        threads : int
            Threads; the result does not depend on it.
        """

        def one(aspects: Sequence[Aspect]) -> list[float]:
            by_name = {aspect.name: aspect.points for aspect in aspects}
            return [
                points_distance(reference, by_name[name])
                for name, reference in zip(self.names, self._native, strict=True)
            ]

        found = map_in_threads(one, motions, threads)
        return np.array(found, dtype=np.float64).reshape(len(motions), len(self.names))

    def overall(self, distances: Floats) -> Floats:
        """Return the mean over the aspects of distance over floor, shape (motions,)."""
        return np.asarray((distances / self.floor).mean(axis=-1))


def aspect_reference(
    aspects: Sequence[Aspect], *, duration: float, seed: int = 0
) -> AspectReference:
    """Return the aspects of a recording, ready for comparison.

    Parameters
    ----------
    aspects : sequence of Aspect
        Of the recording, from `form_aspects`; those with fewer than 30 points are left out.
    duration : float
        From the first to the last sample [s].
    seed : int
        Seed of the random halves.

    Raises
    ------
    InputError
        When no aspect has 30 points.

    Examples
    --------
    >>> from driftwalk.comparison.aspects.form import form_aspects
    >>> from driftwalk.comparison.aspects.plan import plan_aspects
    >>> x, y = np.cumsum(np.random.default_rng(1).normal(size=(2, 2000)), axis=1)
    >>> aspects = form_aspects(plan_aspects(np.arange(2000.0)), x, y)
    >>> reference = aspect_reference(aspects, duration=1999.0)
    >>> float(reference.distances([aspects]).max())
    0.0
    """
    kept = [one for one in aspects if len(one.points) >= FEWEST_POINTS]
    if not kept:
        raise InputError(
            f"no aspect of the motion has {FEWEST_POINTS} points: the recording hardly moves, or "
            "is too short for the step interval (`step_interval`)"
        )
    random = np.random.default_rng(seed)
    halves = [random.permutation(BLOCKS) < BLOCKS // 2 for _ in range(HALVINGS)]
    floor = [_between_halves(one, duration, halves, over=np.sqrt(2.0)) for one in kept]
    return AspectReference(
        tuple(one.name for one in kept),
        np.array(floor),
        tuple(KsReference(one.points) for one in kept),
    )


def block_of(time: npt.ArrayLike, duration: float) -> npt.NDArray[np.int64]:
    """Return the block of time of each instant, 0 to 19.

    Examples
    --------
    >>> block_of([0.0, 4.9, 5.1, 100.0], 100.0).tolist()
    [0, 0, 1, 19]
    """
    share = np.asarray(time, dtype=np.float64) / duration
    return np.clip((share * BLOCKS).astype(np.int64), 0, BLOCKS - 1)


def interleaved(aspects: Sequence[Aspect], *, duration: float) -> tuple[list[Aspect], list[Aspect]]:
    """Return the aspects in the even and in the odd blocks of a recording."""
    odd = [block_of(one.time, duration) % 2 == 1 for one in aspects]
    return (
        [one.within(~chosen) for one, chosen in zip(aspects, odd, strict=True)],
        [one.within(chosen) for one, chosen in zip(aspects, odd, strict=True)],
    )


def points_distance(reference: KsReference, points: Floats) -> float:
    """Return the KS distance, without a word on ties; 1 where there is no point."""
    if not len(points):
        return 1.0
    d1, d2, *_ = reference.native.compare(points, False)
    return (d1 + d2) / (2 * len(reference) * len(points))


def own_distance(aspect: Aspect, *, duration: float, seed: int = 0) -> float:
    """Return how far the parts of a recording are from each other, when they are interleaved.

    The mean over random choices of one block of each two that follow each other: what changes
    slowly is in either part.

    Parameters
    ----------
    aspect : Aspect
        Of the recording.
    duration : float
        From the first to the last sample [s].
    seed : int
        Seed of the choices.
    """
    random = np.random.default_rng(seed)
    first = random.integers(0, 2, size=(HALVINGS, BLOCKS // 2))
    halves = np.stack([first == 0, first == 1], axis=2).reshape(HALVINGS, BLOCKS)
    return _between_halves(aspect, duration, list(halves))


def _between_halves(
    aspect: Aspect, duration: float, halves: Sequence[Bools], *, over: float = 1.0
) -> float:
    """Return the mean distance between halves of the blocks and the rest, over a number."""
    block = block_of(aspect.time, duration)
    found = []
    for half in halves:
        chosen = half[block]
        if chosen.any() and not chosen.all():
            first, second = aspect.within(chosen), aspect.within(~chosen)
            found.append(points_distance(KsReference(first.points), second.points))
    # A recording that does not differ from itself: as many steps as it takes to see a difference.
    least = 1.0 / len(aspect.points)
    return max(float(np.mean(found)) / over, least) if found else 1.0
