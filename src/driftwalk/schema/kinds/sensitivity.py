"""Datasets of many settings of self-assembly: the map, its components, the Sobol' indices."""

from __future__ import annotations

from typing import Final

from driftwalk.schema.description import STUDY, Attribute, Kind, Variable
from driftwalk.schema.kinds.assembly import SETTINGS

_AXES: Final = {
    "drag_coefficient": "settings, where it varies",
    "force_std": "settings, where it varies",
    "tank_diameter": "settings, where it varies",
    "blocks": "settings, where it varies",
    "flow": "settings, where it varies",
    "latching": "settings, where it varies",
    "hidden_face_drag": "settings, where it varies",
}
AXES: Final = (
    Variable("drag_coefficient", "drag_coefficient", "1", "drag coefficient", when="an axis"),
    Variable("force_std", "force_std", "N", "standard deviation of the force", when="an axis"),
    Variable("tank_diameter", "tank_diameter", "m", "diameter of the tank", when="an axis"),
    Variable("blocks", "blocks", "1", "number of blocks", "int", when="an axis"),
    Variable("flow", "flow", None, "flow field", "text", when="an axis"),
    Variable("latching", "latching", None, "when two blocks latch", "text", when="an axis"),
    Variable(
        "hidden_face_drag", "hidden_face_drag", None, "drag on joined faces", "text", when="an axis"
    ),
)
"""Quantities that may vary over a map."""
_NO_AXIS: Final = "it does not vary"
_SETTINGS: Final = tuple(
    Attribute(one.name, one.says, one.meaning, one.when or _NO_AXIS)
    for one in SETTINGS
    if one.name not in ("trial", "study")
)
_TIMES: Final = "the reference was given with times"
_KNOWN: Final = "the reference says so"
_REFERENCE: Final = (
    Attribute("reference_runs", "number", "runs of the reference"),
    Attribute("reference_blocks", "number", "blocks of the reference", _KNOWN),
    Attribute("reference_latching", "text", "latching of the reference", _KNOWN),
    Attribute("reference_hidden_face_drag", "text", "hidden faces of the reference", _KNOWN),
    Attribute("reference_drag_coefficient", "number", "where the reference lies", _KNOWN),
    Attribute("reference_force_std_N", "number", "where the reference lies", _KNOWN),
    Attribute("reference_tank_diameter_m", "number", "where the reference lies", _KNOWN),
    Attribute("reference_realisations", "number", "realisations of the reference", _KNOWN),
    Attribute("reference_mean_pairwise_l1", "number", "mean l1 distance of two of them", _KNOWN),
    Attribute("reference_expected_pairwise_l1", "number", "what chance alone gives", _KNOWN),
)
_CLASS: Final = Variable("class", "class", None, "outcome class", "text")

SENSITIVITY: Final = Kind(
    name="sensitivity",
    version=1,
    dimensions={
        **_AXES,
        "class": "outcome classes",
        "time": "from the start of the runs to their end",
        "class_over_time": "classes with the largest share at some time, and the rest",
    },
    variables=(
        Variable("count", "... class", "1", "runs of this class", "int"),
        Variable("proportion", "... class", "1", "share of runs"),
        Variable("runs", "...", "1", "runs with an outcome", "int"),
        Variable("left_out", "...", "1", "runs without an outcome", "int"),
        Variable("complete", "...", "1", "share of runs with one assembly"),
        Variable(
            "first_contact_median", "...", "s", "median of first contact",
            note="NaN when not reached",
        ),
        Variable(
            "completion_median", "...", "s", "median of completion", note="NaN when not reached"
        ),
        Variable("l1_distance", "...", "1", "l1 distance to the reference"),
        Variable("l1_in_floors", "...", "1", "l1 distance divided by that of chance alone"),
        Variable(
            "trial", "...", "1", "address of the random numbers", "int",
            note="pass it to `assemble` to simulate the setting again",
        ),
        Variable("reference", "class", "1", "share in the reference"),
        Variable(
            "count_over_time", "... time class_over_time", "1", "runs of this class at this time",
            "int",
        ),
        Variable(
            "reference_over_time", "time class_over_time", "1",
            "share in the reference at this time", when=_TIMES,
        ),
        *AXES,
        _CLASS,
        Variable("time", "time", "s", "time from the start of the run"),
        Variable("class_over_time", "class_over_time", None, "outcome class", "text"),
    ),
    attributes=(
        *_REFERENCE,
        Attribute("noise_floor_mean", "number", "distance that the reference itself would have"),
        Attribute("noise_floor_95", "number", "its 95 % quantile"),
        *_SETTINGS,
        STUDY,
    ),
)  # fmt: skip

