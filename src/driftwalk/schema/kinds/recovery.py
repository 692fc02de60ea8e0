"""The datasets of recovery studies: simulated recordings of known truth, and their estimates."""

from __future__ import annotations

from typing import Final

from driftwalk.schema.description import ARENA, SOURCE, STUDY, Attribute, Kind, Variable
from driftwalk.schema.kinds.fit_numbers import PARAMETERS

_EACH: Final = "duration angle recording"
_ALL: Final = "parameter duration angle"
RECOVERED: Final = {
    name: PARAMETERS[name] for name in ("drag_coefficient", "force_std", "tracking_noise")
}
"""The numbers of a fit that a recovery study compares with their truth."""
ESTIMATED, NOT_ESTIMATED, NOT_SIMULATED = range(3)
"""Status of a recording, of both kinds; without an estimate it has a message."""
_MISSING_SHARE: Final = Attribute("missing_share", "number", "share of the samples that is missing")
_SEED: Final = Attribute("seed", "number", "seed of the random numbers")


def _estimate(name: str, unit: str, words: str) -> tuple[Variable, ...]:
    return (
        Variable(name, _EACH, unit, words, note="NaN without a fit"),
        Variable(f"{name}_low", _EACH, unit, f"{words}, lower end of the interval"),
        Variable(f"{name}_high", _EACH, unit, f"{words}, upper end of the interval"),
        Variable(f"{name}_sd", _EACH, "1", f"stated standard deviation of ln {words}"),
        Variable(f"{name}_error", _EACH, "1", f"{words}, estimate / truth - 1"),
        Variable(f"{name}_z", _EACH, "1", f"{words}, ln(estimate / truth) / sd"),
        Variable(f"{name}_covered", _EACH, "1", f"{words}, 1 if the interval holds the truth"),
    )


def _by_angle(name: str, unit: str, words: str, note: str) -> tuple[Variable, ...]:
    return (
        Variable(name, "angle", unit, words, note=note),
        Variable(f"{name}_low", "angle", unit, f"{words}, lower end (90 %)"),
        Variable(f"{name}_high", "angle", unit, f"{words}, upper end (90 %)"),
    )


RECOVERY: Final = Kind(
    name="recovery",
    version=1,
    dimensions={
        "duration": "lengths of the recordings",
        "angle": "uses of the orientation",
        "recording": "simulated recordings",
        "parameter": "drag_coefficient, force_std, tracking_noise",
    },
    variables=(
        *_estimate("drag_coefficient", "1", "drag coefficient"),
        *_estimate("force_std", "N", "standard deviation of the force"),
        *_estimate("tracking_noise", "m", "tracking noise"),
        Variable(
            "flow_error", _EACH, "1", "rms error of the flow over its rms speed",
            note="averaged over the block, where it has been",
        ),
        Variable("flow_point_error", _EACH, "1", "rms error of the flow at points"),
        Variable("flow_z_rms", _EACH, "1", "rms error of the flow in standard errors"),
        Variable("flow_cells", _EACH, "1", "cells in which the flow is compared"),
        Variable("wall_share", _EACH, "1", "share of the intervals at the wall"),
        Variable("samples_used", _EACH, "1", "samples that the fit used"),
        Variable("iterations", _EACH, "1", "iterations of the fit"),
        Variable("converged", _EACH, "1", "1 if the fit converged"),
        Variable("fit_time", _EACH, "s", "time that the fit took"),
        Variable(
            "status", _EACH, None, "status of the recording", "int",
            flags={
                "fitted": ESTIMATED,
                "not_fitted": NOT_ESTIMATED,
                "not_simulated": NOT_SIMULATED,
            },
        ),
        Variable("message", _EACH, None, "reason why there is no fit", "text"),
        Variable(
            "used", _EACH, None, "enters the summary", "int",
            note="1 where fitted, with at most 30 % of the intervals at the wall",
        ),
        Variable("median_absolute_error", _ALL, "1", "median of the relative error's size"),
        Variable("absolute_error_90", _ALL, "1", "90 % quantile of the relative error's size"),
        Variable("bias", _ALL, "1", "mean of the relative error"),
        Variable("rms_error", _ALL, "1", "rms of ln(estimate / truth)"),
        Variable("spread", _ALL, "1", "standard deviation of ln(estimate) over the recordings"),
        Variable("rms_z", _ALL, "1", "rms of z", note="1 if the stated deviations are right"),
        Variable("coverage", _ALL, "1", "share of intervals that hold the truth"),
        Variable("coverage_low", _ALL, "1", "lower end of the coverage's interval"),
        Variable(
            "coverage_high", _ALL, "1", "upper end of the coverage's interval",
            note="Clopper-Pearson, 95 %",
        ),
        Variable("median_flow_error", "duration angle", "1", "median of the flow's error"),
        Variable("flow_error_90", "duration angle", "1", "90 % quantile of the flow's error"),
        *_by_angle(
            "drag_coefficient_error_scale", "s0.5", "scale of C_d's error",
            "a of rms error = a / √T",
        ),
        *_by_angle(
            "needed_duration", "s", "length that the asked precision needs",
            "(a / precision)²; NaN where none is asked",
        ),
        Variable("duration", "duration", "s", "length of the recording"),
        Variable("angle", "angle", None, "use of the orientation", "text"),
        Variable("recording", "recording", None, "recording", "int"),
        Variable("parameter", "parameter", None, "parameter", "text"),
    ),
    attributes=(
        Attribute("drag_coefficient", "number", "the truth"),
        Attribute("force_std_N", "number", "the truth"),
        Attribute("force_interval_s", "number", "the truth"),
        Attribute("tracking_noise_m", "number", "the truth"),
        Attribute("flow", "text", "the true flow"),
        Attribute("sample_interval_s", "number", "time between samples"),
        Attribute("recordings_per_fit", "number", "recordings that are fitted together"),
        _MISSING_SHARE,
        _SEED,
        Attribute("confidence", "number", "of the fits' intervals"),
        Attribute("coverage_confidence", "number", "of the coverage's interval"),
        Attribute("needed_confidence", "number", "of the needed length's interval"),
        Attribute("most_wall_share", "number", "share at the wall with which a fit is used"),
        Attribute("drag_coefficient_precision", "number", "that is asked, NaN for none"),
        STUDY,
    ),
)  # fmt: skip

