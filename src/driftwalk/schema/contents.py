"""Required contents of driftwalk's own stored datasets, for the readers that need all of it.

A page makes do with what there is, section by section; a recording, a flow field or a calibration
that work goes on with has no such way out. Only what its reader relies on stands here: further
variables and attributes, of a later version, pass.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.core.errors import FormatError
from driftwalk.core.json_text import parse_json
from driftwalk.schema.calibration import StoredParameter, stored_parameters

if TYPE_CHECKING:
    import xarray as xr

TEXT_VARIABLES: Final = frozenset({"body"})
"""Variables that hold names; all others hold numbers."""
TEXT_ATTRIBUTES: Final = frozenset(
    {"complete", "format", "interrupted", "model", "source", "study", "tracked_from", "y_axis"}
)
NUMBER_ATTRIBUTES: Final = frozenset(
    {"block_side_m", "drag_coefficient", "force_interval_s", "force_std_N", "metres_per_pixel"}
    | {"position_quantum_m", "region_level", "sample_interval_s", "sample_rate_Hz"}
)
JSON_ATTRIBUTES: Final[dict[str, type[Any]]] = {
    "arena": dict,
    "arena_found": dict,
    "counts": dict,
    "tracking_counts": dict,
    "origin_shift_m": list,
    "warnings": list,
}
"""Attributes that hold JSON, and what the text is of."""
_JSON_WORDS: Final[dict[Any, str]] = {dict: "object", list: "list"}


class Contents(NamedTuple):
    """Contents of a kind of dataset."""

    dims: dict[str, str]
    """Variable to its dimensions: ``[time]`` may be there."""
    needed: tuple[str, ...] = ()
    """Variables without which there is nothing to read."""
    attributes: tuple[str, ...] = ()
    """Attributes without which there is nothing to read."""


def _contents(*lines: str, needed: str = "", attributes: str = "") -> Contents:
    """Build contents from lines such as ``"x y theta: time body"``."""
    dims = {}
    for line in lines:
        names, _, on = line.partition(":")
        dims.update(dict.fromkeys(names.split(), on.strip()))
    return Contents(dims, tuple(needed.split()), tuple(attributes.split()))


_GRID: Final = "drag_coefficient force_std"
_FIELD: Final = "[time] y x"

KINDS: Final[dict[str, Contents]] = {
    "trajectory": _contents(
        "x y theta ambiguous: time body",
        "covariance: time body part",
        "time: time",
        "body: body",
        needed="x y theta time body",
    ),
    "simulation": _contents(
        "x y theta: replicate time body",
        "status: replicate",
        "time: time",
        "body: body",
        needed="x y theta time body",
    ),
    "flow_field": _contents(
        f"u v flag u_block v_block count u_standard_error v_standard_error: {_FIELD}",
        "x: x",
        "y: y",
        "time: time",
        needed="u v x y",
    ),
    "calibration": _contents(
        f"ks_distance status: {_GRID}",
        "drag_coefficient: drag_coefficient",
        "force_std: force_std",
        "refined_surface: refined_drag_coefficient refined_force_std",
        "refined_drag_coefficient: refined_drag_coefficient",
        "refined_force_std: refined_force_std",
        "region_drag_coefficient region_force_std: region_vertex",
        needed="ks_distance drag_coefficient force_std",
        attributes="drag_coefficient force_std_N force_interval_s study warnings",
    ),
    "assembly_path": _contents(
        "x y theta assembly: run time block",
        "run: run",
        "time: time",
        "block: block",
        needed="x y theta run time block",
        attributes="block_side_m",
    ),
}


def _calibration_of(parameters: tuple[StoredParameter, ...]) -> Contents:
    """Return what a calibration of a model of the user holds: the same, under its own names."""
    names = " ".join(one.name for one in parameters)
    refined = " ".join(f"refined_{one.name}" for one in parameters)
    return _contents(
        f"ks_distance status: {names}",
        *(f"{one}: {one}" for one in (*names.split(), *refined.split())),
        f"refined_surface: {refined}",
        " ".join(f"region_{one.name}" for one in parameters) + ": region_vertex",
        needed=f"ks_distance {names}",
        attributes=" ".join(one.key for one in parameters) + " study warnings",
    )


def check_contents(dataset: xr.Dataset, path: Path) -> xr.Dataset:
    """Return a dataset that holds what its kind needs; one of no kind of driftwalk's as it is.

    Raises
    ------
    FormatError
        When a variable or attribute is missing, lies on other dimensions, or is text for numbers or
        numbers for text.
    """
    kind = dataset.attrs.get("kind")
    contents = KINDS.get(kind) if isinstance(kind, str) else None
    if kind == "calibration" and "model" in dataset.attrs:
        contents = _calibration_of(stored_parameters(dataset))
    if contents is None:
        return dataset
    for name in contents.needed:
        if name not in dataset.variables:
            raise FormatError(f"is damaged: its {kind} lacks the variable '{name}'", path=path)
    for name, on in contents.dims.items():
        if name in dataset.variables:
            _check_variable(dataset, name, on, path)
    for name in contents.attributes:
        if name not in dataset.attrs:
            raise FormatError(f"is damaged: its {kind} lacks the attribute '{name}'", path=path)
    for name, value in dataset.attrs.items():
        _check_attribute(str(name), value, path)
    return dataset


def _check_variable(dataset: xr.Dataset, name: str, on: str, path: Path) -> None:
    variable = dataset.variables[name]
    dims = tuple(str(dim) for dim in variable.dims)
    optional = {one[1:-1] for one in on.split() if one.startswith("[")} - set(dims)
    expected = tuple(on.replace("[", "").replace("]", "").split())
    if dims != tuple(one for one in expected if one not in optional):
        raise FormatError(
            f"is damaged: '{name}' lies on ({', '.join(dims)}), expected ({', '.join(expected)})",
            path=path,
        )
    if name in TEXT_VARIABLES:
        if not all(isinstance(value, str) for value in variable.values.flat):
            raise FormatError(f"is damaged: '{name}' holds no text", path=path)
    elif variable.dtype.kind not in "fiu":
        raise FormatError(f"is damaged: '{name}' holds no numbers", path=path)


def _check_attribute(name: str, value: Any, path: Path) -> None:
    if name in TEXT_ATTRIBUTES or name in JSON_ATTRIBUTES:
        if not isinstance(value, str):
            raise FormatError(f"is damaged: its attribute '{name}' is not text", path=path)
    elif name in NUMBER_ATTRIBUTES and not isinstance(value, (int, float, np.number)):
        raise FormatError(f"is damaged: its attribute '{name}' is not a number", path=path)
    if name in JSON_ATTRIBUTES and value:
        _check_json(name, value, path)


def _check_json(name: str, text: str, path: Path) -> None:
    expected = JSON_ATTRIBUTES[name]
    try:
        found = parse_json(text)
    except FormatError as error:
        raise FormatError(
            f"is damaged: its attribute '{name}' is not JSON ({error})", path=path
        ) from error
    if not isinstance(found, expected):
        raise FormatError(
            f"is damaged: its attribute '{name}' holds no JSON {_JSON_WORDS[expected]}", path=path
        )
