"""Shared parts of the figures of self-assembly: classes, their colours, axes of a sweep."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.plot.parts.labels import force_label, in_unit, number_label
from driftwalk.plot.parts.style import PALETTE
from driftwalk.schema.check import kind_name
from driftwalk.schema.kinds.sensitivity import AXIS_NUMBERS, axis_number
from driftwalk.schema.shapes import is_one_assembly

if TYPE_CHECKING:
    import xarray as xr


GREYS: Final = ("#9a9a9a", "#6b6b6b", "#bdbdbd", "#4d4d4d", "#848484")
OTHER: Final = "other"


class SweepAxis(NamedTuple):
    """An axis of a sensitivity study as a figure shows it."""

    name: str
    """Dimension of the dataset."""
    label: str
    """Label with unit."""
    values: Floats
    """Places along the axis, in the unit of the label; 0, 1, ... for words."""
    words: list[str]
    """The words of a categorical axis; empty for numbers."""


def check_kind(dataset: xr.Dataset, kind: str, *variables: str) -> None:
    """Raise `InputError` unless the dataset is of this kind and has these variables."""
    found = kind_name(dataset) or "a dataset of no kind"
    if found != kind:
        raise InputError(f"expected a dataset of kind '{kind}', got '{found}'")
    missing = [name for name in variables if name not in dataset.variables]
    if missing:
        raise InputError(f"the dataset '{kind}' lacks {', '.join(missing)}: nothing to draw")


def class_names(dataset: xr.Dataset) -> list[str]:
    """Return the names of the outcome classes, in the order of the dataset."""
    return [str(name) for name in dataset["class"].values]


def is_complete(name: str) -> bool:
    """Return whether all blocks of a class are in one assembly.

    Examples
    --------
    >>> is_complete("T"), is_complete("2+2")
    (True, False)
    """
    return is_one_assembly(name) and name not in ("", OTHER)


def classes_to_show(names: list[str], share: Floats) -> list[int]:
    """Choose the classes that a figure shows one by one; the rest is summed as "other".

    Up to 16 classes are all shown. Of more, those that reach 1 % somewhere, and of these at most
    the 20 largest.

    Parameters
    ----------
    names : list of str
        Names of the classes.
    share : array, shape (..., classes)
        Proportions of the classes in all that is drawn; NaN where they are unknown.

    Returns
    -------
    list of int
        Indices of the classes to show, in their order.

    Examples
    --------
    >>> classes_to_show(["I", "O"], np.array([1.0, 0.0]))
    [0, 1]
    """
    if len(names) <= 16:
        return list(range(len(names)))
    largest = np.nan_to_num(share).reshape(-1, len(names)).max(axis=0, initial=0.0)
    ranked = np.argsort(-largest, kind="stable")[:20]
    return sorted(int(index) for index in ranked if largest[index] >= 0.01)


def with_rest(values: npt.NDArray[Any], shown: list[int], *, axis: int = 0) -> npt.NDArray[Any]:
    """Return the shown classes along an axis, and behind them the sum of the others."""
    kept = values.take(shown, axis=axis)
    rest = np.delete(values, shown, axis=axis)
    if not rest.shape[axis]:
        return kept
    return np.concatenate([kept, rest.sum(axis=axis, keepdims=True)], axis)


def class_colors(names: list[str]) -> dict[str, str]:
    """Return a colour for every class: hues for one assembly, greys for several.

    Examples
    --------
    >>> class_colors(["2", "1+1"])
    {'2': '#0072B2', '1+1': '#9a9a9a'}
    """
    colors: dict[str, str] = {}
    hues = greys = 0
    for name in names:
        if name == OTHER:
            colors[name] = "#ececec"
        elif is_complete(name):
            colors[name] = PALETTE[hues % len(PALETTE)]
            hues += 1
        else:
            colors[name] = GREYS[greys % len(GREYS)]
            greys += 1
    return colors


def sweep_axes(variable: xr.DataArray, dataset: xr.Dataset) -> list[SweepAxis]:
    """Return the axes of a study over which a variable is given, drag before force.

    Parameters
    ----------
    variable : xarray.DataArray
        A variable of the study whose dimensions are those of the sweep and perhaps ``class`` or
        ``component``.
    dataset : xarray.Dataset
        The study, for its coordinates and the interval of the force.
    """
    names = [str(dim) for dim in variable.dims if dim not in ("class", "component")]
    order = [*AXIS_NUMBERS]
    known = sorted((name for name in names if name in order), key=order.index)
    return [_sweep_axis(name, dataset) for name in [*known, *(n for n in names if n not in order)]]


def reference_value(dataset: xr.Dataset, axis: SweepAxis) -> float:
    """Return where the reference lies on an axis, NaN when the dataset does not say."""
    number = axis_number(axis.name)
    found = dataset.attrs.get(f"reference_{number.key}")
    if found is None:
        return np.nan
    if axis.words:
        word = _word(found)
        return float(axis.words.index(word)) if word in axis.words else np.nan
    return number.factor * float(found)


def runs_text(dataset: xr.Dataset) -> str:
    """Return "4 blocks, 1000 runs" as far as the dataset says."""
    parts = []
    for name, word in (("blocks", "block"), ("runs", "run")):
        if name in dataset.attrs:
            number = int(dataset.attrs[name])
            parts.append(f"{number} {word}{'' if number == 1 else 's'}")
    return ", ".join(parts)


def _word(value: Any) -> str:
    return str(value).replace("_", " ")


def _sweep_axis(name: str, dataset: xr.Dataset) -> SweepAxis:
    coordinate, number = dataset[name], axis_number(name)
    if coordinate.dtype.kind not in "iuf":
        words = [_word(value) for value in coordinate.values]
        return SweepAxis(name, number.plain, np.arange(len(words), dtype=np.float64), words)
    label = number_label(number)
    if name == "force_std" and "force_interval_s" in dataset.attrs:
        label = force_label(dataset)
    if number.factor != 1.0:
        values = in_unit(coordinate, number.reader_unit, stored=number.unit)
        return SweepAxis(name, label, values, [])
    return SweepAxis(name, label, np.asarray(coordinate.values, dtype=np.float64), [])
