"""Design of a sweep: settings, their order and work units."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError


@dataclass(frozen=True, eq=False)
class WorkUnit:
    """A run of consecutive settings that is computed and stored at once.

    Attributes
    ----------
    start, stop : int
        The settings ``start <= i < stop`` of the design.
    settings : dict of str to numpy.ndarray
        The values of every axis, each of shape (stop - start,).
    """

    start: int
    stop: int
    settings: dict[str, npt.NDArray[Any]]

    @property
    def id(self) -> str:
        """Name of the unit: it depends on which settings it holds and on nothing else."""
        return f"{self.start:08d}-{self.stop:08d}"

    @property
    def size(self) -> int:
        """Number of settings."""
        return self.stop - self.start


def work_units(
    settings: Mapping[str, npt.NDArray[Any]], size: int, *, first: int = 0
) -> list[WorkUnit]:
    """Cut settings into work units.

    Parameters
    ----------
    settings : mapping of str to numpy.ndarray
        The values by name, one entry per setting each.
    size : int
        Settings of a unit; the last may have fewer.
    first : int
        Number of the first setting.

    Returns
    -------
    list of WorkUnit
        In the order of the settings.

    Examples
    --------
    >>> [unit.id for unit in work_units({"speed": np.arange(5.0)}, 3)]
    ['00000000-00000003', '00000003-00000005']
    """
    (count,) = {len(values) for values in settings.values()}
    return [
        WorkUnit(
            first + at,
            first + min(at + size, count),
            {name: values[at : at + size] for name, values in settings.items()},
        )
        for at in range(0, count, size)
    ]


@dataclass(frozen=True, eq=False)
class Design:
    """A grid of settings: every combination of the values of its axes, the last axis fastest.

    Attributes
    ----------
    axes : dict of str to numpy.ndarray
        The values of each axis, in the order of the dimensions.
    """

    axes: dict[str, npt.NDArray[Any]]

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each axis."""
        return tuple(values.size for values in self.axes.values())

    @property
    def size(self) -> int:
        """Number of settings."""
        return math.prod(self.shape)

    def settings(self) -> dict[str, npt.NDArray[Any]]:
        """Return the values of every axis for all settings, shape (size,) each."""
        indices = np.unravel_index(np.arange(self.size), self.shape)
        pairs = zip(self.axes.items(), indices, strict=True)
        return {name: values[index] for (name, values), index in pairs}

    def units(self, size: int) -> list[WorkUnit]:
        """Cut the settings into work units of `size` settings; the last may be shorter.

        Raises
        ------
        InputError
            When `size` is below 1.
        """
        if size < 1:
            raise InputError(f"size of a work unit: expected at least 1 setting, got {size}")
        return work_units(self.settings(), size)

    def unstack(self, arrays: Mapping[str, npt.NDArray[Any]]) -> dict[str, npt.NDArray[Any]]:
        """Turn the leading dimension of arrays, the settings, into one dimension per axis.

        Parameters
        ----------
        arrays : mapping of str to numpy.ndarray
            Shape (settings, ...) each, as `run_sweep` returns them.

        Returns
        -------
        dict of str to numpy.ndarray
            Shape ``(*self.shape, ...)`` each.

        Raises
        ------
        InputError
            When an array has another number of settings.
        """
        for name, array in arrays.items():
            if array.shape[:1] != (self.size,):
                raise InputError(
                    f"array '{name}': expected {self.size} settings, got shape {array.shape}"
                )
        return {name: array.reshape(self.shape + array.shape[1:]) for name, array in arrays.items()}

    def describe(self) -> dict[str, Any]:
        """Return the axes as plain lists, for a specification."""
        return {name: values.tolist() for name, values in self.axes.items()}


def grid(**axes: npt.ArrayLike) -> Design:
    """Return the design of every combination of the given values, the last axis fastest.

    Parameters
    ----------
    **axes : array_like, one-dimensional
        Name and values of each axis; numbers, finite. The order of the arguments is the order of
        the dimensions.

    Raises
    ------
    InputError
        When an axis is empty, not one-dimensional, no numbers or not finite.

    Examples
    --------
    >>> grid(drag_coefficient=[0.5, 1.0], replicate=range(3)).settings()["replicate"]
    array([0, 1, 2, 0, 1, 2])
    """
    if not axes:
        raise InputError("a design needs at least one axis, got none")
    return Design({name: _axis(name, values) for name, values in axes.items()})


def _axis(name: str, values: npt.ArrayLike) -> npt.NDArray[Any]:
    array = np.array(values)
    if array.ndim != 1 or array.size == 0:
        raise InputError(
            f"axis '{name}': expected a list of one or more numbers, got shape {array.shape}"
        )
    if array.dtype.kind not in "iuf":
        raise InputError(f"axis '{name}': expected numbers, got {array.dtype}")
    if not np.isfinite(array).all():
        raise InputError(f"axis '{name}': expected finite numbers, got {array.tolist()}")
    array.setflags(write=False)
    return array


class CutPolicy(NamedTuple):
    """How long a work unit takes."""

    block_steps_per_second: float = 25e6
    """Steps of single blocks, or bodies, that one core makes: 12 to 40 million, by its
    instruction set (measured: docs/explanation/performance.md)."""
    largest_s: float = 40.0
    """Longest unit [s of one core]: as much is lost where its worker dies; chosen by hand."""
    many: int = 256
    """Units of a sweep at least, so that many workers are busy; chosen by hand."""
    smallest_s: float = 1.0
    """Shortest unit [s], even if there are then fewer: to hand one out takes some hundredths of
    a second; chosen by hand."""
    fewest: int = 16
    """Units of a sweep at least, however short they are; chosen by hand."""


CUT: Final = CutPolicy()


def settings_per_unit(settings: int, block_steps: float, *, multiple: int = 1) -> int:
    """Return how many settings of a sweep make a work unit.

    Parameters
    ----------
    settings : int
        All settings of the sweep.
    block_steps : float
        Time steps of single blocks that one setting takes, with its replicates; at most, where runs
        may end early.
    multiple : int
        Settings that belong together: a unit has a whole number of such groups.

    Examples
    --------
    >>> settings_per_unit(1681, 4 * 225_000)  # a map of 30 minutes, 1 s each
    27
    >>> settings_per_unit(1000, 4 * 30_000, multiple=25)  # four blocks for 5 minutes
    50
    """
    each = max(block_steps, 1.0) / CUT.block_steps_per_second
    total = settings * each
    unit = min(CUT.largest_s, max(total / CUT.many, CUT.smallest_s), total / CUT.fewest)
    return max(int(unit / each) // multiple, 1) * multiple
