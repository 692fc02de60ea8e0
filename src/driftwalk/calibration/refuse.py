"""Which models and tracks a calibration takes, and over which parameters a grid is laid."""

from __future__ import annotations

import math
from typing import Final

from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.core.grid import MOST_SETTINGS
from driftwalk.motion import MotionModel
from driftwalk.schema import Track
from driftwalk.schema.answers.facts import taken_keys, taken_names

MOST_PARAMETERS: Final = 2
"""Of a grid; with more a model is searched."""


def require_samples(track: Track) -> None:
    """Refuse a track on which no step turns."""
    if track.time.size < 3:
        raise InputError(
            f"the recording has {track.time.size} samples of this body; at least 3 are needed"
        )


def require_searchable(model: MotionModel) -> None:
    """Refuse a model that no grid over one or two parameters can be laid over."""
    names = [parameter.name for parameter in model.parameters]
    if not 1 <= len(names) <= MOST_PARAMETERS:
        raise ConfigurationError(
            f"the model {model.name} has {len(names)} parameters to search"
            f"{': ' + ', '.join(names) if names else ''}; a grid takes one or two"
        )
    taken, taken_flat = taken_names(), taken_keys()
    for parameter in model.parameters:
        prefixed = parameter.name.startswith(("refined_", "bootstrap_", "region_"))
        if parameter.name in taken or parameter.key in taken_flat or prefixed:
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
