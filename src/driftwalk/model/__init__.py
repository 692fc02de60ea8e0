"""Parameters of a simulation: frozen, with units, read from and written to TOML."""

from driftwalk.model.assembly import Assembly
from driftwalk.model.binding import Binding, read_binding
from driftwalk.model.block import Block, Flow, Forces
from driftwalk.model.calibration import Calibration
from driftwalk.model.fit import Fit
from driftwalk.model.recording import Columns, Observation, Recording, Steps
from driftwalk.model.recover import Recover
from driftwalk.model.sensitivity import Sensitivity
from driftwalk.model.simulation import Pose, Simulation
from driftwalk.model.study import (
    Declaration,
    Study,
    apply_overrides,
    declared,
    load_study,
    parameter_table,
    parse_study,
    short_study_template,
    study_template,
)
from driftwalk.model.tank import FieldOfView, Tank, Water

__all__ = [
    "Assembly",
    "Binding",
    "Block",
    "Calibration",
    "Columns",
    "Declaration",
    "FieldOfView",
    "Fit",
    "Flow",
    "Forces",
    "Observation",
    "Pose",
    "Recording",
    "Recover",
    "Sensitivity",
    "Simulation",
    "Steps",
    "Study",
    "Tank",
    "Water",
    "apply_overrides",
    "declared",
    "load_study",
    "parameter_table",
    "parse_study",
    "read_binding",
    "short_study_template",
    "study_template",
]
