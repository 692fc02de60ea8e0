"""Recordings in which there is nothing to see: without a position, too short, or at rest."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING, Final

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.schema import Track, body_names, body_track

if TYPE_CHECKING:
    import xarray as xr

FEWEST_POSITIONS: Final = 3
"""Two steps, the least that has a turning angle."""


def require_positions(recording: xr.Dataset, *, where: str | PathLike[str] = "") -> None:
    """Refuse a recording without a single position.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    where : path-like
        The file, for the message; default: the name that the recording has.

    Raises
    ------
    InputError
        When no sample has both coordinates.

    Examples
    --------
    >>> import driftwalk as dw
    >>> dw.conditions.require_positions(dw.tank30_recording())
    """
    if not (np.isfinite(recording["x"].values) & np.isfinite(recording["y"].values)).any():
        raise InputError(
            f"{_begin(recording, where)}no row holds a position: are these the right columns?"
        )


def require_motion(
    recording: xr.Dataset, *, body: str | None = None, where: str | PathLike[str] = ""
) -> None:
    """Refuse a recording that is too short for motion, or in which the body never moves.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    body : str, optional
        The body, where there are several; "all" asks that one of them moves.
    where : path-like
        The file, for the message; default: the name that the recording has.

    Raises
    ------
    InputError
        When fewer than three positions are there, or all are the same; when there are several
        bodies and none is named.

    Examples
    --------
    >>> import driftwalk as dw
    >>> dw.conditions.require_motion(dw.tank30_recording())
    """
    names = body_names(recording) if body == "all" else [body]
    try:
        tracks = [body_track(recording, name) for name in names]
    except InputError as error:
        raise InputError(f"{_begin(recording, where)}{error}") from error
    most = max(track.time.size for track in tracks)
    if most < FEWEST_POSITIONS:
        rows = "1 position" if most == 1 else f"{most} positions"
        raise InputError(
            f"{_begin(recording, where)}holds {rows} in the time that is kept, at least "
            f"{FEWEST_POSITIONS} are needed for a motion"
        )
    if not any(_moves(track) for track in tracks):
        still = body_names(recording) if body is None else names
        which = ", ".join(f"'{name}'" for name in still)
        raise InputError(
            f"{_begin(recording, where)}the body never moves ({which}): all {most} positions are "
            f"({tracks[0].x[0]:g}, {tracks[0].y[0]:g}) m"
        )


def _begin(recording: xr.Dataset, where: str | PathLike[str]) -> str:
    name = str(where) or recording.attrs.get("source", "")
    return f"{name}: " if name else ""


def _moves(track: Track) -> bool:
    return bool(track.x.size and (np.ptp(track.x) > 0 or np.ptp(track.y) > 0))
