"""Send a function to remote workers once, and check the worker that runs it.

A unit is a few numbers; the function of a sweep holds a flow, a recording, a model. On a Dask
cluster the function is therefore a separate object, which a worker fetches with its first unit.
"""

from __future__ import annotations

import hashlib
import pickle
import platform
import sys
import time
from collections import OrderedDict
from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import ClusterError
from driftwalk.core.provenance import package_versions
from driftwalk.sweep.design import WorkUnit

KEPT: Final = 4
"""Functions that a process keeps ready: one for each stage that may be under way."""
ALIKE: Final = ("driftwalk",)
ALIKE_LINEAR_ALGEBRA: Final = ("driftwalk", "numpy", "scipy")

USER_MODULE: Final = "_driftwalk_"
"""How the names of modules begin that are a file of the user's."""

Guard = Callable[[], None]
"""Raises `ClusterError` in a process that must not compute."""

_ready: OrderedDict[str, Any] = OrderedDict()
_passed: set[Guard] = set()


class Parcel(NamedTuple):
    """The function of a sweep, as it travels."""

    token: str
    """Hash of the content: the same function twice is one."""
    content: bytes
    """The function, pickled."""
    versions: dict[str, str]
    """Of the packages that must be the same where it runs."""
    guard: Guard | None
    """Has to pass where it runs."""


class Answer(NamedTuple):
    """Result of a unit on a worker."""

    arrays: dict[str, npt.NDArray[Any]]
    seconds: float
    """By the worker's clock."""


def packed(function: Any, guard: Guard | None = None) -> Parcel:
    """Return a function as it travels.

    Parameters
    ----------
    function : callable
        The function of a sweep. Where it has a true attribute ``linear_algebra`` its results
        depend on numpy and scipy, and these must be the same where it runs.
    guard : callable, optional
        Called once in each process, before the function.

    Raises
    ------
    ClusterError
        When it does not pickle.
    """
    import cloudpickle

    for name, module in list(sys.modules.items()):
        # A model from a file of the user's: no worker has that module.
        if name.startswith(USER_MODULE):
            cloudpickle.register_pickle_by_value(module)
    names = ALIKE_LINEAR_ALGEBRA if getattr(function, "linear_algebra", False) else ALIKE
    try:
        content = cloudpickle.dumps(function)
    except Exception as error:
        raise ClusterError(
            f"this work cannot be sent to workers: {error}; run it without a cluster"
        ) from error
    token = hashlib.sha256(content).hexdigest()
    return Parcel(token, content, package_versions(names), guard)


def run_unit(parcel: Parcel, unit: WorkUnit) -> Answer:
    """Run a function that has travelled, on a worker.

    Raises
    ------
    ClusterError
        When the worker has another version of a package that the result depends on, or does not
        pass the guard.
    """
    refuse_others(parcel.versions, package_versions(parcel.versions), this_worker())
    if parcel.guard is not None and parcel.guard not in _passed:
        parcel.guard()
        _passed.add(parcel.guard)
    if parcel.token not in _ready:
        _ready[parcel.token] = pickle.loads(parcel.content)
        while len(_ready) > KEPT:
            _ready.popitem(last=False)
    _ready.move_to_end(parcel.token)
    began = time.perf_counter()
    found = _ready[parcel.token](unit)
    arrays = {name: np.asarray(values) for name, values in found.items()}
    return Answer(arrays, time.perf_counter() - began)


def this_worker() -> str:
    """Return how a worker calls itself in a message.

    Examples
    --------
    >>> this_worker().startswith("a worker on ")
    True
    """
    return f"a worker on {platform.node()}"


def refuse_others(wanted: Mapping[str, str], found: Mapping[str, str | None], who: str) -> None:
    """Raise where versions differ.

    Parameters
    ----------
    wanted, found : mapping of str to str
        Versions by package.
    who : str
        Who has found them, for the message.

    Raises
    ------
    ClusterError
        Names the package and both versions.

    Examples
    --------
    >>> refuse_others({"driftwalk": "0.1.0"}, {"driftwalk": "0.1.0"}, "a worker on node7")
    """
    for name, version in wanted.items():
        if found.get(name) != version:
            there = found.get(name) or "none"
            raise ClusterError(
                f"{who} has {name} {there}, this machine has {version}: install {name} {version} "
                "there, so that the numbers are the same"
            )
