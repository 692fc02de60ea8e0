"""How did the water move? Flow fields from the tracks of bodies or tracers, formulas, files.

`extract_flow` is the paper's estimator for a floating body, `flow_from_tracers` takes passive
tracers; `load_flow` and `save_flow` keep a field; the analytic
fields have exact values.
"""

from driftwalk.flow.analytic import (
    flow_from_function,
    jets_flow,
    jets_velocity,
    shear_flow,
    shear_velocity,
    uniform_flow,
    uniform_velocity,
    vortex_flow,
    vortex_velocity,
)
from driftwalk.flow.extract import extract_flow, inertia_correction
from driftwalk.flow.files import flow_format, load_flow, save_flow
from driftwalk.flow.grid import bilinear, stretch_flow
from driftwalk.flow.random_flow import random_tank_flow
from driftwalk.flow.tracers import flow_from_tracers

__all__ = [
    "bilinear",
    "extract_flow",
    "flow_format",
    "flow_from_function",
    "flow_from_tracers",
    "inertia_correction",
    "jets_flow",
    "jets_velocity",
    "load_flow",
    "random_tank_flow",
    "save_flow",
    "shear_flow",
    "shear_velocity",
    "stretch_flow",
    "uniform_flow",
    "uniform_velocity",
    "vortex_flow",
    "vortex_velocity",
]
