"""What many blocks build, with what certainty, and how much that depends on the model."""

from driftwalk.assemble.classify import classify
from driftwalk.assemble.components import Alignment, disconnected_alignment, principal_components
from driftwalk.assemble.distribution import (
    outcome_distribution,
    proportion_interval,
    sampling_variance,
)
from driftwalk.assemble.events import ReplayedEvents, class_at, replay_events
from driftwalk.assemble.l1 import (
    L1NoiseFloor,
    PairwiseL1,
    l1_distance,
    l1_in_floors,
    l1_noise_floor,
    pairwise_l1,
)
from driftwalk.assemble.live_world import LiveEvent, LiveTank
from driftwalk.assemble.outcome import (
    class_cells,
    class_name,
    class_shapes,
    merge_chirality,
    outcome_classes,
    sort_classes,
    world_class,
)
from driftwalk.assemble.parameters import draw_parameters
from driftwalk.assemble.path_recording import path_recording
from driftwalk.assemble.polyomino import polyomino_cells, polyomino_name, polyominoes
from driftwalk.assemble.run import assemble, assemble_drawn, assembly_path, check_assembly
from driftwalk.assemble.sensitivity import (
    check_sensitivity,
    sensitivity_map,
    sensitivity_reference,
)
from driftwalk.assemble.sensitivity_indices import check_indices, sensitivity_indices
from driftwalk.assemble.sobol import sobol_design, sobol_indices
from driftwalk.assemble.survival import SurvivalCurve, class_times, survival_curve

__all__ = [
    "Alignment",
    "L1NoiseFloor",
    "LiveEvent",
    "LiveTank",
    "PairwiseL1",
    "ReplayedEvents",
    "SurvivalCurve",
    "assemble",
    "assemble_drawn",
    "assembly_path",
    "check_assembly",
    "check_indices",
    "check_sensitivity",
    "class_at",
    "class_cells",
    "class_name",
    "class_shapes",
    "class_times",
    "classify",
    "disconnected_alignment",
    "draw_parameters",
    "l1_distance",
    "l1_in_floors",
    "l1_noise_floor",
    "merge_chirality",
    "outcome_classes",
    "outcome_distribution",
    "pairwise_l1",
    "path_recording",
    "polyomino_cells",
    "polyomino_name",
    "polyominoes",
    "principal_components",
    "proportion_interval",
    "replay_events",
    "sampling_variance",
    "sensitivity_indices",
    "sensitivity_map",
    "sensitivity_reference",
    "sobol_design",
    "sobol_indices",
    "sort_classes",
    "survival_curve",
    "world_class",
]
