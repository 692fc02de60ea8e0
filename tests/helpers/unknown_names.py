"""Names in a dataset that its kind does not describe."""

from __future__ import annotations

import xarray as xr

from driftwalk.schema.check import kind_of_dataset


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
