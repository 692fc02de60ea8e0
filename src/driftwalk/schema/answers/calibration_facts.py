"""The answer of a calibration under flat names, with the unit in the name, and as variables.

The names follow from the schema and from the model's parameters, as those of a fit do
(`driftwalk.schema.answers.fit_facts`): ``force_std_N`` is the value at ``force_std`` of the
variable ``estimate``, ``position_noise_m`` the variable ``position_noise`` in m. ``ks_distance`` is
the one exception: the map has that name, so the distance at the optimum is the variable
``optimum_ks_distance``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.schema.answers.fit_facts import BOUNDS, fit_facts, plain, sentences, texts
from driftwalk.schema.calibration import BLOCK, StoredParameter, stored_parameters
from driftwalk.schema.description import Variable
from driftwalk.schema.kinds.calibration import CALIBRATION, OPTIMUM, calibration_of
from driftwalk.schema.parameters import Parameter, unit_suffix

if TYPE_CHECKING:
    import xarray as xr

_BEST: Final = {"estimate": "", "coarse_estimate": "coarse_", "first_half_estimate": "first_half_"}
"""Variable along the parameters to what stands in front of the flat names."""
_TYPES: Final = {"float": np.float64, "int": np.int64}


class AnswerParts(NamedTuple):
    """Facts as a dataset holds them."""

    data: dict[str, Any]
    coords: dict[str, Any]
    attrs: dict[str, Any]
    """Those that have no place in a variable."""


def calibration_parts(
    facts: Mapping[str, Any], parameters: Sequence[Parameter | StoredParameter]
) -> AnswerParts:
    """Return the variables, coordinates and attributes of a calibration that hold facts.

    Parameters
    ----------
    facts : mapping
        Numbers, pairs, words and sentences under flat names.
    parameters : sequence of Parameter or StoredParameter
        What was calibrated, in the order of the dimensions.

    Raises
    ------
    KeyError
        When a parameter has no estimate, or only some have an interval.
    """
    rest = dict(facts)
    data: dict[str, Any] = {}
    for name, prefix in _BEST.items():
        keys = [f"{prefix}{one.key}" for one in parameters]
        if name == "estimate" or any(key in rest for key in keys):
            data[name] = ("parameter", np.array([rest.pop(key) for key in keys], np.float64))
    coords: dict[str, Any] = {
        "parameter": ("parameter", np.array([one.name for one in parameters])),
        "unit": ("parameter", np.array([one.unit for one in parameters])),
    }
    ends = [f"{one.key}_interval" for one in parameters]
    if any(key in rest for key in ends):
        pairs = np.array([rest.pop(key) for key in ends], dtype=np.float64)
        data["interval"] = (("parameter", "bound"), pairs)
        coords["bound"] = ("bound", np.array(BOUNDS))
    if "warnings" in rest:
        coords["warning"] = ("warning", texts(rest.pop("warnings")))
    for key, variable in _scalars(parameters).items():
        if key in rest:
            data[variable.name] = ((), _stored(rest.pop(key), variable))
    return AnswerParts(data, coords, rest)


def is_explained(distance: float, floor: float, floor_upper: float, far_above_floor: float) -> bool:
    """Return whether the KS distance at the optimum is within reach of the noise floor.

    Examples
    --------
    >>> is_explained(0.03, 0.02, 0.025, 2.0), is_explained(0.05, 0.02, 0.025, 2.0)
    (True, False)
    """
    return distance <= max(far_above_floor * floor, floor_upper)


def calibration_facts(calibration: xr.Dataset) -> dict[str, Any]:
    """Return what a calibration says under flat names, in Python's own types.

    Parameters
    ----------
    calibration : xarray.Dataset
        A `calibration`, or as much of one as there is. Its attributes are among the facts; what is
        not in it is absent.

    Returns
    -------
    dict
        Of the block ``drag_coefficient`` and ``drag_coefficient_interval`` [low, high],
        ``force_std_N`` and so on; ``ks_distance`` at the optimum; ``explained`` as "yes" and "no";
        ``warnings``, a list of sentences.
    """
    facts: dict[str, Any] = {str(key): value for key, value in calibration.attrs.items()}
    parameters = stored_parameters(calibration)
    known = (
        [str(name) for name in calibration["parameter"].values] if _has_answer(calibration) else []
    )
    for one in parameters:
        if one.name not in known:
            continue
        at = known.index(one.name)
        for name, prefix in _BEST.items():
            if name in calibration.variables:
                facts[f"{prefix}{one.key}"] = float(calibration[name].values[at])
        if "interval" in calibration.variables:
            facts[f"{one.key}_interval"] = calibration["interval"].values[at].tolist()
    for key, variable in _scalars(parameters).items():
        if variable.name in calibration.variables:
            facts[key] = plain(calibration[variable.name])
    if "warning" in calibration.variables:
        facts["warnings"] = sentences(calibration, "warning")
    return facts


def facts_of(dataset: xr.Dataset) -> dict[str, Any]:
    """Return what a dataset of any kind says under flat names; of most its attributes.

    Examples
    --------
    >>> import xarray as xr
    >>> floor = {"noise_floor": 0.02, "optimum_ks_distance": 0.03}
    >>> found = facts_of(xr.Dataset(floor, attrs={"kind": "calibration"}))
    >>> found["ks_distance"], found["noise_floor"]
    (0.03, 0.02)
    """
    tell = _FACTS.get(str(dataset.attrs.get("kind")))
    return (
        {str(key): value for key, value in dataset.attrs.items()} if tell is None else tell(dataset)
    )


_FACTS: Final = {"calibration": calibration_facts, "fit": fit_facts}


def taken_names() -> frozenset[str]:
    """Return the names that a calibration itself needs: no parameter may have one of them."""
    kind = calibration_of(())
    return frozenset({one.name for one in kind.variables} | set(kind.dimensions))


def taken_keys() -> frozenset[str]:
    """Return the flat names and attributes of a calibration, whatever its parameters are."""
    attributes = {one.name for one in calibration_of(()).attributes}
    return frozenset({*_scalars(()), *attributes, "kind", "schema_version", "warnings"})


def _has_answer(calibration: xr.Dataset) -> bool:
    return "estimate" in calibration.variables and "parameter" in calibration.variables


def _scalars(parameters: Sequence[Parameter | StoredParameter]) -> dict[str, Variable]:
    """Return the variables without a dimension by their flat names."""
    if tuple(one.name for one in parameters) == BLOCK:
        kind = CALIBRATION
    else:
        kind = calibration_of(
            [StoredParameter(one.name, one.unit, one.label, one.scale) for one in parameters]
        )
    return {_key(one): one for one in kind.variables if not one.dims}


def _key(variable: Variable) -> str:
    suffix = unit_suffix(variable.units or "1")
    name = variable.name.removeprefix(OPTIMUM)
    return f"{name}_{suffix}" if suffix else name


def _stored(value: Any, variable: Variable) -> Any:
    if variable.holds == "bool":
        return np.bool_(value == "yes" if isinstance(value, str) else value)
    return _TYPES[variable.holds](value)
