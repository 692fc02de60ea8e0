"""Which models a calibration takes: one or two parameters, by names that are free."""

from __future__ import annotations

import math
from typing import Final

from driftwalk.core.errors import ConfigurationError
from driftwalk.motion import MotionModel
from driftwalk.schema.parameters import MOST_SETTINGS

MOST_PARAMETERS: Final = 2
TAKEN: Final = frozenset(
    {"ks_distance", "ks_distance_standard_error", "ks_distance_replicate", "status", "replicate"}
    | {"refined_surface", "refined_replicate", "ks_step_length", "ks_turning_angle", "ks_quadrant"}
    | {"excerpt_x", "excerpt_y", "excerpt_time", "excerpt_sample", "step_density", "bootstrap"}
    | {"density_step_length", "density_turning_angle", "recording_step", "recording_step_length"}
    | {"recording_turning_angle", "recording_step_density", "step_length_edge", "region_vertex"}
    | {"turning_angle_edge", "bootstrap_ks_distance"}
)
"""Names of a calibration's own variables and dimensions."""
TAKEN_KEYS: Final = frozenset(
    {"kind", "schema_version", "model", "model_source_sha256", "position_noise_m", "duration_s"}
    | {"orientation_noise_rad", "position_quantum_m", "step_interval_s", "recording_pairs"}
    | {"ks_distance", "ks_distance_standard_error", "noise_floor", "noise_floor_upper", "study"}
    | {"distance_to_floor_ratio", "far_above_floor", "second_half_ks_distance", "warnings"}
    | {"second_half_noise_floor", "recording_name", "simulated_recording", "region_level"}
    | {"interval_stretch", "confidence"}
)
"""Names of a calibration's own attributes."""


def require_searchable(model: MotionModel) -> None:
    """Refuse a model that no grid over one or two parameters can be laid over.

    Raises
    ------
    ConfigurationError
        When it has none or more than two parameters, a name that a calibration uses itself, or a
        grid of more settings than anybody could simulate.
    """
    names = [parameter.name for parameter in model.parameters]
    if not 1 <= len(names) <= MOST_PARAMETERS:
        raise ConfigurationError(
            f"the model {model.name} has {len(names)} parameters ({', '.join(names)}), and a "
            f"calibration searches one or two: give the others a fixed value in the model"
        )
    for parameter in model.parameters:
        prefixed = parameter.name.startswith(("refined_", "bootstrap_", "region_"))
        if parameter.name in TAKEN or parameter.key in TAKEN_KEYS or prefixed:
            raise ConfigurationError(
                f"the model {model.name} has a parameter '{parameter.name}', a name that a "
                "calibration uses itself: choose another"
            )
    settings = math.prod(len(parameter.coordinates) for parameter in model.parameters)
    if settings > MOST_SETTINGS:
        raise ConfigurationError(
            f"the grid over {', '.join(names)} has {settings} settings, more than {MOST_SETTINGS}: "
            "enlarge a step"
        )
