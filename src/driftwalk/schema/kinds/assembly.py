"""Datasets of runs of many blocks: the runs themselves, their outcomes, their courses in time."""

from __future__ import annotations

from typing import Final

from driftwalk.schema.description import ARENA, SOURCE, STUDY, Attribute, Kind, Variable
from driftwalk.schema.kinds.flow_series import FLOW_SERIES, began_in_flow
from driftwalk.schema.kinds.motion import WORLD_STATUS

_LAW: Final = "drawn from a fit whose force law has it"
_CONNECTOR: Final = "latching by a connector"
SETTINGS: Final = (
    Attribute("blocks", "number", "blocks in the tank"),
    Attribute("runs", "number", "simulated worlds"),
    Attribute("duration_s", "number", "length of a run at most"),
    Attribute("seed", "number", "seed of the random numbers"),
    Attribute("trial", "number", "address of the random numbers"),
    Attribute("chirality", "text", "whether mirror images are one class"),
    Attribute("latching", "text", "when two blocks latch"),
    Attribute("connector_distance_m", "number", "tolerance of the connector", _CONNECTOR),
    Attribute("connector_axis_rad", "number", "tolerance of the connector", _CONNECTOR),
    Attribute("connector_rotation_rad", "number", "tolerance of the connector", _CONNECTOR),
    Attribute("hidden_face_drag", "text", "drag on joined faces"),
    Attribute("block_restitution", "number", "of collisions"),
    Attribute("block_friction", "number", "of collisions"),
    Attribute("block_side_m", "number", "side of a block"),
    ARENA,
    Attribute("force_interval_s", "number", "how long a force lasts"),
    Attribute("time_step_s", "number", "step of the integrator"),
    Attribute("backend", "text", "what computed it"),
    STUDY,
    *FLOW_SERIES,
)
_CLASS: Final = Variable(
    "class", "class", None, "outcome class", "text",
    note="[names](../explanation/assembly.md#outcome-classes)",
)  # fmt: skip
_ORDER: Final = "first of the assembly that stayed, then of the one that was moved"
_FACES: Final = "faces that joined, in the blocks' own frames: 0 +x, 1 +y, 2 -x, 3 -y"
_LOWEST: Final = "assembly of the block, as its lowest block"
_NOWHERE: Final = "-1 where there is none"

ASSEMBLY: Final = Kind(
    name="assembly",
    version=1,
    dimensions={
        "run": "simulated worlds",
        "event": "joinings in a run, in order; one less than there are blocks, at least one",
        "side": "of the assembly that stayed, of the one that was moved",
        "part": "stayed, moved, became",
        "block": "blocks",
        "axis": "x, y",
        "class": "every class up to 8 blocks, beyond that those that occurred",
        "shape": "polyominoes",
    },
    variables=(
        Variable(
            "outcome", "run", None, "outcome class at the end, -1 for none: index into 'class'",
            "int",
        ),
        Variable("event_count", "run", "1", "number of joinings", "int"),
        Variable(
            "event_time", "run event", "s", "time of the joining",
            note="end of the step; NaN where there is none",
        ),
        Variable(
            "event_block", "run event side", None, f"blocks whose faces joined, {_ORDER}", "int",
            note=_NOWHERE,
        ),
        Variable("event_face", "run event side", None, _FACES, "int", note=_NOWHERE),
        Variable(
            "event_assembly", "run event side", None,
            f"lowest block of the assemblies that joined, {_ORDER}", "int", note=_NOWHERE,
        ),
        Variable(
            "event_shape", "run event part", None,
            "shapes of the assembly that stayed, of the one moved, of both joined: "
            "index into 'shape'", "int", note=_NOWHERE,
        ),
        Variable(
            "event_class", "run event", None,
            "outcome class of the whole world after the joining: index into 'class'", "int",
            note=_NOWHERE,
        ),
        Variable(
            "first_contact_time", "run", "s", "time of the first contact of blocks",
            note="NaN where it did not happen",
        ),
        Variable(
            "completion_time", "run", "s", "time at which all blocks had become one assembly",
            note="NaN where it did not happen",
        ),
        Variable("end_time", "run", "s", "time at which the run stopped"),
        Variable("x", "run block", "m", "position x of the block's centre", note="at the end"),
        Variable("y", "run block", "m", "position y of the block's centre", note="at the end"),
        Variable(
            "theta", "run block", "rad", "orientation of the block, counter-clockwise from x",
            note="at the end",
        ),
        Variable(
            "cell", "run block axis", None, "cell of the block on its assembly's lattice, x and y",
            "int",
        ),
        Variable(
            "quarter", "run block", None, "quarter turns of the block against its assembly", "int"
        ),
        Variable("assembly", "run block", None, _LOWEST, "int"),
        Variable("drag_coefficient", "run", "1", "drag coefficient"),
        Variable("force_std", "run", "N", "standard deviation of the force"),
        Variable("linear_drag", "run", "kg s-1", "linear drag of the block", when=_LAW),
        Variable("drag_power", "run", "1", "power of the speed in the drag", when=_LAW),
        Variable("force_memory", "run", "s", "correlation time of the force", when=_LAW),
        Variable(
            "flow_draw", "run", None, "which drawn flow field the run had", "int",
            when="flow fields were drawn",
        ),
        began_in_flow("run"),
        Variable(
            "status", "run", None, "problems in a run", "int", note="0 is sound",
            flags=WORLD_STATUS, bits=True,
        ),
        Variable("run", "run", None, "run", "int"),
        Variable("block", "block", None, "block", "int"),
        _CLASS,
        Variable("shape", "shape", None, "shape of an assembly", "text"),
    ),
    attributes=(
        *SETTINGS,
        Attribute("drawn", "text", 'what was drawn for each run, or "no"', "made by a run"),
    ),
)  # fmt: skip

