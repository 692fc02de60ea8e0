"""Motion models with what is known of them: a value, or a range, for each that has it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from driftwalk.core.errors import ConfigurationError
from driftwalk.core.text.did_you_mean import did_you_mean
from driftwalk.motion.choose import is_family_name, motion_model
from driftwalk.motion.protocol import MotionModel

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
    for stranger in known.keys() - set(names):
        having = f"they have {', '.join(names)}" if names else "the block has keys of the study"
        raise ConfigurationError(
            f"`parameters` {stranger}: none of the named models has it; {having}"
            f"{did_you_mean(stranger, names)}"
        )
    return found


def _names(model: str) -> list[str]:
    names = [parameter.name for parameter in motion_model(model).parameters]
    return [*names, CLEARANCE] if is_family_name(model) else names
