"""A page on parameters from outcomes alone: intervals, posterior, classes, what data tell."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from driftwalk.page import parts
from driftwalk.page.parts import Maker, Section, require, required
from driftwalk.schema.answers.facts import sentences
from driftwalk.schema.answers.outcome_posterior import (
    agreement,
    class_table,
    condition,
    data_table,
    limit_words,
    number_of,
)
from driftwalk.schema.answers.parts import each

if TYPE_CHECKING:
    import xarray as xr

DATA_NOTE = (
    "Simulated data sets at parameters drawn from the posterior were inferred with the same "
    "emulator. The power widens the likelihood until the regions hold their truths; the "
    "intervals are medians, over those that hold without data."
)
BINS = 40
"""Bins of a marginal density; chosen by hand."""


def outcome_posterior_sections(*, posterior: xr.Dataset | None = None) -> list[Section]:
    """Return the sections of a page on parameters from outcomes alone.

    Parameters
    ----------
    posterior : xarray.Dataset, optional
        An `outcome_posterior`; None while there is none yet.

    Returns
    -------
    list of dict
        Sections; what cannot be shown is an empty one that says why.

    Examples
    --------
    >>> [part["kind"] for part in outcome_posterior_sections()]
    ['empty']
    """
    pieces: list[tuple[str, str, Maker]] = [
        ("posterior", "Posterior", density_sections),
        parts.table_part("classes", "Classes", class_table),
        parts.table_part("data", "Information in each kind of data", data_table, DATA_NOTE),
    ]
    nothing = "The emulator is not checked yet: there is no posterior."
    return parts.sections_of(posterior, nothing, posterior_summary, lambda _: [], pieces)


def posterior_summary(posterior: xr.Dataset) -> Section:
    """Return the verdict with its reasons, and the intervals."""
    facts, confidence = posterior.attrs, float(required(posterior, "confidence"))
    paragraphs = [
        f"{required(posterior, 'runs')} runs of {required(posterior, 'blocks')} blocks ended in "
        f"outcome classes, which were read after {required(posterior, 'after_s'):g} s. An emulator "
        "learned from simulated runs how the shares of the outcomes depend on the parameters.",
        f"Verdict: {required(posterior, 'verdict')}.",
        *(f"{text[:1].upper()}{text[1:]}." for text in sentences(posterior, "reason")),
    ]
    if facts["used"] != "none":
        paragraphs.append(f"Inferred from {facts['used']}; {agreement(posterior)}.")
    shown = []
    for one in each(posterior, "parameter"):
        number, known = number_of(one), bool(one["determined"])
        ends = tuple(one["interval"].values.tolist()) if known else (None, None)
        shown.append(
            parts.figure(
                number.plain,
                float(one["estimate"]) if known else None,
                number.unit,
                symbol=number.symbol,
                note=None if known else limit_words(one, confidence).split(":")[0],
                ends=ends,
                confidence=confidence if known else None,
            )
        )
    return parts.summary_section(paragraphs, shown)


def density_sections(posterior: xr.Dataset) -> list[Section]:
    """Return the marginal density of each parameter as steps."""
    require(posterior, "value", "weight", "low", "high")
    weight = posterior["weight"].values
    made = []
    for at, one in enumerate(each(posterior, "parameter"), start=1):
        number = number_of(one)
        ends = (float(one["low"]), float(one["high"]))
        width = ends[1] - ends[0]
        density, edges = np.histogram(
            one["value"].values, BINS, range=ends, weights=weight, density=True
        )
        flat = np.full(BINS, 1.0 / width)
        drawn = [
            parts.series("posterior", edges, density * width, style="step"),
            parts.series("without data", edges, flat * width, style="step"),
        ]
        made.append(
            parts.chart(
                x=parts.label(number.words, number.unit), y=parts.label("density over the prior"),
                series=drawn, id=f"posterior-{at}",
                title=f"Posterior of {number.plain} {condition(posterior)}".rstrip(),
            )
        )  # fmt: skip
    return made
