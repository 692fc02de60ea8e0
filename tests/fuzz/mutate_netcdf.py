"""Damage to what a NetCDF file says: variables, dimensions, attributes; the file stays valid."""

from __future__ import annotations

import random
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5netcdf
import h5py
import numpy as np
import xarray as xr

SIZES = [10**5, 10**8, 10**10, 10**13, 2**40 + 1]
VALUES: list[Any] = [
    *(
        "",
        "not this",
        "{",
        "[]",
        "{}",
        "null",
        "[" * 3000,
        "9" * 5000,
        '{"shape": "circle"}',
        "nan",
    ),
    *(0, -1, 2**62, 0.0, -1.0, float("nan"), float("inf"), 1e300),
    *(np.array([1.0, 2.0, 3.0]), np.array([], dtype=float), np.array([np.nan, 1.0])),
    *(
        '["a"]',
        '{"shape": "circle"}',
        "[1, 2]",
        '{"rows": "x"}',
        "a" * 70_000,
        b"\xff\xfe",
        "\x1b[31m",
        "\x00",
    ),
]


def damage(path: Path, rng: random.Random) -> None:
    """Change a NetCDF file in one place, sometimes in several."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for _ in range(rng.choice([1, 1, 1, 2])):
            rng.choice([_through_xarray, _through_xarray, _through_hdf5, _huge, _attribute])(
                path, rng
            )


def _through_xarray(path: Path, rng: random.Random) -> None:
    with xr.open_dataset(path, engine=_engine(path), decode_times=False) as stored:
        dataset = stored.load()
    change: Callable[[xr.Dataset, random.Random], xr.Dataset] = rng.choice(CHANGES)
    changed = change(dataset, rng)
    path.unlink()
    if _engine_kept(changed, rng):
        changed.to_netcdf(path, engine="h5netcdf")
    else:
        changed.to_netcdf(path, engine="scipy", format="NETCDF3_64BIT")


def _engine(path: Path) -> str:
    return "h5netcdf" if path.read_bytes()[:4] == b"\x89HDF" else "scipy"


def _engine_kept(dataset: xr.Dataset, rng: random.Random) -> bool:
    plain = all(v.dtype.kind in "fi" and v.size for v in dataset.variables.values())
    return not plain or rng.random() < 0.8


def _name(dataset: xr.Dataset, rng: random.Random) -> str:
    return str(rng.choice(sorted(map(str, dataset.variables))))


def _drop(dataset: xr.Dataset, rng: random.Random) -> xr.Dataset:
    return dataset.drop_vars(_name(dataset, rng))


def _rename(dataset: xr.Dataset, rng: random.Random) -> xr.Dataset:
    return dataset.rename_vars({_name(dataset, rng): "other"})


def _rename_dimension(dataset: xr.Dataset, rng: random.Random) -> xr.Dataset:
    dims = sorted(map(str, dataset.dims))
    return dataset.rename({rng.choice(dims): "other"}) if dims else dataset


def _transpose(dataset: xr.Dataset, rng: random.Random) -> xr.Dataset:
    name = _name(dataset, rng)
    variable = dataset[name].variable
    return dataset.drop_vars(name).assign({name: variable.transpose(*variable.dims[::-1])})


def _one(dataset: xr.Dataset, rng: random.Random) -> xr.Dataset:
    """Make one value of a variable."""
    name = _name(dataset, rng)
    variable = dataset[name].variable
    if not variable.size:
        return dataset
    return dataset.drop_vars(name).assign({name: variable[(0,) * variable.ndim]})


def _text(dataset: xr.Dataset, rng: random.Random) -> xr.Dataset:
    name = _name(dataset, rng)
    variable = dataset[name].variable
    other = (variable.dims, np.full(variable.shape, rng.choice(["x", "", "+"]), dtype=object))
    return dataset.drop_vars(name).assign({name: other})


def _numbers(dataset: xr.Dataset, rng: random.Random) -> xr.Dataset:
    """Give a variable other values: all alike, or a few of them."""
    name = _name(dataset, rng)
    variable = dataset[name].variable
    value = rng.choice([np.nan, np.inf, -np.inf, 0.0, -1.0, 1e300, 1e-300, 2.0**31, 1e9, 0.5])
    whole = variable.dtype.kind in "iu" and np.isfinite(value) and rng.random() < 0.8
    if whole:
        limits = np.iinfo(variable.dtype)
        value = int(min(max(value, limits.min), limits.max))
    values = (
        np.array(variable.values, dtype=variable.dtype if whole else float)
        if variable.dtype.kind in "fiub"
        else np.zeros(variable.shape)
    )
    if rng.random() < 0.5 or not values.size:
        values[...] = value
    else:
        values.flat[rng.randrange(values.size)] = value
    return dataset.drop_vars(name).assign({name: (variable.dims, values, variable.attrs)})


def _shorten(dataset: xr.Dataset, rng: random.Random) -> xr.Dataset:
    dims = sorted(map(str, dataset.dims))
    return dataset.isel({rng.choice(dims): slice(0, rng.choice([0, 1, 2]))}) if dims else dataset


def _reverse(dataset: xr.Dataset, rng: random.Random) -> xr.Dataset:
    dims = sorted(map(str, dataset.dims))
    return dataset.isel({rng.choice(dims): slice(None, None, -1)}) if dims else dataset


def _same_names(dataset: xr.Dataset, rng: random.Random) -> xr.Dataset:
    """Give all along a dimension the same coordinate."""
    dims = sorted(set(map(str, dataset.dims)) & set(map(str, dataset.coords)))
    if not dims:
        return dataset
    dim = rng.choice(dims)
    return (
        dataset.assign_coords({dim: dataset[dim].values[[0] * dataset.sizes[dim]]})
        if dataset.sizes[dim]
        else dataset
    )


CHANGES = [
    *(_drop, _drop, _rename, _rename_dimension, _transpose, _one, _text, _text),
    *(_numbers, _numbers, _numbers, _shorten, _shorten, _reverse, _same_names),
]


def _attribute(path: Path, rng: random.Random) -> None:
    if _engine(path) != "h5netcdf":
        return _through_xarray(path, rng)
    with h5py.File(path, "r+") as file:
        names = [None, None, *file]
        chosen = rng.choice(names)
        holder = file if chosen is None else file[chosen]
        known = [name for name in holder.attrs if name not in _STRUCTURE] or ["kind"]
        name = rng.choice([*known, *known, "scale_factor", "_FillValue", "units", "coordinates"])
        if rng.random() < 0.3 and name in holder.attrs:
            del holder.attrs[name]
            return None
        value = rng.choice(VALUES)
        if isinstance(value, str) and "\x00" in value:
            value = np.bytes_(b"a\x00b")
        holder.attrs[name] = h5py.Empty("f8") if rng.random() < 0.1 else _storable(value)
    return None


_STRUCTURE = {
    "DIMENSION_LIST",
    "REFERENCE_LIST",
    "CLASS",
    "NAME",
    "_Netcdf4Dimid",
    "_Netcdf4Coordinates",
    "_NCProperties",
}


def _storable(value: Any) -> Any:
    """Return a value that fits beside the others: an attribute holds 64 kB at most."""
    return value[:50_000] if isinstance(value, str) else value


def _through_hdf5(path: Path, rng: random.Random) -> None:
    """Put something else where HDF5 has a variable or an entry of NetCDF's own."""
    if _engine(path) != "h5netcdf":
        return _through_xarray(path, rng)
    with h5py.File(path, "r+") as file:
        name = rng.choice(list(file))
        what = rng.randrange(6)
        if what == 0:
            shape = tuple(rng.choice(SIZES) for _ in range(rng.choice([1, 2])))
            del file[name]
            file.create_dataset(name, shape, "f8", chunks=(1000,) * len(shape))
        elif what == 1:
            del file[name]
            file.create_dataset(name, data=np.zeros(3, dtype=[("a", "f8"), ("b", "S3")]))
        elif what == 2:
            del file[name]
            file.create_group(name)
        elif what == 3:
            del file[name]
            file[name] = h5py.SoftLink("/nowhere") if rng.random() < 0.5 else h5py.SoftLink("/")
        elif what == 4:
            del file[name]
            file.create_dataset(name, data=h5py.Empty("f8"))
        else:
            entry = file[name]
            known = list(_STRUCTURE & set(entry.attrs))
            if known:
                del entry.attrs[rng.choice(known)]
    return None


def _huge(path: Path, rng: random.Random) -> None:
    """Declare that a dimension is huge; nothing of it is stored."""
    if _engine(path) != "h5netcdf":
        content = path.read_bytes()
        at = 20 + rng.randrange(40)
        path.write_bytes(content[:at] + b"\x7f\xff\xff\xff" + content[at + 4 :])
        return
    with xr.open_dataset(path, engine="h5netcdf", decode_times=False) as stored:
        dataset = stored.load()
    if not dataset.dims:
        return
    long, size = rng.choice(sorted(map(str, dataset.dims))), rng.choice(SIZES)
    path.unlink()
    with h5netcdf.File(path, "w") as file:
        sizes = {str(name): number for name, number in dataset.sizes.items()} | {long: size}
        file.dimensions = sizes
        for name, variable in dataset.variables.items():
            dims = tuple(map(str, variable.dims))
            text = variable.dtype.kind in "OU"
            made = file.create_variable(
                str(name),
                dims,
                h5py.string_dtype() if text else variable.dtype,
                chunks=tuple(min(sizes[dim], 100) or 1 for dim in dims) or None,
            )
            if long not in dims and variable.size:
                made[...] = variable.values
        for key, value in dataset.attrs.items():
            file.attrs[str(key)] = value
