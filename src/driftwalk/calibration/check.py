"""Which recordings and models can be calibrated, before anything is computed or written."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from driftwalk.calibration.held_out.recorded import body_motion
from driftwalk.calibration.problem import recorded_problem
from driftwalk.core.errors import ConfigurationError
from driftwalk.core.grid import MOST_SETTINGS
from driftwalk.motion import BlockModel, MotionModel, ParticleModel
from driftwalk.schema.answers.facts import taken_keys, taken_names

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


MOST_PARAMETERS: Final = 2
"""Of a grid; with more a model is searched."""


def check_recording(
    recording: xr.Dataset,
    study: Study,
    *,
    flow: xr.Dataset | None,
    body: str | None = None,
    model: MotionModel | None = None,
) -> None:
    """Refuse a recording or a model that `calibrate` would refuse; takes almost no time.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    study : Study
        Model and step interval.
    flow : xarray.Dataset or None
        A `flow_field`; None for a model that needs none.
    body : str, optional
        The body, where there are several.
    model : MotionModel, optional
        Default: the block of the study.

    Raises
    ------
    InputError
        When the recording is too short, does not move, or several bodies are there and none named.
    ConfigurationError
        When the model has no parameter, or a name that a calibration uses itself.

    Examples
    --------
    >>> import driftwalk as dw
    >>> dw.calibration.check_recording(dw.tank30_recording(), dw.Study(), flow=dw.tank30_flow())
    """
    chosen = BlockModel(study) if model is None else model
    if len(chosen.parameters) > MOST_PARAMETERS:
        like = body_motion(recording, study, flow=flow, body=body).like
    else:
        require_searchable(chosen)
        _, problem = recorded_problem(recording, study, lambda _: flow, model=chosen, body=body)
        like = problem.like
    if isinstance(chosen, ParticleModel):
        chosen.require_others(like)
    if isinstance(chosen, BlockModel):
        chosen.native(like)


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