COMPONENTS: Final = Kind(
    name="components",
    version=1,
    dimensions={
        **_AXES,
        "class": "outcome classes",
        "component": "principal components, counted from 1",
    },
    variables=(
        Variable("score", "... component", "1", "score of the setting"),
        Variable("loading", "class component", "1", "loading of the class"),
        Variable(
            "explained_variance_ratio", "component", "1", "share of the variance over settings"
        ),
        Variable(
            "complete_correlation", "component", "1",
            "correlation of the score with the share of complete runs",
        ),
        Variable("mean", "class", "1", "mean proportion over settings"),
        *AXES,
        _CLASS,
        Variable("component", "component", "1", "component", "int"),
    ),
    attributes=(
        Attribute("settings", "number", "settings that were decomposed"),
        Attribute("left_out", "number", "settings that were left out"),
        Attribute("total_variance", "number", "over the settings, of all classes"),
        Attribute("noise_share", "number", "share of it that is sampling noise"),
        *(
            Attribute(one.name, one.says, one.meaning, "decomposed from a map that says so")
            for one in SENSITIVITY.attributes
        ),
    ),
)  # fmt: skip

_DESIGN: Final = (
    ("value", "setting input", "value of the input"),
    ("low", "input", "lowest value"),
    ("high", "input", "highest value"),
)

SOBOL_DESIGN: Final = Kind(
    name="sobol_design",
    version=1,
    dimensions={"setting": "settings, in an order that matters", "input": "inputs, by name"},
    variables=(
        *(Variable(name, dims, None, words) for name, dims, words in _DESIGN),
        Variable("input", "input", None, "input", "text"),
    ),
    attributes=(
        Attribute("samples", "number", "samples of the design, a power of two"),
        Attribute("seed", "number", "seed of the scrambling"),
    ),
)


def _index(name: str, words: str) -> tuple[Variable, ...]:
    on = "... input"
    return (
        Variable(name, on, "1", words),
        Variable(f"{name}_half_width", on, "1", "half width of its confidence interval"),
        Variable(f"{name}_corrected", on, "1", f"{words} without sampling noise"),
    )


_SIMULATED: Final = "made by sensitivity_indices"

SOBOL_INDICES: Final = Kind(
    name="sobol_indices",
    version=1,
    dimensions={
        "output": "outputs, by name; or whatever the given outputs lie along, as they name it",
        "input": "inputs, by name",
        "setting": "settings of the design",
    },
    variables=(
        *_index("first_order", "first order Sobol' index"),
        *_index("total_order", "total order Sobol' index"),
        Variable("variance", "...", None, "variance over the design", note="squared output"),
        Variable("noise_share", "...", "1", "share of the variance that is sampling noise"),
        Variable("input", "input", None, "input", "text"),
        Variable("proportion", "setting output", "1", "share of runs", when=_SIMULATED),
        *(Variable(name, dims, None, words, when=_SIMULATED) for name, dims, words in _DESIGN),
    ),
    attributes=(
        Attribute("samples", "number", "samples of the design"),
        Attribute("confidence", "number", "of the half widths"),
        Attribute("seed", "number", "seed of the bootstrap"),
        Attribute("pure_noise_first_order_half_width", "number", "what pure noise would have"),
        Attribute("pure_noise_total_order", "number", "what pure noise would have"),
        Attribute("runs", "number", "runs of each setting", _SIMULATED),
        Attribute("left_out", "number", "runs without an outcome", _SIMULATED),
        Attribute("blocks", "number", "blocks in the tank", _SIMULATED),
        Attribute("input_units", "text", "units of the inputs, in their order", _SIMULATED),
        Attribute("study", "text", STUDY.meaning, _SIMULATED),
    ),
)

KINDS: Final = (SENSITIVITY, COMPONENTS, SOBOL_DESIGN, SOBOL_INDICES)