_PATH: Final = "run time block"

ASSEMBLY_PATH: Final = Kind(
    name="assembly_path",
    version=1,
    dimensions={"run": "chosen runs", "time": "samples", "block": "blocks"},
    variables=(
        Variable("x", _PATH, "m", "position x of the block's centre"),
        Variable("y", _PATH, "m", "position y of the block's centre"),
        Variable("theta", _PATH, "rad", "orientation of the block, counter-clockwise from x"),
        Variable("assembly", _PATH, None, _LOWEST, "int"),
        Variable("run", "run", None, "run", "int"),
        Variable("time", "time", "s", "time from the start of the run"),
        Variable("block", "block", None, "block", "int"),
    ),
    attributes=(*SETTINGS, Attribute("sample_interval_s", "number", "time between samples")),
    read="x y theta run time block",
    read_attributes="block_side_m",
)

_OF_RUNS: Final = "made from runs"
_SETTINGS_OF_RUNS: Final = tuple(
    Attribute(one.name, one.says, one.meaning, one.when or _OF_RUNS)
    for one in SETTINGS
    if one.name != "runs"
)
_REALISED: Final = "the reference of a sensitivity analysis"

OUTCOME_DISTRIBUTION: Final = Kind(
    name="outcome_distribution",
    version=1,
    dimensions={
        "class": "outcome classes",
        "realisation": "realisations of the reference",
        "time": "from the start of the runs to their end",
        "class_over_time": "classes that occur",
    },
    variables=(
        Variable("count", "class", "1", "runs of this class", "int"),
        Variable("proportion", "class", "1", "share of runs"),
        Variable(
            "interval_low", "class", "1", "lower limit of the simultaneous confidence interval"
        ),
        Variable(
            "interval_high", "class", "1", "upper limit of the simultaneous confidence interval"
        ),
        _CLASS,
        Variable(
            "realisation_count", "realisation class", "1", "runs of this class", "int",
            when=_REALISED,
        ),
        Variable(
            "realisation_proportion", "realisation class", "1", "share of runs", when=_REALISED
        ),
        Variable(
            "standard_deviation", "class", "1",
            "standard deviation of the share over realisations", when=_REALISED,
        ),
        Variable(
            "count_over_time", "time class_over_time", "1", "runs of this class at this time",
            "int", when=_REALISED, note="of all realisations",
        ),
        Variable("time", "time", "s", "time from the start of the run", when=_REALISED),
        Variable(
            "class_over_time", "class_over_time", None, "outcome class", "text", when=_REALISED
        ),
    ),
    attributes=(
        Attribute("runs", "number", "runs with an outcome"),
        Attribute("left_out", "number", "runs without an outcome", _OF_RUNS),
        Attribute("confidence", "number", "with which all intervals hold at once"),
        Attribute("method", "text", "of the intervals"),
        Attribute("complete", "number", "share of runs with one assembly"),
        Attribute("complete_low", "number", "lower end of its interval"),
        Attribute("complete_high", "number", "upper end of its interval"),
        Attribute("time_s", "number", "when the outcomes were read", _OF_RUNS),
        Attribute("realisations", "number", "realisations", _REALISED),
        Attribute("mean_pairwise_l1", "number", "mean l1 distance of two", _REALISED),
        Attribute("expected_pairwise_l1", "number", "what chance alone gives", _REALISED),
        Attribute("drag_coefficient", "number", "of the reference", _REALISED),
        Attribute("force_std_N", "number", "of the reference", _REALISED),
        Attribute("drawn", "text", "as of the runs", _OF_RUNS),
        *_SETTINGS_OF_RUNS,
    ),
)  # fmt: skip


