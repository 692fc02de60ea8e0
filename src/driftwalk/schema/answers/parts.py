"""The parts of an answer: estimates with their intervals, rows, tables and sentences."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

from driftwalk.core.units import in_percent
from driftwalk.schema.description import Number
from driftwalk.schema.kinds.fit import PARAMETERS

if TYPE_CHECKING:
    import xarray as xr

NOT_DETERMINED: Final = "not determined by this recording"
"""Stands in place of a number with an open interval."""
SIMULATED: Final = "This recording was simulated, not measured."
LABEL_WIDTH: Final = 22
"""Column of the values in a terminal: most labels are shorter; chosen by eye."""
DIGITS: Final = 4
"""Significant digits of a number; more where its interval is narrower; chosen by hand."""


class Row(NamedTuple):
    """A label, and what stands next to it."""

    label: str
    text: str


class Estimate(NamedTuple):
    """A number that was estimated, in SI units, with its interval."""

    number: Number
    value: float
    ends: tuple[float, float] | None = None
    confidence: float | None = None
    after: str = ""
    """Words after the value: ", redrawn every 16 ms"."""
    determined: bool = True
    role: Literal["model", "law", "wall"] = "model"
    """A number of the force law may be stated; one of the law or the wall may have one end."""

    @property
    def label(self) -> str:
        """Words and symbol."""
        return self.number.words

    @property
    def open(self) -> bool:
        """Whether the interval has no upper end."""
        return self.ends is not None and math.isinf(self.ends[1])

    @property
    def unknown(self) -> bool:
        """Whether the recording does not determine the number: by a factor of ten either way."""
        if self.ends is None or self.role != "model":
            return False
        low, high = self.ends
        return self.open or (low > 0.0 and high > 100.0 * low)

    @property
    def stated(self) -> bool:
        """Whether it was stated, so that it has no interval."""
        return self.role == "law" and self.ends is not None and self.ends[0] == self.ends[1]

    @property
    def text(self) -> str:
        """Value and interval in the units of a reader.

        Examples
        --------
        >>> Estimate(Number("jitter", "s", shown="ms"), 0.01, (0.009, 0.011), 0.9).text
        '10.00 ms   90 % interval 9.000 to 11.00'
        >>> Estimate(Number("friction"), 1.2, (0.9, float("inf")), 0.9, role="wall").text
        '1.200   90 % interval 0.9000 or more'
        """
        if self.unknown:
            return NOT_DETERMINED
        factor, unit = self.number.factor, self.number.reader_unit
        unit = unit if unit in ("", "°") else f" {unit}"
        value = factor * self.value
        if self.ends is None:
            found = f"{number_text(value)}{unit}{self.after}   no interval without a bootstrap"
            return found if self.determined else "not determined"
        low, high = (factor * end for end in self.ends)
        digits = DIGITS
        if value and 0.0 < high - low < abs(value):
            digits = max(digits, math.ceil(math.log10(abs(value) / (high - low))) + 1)
        ends = f"{number_text(low, digits)} or more"
        if not self.open:
            ends = f"{number_text(low, digits)} to {number_text(high, digits)}"
        if not self.determined:
            return f"not determined ({ends}{unit})"
        if self.stated:
            return f"{value:.4g}{unit}, as stated"
        if math.isinf(value):
            return f"so large that it makes no difference ({ends})"
        share = "" if self.confidence is None else f"{in_percent(self.confidence)} "
        return f"{number_text(value, digits)}{unit}{self.after}   {share}interval {ends}"


class Table(NamedTuple):
    """A table, with a line above it where it has a title."""

    rows: Sequence[Sequence[Any]]
    columns: Sequence[str] = ()
    title: str = ""


Part = Row | Estimate | Table | str


class Answer(NamedTuple):
    """An answer, for people and for programs."""

    parts: list[Part]
    """For people, in the order in which they are read."""
    facts: dict[str, Any]
    """For programs: the JSON of the command."""
    warnings: list[str]


class Following(NamedTuple):
    """The command that follows a run, and the advice that a page gives."""

    command: tuple[str, ...] = ()
    """The command that takes it further, its model, and a name for its result; none: a page."""
    advice: str = ""
    """A sentence with a command, in which ``{run}`` is the run directory."""


PREDICT: Final = Following(
    ("assemble", "assembly"),
    "Predict what several such bodies build: `driftwalk assemble {run} -o four`",
)
"""After parameters of the block."""


def number_text(value: float, digits: int = DIGITS) -> str:
    """Return a number with its significant digits, zeros included.

    Examples
    --------
    >>> number_text(0.62), number_text(0.0), number_text(1234.0), number_text(2e-05)
    ('0.6200', '0', '1234', '2.000e-05')
    """
    return f"{value:#.{digits}g}".rstrip(".") if value else "0"


def lines_of(parts: Iterable[Part]) -> list[str]:
    """Return the lines of an answer."""
    lines = []
    for part in parts:
        if isinstance(part, str):
            lines.append(part)
        elif isinstance(part, Table):
            lines += table_lines(*part)
        else:
            lines.append(f"{part.label:{LABEL_WIDTH}} {part.text}")
    return lines


def table_lines(
    rows: Sequence[Sequence[Any]], columns: Sequence[str] = (), title: str = ""
) -> list[str]:
    """Return a table as aligned lines; a float has six significant digits, None an empty cell."""
    lines = [list(columns)] if columns else []
    lines += [[_cell(value) for value in row] for row in rows]
    count = max((len(line) for line in lines), default=0)
    widths = [max(len(line[i]) for line in lines if i < len(line)) for i in range(count)]
    return [
        *([title] if title else []),
        *(
            "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=False)).rstrip()
            for line in lines
        ),
    ]


def origin(found: xr.Dataset) -> list[Part]:
    """Return that a recording was simulated, where it was."""
    return [SIMULATED] if found.attrs.get("simulated_recording") == "yes" else []


def estimates(found: xr.Dataset) -> list[Estimate]:
    """Return the estimates of a fit, a calibration or a calibration of many parameters.

    Parameters
    ----------
    found : xarray.Dataset
        With ``estimate`` and ``unit`` by ``parameter``; ``interval`` may be absent. Of a part
        without them nothing is returned.
    """
    absent = any(name not in found.variables for name in ("estimate", "parameter", "unit"))
    if absent or found["estimate"].ndim != 1:
        return []
    stored = found.attrs.get("confidence", found.get("confidence"))
    confidence = None if stored is None else float(stored)
    made = []
    for at, (name, unit) in enumerate(
        zip(found["parameter"].values, found["unit"].values, strict=True)
    ):
        number, ends, after = _number(found, str(name), str(unit)), None, ""
        if "interval" in found.variables:
            low, high = map(float, found["interval"].values[at])
            ends = None if math.isnan(low) else (low, high)
        if name == "force_std" and "force_interval" in found:
            # σ_F means nothing without its interval.
            after = f", redrawn every {1e3 * float(found['force_interval']):g} ms"
        known = "determined" not in found or bool(found["determined"].values[at])
        known &= ends is None or ends[1] - ends[0] <= number.widest
        value = float(found["estimate"].values[at])
        made.append(Estimate(number, value, ends, confidence, after, known))
    return made


def _number(found: xr.Dataset, name: str, unit: str) -> Number:
    """Return how a parameter is called: of a user's model as its calibration does."""
    if name in PARAMETERS and PARAMETERS[name].unit == unit:
        return PARAMETERS[name]
    stored = found.variables[name].attrs if name in found.variables else {}
    return Number(name, unit, str(stored.get("long_name", "")))


