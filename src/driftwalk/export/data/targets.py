"""The targets of motion: tables, NetCDF, bags and films, each with a page next to the files.

The page says what of the recording a format cannot hold, and how the file is read again.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from driftwalk.core.files.atomic import write_atomic
from driftwalk.core.text_files import parse_json, text_of_name
from driftwalk.export.data.motion import Motion, find_motions, frame_rate
from driftwalk.export.data.writers import (
    first_stamp,
    particle_numbers,
    topics,
    write_csv,
    write_movement,
    write_ros,
    write_trackpy,
)
from driftwalk.export.target import Source, Target
from driftwalk.schema import body_names
from driftwalk.schema.trajectory import POSE

if TYPE_CHECKING:
    import xarray as xr


WHOLE: Final = "movement"
"""The format that keeps all samples, and the attributes of a recording."""


def lost(format: str, motion: Motion) -> list[str]:
    """Return in sentences what the file of a format does not hold of a recording.

    Parameters
    ----------
    format : {"csv", "movement", "trackpy", "ros"}
        The format.
    motion : Motion
        What was written.

    Examples
    --------
    >>> from driftwalk.schema import build_trajectory
    >>> lost("csv", Motion("a", build_trajectory([0.0, 0.1], [0.1, 0.2], [0.0, 0.0])))
    []
    """
    recording = motion.recording
    found: list[str] = []
    if format != WHOLE:
        found += _lost_in_samples(format, recording)
        if tank := tank_text(recording):
            found.append(f"the tank: give `tank={json.dumps(tank)}` when the file is read")
        if "time_origin_unix_s" in recording.attrs and format != "ros":
            began = float(recording.attrs["time_origin_unix_s"])
            found.append(f"when the recording began, {began:.6f} s after 1970")
    if format == "trackpy":
        found += _lost_in_trackpy(recording)
    if format == "ros":
        found += _lost_in_bag(recording)
    further = [name for name in recording.data_vars if name not in POSE]
    if further:
        found.append(f"further numbers of each sample: {', '.join(map(str, further))}")
    return found


def read_again(format: str, motion: Motion, file: Path) -> str:
    """Return the call by which driftwalk reads a file again.

    Parameters
    ----------
    format : {"csv", "movement", "trackpy", "ros"}
        The format.
    motion : Motion
        What was written.
    file : Path
        The file.

    Examples
    --------
    >>> from driftwalk.schema import build_trajectory
    >>> here = Motion("a", build_trajectory([0.0, 0.1], [0.1, 0.2], [0.0, 0.0]))
    >>> read_again("csv", here, Path("a.csv"))
    'driftwalk.load("a.csv")'
    """
    arguments = [json.dumps(file.name)]
    names = topics(motion.recording)
    if format == "ros" and len(names) > 1:
        arguments.append(f"topic={json.dumps(','.join(names))}")
    if format != WHOLE and (tank := tank_text(motion.recording)):
        arguments.append(f"tank={json.dumps(tank)}")
    return f"driftwalk.load({', '.join(arguments)})"


def tank_text(recording: xr.Dataset) -> str:
    """Return the tank of a recording in the words of `driftwalk.load`, ``""`` where it has none.

    A polygon has no such form; its corners are in the file that `write_tank` writes.

    Parameters
    ----------
    recording : xarray.Dataset
        Kind "trajectory".

    Examples
    --------
    >>> from driftwalk.schema import build_trajectory
    >>> tank = '{"shape": "circle", "diameter_m": 0.3, "center_m": [0, 0]}'
    >>> tank_text(build_trajectory([0.0], [0.0], [0.0], attrs={"arena": tank}))
    'circle:0.3@0,0'
    """
    arena = parse_json(recording.attrs.get("arena") or "{}")
    if not isinstance(arena, dict) or not arena:
        return ""
    x, y = (f"{value:.17g}" for value in arena.get("center_m", (0.0, 0.0)))
    if arena["shape"] == "circle":
        return f"circle:{arena['diameter_m']!r}@{x},{y}"
    if arena["shape"] == "rectangle":
        return f"rect:{arena['width_m']!r}x{arena['height_m']!r}@{x},{y}"
    return f"polygon:{TANK_FILE}"


TANK_FILE: Final = "tank.csv"
"""Corners of a tank that is a polygon, x_m and y_m."""


def write_tank(motion: Motion, folder: Path) -> list[Path]:
    """Write the corners of a tank that is a polygon; a line says any other tank.

    Parameters
    ----------
    motion : Motion
        Whose tank.
    folder : Path
        Where to write.

    Returns
    -------
    list of Path
        The file, where one was written.

    Examples
    --------
    >>> from driftwalk.schema import build_trajectory
    >>> write_tank(Motion("a", build_trajectory([0.0], [0.0], [0.0])), Path("out"))
    []
    """
    arena = parse_json(motion.recording.attrs.get("arena") or "{}")
    if not isinstance(arena, dict) or arena.get("shape") != "polygon":
        return []
    lines = ["x_m,y_m", *(f"{x!r},{y!r}" for x, y in arena["vertices_m"])]
    target = folder / TANK_FILE
    write_atomic(target, ("\n".join(lines) + "\n").encode())
    return [target]


def _lost_in_samples(format: str, recording: xr.Dataset) -> list[str]:
    """Return which samples a table or a bag of those that are there leaves out."""
    x, theta = recording["x"].values, recording["theta"].values
    present = np.isfinite(x) & np.isfinite(recording["y"].values)
    found = []
    absent = np.array(body_names(recording))[~present.any(axis=0)]
    if absent.size:
        found.append(f"bodies that are never seen: {', '.join(absent)}")
    empty = int((~present.any(axis=1)).sum())
    if empty and format != "csv":
        found.append(f"times at which no body is seen: {empty}")
    blind = int((np.isfinite(theta) & ~present).sum())
    if blind:
        found.append(f"orientations of samples without a position: {blind}")
    return found


def _lost_in_trackpy(recording: xr.Dataset) -> list[str]:
    names, numbers = body_names(recording), particle_numbers(recording).tolist()
    renamed = [
        f"{number} is {name}"
        for name, number in zip(names, numbers, strict=True)
        if name != str(number)
    ]
    found = [f"the names of the bodies: particle {', '.join(renamed)}"] if renamed else []
    if frame_rate(recording) is None and recording.sizes["time"] > 1:
        found.append("an even clock, which the recording has not: frame counts the rows")
    return found


def _lost_in_bag(recording: xr.Dataset) -> list[str]:
    found = ["digits of the time below a nanosecond"]
    names = dict(zip(topics(recording), body_names(recording), strict=True))
    renamed = [f"{topic} is {name}" for topic, name in names.items() if topic != f"/{name}"]
    if renamed:
        found.append(f"the names of the bodies: topic {', '.join(renamed)}")
    if "time_origin_unix_s" not in recording.attrs and (added := first_stamp(recording)):
        found.append(f"the start of its clock: {added} s are added to every time")
    return found


MEANING: Final = {
    "csv": "driftwalk's plain table: t_s, x_m, y_m, theta_rad, body. Metres, seconds, radians; y "
    "is up, angles are counter-clockwise. Every number has the digits that give the same double "
    "again.",
    "movement": "NetCDF of poses as the movement package has them: read it with movement, or with "
    "`xarray.open_dataset(FILE)`. Metres with y up, seconds; the variable orientation is in "
    "radians.",
    "trackpy": "Linked features: `trackpy.emsd(pandas.read_csv(FILE), mpp=1, fps=RATE)`. x and y "
    "are in metres with y up, so a unit of length is one metre, and mpp is 1.",
    "ros": "ROS 2 bag (MCAP), `geometry_msgs/msg/PoseStamped`, one topic per body: `ros2 bag play "
    "FOLDER`. Metres, frame `tank`: x right, y up in the picture, z out of the water.",
    "film": "The bodies in their tank, with the time in seconds and a scale.",
}


def write_readme(
    folder: Path, format: str, source: str, exported: Sequence[tuple[Path, Sequence[str], str]]
) -> Path:
    """Write ``README.md`` next to the files.

    Parameters
    ----------
    folder : Path
        Where the files lie.
    format : {"csv", "movement", "trackpy", "ros", "film"}
        Their format.
    source : str
        What they were made of.
    exported : sequence of tuple
        Each file or folder, what it does not hold, in sentences, and how driftwalk reads it again;
        ``""`` where it does not.

    Returns
    -------
    Path
        The page.

    Examples
    --------
    >>> write_readme(Path("out"), "csv", "fit", [])  # doctest: +SKIP
    PosixPath('out/README.md')
    """
    from driftwalk import __version__

    lines = [f"# Motion from {source}", "", f"driftwalk {__version__} wrote these files.", ""]
    lines += [MEANING[format], ""]
    for file, absent, call in exported:
        lines += [f"## {file.name}", ""]
        if call:
            lines += [f"driftwalk reads it again: `{call}`", ""]
        if absent:
            lines += ["The file does not hold:", "", *(f"- {what}" for what in absent), ""]
    target = folder / "README.md"
    write_atomic(target, "\n".join(lines).encode())
    return target


WRITERS: Final[dict[str, tuple[Callable[[Motion, Path], list[Path]], str]]] = {
    "csv": (write_csv, "driftwalk's plain table for each recording"),
    "movement": (write_movement, "NetCDF as movement has it"),
    "trackpy": (write_trackpy, "a table of linked features for trackpy"),
    "ros": (write_ros, "a ROS 2 bag of stamped poses"),
}


def _write_motions(format: str, source: Source, folder: Path) -> list[Path]:
    write, _ = WRITERS[format]
    files: list[Path] = []
    pages: list[tuple[Path, list[str], str]] = []
    missing: dict[str, None] = {}
    for motion in find_motions(source.path, replicate=source.replicate):
        file, *further = write(motion, folder)
        sentences = lost(format, motion)
        pages.append((file, sentences, read_again(format, motion, file)))
        files += [file, *further]
        missing |= dict.fromkeys(sentences)
        if format != WHOLE:
            files += [one for one in write_tank(motion, folder) if one not in files]
    for sentence in missing:
        source.tell(f"{format} does not hold {sentence}")
    return [*files, write_readme(folder, format, text_of_name(source.path), pages)]


def _write_films(ending: str, source: Source, folder: Path) -> list[Path]:
    from driftwalk.plot import write_animation

    motions = find_motions(source.path, replicate=source.replicate)
    if len(motions) > 1:
        source.tell(
            f"the film shows {motions[0].name}, the first of {len(motions)}: name another "
            "with `replicate`"
        )
    file = write_animation(
        motions[0].recording,
        folder / f"{motions[0].name}.{ending}",
        speed=1.0 if source.speed is None else source.speed,
        progress=source.progress,
    )
    page = write_readme(folder, "film", text_of_name(source.path), [(file, [], "")])
    return [file, page]


DATA_TARGETS: Final = (
    *(
        Target(name, gives, partial(_write_motions, name), options=("replicate",))
        for name, (_, gives) in WRITERS.items()
    ),
    *(
        Target(name, gives, partial(_write_films, name), options=("replicate", "speed"))
        for name, gives in {"mp4": "a film", "gif": "a film as a GIF"}.items()
    ),
)
