"""The dataset that says which values of many parameters fit a recording, and how well."""

from __future__ import annotations

from typing import Final

from driftwalk.schema.description import ARENA, SIMULATED, SOURCE, Attribute, Kind, Variable

_SEARCHED: Final = "the model was searched"
_MATCHED: Final = "summaries were matched"
_PROFILED: Final = f"{_MATCHED} and no states changed places"

MODEL_CALIBRATION: Final = Kind(
    name="model_calibration",
    version=1,
    dimensions={
        "parameter": "parameters of the model",
        "bound": "lower and upper end",
        "draw": "settings that could have given the recording",
        "profile_point": "values along a parameter",
        "aspect": "aspects of the motion, by name",
        "check": "facts of the motion that no model is fitted to",
        "warning": "sentences",
    },
    variables=(
        Variable("estimate", "parameter", None, "value of the parameter", note="in its unit"),
        Variable(
            "interval", "parameter bound", None, "interval of the parameter",
            note="NaN where the estimate is the search's",
        ),
        Variable(
            "determined", "parameter", None, "whether the recording determines the parameter",
            "bool", note="within 15 % of its value, with 90 % confidence",
        ),
        Variable(
            "half_width", "parameter", "1", "half the 90 % interval over the value",
            note="of its logarithm on a logarithmic scale; NaN as the interval",
        ),
        Variable(
            "searched_estimate", "parameter", None, "answer of the search by KS distances",
            when=_SEARCHED,
        ),
        Variable("draws", "draw parameter", None, "values that could have given the recording",
            note="a sample of an approximate posterior with even priors on the scales",
            when=_MATCHED,
        ),
        Variable(
            "profile_value", "parameter profile_point", None, "value of the parameter",
            note="in its unit", when=_PROFILED,
        ),
        Variable(
            "profile_misfit", "parameter profile_point", "1",
            "rise of the misfit there, the others at their best",
            note="over the square of the factor by which intervals are widened", when=_PROFILED,
        ),
        Variable("range", "parameter bound", None, "range of the search"),
        Variable("unit", "parameter", None, "unit of the parameter", "text"),
        Variable("scale", "parameter", None, "scale of the parameter: linear or log", "text"),
        Variable("meaning", "parameter", None, "what the parameter is", "text"),
        Variable(
            "held_out_distance", "aspect", "1", "KS distance",
            note="odd blocks of time, by the answer for the even ones",
        ),
        Variable("trained_distance", "aspect", "1", "KS distance", note="even blocks"),
        Variable(
            "own_distance", "aspect", "1", "KS distance of the recording's own parts",
            note="mean over parts of interleaved blocks",
        ),
        Variable(
            "floor", "aspect", "1", "distance of the recording from itself",
            note="between random halves of its odd blocks, over √2",
        ),
        Variable("check_recorded", "check", None, "fact of the recording"),
        Variable("check_median", "check", None, "fact of the model, median of its worlds"),
        Variable("check_low", "check", None, "smallest of its worlds"),
        Variable("check_high", "check", None, "largest of its worlds"),
        Variable("check_unit", "check", None, "unit of the fact", "text"),
        Variable("score", "", "1", "mean over the aspects of distance over floor", note="held out"),
        Variable("score_std", "", "1", "its standard error", note="from leaving blocks out"),
        Variable(
            "searched_score", "", "1", "score of the search's answer", note="even blocks",
            when=_SEARCHED,
        ),
        Variable(
            "matched_score", "", "1", "score of the answer of the summaries", note="even blocks",
            when=_MATCHED,
        ),
        Variable(
            "misfit", "", "1", "sum of the squares of the summaries' deviations",
            note="in standard deviations, correlations taken into account", when=_MATCHED,
        ),
        Variable(
            "usual_misfit", "", "1", "its median over simulated recordings of the model",
            when=_MATCHED,
        ),
        Variable("most_misfit", "", "1", "its 95 % quantile over these", when=_MATCHED),
        Variable(
            "interval_stretch", "", "1", "factor by which the draws are spread for the misfit",
            when=_MATCHED,
        ),
        Variable("explained", "", None, "whether the model explains the recording", "bool"),
        Variable("verdict", "", None, "where the model is farther than the recording", "text"),
        Variable("warning", "warning", None, "warning", "text"),
        Variable("parameter", "parameter", None, "parameter", "text"),
        Variable("bound", "bound", None, "end of an interval", "text"),
        Variable("aspect", "aspect", None, "aspect of the motion", "text"),
        Variable("check", "check", None, "fact of the motion", "text"),
    ),
    attributes=(
        Attribute("model", "text", "name of the model"),
        Attribute("estimate_from", "text", "stage of the estimate: summaries, or search"),
        Attribute("fixed", "object", "known values of the model's other numbers, SI units"),
        Attribute("confidence", "number", "of the intervals"),
        Attribute("step_interval_s", "number", "time between the positions of a step"),
        Attribute("duration_s", "number", "length of the recording"),
        Attribute("position_noise_m", "number", "noise of the recorded positions"),
        Attribute("worlds", "number", "worlds by which the model is judged"),
        Attribute("seed", "number", "seed of the random numbers"),
        ARENA,
        SOURCE,
        SIMULATED,
    ),
)  # fmt: skip

KINDS: Final = (MODEL_CALIBRATION,)
"""A calibration of more than two parameters: no map can be laid over them."""