def intensity_row(value: float) -> Row:
    """Return the row of σ_F²·τ [N² s], which is what a recording tells of the force."""
    return Row("noise intensity σ_F²·τ", f"{value:.4g} N² s")


def undetermined(found: xr.Dataset) -> list[str]:
    """Return which of C_d and σ_F a recording does not determine: both are needed to simulate.

    Parameters
    ----------
    found : xarray.Dataset
        A `fit` or a `calibration` of the block.
    """
    unknown = {one.number.name: one.open for one in estimates(found)}
    # Where the drag is linear but for a trace, nothing depends on C_d.
    linear = not unknown.get("linear_drag", True)
    needed = ("force_std",) if linear else ("drag_coefficient", "force_std")
    return [name for name in needed if unknown[name]]


def each(found: xr.Dataset, dim: str) -> list[xr.Dataset]:
    """Return the parts of a dataset along a dimension."""
    return [found.isel({dim: at}) for at in range(found.sizes[dim])]


def by_name(
    found: xr.Dataset, dim: str, value: Callable[[xr.Dataset], Any] | str
) -> dict[str, Any]:
    """Return a value of each part along a dimension, by its name."""
    if isinstance(value, str):
        return dict(zip(map(str, found[dim].values), found[value].values.tolist(), strict=True))
    return {str(part[dim].values): value(part) for part in each(found, dim)}


def records(found: xr.Dataset, dim: str, names: Iterable[str]) -> list[dict[str, Any]]:
    """Return the name of each part along a dimension, with the numbers that it has."""
    return [
        {
            dim: str(one[dim].values),
            **{name: one[name].values.tolist() for name in names if name in one},
        }
        for one in each(found, dim)
    ]


def interval_cells(
    found: xr.Dataset | Mapping[str, Any], name: str, form: str = ".3g"
) -> tuple[str, str]:
    """Return a number and its interval, whose upper end may be missing, as cells of a table.

    Where a number is unknown, its cell is empty.
    """
    value, low, high = (float(found[f"{name}{end}"]) for end in ("", "_low", "_high"))
    ends = f"{low:{form}} to {high:{form}}" if math.isfinite(high) else f"{low:{form}} or more"
    return "" if math.isnan(value) else f"{value:{form}}", "" if math.isnan(low) else ends


def duration_text(seconds: float) -> str:
    """Return a duration in words of at most two units.

    Examples
    --------
    >>> duration_text(3725)
    '1 h 2 min'
    """
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


def length_text(seconds: float) -> str:
    """Return a duration in words, without parts that are zero.

    Examples
    --------
    >>> length_text(1800.0), length_text(5400.0)
    ('30 min', '1 h 30 min')
    """
    return duration_text(seconds).removesuffix(" 0 s").removesuffix(" 0 min")


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else str(value)
