"""The part of a page on the map of KS distances: its parameters, values, causes, excerpts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.core.arrays import Floats, Integers
from driftwalk.core.errors import InputError
from driftwalk.core.units import percent
from driftwalk.page import parts
from driftwalk.page.arrays import binary_step, encode_array, numbers, plain_list
from driftwalk.page.parts import Section, quantity, require, value_of
from driftwalk.plot.distances import CAUSES, UNKNOWN_CAUSE
from driftwalk.plot.parts.labels import force_interval_text
from driftwalk.schema import body_track
from driftwalk.schema.answers.facts import facts_of
from driftwalk.schema.description import Number
from driftwalk.schema.kinds.fit import PARAMETERS
from driftwalk.schema.parameters import BLOCK, is_block, stored_parameters

if TYPE_CHECKING:
    import xarray as xr


DRAG, FORCE = (PARAMETERS[name] for name in BLOCK)


def page_parameters(calibration: xr.Dataset) -> tuple[Number, ...]:
    """Return the parameters of a calibration, in the order of its dimensions."""
    if is_block(calibration):
        return DRAG, FORCE
    return tuple(Number(one.name, one.unit, one.label) for one in stored_parameters(calibration))


def axis_of(calibration: xr.Dataset, one: Number) -> dict[str, Any]:
    """Return the axis of a map or a chart; the force means nothing without its interval."""
    words, values = one.words, calibration[one.name]
    if one == FORCE and "force_interval_s" in facts_of(calibration):
        words += f", {force_interval_text(calibration)}"
    found = parts.axis(one.name, words, one.unit, values.values)
    return found | ({"log": True} if values.attrs.get("scale") == "log" else {})


def map_section(calibration: xr.Dataset, recording: xr.Dataset | None = None) -> Section:
    """Return the section on the map of KS distances, with all the data for a click on a cell.

    Parameters
    ----------
    calibration : xarray.Dataset
        A `calibration`; one without excerpts or densities gives a map without them.
    recording : xarray.Dataset, optional
        The `trajectory` of one body that it was made from, for an excerpt next to the simulated
        ones, and for the outline of the tank.

    Returns
    -------
    dict
        A section of kind "map": x is the first parameter, y the second; of the block the drag
        coefficient and the stochastic force, as in the paper's Fig. 6 and in the figures of a run.

    Raises
    ------
    InputError
        When the dataset holds no map of two parameters.

    Examples
    --------
    ``map_section(calibration, recording)["value"]``
    """
    up, across = plane_of(calibration)
    require(calibration, "ks_distance", up.name, across.name)
    distance = _plane(calibration, "ks_distance")
    status, causes = _status(calibration, distance)
    cells = _cells(calibration)
    return parts.section(
        "map", "map", "How well each setting explains the recording", _note(calibration, cells),
        x=axis_of(calibration, across),
        y=axis_of(calibration, up),
        value=encode_array(distance),
        standard_error=encode_array(_plane(calibration, "ks_distance_standard_error"))
        if "ks_distance_standard_error" in calibration
        else None,
        status=encode_array(status),
        statuses=causes,
        best=_lowest(calibration, distance, status),
        found=_found(calibration),
        noise_floor=value_of(calibration, "noise_floor"),
        noise_floor_upper=value_of(calibration, "noise_floor_upper"),
        region=region_part(calibration),
        refined=_refined(calibration),
        cells=cells,
        recording=_recording(calibration, recording),
        arena=None if recording is None else parts.arena_part(recording),
    )  # fmt: skip


def plane_of(calibration: xr.Dataset) -> tuple[Number, Number]:
    """Return the parameters along y (the rows) and x (the columns) of every map of a calibration.

    Raises
    ------
    InputError
        When it has not two.
    """
    found = page_parameters(calibration)
    if len(found) != 2:
        raise InputError(f"a map shows two parameters, and the calibration has {len(found)}")
    return found[1], found[0]


def region_part(calibration: xr.Dataset) -> dict[str, Any] | None:
    """Return the border of the joint region, None when there is none."""
    up, across = plane_of(calibration)
    names = (f"region_{across.name}", f"region_{up.name}")
    if not _has(calibration, *names):
        return None
    x, y = (calibration[name].values for name in names)
    known = np.isfinite(x) & np.isfinite(y)
    if known.sum() < 3:
        return None
    return {
        "x": plain_list(x[known]),
        "y": plain_list(y[known]),
        "confidence": value_of(calibration, "confidence"),
    }


def _has(calibration: xr.Dataset, *names: str) -> bool:
    return all(name in calibration.variables for name in names)


def _plane(calibration: xr.Dataset, name: str, prefix: str = "") -> Floats:
    rows = [f"{prefix}{one.name}" for one in plane_of(calibration)]
    return np.asarray(calibration[name].transpose(*rows, ...).values, dtype=np.float64)


def _status(calibration: xr.Dataset, distance: Floats) -> tuple[Integers, dict[str, str]]:
    """Return the reason of every cell, 0 where it is sound, and what the reasons mean."""
    status = np.zeros(distance.shape, dtype=np.int64)
    if "status" in calibration:
        status = np.nan_to_num(_plane(calibration, "status")).astype(np.int64)
    # The bit of a setting without a distance and without a cause.
    status[(status == 0) & ~np.isfinite(distance)] = 8
    return status, {str(code): _cause(int(code)) for code in np.unique(status) if code}


def _cause(status: int) -> str:
    words = [words for bit, (words, _) in CAUSES.items() if status & bit]
    return ", ".join(words) or UNKNOWN_CAUSE[0]


def _lowest(calibration: xr.Dataset, distance: Floats, status: Integers) -> dict[str, float] | None:
    """Return the lowest cell of the map."""
    sound = np.where(status == 0, distance, np.nan)
    if not np.isfinite(sound).any():
        return None
    row, column = np.unravel_index(int(np.nanargmin(sound)), sound.shape)
    up, across = plane_of(calibration)
    return {
        "x": float(calibration[across.name].values[column]),
        "y": float(calibration[up.name].values[row]),
        "value": float(sound[row, column]),
    }


def _found(calibration: xr.Dataset) -> dict[str, Any] | None:
    y, x = (value_of(calibration, one.key) for one in plane_of(calibration))
    return None if x is None or y is None else {"x": x, "y": y}


def _refined(calibration: xr.Dataset) -> dict[str, Any] | None:
    up, across = (f"refined_{one.name}" for one in plane_of(calibration))
    if not _has(calibration, "refined_ks_distance", up, across):
        return None
    return {
        "x": plain_list(calibration[across].values),
        "y": plain_list(calibration[up].values),
        "value": encode_array(_plane(calibration, "refined_ks_distance", "refined_")),
    }


def _cells(calibration: xr.Dataset) -> dict[str, Any] | None:
    """Return what is kept of every setting, None where nothing is."""
    kept: dict[str, Any] = dict.fromkeys(
        ("excerpt_time", "excerpt_x", "excerpt_y", "density", "ks_step_length", "ks_turning_angle")
    )
    if _has(calibration, "excerpt_x", "excerpt_y", "excerpt_time"):
        x, y = (_plane(calibration, f"excerpt_{name}") for name in "xy")
        extents = [float(np.nanmax(v) - np.nanmin(v)) for v in (x, y) if np.isfinite(v).any()]
        # The excerpts extend over five thousand steps or more.
        step = binary_step(max(extents, default=0.0), 5000)
        kept["excerpt_x"] = encode_array(x, step=step)
        kept["excerpt_y"] = encode_array(y, step=step)
        kept["excerpt_time"] = plain_list(calibration["excerpt_time"].values)
    if "step_density" in calibration:
        density = _plane(calibration, "step_density")
        kept["density"] = encode_array(
            # The largest share is two thousand steps or more.
            density,
            step=binary_step(float(np.nanmax(density)), 2000),
        )
    for name in ("ks_step_length", "ks_turning_angle"):
        if name in calibration:
            kept[name] = encode_array(_typical(calibration, name))
    return kept if any(value is not None for value in kept.values()) else None


def _typical(calibration: xr.Dataset, name: str) -> Floats:
    """Return a variable of the replicate whose distance is nearest to the mean of its setting."""
    values = _plane(calibration, name)
    if values.ndim == 2:
        return values
    if "ks_distance_replicate" not in calibration:
        return values[..., 0]
    distance = _plane(calibration, "ks_distance_replicate")
    away = np.abs(distance - _plane(calibration, "ks_distance")[..., None])
    nearest = np.argmin(np.where(np.isfinite(away), away, np.inf), axis=2)
    return np.take_along_axis(values, nearest[..., None], axis=2)[..., 0]


def _recording(calibration: xr.Dataset, recording: xr.Dataset | None) -> dict[str, Any] | None:
    """Return the data shown next to a cell: the recording's density and its first seconds."""
    if not _has(calibration, "recording_step_density", "step_length_edge", "turning_angle_edge"):
        return None
    part: dict[str, Any] = {
        "density": encode_array(calibration["recording_step_density"].values),
        "step_length_edges": plain_list(calibration["step_length_edge"].values),
        "turning_angle_edges": plain_list(calibration["turning_angle_edge"].values),
        "excerpt_x": None,
        "excerpt_y": None,
    }
    if recording is not None and "excerpt_time" in calibration:
        track = body_track(recording)
        until = track.time[0] + float(calibration["excerpt_time"].values.max())
        beginning = track.time <= until + 1e-9
        part["excerpt_x"] = numbers(track.x[beginning])
        part["excerpt_y"] = numbers(track.y[beginning])
    return part


def _note(calibration: xr.Dataset, cells: dict[str, Any] | None) -> str:
    words = [
        "D is the KS distance between the steps of the recording and of a simulation with these "
        "parameters; 1 − D is shown."
    ]
    floor = value_of(calibration, "noise_floor")
    if floor is not None:
        words.append(f"Two runs of the same model are {floor:.3g} apart (noise floor).")
    region = region_part(calibration)
    if region is not None and region["confidence"] is not None:
        words.append(f"The line encloses the joint {percent(region['confidence'])} region.")
    if cells is not None and cells["excerpt_x"] is not None:
        step = quantity(cells["excerpt_x"]["step"], "m", digits=2)
        words.append(f"Click a setting to see its motion (positions to {step}).")
    return " ".join(words)
