"""Parts of the sections of a page: charts, numbers in sentences, the section that replaces one."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import DriftwalkError, InputError
from driftwalk.core.text_files import json_value
from driftwalk.core.units import RAISED, percent, raised_powers
from driftwalk.page.arrays import number, numbers
from driftwalk.plot.parts.arena import arena_of
from driftwalk.schema.answers.facts import facts_of, sentences, source_warnings
from driftwalk.schema.answers.parts import NOT_DETERMINED, Answer, Estimate, Table
from driftwalk.schema.answers.verdict import Verdict
from driftwalk.schema.check import kind_name

if TYPE_CHECKING:
    import xarray as xr


_PREFIXES: Final = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M"}
"""SI prefix by power of ten."""
_PREFIXED: Final = ("m", "s", "N", "m/s", "Hz")


def quantity(value: float, unit: str = "1", *, digits: int = 4) -> str:
    """Return a number and its unit as a sentence has it.

    Parameters
    ----------
    value : float
        The number, in SI.
    unit : str
        Its SI unit, "1" for none.
    digits : int
        Significant digits.

    Examples
    --------
    >>> quantity(0.000665, "N"), quantity(0.3825), quantity(1800.0, "s"), quantity(0.3, "m")
    ('0.665 mN', '0.3825', '30 min', '30 cm')
    >>> quantity(7.076e-9, "N² s"), quantity(0.0042, "m2"), quantity(0.3, "1/s")
    ('7.076×10⁻⁹ N² s', '0.0042 m²', '0.3 1/s')
    """
    if not math.isfinite(value):
        return "unknown"
    if unit == "1":
        return _digits(value, digits)
    if unit == "s" and value >= 120.0:
        return f"{_digits(value / 60.0, digits)} min"
    if unit == "m" and 0.01 <= abs(value) < 1.0:
        return f"{_digits(100.0 * value, digits)} cm"
    if unit == "m/s" and 0.001 <= abs(value) < 1.0:
        return f"{_digits(100.0 * value, digits)} cm/s"
    if unit == "N" and 1e-5 <= abs(value) < 1.0:
        return f"{_digits(1e3 * value, digits)} mN"
    if unit not in _PREFIXED or value == 0.0:
        return f"{_digits(value, digits)} {raised_powers(unit)}"
    power = 3 * math.floor(math.log10(abs(value)) / 3.0 + 1e-12)
    power = min(max(power, min(_PREFIXES)), max(_PREFIXES))
    return f"{_digits(value / 10.0**power, digits)} {_PREFIXES[power]}{unit}"


def count(number: int, word: str) -> str:
    """Return "1 run" or "2 runs".

    Examples
    --------
    >>> count(1, "run"), count(400, "run")
    ('1 run', '400 runs')
    """
    return f"{number} {word}{'' if number == 1 else 's'}"


def with_interval(
    value: float, ends: tuple[float, float] | None, unit: str = "1", confidence: float | None = None
) -> str:
    """Return an estimate with its interval, or with the remark that it has none.

    Examples
    --------
    >>> with_interval(0.39, (0.38, 0.4), confidence=0.9)
    '0.39 (90 % interval 0.38 to 0.4)'
    >>> with_interval(0.39, None)
    '0.39 (no interval)'
    """
    if ends is None:
        return f"{quantity(value, unit)} (no interval)"
    words = "interval" if confidence is None else f"{percent(confidence)} interval"
    return (
        f"{quantity(value, unit)} ({words} {quantity(ends[0], unit)} to {quantity(ends[1], unit)})"
    )


def cell(value: float, unit: str) -> str:
    """Return a number and its unit as a cell of a table has it: a dash where there is none.

    Parameters
    ----------
    value : float
        The number, in SI.
    unit : str
        Its SI unit, "1" for none.

    Examples
    --------
    >>> cell(0.0382, "m"), cell(float("nan"), "m")
    ('3.82 cm', '–')
    """
    return quantity(float(value), unit, digits=3) if math.isfinite(value) else "–"


def _digits(value: float, digits: int) -> str:
    """Return a number with so many significant digits, powers of ten written as such."""
    text = f"{value:.{digits}g}"
    mantissa, _, power = text.partition("e")
    return f"{mantissa}×10{str(int(power)).translate(RAISED)}" if power else text


Section = dict[str, Any]
Maker = Callable[["xr.Dataset"], Section | list[Section]]

_ARENA_KEYS: Final = {
    "circle": ("diameter_m",),
    "rectangle": ("width_m", "height_m"),
    "polygon": ("vertices_m",),
}
FOUND_TITLE: Final = "Results"
SIMULATED: Final = "The recording was simulated: it is not a measurement."
MOST_SETTINGS: Final = 50_000
"""Combinations of parameters that a page names; a cube of 31 values a side has 29,791; chosen by
hand."""


def section(id: str, kind: str, title: str, note: str | None = None, **content: Any) -> Section:
    """Return a section of a page.

    Examples
    --------
    >>> section("notes", "warnings", "Warnings", items=[])["id"]
    'notes'
    """
    return {"id": id, "kind": kind, "title": title, "note": note, **content}


def empty_section(id: str, title: str, reason: str) -> Section:
    """Return the section that stands where there is nothing to show, and why."""
    return section(id, "empty", title, reason=" ".join(reason.split()))


def attempt(id: str, title: str, make: Callable[[], Section | list[Section]]) -> list[Section]:
    """Make sections; what the data do not allow becomes an empty section with the reason.

    A section without an id or a title of its own gets the given one. Another program may have
    written the data in another form: that costs the section, and not the page. Errors that no data
    explain are faults of driftwalk, and pass.
    """
    try:
        made = make()
    except DriftwalkError as error:
        return [empty_section(id, title, str(error))]
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:
        # An error of a library may be long.
        words = f"{type(error).__name__}: {error}"[:200]
        reason = f"The data are not in the form that this version of driftwalk reads ({words})."
        return [empty_section(id, title, reason)]
    return [
        {**part, "id": part["id"] or id, "title": part["title"] or title}
        for part in (made if isinstance(made, list) else [made])
    ]


def sections_of(
    found: xr.Dataset | None,
    nothing: str,
    summary: Maker,
    warnings: Callable[[xr.Dataset], Sequence[str]],
    parts: Iterable[tuple[str, str, Maker]] = (),
) -> list[Section]:
    """Return the sections of a result: its summary, its warnings and its other parts.

    `nothing` says why there are none while there is no result. Each part has the id and the title
    of the empty section that stands in its place when the data do not allow it.
    """
    if found is None:
        return [empty_section("summary", FOUND_TITLE, nothing)]
    made = attempt("summary", FOUND_TITLE, partial(summary, found))
    made += attempt(
        "warnings",
        "Warnings",
        lambda: warnings_section([*source_warnings(found), *warnings(found)]),
    )
    return made + attempts(*((*piece, found) for piece in parts))


def attempts(*pieces: tuple[str, str, Maker, xr.Dataset | None]) -> list[Section]:
    """Return the sections of the datasets that there are, each as `attempt` makes it."""
    return [
        one
        for id, title, make, found in pieces
        if found is not None
        for one in attempt(id, title, partial(make, found))
    ]


def summary_section(
    paragraphs: Sequence[str],
    numbers: Sequence[dict[str, Any]],
    *,
    id: str = "summary",
    title: str = "The answer",
) -> Section:
    """Return paragraphs, and results of `card` and `figure`."""
    return section(id, "summary", title, paragraphs=list(paragraphs), numbers=list(numbers))


def table_section(
    columns: Sequence[str],
    rows: Iterable[Sequence[Any]],
    note: str = "",
    *,
    id: str = "",
    title: str = "",
) -> Section:
    """Return a table; cells that a row lacks at its end stay empty."""
    filled = [[*row, *[""] * (len(columns) - len(row))] for row in rows]
    return section(id, "table", title, note or None, columns=list(columns), rows=filled)


def section_of_table(table: Table, note: str = "", **named: str) -> Section:
    """Return a table of an answer as a section."""
    return table_section(table.columns, table.rows, note, **named)


def table_part(
    id: str, title: str, table_of: Callable[[Any], Table], note: str = ""
) -> tuple[str, str, Maker]:
    """Return a part of a page that is one table of an answer, for `sections_of`."""
    return id, title, lambda found: section_of_table(table_of(found), note)


def answer_table(answer: Answer) -> Table:
    """Return the first table of an answer."""
    return next(part for part in answer.parts if isinstance(part, Table))


def require(dataset: xr.Dataset, *names: str) -> None:
    """Raise `InputError` naming the variables that a dataset lacks."""
    missing = [name for name in names if name not in dataset.variables]
    if missing:
        kind = kind_name(dataset) or "dataset"
        raise InputError(f"the {kind} holds no {', '.join(missing)}")


def required(dataset: xr.Dataset, name: str) -> Any:
    """Return a fact of a dataset, see `facts_of`, or raise `InputError` naming it."""
    facts = facts_of(dataset)
    if name not in facts:
        raise InputError(f"the {kind_name(dataset) or 'dataset'} has no '{name}'")
    return facts[name]


def value_of(dataset: xr.Dataset, name: str) -> float | None:
    """Return a number of the facts, None when it is absent or not finite."""
    found = facts_of(dataset).get(name)
    return None if isinstance(found, str) else number(found)


def is_simulated(dataset: xr.Dataset) -> bool:
    """Return whether a result comes from a simulated recording."""
    return "yes" in [str(dataset.attrs.get(key)) for key in ("simulated_recording", "simulated")]


def stated_warnings(found: xr.Dataset) -> list[str]:
    """Return the warnings of a result, and that its recording was simulated.

    Parameters
    ----------
    found : xarray.Dataset
        A result with the coordinate `warning`.
    """
    said = [SIMULATED] if is_simulated(found) else []
    return [*said, *sentences(found, "warning")]


def verdict_paragraphs(
    verdict: Verdict | None, unchecked: str = "", *, more: str = ""
) -> list[str]:
    """Return the verdict on a model, and a paragraph for each reason; `more` where it explains."""
    if verdict is None:
        return [f"Verdict: not checked{': ' if unchecked else ''}{unchecked}."]
    after = more if verdict.explains else ""
    reasons = (f"{text[:1].upper()}{text[1:]}." for text in verdict.reasons)
    return [f"Verdict: {verdict.word}{':' if verdict.reasons else '.'} {after}".rstrip(), *reasons]


def arena_part(dataset: xr.Dataset) -> dict[str, Any] | None:
    """Return the arena of a dataset as a page has it, None when it is unknown."""
    arena = arena_of(dataset)
    needed = _ARENA_KEYS.get(str(arena.get("shape")))
    if needed is None or any(key not in arena for key in needed):
        return None
    kept = ("shape", *needed, "center_m")
    return {key: json_value(arena[key]) for key in kept if key in arena}


def axis(name: str, label: str, unit: str, values: Any) -> dict[str, Any]:
    """Return an axis of a map."""
    found = np.asarray(values, dtype=np.float64)
    return {"name": name, "label": label, "unit": unit, "values": [number(v) for v in found]}


def card(one: Estimate) -> dict[str, Any]:
    """Return an estimate with its interval, for a summary.

    Its unit is SI, unless the number has one in which it is shown everywhere.
    """
    number_of = one.number
    scale, unit = (number_of.factor, number_of.shown) if number_of.shown else (1.0, number_of.unit)
    value, low, high = (scale * v for v in (one.value, *(one.ends or (math.nan, math.nan))))
    note = number_of.note or one.after.removeprefix(", ") or None
    known = one.determined and not one.unknown
    if not known:
        note = NOT_DETERMINED
    elif one.stated:
        note = f"stated; {note}"
    elif one.open:
        share = "" if one.confidence is None else f"{percent(one.confidence)}: "
        note = f"{share}{low:.2g} or more; {note}"
    closed = not one.stated and math.isfinite(low) and math.isfinite(high)
    return figure(
        number_of.words.removesuffix(number_of.symbol).rstrip(),
        value if known else None,
        unit or "1",
        symbol=number_of.symbol,
        note=note,
        ends=(low, high) if closed else (None, None),
        confidence=one.confidence if closed else None,
    )


def figure(
    label: str,
    value: Any,
    unit: str = "1",
    *,
    symbol: str = "",
    note: str | None = None,
    ends: tuple[Any, Any] = (None, None),
    confidence: float | None = None,
) -> dict[str, Any]:
    """Return a number for a summary, with its interval where it has one."""
    low, high = map(number, ends)
    return {
        "label": label, "symbol": symbol, "value": number(value), "unit": unit, "low": low,
        "high": high, "confidence": confidence, "note": note,
    }  # fmt: skip


def figure_with_ends(
    dataset: xr.Dataset, name: str, label: str, unit: str = "1", *, suffix: str = "", **how: Any
) -> dict[str, Any]:
    """Return a number of the facts with its interval: ``name``, ``name_low``, ``name_high``."""
    value, *ends = (value_of(dataset, f"{name}{end}{suffix}") for end in ("", "_low", "_high"))
    confidence = value_of(dataset, "confidence")
    return figure(label, value, unit, ends=(ends[0], ends[1]), confidence=confidence, **how)


def settings_of(*values: Sequence[Any]) -> list[tuple[Any, ...]]:
    """Return every combination of values, the last one fastest.

    Parameters
    ----------
    *values : sequence
        The values of each parameter.

    Raises
    ------
    InputError
        When there are more: a damaged file may declare an axis of any length.

    Examples
    --------
    >>> settings_of("ab", [1, 2])
    [('a', 1), ('a', 2), ('b', 1), ('b', 2)]
    """
    total = math.prod(len(each) for each in values)
    if total > MOST_SETTINGS:
        raise InputError(f"{total} settings are more than the {MOST_SETTINGS} that a page shows")
    return list(product(*values))


def warnings_section(items: Sequence[str]) -> Section:
    """Return the warnings; that there are none is said too."""
    note = None if items else "None."
    return section("warnings", "warnings", "Warnings", note, items=list(items))


Style = Literal["line", "points", "step"]


def chart(
    note: str | None = None,
    *,
    x: Mapping[str, Any],
    y: Mapping[str, Any],
    series: Sequence[Mapping[str, Any]],
    marks: Sequence[Mapping[str, Any]] = (),
    id: str = "",
    title: str = "",
) -> Section:
    """Return a section of kind "lines".

    Parameters
    ----------
    note : str, optional
        As of every section.
    x, y : mapping
        Result of `label`, or the axis of a map.
    series : sequence of mapping
        Results of `series`.
    marks : sequence of mapping
        Results of `mark`.
    id, title : str
        Where the section has its own, see `attempt`.
    """
    axes = [{key: axis[key] for key in ("label", "unit", "log") if key in axis} for axis in (x, y)]
    return section(
        id, "lines", title, note, x=axes[0], y=axes[1], series=list(series), marks=list(marks)
    )


def label(text: str, unit: str = "1", *, log: bool = False) -> dict[str, Any]:
    """Return an axis of a chart.

    Examples
    --------
    >>> label("time", "s")
    {'label': 'time', 'unit': 's', 'log': False}
    """
    return {"label": text, "unit": unit, "log": log}


def series(
    name: str,
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    *,
    ends: tuple[npt.ArrayLike, npt.ArrayLike] | None = None,
    style: Style = "line",
) -> dict[str, Any]:
    """Return a line, points or steps, with a band or error bars where `ends` are given.

    Parameters
    ----------
    name : str
        Text of the legend.
    x, y : array_like
        Places; NaN breaks a line. For steps x has one more than y.
    ends : tuple of array_like, optional
        Lower and upper end at each x; left out where no number of them is finite.
    style : {"line", "points", "step"}
        How it is drawn.
    """
    low = high = None
    if ends is not None and np.isfinite(np.asarray(ends, dtype=np.float64)).any():
        low, high = (numbers(end) for end in ends)
    return {
        "name": name, "x": numbers(x), "y": numbers(y), "low": low, "high": high,
        "style": style,
    }  # fmt: skip


def course(name: str, x: npt.ArrayLike, found: xr.Dataset, of: str, **how: Any) -> dict[str, Any]:
    """Return a series of a variable, with its limits where the dataset holds them."""
    low, high = (found.get(f"{of}_{end}") for end in ("low", "high"))
    ends = None if low is None or high is None else (low.values, high.values)
    return series(name, x, found[of].values, ends=ends, **how)


def mark(text: str, x: Any = None, y: Any = None) -> dict[str, Any]:
    """Return a mark: a point, or a line across where one of the two is left out.

    Examples
    --------
    >>> mark("noise floor", y=0.03)
    {'label': 'noise floor', 'x': None, 'y': 0.03}
    """
    return {"label": text, "x": number(x), "y": number(y)}
