"""A page on the kinetics of self-assembly: verdict, rates, shares over time, way to a target."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.units import percent
from driftwalk.page import parts
from driftwalk.page.parts import Maker, Section, quantity, require, required, value_of
from driftwalk.page.sections.outcomes import cells_of, class_times_section
from driftwalk.plot.kinetics import class_graph_of, placed_arrows
from driftwalk.plot.parts.outcome_classes import are_discs
from driftwalk.schema.answers.facts import sentences
from driftwalk.schema.answers.kinetics import (
    choice_words,
    equal_table,
    equal_words,
    rate_table,
    score_table,
    started,
    target_table,
    target_words,
)
from driftwalk.schema.answers.parts import each
from driftwalk.schema.shapes import short_class

if TYPE_CHECKING:
    import xarray as xr

GRAPH_PX: Final = 800.0
"""Width for which a graph is laid out; a page scales it. Chosen by eye."""
ROW_PX: Final = 78.0
"""Usual width of a page's graph, and height of a class with its name; chosen by eye."""


def kinetics_sections(*, kinetics: xr.Dataset | None = None) -> list[Section]:
    """Return the sections of a page on kinetics.

    Parameters
    ----------
    kinetics : xarray.Dataset, optional
        A `kinetics`; None while there is none yet.

    Returns
    -------
    list of dict
        Sections; what cannot be shown is an empty one that says why.

    Examples
    --------
    >>> [part["kind"] for part in kinetics_sections()]
    ['empty']
    """
    pieces: list[tuple[str, str, Maker]] = [
        ("shares", "Shares over time", shares_sections),
        ("graph", "Graph of the classes", graph_section),
        ("rates", "Rates", rates_sections),
        ("tests", "Tests of a well-mixed tank", mixing_section),
        parts.table_part("models", "Models", score_table),
    ]
    if kinetics is not None and "target" in kinetics.attrs:
        pieces.insert(0, parts.table_part("target", "Way to the target", target_table))
    if kinetics is not None and kinetics.sizes.get("source") == 2:
        pieces.append(parts.table_part("equal", "Equal rates", equal_table))
    nothing = "There are no rates yet."
    return parts.sections_of(kinetics, nothing, kinetics_summary, lambda _: [], pieces)


def kinetics_summary(kinetics: xr.Dataset) -> Section:
    """Return the verdict with its reasons, and the chosen model."""
    facts = kinetics.attrs
    runs, blocks = required(kinetics, "runs"), required(kinetics, "blocks")
    paragraphs = [
        f"{runs} runs of {blocks} blocks changed their outcome class {facts['joins']} times. "
        "Each run is a history of classes; the rates between them were estimated by likelihood.",
        f"Verdict: {required(kinetics, 'verdict')}.",
        *(f"{text[:1].upper()}{text[1:]}." for text in sentences(kinetics, "reason")),
        f"The shares are those of the {required(kinetics, 'chosen')}, {choice_words(kinetics)}.",
    ]
    if "equal_p" in facts:
        paragraphs.append(f"Equal rates of both data sets: {equal_words(kinetics)}.")
    if "other_blocks_refused" in facts:
        paragraphs.append(f"{str(facts['other_blocks_refused']).capitalize()}.")
    chance = value_of(kinetics, "completion_ks_floor")
    note = None if chance is None else f"by chance up to {quantity(chance)}"
    shown = []
    if "target" in facts:
        paragraphs.insert(0, f"{target_words(kinetics)}.")
        shown += _target_figures(kinetics)
    distance = value_of(kinetics, "completion_ks")
    shown.append(parts.figure("KS distance of completion times", distance, note=note))
    if "other_blocks_rate_per_s" in facts:
        words = f"first join of {facts['other_blocks']} blocks, extrapolated"
        shown.append(parts.figure(words, value_of(kinetics, "other_blocks_rate_per_s"), "s-1"))
    return parts.summary_section(paragraphs, shown)