def _course(name: str, words: str) -> tuple[Variable, ...]:
    return (
        Variable(name, "time", "1", f"share of runs before {words}"),
        Variable(f"{name}_low", "time", "1", f"lower limit, share before {words}"),
        Variable(f"{name}_high", "time", "1", f"upper limit, share before {words}"),
    )


def _medians(name: str, words: str) -> tuple[Attribute, ...]:
    return (
        Attribute(f"{name}_median_s", "number", f"median time of {words}, NaN when not reached"),
        Attribute(f"{name}_median_low_s", "number", "lower end of its interval"),
        Attribute(f"{name}_median_high_s", "number", "upper end of its interval"),
    )


CLASS_TIMES: Final = Kind(
    name="class_times",
    version=1,
    dimensions={"time": "from the start of the runs", "class": "outcome classes"},
    variables=(
        Variable("proportion", "time class", "1", "share of runs"),
        Variable("proportion_low", "time class", "1", "lower limit of the share of runs"),
        Variable("proportion_high", "time class", "1", "upper limit of the share of runs"),
        *_course("first_contact", "first contact"),
        *_course("completion", "completion"),
        Variable("time", "time", "s", "time from the start of the run"),
        _CLASS,
    ),
    attributes=(
        Attribute("runs", "number", "runs with an outcome"),
        Attribute("left_out", "number", "runs without an outcome"),
        Attribute("confidence", "number", "with which an interval holds at its time"),
        *_medians("first_contact", "first contact"),
        *_medians("completion", "completion"),
        Attribute("drawn", "text", "as of the runs", _OF_RUNS),
        *_SETTINGS_OF_RUNS,
    ),
)


_ONE_RUN: Final = "NaN of a single run"


def _mean(name: str, dim: str, unit: str, words: str, note: str = "") -> tuple[Variable, ...]:
    return (
        Variable(name, dim, unit, f"{words}, mean over runs", note=note),
        Variable(f"{name}_low", dim, unit, f"lower limit, {words}", note=_ONE_RUN),
        Variable(f"{name}_high", dim, unit, f"upper limit, {words}", note=_ONE_RUN),
    )


ASSEMBLY_SIZES: Final = Kind(
    name="assembly_sizes",
    version=1,
    dimensions={
        "size": "sizes: each up to 8 alone, beyond that groups that double",
        "time": "from the start of the runs",
    },
    variables=(
        *_mean("number", "size", "1", "assemblies of this size per run", note="at the end"),
        *_mean(
            "block_share", "size", "1", "share of the blocks in assemblies of this size",
            note="at the end",
        ),
        *_mean("mean_size", "time", "1", "blocks over assemblies"),
        *_mean("largest_share", "time", "1", "share of the blocks in the largest assembly"),
        *_mean("free_share", "time", "1", "share of the blocks that are alone"),
        Variable("size", "size", None, "smallest size of the group, in blocks", "int"),
        Variable("size_to", "size", None, "largest size of the group, in blocks", "int"),
        Variable("time", "time", "s", "time from the start of the run"),
    ),
    attributes=(
        Attribute("runs", "number", "runs with an outcome"),
        Attribute("left_out", "number", "runs without an outcome"),
        Attribute("confidence", "number", "with which an interval holds, each on its own"),
        Attribute("method", "text", "of the intervals"),
        Attribute(
            "compactness", "number",
            "least perimeter over that of the assembly, of assemblies of four blocks and more, "
            "weighted by blocks; mean over runs, NaN where there are none",
        ),
        Attribute("compactness_low", "number", "lower end of its interval"),
        Attribute("compactness_high", "number", "upper end of its interval"),
        Attribute("compactness_runs", "number", "runs with an assembly of four blocks or more"),
        Attribute("drawn", "text", "as of the runs", _OF_RUNS),
        *_SETTINGS_OF_RUNS,
    ),
)  # fmt: skip


