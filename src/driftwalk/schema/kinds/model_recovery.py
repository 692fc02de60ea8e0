"""The dataset of a recovery study of a motion model: recordings of known truth, calibrated."""

from __future__ import annotations

from typing import Final

from driftwalk.schema.description import ARENA, SOURCE, STUDY, Attribute, Kind, Variable

CALIBRATED_STATUS: Final = {"calibrated": 0, "not_calibrated": 1, "not_simulated": 2}
"""Status of a recording; those that have no calibration have a message."""

_EACH: Final = "recording parameter"
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
        Variable("estimate", _EACH, None, "estimate of the parameter", note=_WITHOUT),
        Variable(
            "interval", f"{_EACH} bound", None, "interval of the parameter",
            note="NaN where the calibration gives none",
        ),
        Variable(
            "determined", _EACH, None, "whether the recording determines the parameter", "bool",
            note="within 15 % of its value, with 90 % confidence",
        ),
        Variable(
            "half_width", _EACH, "1", "half the 90 % interval over the value",
            note="of its logarithm on a logarithmic scale; infinite at the end of its range",
        ),
        Variable(
            "error", _EACH, "1", "relative error of the estimate",
            note="ln(estimate / truth) on a logarithmic scale; on a linear one over the truth, or "
            "over a twentieth of the range where the truth is smaller",
        ),
        Variable(
            "error_interval", f"{_EACH} bound", "1", "ends of the interval, as errors",
            note="it holds the truth where 0 lies between them",
        ),
        Variable(
            "status", "recording", None, "what became of the recording", "int",
            flags=CALIBRATED_STATUS,
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
        Variable("range", f"{_EACH} bound", None, "range of the search", note=_WITHOUT),
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
        Attribute("missing_share", "number", "share of the samples that is missing"),
        Attribute("position_noise_m", "number", "true noise of the recorded positions"),
        Attribute("noise", "text", "whether the calibrations estimated it: estimated, or known"),
        Attribute("confidence", "number", "of the intervals"),
        Attribute("seed", "number", "seed of the random numbers"),
        ARENA,
        SOURCE,
        STUDY,
    ),
)  # fmt: skip

KINDS: Final = (MODEL_RECOVERY,)
