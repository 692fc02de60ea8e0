"""A page on the sensitivity of self-assembly: l1 map, shares per setting, components, indices."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError
from driftwalk.report.assembly_labels import class_names, classes_to_show
from driftwalk.report.page_arrays import encode_array, number, numbers
from driftwalk.report.page_chart import chart, label, mark, series
from driftwalk.report.page_classes import cells_of, classes_section
from driftwalk.report.page_parts import (
    Section,
    attempt,
    axis,
    empty_section,
    figure,
    require,
    section,
    value_of,
    warnings_section,
)
from driftwalk.report.page_words import count, quantity

if TYPE_CHECKING:
    import xarray as xr

Floats = npt.NDArray[np.float64]

AXES: Final = {
    "force_std": ("stochastic force σ_F", "N", "_N"),
    "drag_coefficient": ("drag coefficient C_d", "1", ""),
    "tank_diameter": ("tank diameter", "m", "_m"),
    "blocks": ("number of blocks", "1", ""),
}
"""Label, unit, and what an attribute's name has more, in the order from x to y."""
NOT_REACHED: Final = "Blank where half the runs did not reach it."
MAP_AXES: Final = 2
LONGEST_ARROW: Final = 0.9
MOST_ARROWS: Final = 20
MOST_SLICES: Final = 12
MOST_CLASSES_OF_INDICES: Final = 12


def sensitivity_sections(
    *,
    sensitivity: xr.Dataset | None = None,
    reference: xr.Dataset | None = None,
    components: xr.Dataset | None = None,
    sobol: xr.Dataset | None = None,
) -> list[Section]:
    """Return the sections of a page on a sensitivity analysis.

    Parameters
    ----------
    sensitivity : xarray.Dataset, optional
        A `sensitivity`; None while there is none yet.
    reference : xarray.Dataset, optional
        Its reference, an `outcome_distribution`.
    components : xarray.Dataset, optional
        Its `components`.
    sobol : xarray.Dataset, optional
        Its `sobol_indices`.

    Returns
    -------
    list of dict
        Sections; what cannot be shown is an empty one that says why.

    Examples
    --------
    >>> [part["kind"] for part in sensitivity_sections()]
    ['empty']
    """
    made: list[Section] = []
    if sensitivity is None:
        reason = "The map of settings is not there yet."
        made.append(empty_section("summary", "What was found", reason))
    else:
        made += attempt(
            "summary", "What was found", lambda: sensitivity_summary(sensitivity, reference)
        )
        made += attempt("warnings", "Warnings", lambda: warnings_section(_warnings(sensitivity)))
        made += attempt("l1", "Distance to the reference", lambda: l1_sections(sensitivity))
        made += attempt("medians", "Over the settings", lambda: setting_sections(sensitivity))
    if reference is not None:
        made += attempt(
            "reference",
            "The reference",
            lambda: (
                classes_section({"reference": reference}, id="reference")
                | {"title": "The reference"}
            ),
        )
    if components is not None and sensitivity is not None:
        made += attempt(
            "biplot", "Principal components", lambda: biplot_section(components, sensitivity)
        )
    elif sensitivity is not None:
        reason = "They need two settings with different outcomes."
        made.append(empty_section("biplot", "Principal components", reason))
    if sobol is not None:
        made += attempt("sobol", "Sobol' indices", lambda: sobol_section(sobol))
    return made


