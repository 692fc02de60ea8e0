"""Known values of motion models: given by name, or found by a calibration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.errors import ConfigurationError, InputError, did_you_mean
from driftwalk.motion.choose import is_family_name, motion_model
from driftwalk.motion.protocol import MotionModel
from driftwalk.motion.ranges import known_value
from driftwalk.schema import Parameter
from driftwalk.schema.check import kind_name

if TYPE_CHECKING:
    import xarray as xr


def known_values(model: MotionModel, given: Mapping[str, Any]) -> dict[str, float]:
    """Return a value for every parameter of a model, in the order of its parameters.

    Parameters
    ----------
    model : MotionModel
        The model; what it holds fixed already is none of its parameters.
    given : mapping of str to float
        The values by name, in the units of the parameters. A value may lie outside the range of
        the search, but not below 0 where the range has nothing below.

    Raises
    ------
    ConfigurationError
        When a value is missing, is no such number, or belongs to no parameter.

    Examples
    --------
    >>> import driftwalk as dw
    >>> model = dw.motion_model("active", turn_rate=0.0)
    >>> known_values(model, {"rotational_diffusion": 0.5, "speed": 0.02})
    {'speed': 0.02, 'rotational_diffusion': 0.5}
    """
    usual = {one.name: one for one in model.parameters}
    for name in given:
        if name not in usual:
            raise ConfigurationError(_unknown_parameter_text(model, name))
    if missing := [_in_words(one) for one in model.parameters if one.name not in given]:
        raise ConfigurationError(
            f"the model {model.name} has no value for {', '.join(missing)}: give one for each "
            "(`parameters`)"
        )
    return {name: known_value(one, given[name]) for name, one in usual.items()}


def estimated_values(found: xr.Dataset, model: MotionModel) -> dict[str, float]:
    """Return the values that a calibration has found for the parameters of a model.

    Parameters
    ----------
    found : xarray.Dataset
        Anything with ``estimate`` along ``parameter``, such as a `calibration`; of a
        `model_comparison` the row of the model. An estimate that is NaN was not found.
    model : MotionModel
        The model; it has to be the one that the calibration was about.

    Raises
    ------
    InputError
        When there is no estimate, or it is about another model.

    Examples
    --------
    >>> import driftwalk as dw
    >>> import xarray as xr
    >>> model = dw.motion_model("active", turn_rate=0.0, rotational_diffusion=0.5)
    >>> speed = xr.DataArray([0.02], {"parameter": ["speed"]}, "parameter")
    >>> estimated_values(xr.Dataset({"estimate": speed}, attrs={"model": "active"}), model)
    {'speed': 0.02}
    """
    kind = kind_name(found) or "dataset"
    if "estimate" not in found or "parameter" not in found["estimate"].dims:
        raise InputError(f"the {kind} has no estimate of parameters: give that of a calibration")
    estimate = found["estimate"]
    several = "model" in estimate.dims
    stated = found["model"].values if several else [found.attrs.get("model", "block")]
    names = [str(name) for name in stated]
    if model.name not in names:
        raise InputError(
            f"the {kind} is about {', '.join(names)}, and not about the model {model.name}"
        )
    if several:
        estimate = estimate.isel(model=names.index(model.name))
    values = zip(found["parameter"].values, np.asarray(estimate.values, np.float64), strict=True)
    return {str(name): float(value) for name, value in values if np.isfinite(value)}


def _unknown_parameter_text(model: MotionModel, name: str) -> str:
    fixed: Mapping[str, float] = getattr(model, "fixed", {})
    if name in fixed:
        return f"the model {model.name} was made with {name}={fixed[name]:g}: leave it out"
    names = [one.name for one in model.parameters]
    has = f"it has {', '.join(names)}" if names else "all of its parameters are known"
    return f"the model {model.name} has no parameter {name!r}; {has}{did_you_mean(name, names)}"


def _in_words(one: Parameter) -> str:
    unit = "" if one.unit == "1" else f" {one.unit}"
    return f"{one.name} ({one.low:g} to {one.high:g}{unit})"


CLEARANCE: Final = "clearance"
BLOCK: Final = "block"


def models_knowing(
    models: Sequence[str | MotionModel], known: Mapping[str, Any]
) -> list[str | MotionModel]:
    """Return the models with what is known of their parameters.

    Parameters
    ----------
    models : sequence of str or MotionModel
        Names of models, or models. These are as they were made, and so is the block.
    known : mapping
        From a parameter to its value, or to a range ``(low, high)``, in SI units: for each named
        model that has it. ``clearance`` is the distance of the recorded point from the wall at
        contact [m], for the family.

    Raises
    ------
    ConfigurationError
        When none of the named models has a parameter of this name, or a value makes no sense.

    Examples
    --------
    >>> models = models_knowing(["inertial", "active+wall"], {"speed": 0.05, "clearance": 0.01})
    >>> [parameter.name for parameter in models[1].parameters][:2], models[0].clearance
    (['rotational_diffusion', 'turn_rate'], 0.01)
    """
    if not known:
        return list(models)
    found: list[str | MotionModel] = []
    names: list[str] = []
    for one in models:
        has = [] if not isinstance(one, str) or one == BLOCK else _names(one)
        own = {key: value for key, value in known.items() if key in has}
        names += [name for name in has if name not in names]
        found.append(motion_model(str(one), **own) if own else one)
    for unknown in known.keys() - set(names):
        having = f"they have {', '.join(names)}" if names else "the block has keys of the study"
        raise ConfigurationError(
            f"`parameters` {unknown}: none of the named models has it; "
            f"{having}{did_you_mean(unknown, names)}"
        )
    return found


def _names(model: str) -> list[str]:
    names = [parameter.name for parameter in motion_model(model).parameters]
    return [*names, CLEARANCE] if is_family_name(model) else names
