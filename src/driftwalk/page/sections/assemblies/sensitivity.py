"""A page on the sensitivity of self-assembly: what was found, and all its other sections."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from driftwalk.page.axes import axis_words
from driftwalk.page.number_words import count, quantity
from driftwalk.page.parts import (
    Section,
    attempt,
    empty_head,
    empty_section,
    figure,
    head_sections,
    require,
    section,
    value_of,
)
from driftwalk.page.sections.assemblies.biplot import biplot_section
from driftwalk.page.sections.assemblies.classes import classes_section
from driftwalk.page.sections.assemblies.settings import (
    l1_sections,
    setting_sections,
    times_sections,
)
from driftwalk.page.sections.assemblies.sobol import sobol_section

if TYPE_CHECKING:
    import xarray as xr


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
    if sensitivity is None:
        made = empty_head("There is no map of settings yet.")
    else:
        made = head_sections(
            lambda: sensitivity_summary(sensitivity, reference), lambda: _warnings(sensitivity)
        )
        made += attempt("l1", "Distance to the reference", lambda: l1_sections(sensitivity))
        made += attempt("medians", "Over the settings", lambda: setting_sections(sensitivity))
        made += attempt("times", "Outcome classes over time", lambda: times_sections(sensitivity))
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
    names = " and ".join(axis_words(str(dim)) for dim in distance.dims)
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
        figure("smallest l1 distance", known.min() if known.size else None),
        figure("largest l1 distance", known.max() if known.size else None),
        figure("by chance, 95 %", floor, note="distance of the reference to itself"),
    ]
    return section("summary", "summary", "Method and results", paragraphs=paragraphs, numbers=shown)


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
