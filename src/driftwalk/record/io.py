"""Load a recording: read, convert to SI, clean, place in its arena."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.core.errors import FormatError, InputError, listed
from driftwalk.core.text_files import parse_json
from driftwalk.core.units import parse_quantity
from driftwalk.record.arena import PlacedArena, arena_attributes, place_arena
from driftwalk.record.cleaning.clean import Counts, clean_body
from driftwalk.record.cleaning.clock import check_clock, unwrap_counters
from driftwalk.record.cleaning.jumps import arena_diagonal, impossible_steps, impossible_warning
from driftwalk.record.cleaning.missing import blank_missing, mark_warnings
from driftwalk.record.cleaning.warn import (
    angle_warnings,
    plausibility_warnings,
    refuse_many_bodies,
    refuse_sparse,
)
from driftwalk.record.convert_units import convert_units
from driftwalk.record.pose import join_markers, two_names
from driftwalk.record.raw import DELIMITERS, Array, RawBody, RawRecording, ReadOptions
from driftwalk.record.registry import PLAIN, loaders, origin_of
from driftwalk.schema import Track, build_trajectory
from driftwalk.schema.outliers import without_far_outliers
from driftwalk.schema.tracking_noise import noise_reach

if TYPE_CHECKING:
    import numpy.typing as npt
    import pandas as pd
    import xarray as xr


def load(
    path: str | PathLike[str] | pd.DataFrame | Mapping[str, Any] | npt.NDArray[Any] | Any,
    *,
    format: str | None = None,
    body: str | None = None,
    start: float | None = None,
    stop: float | None = None,
    tank: str | None = None,
    block: float | str | None = None,
    frame_rate: float | None = None,
    metres_per_pixel: float | None = None,
    length_unit: str | None = None,
    y_axis: str | None = None,
    max_speed: float | None = None,
    sort: str = "error",
    columns: Mapping[str, str | int] | None = None,
    delimiter: str | None = None,
    up: str | None = None,
    topic: str | None = None,
    header_line: int | None = None,
    sheet: str | int | None = None,
    x: str | PathLike[str] | None = None,
    y: str | PathLike[str] | None = None,
    theta: str | PathLike[str] | None = None,
    keypoint: str | None = None,
    heading: Sequence[str] | None = None,
    min_confidence: float | None = None,
    box: str | None = None,
    missing: str | Sequence[str] | None = None,
    replicate: int | None = None,
) -> xr.Dataset:
    """Load a recording as a `trajectory` dataset in SI units, y up.

    A recording is a file, or a table in memory. The format is recognised by content. Scale, frame
    rate and arena are never guessed: what the file does not hold has to be given, and the error
    names the argument.

    Parameters
    ----------
    path : path-like, DataFrame, array or mapping
        File (may be gzip-compressed text), or a folder of SwisTrack tracks or matrices, or of a
        ROS 2 bag. Or a table: a DataFrame of pandas or polars, a structured array, an array with a
        row per sample (`columns` name its columns by number, from 1), or a mapping of names to
        columns. Its columns are recognised by their names as those of a CSV file, and not changed.
    format : str, optional
        Name of the format, see `readable_formats`.
    body : str, optional
        Name of the one body to keep; None or ``"all"`` keeps all.
    start, stop : float, optional
        First and last time to keep [s], on the file's clock.
    tank : str, optional
        The tank: ``circle:D``, ``rect:WxH``, ``polygon:FILE`` or ``fit``; see
        `driftwalk.record.arena`. Positions are shifted so that its centre is the origin.
    block : float or str, optional
        Side of a square block, in metres or as ``"3cm"``; makes ``tank="fit"`` give a bound of the
        tank, not of the centres.
    frame_rate : float, optional
        Frames per second [Hz] of a recording that counts frames.
    metres_per_pixel : float, optional
        Scale of a recording in pixels [m].
    length_unit : {"m", "dm", "cm", "mm", "um", "nm", "km", "ft", "in", "yd", "px"}, optional
        Unit of positions in a file that does not say.
    y_axis : {"up", "down"}, optional
        Direction of y in the file; None: down for pixels (y and theta are negated), else up.
    max_speed : float, optional
        The fewest samples without which the body was never faster than this [m/s] become gaps.
    sort : {"error", "sort"}
        Behaviour if times go backwards.
    columns : mapping, optional
        For a plain table: t, frame, x, y, theta, body and other quantities to the name or number
        (from 1) of the column; ``":unit"`` may follow, such as ``{"x": "2:mm"}``. A time may be the
        sum of two, ``{"t": "1:s+2:ns"}``; columns of ``"skip"`` are not read.
    delimiter : str, optional
        Character between fields of a plain table, or ``"tab"``, ``"space"``.
    up : {"x", "y", "z", "-x", "-y", "-z"}, optional
        Axis of a file in space that points up; None: as its format has it. The plane of the water
        is what is seen from its end.
    topic : str, optional
        Topic of a ROS bag that holds several, or more than one with commas between them.
    header_line : int, optional
        Line of a plain table or a sheet, from 1, that names its columns; the data follow it.
    sheet : str or int, optional
        Name or number, from 1, of a workbook's sheet; name of a variable in a MATLAB file; None:
        the only one that holds positions.
    x, y, theta : path-like, optional
        One matrix per coordinate: a row per frame, a column per body.
    keypoint : str, optional
        Keypoint of a pose file that is the body.
    heading : sequence of str, optional
        Two keypoints of a pose file, or two bodies that are markers of one: the orientation is the
        angle from the first to the second, and the body of markers their middle, or `keypoint`.
    min_confidence : float, optional
        Keypoints of a pose file, or rows of a table with a column of confidence, that were seen
        with less are missing, from 0 to 1; None: a value that is usual for the format, and a note
        says which.
    box : str, optional
        What columns of a box hold: ``"xyxy"``, two corners; ``"xywh"``, the corner with the
        smallest x and y, width and height; ``"cxcywh"``, the centre with them; ``"none"``: they are
        not a box. The body is its centre. The size of an image in pixels may follow, of which the
        sides are shares: ``"cxcywh@1920x1080"``.
    missing : str or sequence of str, optional
        Mark of a position that was not seen, in the file's units: a place such as
        ``"0,0"``, a number such as ``"-9999"``, or ``"held"``, the place of the sample before.
    replicate : int, optional
        Replicate of a simulation, counted from 0; default: the first.

    Returns
    -------
    xarray.Dataset
        Dimensions (time, body); what cleaning found stands in ``attrs["counts"]`` as JSON.

    Raises
    ------
    FormatError
        When the file cannot be read; with line and column.
    InputError
        When an argument is missing, wrong, or contradicts the file.

    Examples
    --------
    >>> load({"t": [0.0, 0.1], "x_mm": [10.0, 12.0], "y_mm": [5.0, 5.0]})["x"].values.ravel()
    array([0.01 , 0.012])
    >>> from importlib.resources import files
    >>> recording = files("driftwalk.datasets") / "tank30_ode_a" / "recording.csv"
    >>> load(str(recording), tank="circle:30cm", block="3cm").sizes["time"]
    18001
    """
    block_side = None if block is None else parse_quantity(block, "m")
    if block_side is not None and not (math.isfinite(block_side) and block_side > 0.0):
        raise InputError(f"`block` is the side of a square block, above zero; got {block!r}")
    options = ReadOptions(
        columns={quantity: str(name) for quantity, name in (columns or {}).items()},
        delimiter=DELIMITERS.get(delimiter or "", delimiter),
        up=up,
        topic=topic,
        header_line=header_line,
        sheet=None if sheet is None else str(sheet),
        frame_rate_hz=frame_rate,
        metres_per_pixel=metres_per_pixel,
        length_unit=length_unit,
        x=None if x is None else Path(x),
        y=None if y is None else Path(y),
        theta=None if theta is None else Path(theta),
        keypoint=keypoint,
        heading=two_names(heading),
        min_confidence=min_confidence,
        box=box,
        missing=(missing,) if isinstance(missing, str) else tuple(missing or ()),
        replicate=replicate or 0,
    )
    origin = origin_of(path, options, format=format, replicate=replicate)
    try:
        raw = origin.read(options)
        _refuse_uneven(raw)
        raw.rows = raw.rows or sum({id(one.clock): one.clock.size for one in raw.bodies}.values())
        # Markers become bodies before `body` chooses among the names.
        join_markers(raw, options)
        raw.bodies = _select(raw.bodies, body)
        refuse_many_bodies([one.name for one in raw.bodies])
        _refuse_unused(options, raw, origin.format)
        blank_missing(raw, options.missing)
        raw.notes += [*origin.notes(), *unwrap_counters(raw), *check_clock(raw)]
        raw.notes += [*angle_warnings(raw), *mark_warnings(raw, options.missing)]
        attrs = convert_units(raw, options, y_axis=y_axis, tank=tank)
        cleaned: list[RawBody] = []
        counts: dict[str, Counts] = {}
        while raw.bodies:  # the uncleaned one is let go as soon as its successor is there
            one, found = clean_body(
                raw.bodies.pop(0),
                sort=sort,
                start=start,
                stop=stop,
                max_speed=max_speed,
                quantum=float(str(attrs["position_quantum_m"])),
                separate=raw.separate,
                columns=raw.body_columns,
            )
            cleaned.append(one)
            counts[one.name] = found
        if not any(body.clock.size for body in cleaned):
            if start is not None or stop is not None:
                raise InputError("no sample lies between `start` and `stop`")
            raise InputError("the recording has no row with a time")
        attrs |= {"source": origin.name, "format": origin.format}
        if raw.columns:
            attrs["columns_read"] = json.dumps(raw.columns, ensure_ascii=False)
        return _assemble(cleaned, counts, attrs, raw, tank=tank, block_side=block_side)
    except InputError as error:
        raise origin.explained(error) from error


def readable_formats() -> dict[str, str]:
    """Return every readable format and its description.

    Examples
    --------
    >>> readable_formats()["driftwalk"]
    "driftwalk's own NetCDF"
    """
    return {name: loader.description for name, loader in loaders().items()}


def _refuse_uneven(raw: RawRecording) -> None:
    """Refuse a body whose columns have unequal numbers of values."""
    for one in raw.bodies:
        columns = {"time": one.clock, "x": one.x, "y": one.y, "theta": one.theta}
        sizes = {name: len(column) for name, column in columns.items() if column is not None}
        if len(set(sizes.values())) > 1:
            counts = ", ".join(f"{size} of {name}" for name, size in sizes.items())
            what = f"body '{one.name}' has unequal numbers of values: {counts}"
            raise FormatError(f"is no recording of poses: {what}")


def _refuse_unused(options: ReadOptions, raw: RawRecording, format: str) -> None:
    """Refuse what says something about a file that this file has not."""
    uses = (
        ("up", "positions with three axes", bool(raw.plane)),
        ("topic", "ROS bags", format == "ros"),
        ("header_line", "plain tables", format in (PLAIN, "excel")),
        ("box", "tables", bool(raw.columns)),
        ("sheet", "workbooks, MATLAB files and arrays", format in ("excel", "matlab", "arrays")),
    )
    for name, what, known in uses:
        if getattr(options, name) is not None and not known:
            raise InputError(f"`{name}` is for {what}, and this is '{format}': leave it out")


def _select(bodies: list[RawBody], wanted: str | None) -> list[RawBody]:
    if wanted is None or wanted == "all":
        return bodies
    chosen = [body for body in bodies if body.name == wanted]
    if not chosen:
        names = listed([body.name for body in bodies])
        raise InputError(f"`body` '{wanted}': no such body in the recording; it has {names}")
    return chosen


def _assemble(
    bodies: list[RawBody],
    counts: dict[str, Counts],
    attrs: dict[str, Any],
    raw: RawRecording,
    *,
    tank: str | None,
    block_side: float | None,
) -> xr.Dataset:
    """Place the bodies in their arena and on one clock, and write down what was done."""
    notes, arena = list(raw.notes), None
    if block_side is not None:
        attrs["block_side_m"] = block_side
    if tank is not None:
        placed = _place(tank, bodies, block_side=block_side)
        arena = placed.arena
        if placed.origin != (0.0, 0.0):
            for one in bodies:
                one.x -= placed.origin[0]
                one.y -= placed.origin[1]
        before = parse_json(attrs.get("origin_shift_m", "[0.0, 0.0]"))
        attrs |= arena_attributes(placed, shifted_before=before)
        notes += placed.notes
    jumps = _count_impossible(bodies, counts, arena)
    totals = {key: sum(getattr(one, key) for one in counts.values()) for key in vars(Counts())}
    # The differences are the median's own to sort: a long recording is not to be held twice.
    steps = (np.diff(body.clock) for body in bodies if body.clock.size > 1)
    intervals = [float(np.median(step, overwrite_input=True)) for step in steps]
    if twice := totals["times_in_two_places"]:
        notes.append(f"times with rows in different places, of which the last is kept: {twice}")
    notes += [*plausibility_warnings(bodies, intervals), *jumps]
    time, x, y, theta = _one_clock(bodies)
    if "sample_rate_Hz" not in attrs and time.size > 1:
        attrs["sample_rate_Hz"] = float(1.0 / np.median(intervals)) if intervals else 0.0
    per_body = {name: vars(found) for name, found in counts.items()}
    said = {"rows_in_file": raw.rows, **totals, "per_body": per_body, "warnings": notes}
    attrs["counts"] = json.dumps(said)
    recording = build_trajectory(time, x, y, theta, body=[one.name for one in bodies], attrs=attrs)
    for name, meaning in raw.extra.items():
        values = _on_clock(time, bodies, [body.extra[name] for body in bodies])
        recording[name] = (("time", "body", *meaning.dims), values, meaning.attrs)
        recording = recording.assign_coords(meaning.coords)
    return recording


def _count_impossible(
    bodies: list[RawBody], counts: dict[str, Counts], arena: dict[str, Any] | None
) -> list[str]:
    """Count the impossible steps of each body; return what to say of them."""
    diagonal = arena_diagonal([body.x for body in bodies], [body.y for body in bodies], arena)
    said = []
    for body in bodies:
        if (steps := impossible_steps(body.clock, body.x, body.y, diagonal=diagonal)) is not None:
            counts[body.name].impossible_steps = steps.number
            said.append(impossible_warning(body.name, steps))
    return said


def _place(tank: str, bodies: list[RawBody], *, block_side: float | None) -> PlacedArena:
    def reach(size: float) -> float:
        return max(noise_reach(_track(body), size=size) for body in bodies)

    # One sample in a thousand beyond the wall moves the centre: mistakes of a tracker may be more.
    sound = [without_far_outliers(_track(body)) for body in bodies]
    x, y = (np.concatenate([getattr(one, axis) for one in sound]) for axis in ("x", "y"))
    return place_arena(tank, x, y, block_side=block_side, reach=reach)


def _track(body: RawBody) -> Track:
    """Return the samples of a body that have a position, without its angle."""
    known = np.isfinite(body.x)
    x, y = body.x[known], body.y[known]
    return Track(body.clock[known], x, y, np.full(x.size, np.nan))


def _one_clock(bodies: list[RawBody]) -> tuple[Array, Array, Array, Array | None]:
    """Return the union of the clocks and the columns on it, which several bodies then lose."""
    has_theta = any(body.theta is not None for body in bodies)
    if len(bodies) == 1:
        return bodies[0].clock, bodies[0].x, bodies[0].y, bodies[0].theta
    time, *others = {id(body.clock): body.clock for body in bodies}.values()
    if not all(np.array_equal(time, clock) for clock in others):
        time = np.unique(np.concatenate([time, *others]))
    refuse_sparse(time, bodies)
    x, y = (_on_clock(time, bodies, [vars(body).pop(axis) for body in bodies]) for axis in "xy")
    theta = _on_clock(time, bodies, [body.theta for body in bodies]) if has_theta else None
    return time, x, y, theta


def _on_clock(time: Array, bodies: list[RawBody], values: Sequence[Array | None]) -> Array:
    """Return values of each body on a common clock, shape (time, body, ...); NaN where none is."""
    shape = next(one.shape[1:] for one in values if one is not None)
    columns = np.full((time.size, len(bodies), *shape), np.nan)
    for index, (body, one) in enumerate(zip(bodies, values, strict=True)):
        if one is not None:
            whole = body.clock.size == time.size  # so it is the common clock
            columns[slice(None) if whole else np.searchsorted(time, body.clock), index] = one
    return columns
