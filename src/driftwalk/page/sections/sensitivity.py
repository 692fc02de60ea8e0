"""A page on the sensitivity of self-assembly: summary, principal components, Sobol' indices."""

from __future__ import annotations

from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Final

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.page import parts
from driftwalk.page.arrays import number, numbers
from driftwalk.page.parts import Section, count, quantity, require, value_of
from driftwalk.page.sections.outcomes import cells_of, classes_section
from driftwalk.page.sections.sensitivity_maps import (
    l1_sections,
    require_axes,
    setting_names,
    setting_sections,
    times_sections,
)
from driftwalk.plot.components import biplot_of
from driftwalk.plot.parts.outcome_classes import are_discs
from driftwalk.schema.kinds.sensitivity import axis_number

if TYPE_CHECKING:
    import xarray as xr

_INDICES: Final = (
    *("first_order", "first_order_half_width"),
    *("total_order", "total_order_half_width"),
)


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
    made = parts.sections_of(
        sensitivity,
        "There is no map of settings yet.",
        lambda found: sensitivity_summary(found, reference),
        _warnings,
        (
            ("l1", "Distance to the reference", l1_sections),
            ("medians", "Over the settings", setting_sections),
            ("times", "Outcome classes over time", times_sections),
        ),
    )
    return made + parts.attempts(
        ("reference", "The reference", lambda one: classes_section({"reference": one}), reference),
        ("biplot", "Principal components", partial(biplot_section, components), sensitivity),
        ("sobol", "Sobol' indices", sobol_section, sobol),
    )


def sensitivity_summary(sensitivity: xr.Dataset, reference: xr.Dataset | None) -> Section:
    """Return the sensitivity in words and numbers."""
    require(sensitivity, "l1_distance", "runs")
    distance = sensitivity["l1_distance"]
    names = " and ".join(axis_number(str(dim)).plain for dim in distance.dims)
    runs = int(np.nanmax(sensitivity["runs"].values))
    done = (
        f"Self-assembly was simulated at {count(int(distance.size), 'setting')} of the {names}, up "
        f"to {count(runs, 'run')} each, and its outcomes were compared with a reference"
    )
    if reference is not None and "drag_coefficient" in reference.attrs:
        done += (
            f" (C_d = {quantity(reference.attrs['drag_coefficient'])}, σ_F = "
            f"{quantity(reference.attrs['force_std_N'], 'N')})"
        )
    known = distance.values[np.isfinite(distance.values)]
    floor = value_of(sensitivity, "noise_floor_95")
    paragraphs = [f"{done}. The l1 distance runs from 0 (identical) to 2 (nothing in common)."]
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
        parts.figure("smallest l1 distance", known.min() if known.size else None),
        parts.figure("largest l1 distance", known.max() if known.size else None),
        parts.figure("by chance, 95 %", floor, note="distance of the reference to itself"),
    ]
    return parts.summary_section(paragraphs, shown)


def _warnings(sensitivity: xr.Dataset) -> list[str]:
    require(sensitivity, "l1_distance")
    left_out = int(sensitivity["left_out"].sum()) if "left_out" in sensitivity else 0
    unknown = int((~np.isfinite(sensitivity["l1_distance"].values)).sum())
    said = []
    if left_out:
        words = "broke down and are left out; use a smaller time step"
        said.append(f"{count(left_out, 'run')} {words}")
    if unknown:
        said.append(f"{count(unknown, 'setting')} cannot be compared with the reference")
    return said


def biplot_section(components: xr.Dataset | None, sensitivity: xr.Dataset) -> Section:
    """Return the settings on their first two principal components, the classes as arrows."""
    if components is None:
        raise InputError("They need two settings with different outcomes.")
    require_axes(sensitivity)
    found = biplot_of(components)
    dims = [str(dim) for dim in components["score"].dims if dim != "component"]
    # More than 20 arrows hide each other.
    order = np.argsort(-np.hypot(*found.tips.T), kind="stable")[:20]
    values = {
        name: numbers(sensitivity[name].transpose(*dims).values.ravel())
        for name in ("complete", "l1_distance")
        if name in sensitivity and set(map(str, sensitivity[name].dims)) == set(dims)
    }
    return parts.section(
        "biplot", "biplot", "Principal components",
        "Points are settings, arrows the loadings of the classes, "
        f"{found.factor:.3g} times as long.",
        axes=[
            {"label": f"component {k}", "share": share}
            for k, share in enumerate(found.shares.tolist(), start=1)
        ],
        points={
            "x": numbers(found.points[:, 0]), "y": numbers(found.points[:, 1]),
            "names": setting_names(sensitivity, dims), "values": values or None,
        },
        arrows=[
            {
                "name": found.names[k], "x": float(found.tips[k, 0]), "y": float(found.tips[k, 1]),
                "cells": cells_of(found.names[k], discs=are_discs(*found.names)),
            }
            for k in sorted(order.tolist())
        ],
    )  # fmt: skip


def sobol_section(sobol: xr.Dataset) -> Section:
    """Return the Sobol' indices of the share of complete runs and of the largest classes."""
    require(sobol, "first_order", "total_order", "output", "input")
    inputs = [axis_number(str(name)).plain for name in sobol["input"].values]
    variance = sobol["variance"].values if "variance" in sobol else np.ones(sobol.sizes["output"])
    # Next to the share of complete runs, the 12 classes that vary most.
    order = [0, *(1 + np.argsort(-variance[1:], kind="stable")[:12])]
    known = {
        name: sobol[name].transpose("output", "input").values for name in _INDICES if name in sobol
    }
    rows = [
        [
            str(sobol["output"].values[output]),
            words,
            *(number(known[name][output, k]) if name in known else None for name in _INDICES),
        ]
        for output, (k, words) in product(sorted(map(int, order)), enumerate(inputs))
    ]
    return parts.table_section(
        ["output", "input", "first order", "± half width", "total", "± half width"], rows,
        "Share of an output's variance that an input explains alone (first order), "
        "and together with the others (total).",
    )  # fmt: skip
