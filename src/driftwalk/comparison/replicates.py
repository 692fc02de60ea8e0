"""Compare a recorded motion with all replicates of a simulation of it."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from driftwalk.comparison.ks import Ties, ks_distance
from driftwalk.comparison.motion import sampling_interval, step_points
from driftwalk.core.errors import InputError
from driftwalk.schema.check import build_dataset

if TYPE_CHECKING:
    import xarray as xr


def compare_replicates(
    recording: xr.Dataset,
    simulation: xr.Dataset,
    *,
    body: str | None = None,
    step_interval: float | None = None,
    ties: Ties = "strict",
) -> xr.Dataset:
    """Compare the steps of a recording with those of every replicate of a simulation.

    If the model is right, recording and replicates are exchangeable: each is as far from the others
    as any. The p-value is the share of these motions whose mean KS distance to the others is at
    least the recording's. A model that was fitted to the recording lies nearer to it than the truth
    does, so that the p-value is then on the safe side (too large).

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    simulation : xarray.Dataset
        As of `simulate`, with at least two replicates.
    body : str, optional
        The recorded body, where there are several.
    step_interval : float, optional
        Time between the positions of a step [s], the same for all; default: the longer of the two
        median sampling intervals.
    ties : {"strict", "limits"}
        As in `ks_distance`.

    Returns
    -------
    xarray.Dataset
        Kind "replicate_comparison". ``ks_distance`` (replicate): KS distance of each replicate to
        the recording; ``mean_ks_distance``: their mean; ``noise_floor``: mean KS distance of two
        replicates; ``p_value``, from 1 / (replicates + 1) to 1. ``attrs``: ``step_interval_s``,
        ``ties``.

    Raises
    ------
    InputError
        When there are fewer than two replicates, or no steps can be formed.

    Examples
    --------
    >>> import driftwalk as dw
    >>> recording = dw.tank30_recording().isel(time=slice(0, 600))
    >>> run = dw.simulate(dw.Study(), dw.tank30_flow(), like=recording, replicates=3)
    >>> dw.comparison.compare_replicates(recording, run)["ks_distance"].sizes["replicate"]
    3
    """
    count = simulation.sizes.get("replicate", 0)
    if count < 2:
        raise InputError(f"at least two replicates are needed, got {count}: simulate more")
    replicates = [simulation.isel(replicate=index) for index in range(count)]
    interval = step_interval
    if interval is None:
        interval = max(sampling_interval(recording, body), sampling_interval(replicates[0], None))
    motions = [step_points(recording, body, interval)]
    motions += [step_points(one, None, interval) for one in replicates]
    distance = _pairwise(motions, ties)
    mean = distance.sum(axis=1) / count
    among = distance[1:, 1:][np.triu_indices(count, k=1)]
    return build_dataset(
        "replicate_comparison",
        {
            "ks_distance": ("replicate", distance[0, 1:]),
            "mean_ks_distance": ((), mean[0]),
            "noise_floor": ((), among.mean()),
            "p_value": ((), np.mean(mean >= mean[0])),
        },
        {"replicate": simulation["replicate"]},
        {"step_interval_s": interval, "ties": ties},
    )


def _pairwise(motions: list[npt.NDArray[np.float64]], ties: Ties) -> npt.NDArray[np.float64]:
    """Return the KS distances of every two motions, shape (motions, motions), 0 with itself."""
    found = np.zeros((len(motions), len(motions)))
    for first, second in itertools.combinations(range(len(motions)), 2):
        found[first, second] = found[second, first] = ks_distance(
            motions[first], motions[second], ties=ties
        )
    return found
