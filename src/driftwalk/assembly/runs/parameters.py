"""Draw parameters from the uncertainty of a calibration or a fit.

A draw from a calibration is a point of its joint region. Where D is the smooth surface of
distances, m its minimum, L its level at the border and c the confidence of the region, a point is
drawn with a weight of ``(1 - c) ** ((D - m) / (L - m))``: 1 at the optimum, 1 - c at the border. If
what chance does to D - m has an exponential tail, as it has for a quadratic surface in two
parameters, this is the likelihood, and the region would hold the share c of it; the tail beyond the
border is left out. So draws follow the valley whatever its shape, and widen with the region where
the model does not quite explain the recording. The bootstrap's optima would do neither: they lie on
a lattice, about the optimum, as if the model were true.

A draw from a fit is one of its Gaussian posterior, `driftwalk.assembly.runs.posterior`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.runs.plan import stream_keys
from driftwalk.assembly.runs.posterior import draw_posterior, has_covariance
from driftwalk.core.errors import InputError
from driftwalk.schema.check import kind_name, refuse_other_version

if TYPE_CHECKING:
    import xarray as xr

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]


class DrawnParameters(NamedTuple):
    """Parameters of runs."""

    drag_coefficient: Floats
    """C_d of each run."""
    force_std: Floats
    """sigma_F of each run [N]."""


class _Region(NamedTuple):
    """A joint region: its border, and the weight of the points in it."""

    border: Floats
    """Vertices (C_d, sigma_F), closed, shape (vertices, 2)."""
    axes: tuple[Floats, Floats]
    weight: Floats
    """On the axes."""


def draw_parameters(
    calibration: xr.Dataset, *, runs: int, seed: int = 1, trial: int = 0
) -> DrawnParameters:
    """Draw drag coefficient and stochastic force from the uncertainty of a calibration or a fit.

    Parameters
    ----------
    calibration : xarray.Dataset
        A `calibration` with its region, that is made with a bootstrap; or a `fit`.
    runs : int
        How many to draw, one per run.
    seed, trial : int
        Address of the draws: the parameters of run r depend on seed, trial and r alone.

    Returns
    -------
    DrawnParameters
        ``drag_coefficient`` and ``force_std`` [N], shape (runs,) each. Of a calibration every pair
        lies in the region, with a weight that falls from 1 at the optimum to 1 - confidence at the
        border. Of a fit they are log-normal about its estimate, with its covariance; where its
        force law has further uncertain numbers, every 25 runs share a draw.

    Raises
    ------
    InputError
        When the calibration has no region, or the fit no covariance.

    Examples
    --------
    >>> import driftwalk as dw
    >>> calibration = dw.calibrate(dw.tank30_recording())  # doctest: +SKIP
    >>> draw_parameters(calibration, runs=2).drag_coefficient  # doctest: +SKIP
    array([0.3874, 0.3921])
    """
    if kind_name(calibration) == "fit":
        numbers = draw_posterior(calibration, runs=runs, seed=seed, trial=trial)
        return DrawnParameters(numbers["drag_coefficient"], numbers["force_std_N"])
    region = _region_of(calibration)
    index = np.arange(runs)
    parts = [
        _draw(region, stream_keys("parameters", seed=seed, trial=trial, index=part))
        for part in np.array_split(index, max(1, -(-runs // 1024)))
    ]
    drawn = np.concatenate(parts)
    return DrawnParameters(np.ascontiguousarray(drawn[:, 0]), np.ascontiguousarray(drawn[:, 1]))


def has_uncertainty(found: xr.Dataset) -> bool:
    """Return whether parameters can be drawn from a dataset.

    Parameters
    ----------
    found : xarray.Dataset
        A `calibration` or a `fit`; there is nothing to draw from in another kind.

    Examples
    --------
    >>> import xarray as xr
    >>> has_uncertainty(xr.Dataset(attrs={"kind": "model_comparison"}))
    False
    """
    kind = kind_name(found)
    return has_covariance(found) if kind == "fit" else kind == "calibration" and has_region(found)


def has_region(calibration: xr.Dataset) -> bool:
    """Return whether a calibration says how well its parameters are known."""
    return "region_drag_coefficient" in calibration and "refined_surface" in calibration


def _region_of(calibration: xr.Dataset) -> _Region:
    calibration = refuse_other_version(calibration)
    if not has_region(calibration):
        raise InputError(
            "the calibration has no joint region to draw parameters from: it was made without a "
            "bootstrap or without its refined map; calibrate with `calibration.bootstrap=200`"
        )
    surface = calibration["refined_surface"].values
    low, level = float(surface.min()), float(calibration["region_level"])
    confidence = float(calibration["confidence"])
    # A surface that stays below the level on all its settings still has a border: its own end.
    rise = np.clip((surface - low) / max(level - low, np.finfo(np.float64).tiny), 0.0, 1.0)
    border = np.column_stack(
        [calibration[f"region_{name}"].values for name in ("drag_coefficient", "force_std")]
    )
    axes = tuple(
        calibration[f"refined_{name}"].values.astype(np.float64)
        for name in ("drag_coefficient", "force_std")
    )
    return _Region(border, (axes[0], axes[1]), (1.0 - confidence) ** rise)


def _draw(region: _Region, keys: npt.NDArray[np.uint64]) -> Floats:
    """Return one point per key, by rejection from the border's bounding box."""
    found = np.empty((keys.size, 2))
    waiting = np.arange(keys.size)
    low, high = region.border.min(axis=0), region.border.max(axis=0)
    for attempt in range(1000):
        numbers = np.stack([_numbers(key, attempt) for key in keys[waiting]])
        point = low + numbers[..., :2] * (high - low)
        taken = numbers[..., 2] < _weight_at(region, point)
        taken &= _inside(region.border, point.reshape(-1, 2)).reshape(taken.shape)
        done = taken.any(axis=1)
        first = taken.argmax(axis=1)[done]
        found[waiting[done]] = point[done, first]
        waiting = waiting[~done]
        if waiting.size == 0:
            return np.maximum(found, 0.0)
    raise InputError("the calibration's joint region has no area to draw parameters from")


