"""A page on compared motion models: the ranking, each aspect, and facts that were not fitted."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.page.arrays import number
from driftwalk.page.chart import chart, label, mark, series
from driftwalk.page.number_words import cell, quantity
from driftwalk.page.parts import (
    Section,
    attempt,
    empty_head,
    figure,
    head_sections,
    require,
    required,
    section,
    stated_warnings,
)
from driftwalk.page.sections.recording import recording_sections
from driftwalk.schema.answers.model_comparison import ASPECT_WORDS, CHECK_WORDS, own_score

if TYPE_CHECKING:
    import xarray as xr


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
    if comparison is None:
        made = empty_head("No model has been compared yet.")
    else:
        made = head_sections(
            lambda: models_summary(comparison), lambda: stated_warnings(comparison)
        )
        made += attempt("ranking", "Ranking", lambda: ranking_section(comparison))
        if "asked" in comparison:
            made += attempt(
                "summaries", "Summaries of the motion", lambda: summaries_section(comparison)
            )
        made += attempt("scores", "Distances", lambda: scores_section(comparison))
        made += attempt("verdicts", "Where they differ", lambda: verdicts_section(comparison))
        made += attempt("aspects", "Aspects", lambda: aspects_section(comparison))
        made += attempt("checks", "Facts that were not fitted", lambda: checks_section(comparison))
        made += attempt("values", "Values", lambda: values_section(comparison))
    if recording is not None:
        made += recording_sections(recording, body=body)
    return made


def models_summary(comparison: xr.Dataset) -> Section:
    """Return the answer in words and numbers."""
    require(comparison, "finding", "score", "own_distance", "floor")
    paragraphs = [f"{text}." for text in map(str, comparison["finding"].values)]
    paragraphs.append(
        "Every model was searched on the even ones of 20 blocks of time, and judged on the odd "
        "ones. Its distance is the mean over six aspects of the KS distance over the recording's "
        "own floor."
    )
    best = comparison.isel(model=0)
    own = own_score(comparison)
    shown = [
        figure(f"distance of {best['model'].item()}", number(best["score"]), "1"),
        figure("distance of the recording's own parts", own, "1"),
        figure("step interval", required(comparison, "step_interval_s"), "s"),
    ]
    return section("summary", "summary", "Results", paragraphs=paragraphs, numbers=shown)


def ranking_section(comparison: xr.Dataset) -> Section:
    """Return the table of the models, the closest first."""
    names = ("score", "score_std", "behind", "behind_std", "free_numbers")
    require(comparison, *names, "explained", "baseline")
    rows = []
    for index in range(comparison.sizes["model"]):
        one = comparison.isel(model=index)
        yes = "a walk of steps" if bool(one["baseline"]) else "no"
        said = "yes" if bool(one["explained"]) else yes
        found = [number(one[name]) for name in names]
        rows.append([one["model"].item(), *found, said])
    columns = ["model", "distance", "±", "behind", "±", "numbers", "explained"]
    return section(
        "ranking", "table", "Ranking", "Distance from blocks of time that no model was fitted to.",
        columns=columns, rows=rows,
    )  # fmt: skip


def summaries_section(comparison: xr.Dataset) -> Section:
    """Return the table of models that were compared by the summaries of the motion."""
    names = ("misfit", "usual_misfit", "most_misfit", "unlikely")
    require(comparison, "asked", "named", *names)
    asked = comparison.isel(model=np.flatnonzero(comparison["asked"].values))
    least = float(asked["unlikely"].min())
    rows = []
    for index in range(asked.sizes["model"]):
        one = asked.isel(model=index)
        shown = [number(one[name]) for name in names[:-1]]
        behind = number(one["unlikely"] - least)
        rows.append([one["model"].item(), *shown, behind, "yes" if bool(one["named"]) else "no"])
    return section(
        "summaries", "table", "Summaries of the motion",
        "About a hundred numbers of the motion, matched by the closest models. The "
        "misfit is compared with those of the model's own simulated recordings; the evidence, as "
        "-2 log above the likeliest model, has a price for each parameter.",
        columns=[
            "model", "misfit", "of own recordings, median", "99 % below", "less likely by", "named",
        ],
        rows=rows,
    )  # fmt: skip


def verdicts_section(comparison: xr.Dataset) -> Section:
    """Return the table of where each model differs from the recording."""
    require(comparison, "verdict", "explained")
    rows = [
        [str(name), str(text) or "nowhere: it explains the recording"]
        for name, text in zip(comparison["model"].values, comparison["verdict"].values, strict=True)
    ]
    return section(
        "verdicts", "table", "Where the models differ from the recording",
        "The worst aspect first.",
        columns=["model", "where"], rows=rows,
    )  # fmt: skip


def scores_section(comparison: xr.Dataset) -> Section:
    """Return the chart of the distances."""
    require(comparison, "score", "score_std", "baseline", "own_distance", "floor")
    place = 1.0 + np.arange(comparison.sizes["model"])
    score, std = comparison["score"].values, comparison["score_std"].values
    walk = comparison["baseline"].values.astype(bool)
    drawn = [
        series(
            words,
            place,
            np.where(of, score, np.nan),
            ends=(np.where(of, score - std, np.nan), np.where(of, score + std, np.nan)),
            style="points",
        )
        for words, of in (("motion models", ~walk), ("walks of recorded steps", walk))
        if of.any()
    ]
    own = own_score(comparison)
    return chart(
        "scores", "Distances", "In the order of the ranking, with standard errors.",
        x=label("place in the ranking"), y=label("distance, mean of D / floor"), series=drawn,
        marks=[mark("the recording's own parts", y=own)],
    )  # fmt: skip


def aspects_section(comparison: xr.Dataset) -> Section:
    """Return the table of KS distances in each aspect."""
    require(comparison, "held_out_distance", "own_distance", "floor")
    aspects = [ASPECT_WORDS.get(str(name), str(name)) for name in comparison["aspect"].values]
    rows: list[list[Any]] = [
        [str(name), *(number(value) for value in values)]
        for name, values in zip(
            comparison["model"].values, comparison["held_out_distance"].values, strict=True
        )
    ]
    for words, name in (("the recording's own parts", "own_distance"), ("floor", "floor")):
        rows.append([words, *(number(value) for value in comparison[name].values)])
    return section(
        "aspects", "table", "Aspects", "KS distance from the held-out blocks.",
        columns=["model", *aspects], rows=rows,
    )  # fmt: skip


def checks_section(comparison: xr.Dataset) -> Section:
    """Return the table of facts that were not fitted."""
    parts = [f"check_{name}" for name in ("low", "median", "high")]
    require(comparison, "check_recorded", "check_unit", *parts)
    models = [str(name) for name in comparison["model"].values]
    rows = []
    for index, name in enumerate(comparison["check"].values):
        unit = str(comparison["check_unit"].values[index])
        cells = [cell(comparison["check_recorded"].values[index], unit)]
        for at in range(len(models)):
            low, middle, high = (comparison[part].values[at, index] for part in parts)
            cells.append(f"{cell(middle, unit)} ({cell(low, unit)} to {cell(high, unit)})")
        rows.append([CHECK_WORDS.get(str(name), str(name)), *cells])
    return section(
        "checks", "table", "Facts that were not fitted",
        "Median, smallest and largest value of 20 simulated recordings.",
        columns=["fact", "recording", *models], rows=rows,
    )  # fmt: skip


def values_section(comparison: xr.Dataset) -> Section:
    """Return the table of the values that the searches found."""
    require(comparison, "estimate", "parameter_unit")
    rows = []
    for at, model in enumerate(comparison["model"].values):
        for name, unit, value in zip(
            comparison["parameter"].values,
            comparison["parameter_unit"].values,
            comparison["estimate"].values[at],
            strict=True,
        ):
            if np.isfinite(value):
                rows.append([str(model), str(name), quantity(float(value), str(unit))])
    return section(
        "values", "table", "Values",
        "The answer of each search. A model that does not explain the recording has values, too: "
        "they mean little.",
        columns=["model", "parameter", "value"], rows=rows,
    )  # fmt: skip
