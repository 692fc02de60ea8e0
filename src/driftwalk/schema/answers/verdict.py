"""The verdict of a model check inside the fit that was checked: whether, why, and where not.

A `model_check` holds everything; the fit keeps the verdict, the p values and the map of residuals,
so that one dataset answers whether its numbers may be used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from driftwalk.core.errors import InputError
from driftwalk.schema.check import described

if TYPE_CHECKING:
    import xarray as xr

PLACES: Final = {"component": "residual_component", "y": "cell_y", "x": "cell_x"}
"""Dimension in a check to that in a fit, which has other nodes of its own."""
BY_CELL: Final = (
    *("residual", "residual_count", "residual_distance", "noise_ratio", "noise_ratio_std"),
)


def with_verdict(fit: xr.Dataset, check: xr.Dataset) -> xr.Dataset:
    """Return a fit that holds what its check found.

    Parameters
    ----------
    fit : xarray.Dataset
        A `fit`.
    check : xarray.Dataset
        Its `model_check`.

    Returns
    -------
    xarray.Dataset
        The `fit`, with ``explained`` (boolean), ``finding`` (sentences), ``p_value`` by criterion
        and the residuals by cell.
    """
    kept = check[["explained", "finding", "p_value", *BY_CELL]].rename(PLACES)
    found = fit.merge(kept, combine_attrs="override", compat="override", join="outer")
    found["residual_cell_size"] = ((), check.attrs["cell_size_m"])
    return described(found)


def residuals_of(dataset: xr.Dataset) -> xr.Dataset:
    """Return the residuals by cell of a model check, or of a fit that was checked.

    Parameters
    ----------
    dataset : xarray.Dataset
        A `model_check` or a `fit`.

    Returns
    -------
    xarray.Dataset
        ``residual`` on (component, y, x), ``residual_count``, ``residual_distance``,
        ``noise_ratio`` and ``noise_ratio_std`` on (y, x); the size of a cell is the attribute
        ``cell_size_m``.

    Raises
    ------
    InputError
        When the dataset is neither, or the fit was not checked.
    """
    kind = dataset.attrs.get("kind")
    if kind == "model_check":
        return dataset
    if kind != "fit":
        raise InputError(
            f"a fit or a model check has residuals, got a dataset of kind {kind!r}; "
            "check_model makes a model check"
        )
    if "residual" not in dataset:
        why = dataset.attrs.get("check_left_out", "check_model makes a model check")
        raise InputError(f"the fit was not checked, so it has no residuals: {why}")
    found = dataset[list(BY_CELL)]
    found = found.drop_vars([name for name in found.coords if name not in PLACES.values()])
    size = float(dataset["residual_cell_size"])
    return found.rename({new: old for old, new in PLACES.items()}).assign_attrs(cell_size_m=size)