def _target_figures(kinetics: xr.Dataset) -> list[dict[str, Any]]:
    """Return committor and mean first-passage time from where most runs start."""
    one, target = started(kinetics), short_class(str(kinetics.attrs["target"]))
    words = {
        "committor": (f"share of runs that reach {target}", "1"),
        "passage_time": (f"mean time until {target}", "s"),
    }
    made = []
    for name, (text, unit) in words.items():
        value, error = (float(one[f"{name}{end}"]) for end in ("", "_standard_error"))
        if math.isfinite(error):
            note = f"± {quantity(error, unit, digits=2)} (one standard error)"
            made.append(parts.figure(text, value, unit, note=note))
    return made


def shares_sections(kinetics: xr.Dataset) -> list[Section]:
    """Return the predicted shares with their bands, and those seen in each data set."""
    require(kinetics, "time", "share", "share_low", "share_high", "empirical")
    ends = {f"share_{end}": f"proportion_{end}" for end in ("low", "high")}
    made = [
        class_times_section(kinetics.rename({"share": "proportion", **ends}))
        | {"id": "shares", "title": "Predicted shares over time"}
    ]
    for at, one in enumerate(each(kinetics, "source"), start=1):
        name = "" if kinetics.sizes["source"] == 1 else f", {one['source'].values} data set"
        off = abs(one["empirical"] - one["share"]).max("time")
        worst = off.isel({"class": int(off.values.argmax())})
        note = (
            f"At most {percent(float(worst))} of the runs from the predicted share "
            f"({short_class(str(worst['class'].values))})."
        )
        made.append(
            class_times_section(one.rename(empirical="proportion"))
            | {"id": f"seen-{at}", "title": f"Shares seen{name}", "note": note}
        )
    return made


def graph_section(kinetics: xr.Dataset) -> Section:
    """Return the classes by their number of assemblies, and the rates between them as arrows."""
    place, rows, kept, title = class_graph_of(kinetics)
    unit = np.array([GRAPH_PX, ROW_PX * rows])
    return parts.section(
        "graph", "class_graph", "Graph of the classes", f"{title.capitalize()}.",
        height=float(unit[1]),
        classes=[
            {"class": name, "x": x, "y": y, "cells": cells_of(name, discs=are_discs(*place))}
            for name, (x, y) in place.items()
        ],
        arrows=[
            {
                "x": [float(one.first[0]), float(one.last[0])],
                "y": [float(one.first[1]), float(one.last[1])],
                "at": one.at, "share": one.share, "label": one.label,
            }
            for one in placed_arrows(place, kept, unit)
        ],
    )  # fmt: skip


def rates_sections(kinetics: xr.Dataset) -> list[Section]:
    """Return the rates of each data set as a table."""
    require(kinetics, "count", "rate", "rate_low", "rate_high")
    tables = (rate_table(kinetics, at) for at in range(kinetics.sizes["source"]))
    return [
        parts.section_of_table(
            one, id=f"rates-{at}", title=f"Rates, {one.title}" if one.title else "Rates"
        )
        for at, one in enumerate(tables, start=1)
    ]


def mixing_section(kinetics: xr.Dataset) -> Section:
    """Return Weibull's shapes and Spearman's coefficients with their p-values."""
    require(kinetics, "statistic", "p", "p_corrected")
    names = ("statistic", "statistic_low", "statistic_high", "p", "p_corrected")
    rows = [
        [str(one["test"].values), int(one["events"]), *(f"{float(one[n]):.3g}" for n in names)]
        for one in each(kinetics, "test")
    ]
    note = (
        "Of a sojourn the Weibull shape (1: exponential), of two waits Spearman's coefficient "
        "(0: no memory). The p-values are corrected by Holm's method."
    )
    columns = ["test", "events", "statistic", "from", "to (90 %)", "p", "p, corrected"]
    return parts.table_section(columns, rows, note)
