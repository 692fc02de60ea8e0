"""Numbers of compared motion models that figures and pages read alike."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr


def own_score(found: xr.Dataset) -> float:
    """Return the distance of the recording's own parts, as the models' distances are counted.

    Parameters
    ----------
    found : xarray.Dataset
        A `model_comparison` or a `model_calibration`.

    Returns
    -------
    float
        Mean over the aspects of the distance over the floor.
    """
    return float((found["own_distance"] / found["floor"]).mean())
