"""Whether a recording can be calibrated on, before anything is computed or written."""

from __future__ import annotations

from typing import TYPE_CHECKING

from driftwalk.calibration.held_out.recorded import body_motion
from driftwalk.calibration.problem import recorded_problem
from driftwalk.calibration.refuse import MOST_PARAMETERS, require_searchable
from driftwalk.motion import BlockModel, MotionModel, ParticleModel

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


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
    if model is not None and len(model.parameters) > MOST_PARAMETERS:
        motion = body_motion(recording, study, flow=flow, body=body)
        if isinstance(model, ParticleModel):
            model.require_others(motion.like)
        return
    if model is not None:
        require_searchable(model)
    _, problem = recorded_problem(
        recording,
        study,
        lambda _: flow,
        model=BlockModel(study) if model is None else model,
        body=body,
    )
    if isinstance(problem.model, ParticleModel):
        problem.model.require_others(problem.like)
    if isinstance(problem.model, BlockModel):
        problem.model.native(problem.like)
