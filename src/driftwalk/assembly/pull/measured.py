"""A measured table of the force between two faces: read, checked, and as an energy."""

from __future__ import annotations

import csv
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import FormatError, InputError

UNITS: Final = {
    "gap": {"m": 1.0, "mm": 1e-3},
    "offset": {"m": 1.0, "mm": 1e-3},
    "angle": {"rad": 1.0, "deg": np.pi / 180.0},
    "force": {"N": 1.0, "mN": 1e-3},
    "torque": {"N_m": 1.0, "mN_m": 1e-3, "N_mm": 1e-3, "uN_m": 1e-6},
}
"""Columns of the table, and the factors of their units to SI."""


class MeasuredPullPolicy(NamedTuple):
    """When a measured table contradicts itself, and where it ends."""

    torque_agrees: float = 0.1
    """Share of the largest torque by which a stated torque may differ from the one that the force
    implies: a balance and a lever measure within some per cent. Chosen by hand."""
    behind_m: tuple[float, float] = (0.003, 0.01)
    """Where the energy behind a face begins to fade, and where it ends: deeper than two blocks
    overlap, and before the next face of a block of 3 cm; chosen by hand."""


MEASURED_PULL: Final = MeasuredPullPolicy()


@dataclass(frozen=True)
class MeasuredAttraction:
    """Attraction of two faces against gap, offset and angle.

    Attributes
    ----------
    axes : tuple of tuple of float
        Gaps [m], offsets [m] and angles [rad], increasing.
    force : tuple of float
        Attraction along the first face's normal [N], the angle fastest.
    """

    axes: tuple[tuple[float, ...], ...]
    force: tuple[float, ...]

    @property
    def longest_gap(self) -> float:
        """The largest gap [m], beyond which nothing is felt."""
        return self.axes[0][-1]

    @property
    def is_oriented(self) -> bool:
        """Whether the force depends on the offset or the angle."""
        return len(self.axes[1]) > 1 or len(self.axes[2]) > 1

    def _values(self) -> Floats:
        return np.reshape(self.force, [len(axis) for axis in self.axes])

    def at_gap(self, gap: Floats) -> Floats:
        """Return the attraction of faces opposite each other [N] at gaps [m]."""
        offset, angle = (int(np.argmin(np.abs(axis))) for axis in self.axes[1:])
        return np.asarray(np.interp(gap, self.axes[0], self._values()[:, offset, angle], right=0.0))

    @property
    def farthest(self) -> float:
        """The largest distance of two centres of faces in the table [m]."""
        return float(np.hypot(self.longest_gap, np.abs(self.axes[1]).max()))

    def _with_gap(self, gap: float) -> tuple[Floats, Floats]:
        """Return the gaps with this one among them, and the forces."""
        gaps, values = np.asarray(self.axes[0]), self._values()
        if gap <= gaps[0] or gap >= gaps[-1] or gap in gaps:
            return gaps, values
        row = int(np.searchsorted(gaps, gap))
        share = (gap - gaps[row - 1]) / (gaps[row] - gaps[row - 1])
        between = values[row - 1] + share * (values[row] - values[row - 1])
        return np.insert(gaps, row, gap), np.insert(values, row, between, axis=0)

    def _at_gaps(self, gaps: Floats, values: Floats) -> MeasuredAttraction:
        axes = tuple(gaps.tolist()), *self.axes[1:]
        return replace(self, axes=axes, force=tuple(values.ravel().tolist()))

    def flat_below(self, gap: float) -> MeasuredAttraction:
        """Return the table with the force of this gap [m] at all below it."""
        gaps, values = self._with_gap(gap)
        row = int(np.searchsorted(gaps, gap))
        values = np.concatenate([np.repeat(values[row : row + 1], row, axis=0), values[row:]])
        return self._at_gaps(gaps, values)

    def up_to(self, gap: float) -> MeasuredAttraction:
        """Return the part of the table up to this gap [m].

        Raises
        ------
        InputError
            When the table begins beyond it.
        """
        if gap <= self.axes[0][0]:
            raise InputError(
                f"[interaction] cutoff_m: the table begins at {1e3 * self.axes[0][0]:g} mm; a "
                f"cut-off of {1e3 * gap:g} mm leaves no force"
            )
        gaps, values = self._with_gap(gap)
        kept = gaps <= gap
        return self._at_gaps(gaps[kept], values[kept])

    def energies(self) -> Floats:
        """Return the energy at the nodes [J]: the force integrated from the largest gap inward."""
        force, gap = self._values(), np.asarray(self.axes[0])
        steps = (force[1:] + force[:-1]) / 2.0 * np.diff(gap)[:, None, None]
        inward = np.cumsum(steps[::-1], axis=0)[::-1]
        return np.asarray(-np.concatenate([inward, np.zeros((1, *inward.shape[1:]))]))

    def energy(self, x: Floats, y: Floats, angle: Floats) -> Floats:
        """Return the energy of two faces [J]; 0 outside the table.

        A little behind the first face it goes on as at the first gap, and further behind ends.
        Without offsets in the table the distance of the centres is the gap.

        Parameters
        ----------
        x, y : ndarray
            Place of the second face's centre along the first's normal, and across it [m].
        angle : ndarray
            Of the second face against the first's opposite [rad].
        """
        from scipy.interpolate import RegularGridInterpolator

        angle = (angle + np.pi) % (2.0 * np.pi) - np.pi
        # A table of one sign is that of the other sign, too: it is the same pair in a mirror.
        if self.axes[1][0] >= 0.0:
            angle, y = np.where(y < 0.0, -angle, angle), np.abs(y)
        if self.axes[2][0] >= 0.0:
            angle = np.abs(angle)
        used = [k for k, axis in enumerate(self.axes) if len(axis) > 1]
        begin, end = MEASURED_PULL.behind_m
        part = np.clip((-x - begin) / (end - begin), 0.0, 1.0)
        gap = x if len(self.axes[1]) > 1 else np.hypot(x, y)
        gap = np.maximum(gap, self.axes[0][0])
        points = np.stack(np.broadcast_arrays(gap, y, angle), axis=-1)
        shape = [len(self.axes[k]) for k in used]
        table = RegularGridInterpolator(
            [self.axes[k] for k in used], self.energies().reshape(shape),
            bounds_error=False, fill_value=0.0,
        )  # fmt: skip
        return np.asarray(table(points[..., used]) * (1.0 - part**2 * (3.0 - 2.0 * part)))


