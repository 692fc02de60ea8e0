"""The clock of a recording as programs need it that count frames."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import xarray as xr

SLACK: Final = 0.25
"""How far a sample may lie from its frame, in frames, for its clock to count as even."""


def frame_rate(recording: xr.Dataset) -> float | None:
    """Return the rate [Hz] of a clock that ticks evenly, None for any other.

    Parameters
    ----------
    recording : xarray.Dataset
        Kind "trajectory"; frames may be missing.

    Examples
    --------
    >>> from driftwalk.schema import build_trajectory
    >>> frame_rate(build_trajectory([0.0, 0.04, 0.12], [0.0] * 3, [0.0] * 3))
    25.0
    """
    time = np.asarray(recording["time"].values, dtype=np.float64)
    if time.size < 2:
        return None
    stated = recording.attrs.get("sample_rate_Hz")
    for rate in (stated, 1.0 / float(np.diff(time).min()), 1.0 / float(np.median(np.diff(time)))):
        if isinstance(rate, (int, float, np.number)) and _is_even(time, float(rate)):
            # Over the whole recording the rounding of single times does not count.
            frames = np.rint((time[-1] - time[0]) * rate)
            mean = float(f"{frames / (time[-1] - time[0]):.12g}")
            return mean if _is_even(time, mean) else float(rate)
    return None


def frame_numbers(recording: xr.Dataset) -> npt.NDArray[np.int64]:
    """Return the number of the frame of each time, from 0; of an uneven clock that of the row.

    Parameters
    ----------
    recording : xarray.Dataset
        Kind "trajectory".

    Examples
    --------
    >>> from driftwalk.schema import build_trajectory
    >>> frame_numbers(build_trajectory([0.0, 0.04, 0.12], [0.0] * 3, [0.0] * 3)).tolist()
    [0, 1, 3]
    """
    time = np.asarray(recording["time"].values, dtype=np.float64)
    rate = frame_rate(recording)
    if rate is None:
        return np.arange(time.size, dtype=np.int64)
    numbers: npt.NDArray[np.int64] = np.rint((time - time[0]) * rate).astype(np.int64)
    return numbers


def _is_even(time: npt.NDArray[np.float64], rate: float) -> bool:
    """Whether every time lies at a frame of its own."""
    if not (np.isfinite(rate) and rate > 0.0):
        return False
    ticks = (time - time[0]) * rate
    if not ticks[-1] < 2.0**53:
        return False
    frames = np.rint(ticks)
    return bool((np.diff(frames) > 0).all() and (np.abs(ticks - frames) <= SLACK).all())
