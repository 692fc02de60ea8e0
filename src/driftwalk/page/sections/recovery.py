"""Pages on recovery studies: how well recordings of known truth give it back."""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.units import percent
from driftwalk.page import parts
from driftwalk.page.arrays import number
from driftwalk.page.parts import Maker, Section, count, quantity, require, required, value_of
from driftwalk.schema.answers.parts import each
from driftwalk.schema.answers.recovery import model_recovery_answer, model_warnings, recovery_answer
from driftwalk.schema.kinds.recovery import RECOVERED

if TYPE_CHECKING:
    import xarray as xr

MOST_WAYS: Final = 1000
"""Combinations of length, angle and parameter, a row of the table each; chosen by hand."""
MOST_PARAMETERS: Final = 100
"""Parameters of a model that a page shows, with a chart each; chosen by hand."""


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
    pieces: tuple[tuple[str, str, Maker], ...] = (
        ("errors", "Errors and intervals", errors_section),
        ("by-length", "Error by length", by_length_section),
        *(
            (_id_of(name), f"Estimates: {one.words}", partial(estimates_section, name=name))
            for name, one in RECOVERED.items()
        ),
        ("flow-error", "Error of the flow", flow_error_section),
    )
    reason = _obstacle(recovery, MOST_WAYS, "duration", "angle", "parameter")
    found = None if reason else recovery
    return parts.sections_of(
        found, reason, recovery_summary, lambda found: recovery_answer(found).warnings, pieces
    )


def _obstacle(recovery: xr.Dataset | None, most: int, *coordinates: str) -> str:
    """Return why a study cannot be shown: a damaged file may declare an axis of any length."""
    if recovery is None:
        return "There are no estimates yet."
    missing = [name for name in coordinates if name not in recovery.variables]
    if missing:
        return f"the recovery holds no {', '.join(missing)}"
    rows = math.prod(recovery[name].size for name in coordinates)
    return f"{rows} rows of estimates are more than the {most} of a page" if rows > most else ""


def _id_of(name: str) -> str:
    return f"estimates-{name.replace('_', '-')}"


def recovery_summary(recovery: xr.Dataset) -> Section:
    """Return a recovery study in words and numbers."""
    ends = [f"needed_duration{end}" for end in ("", "_low", "_high")]
    require(recovery, "used", "median_absolute_error", "coverage", *ends)
    lengths = ", ".join(quantity(float(value), "s") for value in recovery["duration"].values)
    truth = ", ".join(
        f"{one.words} = {quantity(float(required(recovery, one.key)), one.unit)}"
        for one in RECOVERED.values()
    )
    every = quantity(float(required(recovery, "force_interval_s")), "s")
    paragraphs = [
        f"{count(recovery.sizes['recording'], 'recording')} of each length ({lengths}) were "
        "simulated with known parameters and fitted. All of this is simulated: it "
        "shows how well the fit would do if the model were right.",
        f"The truth: {truth}; the force is redrawn every {every}.",
        *_found(recovery),
    ]
    shown = [
        parts.figure(one.words, required(recovery, one.key), one.unit, note="truth")
        for one in RECOVERED.values()
    ]
    wanted = value_of(recovery, "drag_coefficient_precision")
    note = None if wanted is None else f"for an error of C_d of {percent(wanted)} (rms)"
    for part in each(recovery, "angle"):
        needed, low, high = (number(part[end]) for end in ends)
        if needed is not None:
            words, within = f"length needed, angle {part['angle'].item()}", (low, high)
            confidence = value_of(recovery, "needed_confidence")
            shown.append(
                parts.figure(words, needed, "s", note=note, ends=within, confidence=confidence)
            )
    return parts.summary_section(paragraphs, shown)


def _found(recovery: xr.Dataset) -> list[str]:
    """Return how well the longest recordings give C_d, in a sentence for each use of the angle."""
    confidence = value_of(recovery, "confidence")
    words = "" if confidence is None else f"{percent(confidence)} "
    told = []
    for part in each(recovery.sel(parameter="drag_coefficient").isel(duration=-1), "angle"):
        error, held = number(part["median_absolute_error"]), number(part["coverage"])
        if error is not None and held is not None:
            told.append(
                f"With {quantity(float(part['duration']), 's')} and the angle "
                f"{part['angle'].item()}, the median error of C_d is {percent(error)}; "
                f"{percent(held)} of the {words}intervals hold the truth."
            )
    return told


def errors_section(recovery: xr.Dataset) -> Section:
    """Return the table of errors and coverage."""
    table = parts.answer_table(recovery_answer(recovery))
    note = "Errors are relative to the truth."
    return parts.section_of_table(table, note)


