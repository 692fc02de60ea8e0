"""A study of many settings: each computed on some worker, all of them together one result."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from concurrent.futures import Executor
from typing import Any, ClassVar, Generic, TypeVar

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import DriftwalkError
from driftwalk.core.files.shards import Arrays, Unit, UnitT
from driftwalk.core.progress import Progress
from driftwalk.sweep.design import Design, WorkUnit
from driftwalk.sweep.run import MemoryStore, Store, SweepError, run_sweep

ResultT = TypeVar("ResultT")


class SweepStudy(ABC, Generic[ResultT]):
    """A design, what is computed at each of its settings, and the result of all.

    Recovery studies, sensitivity analyses and the nodes of an emulator are such studies.
    """

    names_units: ClassVar[bool] = True
    """Whether an error names the work unit that failed. Where any setting may show a mistake of the
    user, that is raised as it is."""

    def check(self) -> None:
        """Raise what forbids the whole study, before anything is computed."""

    @abstractmethod
    def design(self) -> Design:
        """Return the settings."""

    @property
    def unit_size(self) -> int:
        """Number of settings that are computed and stored at once."""
        return 1

    @abstractmethod
    def __call__(self, unit: WorkUnit) -> Arrays:
        """Return arrays with one entry per setting of a work unit; they may hold text."""

    @abstractmethod
    def result(self, found: Arrays) -> ResultT:
        """Return the result of the study, from arrays with the dimensions of the design."""

    def sweep(
        self,
        *,
        store: Store | None = None,
        executor: Executor | None = None,
        progress: Progress | None = None,
    ) -> ResultT:
        """Compute all settings that a store lacks, and return the result of the study.

        Raises
        ------
        InputError
            As `check`; without `names_units` also when a setting shows a mistake of the user.
        SweepError
            When the computation of a setting fails; names its work unit.
        """
        self.check()
        design = self.design()
        try:
            found = run_sweep(
                self,
                design.units(self.unit_size),
                store=_TextStore(MemoryStore() if store is None else store),
                executor=executor,
                progress=progress,
            )
        except SweepError as error:
            if not self.names_units and isinstance(error.__cause__, DriftwalkError):
                raise error.__cause__ from None
            raise
        return self.result(design.unstack(found))


class _TextStore:
    """A store that keeps text too: class names differ from unit to unit, in number and length."""

    def __init__(self, inner: Store) -> None:
        self._inner = inner

    def missing(self, units: Iterable[UnitT]) -> list[UnitT]:
        """Return the units that have no result yet."""
        return self._inner.missing(units)

    def write(self, unit: Unit, arrays: Mapping[str, npt.NDArray[Any]]) -> None:
        """Keep what a unit gave, text as arrays of bytes."""
        encoded = {
            name: np.char.encode(values.astype(str)) if values.dtype == object else values
            for name, values in arrays.items()
        }
        self._inner.write(unit, encoded)

    def read(self, unit: Unit) -> Arrays:
        """Return what was kept for a unit."""
        return {name: _with_text(values) for name, values in self._inner.read(unit).items()}


def _with_text(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return text as objects, from bytes or as it is."""
    if values.dtype.kind == "S":
        values = np.char.decode(values)
    return values.astype(object) if values.dtype.kind == "U" else values
