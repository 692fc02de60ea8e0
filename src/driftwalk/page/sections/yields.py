"""A page on a maximised yield: the best setting, the others, and the front of yield and time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from driftwalk.core.units import in_percent, percent
from driftwalk.page import parts
from driftwalk.page.parts import Maker, Section, require, required
from driftwalk.page.sections.sensitivity_maps import is_words
from driftwalk.schema.answers.yields import (
    front_table,
    setting_table,
    setting_words,
    standing_sentences,
    varied,
    yield_answer,
)
from driftwalk.schema.kinds.sensitivity import axis_number
from driftwalk.schema.shapes import short_class

if TYPE_CHECKING:
    import xarray as xr

BY_TIME = "Best setting by time"
MOST_CURVES = 6
"""Settings whose yield is drawn over time; chosen by hand."""


def yield_sections(*, yields: xr.Dataset | None = None) -> list[Section]:
    """Return the sections of a page on a maximised yield.

    Parameters
    ----------
    yields : xarray.Dataset, optional
        A `yield`; None while there is none yet.

    Returns
    -------
    list of dict
        Sections; what cannot be shown is an empty one that says why.

    Examples
    --------
    >>> [part["kind"] for part in yield_sections()]
    ['empty']
    """
    pieces: list[tuple[str, str, Maker]] = [
        ("front", "Front of yield and time", front_section),
        parts.table_part("settings", "Settings", setting_table),
        ("along", "Along each setting", along_sections),
        parts.table_part("times", BY_TIME, front_table),
    ]
    return parts.sections_of(yields, "There is no yield yet.", yield_summary, _warnings, pieces)


def yield_summary(yields: xr.Dataset) -> Section:
    """Return the best setting, its yield, and whether it was distinguished from the others."""
    best = yields.isel(setting=required(yields, "best"))
    target, facts = short_class(str(required(yields, "target"))), yields.attrs
    low, high = (float(best[f"fresh_yield_{end}"]) for end in ("low", "high"))
    paragraphs = [
        f"{yields.sizes['setting']} settings were compared by {facts['chosen_runs']} runs: run k "
        "of every setting has the same random numbers. The yields come from "
        f"{facts['reported_runs']} fresh runs, which chose nothing.",
        f"Most runs reach {target} by {facts['by_s']:g} s at "
        f"{setting_words(yields, required(yields, 'best'))}.",
        # A paragraph has no code.
        *(f"{text[:1].upper()}{text[1:]}.".replace("`", "") for text in standing_sentences(yields)),
    ]
    shown = [
        parts.figure(
            f"yield of {target} by {facts['by_s']:g} s", float(best["fresh_yield"]),
            note=f"{percent(low)} to {percent(high)}, {in_percent(facts['confidence'])} interval",
        )
    ]  # fmt: skip
    return parts.summary_section(paragraphs, shown)


def front_section(yields: xr.Dataset) -> Section:
    """Return the largest yield over time, and the curves of some settings."""
    require(yields, "time", "share", "front_yield", "front_yield_low", "front_yield_high")
    time = yields["time"].values
    drawn = [parts.course("best setting of each time", time, yields, "front_yield")]
    fresh = np.flatnonzero(yields["fresh_runs"].values > 0)
    order = fresh[np.argsort(-yields["fresh_yield"].values[fresh], kind="stable")]
    drawn += [
        parts.series(setting_words(yields, int(at)), time, yields["share"].values[at])
        for at in order[:MOST_CURVES]
    ]
    return parts.chart(
        "From fresh runs; for each time the setting was chosen by the runs before them.",
        x=parts.label("time", "s"), y=parts.label("share of runs with the target"), series=drawn,
        marks=[parts.mark(f"deadline {yields.attrs['by_s']:g} s", x=yields.attrs["by_s"])],
    )  # fmt: skip


def along_sections(yields: xr.Dataset) -> list[Section]:
    """Return the yields of all settings along each axis with numbers."""
    require(yields, "runs", "reached", "standing")
    share = (yields["reached"] / yields["runs"]).values
    found = []
    for name in varied(yields):
        values = yields[name].values
        if is_words(yields, name) or len(set(values.tolist())) < 2:
            continue
        drawn = []
        for word in ("worse", "alike", "best"):
            mine = yields["standing"].values == word
            if mine.any():
                text = "cannot be distinguished" if word == "alike" else word
                drawn.append(parts.series(text, values[mine], share[mine], style="points"))
        number = axis_number(name)
        found.append(
            parts.chart(
                "In the choosing runs.", id=f"along-{name}", title=f"Yield along {number.plain}",
                x=parts.label(number.words, number.unit), y=parts.label("yield"), series=drawn,
            )
        )  # fmt: skip
    return found


def _warnings(found: xr.Dataset) -> list[str]:
    return yield_answer(found).warnings
