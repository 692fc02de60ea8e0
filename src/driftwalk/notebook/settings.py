"""The keyword arguments that set keys of a study, for type checkers; their table is in `core`."""

from __future__ import annotations

from typing import TypedDict

Number = float | str
"""A number in SI units, or a text with a unit such as ``"16ms"``."""


class StudySettings(TypedDict, total=False):
    """Parameters of the model and its conditions."""

    tank_diameter: Number
    wall_friction: Number
    wall_restitution: Number
    side: Number
    mass: Number
    depth: Number
    drag_coefficient: Number
    force_std: Number
    force_interval: Number
    time_step: Number
    duration: Number
    sample_rate: Number
    seed: int
    replicates: int
    step_interval: Number
    position_noise: Number
    orientation_noise: Number
    flow_repeat: str
    flow_start: str


class CalibrationSettings(StudySettings, total=False):
    """The same, and the size of a calibration."""

    bootstrap: int
    confidence: Number


class FitSettings(StudySettings, total=False):
    """The same, and how a likelihood fit is made."""

    angle: str
    spline_spacing: Number
    confidence: Number
    switching_times: list[Number]
    flow_labels: list[str]
    precision: Number
    law: str
    pressure_gradient: str
    added_mass: Number
    added_mass_std: Number
    mass_std: Number
    side_std: Number
    force_memory: Number
    flow_strength: str
    camera: str


class AssemblySettings(StudySettings, total=False):
    """The same, and the rules and number of runs of self-assembly."""

    blocks: int
    runs: int
    latching: str
    connector_distance: Number
    connector_axis: Number
    hidden_face_drag: str
    chirality: str
    block_restitution: Number
    block_friction: Number
    confidence: Number
