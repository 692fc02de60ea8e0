"""NetCDF of the `movement` package: ``position`` over time, space, keypoint and individual.

Dimensions are ``keypoints`` and ``individuals``, or the same in the singular; bounding boxes have
no keypoints. Where driftwalk wrote the file, positions state their unit, an ``orientation`` lies
next to them, and an attribute holds what was known of the recording.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.errors import FormatError
from driftwalk.core.text.json_text import parse_json
from driftwalk.record.pose import Confidence, Point, choose_keypoints, recording_of_poses
from driftwalk.record.raw import LENGTH_UNITS, Array, Marks, RawRecording, ReadOptions
from driftwalk.schema.stores.netcdf import MAGIC, open_netcdf, text_attribute

if TYPE_CHECKING:
    import xarray as xr

SINGLE: Final = "centroid"
"""Name of the one point of a bounding box."""
SLEAP: Final = Confidence(0.2, "SLEAP's threshold of peaks")
USUAL: Final = Confidence(0.6, "movement's threshold")

TEXTS: Final = (
    *("arena", "arena_found", "origin_shift_m", "simulated", "tracked_from", "complete"),
    *("interrupted", "block_shape"),
)
NUMBERS: Final = (
    *("block_side_m", "block_width_m", "block_mass_kg", "metres_per_pixel", "position_quantum_m"),
    *("sample_rate_Hz", "time_origin_unix_s"),
)
"""Attributes that are taken over of a recording that driftwalk wrote in this format."""


class MovementLoader:
    """Positions in pixels unless the file or an option says another unit."""

    name = "movement"
    description = "movement NetCDF (position over time, space, keypoints, individuals; pixels)"
    marks = (Marks("HDF5", ("position", "time", "space", "ds_type", "time_unit")),)

    def sniff(self, head: bytes, path: Path) -> float:
        """Recognise the attributes that `movement` writes."""
        names = ("time_unit", "ds_type")
        known = head.startswith(MAGIC) and any(text_attribute(path, name) for name in names)
        return 0.9 if known else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every individual; of several keypoints one has to be named."""
        dataset = open_netcdf(path)
        position = _array(dataset, "position")
        if not {"time", "space"} <= set(position.dims):
            raise FormatError("has no variable 'position' over time and space")
        space = [str(axis) for axis in position["space"].values]
        if not {"x", "y"} <= set(space):
            raise FormatError(f"the dimension 'space' has {space}, expected x and y")
        position = _in_order(position, "space")
        confidence = _in_order(_array(dataset, "confidence")) if "confidence" in dataset else None
        if confidence is not None and confidence.shape != (position.shape[0], *position.shape[2:]):
            raise FormatError("'confidence' has another shape than 'position'")

        def read_point(place: tuple[int, int]) -> Point:
            point = position.values[:, :, *place].astype(np.float64)
            known = None if confidence is None else confidence.values[:, *place].astype(np.float64)
            x, y = (np.ascontiguousarray(point[:, space.index(axis)]) for axis in ("x", "y"))
            return x, y, known

        keypoints, individuals = (_names(position, name) for name in ("keypoint", "individual"))
        places = {
            individual: {keypoint: (at, of) for at, keypoint in enumerate(keypoints)}
            for of, individual in enumerate(individuals)
        }
        time, unit = _clock(dataset)
        sleap = str(dataset.attrs.get("source_software")) == "SLEAP"
        chosen = choose_keypoints(keypoints, options)
        usual = SLEAP if sleap else USUAL
        raw = recording_of_poses(places, read_point, chosen, time, options, usual=usual)
        own = "driftwalk" in dataset.attrs
        # Other programs may call something else so.
        if own and "orientation" in dataset and chosen.heading is None:
            angles = _orientation(dataset, individuals)
            for body in raw.bodies:
                theta = angles[body.name]
                body.theta = theta if np.isfinite(theta).any() else None
        rate = dataset.attrs.get("fps")
        units = (*LENGTH_UNITS, "px")
        stated = next((one for one in units if one == position.attrs.get("units")), None)
        return replace(
            raw,
            clock_unit=unit,
            length_unit=stated or options.length_unit or "px",
            frame_rate_hz=float(rate) if rate is not None and unit == "frame" else None,
            attrs=_known(dataset, path) if own else {},
        )


def _orientation(dataset: xr.Dataset, individuals: list[str]) -> dict[str, Array]:
    """Return the angles [rad] of every individual, which driftwalk writes next to the positions."""
    angles = _array(dataset, "orientation")
    if sorted(map(str, angles.dims)) != ["individuals", "time"]:
        raise FormatError("'orientation' is not over time and individuals")
    if angles.attrs.get("units") != "rad":
        raise FormatError("'orientation' does not state its unit, rad")
    values = angles.transpose("time", "individuals").values.astype(np.float64)
    return {name: np.ascontiguousarray(values[:, at]) for at, name in enumerate(individuals)}


def _known(dataset: xr.Dataset, path: Path) -> dict[str, Any]:
    """Return what driftwalk knew of the recording when it wrote the file."""
    known = parse_json(str(dataset.attrs["driftwalk"]), path=path)
    if not isinstance(known, dict):
        raise FormatError("the attribute 'driftwalk' is no JSON object")
    texts = {key: known[key] for key in TEXTS if isinstance(known.get(key), str)}
    numbers = {key: known[key] for key in NUMBERS if type(known.get(key)) in (int, float)}
    return {**texts, **numbers}


def _array(dataset: xr.Dataset, name: str) -> xr.DataArray:
    if name not in dataset:
        raise FormatError(f"has no variable '{name}' over time and space")
    if dataset[name].dtype.kind not in "fiu":
        raise FormatError(f"'{name}' holds no numbers")
    return dataset[name]


def _in_order(values: xr.DataArray, *further: str) -> xr.DataArray:
    """Return an array over time, further dimensions, keypoint and individual.

    A dimension that is missing has the length one; its name is the singular or the plural.
    """
    values = values.rename(
        {dim: str(dim)[:-1] for dim in values.dims if dim in ("keypoints", "individuals")}
    )
    missing = {
        name: [only]
        for name, only in (("keypoint", SINGLE), ("individual", "0"))
        if name not in values.dims
    }
    values = values.expand_dims(missing)
    order = ("time", *further, "keypoint", "individual")
    if sorted(map(str, values.dims)) != sorted(order):
        found = ", ".join(map(str, values.dims))
        raise FormatError(f"'{values.name}' is over {found}, expected {', '.join(order)}")
    return values.transpose(*order)


def _names(values: xr.DataArray, dimension: str) -> list[str]:
    if dimension in values.coords:
        return [str(name) for name in values[dimension].values]
    return [str(index) for index in range(values.sizes[dimension])]


def _clock(dataset: xr.Dataset) -> tuple[Array, str]:
    """Return the time stamps and their unit."""
    if "time" not in dataset.coords:
        return np.arange(dataset.sizes["time"], dtype=np.float64), "frame"
    unit = "s" if str(dataset.attrs.get("time_unit", "")).startswith("s") else "frame"
    return np.asarray(_array(dataset, "time").values, dtype=np.float64), unit


LOADER = MovementLoader()
