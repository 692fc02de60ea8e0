"""The page that lies next to exported files: what they are, what they lack, how to read them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from driftwalk.core.files.atomic import write_atomic

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
