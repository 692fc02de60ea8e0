"""Draw the parameters and the flow of runs from the uncertainty of a calibration or a fit.

A draw from a calibration is a point of its joint region. Where D is the smooth surface of
distances, m its minimum, L its level at the border and c the confidence of the region, a point is
drawn with a weight of ``(1 - c) ** ((D - m) / (L - m))``: 1 at the optimum, 1 - c at the border. If
what chance does to D - m has an exponential tail, as it has for a quadratic surface in two
parameters, this is the likelihood, and the region would hold the share c of it; the tail beyond the
border is left out. So draws follow the valley whatever its shape, and widen with the region where
the model does not quite explain the recording. The bootstrap's optima would do neither: they lie on
a lattice, about the optimum, as if the model were true.

A draw from a fit is one of its Gaussian posterior, in ln C_d, in the logarithm of the force's noise
intensity and in the numbers of the force law, with the covariance that the fit stores; numbers of
the camera are left out. It holds for the block's mass, added mass and side as they are stated: a
recording tells C_d and sigma_F over the mass, a simulation depends on nothing else, and so what the
mass leaves open of the two changes no motion and is not drawn.

A fit of several bodies adds the stirring length, and of glued blocks the share of hidden drag. They
are drawn from the quantiles of its posterior, each on its own and independent of the other draws.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.runs.plan import stream_keys
from driftwalk.core.arrays import Bools, Floats, Keys
from driftwalk.core.errors import InputError
from driftwalk.model import declared
from driftwalk.schema.answers.facts import fitted_value
from driftwalk.schema.check import refuse_other_version
from driftwalk.schema.runs import kind_of

if TYPE_CHECKING:
    import xarray as xr


RUNS_PER_FLOW: Final = 25
"""Runs that share a drawn flow: each drawn one has to be prepared for the core; chosen by hand."""
PLAIN: Final = {"drag_power": "drag_power", "force_memory": "force_memory_s"}
"""Numbers of a law that [forces] holds as they are, by the fit's name for them."""
PARAMETERS: Final = ("ln_drag_coefficient", "ln_noise_intensity", "linear_share", *PLAIN)
"""Parameters that are drawn from a fit, by the fit's names."""


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
    if drawn_from(calibration) == "covariance":
        numbers = draw_posterior(calibration, runs=runs, seed=seed, trial=trial)
        return DrawnParameters(numbers["drag_coefficient"], numbers["force_std_N"])
    region = _region_of(calibration)
    # In parts, so that the proposals of many runs do not fill the memory.
    drawn = np.concatenate(
        [
            _draw(region, stream_keys("parameters", seed=seed, trial=trial, index=part))
            for part in np.array_split(np.arange(runs), max(1, -(-runs // 1024)))
        ]
    )
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
    holds = {"covariance": has_covariance, "region": has_region}.get(drawn_from(found))
    return holds is not None and holds(found)


def drawn_from(found: xr.Dataset) -> str:
    """Return what of a dataset parameters are drawn from: "covariance", "region" or ""."""
    kind = kind_of(found)
    return "" if kind is None else kind.drawn_from


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
    names = ("drag_coefficient", "force_std")
    border = np.column_stack([calibration[f"region_{name}"].values for name in names])
    across, along = (calibration[f"refined_{name}"].values.astype(np.float64) for name in names)
    return _Region(border, (across, along), (1.0 - confidence) ** rise)


def _draw(region: _Region, keys: Keys) -> Floats:
    """Return one point per key, by rejection from the border's bounding box."""
    found = np.empty((keys.size, 2))
    waiting = np.arange(keys.size)
    low, high = region.border.min(axis=0), region.border.max(axis=0)
    for attempt in range(1000):
        # Three uniform numbers for each of the 32 points that are proposed to a run at once.
        streams = (np.random.Philox(key=int(key), counter=attempt << 64) for key in keys[waiting])
        numbers = np.stack([np.random.Generator(bits).random((32, 3)) for bits in streams])
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


def has_covariance(fit: xr.Dataset) -> bool:
    """Return whether a fit states the covariance of its parameters."""
    return "covariance" in fit and bool(np.isfinite(fit["covariance"].values).all())


def law_of(fit: xr.Dataset) -> tuple[str, ...]:
    """Return the keys of [forces] for the numbers of a fit's law that are uncertain.

    Parameters
    ----------
    fit : xarray.Dataset
        A `fit`.

    Examples
    --------
    >>> import xarray as xr
    >>> fit = xr.Dataset(coords={"parameter": ["linear_drag"], "log_parameter": ["force_memory"]})
    >>> law_of(fit)
    ('linear_drag_kg_s', 'force_memory_s')
    """
    opened = {str(name) for name in fit["log_parameter"].values}
    # A linear drag goes with C_d, even if its share of the drag is known.
    linear = "linear_drag" in fit["parameter"].values
    plain = tuple(key for name, key in PLAIN.items() if name in opened)
    return (*(("linear_drag_kg_s",) if linear else ()), *plain)


def draw_posterior(fit: xr.Dataset, *, runs: int, seed: int, trial: int) -> dict[str, Floats]:
    """Return C_d, sigma_F and the other numbers of the law of each run, by their keys in [forces].

    A law has to be prepared for the core, as a flow has: where it has numbers of its own, 25 runs
    share a draw.

    Parameters
    ----------
    fit : xarray.Dataset
        A `fit`.
    runs : int
        How many runs.
    seed, trial : int
        Address of the draws, as in `draw_parameters`.

    Raises
    ------
    InputError
        When the fit states no covariance.

    Examples
    --------
    >>> draw_posterior(fit, runs=2, seed=1, trial=1)["drag_coefficient"]  # doctest: +SKIP
    array([0.3874, 0.3921])
    """
    fit = refuse_other_version(fit)
    if not has_covariance(fit):
        raise InputError("the fit has no covariance to draw parameters from: fit again")
    names = [str(name) for name in fit["log_parameter"].values]
    chosen = [name for name in PARAMETERS if name in names]
    rows = [names.index(name) for name in chosen]
    covariance = fit["covariance"].values[np.ix_(rows, rows)]
    try:
        root = np.linalg.cholesky(covariance)
    except np.linalg.LinAlgError:
        raise InputError("the covariance of the fit is not one: fit again") from None
    shared = RUNS_PER_FLOW if law_of(fit) else 1
    index = np.arange(-(-runs // shared))
    keys = stream_keys("parameters", seed=seed, trial=trial, index=index)
    streams = (np.random.Generator(np.random.Philox(key=int(key))) for key in keys)
    normal = np.stack([stream.standard_normal(len(rows)) for stream in streams])
    # Sums of products in one order: a product of matrices depends on the processor.
    change = dict(zip(chosen, (root[:, None, :] * normal[None]).sum(axis=2), strict=True))
    with np.errstate(over="ignore"):
        by_drag = np.exp(change["ln_drag_coefficient"])
        by_force = np.exp(0.5 * change["ln_noise_intensity"])
    quadratic, linear = np.ones(keys.size), np.ones(keys.size)
    if "linear_share" in change:
        share = _number(fit, "linear_share")
        # With a smaller share of quadratic drag, nothing is known of its C_d.
        quadratic -= change["linear_share"] / max(1.0 - share, 1e-6)
        linear += change["linear_share"] / share
    drawn = {
        "drag_coefficient": fitted_value(fit, "drag_coefficient") * by_drag * quadratic,
        "force_std_N": fitted_value(fit, "force_std") * by_force,
    }
    if "linear_drag_kg_s" in law_of(fit):
        drawn["linear_drag_kg_s"] = fitted_value(fit, "linear_drag") * by_drag * linear
    for name, key in PLAIN.items():
        if name in change:
            drawn[key] = _number(fit, name) + change[name]
    return {key: np.repeat(_within(key, values), shared)[:runs] for key, values in drawn.items()}


def interaction_quantiles(fit: xr.Dataset) -> dict[str, Floats]:
    """Return what a fit of several bodies knows of hidden faces and of the stirring.

    Parameters
    ----------
    fit : xarray.Dataset
        A `fit` of glued blocks after one of a single block, or of free bodies in one recording.

    Returns
    -------
    dict
        By their keys in the study the share of hidden drag, 0 to 1, of glued blocks, and the
        stirring length [m], where it is known, each at the middles of equal shares of its
        posterior: a normal law for the first.

    Raises
    ------
    InputError
        When the fit knows neither, or has no covariance.

    Examples
    --------
    >>> interaction_quantiles(fit)["assembly.hidden_face_drag"].round(2)  # doctest: +SKIP
    array([0.29, 0.32, ..., 0.63, 0.66])
    """
    from scipy.special import ndtri

    fit = refuse_other_version(fit)
    if "stirring_length_quantile" not in fit:
        raise InputError(
            "the fit does not say what hidden faces and neighbours feel: it has to be one of glued "
            "blocks after one of a single block, or of free bodies in one recording that can tell"
        )
    if not has_covariance(fit):
        raise InputError("the fit has no covariance to draw parameters from: fit again")
    length = np.asarray(fit["stirring_length_quantile"].values, dtype=np.float64)
    found = {"forces.stirring_length_m": length}
    names = [str(name) for name in fit["log_parameter"].values]
    if "hidden_share" in names:
        at = names.index("hidden_share")
        normal = ndtri((np.arange(length.size) + 0.5) / length.size)
        share = _number(fit, "hidden_share") + float(fit["covariance"][at, at]) ** 0.5 * normal
        found["assembly.hidden_face_drag"] = np.clip(share, 0.0, 1.0)
    return found


def draw_quantiles(
    quantiles: Mapping[str, npt.ArrayLike], *, runs: int, seed: int, trial: int
) -> dict[str, Floats]:
    """Return a value of each number for each run, drawn from its quantiles; 25 runs share one.

    Parameters
    ----------
    quantiles : mapping
        Values for equal shares of probability, by a key.
    runs : int
        How many runs.
    seed, trial : int
        Address of the draws, as in `draw_parameters`.

    Examples
    --------
    >>> draw_quantiles({"length": [0.03, 0.03]}, runs=2, seed=1, trial=0)["length"]
    array([0.03, 0.03])
    """
    index = np.arange(-(-runs // RUNS_PER_FLOW))
    keys = stream_keys("glued", seed=seed, trial=trial, index=index)
    streams = (np.random.Generator(np.random.Philox(key=int(key))) for key in keys)
    uniform = np.stack([stream.random(len(quantiles)) for stream in streams])
    drawn = {}
    for (key, values), one in zip(quantiles.items(), uniform.T, strict=True):
        known = np.asarray(values, dtype=np.float64)
        chosen = known[(one * known.size).astype(np.intp)]
        drawn[key] = np.repeat(chosen, RUNS_PER_FLOW)[:runs]
    return drawn


def _within(key: str, values: Floats) -> Floats:
    """Return values within what [forces] takes: draws of a fit may lie beyond it."""
    quantity = declared(f"forces.{key}").quantity
    return values if quantity is None else np.clip(values, quantity.ge, quantity.le)


def _number(fit: xr.Dataset, name: str) -> float:
    """Return a number of the law as the fit's filter takes it."""
    return float(fit["number_value"].values[fit["number"].values.tolist().index(name)])


def has_standard_error(flow: xr.Dataset) -> bool:
    """Return whether a flow field states a standard error at any of its nodes."""
    names = ("u_standard_error", "v_standard_error")
    return all(name in flow and bool(np.isfinite(flow[name].values).any()) for name in names)


def draw_flow(
    flow: xr.Dataset, *, seed: int, trial: int, draw: int, correlated_over: float | None = None
) -> xr.Dataset:
    """Return a flow field whose measured nodes differ from the given one by chance.

    To each velocity component of each node a normal number times its standard error is added,
    independently of the other nodes, or smooth over a length that is given. Nodes without a
    standard error (filled ones, and those that the body visited once) stay as they are. The bias of
    the estimate (Eq. 4) is not drawn, nor is what the calibrated parameters have absorbed of the
    flow's error.

    Parameters
    ----------
    flow : xarray.Dataset
        A `flow_field` with ``u_standard_error`` and ``v_standard_error``.
    seed, trial, draw : int
        Address of the random numbers.
    correlated_over : float, optional
        Distance of the knots of the bicubic spline that the flow was fitted with [m]: the numbers
        of nodes are one of its splines, the same at every time.

    Examples
    --------
    >>> import driftwalk as dw
    >>> still = dw.uniform_flow(0.0, 0.0)
    >>> error = 0.0 * still["u"] + 1e-3
    >>> still = still.assign(u_standard_error=error, v_standard_error=error)
    >>> round(float(draw_flow(still, seed=1, trial=0, draw=0)["u"].std()), 4)
    0.001
    """
    key = stream_keys("flow", seed=seed, trial=trial, index=draw)[0]
    generator = np.random.Generator(np.random.Philox(key=int(key)))
    changed = {}
    for name in ("u", "v"):
        error = np.nan_to_num(flow[f"{name}_standard_error"].values, nan=0.0)
        if correlated_over is None:
            number = generator.standard_normal(error.shape)
        else:
            number = _smooth(flow, correlated_over, generator)
        changed[name] = flow[name].copy(data=flow[name].values + error * number)
    return flow.assign(changed)


def _smooth(flow: xr.Dataset, distance: float, generator: np.random.Generator) -> Floats:
    """Return a normal number at each node, (y, x), of variance 1 and smooth over a distance."""
    down, along = (_weights(flow[axis].values, distance) for axis in ("y", "x"))
    knots = generator.standard_normal((down.shape[1], along.shape[1]))
    spread = np.sqrt((down**2).sum(axis=1)[:, None] * (along**2).sum(axis=1))
    # No product of matrices: its last digits would depend on the processor.
    rows = (down[:, :, None] * knots).sum(axis=1)
    return np.asarray((rows[:, None, :] * along).sum(axis=2) / spread)


def _weights(axis: Floats, distance: float) -> Floats:
    """Return the cubic B-splines of evenly spaced knots at positions, (position, knot)."""
    place = (axis - axis[0]) / distance
    away = np.abs(place[:, None] - np.arange(-1.0, np.ceil(place[-1]) + 2.0))
    inner = 2.0 / 3.0 - away**2 + 0.5 * away**3
    outer = np.maximum(2.0 - away, 0.0) ** 3 / 6.0
    return np.asarray(np.where(away < 1.0, inner, outer))
