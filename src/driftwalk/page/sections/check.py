"""The part of a page on a model check: what speaks against the model, where and when."""

from __future__ import annotations

from functools import partial
from math import isfinite
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.units import percent
from driftwalk.page import parts
from driftwalk.page.arrays import encode_array, number
from driftwalk.page.parts import Maker, Section, require, value_of
from driftwalk.plot.model_check import BAND_STDS, LEAST_TOP, running_time
from driftwalk.schema.answers.fit import marked_criteria

if TYPE_CHECKING:
    import xarray as xr

ABSORBED: Final = "A tenth without a point: the fitted flow has absorbed what would be seen there."

LOOKS_FOR: Final = {
    "autocorrelation": "Prediction errors that depend on the ones before them.",
    "tails": "More large errors than a normal distribution has.",
    "outliers": "Single positions that the tracker got wrong.",
    "place": "A part of the tank where the flow differs from the fitted one.",
    "time and place": "A time in which the flow differs in some part of the tank.",
    "flow strength": "A flow that gets stronger or weaker.",
    "drag law": "A drag that fits slow motion and not fast motion, or the other way round.",
    "noise by place": "A part of the tank where the errors are larger, as under a lamp.",
    "noise by time": "A part of the recording where the errors are larger.",
    "change": "A moment at which the flow changes.",
    "steps": "Steps and turns that differ from simulated recordings (KS distance).",
    "measured flow": "A measured flow that differs from the fitted one.",
    "measured scale": "A scale that is wrong: measured and fitted flow differ by a factor.",
}
"""The fault that each test of a check looks for, in a sentence."""


def check_sections(check: xr.Dataset) -> list[Section]:
    """Return the sections on a model check.

    Parameters
    ----------
    check : xarray.Dataset
        A `model_check`.
    """
    lengths = partial(_density, name="step_length", unit="m")
    angles = partial(_density, name="turning_angle", unit="rad")
    makers: tuple[tuple[str, str, Maker], ...] = (
        ("check", "Does the model explain the recording?", _criteria),
        ("check-innovations", "Are the errors of prediction white?", _innovations),
        ("check-place", "Errors of prediction in the tank", _mean_errors),
        ("check-noise", "Size of the errors in the tank", _noise_ratio),
        ("check-flow-time", "Strength of the flow over time", partial(_over_time, show="flow")),
        ("check-noise-time", "Size of the errors over time", partial(_over_time, show="noise")),
        ("check-drag-speed", "Drag at different speeds", _drag_by_speed),
        ("check-step-length", "Step lengths, recorded and predicted", lengths),
        ("check-turning-angle", "Turning angles, recorded and predicted", angles),
    )
    return parts.attempts(*((*piece, check) for piece in makers))


def _criteria(check: xr.Dataset) -> Section:
    require(check, "criterion", "p_value", "failed", "detectable", "detectable_of")
    columns = (check[one].values for one in ("criterion", "p_value", "detectable", "detectable_of"))
    rows = [
        [
            marked,
            LOOKS_FOR.get(str(name), ""),
            number(p),
            f"{size:.2g}: {of}" if isfinite(size) else "–",
        ]
        for marked, name, p, size, of in zip(marked_criteria(check), *columns, strict=True)
    ]
    level = value_of(check, "level")
    note = "" if level is None else f"A test fails where its p value is below {level:.3g}."
    if any(row[0].endswith(": small") for row in rows):
        note += " Where it says 'small', the misfit is too small to change the verdict."
    heads = ["test", "what it looks for", "p value", "found nine times in ten"]
    return parts.table_section(heads, rows, note)


def _innovations(check: xr.Dataset) -> Section:
    require(check, "lag", "autocorrelation", "autocorrelation_expected", "autocorrelation_std")
    lag = check["lag"].values
    expected = check["autocorrelation_expected"].values.mean(axis=0)
    reach = BAND_STDS * check["autocorrelation_std"].values.mean(axis=0)
    band = (expected - reach, expected + reach)
    drawn = [parts.series("95 % if the model is right", lag, expected, ends=band)]
    for name, values in zip(
        check["component"].values, check["autocorrelation"].values, strict=True
    ):
        shown = "θ" if name == "theta" else name
        drawn.append(parts.series(f"error in {shown}", lag, values, style="points"))
    return parts.chart(
        "Errors of a right model have no memory.",
        x=parts.label("lag (samples)"), y=parts.label("autocorrelation"), series=drawn,
    )  # fmt: skip


