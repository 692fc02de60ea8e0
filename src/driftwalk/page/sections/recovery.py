"""A page on a recovery study: how well recordings of known truth give it back."""

from __future__ import annotations

import math
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

if TYPE_CHECKING:
    import xarray as xr

PARAMETERS: Final = {
    "drag_coefficient": ("drag_coefficient", "1", "drag coefficient C_d"),
    "force_std": ("force_std_N", "N", "stochastic force σ_F"),
    "tracking_noise": ("tracking_noise_m", "m", "tracking noise"),
}
"""Attribute that holds the truth, unit and label."""
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
    for name, (_, _, words) in PARAMETERS.items():
        id, title = f"estimates-{name.replace('_', '-')}", f"Estimates: {words}"
        made += attempt(
            id,
            title,
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
        f"{words} = {quantity(float(required(recovery, key)), unit)}"
        for key, unit, words in PARAMETERS.values()
    )
    every = quantity(float(required(recovery, "force_interval_s")), "s")
    paragraphs = [done, f"The truth: {truth}; the force is redrawn every {every}."]
    paragraphs += _found(recovery, confidence)
    shown = [
        figure(words, required(recovery, key), unit, note="truth")
        for key, unit, words in PARAMETERS.values()
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
        words = PARAMETERS[name][2] if name in PARAMETERS else name
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
    key, unit, words = PARAMETERS[name]
    require(recovery, name, f"{name}_low", f"{name}_high", "used")
    drawn = []
    for at, words_of, part in _groups(recovery):
        used = part["used"].values == 1
        for kept, more in ((used, ""), (~used, ", left out of the summary")):
            if not kept.any():
                continue
            values, low, high = (
                np.where(kept, part[f"{name}{end}"].values, np.nan) for end in ("", "_low", "_high")
            )
            drawn.append(series(f"{words_of}{more}", at, values, ends=(low, high), style="points"))
    return chart(
        f"estimates-{name.replace('_', '-')}", f"Estimates: {words}",
        "Each point is a recording, with its interval.",
        x=label("recording"), y=label(words, unit), series=drawn,
        marks=[mark("truth", y=required(recovery, key))],
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
