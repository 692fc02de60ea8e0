"""The `steps` dataset: a sampled path as steps of a correlated random walk.

Dimension ``step``; coordinate ``time`` [s], the instant at which the step begins; variables
``step_length`` [m] and ``turning_angle`` [rad, in (-pi, pi]], the signed angle from the step before
to this one (the paper's step angle). ``attrs`` holds the counts.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError
from driftwalk.schema.check import build_dataset

if TYPE_CHECKING:
    import xarray as xr

STEP: Final = ("step_length", "turning_angle")


def build_steps(
    step_length: npt.ArrayLike,
    turning_angle: npt.ArrayLike,
    *,
    time: npt.ArrayLike,
    attrs: dict[str, Any] | None = None,
) -> xr.Dataset:
    """Build a `steps` dataset.

    Parameters
    ----------
    step_length : array_like, shape (n,)
        Step lengths [m], > 0.
    turning_angle : array_like, shape (n,)
        Turning angles [rad], in (-pi, pi].
    time : array_like, shape (n,)
        When each step begins [s].
    attrs : dict, optional
        Attributes to add.

    Raises
    ------
    InputError
        When the shapes disagree or a value is out of range.

    Examples
    --------
    >>> build_steps([0.01], [0.2], time=[0.1]).sizes["step"]
    1
    """
    values = {"step_length": step_length, "turning_angle": turning_angle}
    try:
        dataset = build_dataset(
            "steps",
            {name: ("step", np.asarray(array, dtype=np.float64)) for name, array in values.items()},
            {"time": ("step", np.asarray(time, dtype=np.float64))},
            attrs or {},
        )
    except ValueError as error:
        raise InputError(f"not a steps dataset: {error}") from error
    return check_steps(dataset)


def check_steps(dataset: xr.Dataset) -> xr.Dataset:
    """Return the dataset if it is a valid `steps` dataset, else raise `InputError`."""
    for name in STEP:
        if name not in dataset or dataset[name].dims != ("step",):
            raise InputError(
                f"not a steps dataset: variable '{name}' with dimension (step) is missing"
            )
    length, angle = (dataset[name].values for name in STEP)
    if not (np.isfinite(length) & (length > 0)).all():
        raise InputError("not a steps dataset: a step_length is not a positive number")
    if not ((angle > -np.pi) & (angle <= np.pi)).all():
        raise InputError("not a steps dataset: a turning_angle lies outside (-pi, pi]")
    return dataset
