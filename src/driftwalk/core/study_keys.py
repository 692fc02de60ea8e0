"""Short names for the keys of a study: arguments of functions and options of the command line.

A name, its type and the key that it sets are declared once, as keyword arguments that a type
checker knows (`FitSettings`); the tables from names to keys (`FIT_KEYS`) are made of them.
"""

from collections.abc import Mapping
from typing import Annotated, Any, Final, TypedDict

from driftwalk.core.errors import ConfigurationError, did_you_mean
from driftwalk.core.units import Uncertain, split_uncertain

Number = float | str
"""A number in SI units, or a text with a unit such as ``"16ms"``."""


class ModelSettings(TypedDict, total=False):
    """Parameters of the model and its conditions."""

    tank_diameter: Annotated[Number, "tank.diameter_m"]
    wall_friction: Annotated[Number, "tank.wall_friction"]
    wall_restitution: Annotated[Number, "tank.wall_restitution"]
    body_shape: Annotated[str, "block.shape"]
    side: Annotated[Number, "block.side_m"]
    mass: Annotated[Number, "block.mass_kg"]
    depth: Annotated[Number, "block.depth"]
    drag_coefficient: Annotated[Number, "forces.drag_coefficient"]
    force_std: Annotated[Number, "forces.force_std_N"]
    force_interval: Annotated[Number, "forces.force_interval_s"]
    time_step: Annotated[Number, "simulation.time_step_s"]
    sample_rate: Annotated[Number, "simulation.sample_rate_Hz"]
    step_interval: Annotated[Number, "steps.step_interval_s"]
    position_noise: Annotated[Number, "observation.position_noise_m"]
    orientation_noise: Annotated[Number, "observation.orientation_noise_rad"]
    stirring_length: Annotated[Number, "forces.stirring_length_m"]
    stirring: Annotated[str, "forces.stirring"]
    flow_repeat: Annotated[str, "flow.repeat"]
    flow_start: Annotated[str, "flow.start"]


class StudySettings(ModelSettings, total=False):
    """The same, and the times and numbers of a simulation."""

    duration: Annotated[Number, "simulation.duration_s"]
    seed: Annotated[int, "simulation.seed"]
    replicates: Annotated[int, "simulation.replicates"]


class CalibrationSettings(ModelSettings, total=False):
    """The same for a calibration, where seed and replicates belong to its simulations."""

    duration: Annotated[Number, "simulation.duration_s"]
    seed: Annotated[int, "calibration.seed"]
    replicates: Annotated[int, "calibration.replicates"]
    bootstrap: Annotated[int, "calibration.bootstrap"]
    confidence: Annotated[Number, "calibration.confidence"]


class AssemblySettings(ModelSettings, total=False):
    """The same for self-assembly, where seed, duration and confidence belong to its runs."""

    replicates: Annotated[int, "simulation.replicates"]
    blocks: Annotated[int, "assembly.blocks"]
    runs: Annotated[int, "assembly.runs"]
    duration: Annotated[Number, "assembly.duration_s"]
    seed: Annotated[int, "assembly.seed"]
    latching: Annotated[str, "assembly.latching"]
    connector_distance: Annotated[Number, "assembly.connector_distance_m"]
    connector_axis: Annotated[Number, "assembly.connector_axis_rad"]
    faces: Annotated[str, "assembly.faces"]
    glued: Annotated[str, "assembly.glued"]
    hidden_face_drag: Annotated[Number, "assembly.hidden_face_drag"]
    chirality: Annotated[str, "assembly.chirality"]
    block_restitution: Annotated[Number, "assembly.block_restitution"]
    block_friction: Annotated[Number, "assembly.block_friction"]
    bond_rate: Annotated[Number, "assembly.bond_rate_per_s"]
    bond_strength: Annotated[Number, "assembly.bond_strength_N"]
    relatch_clearance: Annotated[Number, "assembly.relatch_clearance"]
    confidence: Annotated[Number, "assembly.confidence"]
    magnets: Annotated[str, "interaction.magnets"]
    magnet_inset: Annotated[Number, "interaction.magnet_inset_m"]
    poles: Annotated[str, "interaction.poles"]
    attraction: Annotated[str, "interaction.attraction"]
    capillary: Annotated[str, "interaction.capillary"]
    meniscus_height: Annotated[Number, "interaction.meniscus_height_m"]
    approach_resistance: Annotated[Number, "interaction.approach_resistance_N_s"]


class FitSettings(StudySettings, total=False):
    """The same for a likelihood fit."""

    angle: Annotated[str, "fit.angle"]
    spline_spacing: Annotated[Number, "fit.spline_spacing_m"]
    confidence: Annotated[Number, "fit.confidence"]
    switching_times: Annotated[list[Number], "fit.switching_times_s"]
    flow_labels: Annotated[list[str], "fit.flow_labels"]
    precision: Annotated[Number, "fit.drag_coefficient_precision"]
    law: Annotated[str, "fit.law"]
    pressure_gradient: Annotated[str, "fit.pressure_gradient"]
    added_mass: Annotated[Number, "fit.added_mass_share"]
    added_mass_std: Annotated[Number, "fit.added_mass_share_std"]
    mass_std: Annotated[Number, "fit.mass_std_kg"]
    side_std: Annotated[Number, "fit.side_std_m"]
    force_memory: Annotated[Number, "fit.force_memory_s"]
    flow_strength: Annotated[str, "fit.flow_strength"]
    flow_modes: Annotated[str, "fit.flow_modes"]
    camera: Annotated[str, "fit.camera"]
    interaction: Annotated[bool, "fit.interaction"]
    flow_error: Annotated[Number, "fit.flow_error_m_s"]
    flow_scale_error: Annotated[Number, "fit.flow_scale_std"]


