"""Required contents of driftwalk's own stored datasets, for the readers that need all of it.

A page makes do with what there is, section by section; a recording, a flow field or a calibration
that work goes on with has no such way out. Files that other programs write in this form hold less
than `driftwalk.schema.check_dataset` asks for: here only what a reader relies on is needed, and the
rest has to be what its name says where it is there.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.errors import FormatError
from driftwalk.core.text.json_text import parse_json
from driftwalk.schema.check import refuse_other_version
from driftwalk.schema.description import Attribute, Variable
from driftwalk.schema.kinds import find_kind

if TYPE_CHECKING:
    import xarray as xr

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