def by_length_section(recovery: xr.Dataset) -> Section:
    """Return how the error of C_d falls with the length of a recording."""
    require(recovery, "rms_error")
    length = recovery["duration"].values
    drawn = []
    for angle in recovery["angle"].values:
        rms = recovery["rms_error"].sel(parameter="drag_coefficient", angle=angle).values
        drawn.append(parts.series(f"angle {angle}", length, rms, style="points"))
    wanted = value_of(recovery, "drag_coefficient_precision")
    marks = [] if wanted is None else [parts.mark("wanted", y=wanted)]
    return parts.chart(
        "Root mean square of ln(estimate / truth).",
        x=parts.label("length of a recording", "s", log=True),
        y=parts.label("error of C_d", log=True), series=drawn, marks=marks,
    )  # fmt: skip


def estimates_section(recovery: xr.Dataset, *, name: str) -> Section:
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
        parts.label(parameter.words, parameter.unit), required(recovery, parameter.key), drawn,
    )  # fmt: skip


def _estimates_chart(y: Any, truth: float, drawn: Iterable[tuple[str, Any, Any, Any]]) -> Section:
    """Return a chart of words, places, which are shown, and estimates with both ends."""
    shown = []
    for words, at, kept, values in drawn:
        if kept.any():
            value, low, high = (np.where(kept, one, np.nan) for one in values)
            shown.append(parts.series(words, at, value, ends=(low, high), style="points"))
    return parts.chart(
        "Each point is a recording, with its interval.", x=parts.label("recording"), y=y,
        series=shown, marks=[parts.mark("truth", y=truth)],
    )  # fmt: skip


def flow_error_section(recovery: xr.Dataset) -> Section:
    """Return the error of the flow in every recording."""
    require(recovery, "flow_error", "used")
    drawn = []
    for at, words, part in _groups(recovery):
        error = np.where(part["used"].values == 1, part["flow_error"].values, np.nan)
        drawn.append(parts.series(words, at, error, style="points"))
    return parts.chart(
        "Rms error over rms speed, averaged over the block.",
        x=parts.label("recording"), y=parts.label("relative error"), series=drawn,
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
    reason = _obstacle(model_recovery, MOST_PARAMETERS, "parameter")
    found = None if reason else model_recovery
    names = [] if found is None else list(map(str, found["parameter"].values))
    pieces: tuple[tuple[str, str, Maker], ...] = (
        ("errors", "Errors and intervals", model_errors_section),
        *(
            (f"estimates-{at + 1}", f"Estimates: {one}", partial(model_estimates_section, index=at))
            for at, one in enumerate(names)
        ),
    )
    return parts.sections_of(found, reason, model_summary_section, model_warnings, pieces)


def model_summary_section(recovery: xr.Dataset) -> Section:
    """Return a recovery study in words and numbers."""
    require(recovery, "determined_share", "status")
    model, length = required(recovery, "model"), float(required(recovery, "duration_s"))
    paragraphs = [
        f"{count(recovery.sizes['recording'], 'recording')} of {quantity(length, 's')} were "
        f"simulated by the model {model} with known parameters, and calibrated. All of this is "
        "simulated: it shows how well a calibration would do if the model were right.",
    ]
    names, share = recovery["parameter"].values.astype(str), recovery["determined_share"].values
    for words, chosen in (("Every", names[share == 1.0]), ("No", names[share == 0.0])):
        if chosen.size:
            paragraphs.append(f"{words} recording determines {', '.join(chosen)}.")
    shown = [
        parts.figure("length of a recording", length, "s"),
        parts.figure("samples per second", required(recovery, "sample_rate_Hz"), "Hz"),
        parts.figure("position noise", required(recovery, "position_noise_m"), "m"),
    ]
    return parts.summary_section(paragraphs, shown)


def model_errors_section(recovery: xr.Dataset) -> Section:
    """Return the table of errors, of what is determined, and of coverage."""
    require(recovery, "meaning")
    table = parts.answer_table(model_recovery_answer(recovery))
    meanings = map(str, recovery["meaning"].values)
    return parts.table_section(
        [*table.columns, "meaning"],
        [[*row, words] for row, words in zip(table.rows, meanings, strict=True)],
        "Errors are relative to the truth. A parameter is determined where its 90 % interval ends "
        "within 15 % of its value.",
    )  # fmt: skip


def model_estimates_section(recovery: xr.Dataset, *, index: int) -> Section:
    """Return the estimates of a parameter with their intervals next to the truth."""
    require(recovery, "estimate", "interval", "determined", "truth", "unit")
    one = recovery.isel(parameter=index)
    at = 1.0 + np.arange(recovery.sizes["recording"])
    values = [one["estimate"].values, *one["interval"].transpose("bound", "recording").values]
    known, name = one["determined"].values.astype(bool), str(one["parameter"].values)
    return _estimates_chart(
        parts.label(name.replace("_", " "), str(one["unit"].values)), float(one["truth"]),
        [("determined", at, known, values), ("not determined", at, ~known, values)],
    )  # fmt: skip