def _joins(name: str, of: str, *, faces: str) -> tuple[Variable, ...]:
    """Return what is known of the joinings, or of what came apart."""
    return (
        Variable(f"{name}_count", "", "1", f"number of {of}", "int"),
        Variable(f"{name}_time", name, "s", f"time of the {of}", note="NaN where there is none"),
        Variable(f"{name}_block", f"{name} side", None, f"blocks, {of}", "int", note=_NOWHERE),
        Variable(f"{name}_face", f"{name} side", None, faces, "int", note=_NOWHERE),
        Variable(
            f"{name}_class", name, None,
            f"outcome class after the {of}: index into 'class'", "int", note=_NOWHERE,
        ),
    )  # fmt: skip


_OBSERVED: Final = "made by observe"

CLASSIFICATION: Final = Kind(
    name="classification",
    version=1,
    dimensions={
        "time": "samples of the recording",
        "body": "bodies, by name",
        "event": "joinings, at least one",
        "split": "partings, at least one",
        "side": "the two blocks",
        "part": "stayed, moved, became",
        "class": "outcome classes",
        "shape": "polyominoes",
    },
    variables=(
        Variable(
            "outcome", "time", None, "outcome class, -1 unknown", "int", note="index into 'class'"
        ),
        Variable(
            "assembly", "time body", None, "lowest body of the assembly, -1 unknown", "int"
        ),
        Variable("proportion", "class", "1", "share of the time in which the class is known"),
        *_joins("event", "joinings", faces=_FACES),
        Variable(
            "event_assembly", "event side", None, "lowest body of the assemblies that joined",
            "int", note=_NOWHERE,
        ),
        Variable(
            "event_shape", "event part", None,
            "shapes of the two assemblies and of both joined: index into 'shape'", "int",
            note=_NOWHERE,
        ),
        *_joins("split", "partings", faces="faces that came apart, as those that join"),
        Variable(
            "possible", "time class", None, "whether the class is possible", "bool",
            when=_OBSERVED, note="none at all: nothing is known",
        ),
        Variable(
            "hidden", "time", "1", "number of blocks that are hidden", "int", when=_OBSERVED
        ),
        Variable("time", "time", "s", "time"),
        Variable("body", "body", None, "body", "text"),
        _CLASS,
        Variable("shape", "shape", None, "shape", "text"),
    ),
    attributes=(
        Attribute("source", "text", SOURCE.meaning, "the recording says so"),
        Attribute("arena", "object", ARENA.meaning, "the tank is known"),
        Attribute("blocks", "number", "bodies of the recording"),
        Attribute("chirality", "text", "whether mirror images are one class"),
        Attribute("block_side_m", "number", "side of a block"),
        Attribute("join_distance_m", "number", "how near faces come to be joined"),
        Attribute("join_angle_rad", "number", "how parallel faces are when joined"),
        Attribute("release_distance_m", "number", "how far faces go when they part"),
        Attribute("release_angle_rad", "number", "how far faces turn when they part"),
        Attribute("min_duration_s", "number", "how long a joining lasts at least"),
        Attribute("hold_s", "number", "how long a pose holds without a sample"),
        Attribute("dropped_joins", "number", "joinings that contradict others"),
        Attribute("closest_m", "number", "smallest distance of two centres"),
        Attribute("unknown_samples", "number", "samples of unknown class"),
        Attribute("known_s", "number", "time in which the class is known"),
    ),
)  # fmt: skip

KINDS: Final = (
    ASSEMBLY, ASSEMBLY_PATH, OUTCOME_DISTRIBUTION, CLASS_TIMES, ASSEMBLY_SIZES, CLASSIFICATION
)  # fmt: skip
