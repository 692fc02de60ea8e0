"""Whether a dataset is what its kind says, and what its kind says of it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.errors import FormatError, InputError
from driftwalk.core.text.json_text import parse_json
from driftwalk.schema.description import Attribute, Kind, Variable
from driftwalk.schema.kinds import KINDS, find_kind

if TYPE_CHECKING:
    import xarray as xr

LETTERS: Final = {"float": "f", "int": "iu", "bool": "b", "text": "OU"}
"""Letters of the NumPy types that may hold each."""
WORDS: Final = {"float": "numbers", "int": "whole numbers", "bool": "truth values", "text": "text"}


def kind_of_dataset(dataset: xr.Dataset) -> Kind:
    """Return the kind that a dataset says it is.

    Raises
    ------
    InputError
        When it says none, or one that is not known.
    """
    kind = find_kind(dataset)
    if kind is not None:
        return kind
    name = dataset.attrs.get("kind")
    if not isinstance(name, str):
        raise InputError("not a dataset of driftwalk: it has no attribute 'kind'")
    raise InputError(f"no kind of dataset is called '{name}': there are {', '.join(KINDS)}")


def kind_name(dataset: xr.Dataset) -> str | None:
    """Return what kind a dataset says it is, None where it says nothing."""
    name = dataset.attrs.get("kind")
    return name if isinstance(name, str) else None


def require_kind(dataset: xr.Dataset, kind: str, advice: str = "") -> xr.Dataset:
    """Return a dataset of a kind, refuse any other.

    Parameters
    ----------
    dataset : xarray.Dataset
        Any dataset.
    kind : str
        What it has to be.
    advice : str
        How such a dataset is made, for the error.

    Raises
    ------
    InputError
        When its attribute ``kind`` says something else.
    """
    found = kind_name(dataset)
    if found != kind:
        hint = f"; {advice}" if advice else ""
        raise InputError(f"expected a dataset '{kind}', got {found or 'one of no kind'}{hint}")
    return dataset


def check_dataset(dataset: xr.Dataset, kind: str | None = None) -> xr.Dataset:
    """Return a dataset that holds all that its kind says, with its dimensions and units.

    Parameters
    ----------
    dataset : xarray.Dataset
        Any dataset of driftwalk's. Variables and attributes of one's own may be in it.
    kind : str, optional
        What kind it has to be; default: whatever its attribute ``kind`` says.

    Raises
    ------
    InputError
        When it is of another kind or version, a variable or attribute is missing, a variable lies
        on other dimensions, has other units, or holds text for numbers.

    Examples
    --------
    >>> from driftwalk.schema import build_trajectory
    >>> still = build_trajectory([0.0, 0.1], [0.0, 0.0], [0.0, 0.0])
    >>> check_dataset(still) is still
    True
    >>> check_dataset(still.drop_vars("theta"))
    Traceback (most recent call last):
        ...
    driftwalk.core.errors.InputError: not of the kind trajectory: the variable 'theta' is missing
    """
    found = kind_of_dataset(dataset)
    if kind is not None and found.name != kind:
        raise InputError(f"not of the kind {kind}, but {found.name}")
    if "schema_version" not in dataset.attrs:
        raise InputError(f"not of the kind {found.name}: the attribute 'schema_version' is missing")
    refuse_other_version(dataset)
    for variable in found.variables:
        if variable.name in dataset.variables:
            _check_variable(dataset, variable, found)
        elif not variable.when:
            raise InputError(
                f"not of the kind {found.name}: the variable '{variable.name}' is missing"
            )
    for attribute in found.attributes:
        if not attribute.when and attribute.name not in dataset.attrs:
            raise InputError(
                f"not of the kind {found.name}: the attribute '{attribute.name}' is missing"
            )
    return dataset


def refuse_other_version(dataset: xr.Dataset, path: Path | None = None) -> xr.Dataset:
    """Return a dataset, unless it states another schema version than its kind's.

    A dataset without a version passes: a file of another program need not state one.
    """
    kind = KINDS.get(str(dataset.attrs.get("kind")))
    version = dataset.attrs.get("schema_version")
    if kind is None or version is None:
        return dataset
    if not isinstance(version, int | np.integer) or version != kind.version:
        raise FormatError(
            ("" if path else f"the dataset '{kind.name}' ")
            + f"is of another schema version: its {kind.name} has version {version}, and this "
            f"driftwalk reads {kind.version}; make it again with this driftwalk",
            path=path,
        )
    return dataset


def described(dataset: xr.Dataset) -> xr.Dataset:
    """Return a dataset whose variables carry the units and names of its kind's schema, checked.

    Parameters
    ----------
    dataset : xarray.Dataset
        With the attribute ``kind``. Its variables' own attributes stay, unless the schema has them.

    Raises
    ------
    InputError
        As `check_dataset`.
    """
    kind = kind_of_dataset(dataset)
    dataset = dataset.copy(deep=False)
    for variable in kind.variables:
        if variable.name in dataset.variables:
            held = dataset.variables[variable.name]
            dataset[variable.name].attrs.update(variable.described(held.dtype))
    return check_dataset(dataset)


def build_dataset(
    kind: str, data: dict[str, Any], coords: dict[str, Any], attrs: dict[str, Any]
) -> xr.Dataset:
    """Return a new dataset of a kind, described and checked.

    Parameters
    ----------
    kind : str
        What it is.
    data, coords : dict
        By name ``(dims, values)``, as `xarray.Dataset` takes them. Units and long names are the
        schema's.
    attrs : dict
        Attributes, without ``kind`` and ``schema_version``.

    Raises
    ------
    InputError
        As `check_dataset`.

    Examples
    --------
    >>> data = {"step_length": ("step", [0.01]), "turning_angle": ("step", [0.2])}
    >>> build_dataset("steps", data, {}, {})
    Traceback (most recent call last):
        ...
    driftwalk.core.errors.InputError: not of the kind steps: the variable 'time' is missing
    """
    import xarray as xr

    known = {"kind": kind, "schema_version": KINDS[kind].version}
    return described(xr.Dataset(data, coords, {**known, **attrs, **known}))


def unknown_names(dataset: xr.Dataset) -> list[str]:
    """Return the variables, dimensions and attributes that its kind does not name."""
    kind = kind_of_dataset(dataset)
    variables = {one.name: one for one in kind.variables}
    free = {
        str(dim)
        for name, one in dataset.variables.items()
        if name in variables and variables[str(name)].dims.startswith("...")
        for dim in one.dims
    }
    known = {one.name for one in kind.attributes} | {"kind", "schema_version"}
    return [
        *(f"variable {name}" for name in dataset.variables if name not in {*variables, *free}),
        *(f"dimension {name}" for name in dataset.dims if name not in {*kind.dimensions, *free}),
        *(f"attribute {name}" for name in dataset.attrs if name not in known),
    ]


def _check_variable(dataset: xr.Dataset, variable: Variable, kind: Kind) -> None:
    held = dataset.variables[variable.name]
    dims = tuple(str(dim) for dim in held.dims)
    if not variable.lies_on(dims):
        raise InputError(
            f"not of the kind {kind.name}: '{variable.name}' lies on ({', '.join(dims)}), expected "
            f"({', '.join(variable.dims.split())})"
        )
    letter = held.dtype.kind
    if letter not in LETTERS[variable.holds]:
        raise InputError(
            f"not of the kind {kind.name}: '{variable.name}' holds {held.dtype}, expected "
            f"{WORDS[variable.holds]}"
        )
    units = held.attrs.get("units")
    if units != variable.units:
        raise InputError(
            f"not of the kind {kind.name}: '{variable.name}' has the units {units!r}, expected "
            f"{variable.units!r}"
        )


_JSON: Final[dict[str, type[Any]]] = {"object": dict, "list": list}


def check_contents(dataset: xr.Dataset, path: Path) -> xr.Dataset:
    """Return a dataset that holds what its kind needs; one of no kind of driftwalk's as it is.

    Raises
    ------
    FormatError
        When it is of another schema version, a variable or attribute is missing, lies on other
        dimensions, or is text for numbers or numbers for text.
    """
    kind = find_kind(dataset)
    if kind is None:
        return dataset
    refuse_other_version(dataset, path)
    attributes = {one.name: one for one in kind.attributes}
    for needed in kind.read.split():
        if needed not in dataset.variables:
            raise FormatError(
                f"is damaged: its {kind.name} lacks the variable '{needed}'", path=path
            )
    for variable in kind.variables:
        if variable.name in dataset.variables:
            _check_variable(dataset, variable, path)
    for needed in kind.read_attributes.split():
        if needed not in dataset.attrs:
            raise FormatError(
                f"is damaged: its {kind.name} lacks the attribute '{needed}'", path=path
            )
    for key, value in dataset.attrs.items():
        if key in attributes:
            _check_attribute(attributes[str(key)], value, path)
    return dataset


def _check_variable(dataset: xr.Dataset, variable: Variable, path: Path) -> None:
    held = dataset.variables[variable.name]
    dims = tuple(str(dim) for dim in held.dims)
    if not variable.lies_on(dims):
        expected = ", ".join(variable.fixed_dims)
        raise FormatError(
            f"is damaged: '{variable.name}' lies on ({', '.join(dims)}), expected ({expected})",
            path=path,
        )
    if variable.holds == "text":
        if not all(isinstance(value, str) for value in held.values.flat):
            raise FormatError(f"is damaged: '{variable.name}' holds no text", path=path)
    elif held.dtype.kind not in "fiub":
        raise FormatError(f"is damaged: '{variable.name}' holds no numbers", path=path)


def _check_attribute(attribute: Attribute, value: Any, path: Path) -> None:
    name = attribute.name
    if attribute.says == "number":
        if not isinstance(value, (int, float, np.number)):
            raise FormatError(f"is damaged: its attribute '{name}' is not a number", path=path)
    elif attribute.says != "numbers" and not isinstance(value, str):
        raise FormatError(f"is damaged: its attribute '{name}' is not text", path=path)
    if attribute.says in _JSON and value:
        _check_json(name, value, path, holds=attribute.says)


def _check_json(name: str, text: str, path: Path, *, holds: str) -> None:
    try:
        found = parse_json(text)
    except FormatError as error:
        raise FormatError(
            f"is damaged: its attribute '{name}' is not JSON ({error})", path=path
        ) from error
    if not isinstance(found, _JSON[holds]):
        raise FormatError(f"is damaged: its attribute '{name}' holds no JSON {holds}", path=path)
