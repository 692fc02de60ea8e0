"""The force laws that a fit has compared, as the command line and a page show them."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    import xarray as xr


class ComparedLaw(NamedTuple):
    """One law, against the best ones; NaN where it has no solution."""

    name: str
    loss: float
    """Loss of the mean logarithm of the density of a held out sample, against the best law."""
    std: float
    """Standard error of the loss."""
    evidence: float
    """Logarithm of the evidence, above that of the law with the most; at most 0."""

    @property
    def solved(self) -> bool:
        """Whether the law has a solution."""
        return isfinite(self.loss)


def compared_laws(fit: xr.Dataset) -> list[ComparedLaw]:
    """Return the compared laws, the best first; none where nobody asked for them.

    Parameters
    ----------
    fit : xarray.Dataset
        A `fit`.

    Examples
    --------
    >>> import xarray as xr
    >>> names = ("log_evidence", "log_score", "log_score_std")
    >>> columns = [[7.0, 9.0], [1.5, 2.0], [0.1, 0.0]]
    >>> fit = xr.Dataset(
    ...     {f"compared_{n}": ("compared_law", c) for n, c in zip(names, columns)},
    ...     {"compared_law": ["paper", "floating body"]},
    ... )
    >>> compared_laws(fit)[1]
    ComparedLaw(name='paper', loss=0.5, std=0.1, evidence=-2.0)
    """
    if "compared_law" not in fit.dims:
        return []
    score = fit["compared_log_score"].values
    evidence = fit["compared_log_evidence"].values
    std = fit["compared_log_score_std"].values
    known = bool(np.isfinite(score).any())
    best, most = (float(np.nanmax(one)) if known else np.nan for one in (score, evidence))
    return [
        ComparedLaw(
            str(fit["compared_law"].values[k]),
            best - float(score[k]),
            float(std[k]),
            float(evidence[k]) - most,
        )
        for k in np.argsort(-score)
    ]
