"""Pages on recovery studies: how well recordings of known truth give it back."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import product
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
    value_of,
)
from driftwalk.schema.answers.recovery import model_warnings
from driftwalk.schema.kinds.recovery import RECOVERED

if TYPE_CHECKING:
    import xarray as xr

SUMMARY: Final = {
    "median_absolute_error": "median error",
    "absolute_error_90": "90 % of errors below",
    "bias": "bias",
    "coverage": "intervals that hold the truth",
    "coverage_low": "at least",
    "coverage_high": "at most",
}
COORDINATES: Final = ("duration", "angle", "parameter")
MOST_WAYS: Final = 1000
"""Combinations of these, a row of the table each."""
MODEL_SUMMARY: Final = ("median_error", "determined_share", "coverage", "coverage_standard_error")
MOST_PARAMETERS: Final = 100
"""Parameters of a model that a page shows, with a chart each."""


def recovery_sections(recovery: xr.Dataset | None) -> list[Section]:
    """Return the sections of a page on a recovery study.

    Parameters
    ----------
    recovery : xarray.Dataset, optional
        A `recovery`; None while there is none yet.

    Returns
    -------
    list of dict
        Sections; what cannot be shown is an empty one that says why.

    Examples
    --------
    >>> [part["kind"] for part in recovery_sections(None)]
    ['empty']
    """
    if recovery is None:
        return empty_head("There are no estimates yet.")
    missing = [name for name in COORDINATES if name not in recovery.variables]
    if missing:
        return empty_head(f"the recovery holds no {', '.join(missing)}")
    ways = math.prod(recovery[name].size for name in COORDINATES)
    if ways > MOST_WAYS:
        return empty_head(f"{ways} rows of estimates are more than the {MOST_WAYS} of a page")
    made = head_sections(lambda: recovery_summary(recovery), lambda: _warnings(recovery))
    made += attempt("errors", "Errors and intervals", lambda: errors_section(recovery))
    made += attempt("by-length", "Error by length", lambda: by_length_section(recovery))
    for name, one in RECOVERED.items():
        made += attempt(
            f"estimates-{name.replace('_', '-')}",
            f"Estimates: {one.words}",
            lambda name=name: estimates_section(recovery, name),  # type: ignore[misc]
        )
    made += attempt("flow-error", "Error of the flow", lambda: flow_error_section(recovery))
    return made


def recovery_summary(recovery: xr.Dataset) -> Section:
    """Return a recovery study in words and numbers."""
    ends = [f"needed_duration{end}" for end in ("", "_low", "_high")]
    require(recovery, "used", "median_absolute_error", "coverage", *ends)
    lengths = ", ".join(quantity(float(value), "s") for value in recovery["duration"].values)
    confidence = value_of(recovery, "confidence")
    done = (
        f"{count(recovery.sizes['recording'], 'recording')} of each length ({lengths}) were "
        "simulated with known parameters and fitted. All of this is simulated: it "
        "shows how well the fit would do if the model were right."
    )
    truth = ", ".join(
        f"{one.words} = {quantity(float(required(recovery, one.key)), one.unit)}"
        for one in RECOVERED.values()
    )
    every = quantity(float(required(recovery, "force_interval_s")), "s")
    paragraphs = [done, f"The truth: {truth}; the force is redrawn every {every}."]
    paragraphs += _found(recovery, confidence)
    shown = [
        figure(one.words, required(recovery, one.key), one.unit, note="truth")
        for one in RECOVERED.values()
    ]
    for angle in recovery["angle"].values:
        part = recovery.sel(angle=angle)
        needed = number(part["needed_duration"])
        if needed is None:
            continue
        wanted = value_of(recovery, "drag_coefficient_precision")
        note = None if wanted is None else f"for an error of C_d of {percent(wanted)} (rms)"
        shown.append(
            figure(f"length needed, angle {angle}", needed, "s", note=note)
            | {
                "low": number(part["needed_duration_low"]),
                "high": number(part["needed_duration_high"]),
                "confidence": value_of(recovery, "needed_confidence"),
            }
        )
    return section("summary", "summary", "Method and results", paragraphs=paragraphs, numbers=shown)


def errors_section(recovery: xr.Dataset) -> Section:
    """Return the table of errors and coverage."""
    require(recovery, *SUMMARY)
    rows: list[list[Any]] = []
    names = [str(name) for name in recovery["parameter"].values]
    for name, duration, angle in product(
        names, recovery["duration"].values, recovery["angle"].values
    ):
        part = recovery.sel(parameter=name, duration=duration, angle=angle)
        words = RECOVERED[name].words if name in RECOVERED else name
        found = [number(part[key]) for key in SUMMARY]
        rows.append([words, quantity(float(duration), "s"), str(angle), *found])
    return section(
        "errors", "table", "Errors and intervals", "Errors are relative to the truth.",
        columns=["parameter", "length", "angle", *SUMMARY.values()], rows=rows,
    )  # fmt: skip


def by_length_section(recovery: xr.Dataset) -> Section:
    """Return how the error of C_d falls with the length of a recording."""
    require(recovery, "rms_error")
    length = recovery["duration"].values
    drawn = []
    for angle in recovery["angle"].values:
        rms = recovery["rms_error"].sel(parameter="drag_coefficient", angle=angle).values
        drawn.append(series(f"angle {angle}", length, rms, style="points"))
    wanted = value_of(recovery, "drag_coefficient_precision")
    marks = [] if wanted is None else [mark("wanted", y=wanted)]
    return chart(
        "by-length", "Error by length", "Root mean square of ln(estimate / truth).",
        x=label("length of a recording", "s", log=True), y=label("error of C_d", log=True),
        series=drawn, marks=marks,
    )  # fmt: skip


def estimates_section(recovery: xr.Dataset, name: str) -> Section:
    """Return the estimates of a parameter with their intervals next to the truth."""
    parameter = RECOVERED[name]
    ends = [f"{name}{end}" for end in ("", "_low", "_high")]
    require(recovery, *ends, "used")
    drawn = []
    for at, words, part in _groups(recovery):
        used, values = part["used"].values == 1, [part[end].values for end in ends]
        drawn += [
            (words, at, used, values),
            (f"{words}, left out of the summary", at, ~used, values),
        ]
    return _estimates_chart(
        f"estimates-{name.replace('_', '-')}", f"Estimates: {parameter.words}",
        label(parameter.words, parameter.unit), required(recovery, parameter.key), drawn,
    )  # fmt: skip


def _estimates_chart(
    id: str, title: str, y: Any, truth: float, drawn: Iterable[tuple[str, Any, Any, Any]]
) -> Section:
    """Return a chart of words, places, which are shown, and estimates with both ends."""
    shown = []
    for words, at, kept, values in drawn:
        if kept.any():
            value, low, high = (np.where(kept, one, np.nan) for one in values)
            shown.append(series(words, at, value, ends=(low, high), style="points"))
    return chart(
        id, title, "Each point is a recording, with its interval.", x=label("recording"), y=y,
        series=shown, marks=[mark("truth", y=truth)],
    )  # fmt: skip


def flow_error_section(recovery: xr.Dataset) -> Section:
    """Return the error of the flow in every recording."""
    require(recovery, "flow_error", "used")
    drawn = [
        series(
            words,
            at,
            np.where(part["used"].values == 1, part["flow_error"].values, np.nan),
            style="points",
        )
        for at, words, part in _groups(recovery)
    ]
    return chart(
        "flow-error", "Error of the flow", "Rms error over rms speed, averaged over the block.",
        x=label("recording"), y=label("relative error"), series=drawn,
    )  # fmt: skip


def _groups(recovery: xr.Dataset) -> list[tuple[Any, str, xr.Dataset]]:
    """Return place, name and dataset of recordings that were made and fitted alike."""
    groups = []
    at = 1.0 + np.arange(recovery.sizes["recording"])
    pairs = list(product(range(recovery.sizes["duration"]), range(recovery.sizes["angle"])))
    for index, (duration, angle) in enumerate(pairs):
        part = recovery.isel(duration=duration, angle=angle)
        words = f"{quantity(float(part['duration']), 's')}, angle {part['angle'].item()}"
        # Side by side, so that intervals do not hide each other.
        groups.append((at + 0.6 * ((index + 0.5) / len(pairs) - 0.5), words, part))
    return groups


def _found(recovery: xr.Dataset, confidence: float | None) -> list[str]:
    drag = recovery.sel(parameter="drag_coefficient")
    told = []
    for angle in recovery["angle"].values:
        part = drag.sel(angle=angle).isel(duration=-1)
        error, held = number(part["median_absolute_error"]), number(part["coverage"])
        if error is None or held is None:
            continue
        words = "" if confidence is None else f"{percent(confidence)} "
        told.append(
            f"With {quantity(float(part['duration']), 's')} and the angle {angle}, the median "
            f"error of C_d is {percent(error)}; {percent(held)} of the {words}intervals hold the "
            "truth."
        )
    return told


def _warnings(recovery: xr.Dataset) -> list[str]:
    require(recovery, "status", "used")
    status, used = recovery["status"].values, recovery["used"].values
    refused, broken, left = (
        int(found.sum()) for found in (status == 1, status == 2, (status == 0) & (used == 0))
    )
    said = (
        (refused, f"the fit refused {count(refused, 'recording')}"),
        (broken, f"{count(broken, 'simulation')} broke down"),
        (left, f"{count(left, 'recording')} left out of the summary: too long at the wall"),
    )
    return [text for number_of, text in said if number_of]


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
        lambda: model_summary_section(model_recovery), lambda: model_warnings(model_recovery)
    )
    made += attempt("errors", "Errors and intervals", lambda: model_errors_section(model_recovery))
    for index, name in enumerate(model_recovery["parameter"].values):
        made += attempt(
            f"estimates-{index + 1}",
            f"Estimates: {name}",
            lambda index=index: model_estimates_section(model_recovery, index),  # type: ignore[misc]
        )
    return made


def model_summary_section(recovery: xr.Dataset) -> Section:
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


def model_errors_section(recovery: xr.Dataset) -> Section:
    """Return the table of errors, of what is determined, and of coverage."""
    require(recovery, "truth", "unit", "meaning", *MODEL_SUMMARY)
    rows: list[list[Any]] = []
    for index, name in enumerate(recovery["parameter"].values):
        one = recovery.isel(parameter=index)
        rows.append(
            [
                str(name),
                quantity(float(one["truth"]), str(one["unit"].values)),
                *(number(one[key]) for key in MODEL_SUMMARY),
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


def model_estimates_section(recovery: xr.Dataset, index: int) -> Section:
    """Return the estimates of a parameter with their intervals next to the truth."""
    require(recovery, "estimate", "interval", "determined", "truth", "unit")
    one = recovery.isel(parameter=index)
    at = 1.0 + np.arange(recovery.sizes["recording"])
    values = [one["estimate"].values, *one["interval"].transpose("bound", "recording").values]
    known, name = one["determined"].values.astype(bool), str(one["parameter"].values)
    return _estimates_chart(
        f"estimates-{index + 1}", f"Estimates: {name}",
        label(name.replace("_", " "), str(one["unit"].values)), float(one["truth"]),
        [("determined", at, known, values), ("not determined", at, ~known, values)],
    )  # fmt: skip