_EACH_MODEL: Final = "recording parameter"
_ENDS: Final = "recording parameter bound"
_WITHOUT: Final = "NaN without a calibration"

MODEL_RECOVERY: Final = Kind(
    name="model_recovery",
    version=1,
    dimensions={
        "recording": "simulated recordings",
        "parameter": "open parameters of the model",
        "bound": "lower and upper end",
    },
    variables=(
        Variable("truth", "parameter", None, "true value of the parameter", note="in its unit"),
        Variable("estimate", _EACH_MODEL, None, "estimate of the parameter", note=_WITHOUT),
        Variable(
            "interval", _ENDS, None, "interval of the parameter",
            note="NaN where the calibration gives none",
        ),
        Variable(
            "determined", _EACH_MODEL, None, "whether the recording determines the parameter",
            "bool", note="within 15 % of its value, with 90 % confidence",
        ),
        Variable(
            "half_width", _EACH_MODEL, "1", "half the 90 % interval over the value",
            note="of its logarithm on a logarithmic scale; infinite at the end of its range",
        ),
        Variable(
            "error", _EACH_MODEL, "1", "relative error of the estimate",
            note="ln(estimate / truth) on a logarithmic scale; on a linear one over the truth, or "
            "over a twentieth of the range where the truth is smaller",
        ),
        Variable(
            "error_interval", _ENDS, "1", "ends of the interval, as errors",
            note="it holds the truth where 0 lies between them",
        ),
        Variable(
            "status", "recording", None, "what became of the recording", "int",
            flags={
                "calibrated": ESTIMATED,
                "not_calibrated": NOT_ESTIMATED,
                "not_simulated": NOT_SIMULATED,
            },
        ),
        Variable("message", "recording", None, "why there is no calibration", "text"),
        Variable("median_error", "parameter", "1", "median of the size of the error"),
        Variable(
            "determined_median_error", "parameter", "1",
            "median of the size of the error where the parameter is determined",
        ),
        Variable(
            "determined_share", "parameter", "1",
            "share of the calibrations that determine the parameter",
        ),
        Variable("coverage", "parameter", "1", "share of the intervals that hold the truth"),
        Variable(
            "coverage_standard_error", "parameter", "1", "standard error of the coverage",
            note="binomial, of intervals that hold the truth as often as their confidence says",
        ),
        Variable("range", _ENDS, None, "range of the search", note=_WITHOUT),
        Variable("unit", "parameter", None, "unit of the parameter", "text"),
        Variable("scale", "parameter", None, "scale of the parameter: linear or log", "text"),
        Variable("meaning", "parameter", None, "what the parameter is", "text"),
        Variable("recording", "recording", None, "number of the recording", "int"),
        Variable("parameter", "parameter", None, "parameter", "text"),
        Variable("bound", "bound", None, "end of an interval", "text"),
    ),
    attributes=(
        Attribute("model", "text", "name of the model"),
        Attribute("fixed", "object", "known values of the model's other numbers, SI units"),
        Attribute("duration_s", "number", "length of each recording"),
        Attribute("sample_rate_Hz", "number", "samples of each recording per second"),
        _MISSING_SHARE,
        Attribute("position_noise_m", "number", "true noise of the recorded positions"),
        Attribute("noise", "text", "whether the calibrations estimated it: estimated, or known"),
        Attribute("confidence", "number", "of the intervals"),
        _SEED,
        ARENA,
        SOURCE,
        STUDY,
    ),
)  # fmt: skip

KINDS: Final = (RECOVERY, MODEL_RECOVERY)
