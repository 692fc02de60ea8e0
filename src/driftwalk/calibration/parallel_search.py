"""Parallel search: models searched at the same time in threads of this process.

The simulations and distances of one model leave Python now and then only, so two threads in one
model keep 1.2 processors busy, and two models with one thread each 1.8.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from threading import Lock

from driftwalk.calibration.held_out.candidates import Candidate
from driftwalk.core.background_task import CancelOnError
from driftwalk.motion import BlockModel, ParticleModel


def runs_in_threads(entry: Candidate) -> bool:
    """Return whether several threads may simulate a model: nobody knows of a user's own."""
    return entry.baseline or isinstance(entry.model, BlockModel | ParticleModel)


def longest_first(places: Sequence[int], entries: Sequence[Candidate]) -> list[int]:
    """Return places of models so that none is left over for one processor at the end.

    The block takes more steps of time than the others, which take the longer the more they have to
    search.
    """
    return sorted(
        places,
        key=lambda k: (not isinstance(entries[k].model, BlockModel), -len(entries[k].ranges)),
    )


def with_thread_share(entry: Candidate, count: int) -> Candidate:
    """Return a model with its share of the threads, where so many are searched at a time."""
    each = max(entry.like.threads // max(count, 1), 1)
    return entry._replace(like=replace(entry.like, threads=each))


@contextmanager
def thread_pool(count: int) -> Iterator[ThreadPoolExecutor | None]:
    """Give threads for several models; none where there is one processor.

    Left by an error, also by Ctrl-C, they are not waited for.
    """
    if count < 2:
        yield None
        return
    pool = ThreadPoolExecutor(count, thread_name_prefix="model")
    try:
        yield pool
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


class SearchProgress:
    """How far several searches are.

    Parameters
    ----------
    names : sequence of str
        Of the models.
    costs : sequence of int
        Settings that each simulates at most.
    tell : callable
        Called with the settings done, in all, and the models under way.

    Attributes
    ----------
    cancellation : CancelOnError
        The block that waits for the searches; they end with it.
    """

    def __init__(
        self, names: Sequence[str], costs: Sequence[int], tell: Callable[[int, str], None]
    ) -> None:
        self._names, self._costs, self._tell = names, costs, tell
        self._done = [0] * len(names)
        self._under_way: set[int] = set()
        self._lock = Lock()
        self.cancellation = CancelOnError()

    def finished(self, indices: Sequence[int]) -> None:
        """Hear which models were searched before."""
        for index in indices:
            self._done[index] = self._costs[index]

    def __call__(self, index: int, done: int) -> None:
        """Hear how many settings of a model are done; all of them when it is finished."""
        self.cancellation.raise_if_cancelled()
        with self._lock:
            self._done[index] = done
            if done < self._costs[index]:
                self._under_way.add(index)
            else:
                self._under_way.discard(index)
            names = ", ".join(self._names[k] for k in sorted(self._under_way))
            self._tell(sum(self._done), names or self._names[index])
