"""A page on a calibration: its answer in words, the map, how well it is known."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.page import parts
from driftwalk.page.arrays import number
from driftwalk.page.parts import Maker, Section, count, quantity, require, required, value_of
from driftwalk.page.sections.flow import flow_sections
from driftwalk.page.sections.map import (
    FORCE,
    axis_of,
    map_section,
    page_parameters,
    region_part,
)
from driftwalk.page.sections.recording import Noise, recording_sections
from driftwalk.plot.parts.labels import interval_of
from driftwalk.schema.answers.calibration import UNCHECKED
from driftwalk.schema.answers.facts import sentences
from driftwalk.schema.answers.parts import estimates
from driftwalk.schema.answers.verdict import stored_verdict
from driftwalk.schema.description import Number
from driftwalk.schema.parameters import is_block

if TYPE_CHECKING:
    import xarray as xr


def calibration_sections(
    calibration: xr.Dataset | None,
    *,
    flow: xr.Dataset | None = None,
    recording: xr.Dataset | None = None,
    body: str | None = None,
) -> list[Section]:
    """Return the sections of a page on a calibration.

    Parameters
    ----------
    calibration : xarray.Dataset, optional
        A `calibration`; None while there is none yet.
    flow : xarray.Dataset, optional
        The `flow_field` that it used.
    recording : xarray.Dataset, optional
        The `trajectory`.
    body : str, optional
        The body that was used, where the recording has several.

    Returns
    -------
    list of dict
        Sections; what cannot be shown is an empty one that says why.

    Examples
    --------
    >>> [part["kind"] for part in calibration_sections(None)]
    ['empty']
    """
    nothing = "There is no calibration yet."
    said = partial(sentences, name="warning")
    made = parts.sections_of(calibration, nothing, calibration_summary, said)
    if recording is not None:
        noise = None if calibration is None else _noise(calibration)
        made += recording_sections(recording, body=body, noise=noise)
    if flow is not None:
        made += flow_sections(flow)
    pieces: list[tuple[str, str, Maker]] = [
        ("profiles", "Along the optimum", profile_sections),
        ("bootstrap", "The bootstrap", bootstrap_section),
        ("validation", "Validation", validation_section),
    ]
    if calibration is not None and len(page_parameters(calibration)) != 1:
        one = one_body(recording, body)
        pieces.insert(0, ("map", "The map", lambda found: map_section(found, one)))
    return made + parts.attempts(*((*piece, calibration) for piece in pieces))


def calibration_summary(calibration: xr.Dataset) -> Section:
    """Return the answer of a calibration in words and numbers."""
    require(calibration, "ks_distance")
    paragraphs = [parts.SIMULATED] if parts.is_simulated(calibration) else []
    paragraphs += [_what_was_done(calibration), _what_was_found(calibration)]
    shown = [
        *_estimates(calibration),
        parts.figure(
            "KS distance at the optimum", value_of(calibration, "ks_distance"), symbol="D"
        ),
        parts.figure(
            "noise floor", value_of(calibration, "noise_floor"),
            note="distance between two runs of the same model",
        ),
    ]  # fmt: skip
    return parts.summary_section([*paragraphs, *_how_good(calibration)], shown)


def _estimates(calibration: xr.Dataset) -> list[dict[str, Any]]:
    """Return the estimates; of the block the noise intensity as well."""
    require(calibration, "estimate", "parameter", "unit")
    shown = [parts.card(one) for one in estimates(calibration)]
    intensity = value_of(calibration, "force_noise_intensity_N2_s")
    if is_block(calibration):
        shown.append(parts.figure("noise intensity", intensity, "N² s", symbol="σ_F²·τ"))
    return shown


def profile_sections(calibration: xr.Dataset) -> list[Section]:
    """Return the KS distance along every parameter, the others next to the optimum.

    Parameters
    ----------
    calibration : xarray.Dataset
        A `calibration`; one that is still being made has to have a single parameter.

    Raises
    ------
    InputError
        When the dataset holds no map, or not the estimates of the other parameters.

    Examples
    --------
    ``profile_sections(calibration)[0]["series"]``
    """
    parameters = page_parameters(calibration)
    require(calibration, "ks_distance", *(one.name for one in parameters))
    return [_profile(calibration, along) for along in parameters]


def bootstrap_section(calibration: xr.Dataset) -> Section:
    """Return the estimates from simulated recordings, with the joint region.

    Two parameters have their plane, a single one the distribution of its estimates.

    Parameters
    ----------
    calibration : xarray.Dataset
        A `calibration`; without a bootstrap the section is an empty one that says so.

    Examples
    --------
    ``bootstrap_section(calibration)["series"]``
    """
    parameters = page_parameters(calibration)
    title = "How well the parameters are known"
    if any(f"bootstrap_{one.name}" not in calibration for one in parameters):
        reason = "The calibration was made without a bootstrap: no interval, no region."
        return parts.empty_section("bootstrap", title, reason)
    estimates = [calibration[f"bootstrap_{one.name}"].values for one in parameters]
    note = (
        f"{count(int(estimates[0].size), 'recording')} simulated at the optimum, each calibrated "
        "like the real one."
    )
    name = "estimates from simulated recordings"
    marks = [parts.mark("estimate", *(value_of(calibration, one.key) for one in parameters))]
    if len(parameters) == 1:
        values = np.sort(estimates[0])
        y = parts.label("share of the estimates up to here")
        drawn = [parts.series(name, values, np.arange(1, values.size + 1) / values.size)]
        ends = interval_of(calibration, f"{parameters[0].key}_interval") or ()
        marks += [parts.mark("end of the interval", end) for end in ends]
    else:
        y = axis_of(calibration, parameters[1])
        drawn = [parts.series(name, estimates[0], estimates[1], style="points")]
        region = region_part(calibration)
        if region is not None:
            drawn.append(parts.series("joint region", *([*region[n], region[n][0]] for n in "xy")))
    x = axis_of(calibration, parameters[0])
    return parts.chart(note, x=x, y=y, series=drawn, marks=marks, title=title)


def validation_section(calibration: xr.Dataset) -> Section:
    """Return the calibration on the first half, judged on the second."""
    title = "Fitted on the first half, tested on the second"
    if "second_half_ks_distance" not in calibration:
        return parts.empty_section("validation", title, "The recording was not split into halves.")
    keys = [
        (f"{_with_unit(one)}, {part}", f"{prefix}{one.key}", 1e3 if one == FORCE else 1.0)
        for one in page_parameters(calibration)
        for part, prefix in (("whole recording", ""), ("first half", "first_half_"))
    ]
    keys += [
        ("KS distance to the second half", "second_half_ks_distance", 1.0),
        ("noise floor there", "second_half_noise_floor", 1.0),
        ("KS distance between the two halves", "halves_ks_distance", 1.0),
        ("the same of parts drawn at random", "halves_ks_distance_expected", 1.0),
    ]
    rows = [
        [label, None if (value := value_of(calibration, key)) is None else scale * value]
        for label, key, scale in keys
    ]
    return parts.table_section(["", "value"], rows, title=title)


def _with_unit(one: Number) -> str:
    unit = "mN" if one == FORCE else one.unit
    return one.short if unit == "1" else f"{one.short} ({unit})"


def _what_was_done(calibration: xr.Dataset) -> str:
    name = calibration.attrs.get("recording_name", "")
    words = f"driftwalk compared the recording {name}".rstrip()
    duration, pairs = (value_of(calibration, name) for name in ("duration_s", "recording_pairs"))
    if duration is not None and pairs is not None:
        step = value_of(calibration, "step_interval_s")
        each = "" if step is None else f" of {quantity(step, 's')}"
        words += f" ({quantity(duration, 's')}, {count(int(pairs), 'pair')} of steps{each})"
    settings = calibration["ks_distance"].size
    searched = " and ".join(one.plain for one in page_parameters(calibration))
    if is_block(calibration):
        searched = "drag and stochastic force"
    words += f" with simulations of {settings} settings of {searched}"
    if "replicate" in calibration.sizes:
        words += f", {_runs_each(calibration)} each"
    if "refined_ks_distance" in calibration:
        words += f", then of {calibration['refined_ks_distance'].size} around the best"
    measure = "the Kolmogorov–Smirnov distance D of step lengths and turning angles"
    return f"{words}. The measure is {measure}."


def _runs_each(calibration: xr.Dataset) -> str:
    """Return how many simulations the settings of the coarse map have."""
    most = calibration.sizes["replicate"]
    counts = calibration.get("replicate_count")
    fewest = most if counts is None else int(counts.min())
    return count(most, "run") if fewest == most else f"{fewest} to {count(most, 'run')}"


def _what_was_found(calibration: xr.Dataset) -> str:
    confidence = value_of(calibration, "confidence")
    parameters = page_parameters(calibration)
    found = [
        parts.with_interval(
            required(calibration, one.key),
            interval_of(calibration, f"{one.key}_interval"),
            one.unit,
            confidence,
        )
        for one in parameters
    ]
    if FORCE not in parameters:
        words = [f"{one.plain} = {value}" for one, value in zip(parameters, found, strict=True)]
        return f"The best agreement is at {' and '.join(words)}."
    drag, force = found
    every = quantity(required(calibration, "force_interval_s"), "s")
    intensity = quantity(required(calibration, "force_noise_intensity_N2_s"), "N² s")
    return (
        f"The best agreement is at a drag coefficient C_d = {drag} and a stochastic force "
        f"σ_F = {force}, redrawn every {every}. The recording determines only σ_F²·τ = "
        f"{intensity}: σ_F means nothing without its interval."
    )


def _how_good(calibration: xr.Dataset) -> list[str]:
    """Return what the distance means, in honest words."""
    distance, floor = (value_of(calibration, name) for name in ("ks_distance", "noise_floor"))
    if distance is None or floor is None:
        return []
    verdict = parts.verdict_paragraphs(
        stored_verdict(calibration),
        UNCHECKED,
        more="A small distance does not prove that the model is right.",
    )
    words = [
        f"There D = {distance:.4g}, where two runs of the same model are {floor:.4g} apart "
        f"(noise floor): {distance / floor:.2f} times it.",
        *verdict,
    ]
    second, second_floor = (
        value_of(calibration, f"second_half_{name}") for name in ("ks_distance", "noise_floor")
    )
    if second is not None and second_floor is not None:
        words.append(
            f"Calibrated on the first half, it is {second:.4g} from the second (noise floor "
            f"{second_floor:.4g}). This includes the errors of the parameters and the "
            "flow of half a recording, so a few floors are normal for a short recording."
        )
    return words


def _profile(calibration: xr.Dataset, along: Number) -> Section:
    others = [one for one in page_parameters(calibration) if one.name != along.name]
    best = {other.name: float(required(calibration, other.key)) for other in others}
    line = calibration.sel(best, method="nearest")
    fixed = [f"{other.short} = {quantity(float(line[other.name]), other.unit)}" for other in others]
    optimum = (value_of(calibration, key) for key in (along.key, "ks_distance"))
    marks = [parts.mark("optimum", *optimum)]
    floor = value_of(calibration, "noise_floor")
    if floor is not None:
        marks.append(parts.mark("noise floor", y=floor))
    where = "At " + ", ".join(fixed) + ", the setting of the map next to the optimum."
    drawn = _profile_series(line, along.name)
    if not others and "refined_surface" in calibration:
        fine = (calibration[name].values for name in (f"refined_{along.name}", "refined_surface"))
        drawn.append(parts.series("fitted curve", *fine))
    return parts.chart(
        where if fixed else "Every setting that was simulated.",
        x=axis_of(calibration, along),
        y=parts.label("KS distance D", log=True),
        series=drawn,
        marks=marks,
        id=f"profile-{along.name.replace('_', '-')}",
        title=f"Distance along the {along.plain}",
    )


def _profile_series(line: xr.Dataset, along: str) -> list[dict[str, Any]]:
    """Return the replicates as points and their mean as a line with its standard error."""
    values, distance = line[along].values, line["ks_distance"].values
    drawn = []
    if "ks_distance_replicate" in line:
        replicates = line["ks_distance_replicate"].transpose(along, ...).values
        each = np.repeat(values, replicates.shape[1])
        drawn.append(parts.series("replicates", each, replicates.ravel(), style="points"))
    ends = None
    if "ks_distance_standard_error" in line:
        error = line["ks_distance_standard_error"].values
        ends = (distance - error, distance + error)
    return [*drawn, parts.series("mean ± standard error", values, distance, ends=ends)]


def _noise(calibration: xr.Dataset) -> Noise | None:
    value = number(calibration.get("position_noise"))
    return None if value is None else Noise(value, None, None, "used in the simulated camera")


def one_body(recording: xr.Dataset | None, body: str | None) -> xr.Dataset | None:
    """Return the recording with the one body that was used, None when that is not said."""
    if recording is None:
        return None
    if body is not None and body in [str(name) for name in recording["body"].values]:
        return recording.sel(body=[body])
    return recording if recording.sizes["body"] == 1 else None
