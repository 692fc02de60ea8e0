"""A page on a recovery study of a motion model: how well its parameters come back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.page.arrays import number
from driftwalk.page.chart import chart, label, mark, series
from driftwalk.page.number_words import count, percent, quantity
from driftwalk.page.parts import (
    Section,
    attempt,
    empty_head,
    figure,
    head_sections,
    require,
    required,
    section,
)
from driftwalk.schema.answers.recovery import model_warnings

if TYPE_CHECKING:
    import xarray as xr

SUMMARY: Final = ("median_error", "determined_share", "coverage", "coverage_standard_error")
MOST_PARAMETERS: Final = 100
"""Parameters of a model that a page shows, with a chart each."""


def model_recovery_sections(model_recovery: xr.Dataset | None) -> list[Section]:
    """Return the sections of a page on a recovery study of a motion model.

    Parameters
    ----------
    model_recovery : xarray.Dataset, optional
        A `model_recovery`; None while there is none yet.

    Returns
    -------
    list of dict
        Sections; an empty one says why it cannot be shown.

    Examples
    --------
    >>> [part["kind"] for part in model_recovery_sections(None)]
    ['empty']
    """
    if model_recovery is None:
        return empty_head("There are no estimates yet.")
    if "parameter" not in model_recovery.variables:
        return empty_head("the recovery holds no parameter")
    if model_recovery["parameter"].size > MOST_PARAMETERS:
        return empty_head(
            f"{model_recovery['parameter'].size} parameters are more than the {MOST_PARAMETERS} of "
            "a page"
        )
    made = head_sections(
        lambda: summary_section(model_recovery), lambda: model_warnings(model_recovery)
    )
    made += attempt("errors", "Errors and intervals", lambda: errors_section(model_recovery))
    for index, name in enumerate(model_recovery["parameter"].values):
        made += attempt(
            f"estimates-{index + 1}",
            f"Estimates: {name}",
            lambda index=index: estimates_section(model_recovery, index),  # type: ignore[misc]
        )
    return made


def summary_section(recovery: xr.Dataset) -> Section:
    """Return a recovery study in words and numbers."""
    require(recovery, "determined_share", "status")
    model, length = required(recovery, "model"), float(required(recovery, "duration_s"))
    share = recovery["determined_share"].values
    names = [str(name) for name in recovery["parameter"].values]
    always = [name for name, one in zip(names, share, strict=True) if one == 1.0]
    never = [name for name, one in zip(names, share, strict=True) if one == 0.0]
    paragraphs = [
        f"{count(recovery.sizes['recording'], 'recording')} of {quantity(length, 's')} were "
        f"simulated by the model {model} with known parameters, and calibrated. All of this is "
        "simulated: it shows how well a calibration would do if the model were right.",
    ]
    if always:
        paragraphs.append(f"Every recording determines {', '.join(always)}.")
    if never:
        paragraphs.append(f"No recording determines {', '.join(never)}.")
    shown = [
        figure("length of a recording", length, "s"),
        figure("samples per second", required(recovery, "sample_rate_Hz"), "Hz"),
        figure("position noise", required(recovery, "position_noise_m"), "m"),
    ]
    return section("summary", "summary", "Method and results", paragraphs=paragraphs, numbers=shown)


def errors_section(recovery: xr.Dataset) -> Section:
    """Return the table of errors, of what is determined, and of coverage."""
    require(recovery, "truth", "unit", "meaning", *SUMMARY)
    rows: list[list[Any]] = []
    for index, name in enumerate(recovery["parameter"].values):
        one = recovery.isel(parameter=index)
        rows.append(
            [
                str(name),
                quantity(float(one["truth"]), str(one["unit"].values)),
                *(number(one[key]) for key in SUMMARY),
                str(one["meaning"].values),
            ]
        )
    confidence = percent(float(required(recovery, "confidence")))
    return section(
        "errors", "table", "Errors and intervals",
        "Errors are relative to the truth. A parameter is determined where its 90 % interval ends "
        f"within 15 % of its value. {confidence} of the intervals should hold the truth, give "
        "or take the standard error.",
        columns=[
            "parameter", "truth", "median error", "share determined",
            "intervals that hold the truth", "standard error", "meaning",
        ],
        rows=rows,
    )  # fmt: skip


def estimates_section(recovery: xr.Dataset, index: int) -> Section:
    """Return the estimates of a parameter with their intervals next to the truth."""
    require(recovery, "estimate", "interval", "determined", "truth", "unit")
    one = recovery.isel(parameter=index)
    at = 1.0 + np.arange(recovery.sizes["recording"])
    interval = one["interval"].transpose("recording", "bound").values
    known = one["determined"].values.astype(bool)
    drawn = []
    for kept, words in ((known, "determined"), (~known, "not determined")):
        if kept.any():
            value, low, high = (
                np.where(kept, values, np.nan) for values in (one["estimate"].values, *interval.T)
            )
            drawn.append(series(words, at, value, ends=(low, high), style="points"))
    name = str(one["parameter"].values)
    return chart(
        f"estimates-{index + 1}", f"Estimates: {name}",
        "Each point is a recording, with its interval.",
        x=label("recording"), y=label(name.replace("_", " "), str(one["unit"].values)),
        series=drawn, marks=[mark("truth", y=float(one["truth"]))],
    )  # fmt: skip
