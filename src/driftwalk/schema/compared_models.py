"""Numbers of compared motion models that figures and pages read alike."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr


def own_score(comparison: xr.Dataset) -> float:
    """Return the distance of the recording's own parts, as the models' distances are counted.

    Parameters
    ----------
    comparison : xarray.Dataset
        A `model_comparison`.

    Returns
    -------
    float
        Mean over the aspects of the distance over the floor.
    """
    return float((comparison["own_distance"] / comparison["floor"]).mean())
