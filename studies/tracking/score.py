"""A tracked recording beside its truth: errors, recall, identities, and what covariances say."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import xarray as xr

Floats = npt.NDArray[np.float64]
Whole = npt.NDArray[np.int64]

NEAR_M: Final = 0.015
"""Half a block's side: a measurement further from every block shows none of them."""
VISIBLE: Final = 0.695
"""A bar is pushed in until it hides 30 %: just less than 70 % is left then, and that counts."""
PARTS: Final = ("x", "y", "theta")


class Matched(NamedTuple):
    """Which block each column of a recording shows, by distance, frame by frame."""

    truth: Whole
    """Index of the block, shape (time, column); -1 where there is no measurement or no block."""
    error: Floats
    """Measured minus true pose [m, m, rad], shape (time, column, 3); NaN where `truth` is -1."""
    false: int
    """Measurements with no block of their own near."""


def poses_of(trajectory: xr.Dataset) -> Floats:
    """Return the poses of a trajectory, shape (time, body, 3)."""
    return np.stack([trajectory[name].transpose("time", "body").values for name in PARTS], axis=-1)


def match(tracked: xr.Dataset, truth: xr.Dataset) -> Matched:
    """Give each measurement the block it shows: the closest, one to one, within `NEAR_M`."""
    from scipy.optimize import linear_sum_assignment

    seen, true = poses_of(tracked), poses_of(truth)
    _same_frames(tracked, truth)
    shown = np.full(seen.shape[:2], -1, dtype=np.int64)
    for frame, poses in enumerate(seen):
        columns = np.flatnonzero(np.isfinite(poses[:, 0]))
        away = np.linalg.norm(poses[columns, None, :2] - true[frame, None, :, :2], axis=-1)
        # Beyond the reach all are alike, so that a false one takes no block from a true one.
        rows, blocks = linear_sum_assignment(np.minimum(away, 10 * NEAR_M) ** 2)
        near = away[rows, blocks] < NEAR_M
        shown[frame, columns[rows[near]]] = blocks[near]
    error = seen - np.take_along_axis(true, np.maximum(shown, 0)[..., None], axis=1)
    error[..., 2] = np.angle(np.exp(1j * error[..., 2]))
    error[shown < 0] = np.nan
    false = int(np.isfinite(seen[..., 0]).sum() - (shown >= 0).sum())
    return Matched(shown, error, false)


def exchanges(shown: Whole, ambiguous: Floats) -> dict[str, Any]:
    """Count the changes of the block that a column shows, and those that are not marked.

    A change is marked when ``ambiguous`` is above zero at the first sample of the other block, or
    anywhere between it and the last sample of the one before.
    """
    found: dict[str, Any] = {"swaps": 0, "unmarked": 0, "unmarked_at_sample": 0, "changes": []}
    marks = np.nan_to_num(ambiguous) > 0.0
    for column in range(shown.shape[1]):
        frames = np.flatnonzero(shown[:, column] >= 0)
        for before, after in pairwise(frames):
            if shown[before, column] == shown[after, column]:
                continue
            marked = bool(marks[before + 1 : after + 1, column].any())
            found["swaps"] += 1
            found["unmarked"] += not marked
            found["unmarked_at_sample"] += not bool(marks[after, column])
            found["changes"].append(
                {
                    "column": column,
                    "last_frame": int(before),
                    "first_frame": int(after),
                    "from": int(shown[before, column]),
                    "to": int(shown[after, column]),
                    "marked": marked,
                }
            )
    return found


