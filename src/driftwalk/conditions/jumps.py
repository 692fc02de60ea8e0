"""Warn of impossible steps in a recording."""

from __future__ import annotations

from typing import TYPE_CHECKING

from driftwalk.flow.arena import read_arena
from driftwalk.record import arena_diagonal, impossible_steps, impossible_warning
from driftwalk.schema import body_track

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.schema import Track


def jump_warnings(
    recording: xr.Dataset, body: str | None = None, *, track: Track | None = None
) -> list[str]:
    """Return a warning where a body makes steps that it cannot have made; else nothing.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    body : str, optional
        The body, where there are several.
    track : Track, optional
        What is used of the body; default: all of its samples.

    Examples
    --------
    >>> import driftwalk as dw
    >>> jump_warnings(dw.tank30_recording())
    []
    """
    used = body_track(recording, body) if track is None else track
    arena = read_arena(str(recording.attrs.get("arena", "{}")))
    x, y = ([recording[axis].values.ravel()] for axis in ("x", "y"))
    steps = impossible_steps(used.time, used.x, used.y, diagonal=arena_diagonal(x, y, arena))
    name = str(recording["body"].values[0]) if body is None else body
    return [] if steps is None else [impossible_warning(name, steps)]
