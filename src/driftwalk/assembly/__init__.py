"""Self-assembly of many blocks: outcomes, their uncertainty, and their dependence on the model."""

from driftwalk.assembly.chains.transition_rates import check_kinetics, kinetics
from driftwalk.assembly.control.live import LiveControl
from driftwalk.assembly.control.modes import Modes, ModeSource, make_modes
from driftwalk.assembly.control.plan import check_control, plan_control
from driftwalk.assembly.control.trial import control_path, try_control
from driftwalk.assembly.control.worlds import Wanted
from driftwalk.assembly.lattice.events import ReplayedEvents, replay_events
from driftwalk.assembly.lattice.polyomino import polyomino_cells, polyomino_name, polyominoes
from driftwalk.assembly.live_world import LiveEvent, LiveTank
from driftwalk.assembly.outcome_posterior.infer import infer_outcomes
from driftwalk.assembly.outcome_posterior.problem import check_outcomes
from driftwalk.assembly.outcome_posterior.records import read_outcomes
from driftwalk.assembly.outcomes.bond_kinetics import rate_interval
from driftwalk.assembly.outcomes.components import (
    Alignment,
    disconnected_alignment,
    principal_components,
)
from driftwalk.assembly.outcomes.distribution import (
    class_at,
    outcome_distribution,
    sampling_variance,
)
from driftwalk.assembly.outcomes.l1 import (
    L1NoiseFloor,
    PairwiseL1,
    l1_distance,
    l1_in_floors,
    l1_noise_floor,
    pairwise_l1,
)
from driftwalk.assembly.outcomes.outcome_classes import (
    class_cells,
    class_name,
    class_shapes,
    kind_classes,
    merge_chirality,
    outcome_classes,
    sort_classes,
    world_class,
)
from driftwalk.assembly.outcomes.sizes import assembly_sizes
from driftwalk.assembly.outcomes.steady_state import steady_state
from driftwalk.assembly.outcomes.survival import SurvivalCurve, class_times, survival_curve
from driftwalk.assembly.pull.force_tables import attraction
from driftwalk.assembly.recordings import classify
from driftwalk.assembly.runs.dataset import path_recording
from driftwalk.assembly.runs.draws import draw_parameters, has_uncertainty, interaction_quantiles
from driftwalk.assembly.runs.run import assemble, assemble_drawn, assembly_path, check_assembly
from driftwalk.assembly.sensitivity.run import (
    check_sensitivity,
    sensitivity_map,
    sensitivity_reference,
)
from driftwalk.assembly.sensitivity.sobol import (
    check_indices,
    sensitivity_indices,
    sobol_design,
    sobol_indices,
)
from driftwalk.assembly.tank_batch import TankBatch
from driftwalk.assembly.yields.run import check_yield, maximise_yield
from driftwalk.core.intervals import proportion_interval

__all__ = [
    "Alignment",
    "L1NoiseFloor",
    "LiveControl",
    "LiveEvent",
    "LiveTank",
    "ModeSource",
    "Modes",
    "PairwiseL1",
    "ReplayedEvents",
    "SurvivalCurve",
    "TankBatch",
    "Wanted",
    "assemble",
    "assemble_drawn",
    "assembly_path",
    "assembly_sizes",
    "attraction",
    "check_assembly",
    "check_control",
    "check_indices",
    "check_kinetics",
    "check_outcomes",
    "check_sensitivity",
    "check_yield",
    "class_at",
    "class_cells",
    "class_name",
    "class_shapes",
    "class_times",
    "classify",
    "control_path",
    "disconnected_alignment",
    "draw_parameters",
    "has_uncertainty",
    "infer_outcomes",
    "interaction_quantiles",
    "kind_classes",
    "kinetics",
    "l1_distance",
    "l1_in_floors",
    "l1_noise_floor",
    "make_modes",
    "maximise_yield",
    "merge_chirality",
    "outcome_classes",
    "outcome_distribution",
    "pairwise_l1",
    "path_recording",
    "plan_control",
    "polyomino_cells",
    "polyomino_name",
    "polyominoes",
    "principal_components",
    "proportion_interval",
    "rate_interval",
    "read_outcomes",
    "replay_events",
    "sampling_variance",
    "sensitivity_indices",
    "sensitivity_map",
    "sensitivity_reference",
    "sobol_design",
    "sobol_indices",
    "sort_classes",
    "steady_state",
    "survival_curve",
    "try_control",
    "world_class",
]
