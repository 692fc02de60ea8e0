"""The targets of motion: tables, NetCDF, bags and films, each with a page next to the files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

from driftwalk.core.files.atomic import write_atomic
from driftwalk.core.files.file_names import text_of_name
from driftwalk.export.data.losses import lost, read_again, write_tank
from driftwalk.export.data.motion import Motion, find_motions
from driftwalk.export.data.movement import write_movement
from driftwalk.export.data.ros import write_ros
from driftwalk.export.data.tables import write_csv, write_trackpy
from driftwalk.export.target import Source, Target

README: Final = "README.md"
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


@dataclass(frozen=True)
class Exported:
    """One world in one format.

    Attributes
    ----------
    file : Path
        The file or folder.
    lost : sequence of str
        What it does not hold, in sentences.
    call : str
        How driftwalk reads it again; ``""`` where it does not.
    """

    file: Path
    lost: Sequence[str]
    call: str


def write_readme(folder: Path, format: str, source: str, exported: Sequence[Exported]) -> Path:
    """Write ``README.md`` next to the files.

    Parameters
    ----------
    folder : Path
        Where the files lie.
    format : {"csv", "movement", "trackpy", "ros", "film"}
        Their format.
    source : str
        What they were made of.
    exported : sequence of Exported
        The files.

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
    for one in exported:
        lines += [f"## {one.file.name}", ""]
        if one.call:
            lines += [f"driftwalk reads it again: `{one.call}`", ""]
        if one.lost:
            lines += ["The file does not hold:", "", *(f"- {what}" for what in one.lost), ""]
    target = folder / README
    write_atomic(target, "\n".join(lines).encode())
    return target


WRITERS: Final[dict[str, tuple[Callable[[Motion, Path], list[Path]], str]]] = {
    "csv": (write_csv, "driftwalk's plain table for each recording"),
    "movement": (write_movement, "NetCDF as movement has it"),
    "trackpy": (write_trackpy, "a table of linked features for trackpy"),
    "ros": (write_ros, "a ROS 2 bag of stamped poses"),
}
FILMS: Final = {"mp4": "a film", "gif": "a film as a GIF"}


def _write_motions(format: str, source: Source, folder: Path) -> list[Path]:
    write = WRITERS[format][0]
    files: list[Path] = []
    pages: list[Exported] = []
    missing: dict[str, None] = {}
    for motion in find_motions(source.path, replicate=source.replicate):
        file, *further = write(motion, folder)
        sentences = lost(format, motion)
        pages.append(Exported(file, sentences, read_again(format, motion, file)))
        files += [file, *further]
        missing |= dict.fromkeys(sentences)
        if format != "movement":
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
    page = write_readme(folder, "film", text_of_name(source.path), [Exported(file, [], "")])
    return [file, page]


DATA_TARGETS: Final = (
    *(
        Target(name, gives, partial(_write_motions, name), options=("replicate",))
        for name, (_, gives) in WRITERS.items()
    ),
    *(
        Target(name, gives, partial(_write_films, name), options=("replicate", "speed"))
        for name, gives in FILMS.items()
    ),
)
