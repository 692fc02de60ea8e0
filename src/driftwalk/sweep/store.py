"""Storage of a sweep's results. `driftwalk.core.files.shards` defines the files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError
from driftwalk.core.files.shards import Arrays, Unit, UnitT


class Store(Protocol):
    """Interface that `run_sweep` needs of a store; `ShardStore` is the one on disk."""

    def missing(self, units: Iterable[UnitT]) -> list[UnitT]:
        """Return the units that have no result yet, in their order."""

    def write(self, unit: Unit, arrays: Mapping[str, npt.NDArray[Any]]) -> None:
        """Keep what a unit gave."""

    def read(self, unit: Unit) -> Arrays:
        """Return what was kept for a unit."""


class MemoryStore:
    """The results of a sweep in memory, gone with the process.

    Examples
    --------
    >>> MemoryStore().missing([])
    []
    """

    def __init__(self) -> None:
        self._results: dict[str, Arrays] = {}

    def missing(self, units: Iterable[UnitT]) -> list[UnitT]:
        """Return the units that have no result yet, in their order."""
        return [unit for unit in units if unit.id not in self._results]

    def write(self, unit: Unit, arrays: Mapping[str, npt.NDArray[Any]]) -> None:
        """Keep what a unit gave; what is kept already stays."""
        self._results.setdefault(unit.id, {name: np.array(a) for name, a in arrays.items()})

    def read(self, unit: Unit) -> Arrays:
        """Return what was kept for a unit."""
        return dict(self._results[unit.id])


def collect(store: Store, units: Iterable[Unit]) -> Arrays:
    """Join the results of units along their first dimension, in the order of the units.

    Parameters
    ----------
    store : Store
        Where the results are.
    units : iterable of Unit
        The units, each with a result in the store.

    Returns
    -------
    dict of str to numpy.ndarray
        Shape (settings, ...) each.

    Raises
    ------
    InputError
        When there is no unit, or a unit has other arrays, types or trailing shapes than the first.
    RunDirectoryError
        When a unit's result is absent or damaged.

    Examples
    --------
    >>> collect(store, units)["ks_distance"].shape  # doctest: +SKIP
    (1681, 4)
    """
    results = [(unit.id, store.read(unit)) for unit in units]
    if not results:
        raise InputError("a sweep needs at least one work unit, got none")
    first_id, first = results[0]
    for unit_id, arrays in results[1:]:
        if _form(arrays) != _form(first):
            raise InputError(
                f"unit {unit_id} gave {_form(arrays)}, unit {first_id} gave {_form(first)}; "
                "expected the same names, types and shapes of one setting"
            )
    return {name: np.concatenate([arrays[name] for _, arrays in results]) for name in first}


def _form(arrays: Arrays) -> dict[str, str]:
    return {name: f"{a.dtype}{list(a.shape[1:])}" for name, a in sorted(arrays.items())}
