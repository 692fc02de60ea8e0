"""Pages on motion models: the calibration of one with many parameters, a comparison of several."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.page import parts
from driftwalk.page.arrays import number
from driftwalk.page.parts import Section, cell, quantity, require, required
from driftwalk.page.sections.recording import recording_sections
from driftwalk.schema.answers.model_comparison import (
    ASPECT_WORDS,
    CHECK_WORDS,
    own_score,
    ranking_table,
)
from driftwalk.schema.answers.parts import each
from driftwalk.schema.answers.verdict import stored_verdict

if TYPE_CHECKING:
    import xarray as xr

_CHECKS_NOTE: Final = "Median, smallest and largest value of 20 simulated recordings."


def model_calibration_sections(
    model_calibration: xr.Dataset | None,
    *,
    recording: xr.Dataset | None = None,
    body: str | None = None,
) -> list[Section]:
    """Return the sections of a page on a calibration of many parameters.

    Parameters
    ----------
    model_calibration : xarray.Dataset, optional
        A `model_calibration`; None while there is none yet.
    recording : xarray.Dataset, optional
        The recording.
    body : str, optional
        Its body.

    Returns
    -------
    list of dict
        Sections; an empty one says why it cannot be shown.

    Examples
    --------
    >>> [part["kind"] for part in model_calibration_sections(None)]
    ['empty']
    """
    pieces = (
        ("values", "Values", values_section),
        ("draws", "How well they are known", draws_section),
        ("aspects", "Aspects", aspects_section),
        ("checks", "Facts that were not fitted", checks_section),
    )
    nothing = "The calibration has no result yet."
    made = parts.sections_of(
        model_calibration, nothing, calibration_summary, parts.stated_warnings, pieces
    )
    if recording is not None:
        made += recording_sections(recording, body=body)
    return made


def calibration_summary(found: xr.Dataset) -> Section:
    """Return the answer in words and numbers."""
    require(found, "determined", "score", "verdict")
    names = [str(name) for name in found["parameter"].values]
    known = [name for name, one in zip(names, found["determined"].values, strict=True) if one]
    model = required(found, "model")
    paragraphs = [
        f"The model {model} was calibrated on the recording.",
        *parts.verdict_paragraphs(stored_verdict(found)),
        f"The recording determines {len(known)} of {len(names)} parameters"
        f"{': ' + ', '.join(known) if known else ''}.",
    ]
    shown = [
        parts.figure("distance from held-out blocks", found["score"]),
        parts.figure("step interval", required(found, "step_interval_s"), "s"),
        parts.figure("duration", required(found, "duration_s"), "s"),
    ]
    if "discrepancy" in found:
        shown.append(parts.figure("discrepancy of the summaries", found["discrepancy"]))
        shown.append(parts.figure("usual discrepancy", found["discrepancy_median"]))
    return parts.summary_section(paragraphs, shown)


def values_section(found: xr.Dataset) -> Section:
    """Return the table of the parameters."""
    require(found, "estimate", "interval", "determined", "range", "unit", "meaning")
    rows = []
    for one in each(found, "parameter"):
        unit, known = str(one["unit"].values), bool(one["determined"])
        rows.append(
            [
                str(one["parameter"].values),
                quantity(float(one["estimate"]), unit) if known else "not determined",
                _between(one["interval"].values, unit),
                "yes" if known else "no",
                _between(one["range"].values, unit),
                str(one["meaning"].values),
            ]
        )
    return parts.table_section(
        ["parameter", "value", "interval", "determined", "range", "meaning"], rows,
        "A parameter is determined where its 90 % interval ends within 15 % of its value, unless "
        "the discrepancy is above four times the usual.",
    )  # fmt: skip


def draws_section(found: xr.Dataset) -> Section:
    """Return the chart of the draws of each parameter, over its estimate."""
    require(found, "posterior_sample", "estimate")
    drawn = []
    for one in each(found, "parameter"):
        values = np.sort(one["posterior_sample"].values) / float(one["estimate"])
        share = np.linspace(0.0, 1.0, values.size)
        drawn.append(parts.series(str(one["parameter"].values), values, share))
    return parts.chart(
        "Share of the draws below a value, over the estimate: the steeper, the better known.",
        x=parts.label("value / estimate"), y=parts.label("share of the draws"), series=drawn,
    )  # fmt: skip


def aspects_section(found: xr.Dataset) -> Section:
    """Return the table of KS distances of one model in each aspect."""
    names = ("held_out_distance", "trained_distance", "own_distance", "floor")
    require(found, *names)
    rows = [[_aspect(one), *(number(one[name]) for name in names)] for one in each(found, "aspect")]
    return parts.table_section(
        ["aspect", "not seen", "seen", "the recording's own parts", "floor"], rows,
        "KS distance from blocks of time that the answer has not seen, and from those it has.",
    )  # fmt: skip


def checks_section(found: xr.Dataset) -> Section:
    """Return the table of facts of one model that were not fitted."""
    pieces = ["check_recorded", *(f"check_{name}" for name in ("median", "low", "high"))]
    require(found, "check_unit", *pieces)
    rows = []
    for one in each(found, "check"):
        unit = str(one["check_unit"].values)
        rows.append([_check(one), *(cell(float(one[part]), unit) for part in pieces)])
    columns = ["fact", "recording", "median", "smallest", "largest"]
    return parts.table_section(columns, rows, _CHECKS_NOTE)


def model_sections(
    comparison: xr.Dataset | None, *, recording: xr.Dataset | None = None, body: str | None = None
) -> list[Section]:
    """Return the sections of a page on compared motion models.

    Parameters
    ----------
    comparison : xarray.Dataset, optional
        A `model_comparison`; None while there is none yet.
    recording : xarray.Dataset, optional
        The recording.
    body : str, optional
        Its body.

    Returns
    -------
    list of dict
        Sections; an empty one says why it cannot be shown.

    Examples
    --------
    >>> [part["kind"] for part in model_sections(None)]
    ['empty']
    """
    by_summaries = comparison is not None and "asked" in comparison
    pieces = (
        ("ranking", "Ranking", ranking_section),
        *((("summaries", "Summaries of the motion", summaries_section),) if by_summaries else ()),
        ("scores", "Distances", scores_section),
        ("verdicts", "Where they differ", verdicts_section),
        ("aspects", "Aspects", compared_aspects),
        ("checks", "Facts that were not fitted", compared_checks),
        ("values", "Values", compared_values),
    )
    nothing = "No model has been compared yet."
    made = parts.sections_of(comparison, nothing, models_summary, parts.stated_warnings, pieces)
    if recording is not None:
        made += recording_sections(recording, body=body)
    return made


def models_summary(comparison: xr.Dataset) -> Section:
    """Return the answer in words and numbers."""
    require(comparison, "finding", "score", "own_distance", "floor")
    paragraphs = [
        *(f"{text}." for text in comparison["finding"].values),
        "Every model was searched on the even ones of 20 blocks of time, and judged on the odd "
        "ones. Its distance is the mean over six aspects of the KS distance over the recording's "
        "own floor.",
    ]
    best = comparison.isel(model=0)
    shown = [
        parts.figure(f"distance of {best['model'].item()}", best["score"]),
        parts.figure("distance of the recording's own parts", own_score(comparison)),
        parts.figure("step interval", required(comparison, "step_interval_s"), "s"),
    ]
    return parts.summary_section(paragraphs, shown)


def ranking_section(comparison: xr.Dataset) -> Section:
    """Return the table of the models, the closest first."""
    require(comparison, "score", "score_std", "behind", "behind_std", "held_out_distance")
    table = ranking_table(comparison)
    note = "Distance from blocks of time that no model was fitted to."
    return parts.section_of_table(table, note)


def summaries_section(comparison: xr.Dataset) -> Section:
    """Return the table of models that were compared by the summaries of the motion."""
    names = ("discrepancy", "discrepancy_median", "discrepancy_q95")
    require(comparison, "asked", "named", "deviance", *names)
    asked = comparison.isel(model=np.flatnonzero(comparison["asked"].values))
    least = float(asked["deviance"].min())
    rows = [
        [
            one["model"].item(),
            *(number(one[name]) for name in names),
            number(one["deviance"] - least),
            "yes" if bool(one["named"]) else "no",
        ]
        for one in each(asked, "model")
    ]
    columns = ["model", "discrepancy", "of own recordings, median", "95 % below", "less likely by"]
    return parts.table_section(
        [*columns, "named"], rows,
        "About a hundred numbers of the motion, matched by the closest models. The discrepancy is "
        "compared with the model's own simulated recordings; the evidence, as -2 log above the "
        "likeliest model, has a price for each parameter.",
    )  # fmt: skip


def scores_section(comparison: xr.Dataset) -> Section:
    """Return the chart of the distances."""
    require(comparison, "score", "score_std", "baseline", "own_distance", "floor")
    place = 1.0 + np.arange(comparison.sizes["model"])
    score, std = comparison["score"].values, comparison["score_std"].values
    walk = comparison["baseline"].values.astype(bool)
    drawn = [
        parts.series(
            words,
            place,
            np.where(of, score, np.nan),
            ends=(np.where(of, score - std, np.nan), np.where(of, score + std, np.nan)),
            style="points",
        )
        for words, of in (("motion models", ~walk), ("walks of recorded steps", walk))
        if of.any()
    ]
    return parts.chart(
        "In the order of the ranking, with standard errors.",
        x=parts.label("place in the ranking"), y=parts.label("distance, mean of D / floor"),
        series=drawn, marks=[parts.mark("the recording's own parts", y=own_score(comparison))],
    )  # fmt: skip


def verdicts_section(comparison: xr.Dataset) -> Section:
    """Return the table of where each model differs from the recording."""
    require(comparison, "verdict", "verdict_reason")
    columns = [comparison[name].values for name in ("model", "verdict", "verdict_reason")]
    rows = [list(map(str, row)) for row in zip(*columns, strict=True)]
    return parts.table_section(["model", "verdict", "why"], rows, title="Verdicts")


def compared_aspects(comparison: xr.Dataset) -> Section:
    """Return the table of KS distances of every model in each aspect."""
    require(comparison, "held_out_distance", "own_distance", "floor")
    names = [*map(str, comparison["model"].values), "the recording's own parts", "floor"]
    distances = [
        *comparison["held_out_distance"].transpose("model", "aspect").values,
        comparison["own_distance"].values,
        comparison["floor"].values,
    ]
    rows = [[name, *map(number, row)] for name, row in zip(names, distances, strict=True)]
    columns = ["model", *map(_aspect, each(comparison[["floor"]], "aspect"))]
    note = "KS distance from the held-out blocks."
    return parts.table_section(columns, rows, note)


def compared_checks(comparison: xr.Dataset) -> Section:
    """Return the table of facts of every model that were not fitted."""
    pieces = [f"check_{name}" for name in ("low", "median", "high")]
    require(comparison, "check_recorded", "check_unit", *pieces)
    rows = []
    for one in each(comparison[["check_recorded", "check_unit", *pieces]], "check"):
        unit = str(one["check_unit"].values)
        cells = [cell(float(one["check_recorded"]), unit)]
        for of in each(one, "model"):
            low, middle, high = (cell(float(of[part]), unit) for part in pieces)
            cells.append(f"{middle} ({low} to {high})")
        rows.append([_check(one), *cells])
    columns = ["fact", "recording", *map(str, comparison["model"].values)]
    return parts.table_section(columns, rows, _CHECKS_NOTE)


def compared_values(comparison: xr.Dataset) -> Section:
    """Return the table of the values that the searches found."""
    require(comparison, "estimate", "parameter_unit")
    rows = [
        [
            str(model["model"].values),
            str(one["parameter"].values),
            quantity(float(one["estimate"]), str(one["parameter_unit"].values)),
        ]
        for model in each(comparison[["estimate", "parameter_unit"]], "model")
        for one in each(model, "parameter")
        if np.isfinite(one["estimate"])
    ]
    return parts.table_section(
        ["model", "parameter", "value"], rows,
        "The answer of each search. A model that does not explain the recording has values, too: "
        "they mean little.",
    )  # fmt: skip


def _aspect(one: xr.Dataset) -> str:
    name = str(one["aspect"].values)
    return ASPECT_WORDS.get(name, name)


def _check(one: xr.Dataset) -> str:
    name = str(one["check"].values)
    return CHECK_WORDS.get(name, name)


def _between(ends: Any, unit: str) -> str:
    if not np.isfinite(ends).all():
        return "–"
    return " to ".join(cell(end, unit) for end in ends)