def sensitivity_summary(sensitivity: xr.Dataset, reference: xr.Dataset | None) -> Section:
    """Return the sensitivity in words and numbers."""
    require(sensitivity, "l1_distance", "runs")
    distance = sensitivity["l1_distance"]
    names = " and ".join(_axis_words(str(dim)) for dim in distance.dims)
    runs = int(np.nanmax(sensitivity["runs"].values))
    done = (
        f"Self-assembly was simulated at {count(int(distance.size), 'setting')} of the {names}, "
        f"up to {count(runs, 'run')} each, and its outcomes were compared with those of a reference"
    )
    if reference is not None and "drag_coefficient" in reference.attrs:
        done += (
            f" (C_d = {quantity(reference.attrs['drag_coefficient'])}, σ_F = "
            f"{quantity(reference.attrs['force_std_N'], 'N')})"
        )
    known = distance.values[np.isfinite(distance.values)]
    floor = value_of(sensitivity, "noise_floor_95")
    paragraphs = [f"{done}. The l1 distance runs from 0, alike, to 2, nothing in common."]
    if known.size:
        told = (
            f"It lies between {known.min():.3g} and {known.max():.3g}, with median "
            f"{np.median(known):.3g}."
        )
        if floor is not None:
            above = int((known > floor).sum())
            told += (
                f" Chance alone gives up to {floor:.3g} (95 %): {above} of {known.size} settings "
                "differ from the reference by more."
            )
        paragraphs.append(told)
    shown = [
        figure("smallest l1 distance", known.min() if known.size else None),
        figure("largest l1 distance", known.max() if known.size else None),
        figure("by chance, 95 %", floor, note="distance of the reference to itself"),
    ]
    return section(
        "summary", "summary", "What was done and found", paragraphs=paragraphs, numbers=shown
    )


def require_axes(sensitivity: xr.Dataset) -> None:
    """Raise `InputError` unless the study has its distances and the values of its axes."""
    require(sensitivity, "l1_distance")
    require(sensitivity, *map(str, sensitivity["l1_distance"].dims))


def l1_sections(sensitivity: xr.Dataset) -> list[Section]:
    """Return the distance to the reference over the axes: maps, or lines where they are no map.

    A study of more than two axes has a map for each value of the others, at most 12.

    Parameters
    ----------
    sensitivity : xarray.Dataset
        A `sensitivity`.

    Raises
    ------
    InputError
        When it holds no distance.
    """
    require_axes(sensitivity)
    made: list[Section] = []
    for number_of, (words, part) in enumerate(_slices(sensitivity)):
        if number_of == MOST_SLICES:
            made[-1]["note"] += " More are in the file."
            break
        id = "l1" if number_of == 0 else f"l1-{number_of + 1}"
        x, y = _map_axes(part)
        title = f"Distance to the reference{words}"
        if y is None or _is_words(part, x) or _is_words(part, y):
            made.append(_lines(part, "l1_distance", id, title, "l1 distance", noise=True))
        else:
            made.append(_l1_map(part, x, y, id, title))
    return made


def setting_sections(sensitivity: xr.Dataset) -> list[Section]:
    """Return the shares of complete runs and the median times over the settings."""
    shown = {
        "complete": ("Share of runs that end as one assembly", "share of runs", "1"),
        "first_contact_median": ("Median time of the first contact", "time", "s"),
        "completion_median": ("Median time of completion", "time", "s"),
    }
    require_axes(sensitivity)
    made: list[Section] = []
    if sensitivity["l1_distance"].ndim > MAP_AXES:
        return made
    for name, (title, words, unit) in shown.items():
        if name not in sensitivity or not np.isfinite(sensitivity[name].values).any():
            continue
        x, y = _map_axes(sensitivity)
        id = name.replace("_", "-")
        if y is None or _is_words(sensitivity, x) or _is_words(sensitivity, y):
            made.append(_lines(sensitivity, name, id, title, words, unit=unit))
            continue
        made.append(
            section(
                id, "image_grid", title, None if unit == "1" else NOT_REACHED,
                arena=None, x=_axis(sensitivity, x), y=_axis(sensitivity, y),
                value=encode_array(sensitivity[name].transpose(y, x).values),
                label=words, unit=unit, diverging=False, limits=[0.0, 1.0] if unit == "1" else None,
            )
        )  # fmt: skip
    return made


