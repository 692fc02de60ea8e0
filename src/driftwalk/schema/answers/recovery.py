"""The answers of recovery studies, of a fit and of a motion model: errors and intervals."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.core.units import in_percent
from driftwalk.schema.answers.parts import Answer, Part, Table, each, length_text
from driftwalk.schema.kinds.recovery import RECOVERED
from driftwalk.schema.parameters import flat_name

if TYPE_CHECKING:
    import xarray as xr

_SUMMARY: Final = (
    *("median_absolute_error", "absolute_error_90", "bias", "rms_error", "spread", "rms_z"),
    *("coverage", "coverage_low", "coverage_high"),
)
_TRUTH: Final = (
    *("drag_coefficient", "force_std_N", "force_interval_s", "tracking_noise_m", "flow"),
    *("sample_interval_s", "recordings_per_fit", "missing_share", "seed", "confidence"),
    "coverage_confidence",
)


class NotablePolicy(NamedTuple):
    """When a recovery study says that an error is more than the fits state."""

    bias: float = 0.05
    """Mean relative error of C_d that is always tolerated; chosen by hand."""
    standard_errors: float = 3.0
    """Standard errors of a mean beyond which it is a bias: chance exceeds them once in 370."""
    excess: float = 2.0
    """Standard errors of the logarithm of an rms beyond which errors do not shrink with the length:
    chance exceeds them once in 44."""


NOTABLE: Final = NotablePolicy()

_COLUMNS: Final = ("length", "angle", "of", "median |error|", "90 % within", "bias", "rms z")
_SET_UP: Final = (
    *("duration_s", "sample_rate_Hz", "missing_share", "position_noise_m", "noise"),
    *("confidence", "seed"),
)
_STATUS: Final = {1: "could not be calibrated", 2: "could not be simulated"}
"""Words for a data set without an answer, by its status."""
_MODEL_SUMMARY: Final = (
    *("truth", "median_error", "determined_median_error", "determined_share", "coverage"),
    "coverage_standard_error",
)


def recovery_answer(found: xr.Dataset) -> Answer:
    """Return the answer of a recovery study: errors and intervals, and how long to record."""
    truth = found.attrs
    parts: list[Part] = [
        f"truth: C_d {truth['drag_coefficient']:g}, σ_F {1e3 * truth['force_std_N']:g} mN every "
        f"{1e3 * truth['force_interval_s']:g} ms, tracking noise "
        f"{1e3 * truth['tracking_noise_m']:.3g} mm, flow: {truth['flow']}",
        Table(
            [row for part in _parts(found) for row in _rows(part)],
            [*_COLUMNS, f"{in_percent(truth['confidence'])} intervals that hold the truth"],
        ),
        *map(_needed_sentence, each(found, "angle")),
    ]
    warnings = _warnings(found)
    facts = {
        "truth": {key: truth[key] for key in _TRUTH},
        "results": [_result(part) for part in _parts(found)],
        "needed": [_needed(part) for part in each(found, "angle")],
        "warnings": warnings,
    }
    return Answer(parts, facts, warnings)


def _result(part: xr.Dataset) -> dict[str, Any]:
    return {
        "duration_s": float(part["duration"]),
        "angle": str(part["angle"].values),
        **_counts(part),
        **{name: _summary(part, name) for name in RECOVERED},
        **{key: float(part[key]) for key in ("median_flow_error", "flow_error_90")},
        "median_wall_share": _median(part["wall_share"].values),
        "median_fit_s": _median(part["fit_time"].values),
    }


def _summary(part: xr.Dataset, name: str) -> dict[str, float]:
    one = part.sel(parameter=name)
    return {key: float(one[key]) for key in _SUMMARY}


def _counts(part: xr.Dataset) -> dict[str, int]:
    """Return what became of the recordings of one length."""
    fitted = int((part["status"].values == 0).sum())
    used = int(part["used"].values.sum())
    return {
        "recordings": part.sizes["recording"],
        "used": used,
        "at_the_wall": fitted - used,
        "without_fit": part.sizes["recording"] - fitted,
    }


def _warnings(found: xr.Dataset) -> list[str]:
    """Return what the user should know, in sentences."""
    said = []
    for part in _parts(found):
        number = _counts(part)
        where = _where(part)
        if number["at_the_wall"]:
            said.append(
                f"{where}: {number['at_the_wall']} of {number['recordings']} recordings have more "
                f"than {in_percent(found.attrs['most_wall_share'])} of their intervals at the "
                "wall; they are left out of the summary"
            )
        if number["without_fit"]:
            texts = [str(text) for text in part["message"].values.ravel() if text]
            said.append(
                f"{where}: {number['without_fit']} of {number['recordings']} recordings could not "
                f"be fitted: {texts[0]}"
            )
    for part in each(found.isel(duration=-1), "angle"):
        said += [f"{_where(part)}: {text}" for text in _doubts(part)]
    return said


def _where(part: xr.Dataset) -> str:
    return f"{length_text(float(part['duration']))}, angle {part['angle'].values}"


def _doubts(part: xr.Dataset) -> list[str]:
    """Return what to say of C_d where its error is not the chance that the fits state."""
    used = _counts(part)["used"]
    value = _summary(part, "drag_coefficient")
    chance = value["spread"] / np.sqrt(max(used, 1))
    said = []
    if abs(value["bias"]) > max(NOTABLE.bias, NOTABLE.standard_errors * chance):
        said.append(
            f"C_d is off by {in_percent(value['bias'], sign=True)} on average, where chance gives "
            f"{in_percent(chance)}: more recordings do not help, and only a comparison of "
            "lengths shows whether longer ones do"
        )
    if value["coverage_high"] < part.attrs["confidence"]:
        said.append(
            f"the {in_percent(part.attrs['confidence'])} intervals of C_d hold the truth in "
            f"{round(value['coverage'] * used)} of {used}: they are too narrow here, by a "
            f"factor of about {value['rms_z']:.1f}"
        )
    # Over the error of the law; the longest recordings show a bias that stays.
    law = float(part["drag_coefficient_error_scale"]) / np.sqrt(float(part["duration"]))
    excess = float(value["rms_error"] / law)
    if excess > np.exp(NOTABLE.excess / np.sqrt(2.0 * max(used, 1))):
        said.append(
            f"the error of C_d is {excess:.1f} times what the square root of the length gives: do "
            "not trust the length to record"
        )
    return said


def _parts(found: xr.Dataset) -> list[xr.Dataset]:
    return [part for length in each(found, "duration") for part in each(length, "angle")]


def _rows(part: xr.Dataset) -> list[list[str]]:
    used = _counts(part)["used"]
    rows = []
    for name in RECOVERED:
        value = _summary(part, name)
        covered = (
            f"{round(value['coverage'] * used)} of {used} ({in_percent(value['coverage_low'])} to "
            f"{in_percent(value['coverage_high'])})"
            if used
            else "none"
        )
        errors = [_percent(value[key]) for key in ("median_absolute_error", "absolute_error_90")]
        errors += [_percent(value["bias"], sign="+"), f"{value['rms_z']:.2f}"]
        rows.append([RECOVERED[name].short, *errors, covered])
    flow = [_percent(float(part[key])) for key in ("median_flow_error", "flow_error_90")]
    rows.append(["flow", *flow])
    head = [length_text(float(part["duration"])), str(part["angle"].values)]
    return [[*(head if n == 0 else ("", "")), *row] for n, row in enumerate(rows)]


def _percent(value: float, *, sign: str = "") -> str:
    return f"{100 * value:{sign}.1f} %" if np.isfinite(value) else "-"


def _median(values: Any) -> float | None:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else None


def _needed(part: xr.Dataset) -> dict[str, Any]:
    """Return how long to record with one use of the angle."""
    return {
        "angle": str(part["angle"].values),
        "drag_coefficient_precision": part.attrs["drag_coefficient_precision"],
        "duration_s": float(part["needed_duration"]),
        "duration_s_interval": [float(part[f"needed_duration_{end}"]) for end in ("low", "high")],
        "drag_coefficient_error_scale_sqrt_s": float(part["drag_coefficient_error_scale"]),
        "basis": _basis(part),
    }


def _basis(part: xr.Dataset) -> str:
    lengths = ", ".join(length_text(float(value)) for value in part["duration"].values)
    return f"rms error of C_d at {lengths}, assumed to fall with the square root of the length"


def _needed_sentence(part: xr.Dataset) -> str:
    scale = float(part["drag_coefficient_error_scale"])
    head = f"angle {part['angle'].values}: "
    if not np.isfinite(scale):
        return f"{head}too few fits to say how the error of C_d falls with the length"
    hour, low, high = (
        in_percent(float(part[f"drag_coefficient_error_scale{end}"]) / np.sqrt(3600.0), decimals=1)
        for end in ("", "_low", "_high")
    )
    within = f"{in_percent(part.attrs['needed_confidence'])} interval"
    text = f"{head}C_d to {hour} (rms) in 1 h ({within} {low} to {high})"
    asked = float(part.attrs["drag_coefficient_precision"])
    if np.isfinite(asked):
        time, low, high = (
            length_text(float(part[f"needed_duration{end}"])) for end in ("", "_low", "_high")
        )
        wanted = in_percent(asked, decimals=1)
        text = f"{head}for C_d to {wanted} (rms) record {time} ({within} {low} to {high})"
    return f"{text}: an estimate from the {_basis(part)}"


def model_recovery_answer(found: xr.Dataset) -> Answer:
    """Return the answer of a recovery study of a motion model."""
    set_up = found.attrs
    lost = float(set_up["missing_share"])
    columns = [
        *("parameter", "truth", "median |error|", "determined in"),
        f"{in_percent(set_up['confidence'])} intervals that hold the truth",
    ]
    parts: list[Part] = [
        f"{set_up['model']}: {found.sizes['recording']} recordings of "
        f"{length_text(float(set_up['duration_s']))} at {float(set_up['sample_rate_Hz']):g} Hz"
        f"{f', {in_percent(lost)} of the samples missing' if lost else ''}, tracking noise "
        f"{1e3 * float(set_up['position_noise_m']):.3g} mm"
        f"{', which is known' if set_up['noise'] == 'known' else ''}",
        Table([_model_row(one) for one in each(found, "parameter")], columns),
    ]
    warnings = model_warnings(found)
    facts = {
        "model": set_up["model"],
        "fixed": json.loads(set_up["fixed"]),
        "recordings": found.sizes["recording"],
        "calibrated": int((found["status"].values == 0).sum()),
        **{key: set_up[key] for key in _SET_UP},
        "parameters": {
            flat_name(str(one["parameter"].values), str(one["unit"].values)): {
                **{name: _finite(float(one[name])) for name in _MODEL_SUMMARY},
                **_model_counts(one),
            }
            for one in each(found, "parameter")
        },
        "warnings": warnings,
    }
    return Answer(parts, facts, warnings)


def model_warnings(found: xr.Dataset) -> list[str]:
    """Return what the user should know, in sentences."""
    said = []
    status = found["status"].values
    for value, words in _STATUS.items():
        which = status == value
        if which.any():
            why = str(found["message"].values[which][0])
            said.append(f"{which.sum()} of {status.size} recordings {words}: {why}")
    return said


def _model_row(one: xr.Dataset) -> list[str]:
    count = _model_counts(one)
    unit = str(one["unit"].values)
    held = f"{count['covered']} of {count['intervals']}" if count["intervals"] else "no intervals"
    return [
        str(one["parameter"].values).replace("_", " "),
        f"{float(one['truth']):g} {'' if unit == '1' else unit}".rstrip(),
        _percent(float(one["median_error"])),
        f"{count['determined']} of {count['calibrated']}",
        held,
    ]


def _model_counts(one: xr.Dataset) -> dict[str, int]:
    """Return in how many recordings a parameter is what."""
    known = np.isfinite(one["interval"].transpose("recording", "bound").values).all(axis=1)
    calibrated = one["status"].values == 0
    return {
        "calibrated": int(calibrated.sum()),
        "determined": int((one["determined"].values.astype(bool) & calibrated).sum()),
        "intervals": int(known.sum()),
        "covered": round(float(one["coverage"]) * known.sum()) if known.any() else 0,
    }


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