def _numbers(key: Any, attempt: int) -> Floats:
    """Return three uniform numbers in [0, 1) per proposal of one attempt of one run."""
    bits = np.random.Philox(key=int(key), counter=attempt << 64)
    # Points that are proposed to a run at once.
    return np.random.Generator(bits).random((32, 3))


def _weight_at(region: _Region, point: Floats) -> Floats:
    """Return the weight at points, bilinear between the settings, shape of `point` without axis."""
    cells, parts = [], []
    for axis, value in zip(region.axes, np.moveaxis(point, -1, 0), strict=True):
        place = np.interp(value, axis, np.arange(axis.size))
        cell = np.minimum(place.astype(np.intp), max(axis.size - 2, 0))
        cells.append((cell, np.minimum(cell + 1, axis.size - 1)))
        parts.append(place - cell)
    (left, right), (down, up) = cells
    across, along = parts
    weight = region.weight
    low = (1.0 - across) * weight[left, down] + across * weight[right, down]
    high = (1.0 - across) * weight[left, up] + across * weight[right, up]
    return np.asarray((1.0 - along) * low + along * high)


def _inside(border: Floats, point: Floats) -> Bools:
    """Return whether points lie in a closed polygon: they see an odd number of edges upwards."""
    x, y = point[:, :1], point[:, 1:]
    here, there = border, np.roll(border, -1, axis=0)
    spans = (here[:, 0] > x) != (there[:, 0] > x)
    width = np.where(here[:, 0] == there[:, 0], 1.0, there[:, 0] - here[:, 0])
    above = here[:, 1] + (x - here[:, 0]) / width * (there[:, 1] - here[:, 1]) > y
    return np.asarray((spans & above).sum(axis=1) % 2 == 1)