def biplot_section(components: xr.Dataset, sensitivity: xr.Dataset) -> Section:
    """Return the settings on their first two principal components, the classes as arrows."""
    require(components, "score", "loading", "explained_variance_ratio", "class")
    require_axes(sensitivity)
    if components.sizes["component"] < MAP_AXES:
        raise InputError("all outcomes lie on one line: there is one principal component")
    dims = [str(dim) for dim in components["score"].dims if dim != "component"]
    score = (
        components["score"]
        .transpose(*dims, "component")
        .values.reshape(-1, components.sizes["component"])[:, :2]
    )
    loading = components["loading"].transpose("class", "component").values[:, :2]
    reach, longest = (float(np.nanmax(np.hypot(*v.T), initial=0.0)) for v in (score, loading))
    factor = LONGEST_ARROW * reach / longest if reach and longest else 1.0
    tips = factor * loading
    order = np.argsort(-np.hypot(*tips.T), kind="stable")[:MOST_ARROWS]
    names = class_names(components)
    share = components["explained_variance_ratio"].values
    values = {
        name: numbers(sensitivity[name].transpose(*dims).values.ravel())
        for name in ("complete", "l1_distance")
        if name in sensitivity and set(map(str, sensitivity[name].dims)) == set(dims)
    }
    return section(
        "biplot", "biplot", "Principal components",
        f"Points are settings, arrows the loadings of the classes, {factor:.3g} times as long.",
        axes=[{"label": f"component {k + 1}", "share": number(share[k])} for k in range(2)],
        points={
            "x": numbers(score[:, 0]), "y": numbers(score[:, 1]),
            "names": _setting_names(sensitivity, dims), "values": values or None,
        },
        arrows=[
            {"name": names[k], "x": float(tips[k, 0]), "y": float(tips[k, 1])}
            for k in sorted(order.tolist())
        ],
    )  # fmt: skip


def sobol_section(sobol: xr.Dataset) -> Section:
    """Return the Sobol' indices of the share of complete runs and of the largest classes."""
    require(sobol, "first_order", "total_order", "output", "input")
    inputs = [_axis_words(str(name)) for name in sobol["input"].values]
    variance = sobol["variance"].values if "variance" in sobol else np.ones(sobol.sizes["output"])
    order = [0, *(1 + np.argsort(-variance[1:], kind="stable")[:MOST_CLASSES_OF_INDICES])]
    rows = []
    for output, k in product(sorted(map(int, order)), range(len(inputs))):
        found = {
            name: sobol[name].transpose("output", "input").values[output, k]
            for name in _INDICES
            if name in sobol
        }
        rows.append(
            [
                str(sobol["output"].values[output]),
                inputs[k],
                *(number(found.get(name)) for name in _INDICES),
            ]
        )
    columns = ["output", "input", "first order", "± half width", "total", "± half width"]
    return section(
        "sobol", "table", "Sobol' indices",
        "Share of an output's variance that an input makes alone (first order), and with the "
        "others (total).",
        columns=columns, rows=rows,
    )  # fmt: skip


_INDICES: Final = (
    "first_order",
    "first_order_half_width",
    "total_order",
    "total_order_half_width",
)


def _l1_map(part: xr.Dataset, x: str, y: str, id: str, title: str) -> Section:
    names = class_names(part) if "class" in part else []
    shares = None
    shown: list[str] = []
    if "proportion" in part and names:
        every = part["proportion"].transpose(y, x, "class").values
        largest = np.nan_to_num(every).reshape(-1, len(names)).max(axis=0)
        kept = classes_to_show(names, largest)
        shown, shares = [names[k] for k in kept], encode_array(every[:, :, kept])
    floor = value_of(part, "noise_floor_95")
    note = "0: the outcomes of the reference; 2: none in common."
    if floor is not None:
        note += f" Chance alone gives up to {floor:.3g} (95 %)."
    at = [_reference(part, name) for name in (x, y)]
    return section(
        id, "l1_map", title, note,
        x=_axis(part, x), y=_axis(part, y),
        value=encode_array(part["l1_distance"].transpose(y, x).values),
        reference=None if None in at else {"x": at[0], "y": at[1]},
        noise=floor,
        label="l1 distance",
        classes=shown,
        cells=[cells_of(name) for name in shown],
        shares=shares,
    )  # fmt: skip