def read_attraction(path: str | Path) -> MeasuredAttraction:
    """Read a CSV table of the force between two faces.

    Parameters
    ----------
    path : path-like
        Columns ``gap_mm`` and ``force_mN``, and ``offset_mm``, ``angle_deg`` where the force
        depends on them, in these units or in SI; one row for each combination. A column of torques
        is compared with the torque that the forces imply.

    Raises
    ------
    FormatError
        With file, line and column: a missing or unknown column, no number, a missing or second row,
        or a torque that no energy has together with these forces.
    """
    try:
        with Path(path).open(newline="", encoding="utf-8-sig") as file:
            rows = list(csv.reader(file))
    except (OSError, UnicodeDecodeError) as error:
        raise FormatError(
            f"cannot be read as a table of attractions: {error}", path=path
        ) from error
    if not rows:
        raise FormatError("is empty; expected columns such as gap_mm, force_mN", path=path)
    columns = _columns(path, [head.strip() for head in rows[0]])
    table = _numbers(path, rows[1:], columns)
    axes = tuple(np.unique(table.get(name, np.zeros(1))) for name in ("gap", "offset", "angle"))
    at = [np.searchsorted(axis, table.get(name, 0.0)) for name, axis in
          zip(("gap", "offset", "angle"), axes, strict=True)]  # fmt: skip
    shape = [axis.size for axis in axes]
    places = np.ravel_multi_index(np.broadcast_arrays(*at), shape)
    double = np.flatnonzero(np.bincount(places) > 1)
    if double.size:
        line = int(np.flatnonzero(places == double[0])[1]) + 2
        raise FormatError("a second row for the same gap, offset and angle", path=path, line=line)
    if places.size < np.prod(shape):
        raise FormatError(
            f"has {places.size} rows; {' x '.join(map(str, shape))} gaps, offsets and angles need "
            f"{np.prod(shape)}, one for each combination",
            path=path,
        )
    if axes[0].size < 2 or axes[0][0] < 0.0:
        raise FormatError("column gap: expected at least two gaps, none below 0", path=path)
    found = MeasuredAttraction(
        tuple(tuple(axis.tolist()) for axis in axes), tuple(table["force"][np.argsort(places)])
    )
    if "torque" in table:
        _require_conservative(path, found, table["torque"][np.argsort(places)].reshape(shape))
    return found


def _columns(path: str | Path, heads: list[str]) -> dict[str, tuple[int, float]]:
    """Return place and factor of each column."""
    columns: dict[str, tuple[int, float]] = {}
    for place, head in enumerate(heads):
        name, _, unit = head.partition("_")
        if name not in UNITS or unit not in UNITS[name]:
            known = ", ".join(f"{key}_{next(iter(units))}" for key, units in UNITS.items())
            raise FormatError(
                f"no column is called '{head}'; there are {known}",
                path=path, line=1, column=place + 1,
            )  # fmt: skip
        if name in columns:
            raise FormatError(
                f"a second column of the {name}: '{head}'", path=path, line=1, column=place + 1
            )
        columns[name] = place, UNITS[name][unit]
    for name in ("gap", "force"):
        if name not in columns:
            raise FormatError(
                f"there is no column {name}_{'m' if name == 'gap' else 'N'}", path=path, line=1
            )
    return columns


def _numbers(
    path: str | Path, rows: list[list[str]], columns: dict[str, tuple[int, float]]
) -> dict[str, Floats]:
    table: dict[str, list[float]] = {name: [] for name in columns}
    for line, row in enumerate(rows, start=2):
        if not any(cell.strip() for cell in row):
            continue
        for name, (place, factor) in columns.items():
            cell = row[place] if place < len(row) else ""
            try:
                value = float(cell)
            except ValueError:
                value = np.nan
            if not np.isfinite(value):
                raise FormatError(
                    f"{name} is no number: '{cell}'", path=path, line=line, column=place + 1
                )
            table[name].append(value * factor)
    if not table["gap"]:
        raise FormatError("has no rows", path=path)
    return {name: np.asarray(values) for name, values in table.items()}


def _require_conservative(path: str | Path, found: MeasuredAttraction, torque: Floats) -> None:
    """Refuse torques that are not the derivative of the energy by the angle."""
    if len(found.axes[2]) < 3:
        return
    implied = -np.gradient(found.energies(), np.asarray(found.axes[2]), axis=2)
    apart = float(np.abs(torque - implied)[..., 1:-1].max())
    if apart > MEASURED_PULL.torque_agrees * max(float(np.abs(torque).max()), 1e-300):
        raise FormatError(
            f"the torque differs by up to {1e6 * apart:.3g} µN m from the one that the "
            "forces imply (minus the derivative of their energy by the angle, counter-clockwise): "
            "leave the column out, or mend its sign or unit",
            path=path,
        )