def _keys_of(settings: type) -> dict[str, str]:
    return {name: hint.__metadata__[0] for name, hint in settings.__annotations__.items()}


STUDY_KEYS: Final = _keys_of(StudySettings)
"""From an argument's name to the key of the study that it sets."""
CALIBRATION_KEYS: Final = _keys_of(CalibrationSettings)
ASSEMBLY_KEYS: Final = _keys_of(AssemblySettings)
INFERRED_KEYS: Final = {
    name: ASSEMBLY_KEYS[name]
    for name in (
        "drag_coefficient", "force_std", "hidden_face_drag", "stirring_length", "bond_rate",
        "bond_strength", "block_restitution", "block_friction", "wall_restitution",
        "wall_friction", "mass", "side",
    )
}  # fmt: skip
"""Parameters that outcomes of self-assembly alone may determine."""
INFERRED_RANGES: Final = {"drag_coefficient": (0.3, 0.6), "force_std": (0.2e-3, 1.2e-3)}
"""Those that are inferred where none is named, and their ranges, SI: around the paper's."""
FIT_KEYS: Final = _keys_of(FitSettings)
SENSITIVITY_KEYS: Final[dict[str, str]] = {
    **ASSEMBLY_KEYS,
    "runs": "sensitivity.runs",
    "realisations": "sensitivity.reference_realisations",
    "seed": "sensitivity.seed",
}
"""The same for a sensitivity analysis, where runs are counted per setting."""
FLOW_KEYS: Final[dict[str, str]] = {
    **STUDY_KEYS,
    "cells": "flow.cells",
    "cell_size": "flow.cell_size_m",
    "window": "flow.smoothing_window_s",
    "flow_drag_coefficient": "flow.flow_drag_coefficient",
    "min_count": "flow.min_count",
    "inertia": "flow.inertia",
}
"""The same for the extraction of a flow field."""
RECOVER_KEYS: Final[dict[str, str]] = {
    "recordings": "recover.recordings",
    "duration": "recover.durations_s",
    "flow": "recover.flow",
    "precision": "recover.drag_coefficient_precision",
    "seed": "recover.seed",
    "tank_diameter": "tank.diameter_m",
    "position_noise": "observation.position_noise_m",
    "step_interval": "steps.step_interval_s",
    "bootstrap": "calibration.bootstrap",
}
"""The same for a recovery study."""

BOND_FORCE: Final = "assembly.bond_force_N"
"""The key that the second number of ``bond_rate`` sets, as in ``"0.01/s,2mN"``."""

TABLES: Final = (
    *(STUDY_KEYS, CALIBRATION_KEYS, ASSEMBLY_KEYS, SENSITIVITY_KEYS),
    *(FLOW_KEYS, FIT_KEYS, RECOVER_KEYS),
)
"""All of them."""


def study_overrides(*, keys: Mapping[str, str] = STUDY_KEYS, **options: Any) -> dict[str, Any]:
    """Return the keys of the study that arguments set; an argument that is None sets none.

    Parameters
    ----------
    keys : mapping
        One of the tables of this module.
    **options
        Values by the names in `keys`.

    Raises
    ------
    ConfigurationError
        When a name is not in the table.

    Examples
    --------
    >>> study_overrides(tank_diameter=0.5, seed=None)
    {'tank.diameter_m': 0.5}
    >>> study_overrides(keys=FIT_KEYS, mass="11.6±0.2 g")
    {'block.mass_kg': '11.6 g', 'fit.mass_std_kg': '0.2 g'}
    """
    if unknown := [name for name in options if name not in keys]:
        advice = did_you_mean(unknown[0], keys) or f"; there are {', '.join(keys)}"
        raise ConfigurationError(f"there is no argument '{unknown[0]}'{advice}")
    overrides: dict[str, Any] = {}
    for name, value in options.items():
        overrides.update(_stated(name, value, keys))
    depth = overrides.get("block.depth")
    if depth is not None and depth not in ("immersed", "archimedes"):
        overrides["block.depth_m"] = overrides.pop("block.depth")
    return overrides


def _stated(name: str, value: Any, keys: Mapping[str, str]) -> dict[str, Any]:
    """Return the keys that one argument sets, with that of its standard deviation."""
    if name == "bond_rate" and isinstance(value, str) and "," in value:
        rate, force = value.split(",", 1)
        return {keys[name]: rate, BOND_FORCE: force}
    both = split_uncertain(value) if isinstance(value, str) else value
    if not isinstance(both, Uncertain):
        return {} if value is None else {keys[name]: value}
    if f"{name}_std" not in keys:
        raise ConfigurationError(f"'{name}' takes no standard deviation, only a number")
    return {keys[name]: both.value, keys[f"{name}_std"]: both.std}
