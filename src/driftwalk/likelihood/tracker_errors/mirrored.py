"""Orientations that are counted clockwise: the block then seems to turn against the water."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from driftwalk.likelihood.spline import Floats, Spline, basis_matrix

if TYPE_CHECKING:
    from driftwalk.likelihood.filter.series import Series


def spin_correlation(coefficients: Floats, spline: Spline, series: Sequence[Series]) -> float:
    """Return the correlation of the block's spin with the vorticity of the water around it.

    A block in water turns with it, at about half the vorticity. With the orientation counted the
    wrong way round the correlation is negative.
    """
    spins, vorticities = [], []
    for one in series:
        seen = np.isfinite(one.x) & np.isfinite(one.y) & (one.excluded == 0)
        spins.append(one.omega[seen])
        vorticities.append(_vorticity(coefficients, spline, one.x[seen], one.y[seen]))
    spin, vorticity = np.concatenate(spins), np.concatenate(vorticities)
    size = float(np.sqrt((spin**2).mean() * (vorticity**2).mean()))
    return float((spin * vorticity).mean()) / size if size > 0.0 else 0.0


def _vorticity(coefficients: Floats, spline: Spline, x: Floats, y: Floats) -> Floats:
    """Return dv/dx - du/dy at places, from differences over a tenth of a cell."""
    step = 0.05 * spline.spacing

    def at(component: int, dx: float, dy: float) -> Floats:
        along_x = basis_matrix((x + dx - spline.origin_x) / spline.spacing, spline.columns)
        along_y = basis_matrix((y + dy - spline.origin_y) / spline.spacing, spline.rows)
        return np.asarray(np.einsum("ni,ji,nj->n", along_x, coefficients[component], along_y))

    return (at(1, step, 0.0) - at(1, -step, 0.0) - at(0, 0.0, step) + at(0, 0.0, -step)) / (
        2.0 * step
    )
