"""Histories of outcome classes: the sojourns of every run, one class after the other."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.lattice.polyomino import shape_size
from driftwalk.assembly.outcomes.outcome_classes import class_shapes
from driftwalk.core.arrays import Bools, Floats, Integers
from driftwalk.core.errors import InputError
from driftwalk.schema.check import require_kind
from driftwalk.schema.kinds import find_kind
from driftwalk.schema.kinds.assembly import ASSEMBLY
from driftwalk.schema.shapes import MOST_NAMED, all_single, counted_assemblies

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr

OPEN = -1
"""In place of the next class where a sojourn was still under way at the end of its run."""
MOST_CLASSES = 200
"""Classes that occur, at most: as many as 7 blocks have. Chosen by hand."""


class Histories(NamedTuple):
    """Sojourns in outcome classes, those of a run one after the other."""

    classes: tuple[str, ...]
    run: Integers
    """Number of the run of each sojourn, ascending, shape (sojourn,)."""
    state: Integers
    """Its class: index into `classes`."""
    duration: Floats
    """How long it lasted [s]; above zero."""
    target: Integers
    """The class after it, `OPEN` where it was under way at the end."""
    runs: int

    @property
    def first(self) -> Bools:
        """Whether a sojourn is the first of its run."""
        return np.r_[True, self.run[1:] != self.run[:-1]] if self.run.size else self.run > 0

    @property
    def joins(self) -> int:
        """Number of observed changes of class."""
        return int((self.target >= 0).sum())

    def of(self, chosen: Bools) -> Histories:
        """Return the histories of chosen runs, shape (run,), numbered from 0."""
        found, number = self._sojourns(chosen[self.run]), np.cumsum(chosen) - 1
        return found._replace(run=number[found.run], runs=int(chosen.sum()))

    @property
    def entry(self) -> Floats:
        """When each sojourn began, from the start of its run [s]."""
        before = np.cumsum(self.duration) - self.duration
        return before - np.maximum.accumulate(np.where(self.first, before, 0.0))

    def until(self, end: float) -> Histories:
        """Return what is seen of the histories up to a time from the start of their runs [s]."""
        begun = self.entry < end
        left = np.minimum(self.duration, end - self.entry)
        target = np.where(left < self.duration, OPEN, self.target)
        return self._replace(duration=left, target=target)._sojourns(begun)

    def _sojourns(self, kept: Bools) -> Histories:
        columns = ("run", "state", "duration", "target")
        return self._replace(**{name: getattr(self, name)[kept] for name in columns})

    def recorded_s(self) -> float:
        """Return the length of the longest run [s]."""
        return float(np.bincount(self.run, self.duration).max())


def histories(datasets: Sequence[xr.Dataset], *, classes: Sequence[str] | None = None) -> Histories:
    """Return the histories of runs and recordings of the same number of blocks.

    Parameters
    ----------
    datasets : sequence of xarray.Dataset
        Of kind "assembly" (each run is a history) or "classification" (each is one history).
    classes : sequence of str, optional
        Further classes to list.

    Raises
    ------
    InputError
        When a dataset is of another kind, numbers of blocks differ, or no run has a class.
    """
    rows: list[tuple[list[str], Floats, float]] = []
    for found in datasets:
        require_kind(found, "assembly classification", "kinetics need one of them")
        rows += _of_runs(found) if find_kind(found) is ASSEMBLY else _of_recording(found)
    passed = dict.fromkeys(name for row in rows for name in row[0])
    if counted := [name for name in passed if counted_assemblies(name)]:
        raise InputError(
            f"the class '{counted[0]}' counts assemblies, as classes of more than {MOST_NAMED} "
            f"blocks do, and rates are between shapes: use at most {MOST_NAMED} blocks"
        )
    names = tuple(dict.fromkeys([*(classes or ()), *passed]))
    if not rows:
        raise InputError("no run has an outcome class: there is nothing to estimate rates from")
    sizes = {blocks_of(name) for name in names}
    if len(sizes) > 1:
        raise InputError(
            f"runs of {' and '.join(map(str, sorted(sizes)))} blocks cannot be combined: give only "
            "runs with one number of blocks"
        )
    if len(names) > MOST_CLASSES:
        raise InputError(
            f"{len(names)} outcome classes occur, and rates are estimated for {MOST_CLASSES} at "
            "most: use fewer blocks"
        )
    return _listed(rows, names)


def datasets_of(given: xr.Dataset | Sequence[xr.Dataset]) -> list[xr.Dataset]:
    """Return one or several datasets as a list."""
    import xarray as xr

    return [given] if isinstance(given, xr.Dataset) else list(given)


def blocks_of(name: str) -> int:
    """Return the number of blocks of an outcome class; of discs those of its contact graphs.

    Examples
    --------
    >>> blocks_of("2+1+1")
    4
    """
    return sum(shape_size(shape) for shape in class_shapes(name))


def _listed(rows: list[tuple[list[str], Floats, float]], names: tuple[str, ...]) -> Histories:
    place = {name: index for index, name in enumerate(names)}
    run = np.repeat(np.arange(len(rows)), [len(passed) for passed, _, _ in rows])
    state = np.array([place[name] for passed, _, _ in rows for name in passed], dtype=np.int64)
    target = np.append(state[1:], OPEN)
    target[np.flatnonzero(np.diff(run))] = OPEN
    lasts = np.concatenate([np.diff(entry, append=end) for _, entry, end in rows])
    # Two events of one time step: the class between them lasted less than the step.
    shortest = lasts[lasts > 0].min(initial=1.0)
    return Histories(names, run, state, np.maximum(lasts, 0.5 * shortest), target, len(rows))


def _of_runs(assembly: xr.Dataset) -> list[tuple[list[str], Floats, float]]:
    """Return class names, entry times and end of every run."""
    names = [str(name) for name in assembly["class"].values]
    start = all_single(int(assembly.attrs["blocks"]))
    time, after, end = (assembly[name].values for name in ("event_time", "event_class", "end_time"))
    real = np.isfinite(time) & (after >= 0)
    rows = []
    for at in np.flatnonzero(assembly["outcome"].values >= 0):
        passed = [start, *(names[index] for index in after[at, real[at]].tolist())]
        entry = np.concatenate([[0.0], time[at, real[at]]])
        begun = int((entry == 0.0).nonzero()[0][-1])  # glued blocks join at time 0
        rows.append((*merged_history(passed[begun:], entry[begun:]), float(end[at])))
    return rows


def _of_recording(found: xr.Dataset) -> list[tuple[list[str], Floats, float]]:
    """Return the history of a recording; an unknown class is taken to last until it is seen."""
    known = np.flatnonzero(found["outcome"].values >= 0)
    if known.size < 2:
        return []
    time: npt.NDArray[Any] = found["time"].values[known]
    names = found["class"].values[found["outcome"].values[known]]
    return [(*merged_history([str(name) for name in names], time), float(time[-1]))]


def merged_history(passed: list[str], entry: Floats) -> tuple[list[str], Floats]:
    """Return a history, names and entry times, in which a class is entered only from another."""
    fresh = [0, *(k for k in range(1, len(passed)) if passed[k] != passed[k - 1])]
    return [passed[k] for k in fresh], entry[fresh]
