"""Workers for the time of a run: reached or begun, checked for the same bits, counted, let go."""

from __future__ import annotations

import hashlib
import logging
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from typing import Any, Final

import numpy as np

from driftwalk.cluster.address import ClusterAddress, begin_jobs
from driftwalk.core.errors import ClusterError, InputError, reason_of
from driftwalk.core.extras import show_dask
from driftwalk.core.progress import ignore_progress
from driftwalk.core.provenance import package_versions
from driftwalk.flow import uniform_flow
from driftwalk.model import Study, Tank
from driftwalk.simulation import simulate
from driftwalk.sweep import WorkerExecutor, refuse_others, this_worker

SHOWN: Final = 12
"""Digits of a hash in a message."""


def probe_digest() -> str:
    """Return the SHA-256 of a short simulation: drag, force and impacts on the wall.

    It is the same on every processor, for every compiler and number of threads.

    Examples
    --------
    >>> len(probe_digest())
    64
    """
    # The flow carries every block to the wall of this narrow tank.
    study = Study(tank=Tank(diameter_m=0.15))
    found = simulate(
        study,
        uniform_flow(0.03, -0.01),
        sample_time=np.arange(0.0, 30.0, 0.5),
        # More than the lanes of any instruction set, and not a whole number of them.
        replicates=20,
        seed=1729,
        threads=1,
    )
    digest = hashlib.sha256()
    for name in ("x", "y", "theta", "status"):
        digest.update(np.ascontiguousarray(found[name].values).tobytes())
    return digest.hexdigest()


@dataclass(frozen=True)
class SameBits:
    """Lets a process compute only if the probe gives the same bits there.

    Attributes
    ----------
    expected : str
        What `probe_digest` gives on the machine of the run.
    """

    expected: str

    def __call__(self) -> None:
        """Raise where this process has other bits.

        Raises
        ------
        ClusterError
            Names the machine.
        """
        refuse_other_bits(self.expected, probe_digest(), this_worker())


def refuse_other_bits(expected: str, found: Any, who: str) -> None:
    """Raise where a probe gave other bits.

    Parameters
    ----------
    expected : str
        What this machine gives.
    found : Any
        What was found elsewhere.
    who : str
        Where, for the message.

    Raises
    ------
    ClusterError
        Names the machine.

    Examples
    --------
    >>> refuse_other_bits("60d1", "60d1", "a worker on node7")
    """
    if found != expected:
        raise ClusterError(
            f"{who} computes other numbers than this machine: a short simulation gave "
            f"{str(found)[:SHOWN]} there, {expected[:SHOWN]} here; install the same driftwalk "
            "there, from the same package"
        )


Say = Callable[[str], None]


