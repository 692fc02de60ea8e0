"""The dataset that says which motion models explain a recording."""

from __future__ import annotations

from typing import Final

from driftwalk.schema.description import ARENA, SIMULATED, SOURCE, Attribute, Kind, Variable

_HELD: Final = "odd blocks of time, which no model has seen"
_TIED: Final = "of two models or more"

MODEL_COMPARISON: Final = Kind(
    name="model_comparison",
    version=1,
    dimensions={
        "model": "motion models, from the closest to the farthest",
        "aspect": "aspects of the motion, by name",
        "check": "facts of the motion that no model is fitted to",
        "parameter": "parameters of all the models",
        "end": "searches: the short ones, and the long one",
        "finding": "sentences",
        "warning": "sentences",
    },
    variables=(
        Variable(
            "score", "model", "1", "mean over the aspects of distance over floor", note=_HELD
        ),
        Variable("score_std", "model", "1", "its standard error", note="from leaving blocks out"),
        Variable("behind", "model", "1", "score above that of the first model"),
        Variable("behind_std", "model", "1", "its standard error"),
        Variable("free_numbers", "model", None, "numbers that were fitted", "int"),
        Variable(
            "baseline", "model", None, "whether it is a walk of recorded steps, never explained",
            "bool",
        ),
        Variable("explained", "model", None, "whether the model explains the recording", "bool"),
        Variable("verdict", "model", None, "where the model is farther than the recording", "text"),
        Variable("held_out_distance", "model aspect", "1", "KS distance", note=_HELD),
        Variable("trained_distance", "model aspect", "1", "KS distance", note="even blocks"),
        Variable(
            "own_distance", "aspect", "1", "KS distance of the recording's own parts",
            note="mean over parts of interleaved blocks",
        ),
        Variable(
            "floor", "aspect", "1", "distance of the recording from itself",
            note="between random halves of its odd blocks, over √2",
        ),
        Variable("check_recorded", "check", None, "fact of the recording"),
        Variable("check_median", "model check", None, "fact of the model, median of its worlds"),
        Variable("check_low", "model check", None, "smallest of its worlds"),
        Variable("check_high", "model check", None, "largest of its worlds"),
        Variable("check_unit", "check", None, "unit of the fact", "text"),
        Variable(
            "estimate", "model parameter", None, "value of the parameter",
            note="NaN where the model has no such parameter",
        ),
        Variable("parameter_unit", "parameter", None, "unit of the parameter", "text"),
        Variable("end_score", "model end", "1", "score at the end of a search", note="even blocks"),
        Variable("evaluations", "model", None, "settings that were simulated", "int"),
        Variable(
            "asked", "model", None, "whether the summaries of the motion were matched", "bool",
            when=_TIED,
        ),
        Variable(
            "named", "model", None, "whether the summaries of the motion speak for the model",
            "bool", when=_TIED,
        ),
        Variable(
            "misfit", "model", "1", "sum of squares of the deviations of the summaries",
            when=_TIED, note="in standard deviations; NaN where it was not asked",
        ),
        Variable(
            "usual_misfit", "model", "1", "its median over the model's own recordings", when=_TIED
        ),
        Variable("most_misfit", "model", "1", "its 99 % quantile over them", when=_TIED),
        Variable(
            "unlikely", "model", "1", "-2 log of the evidence of the summaries", when=_TIED,
            note="but for a constant that all models share",
        ),
        Variable("finding", "finding", None, "answer", "text"),
        Variable("warning", "warning", None, "warning", "text"),
        Variable("model", "model", None, "motion model", "text"),
        Variable("aspect", "aspect", None, "aspect of the motion", "text"),
        Variable("check", "check", None, "fact of the motion", "text"),
        Variable("parameter", "parameter", None, "parameter", "text"),
    ),
    attributes=(
        Attribute("step_interval_s", "number", "time between the positions of a step"),
        Attribute("duration_s", "number", "length of the recording"),
        Attribute("worlds", "number", "worlds by which each model is judged"),
        Attribute("seed", "number", "seed of the random numbers"),
        Attribute(
            "halves_ks_distance", "number", "KS distance of the first half's steps to the second's",
            "200 pairs of steps or more",
        ),
        Attribute(
            "halves_p_value", "number", "share of random halves that differ as much",
            "200 pairs of steps or more",
        ),
        ARENA,
        SOURCE,
        SIMULATED,
    ),
)  # fmt: skip

KINDS: Final = (MODEL_COMPARISON,)
