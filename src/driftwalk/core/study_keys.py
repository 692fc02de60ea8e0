"""Short names for the keys of a study: arguments of functions and options of the command line."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Final

from driftwalk.core.errors import ConfigurationError
from driftwalk.core.text.did_you_mean import did_you_mean
from driftwalk.core.units import Uncertain, split_uncertain

_UNIT: Final = re.compile("_(m|kg|s|N|Hz|rad)$")


def _of(section: str, *keys: str) -> dict[str, str]:
    """Return keys of a section by the names of their arguments: without the unit."""
    return {_UNIT.sub("", key): f"{section}.{key}" for key in keys}


STUDY_KEYS: Final = {
    "tank_diameter": "tank.diameter_m",
    **_of("tank", "wall_friction", "wall_restitution"),
    **_of("block", "side_m", "mass_kg", "depth"),
    **_of("forces", "drag_coefficient", "force_std_N", "force_interval_s"),
    **_of("simulation", "time_step_s", "duration_s", "sample_rate_Hz", "seed", "replicates"),
    **_of("steps", "step_interval_s"),
    **_of("observation", "position_noise_m", "orientation_noise_rad"),
    "flow_repeat": "flow.repeat",
    "flow_start": "flow.start",
}
"""From an argument's name to the key of the study that it sets."""

CALIBRATION_KEYS: Final = {
    **STUDY_KEYS,
    **_of("calibration", "seed", "replicates", "bootstrap", "confidence"),
}
"""The same for a calibration, where seed and replicates are those of its simulations."""

ASSEMBLY_KEYS: Final = {
    **STUDY_KEYS,
    **_of("assembly", "blocks", "runs", "duration_s", "seed", "latching"),
    **_of("assembly", "connector_distance_m", "connector_axis_rad", "hidden_face_drag"),
    **_of("assembly", "chirality", "block_restitution", "block_friction", "confidence"),
}
"""The same for self-assembly, where seed, duration and confidence are those of its runs."""

SENSITIVITY_KEYS: Final = {
    **ASSEMBLY_KEYS,
    **_of("sensitivity", "runs", "seed"),
    "realisations": "sensitivity.reference_realisations",
}
"""The same for a sensitivity analysis, where runs are those of a setting."""

FLOW_KEYS: Final = {
    **STUDY_KEYS,
    **_of("flow", "cells", "cell_size_m", "flow_drag_coefficient", "min_count", "inertia"),
    "window": "flow.smoothing_window_s",
}
"""The same for the extraction of a flow field."""

FIT_KEYS: Final = {
    **STUDY_KEYS,
    **_of("fit", "angle", "spline_spacing_m", "confidence", "switching_times_s", "flow_labels"),
    **_of("fit", "law", "pressure_gradient", "mass_std_kg", "side_std_m", "force_memory_s"),
    **_of("fit", "flow_strength", "camera"),
    "precision": "fit.drag_coefficient_precision",
    "added_mass": "fit.added_mass_share",
    "added_mass_std": "fit.added_mass_share_std",
}
"""The same for a likelihood fit."""

RECOVER_KEYS: Final = {
    **_of("recover", "recordings", "flow", "seed"),
    "duration": "recover.durations_s",
    "precision": "recover.drag_coefficient_precision",
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
