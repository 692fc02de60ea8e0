"""Workers for the time of a run: reached or begun, checked, counted, and let go at its end."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import ExitStack, contextmanager
from importlib import import_module
from typing import Any, Final

from driftwalk.cluster.address import ClusterAddress
from driftwalk.cluster.jobs import begin_jobs
from driftwalk.cluster.versions import refuse_other_workers
from driftwalk.core.errors import ClusterError, InputError

ANSWER_S: Final = 10.0
"""How long a scheduler may take to answer [s]."""
LOOK_S: Final = 1.0
"""How often workers are counted [s]."""
REMARK_S: Final = 10.0
"""How often it is said that no worker has come yet [s]."""

Say = Callable[[str], None]


class Cluster:
    """Workers that are there.

    Attributes
    ----------
    executor : concurrent.futures.Executor
        Runs the units of a sweep on them.
    dashboard : str
        Address of the page that shows what they do.
    """

    def __init__(self, client: Any, address: ClusterAddress) -> None:
        self.executor: Executor = client.get_executor(pure=False)
        self.dashboard = str(client.dashboard_link)
        self._client, self._address = client, address
        self._lost = 0
        self._counted = (-float("inf"), 0)
        client.subscribe_topic("all", self._heard)

    @property
    def workers(self) -> int:
        """How many there are now; counted at most once a second."""
        when, count = self._counted
        if time.monotonic() - when > LOOK_S:
            count = len(self._client.scheduler_info(n_workers=-1)["workers"])
            self._counted = (time.monotonic(), count)
        return count

    @property
    def words(self) -> str:
        """Their number, for a line of progress."""
        return f"{self.workers} worker{'' if self.workers == 1 else 's'}"

    def report(self) -> str:
        """Return what happened to the workers, in a sentence; nothing where all went well."""
        if not self._lost:
            return ""
        lost = "1 worker was" if self._lost == 1 else f"{self._lost} workers were"
        return f"{lost} lost; the units there were computed again, and the result is the same"

    def _heard(self, event: tuple[float, Any]) -> None:
        """Note a worker that went without being asked to."""
        what = event[1]
        if what.get("action") == "remove-worker" and not what.get("expected"):
            self._lost += 1


@contextmanager
def connect(address: ClusterAddress, *, say: Say | None = None) -> Iterator[Cluster]:
    """Give workers for the time of a block.

    Parameters
    ----------
    address : ClusterAddress
        See `parse_address`.
    say : callable, optional
        Called with a sentence, where something is to be waited for.

    Raises
    ------
    InputError
        When the extra ``driftwalk[cluster]`` is not installed.
    ClusterError
        When no scheduler answers, jobs cannot be submitted, or workers have another version of
        driftwalk.

    Examples
    --------
    >>> import driftwalk as dw
    >>> from driftwalk.cluster import connect, parse_address
    >>> with connect(parse_address("local:2")) as cluster:  # doctest: +SKIP
    ...     found = dw.assemble(dw.Study(), dw.tank30_flow(), executor=cluster.executor)
    """
    _require_dask()
    say = say if say is not None else _silent
    with ExitStack() as stack:
        stack.enter_context(_quiet())
        client = stack.enter_context(_client(address, stack))
        _await_workers(client, address, say)
        refuse_other_workers(client)
        cluster = Cluster(client, address)
        say(f"{cluster.words} at {address.words}, dashboard {cluster.dashboard}")
        yield cluster


def _require_dask() -> None:
    try:
        import distributed  # noqa: F401
    except ImportError as error:
        raise InputError(
            "workers need Dask, which is not installed: pip install 'driftwalk[cluster]'"
        ) from error


def _client(address: ClusterAddress, stack: ExitStack) -> Any:
    """Return a client of a scheduler, which is begun where there is none yet."""
    distributed: Any = import_module("distributed")
    if address.kind == "scheduler":
        try:
            return distributed.Client(address.url, timeout=ANSWER_S, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            raise ClusterError(
                f"no scheduler answers at {address.url}: {_reason(error)}; begin one with 'dask "
                "scheduler', and workers with 'dask worker'"
            ) from error
    if address.kind == "local":
        begun = distributed.LocalCluster(
            n_workers=address.workers,
            threads_per_worker=1,
            processes=True,
            memory_limit=0,
            dashboard_address=":0",
            silence_logs=logging.CRITICAL,
        )
    else:
        begun = begin_jobs(address)
    stack.enter_context(begun)
    return distributed.Client(begun, set_as_default=False)


def _await_workers(client: Any, address: ClusterAddress, say: Say) -> None:
    """Wait for the first worker, however long its job is in the queue."""
    began = said = time.monotonic()
    while not client.scheduler_info(n_workers=-1)["workers"]:
        now = time.monotonic()
        if now - said > REMARK_S:
            said = now
            say(f"no worker of {address.words} has come in {now - began:.0f} s; waiting")
        time.sleep(0.1)


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep Dask's own log off the terminal: what matters is said by driftwalk."""
    loggers = [logging.getLogger(name) for name in ("distributed", "tornado")]
    before = [one.level for one in loggers]
    for one in loggers:
        one.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for one, level in zip(loggers, before, strict=True):
            one.setLevel(level)


def _reason(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__


def _silent(_: str) -> None:
    """Say nothing."""