def _mean_errors(check: xr.Dataset) -> Section:
    require(check, "residual_distance", "x", "y")
    distance = check["residual_distance"].values
    top = max(LEAST_TOP, float(np.nanmax(distance, initial=0.0)))
    limit = number(check["residual_distance"].attrs.get("limit"))
    beyond = (
        ""
        if limit is None
        else f" If the model is right, all cells stay below {limit:.2g} in 95 % of recordings, and "
        "one in twenty has a cell beyond it by chance: such a cell alone is no evidence against "
        "the model. The p value of 'place' above decides."
    )
    return _field(
        check, distance, f"Distance of the mean error from zero.{beyond}",
        words="distance from zero (standard deviations)", limits=[0.0, top],
    )  # fmt: skip


def _noise_ratio(check: xr.Dataset) -> Section:
    require(check, "noise_ratio", "noise_ratio_std", "x", "y")
    off = (check["noise_ratio"].values - 1.0) / check["noise_ratio_std"].values
    top = max(LEAST_TOP, float(np.nanmax(np.abs(off), initial=0.0)))
    return _field(
        check, off, "Mean squared error of each cell, relative to all cells.",
        words="off the mean (standard deviations)", limits=[-top, top],
    )  # fmt: skip


def _field(
    check: xr.Dataset, values: Floats, note: str, *, words: str, limits: list[float]
) -> Section:
    return parts.section(
        "", "image_grid", "", note,
        arena=parts.arena_part(check),
        x=parts.axis("x", "x", "m", check["x"].values),
        y=parts.axis("y", "y", "m", check["y"].values),
        value=encode_array(values), label=words, unit="1", diverging=limits[0] < 0.0, limits=limits,
    )  # fmt: skip


def _over_time(check: xr.Dataset, *, show: str) -> Section:
    name, shift, words = (
        ("flow_change", 0.0, "strength of the flow, relative to its mean")
        if show == "flow"
        else ("part_noise_ratio", 1.0, "squared errors, relative to their mean")
    )
    require(check, name, f"{name}_std", "part_start", "part_end", "part_recording")
    start, end = running_time(check)
    value = check[name].values - shift
    reach = BAND_STDS * check[f"{name}_std"].values
    note = "Tenths of the recording, with 95 % bars; 0 if nothing changes."
    if show == "flow" and np.isnan(value).any():
        note += f" {ABSORBED}"
    return parts.chart(
        note,
        x=parts.label("time", "s"), y=parts.label(words),
        series=[_with_bars("tenths", 0.5 * (start + end), value, reach)],
        marks=[parts.mark("no change", y=0.0)],
    )  # fmt: skip


def _with_bars(name: str, x: Floats, value: Floats, reach: Floats) -> dict[str, Any]:
    return parts.series(name, x, value, ends=(value - reach, value + reach), style="points")


def _drag_by_speed(check: xr.Dataset) -> Section:
    require(check, "drag_change", "drag_change_std", "speed_low", "speed_high")
    value = check["drag_change"].values
    reach = BAND_STDS * check["drag_change_std"].values
    middle = 0.5 * (check["speed_low"].values + check["speed_high"].values)
    return parts.chart(
        "A right drag law has the same C_d at all speeds; 95 % bars.",
        x=parts.label("speed through the water", "m/s"),
        y=parts.label("C_d, relative to the overall value"),
        series=[_with_bars("ranges of speed", middle, value, reach)],
        marks=[parts.mark("no change", y=0.0)],
    )  # fmt: skip


def _density(check: xr.Dataset, *, name: str, unit: str) -> Section:
    if f"{name}_edge" not in check:
        reason = f"No recordings were simulated: {check.attrs.get('ks_left_out', 'left out')}."
        return parts.empty_section("", "", reason)
    pieces = ("recording", "median", "low", "high")
    require(check, *(f"{name}_density_{part}" for part in pieces))
    edge = check[f"{name}_edge"].values
    real, median, low, high = (check[f"{name}_density_{part}"].values for part in pieces)
    band = value_of(check, "band")
    share = "" if band is None else f" and band of {percent(band)}"
    return parts.chart(
        x=parts.label(name.replace("_", " "), unit), y=parts.label("density", f"1/{unit}"),
        series=[
            parts.series(f"simulated: median{share}", edge, median, ends=(low, high), style="step"),
            parts.series("recording", edge, real, style="step"),
        ],
    )  # fmt: skip
