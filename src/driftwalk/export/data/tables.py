"""Motion as tables: driftwalk's plain CSV, and the table that trackpy works on."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Integers
from driftwalk.core.files.atomic import atomic_path, require_free
from driftwalk.export.data.motion import Motion, frame_numbers
from driftwalk.schema import body_names

if TYPE_CHECKING:
    import xarray as xr

ROWS_AT_ONCE: Final = 200_000


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
    columns = ["y", "x", "frame", "particle", "time_s"]
    oriented = bool(np.isfinite(recording["theta"].values).any())
    with atomic_path(target) as partial, partial.open("w", encoding="utf-8", newline="") as file:
        header = [*columns, *(["theta_rad"] if oriented else [])]
        pd.DataFrame(columns=header).to_csv(file, index=False)
        for first in range(0, time.size, ROWS_AT_ONCE):
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
            pd.DataFrame(values).to_csv(file, index=False, header=False)
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
