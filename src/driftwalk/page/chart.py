"""Charts of a page: axes, series and marks of a section of kind "lines"."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from driftwalk.page.arrays import number, numbers
from driftwalk.page.parts import Section, section

Style = Literal["line", "points", "step"]


def chart(
    id: str,
    title: str,
    note: str | None = None,
    *,
    x: Mapping[str, Any],
    y: Mapping[str, Any],
    series: Sequence[Mapping[str, Any]],
    marks: Sequence[Mapping[str, Any]] = (),
) -> Section:
    """Return a section of kind "lines".

    Parameters
    ----------
    id, title, note : str
        As of every section.
    x, y : mapping
        Result of `label`, or the axis of a map.
    series : sequence of mapping
        Results of `series`.
    marks : sequence of mapping
        Results of `mark`.
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


def mark(text: str, x: Any = None, y: Any = None) -> dict[str, Any]:
    """Return a mark: a point, or a line across where one of the two is left out.

    Examples
    --------
    >>> mark("noise floor", y=0.03)
    {'label': 'noise floor', 'x': None, 'y': 0.03}
    """
    return {"label": text, "x": number(x), "y": number(y)}
