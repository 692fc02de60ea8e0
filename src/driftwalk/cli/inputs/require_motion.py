"""Refuse a recording in which there is nothing to see, and name the file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from driftwalk.core.errors import FormatError
from driftwalk.schema import Track, body_names, body_track

if TYPE_CHECKING:
    import xarray as xr

FEWEST_POSITIONS = 3
"""Two steps, the least that has a turning angle."""


def require_positions(recording: xr.Dataset, path: Path) -> None:
    """Refuse a recording without a single position.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    path : Path
        The file that it came from.

    Raises
    ------
    FormatError
        When no sample has both coordinates.
    """
    if not (np.isfinite(recording["x"].values) & np.isfinite(recording["y"].values)).any():
        raise FormatError("no row holds a position: are these the right columns?", path=path)


def require_motion(recording: xr.Dataset, path: Path, *, body: str | None) -> None:
    """Refuse a recording that is too short for motion, or in which the body never moves.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    path : Path
        The file that it came from.
    body : str or None
        The body; "all" asks that one of them moves.

    Raises
    ------
    FormatError
        When fewer than three positions are there, or all are the same.
    InputError
        When there are several bodies and none is named.
    """
    names = body_names(recording) if body == "all" else [body]
    tracks = [body_track(recording, name) for name in names]
    most = max(track.time.size for track in tracks)
    if most < FEWEST_POSITIONS:
        rows = "1 position" if most == 1 else f"{most} positions"
        raise FormatError(
            f"holds {rows} in the time that is kept, at least {FEWEST_POSITIONS} are needed for "
            "a motion",
            path=path,
        )
    if not any(_moves(track) for track in tracks):
        raise FormatError(
            f"the body never moves: all {most} positions are ({tracks[0].x[0]:g}, "
            f"{tracks[0].y[0]:g}) m",
            path=path,
        )


def _moves(track: Track) -> bool:
    return bool(track.x.size and (np.ptp(track.x) > 0 or np.ptp(track.y) > 0))
