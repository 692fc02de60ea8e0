"""Motion as files of other programs: plain CSV, trackpy's table, movement's NetCDF, a ROS 2 bag."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Integers
from driftwalk.core.errors import InputError
from driftwalk.core.files.atomic import atomic_path, require_free, write_atomic
from driftwalk.core.text_files import json_value
from driftwalk.export.data.motion import Motion, frame_numbers, frame_rate
from driftwalk.schema import body_names
from driftwalk.schema.stores.netcdf import netcdf_bytes

if TYPE_CHECKING:
    import xarray as xr

ROWS_AT_ONCE: Final = 200_000
"""Rows that are written at once: the memory for a long recording stays bounded. Chosen by hand."""


def write_csv(motion: Motion, folder: Path) -> list[Path]:
    """Write driftwalk's plain CSV: t_s, x_m, y_m, theta_rad, body.

    Parameters
    ----------
    motion : Motion
        What to write.
    folder : Path
        Where to write.

    Returns
    -------
    list of Path
        The file, ``NAME.csv``.

    Raises
    ------
    InputError
        When the file exists.

    Examples
    --------
    >>> write_csv(Motion("recording", trajectory), Path("out"))  # doctest: +SKIP
    [PosixPath('out/recording.csv')]
    """
    from driftwalk.record import save_trajectory

    return [save_trajectory(motion.recording, folder / f"{motion.name}.csv")]


def write_trackpy(motion: Motion, folder: Path) -> list[Path]:
    """Write the table of linked features that trackpy works on, in metres.

    Its columns ``y``, ``x``, ``frame`` and ``particle`` are trackpy's. ``time_s`` holds the time as
    the recording has it, and ``theta_rad`` the orientation where there is one; trackpy leaves both
    alone. driftwalk reads the file again as a plain table, without options.

    Parameters
    ----------
    motion : Motion
        What to write.
    folder : Path
        Where to write.

    Returns
    -------
    list of Path
        The file, ``NAME.trackpy.csv``.

    Raises
    ------
    InputError
        When the file exists.

    Examples
    --------
    >>> write_trackpy(Motion("recording", trajectory), Path("out"))  # doctest: +SKIP
    [PosixPath('out/recording.trackpy.csv')]
    """
    import pandas as pd

    recording = motion.recording
    target = folder / f"{motion.name}.trackpy.csv"
    require_free(target, existing="error")
    time = recording["time"].values
    frames = frame_numbers(recording)
    particles = particle_numbers(recording)
    oriented = bool(np.isfinite(recording["theta"].values).any())
    with atomic_path(target) as partial, partial.open("w", encoding="utf-8", newline="") as file:
        for first in range(0, max(time.size, 1), ROWS_AT_ONCE):
            block = slice(first, first + ROWS_AT_ONCE)
            x, y, theta = (recording[name].values[block] for name in ("x", "y", "theta"))
            row, body = np.nonzero(np.isfinite(x) & np.isfinite(y))
            values: dict[str, npt.NDArray[np.generic]] = {
                "y": y[row, body],
                "x": x[row, body],
                "frame": frames[block][row],
                "particle": particles[body],
                "time_s": time[block][row],
            }
            if oriented:
                values["theta_rad"] = theta[row, body]
            pd.DataFrame(values).to_csv(file, index=False, header=first == 0)
    return [target]


def particle_numbers(recording: xr.Dataset) -> Integers:
    """Return the whole number that names each body for trackpy.

    Bodies whose names are such numbers keep them; others are counted from 0.

    Parameters
    ----------
    recording : xarray.Dataset
        Kind "trajectory".

    Examples
    --------
    >>> from driftwalk.schema import build_trajectory
    >>> pair = build_trajectory([0.0], [[0.0, 1.0]], [[0.0, 1.0]], body=["7", "3"])
    >>> particle_numbers(pair).tolist()
    [7, 3]
    """
    names = body_names(recording)
    if all(_is_number(name) for name in names):
        return np.array([int(name) for name in names], dtype=np.int64)
    return np.arange(len(names), dtype=np.int64)


def _is_number(name: str) -> bool:
    """Whether a name is a whole number as it would be written again."""
    return name.isascii() and name.isdecimal() and len(name) <= 15 and str(int(name)) == name


def write_movement(motion: Motion, folder: Path) -> list[Path]:
    """Write NetCDF as movement 0.15 does: positions of one keypoint, the body's centre.

    Numbers are double. Positions are in metres, as their attribute ``units`` says, with y up; the
    orientation is the further variable ``orientation``. The attribute ``driftwalk`` holds what was
    known of the recording as JSON, and driftwalk takes it over when it reads the file again.

    Parameters
    ----------
    motion : Motion
        What to write.
    folder : Path
        Where to write.

    Returns
    -------
    list of Path
        The file, ``NAME.movement.nc``.

    Raises
    ------
    InputError
        When the file exists.

    Examples
    --------
    >>> write_movement(Motion("recording", trajectory), Path("out"))  # doctest: +SKIP
    [PosixPath('out/recording.movement.nc')]
    """
    target = folder / f"{motion.name}.movement.nc"
    require_free(target, existing="error")
    write_atomic(target, netcdf_bytes(movement_dataset(motion.recording)))
    return [target]


def movement_dataset(recording: xr.Dataset) -> xr.Dataset:
    """Return a recording as a dataset of poses in movement's form.

    Parameters
    ----------
    recording : xarray.Dataset
        Kind "trajectory".

    Examples
    --------
    >>> from driftwalk.schema import build_trajectory
    >>> dict(movement_dataset(build_trajectory([0.0], [0.1], [0.2])).sizes)
    {'time': 1, 'space': 2, 'keypoints': 1, 'individuals': 1}
    """
    import xarray as xr

    x, y, theta = (recording[name].values for name in ("x", "y", "theta"))
    position = np.stack([x, y], axis=1)[:, :, None, :]
    data: dict[str, Any] = {
        "position": (("time", "space", "keypoints", "individuals"), position, {"units": "m"}),
        # movement asks for it, and none was stated.
        "confidence": (("time", "keypoints", "individuals"), np.full_like(x, np.nan)[:, None, :]),
    }
    if np.isfinite(theta).any():
        words = {"units": "rad", "long_name": "orientation, counter-clockwise from x"}
        data["orientation"] = (("time", "individuals"), theta, words)
    # These are made again when a recording is read.
    made_again = {"kind", "schema_version", "counts"}
    known = {key: value for key, value in recording.attrs.items() if key not in made_again}
    attrs: dict[str, Any] = {
        "source_software": "driftwalk",
        "ds_type": "poses",
        "time_unit": "seconds",
        "driftwalk": json.dumps(json_value(known)),
    }
    rate = frame_rate(recording)
    if rate is not None:
        attrs["fps"] = rate
    if "source" in recording.attrs:
        attrs["source_file"] = recording.attrs["source"]
    return xr.Dataset(
        data,
        {
            "time": recording["time"].values,
            "space": ["x", "y"],
            "keypoints": ["centroid"],
            "individuals": body_names(recording),
        },
        attrs,
    )


POSE_STAMPED: Final = "geometry_msgs/msg/PoseStamped"
NS_PER_S: Final = 1_000_000_000
"""Nanoseconds of a second: a stamp of ROS counts whole ones."""


def write_ros(motion: Motion, folder: Path) -> list[Path]:
    """Write a ROS 2 bag (MCAP) with one topic of ``PoseStamped`` per body.

    A body whose orientation is unknown has a quaternion of four zeros, which is no rotation. The
    stamps of the headers are the recording's times, as `first_stamp` says; what was known of the
    recording is in the bag's custom data under ``driftwalk``.

    Parameters
    ----------
    motion : Motion
        What to write.
    folder : Path
        Where to write.

    Returns
    -------
    list of Path
        The folder of the bag, ``NAME_bag``.

    Raises
    ------
    InputError
        When rosbags is not installed, or the bag exists.

    Examples
    --------
    >>> write_ros(Motion("recording", trajectory), Path("out"))  # doctest: +SKIP
    [PosixPath('out/recording_bag')]
    """
    # Not NAME.bag, which the programs of ROS take for a file of ROS 1.
    target = folder / f"{motion.name}_bag"
    require_free(target, existing="error")
    try:
        from rosbags.rosbag2 import StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise InputError("a ROS bag needs rosbags: pip install 'driftwalk[ros]'") from error
    recording = motion.recording
    store = get_typestore(Stores.ROS2_HUMBLE)
    known = {key: str(value) for key, value in recording.attrs.items()}
    x, y, theta = (recording[name].values for name in ("x", "y", "theta"))
    with Writer(target, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        writer.set_custom_data("driftwalk", json.dumps(known))
        connections = [
            writer.add_connection(topic, POSE_STAMPED, typestore=store)
            for topic in topics(recording)
        ]
        for row, stamp in enumerate(stamps(recording).tolist()):
            for body in np.flatnonzero(np.isfinite(x[row]) & np.isfinite(y[row])).tolist():
                pose = (float(x[row, body]), float(y[row, body]), float(theta[row, body]))
                message = _message(store.types, stamp, *pose)
                writer.write(connections[body], stamp, store.serialize_cdr(message, POSE_STAMPED))
    return [target]


def topics(recording: xr.Dataset) -> list[str]:
    """Return the topic of each body; what ROS allows in no name becomes an underscore.

    Parameters
    ----------
    recording : xarray.Dataset
        Kind "trajectory".

    Examples
    --------
    >>> from driftwalk.schema import build_trajectory
    >>> pair = build_trajectory([0.0], [[0.0, 1.0]], [[0.0, 1.0]], body=["0", "robot a"])
    >>> topics(pair)
    ['/body_0', '/robot_a']
    """
    found: list[str] = []
    for number, name in enumerate(body_names(recording)):
        word = re.sub(r"_+", "_", re.sub(r"[^A-Za-z0-9_]", "_", name)).strip("_")
        topic = f"/{word}" if word[:1].isalpha() else f"/body_{word or number}"
        found.append(topic if topic not in found else f"{topic}_of_{number}")
    return found


def first_stamp(recording: xr.Dataset) -> int:
    """Return the whole seconds that are added to the recording's times to make stamps.

    Those since 1970 where the recording knows when it began; otherwise none, or as many as put the
    first stamp above zero, which in ROS says that there is no time.

    Parameters
    ----------
    recording : xarray.Dataset
        Kind "trajectory".

    Examples
    --------
    >>> from driftwalk.schema import build_trajectory
    >>> first_stamp(build_trajectory([0.0, 0.1], [0.0, 0.0], [0.0, 0.0]))
    1
    """
    began = recording.attrs.get("time_origin_unix_s")
    if began is not None:
        return int(np.floor(float(began)))
    return max(0, 1 - int(np.floor(float(recording["time"].values[0]))))


def stamps(recording: xr.Dataset) -> Integers:
    """Return the stamp of each time [ns].

    Parameters
    ----------
    recording : xarray.Dataset
        Kind "trajectory".

    Raises
    ------
    InputError
        When the times are beyond what a stamp holds.

    Examples
    --------
    >>> from driftwalk.schema import build_trajectory
    >>> stamps(build_trajectory([0.0, 0.1], [0.0, 0.0], [0.0, 0.0])).tolist()
    [1000000000, 1100000000]
    """
    time = np.asarray(recording["time"].values, dtype=np.float64)
    added = first_stamp(recording)
    if not 0.0 < time[-1] + added < 2.0**31:
        raise InputError(
            f"the recording ends at {time[-1] + added:g} s, and a stamp of ROS holds at most "
            f"{2**31 - 1} s"
        )
    began = float(recording.attrs.get("time_origin_unix_s", added)) - added
    # Whole seconds apart, so that the part behind the point keeps its digits.
    seconds = np.floor(time)
    parts = np.rint((time - seconds + began) * NS_PER_S).astype(np.int64)
    return (seconds.astype(np.int64) + added) * NS_PER_S + parts


def _message(types: dict[str, Any], stamp: int, x: float, y: float, theta: float) -> Any:
    """Return a pose in the plane of the water, with z out of it."""
    seconds, rest = divmod(stamp, NS_PER_S)
    turned = np.isfinite(theta)
    quaternion = (0.0, 0.0, np.sin(theta / 2.0), np.cos(theta / 2.0)) if turned else (0.0,) * 4
    return types[POSE_STAMPED](
        header=types["std_msgs/msg/Header"](
            # The recording's own frame, which begins in the centre of a known tank; z is out of the
            # water.
            stamp=types["builtin_interfaces/msg/Time"](sec=seconds, nanosec=rest),
            frame_id="tank",
        ),
        pose=types["geometry_msgs/msg/Pose"](
            position=types["geometry_msgs/msg/Point"](x=x, y=y, z=0.0),
            orientation=types["geometry_msgs/msg/Quaternion"](
                **dict(zip("xyzw", map(float, quaternion), strict=True))
            ),
        ),
    )
