"""The targets of motion: tables, NetCDF, bags and films, each with a page next to the files."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Final

from driftwalk.core.files.file_names import text_of_name
from driftwalk.export.data.losses import lost, read_again, write_tank
from driftwalk.export.data.motion import Motion, find_motions
from driftwalk.export.data.movement import write_movement
from driftwalk.export.data.readme import Exported, write_readme
from driftwalk.export.data.ros import write_ros
from driftwalk.export.data.tables import write_csv, write_trackpy
from driftwalk.export.target import Source, Target

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
