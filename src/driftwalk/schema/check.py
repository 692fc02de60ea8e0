"""Whether a dataset is what its kind says, and what its kind says of it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.errors import FormatError, InputError
from driftwalk.core.text_files import parse_json
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
    if (kind := find_kind(dataset)) is not None:
        return kind
    name = kind_name(dataset)
    if name is None:
        raise InputError("not a dataset of driftwalk: it has no attribute 'kind'")
    raise InputError(f"no kind of dataset is called '{name}': there are {', '.join(KINDS)}")


def kind_name(dataset: xr.Dataset) -> str | None:
    """Return what kind a dataset says it is, None where it says nothing."""
    name = dataset.attrs.get("kind")
    return name if isinstance(name, str) else None


def require_kind(
    dataset: xr.Dataset, kinds: str, advice: str = "", *, otherwise: str = ""
) -> xr.Dataset:
    """Return a dataset of a kind, or of one of several; refuse any other.

    Parameters
    ----------
    dataset : xarray.Dataset
        Any dataset.
    kinds : str
        What it has to be: a name, or several separated by spaces.
    advice : str
        How such a dataset is made, for the error.
    otherwise : str
        The whole error, where this one says too little.

    Raises
    ------
    InputError
        When its attribute ``kind`` says something else.
    """
    found = kind_name(dataset)
    if found not in kinds.split():
        wanted, hint = "' or '".join(kinds.split()), f"; {advice}" if advice else ""
        raise InputError(
            otherwise or f"expected a dataset '{wanted}', got {found or 'one of no kind'}{hint}"
        )
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
    for fault in _differences(dataset, found):
        raise InputError(f"not of the kind {found.name}: {fault}")
    return dataset


def refuse_other_version(dataset: xr.Dataset, path: Path | None = None) -> xr.Dataset:
    """Return a dataset, unless it states another schema version than its kind's.

    A dataset without a version passes: a file of another program need not state one.
    """
    kind = KINDS.get(kind_name(dataset) or "")
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


def _differences(dataset: xr.Dataset, kind: Kind) -> Iterator[str]:
    """Yield what is missing, or is not what the schema says."""
    for variable in kind.variables:
        if variable.name in dataset.variables:
            yield from _variable_differences(dataset.variables[variable.name], variable)
        elif not variable.when:
            yield f"the variable '{variable.name}' is missing"
    for attribute in kind.attributes:
        if not attribute.when and attribute.name not in dataset.attrs:
            yield f"the attribute '{attribute.name}' is missing"


def _variable_differences(held: xr.Variable, variable: Variable) -> Iterator[str]:
    name, dims = f"'{variable.name}'", tuple(str(dim) for dim in held.dims)
    if not variable.lies_on(dims):
        expected = ", ".join(variable.dims.split())
        yield f"{name} lies on ({', '.join(dims)}), expected ({expected})"
    if held.dtype.kind not in LETTERS[variable.holds]:
        yield f"{name} holds {held.dtype}, expected {WORDS[variable.holds]}"
    units = held.attrs.get("units")
    if units != variable.units:
        yield f"{name} has the units {units!r}, expected {variable.units!r}"


def check_contents(dataset: xr.Dataset, path: Path) -> xr.Dataset:
    """Return a dataset that holds what its kind needs; one of no kind of driftwalk's as it is.

    For the readers that need all of it. A page makes do with what there is, section by section; a
    recording, a flow field or a calibration that work goes on with has no such way out. Files that
    other programs write in this form hold less than `check_dataset` asks for: here only what a
    reader relies on is needed, and the rest has to be what its name says where it is there.

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
    for fault in _faults(dataset, kind):
        raise FormatError(f"is damaged: {fault}", path=path)
    return dataset


def _faults(dataset: xr.Dataset, kind: Kind) -> Iterator[str]:
    """Yield what is missing, or is not what its name says."""
    for name in kind.read.split():
        if name not in dataset.variables:
            yield f"its {kind.name} lacks the variable '{name}'"
    for variable in kind.variables:
        if variable.name in dataset.variables:
            yield from _variable_faults(dataset.variables[variable.name], variable)
    for name in kind.read_attributes.split():
        if name not in dataset.attrs:
            yield f"its {kind.name} lacks the attribute '{name}'"
    for attribute in kind.attributes:
        if attribute.name in dataset.attrs:
            yield from _attribute_faults(dataset.attrs[attribute.name], attribute)


def _variable_faults(held: xr.Variable, variable: Variable) -> Iterator[str]:
    dims = tuple(str(dim) for dim in held.dims)
    if not variable.lies_on(dims):
        expected = ", ".join(variable.fixed_dims)
        yield f"'{variable.name}' lies on ({', '.join(dims)}), expected ({expected})"
    if variable.holds == "text":
        if not all(isinstance(value, str) for value in held.values.flat):
            yield f"'{variable.name}' holds no text"
    elif held.dtype.kind not in "fiub":
        yield f"'{variable.name}' holds no numbers"


def _attribute_faults(value: Any, attribute: Attribute) -> Iterator[str]:
    name, says = f"its attribute '{attribute.name}'", attribute.says
    if says == "number":
        if not isinstance(value, (int, float, np.number)):
            yield f"{name} is not a number"
    elif says != "numbers" and not isinstance(value, str):
        yield f"{name} is not text"
    elif says in ("object", "list") and value:
        try:
            found = parse_json(value)
        except FormatError as error:
            yield f"{name} is not JSON ({error})"
        else:
            if not isinstance(found, dict if says == "object" else list):
                yield f"{name} holds no JSON {says}"
