"""Build a recording from tracks."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from driftwalk.schema.check import described
from driftwalk.track.follow.tracks import COVARIANCE, Track

if TYPE_CHECKING:
    import xarray as xr

Floats = npt.NDArray[np.float64]


def recording_of(
    times: Sequence[float],
    names: Sequence[str],
    tracks: Iterable[Track],
    ambiguous: Floats,
    *,
    attrs: Mapping[str, Any],
    counts: Mapping[str, Any],
) -> xr.Dataset:
    """Return a trajectory with the measurements of tracks; see `Tracker.finish`.

    Parameters
    ----------
    times : sequence of float
        Of the frames [s].
    names : sequence of str
        Of the bodies.
    tracks : iterable of Track
        The tracks followed.
    ambiguous : array, shape (frames, bodies)
        Scores.
    attrs, counts : mapping
        Attributes and counts to add.
    """
    from driftwalk.schema import build_trajectory

    values = np.full((len(times), len(names), 3 + len(COVARIANCE)), np.nan)
    for track in tracks:
        if track.body is not None:
            values[track.samples.frames, track.body] = track.samples.values
    intervals = np.diff(times)
    rate = 1.0 / float(np.median(intervals)) if intervals.size else 0.0
    recording = build_trajectory(
        times,
        *(values[..., part] for part in range(3)),
        body=list(names),
        attrs={
            "format": "driftwalk track",
            "sample_rate_Hz": rate,
            "position_quantum_m": 0.0,
            "y_axis": "up",
            **attrs,
            "counts": json.dumps({"frames": len(times), **counts}),
        },
    )
    recording["ambiguous"] = (("time", "body"), ambiguous)
    recording["covariance"] = (("time", "body", "part"), values[..., 3:])
    return described(recording.assign_coords(part=("part", np.array(COVARIANCE, dtype=object))))
