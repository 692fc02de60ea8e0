"""Executor on a Dask cluster: each worker gets a function once, then units."""

from __future__ import annotations

import time
import warnings
from collections import OrderedDict
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from driftwalk.sweep.remote import KEPT, Answer, Guard, packed, run_unit

if TYPE_CHECKING:
    import numpy.typing as npt

    from driftwalk.sweep.design import WorkUnit

UnitFunction = Callable[["WorkUnit"], Mapping[str, "npt.NDArray[Any]"]]


@dataclass
class UnitCounts:
    """Units of the sweep that is under way, and of all sweeps.

    Attributes
    ----------
    done, total : int
        Of the present sweep.
    again : int
        Units that took long, and were handed to a second worker, in all sweeps.
    """

    done: int = 0
    total: int = 0
    again: int = 0


class WorkerExecutor(Executor):
    """An executor whose tasks run on the workers of a Dask cluster.

    Parameters
    ----------
    client : distributed.Client
        Of the cluster.
    guard : callable, optional
        Called once in every process before its first unit; raises `ClusterError` where that must
        not compute.

    Attributes
    ----------
    units : UnitCounts
        What has been done.
    """

    def __init__(self, client: Any, guard: Guard | None = None) -> None:
        self.client = client
        self.units = UnitCounts()
        self._guard = guard
        self._executor = client.get_executor(pure=False)
        self._parcels: OrderedDict[str, Any] = OrderedDict()
        self._submitted = 0
        self._counted = (-float("inf"), 0)

    @property
    def workers(self) -> int:
        """How many workers there are; counted at most once a second."""
        when, count = self._counted
        if time.monotonic() - when > 1.0:
            count = len(self.client.scheduler_info(n_workers=-1)["workers"])
            self._counted = (time.monotonic(), count)
        return count

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Have a function called by a worker."""
        future: Future[Any] = self._executor.submit(fn, *args, **kwargs)
        return future

    def sent(self, function: UnitFunction) -> Any:
        """Return the function of a sweep as what workers fetch: the same one twice is one."""
        parcel = packed(function, self._guard)
        if parcel.token not in self._parcels:
            # A task, unlike data that is scattered, is made again when all who held it have died.
            with warnings.catch_warnings():
                # A recording and a flow are some MB: sent once, they are no large graph.
                warnings.filterwarnings("ignore", message="Sending large graph")
                self._parcels[parcel.token] = self.client.submit(
                    _as_it_is, parcel, key=f"driftwalk-function-{parcel.token}", pure=False
                )
            while len(self._parcels) > KEPT:
                self._parcels.popitem(last=False)
        self._parcels.move_to_end(parcel.token)
        return self._parcels[parcel.token]

    def run(self, parcel: Any, unit: WorkUnit) -> Future[Answer]:
        """Have a unit computed with a function that was sent."""
        self._submitted += 1
        key = f"driftwalk-unit-{unit.id}-{parcel.key[-8:]}-{self._submitted}"
        future: Future[Answer] = self._executor.submit(run_unit, parcel, unit, key=key, pure=False)
        return future


def _as_it_is(parcel: Any) -> Any:
    return parcel
