"""A page on a calibration of many parameters: values, how well they are known, how good it is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.page.arrays import number
from driftwalk.page.chart import chart, label, series
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
from driftwalk.schema.answers.model_comparison import ASPECT_WORDS, CHECK_WORDS

if TYPE_CHECKING:
    import xarray as xr


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
    found = model_calibration
    if found is None:
        made = empty_head("The calibration has no result yet.")
    else:
        made = head_sections(lambda: summary_section(found), lambda: stated_warnings(found))
        made += attempt("values", "Values", lambda: values_section(found))
        made += attempt("draws", "How well they are known", lambda: draws_section(found))
        made += attempt("aspects", "Aspects", lambda: aspects_section(found))
        made += attempt("checks", "Facts that were not fitted", lambda: checks_section(found))
    if recording is not None:
        made += recording_sections(recording, body=body)
    return made


def summary_section(found: xr.Dataset) -> Section:
    """Return the answer in words and numbers."""
    require(found, "determined", "score", "explained", "verdict")
    names = [str(name) for name in found["parameter"].values]
    known = [name for name, one in zip(names, found["determined"].values, strict=True) if one]
    model = required(found, "model")
    verdict = "explains" if bool(found["explained"]) else "does not explain"
    where = str(found["verdict"].values)
    paragraphs = [
        f"The model {model} {verdict} the recording{f': {where}' if where else ''}.",
        f"The recording determines {len(known)} of {len(names)} parameters"
        f"{': ' + ', '.join(known) if known else ''}.",
    ]
    shown = [
        figure("distance from held-out blocks", number(found["score"]), "1"),
        figure("step interval", required(found, "step_interval_s"), "s"),
        figure("duration", required(found, "duration_s"), "s"),
    ]
    if "misfit" in found:
        shown.append(figure("misfit of the summaries", number(found["misfit"]), "1"))
        shown.append(figure("usual misfit", number(found["usual_misfit"]), "1"))
    return section("summary", "summary", "Results", paragraphs=paragraphs, numbers=shown)


def values_section(found: xr.Dataset) -> Section:
    """Return the table of the parameters."""
    require(found, "estimate", "interval", "determined", "range", "unit", "meaning")
    rows: list[list[Any]] = []
    for index, name in enumerate(found["parameter"].values):
        one = found.isel(parameter=index)
        unit, known = str(one["unit"].values), bool(one["determined"])
        rows.append(
            [
                str(name),
                quantity(float(one["estimate"]), unit) if known else "not determined",
                _between(one["interval"].values, unit),
                "yes" if known else "no",
                _between(one["range"].values, unit),
                str(one["meaning"].values),
            ]
        )
    return section(
        "values", "table", "Values",
        "A parameter is determined where its 90 % interval ends within 15 % of its value, "
        "unless the misfit is above four times the usual.",
        columns=["parameter", "value", "interval", "determined", "range", "meaning"], rows=rows,
    )  # fmt: skip


def draws_section(found: xr.Dataset) -> Section:
    """Return the chart of the draws of each parameter, over its estimate."""
    require(found, "draws", "estimate")
    drawn = []
    for index, name in enumerate(found["parameter"].values):
        one = found.isel(parameter=index)
        values = np.sort(one["draws"].values) / float(one["estimate"])
        drawn.append(series(str(name), values, np.linspace(0.0, 1.0, values.size), style="line"))
    return chart(
        "draws", "How well they are known",
        "Share of the draws below a value, over the estimate: the steeper, the better known.",
        x=label("value / estimate"), y=label("share of the draws"), series=drawn,
    )  # fmt: skip


def aspects_section(found: xr.Dataset) -> Section:
    """Return the table of KS distances in each aspect."""
    names = ("held_out_distance", "trained_distance", "own_distance", "floor")
    require(found, *names)
    rows = [
        [
            ASPECT_WORDS.get(str(aspect), str(aspect)),
            *(number(found[name].values[index]) for name in names),
        ]
        for index, aspect in enumerate(found["aspect"].values)
    ]
    return section(
        "aspects", "table", "Aspects",
        "KS distance from blocks of time that the answer has not seen, and from those it has.",
        columns=["aspect", "not seen", "seen", "the recording's own parts", "floor"], rows=rows,
    )  # fmt: skip


def checks_section(found: xr.Dataset) -> Section:
    """Return the table of facts that were not fitted."""
    parts = [f"check_{name}" for name in ("median", "low", "high")]
    require(found, "check_recorded", "check_unit", *parts)
    rows = []
    for index, name in enumerate(found["check"].values):
        unit = str(found["check_unit"].values[index])
        cells = [cell(found[part].values[index], unit) for part in ("check_recorded", *parts)]
        rows.append([CHECK_WORDS.get(str(name), str(name)), *cells])
    return section(
        "checks", "table", "Facts that were not fitted",
        "Median, smallest and largest value of 20 simulated recordings.",
        columns=["fact", "recording", "median", "smallest", "largest"], rows=rows,
    )  # fmt: skip


def _between(ends: Any, unit: str) -> str:
    if not np.isfinite(ends).all():
        return "–"
    return " to ".join(cell(end, unit) for end in ends)
