"""Plug-in loaders of other packages: entry points of the group ``driftwalk.loaders``.

An error in one of them is one line with the name of its package, and keeps no other file from being
read.
"""

from __future__ import annotations

from collections.abc import Container
from dataclasses import replace
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.core.errors import FormatError, InputError, reason_of
from driftwalk.record.raw import (
    ANGLE_UNITS,
    CLOCK_UNITS,
    LENGTH_UNITS,
    RawBody,
    RawRecording,
    ReadOptions,
)

if TYPE_CHECKING:
    from driftwalk.record.raw import Marks

GROUP: Final = "driftwalk.loaders"
_MEMBERS: Final = ("name", "description", "sniff", "read")


class ForeignLoaders(NamedTuple):
    """Loaders that the installed packages offer, and entry points that are broken."""

    loaders: dict[str, ForeignLoader]
    """Those that can be used, by the names of their formats."""
    broken: dict[str, str]
    """Names of entry points to what is wrong with them, with their package."""


class ForeignLoader:
    """A loader of another package, whose errors name the package."""

    def __init__(self, loader: Any, package: str) -> None:
        self._loader = loader
        self.name = str(loader.name)
        self.description = str(loader.description)
        self.package = package
        self.failed = ""
        """Error of the last attempt to recognise a file, ``""`` where there was none."""
        self.marks: tuple[Marks, ...] = tuple(getattr(loader, "marks", ()))

    def sniff(self, head: bytes, path: Path) -> float:
        """Return how sure the loader is; one that fails is not sure at all."""
        self.failed = ""
        try:
            return float(self._loader.sniff(head, path))
        except Exception as error:  # whatever another package's code raises
            kind = type(error).__name__
            self.failed = (
                f"the loader '{self.name}' of the package {self.package} failed to recognise it: "
                f"{kind}: {reason_of(error)}"
            )
            return 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the file by the other package's code."""
        by = f"the loader '{self.name}' of the package {self.package}"
        try:
            raw = self._loader.read(path, options)
        except FormatError as error:
            reason, at = f"{' '.join(error.reason.split())} ({by})", (error.line, error.column)
            raise FormatError(reason, path=error.path, line=at[0], column=at[1]) from error
        except InputError as error:
            raise InputError(f"{reason_of(error)} ({by})") from error
        except Exception as error:  # whatever another package's code raises
            kind = type(error).__name__
            raise FormatError(f"{by} failed: {kind}: {reason_of(error)}") from error
        wrong = _what_is_wrong(raw)
        if wrong:
            raise FormatError(f"{by} returned {wrong}")
        recording: RawRecording = raw
        recording.bodies = [_own(body) for body in recording.bodies]
        return recording


def foreign_loaders(taken: Container[str]) -> ForeignLoaders:
    """Return the loaders of the installed packages.

    Parameters
    ----------
    taken : container of str
        Names of formats that no other package may use.

    Examples
    --------
    >>> sorted(foreign_loaders([]).broken)
    []
    """
    found: dict[str, ForeignLoader] = {}
    broken: dict[str, str] = {}
    points = sorted(entry_points(group=GROUP), key=lambda point: (point.name, _package(point)))
    for point in points:
        try:
            loader = point.load()
            lacking = [name for name in _MEMBERS if not hasattr(loader, name)]
            if lacking:
                raise TypeError(f"it has no {' and no '.join(lacking)}")
            foreign = ForeignLoader(loader, _package(point))
        except Exception as error:  # whatever another package's code raises
            reason = f"{type(error).__name__}: {reason_of(error)}"
            broken[point.name] = f"the package {_package(point)} has a broken loader ({reason})"
            continue
        if foreign.name in taken or foreign.name in found:
            broken[point.name] = (
                f"the package {foreign.package} has a loader named '{foreign.name}', which another "
                "loader is named already"
            )
        else:
            found[foreign.name] = foreign
    return ForeignLoaders(found, broken)


def _package(point: EntryPoint) -> str:
    return point.dist.name if point.dist is not None else point.value


def _what_is_wrong(raw: Any) -> str:
    """Return what a loader must not return, ``""`` where all is well."""
    if not isinstance(raw, RawRecording):
        return f"{type(raw).__name__}, and has to return a RawRecording"
    units = (
        ("clock_unit", raw.clock_unit, (*CLOCK_UNITS, "frame")),
        ("length_unit", raw.length_unit, (*LENGTH_UNITS, "px", "")),
        ("angle_unit", raw.angle_unit, tuple(ANGLE_UNITS)),
        ("y_axis", raw.y_axis, ("up", "down", "")),
    )
    for name, value, known in units:
        if value not in known:
            return f"{name} = {value!r}, which is none of {', '.join(map(repr, known))}"
    if not raw.bodies:
        return "no bodies"
    for body in raw.bodies:
        columns = {name: np.asarray(getattr(body, name)) for name in ("clock", "x", "y")}
        if body.theta is not None:
            columns["theta"] = np.asarray(body.theta)
        for name, values in columns.items():
            if values.dtype.kind not in "fiu" or values.shape != columns["clock"].shape[:1]:
                return (
                    f"{name} of body '{body.name}' as {values.dtype} of shape {values.shape}, and "
                    f"it has to be numbers, one for each of the {columns['clock'].size} times"
                )
    return ""


def _own(body: RawBody) -> RawBody:
    """Return a body whose arrays may be converted in place."""
    named = {"clock": body.clock, "x": body.x, "y": body.y, "theta": body.theta}
    copied: dict[str, Any] = {
        key: np.array(one, dtype=np.float64) for key, one in named.items() if one is not None
    }
    return replace(body, name=str(body.name), **copied)
