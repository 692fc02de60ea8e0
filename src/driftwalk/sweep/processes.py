"""Process executor, for work that holds the interpreter lock."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

LINEAR_ALGEBRA_THREADS: Final = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)


@contextmanager
def single_threaded_processes(count: int) -> Iterator[ProcessPoolExecutor]:
    """Give an executor of `count` processes whose linear algebra has one thread each.

    Results then have the same bits whatever the number of processes. The processes end with the
    block, also when it is left by an error or when this process is killed; Ctrl-C is for this
    process alone.

    Parameters
    ----------
    count : int
        Number of processes, at least 1.

    Yields
    ------
    concurrent.futures.ProcessPoolExecutor
        Functions and their arguments must pickle. A script that comes here needs
        ``if __name__ == "__main__":`` around what it does, as for every use of processes.

    Examples
    --------
    >>> with single_threaded_processes(2) as executor:  # doctest: +SKIP
    ...     list(executor.map(abs, [-1, 2]))
    [1, 2]
    """
    import multiprocessing

    context = multiprocessing.get_context("spawn")
    reader, writer = context.Pipe(duplex=False)
    with _environment(dict.fromkeys(LINEAR_ALGEBRA_THREADS, "1")):
        executor = ProcessPoolExecutor(
            count, mp_context=context, initializer=_begin, initargs=(reader,)
        )
        try:
            yield executor
            executor.shutdown()
        except BaseException:
            executor.shutdown(wait=False, cancel_futures=True)
            raise
        finally:
            writer.close()
            reader.close()


@contextmanager
def _environment(values: dict[str, str]) -> Iterator[None]:
    """Set variables of the environment, which processes inherit; restore them after."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _begin(alive: Connection) -> None:
    """Leave Ctrl-C to the parent, and end when its end of the pipe is closed or it is dead."""
    import signal
    import threading

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(alive,), daemon=True).start()


def _end_with(alive: Any) -> None:
    try:
        alive.poll(None)
    finally:
        os._exit(1)