def score(tracked: xr.Dataset, truth: xr.Dataset) -> dict[str, Any]:
    """Return every figure of a recording.

    Parameters
    ----------
    tracked : xarray.Dataset
        What `driftwalk track` wrote.
    truth : xarray.Dataset
        What `video_truth` returns for the same video.

    Returns
    -------
    dict
        Errors [mm, degrees], recall, exchanges, and how errors compare with their covariance.
    """
    matched = match(tracked, truth)
    visible = truth["visible"].transpose("time", "body").values
    seen = np.zeros(visible.shape, dtype=bool)
    frames, columns = np.nonzero(matched.truth >= 0)
    seen[frames, matched.truth[frames, columns]] = True
    asked = visible >= VISIBLE
    ambiguous = tracked["ambiguous"].transpose("time", "body").values
    return {
        "frames": int(seen.shape[0]),
        "columns": int(matched.truth.shape[1]),
        "samples": int(visible.size),
        "samples_visible": int(asked.sum()),
        "lost": int((~seen).sum()),
        "lost_visible": int((asked & ~seen).sum()),
        "recall": float(seen.mean()),
        "recall_visible": float(seen[asked].mean()),
        "recall_by_visible": _recall_by_visible(seen, visible),
        "false": matched.false,
        **exchanges(matched.truth, ambiguous),
        "ambiguous_share": float((ambiguous[matched.truth >= 0] > 0.0).mean()),
        **errors(matched),
        **honesty(matched, tracked["covariance"].transpose("time", "body", "part").values),
    }


def errors(matched: Matched) -> dict[str, float]:
    """Return size, bias and worst of the errors [mm, degrees]; rms of positions is in the plane."""
    error = matched.error[matched.truth >= 0]
    mm, degrees = 1e3 * error[:, :2], np.degrees(error[:, 2])
    away = np.hypot(mm[:, 0], mm[:, 1])
    return {
        "position_rms_mm": _rms(away),
        "position_rms_per_axis_mm": _rms(mm),
        "position_sd_per_axis_mm": float(np.sqrt(mm.var(axis=0).mean())),
        "x_bias_mm": float(mm[:, 0].mean()),
        "y_bias_mm": float(mm[:, 1].mean()),
        "position_median_mm": float(np.median(away)),
        "position_99_mm": float(np.quantile(away, 0.99)),
        "position_worst_mm": float(away.max()),
        "angle_rms_deg": _rms(degrees),
        "angle_sd_deg": float(degrees.std()),
        "angle_bias_deg": float(degrees.mean()),
        "angle_99_deg": float(np.quantile(np.abs(degrees), 0.99)),
        "angle_worst_deg": float(np.abs(degrees).max()),
    }


def honesty(matched: Matched, covariance: Floats) -> dict[str, float]:
    """Return rms errors in units of the reported standard deviations; 1 is honest.

    ``z_total`` is that of the whole pose: the root of the mean Mahalanobis distance over 3.
    """
    at = matched.truth >= 0
    error, parts = matched.error[at], covariance[at]
    xx, xy, yy, xt, yt, tt = parts.T
    full = np.stack([xx, xy, xt, xy, yy, yt, xt, yt, tt], axis=-1).reshape(-1, 3, 3)
    square = np.einsum("ni,ni->n", error, np.linalg.solve(full, error[..., None])[..., 0])
    spread = np.sqrt(np.stack([xx, yy, tt], axis=-1))
    z = error / spread
    return {
        "z_x": _rms(z[:, 0]),
        "z_y": _rms(z[:, 1]),
        "z_theta": _rms(z[:, 2]),
        "z_total": float(np.sqrt(square.mean() / 3.0)),
        "z_median_total": float(np.sqrt(np.median(square) / 2.366)),
        "beyond_5_sd": float((np.abs(z) > 5.0).any(axis=1).mean()),
    }


def _recall_by_visible(seen: npt.NDArray[np.bool_], visible: Floats) -> dict[str, list[float]]:
    """Return number and recall of the samples in steps of the share that is visible."""
    edges = (0.0, 0.3, 0.5, VISIBLE, 0.95, np.inf)
    found = {}
    for low, high in pairwise(edges):
        within = (visible >= low) & (visible < high)
        share = float(seen[within].mean()) if within.any() else 0.0
        found[f"{low:g}"] = [int(within.sum()), share]
    return found


def _same_frames(tracked: xr.Dataset, truth: xr.Dataset) -> None:
    """Refuse a recording whose clock is not that of the video, to the millisecond of its file."""
    clock, true = tracked["time"].values, truth["time"].values
    if clock.size != true.size or np.abs(clock - true).max() > 1.1e-3:
        raise SystemExit(f"{clock.size} frames were tracked, {true.size} drawn, or at other times")


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
