"""Noise-free recording of a simulated run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.schema.check import require_kind

if TYPE_CHECKING:
    import xarray as xr


def path_recording(path: xr.Dataset, *, run: int = 0) -> xr.Dataset:
    """Return one simulated run as a recording of all its blocks.

    Functions that read recordings can then be tried on motion whose events are known: `classify`
    above all.

    Parameters
    ----------
    path : xarray.Dataset
        An `assembly_path`.
    run : int
        The run's index, as in its coordinate ``run``.

    Returns
    -------
    xarray.Dataset
        A `trajectory`: ``x``, ``y`` [m], ``theta`` [rad] on (time, body), bodies named by their
        index.

    Raises
    ------
    InputError
        When the dataset is of another kind, or has no such run.

    Examples
    --------
    >>> import driftwalk as dw
    >>> still = dw.uniform_flow(0.0, 0.0)
    >>> path = dw.assembly_path(dw.Study(), still, blocks=2, duration=1.0)
    >>> dw.classify(dw.path_recording(path), side=0.03)["outcome"].sizes["time"]
    11
    """
    from driftwalk.schema import build_trajectory

    require_kind(path, "assembly_path", "assembly_path makes one")
    runs = path["run"].values.tolist()
    if run not in runs:
        raise InputError(f"there is no run {run}: the path holds {', '.join(map(str, runs))}")
    one = path.sel(run=run)
    x, y, theta = (
        np.asarray(one[name].transpose("time", "block").values, dtype=np.float64)
        for name in ("x", "y", "theta")
    )
    return build_trajectory(
        one["time"].values,
        x,
        y,
        theta,
        body=[str(block) for block in one["block"].values],
        attrs={
            "source": f"simulated run {run}",
            "format": "driftwalk",
            "arena": path.attrs["arena"],
            "sample_rate_Hz": 1.0 / float(path.attrs["sample_interval_s"]),
        },
    )