def _lines(
    part: xr.Dataset,
    variable: str,
    id: str,
    title: str,
    words: str,
    *,
    unit: str = "1",
    noise: bool = False,
) -> Section:
    """Return a variable along one axis, or along numbers for each word of another."""
    x, y = _map_axes(part)
    if y is not None and _is_words(part, x) and not _is_words(part, y):
        x, y = y, x
    positions, note = _positions(part, x)
    drawn: list[dict[str, Any]] = []
    if y is None:
        drawn.append(series(words, positions, part[variable].values, style="points"))
    else:
        for value in part[y].values:
            one = part[variable].sel({y: value}).values
            drawn.append(
                series(f"{_axis_words(y)} {_value_words(y, value)}", positions, one, style="points")
            )
    marks = []
    floor = value_of(part, "noise_floor_95")
    if noise and floor is not None:
        marks.append(mark("by chance, 95 %", y=floor))
    words_x = AXES.get(x, (_axis_words(x), "1", ""))
    return chart(
        id, title, note or None, x=label(words_x[0], words_x[1]), y=label(words, unit),
        series=drawn, marks=marks,
    )  # fmt: skip


def _positions(part: xr.Dataset, name: str) -> tuple[Floats, str]:
    """Return places along an axis, and what they stand for where it is one of words."""
    if not _is_words(part, name):
        return np.asarray(part[name].values, dtype=np.float64), ""
    values = [str(value) for value in part[name].values]
    told = ", ".join(f"{k}: {value}" for k, value in enumerate(values, start=1))
    return np.arange(1.0, len(values) + 1.0), f"{_axis_words(name)}: {told}.".capitalize()


def _slices(sensitivity: xr.Dataset) -> list[tuple[str, xr.Dataset]]:
    """Return the parts of a study that have at most two axes, and what they are."""
    dims = [str(dim) for dim in sensitivity["l1_distance"].dims]
    fixed = dims[: max(len(dims) - MAP_AXES, 0)]
    parts = []
    for values in product(*(sensitivity[name].values.tolist() for name in fixed)):
        chosen = dict(zip(fixed, values, strict=True))
        words = "".join(f", {_axis_words(n)} {_value_words(n, v)}" for n, v in chosen.items())
        parts.append((words, sensitivity.sel(chosen)))
    return parts


def _map_axes(part: xr.Dataset) -> tuple[str, str | None]:
    """Return which axis is x and which is y: the force lies along x, as in the paper's figures."""
    order = [*AXES]
    names = [str(dim) for dim in part["l1_distance"].dims]
    ranked = sorted(names, key=lambda name: order.index(name) if name in order else len(order))
    return ranked[0], ranked[1] if len(ranked) > 1 else None


def _is_words(part: xr.Dataset, name: str) -> bool:
    return part[name].dtype.kind not in "iuf"


def _axis(part: xr.Dataset, name: str) -> dict[str, Any]:
    words, unit, _ = AXES.get(name, (_axis_words(name), "1", ""))
    every = value_of(part, "force_interval_s")
    if name == "force_std" and every is not None:
        words += f", drawn anew every {quantity(every, 's')}"
    return axis(name, words, unit, part[name].values)


def _reference(part: xr.Dataset, name: str) -> float | None:
    return value_of(part, f"reference_{name}{AXES.get(name, ('', '', ''))[2]}")


def _setting_names(sensitivity: xr.Dataset, dims: list[str]) -> list[str]:
    every = [
        [f"{_axis_words(n)} {_value_words(n, v)}" for v in sensitivity[n].values] for n in dims
    ]
    return [", ".join(words) for words in product(*every)]


def _value_words(name: str, value: Any) -> str:
    if isinstance(value, str):
        return value.replace("_", " ")
    return quantity(float(value), AXES.get(name, ("", "1", ""))[1])


def _axis_words(name: str) -> str:
    return "stochastic force" if name == "force_std" else name.replace("_", " ")


def _warnings(sensitivity: xr.Dataset) -> list[str]:
    require(sensitivity, "l1_distance")
    left_out = int(sensitivity["left_out"].sum()) if "left_out" in sensitivity else 0
    unknown = int((~np.isfinite(sensitivity["l1_distance"].values)).sum())
    said = (
        (
            left_out,
            f"{count(left_out, 'run')} broke down and are left out; use a smaller time step",
        ),
        (unknown, f"{count(unknown, 'setting')} cannot be compared with the reference"),
    )
    return [text for holds, text in said if holds]
