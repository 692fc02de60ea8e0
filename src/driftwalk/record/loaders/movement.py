"""NetCDF of the `movement` package: ``position`` over time, space, keypoint and individual."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from driftwalk.core.errors import FormatError, InputError
from driftwalk.record.raw import Array, RawBody, RawRecording, ReadOptions
from driftwalk.schema.netcdf import MAGIC, open_netcdf, read_attributes

if TYPE_CHECKING:
    import xarray as xr


class MovementLoader:
    """Positions in pixels unless another unit is given; seconds, or frames with a rate."""

    name = "movement"
    description = "movement NetCDF (position over time, space, keypoint, individual; pixels)"

    def sniff(self, head: bytes, path: Path) -> float:
        """Recognise the attributes that `movement` writes."""
        attributes = read_attributes(path) if head.startswith(MAGIC) else {}
        return 0.9 if {"time_unit", "ds_type"} & set(attributes) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every individual; of several keypoints one has to be named."""
        dataset = open_netcdf(path)
        if "position" not in dataset or not {"time", "space"} <= set(dataset["position"].dims):
            raise FormatError("has no variable 'position' over time and space", path=path)
        for name in ("position", *({"time"} & set(map(str, dataset.coords)))):
            if dataset[name].dtype.kind not in "fiu":
                raise FormatError(f"'{name}' holds no numbers", path=path)
        position = _choose_keypoint(dataset["position"], options.keypoint)
        individual = _dimension(position, "individual")
        if individual is None:
            position, individual = position.expand_dims(individual=["0"]), "individual"
        space = [str(axis) for axis in position["space"].values]
        if not {"x", "y"} <= set(space):
            raise FormatError(f"the dimension 'space' has {space}, expected x and y", path=path)
        values = position.transpose("time", "space", individual).values.astype(np.float64)
        time, unit = _clock(dataset)
        names = (
            [str(name) for name in position[individual].values]
            if individual in position.coords
            else [str(index) for index in range(values.shape[2])]
        )
        bodies = [
            RawBody(
                name,
                time,
                np.ascontiguousarray(values[:, space.index("x"), index]),
                np.ascontiguousarray(values[:, space.index("y"), index]),
            )
            for index, name in enumerate(names)
        ]
        rate = dataset.attrs.get("fps")
        return RawRecording(
            bodies,
            clock_unit=unit,
            length_unit=options.length_unit or "px",
            frame_rate_hz=float(rate) if rate is not None and unit == "frame" else None,
            rows=time.size,
        )


def _dimension(position: xr.DataArray, name: str) -> str | None:
    """Return the dimension under its present name or its former plural."""
    return next((str(dim) for dim in position.dims if dim in (name, f"{name}s")), None)


def _choose_keypoint(position: xr.DataArray, keypoint: str | None) -> xr.DataArray:
    dimension = _dimension(position, "keypoint")
    if dimension is None:
        return position
    count = position.sizes[dimension]
    names = (
        [str(name) for name in position[dimension].values]
        if dimension in position.coords
        else [str(index) for index in range(count)]
    )
    if keypoint is None and count == 1:
        return position.isel({dimension: 0}, drop=True)
    if keypoint not in names:
        got = "" if keypoint is None else f" (got '{keypoint}')"
        raise InputError(f"name the body's keypoint with `keypoint`{got}: {', '.join(names)}")
    return position.isel({dimension: names.index(keypoint)}, drop=True)


def _clock(dataset: xr.Dataset) -> tuple[Array, str]:
    """Return the time stamps and their unit."""
    if "time" not in dataset.coords:
        return np.arange(dataset.sizes["time"], dtype=np.float64), "frame"
    unit = "s" if str(dataset.attrs.get("time_unit", "")).startswith("s") else "frame"
    return np.asarray(dataset["time"].values, dtype=np.float64), unit


LOADER = MovementLoader()
