"""Short names for the keys of a study: arguments of functions and options of the command line."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from driftwalk.core.errors import ConfigurationError
from driftwalk.core.text.did_you_mean import did_you_mean
from driftwalk.core.units import Uncertain, split_uncertain

STUDY_KEYS: Final[dict[str, str]] = {
    "tank_diameter": "tank.diameter_m",
    "wall_friction": "tank.wall_friction",
    "wall_restitution": "tank.wall_restitution",
    "side": "block.side_m",
    "mass": "block.mass_kg",
    "depth": "block.depth",
    "drag_coefficient": "forces.drag_coefficient",
    "force_std": "forces.force_std_N",
    "force_interval": "forces.force_interval_s",
    "time_step": "simulation.time_step_s",
    "duration": "simulation.duration_s",
    "sample_rate": "simulation.sample_rate_Hz",
    "seed": "simulation.seed",
    "replicates": "simulation.replicates",
    "step_interval": "steps.step_interval_s",
    "position_noise": "observation.position_noise_m",
    "orientation_noise": "observation.orientation_noise_rad",
    "flow_repeat": "flow.repeat",
    "flow_start": "flow.start",
}
"""From an argument's name to the key of the study that it sets."""

CALIBRATION_KEYS: Final[dict[str, str]] = {
    **STUDY_KEYS,
    "seed": "calibration.seed",
    "replicates": "calibration.replicates",
    "bootstrap": "calibration.bootstrap",
    "confidence": "calibration.confidence",
}
"""The same for a calibration, where seed and replicates are those of its simulations."""

ASSEMBLY_KEYS: Final[dict[str, str]] = {
    **STUDY_KEYS,
    "blocks": "assembly.blocks",
    "runs": "assembly.runs",
    "duration": "assembly.duration_s",
    "seed": "assembly.seed",
    "latching": "assembly.latching",
    "connector_distance": "assembly.connector_distance_m",
    "connector_axis": "assembly.connector_axis_rad",
    "hidden_face_drag": "assembly.hidden_face_drag",
    "chirality": "assembly.chirality",
    "block_restitution": "assembly.block_restitution",
    "block_friction": "assembly.block_friction",
    "confidence": "assembly.confidence",
}
"""The same for self-assembly, where seed, duration and confidence are those of its runs."""

SENSITIVITY_KEYS: Final[dict[str, str]] = {
    **ASSEMBLY_KEYS,
    "runs": "sensitivity.runs",
    "realisations": "sensitivity.reference_realisations",
    "seed": "sensitivity.seed",
}
"""The same for a sensitivity analysis, where runs are those of a setting."""

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

FIT_KEYS: Final[dict[str, str]] = {
    **STUDY_KEYS,
    "angle": "fit.angle",
    "spline_spacing": "fit.spline_spacing_m",
    "confidence": "fit.confidence",
    "switching_times": "fit.switching_times_s",
    "flow_labels": "fit.flow_labels",
    "precision": "fit.drag_coefficient_precision",
    "law": "fit.law",
    "pressure_gradient": "fit.pressure_gradient",
    "added_mass": "fit.added_mass_share",
    "added_mass_std": "fit.added_mass_share_std",
    "mass_std": "fit.mass_std_kg",
    "side_std": "fit.side_std_m",
    "force_memory": "fit.force_memory_s",
    "flow_strength": "fit.flow_strength",
    "camera": "fit.camera",
}
"""The same for a likelihood fit."""

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
    unknown = [name for name in options if name not in keys]
    if unknown:
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
    both = split_uncertain(value) if isinstance(value, str) else value
    if not isinstance(both, Uncertain):
        return {} if value is None else {keys[name]: value}
    if f"{name}_std" not in keys:
        raise ConfigurationError(f"'{name}' takes no standard deviation, only a number")
    return {keys[name]: both.value, keys[f"{name}_std"]: both.std}
