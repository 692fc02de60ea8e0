"""Neighbours: the other bodies of a recording, at their recorded positions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from driftwalk.schema import body_names, body_track
from driftwalk.simulation.backend import wall_edges

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Tank
    from driftwalk.schema import Track

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Neighbours:
    """The other bodies in the tank, each with its recorded samples.

    Attributes
    ----------
    tracks : tuple of Track
        Present samples of each.

    Examples
    --------
    >>> from driftwalk.schema import Track
    >>> time = np.arange(5.0)
    >>> other = Track(time, 0.01 * time, 0.0 * time, np.full(5, np.nan))
    >>> Neighbours((other,)).at([0.5, 9.0])[:, 0].tolist()
    [[0.005, 0.0], [nan, nan]]
    """

    tracks: tuple[Track, ...]

    def since(self, begin: float) -> Neighbours:
        """Return the same with times [s] that count from `begin` on."""
        return Neighbours(tuple(one._replace(time=one.time - begin) for one in self.tracks))

    def at(self, time: npt.ArrayLike) -> Floats:
        """Return where they are at times [s], shape (times, bodies, 2) [m].

        Between two samples in a straight line; NaN within gaps, before the first and after the last
        sample.
        """
        wanted = np.asarray(time, dtype=np.float64)
        found = np.full((wanted.size, len(self.tracks), 2), np.nan)
        for k, track in enumerate(self.tracks):
            there = _within_samples(track.time, wanted)
            for axis, values in enumerate((track.x, track.y)):
                found[there, k, axis] = np.interp(wanted[there], track.time, values)
        return found


def neighbours_of(recording: xr.Dataset, body: str | None, tank: Tank) -> Neighbours | None:
    """Return the other bodies of a recording that are in the tank; None where there are none.

    A body that is mostly beyond the wall is in another tank: one recording may show several. Where
    each body has its own tank, none is another's neighbour.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    body : str or None
        The body that is followed; None where there is one alone.
    tank : Tank
        Its tank.

    Examples
    --------
    >>> import driftwalk as dw
    >>> neighbours_of(dw.tank30_recording(), None, dw.Study().tank) is None
    True
    """
    names = body_names(recording)
    if body is None or len(names) < 2 or recording.attrs.get("bodies_apart") == "yes":
        return None
    tracks = [body_track(recording, name) for name in names if name != body]
    inside = tuple(one for one in tracks if one.time.size > 1 and _mostly_inside(one, tank))
    return Neighbours(inside) if inside else None


def _mostly_inside(track: Track, tank: Tank) -> bool:
    if tank.radius_m is not None:
        beyond = np.hypot(track.x, track.y) - tank.radius_m
    else:
        edges = wall_edges(tank)
        across = edges[:, :2] @ np.stack([track.x, track.y]) - edges[:, 2, None]
        beyond = across.max(axis=0)
    return bool(np.mean(beyond <= 0.0) > 0.5)


def _within_samples(time: Floats, wanted: Floats) -> npt.NDArray[np.bool_]:
    """Return which times lie between two samples that are no more than a gap apart."""
    # Over five median intervals a body has moved straight on: trackers drop a frame or two, and
    # after more its place is unknown.
    longest = 5.0 * float(np.median(np.diff(time)))
    after = np.clip(np.searchsorted(time, wanted), 1, time.size - 1)
    close = time[after] - time[after - 1] <= longest
    return np.asarray((wanted >= time[0]) & (wanted <= time[-1]) & close)
