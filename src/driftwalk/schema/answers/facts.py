"""The numbers of a fit and of a calibration under flat names, with the unit in the name.

The JSON of a command has these names, which follow from the kind's schema: ``force_std_N`` is the
value at ``force_std`` of the variable ``estimate``, ``position_noise_m`` the variable
``position_noise`` in m. Two names differ: ``ks_distance`` is the variable ``optimum_ks_distance``
(the map has the plain name), and ``switching_times_s`` holds several times.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.core.text_files import parse_json
from driftwalk.schema.check import kind_name
from driftwalk.schema.description import Kind, Number, Variable
from driftwalk.schema.kinds import find_kind
from driftwalk.schema.kinds.calibration import CALIBRATION, OPTIMUM, calibration_of
from driftwalk.schema.kinds.fit import FIT, PARAMETERS
from driftwalk.schema.parameters import BLOCK, Parameter, StoredParameter, flat_name

if TYPE_CHECKING:
    import xarray as xr

BOUNDS: Final = ("lower", "upper")
_PREFIXES: Final = {
    "estimate": "",
    "coarse_estimate": "coarse_",
    "first_half_estimate": "first_half_",
}
"""Variable along the parameters to what stands in front of the flat names."""
_ROWS: Final = ("", "bound", "axis", "switch", "flow")
"""Dimensions of what is a fact: a number, a pair, a few times."""
_WITH_FACTS: Final = (FIT.name, CALIBRATION.name)
"""Kinds whose variables are facts."""
_TYPES: Final = {"float": np.float64, "int": np.int64}


Named = Parameter | StoredParameter | Number
"""A parameter: of a model, of a stored calibration, or of a fit."""


class AnswerParts(NamedTuple):
    """Facts as a dataset holds them."""

    data: dict[str, Any]
    coords: dict[str, Any]
    attrs: dict[str, Any]
    """Those that have no place in a variable."""


class GoodnessPolicy(NamedTuple):
    """When a distance is more than what chance makes of two recordings of one model."""

    far_above_floor: float = 2.0
    """Noise floors of a KS distance above which it is called far above the floor; chosen by
    hand."""
    floor_quantile: float = 0.95
    """Quantile of the distances between two simulated recordings up to which the floor reaches:
    chance exceeds it once in twenty."""


GOODNESS: Final = GoodnessPolicy()


def facts_of(dataset: xr.Dataset) -> dict[str, Any]:
    """Return what a dataset says under flat names, in Python's own types.

    Parameters
    ----------
    dataset : xarray.Dataset
        A `fit` or a `calibration`, or as much of one as there is; of another kind only the
        attributes are facts.

    Returns
    -------
    dict
        ``drag_coefficient`` and ``drag_coefficient_interval`` [low, high], ``force_std_N`` and so
        on; verdicts as "yes" and "no"; ``warnings``, a list of sentences; the attributes.

    Examples
    --------
    >>> import xarray as xr
    >>> floor = {"noise_floor": 0.02, "optimum_ks_distance": 0.03}
    >>> found = facts_of(xr.Dataset(floor, attrs={"kind": "calibration"}))
    >>> found["ks_distance"], found["noise_floor"]
    (0.03, 0.02)
    """
    facts: dict[str, Any] = {str(key): value for key, value in dataset.attrs.items()}
    kind = find_kind(dataset)
    if kind is None or kind.name not in _WITH_FACTS:
        return facts
    if "estimate" in dataset.variables and "parameter" in dataset.dims:
        for at, (name, unit) in enumerate(
            zip(dataset["parameter"].values, dataset["unit"].values, strict=True)
        ):
            key = flat_name(str(name), str(unit))
            for variable, prefix in _PREFIXES.items():
                if variable in dataset.variables:
                    facts[f"{prefix}{key}"] = float(dataset[variable].values[at])
            if "interval" in dataset.variables:
                facts[f"{key}_interval"] = dataset["interval"].values[at].tolist()
    for key, one in flat_variables(kind).items():
        if one.name in dataset.variables:
            facts[key] = _plain(dataset[one.name].values.tolist())
    facts["warnings"] = sentences(dataset, "warning")
    return facts


def flat_variables(kind: Kind) -> dict[str, Variable]:
    """Return the variables of a kind that hold a fact, by its flat name."""
    return {
        _key(one): one
        for one in kind.variables
        if one.dims in _ROWS and one.name != one.dims and one.holds != "text"
    }


def fit_parts(facts: Mapping[str, Any]) -> AnswerParts:
    """Return the variables and coordinates of a fit that hold facts."""
    return _parts(facts, [one for one in PARAMETERS.values() if one.key in facts], FIT)


def calibration_parts(facts: Mapping[str, Any], parameters: Sequence[Named]) -> AnswerParts:
    """Return the variables, coordinates and attributes of a calibration that hold facts.

    Parameters
    ----------
    facts : mapping
        Numbers, pairs, words and sentences under flat names.
    parameters : sequence of Named
        What was calibrated, in the order of the dimensions.

    Raises
    ------
    KeyError
        When a parameter has no estimate, or only some have an interval.
    """
    return _parts(facts, parameters, _calibration_kind(parameters))


def _parts(facts: Mapping[str, Any], parameters: Sequence[Named], kind: Kind) -> AnswerParts:
    rest, data = dict(facts), dict[str, Any]()
    for name, prefix in _PREFIXES.items():
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
    if kind is FIT:
        coords["axis"] = ("axis", np.array(["x", "y"]))
    if "warnings" in rest:
        coords["warning"] = ("warning", texts(rest.pop("warnings")))
    for key, variable in flat_variables(kind).items():
        if key in rest:
            data[variable.name] = _stored(rest.pop(key), variable)
    return AnswerParts(data, coords, rest)


def _stored(value: Any, variable: Variable) -> tuple[Any, Any]:
    """Return dimension and value of a fact."""
    if variable.dims:
        # NetCDF keeps a list of one number as the number.
        return variable.dims, np.atleast_1d(np.asarray(value, dtype=np.float64))
    if variable.holds == "bool":
        return (), np.bool_(value == "yes" if isinstance(value, str) else value)
    return (), _TYPES[variable.holds](value)


def is_explained(distance: float, floor: float, floor_upper: float, far_above_floor: float) -> bool:
    """Return whether the KS distance at the optimum is within reach of the noise floor.

    Examples
    --------
    >>> is_explained(0.03, 0.02, 0.025, 2.0), is_explained(0.05, 0.02, 0.025, 2.0)
    (True, False)
    """
    return distance <= max(far_above_floor * floor, floor_upper)


def taken_names() -> frozenset[str]:
    """Return the names that a calibration itself needs: no parameter may have one of them."""
    kind = calibration_of(())
    return frozenset({one.name for one in kind.variables} | set(kind.dimensions))


def taken_keys() -> frozenset[str]:
    """Return the flat names and attributes of a calibration, whatever its parameters are."""
    kind = calibration_of(())
    attributes = {one.name for one in kind.attributes}
    return frozenset({*flat_variables(kind), *attributes, "kind", "schema_version", "warnings"})


def is_open(facts: Mapping[str, Any], key: str) -> bool:
    """Return whether an interval has no upper end: the recording does not determine the number.

    Examples
    --------
    >>> facts = {"drag_coefficient": 0.4, "drag_coefficient_interval": [0.0, np.inf]}
    >>> is_open(facts, "drag_coefficient"), is_open(facts, "force_std_N")
    (True, False)
    """
    return bool(np.isposinf(facts.get(f"{key}_interval", (0.0, 0.0))[1]))


def sentences(dataset: xr.Dataset, name: str) -> list[str]:
    """Return the sentences that a variable holds; none where it is absent."""
    return [str(text) for text in dataset[name].values] if name in dataset.variables else []


def source_warnings(dataset: xr.Dataset) -> list[str]:
    """Return the warnings of the fit or the study that simulations took their parameters from.

    Examples
    --------
    >>> import xarray as xr
    >>> source_warnings(xr.Dataset(attrs={"warnings": '["of the fit: does not explain"]'}))
    ['of the fit: does not explain']
    """
    return [str(text) for text in parse_json(dataset.attrs.get("warnings", "[]"))]


def texts(stored: str | Iterable[str]) -> Any:
    """Return sentences as an array; given as a list or as its JSON text.

    Text keeps its type where there is none: a variable of length 0 stays one of text in a file.
    """
    found = parse_json(stored) if isinstance(stored, str) else list(stored)
    return np.array(found, dtype=np.str_)


def fitted_value(fit: xr.Dataset, parameter: str) -> float:
    """Return the estimate of a parameter of a fit or of a calibration.

    Raises
    ------
    InputError
        When it was not fitted.
    """
    known = [str(name) for name in fit["parameter"].values]
    if parameter not in known:
        has = f"the {kind_name(fit) or 'fit'} has no {parameter}"
        raise InputError(f"{has}: it has {', '.join(known)}")
    return float(fit["estimate"].values[known.index(parameter)])


def _calibration_kind(parameters: Sequence[Named]) -> Kind:
    names = tuple(one.name for one in parameters)
    if names == BLOCK:
        return CALIBRATION
    return calibration_of([StoredParameter(one.name, one.unit, "", "linear") for one in parameters])


def _key(variable: Variable) -> str:
    if variable.name == "switching_time":
        return "switching_times_s"
    return flat_name(variable.name.removeprefix(OPTIMUM), variable.units or "1")


def _plain(value: Any) -> Any:
    """Return a verdict as "yes" or "no", anything else as it is."""
    return {True: "yes", False: "no"}[value] if isinstance(value, bool) else value