class Cluster:
    """Workers that are there.

    Attributes
    ----------
    executor : WorkerExecutor
        Runs the units of a sweep on them.
    dashboard : str
        Address of the page that shows what they do.
    """

    def __init__(self, client: Any, guard: SameBits) -> None:
        self.executor = WorkerExecutor(client, guard)
        self.dashboard = str(client.dashboard_link)
        self._lost = self._ended = 0
        self._client = client
        # The topic under which the scheduler reports that a worker has come or gone.
        client.subscribe_topic("all", self._heard)

    @property
    def workers(self) -> int:
        """How many there are now; counted at most once a second."""
        return self.executor.workers

    @property
    def words(self) -> str:
        """The units of the present stage and the workers, for a line of progress."""
        units = self.executor.units
        now = _number(self.workers, "worker")
        return f"{units.done} of {_number(units.total, 'unit')}, {now}" if units.total else now

    def report(self) -> str:
        """Return what happened to the workers, in a sentence; nothing where all went well."""
        lost, ended, again = self._lost, self._ended, self.executor.units.again
        events = (
            (lost, "worker", f"{_was(lost)} lost; the units there were computed again"),
            (ended, "worker", "ended before the run did, such as jobs whose time was over; the "
             "units there were computed again"),
            (again, "unit", f"took long and {_was(again)} computed by a second worker, too"),
        )  # fmt: skip
        said = [f"{_number(count, what)} {why}" for count, what, why in events if count]
        return "; ".join([*said, "the result is the same"]) if said else ""

    def let_go(self) -> None:
        """Hear no more of the workers: a scheduler that ends would only complain."""
        # Where it is gone already nothing is to be said.
        with suppress(Exception):
            self._client.unsubscribe_topic("all")

    def _heard(self, event: tuple[float, Any]) -> None:
        """Note a worker that went."""
        what = event[1]
        if what.get("action") == "remove-worker":
            if what.get("expected"):
                self._ended += 1
            else:
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
        When no scheduler answers, jobs cannot be submitted, or a worker has another version of
        driftwalk or gives other bits.

    Examples
    --------
    >>> import driftwalk as dw
    >>> from driftwalk.cluster import connect, parse_address
    >>> with connect(parse_address("local:2")) as cluster:  # doctest: +SKIP
    ...     found = dw.assemble(dw.Study(), dw.tank30_flow(), executor=cluster.executor)
    """
    _require_dask()
    say = say if say is not None else ignore_progress
    with ExitStack() as stack:
        stack.enter_context(_quiet())
        client = stack.enter_context(_client(address, stack))
        _await_workers(client, address, say)
        cluster = Cluster(client, refuse_other_workers(client))
        say(f"{cluster.words} at {address.words}, dashboard {cluster.dashboard}")
        stack.callback(cluster.let_go)
        yield cluster


def _require_dask() -> None:
    show_dask()
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
            return distributed.Client(address.url, timeout=10.0, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            raise ClusterError(
                f"no scheduler answers at {address.url}: {reason_of(error)}; begin one with 'dask "
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
    if address.kind == "local":
        _replace_lost(begun, address.workers, stack)
    return distributed.Client(begun, set_as_default=False)


def _replace_lost(begun: Any, workers: int, stack: ExitStack) -> None:
    """Replace workers that Dask gave up: those that take over 15 s to come back."""
    ended = threading.Event()

    def look() -> None:
        while not ended.wait(1.0) and begun.status.name == "running":
            # The loop of a cluster that is being closed takes no more calls.
            with suppress(RuntimeError):
                begun.scale(workers)

    threading.Thread(target=look, daemon=True).start()
    stack.callback(ended.set)


def _await_workers(client: Any, address: ClusterAddress, say: Say) -> None:
    """Wait for the first worker, however long its job is in the queue."""
    began = said = time.monotonic()
    while not client.scheduler_info(n_workers=-1)["workers"]:
        now = time.monotonic()
        if now - said > 10.0:
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


def _number(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"


def _was(count: int) -> str:
    return "was" if count == 1 else "were"


def refuse_other_workers(client: Any) -> SameBits:
    """Raise where a worker has another version of driftwalk, or none, or gives other bits.

    Parameters
    ----------
    client : distributed.Client
        Of the workers.

    Returns
    -------
    SameBits
        The same check for workers that come later.

    Raises
    ------
    ClusterError
        Names the worker, and both versions or both hashes.
    """
    wanted = package_versions(["driftwalk"])
    # A function of the standard library: one of driftwalk's own would not run where it is missing.
    for worker, found in _asked(client, version, "driftwalk"):
        there = None if isinstance(found, PackageNotFoundError) else str(found)
        refuse_others(wanted, {"driftwalk": there}, worker)
    expected = probe_digest()
    for worker, found in _asked(client, probe_digest):
        refuse_other_bits(expected, found, worker)
    return SameBits(expected)


def _asked(client: Any, function: Callable[..., Any], *arguments: Any) -> Iterator[tuple[str, Any]]:
    """Call a function on every worker, and give its name and what it said."""
    for address, found in client.run(function, *arguments, on_error="return").items():
        worker = f"the worker {address}"
        if isinstance(found, BaseException) and not isinstance(found, PackageNotFoundError):
            raise ClusterError(f"{worker} does not answer: {type(found).__name__}: {found}")
        yield worker, found
