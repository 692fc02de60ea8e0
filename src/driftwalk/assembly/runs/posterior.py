"""Draw parameters from the posterior of a fit.

It is Gaussian in ln C_d, in the logarithm of the force's noise intensity and in the numbers of the
force law, with the covariance that the fit stores; numbers of the camera are left out. It holds for
the block's mass, added mass and side as they are stated: a recording tells C_d and sigma_F over the
mass, a simulation depends on nothing else, and so what the mass leaves open of the two changes no
motion and is not drawn.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.runs.drawn_flow import RUNS_PER_FLOW
from driftwalk.assembly.runs.plan import stream_keys
from driftwalk.core.errors import InputError
from driftwalk.model import declared
from driftwalk.schema.answers.facts import fitted_value
from driftwalk.schema.check import refuse_other_version

if TYPE_CHECKING:
    import xarray as xr

Floats = npt.NDArray[np.float64]

PARAMETERS: Final = ("ln_drag_coefficient", "ln_noise_intensity")
LINEAR_SHARE: Final = "linear_share"
PLAIN: Final = {"drag_power": "drag_power", "force_memory": "force_memory_s"}
"""Numbers of a law that [forces] holds as they are, by the fit's name for them."""
LAW_NUMBERS: Final = (LINEAR_SHARE, *PLAIN)


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
    chosen = [name for name in (*PARAMETERS, *LAW_NUMBERS) if name in names]
    rows = [names.index(name) for name in chosen]
    covariance = fit["covariance"].values[np.ix_(rows, rows)]
    try:
        root = np.linalg.cholesky(covariance)
    except np.linalg.LinAlgError:
        raise InputError("the covariance of the fit is not one: fit again") from None
    shared = RUNS_PER_FLOW if law_of(fit) else 1
    index = np.arange(-(-runs // shared))
    keys = stream_keys("parameters", seed=seed, trial=trial, index=index)
    normal = np.stack([_normal(key, len(rows)) for key in keys])
    # Sums of products in one order: a product of matrices depends on the processor.
    change = dict(zip(chosen, (root[:, None, :] * normal[None]).sum(axis=2), strict=True))
    with np.errstate(over="ignore"):
        by_drag = np.exp(change["ln_drag_coefficient"])
        by_force = np.exp(0.5 * change["ln_noise_intensity"])
    quadratic, linear = np.ones(keys.size), np.ones(keys.size)
    if LINEAR_SHARE in change:
        share = _number(fit, LINEAR_SHARE)
        # With a smaller share of quadratic drag, nothing is known of its C_d.
        quadratic -= change[LINEAR_SHARE] / max(1.0 - share, 1e-6)
        linear += change[LINEAR_SHARE] / share
    drawn = {
        "drag_coefficient": fitted_value(fit, "drag_coefficient") * by_drag * quadratic,
        "force_std_N": fitted_value(fit, "force_std") * by_force,
    }
    for key in law_of(fit):
        if key == "linear_drag_kg_s":
            drawn[key] = fitted_value(fit, "linear_drag") * by_drag * linear
    for name, key in PLAIN.items():
        if name in change:
            drawn[key] = _number(fit, name) + change[name]
    return {key: np.repeat(_within(key, values), shared)[:runs] for key, values in drawn.items()}


def _within(key: str, values: Floats) -> Floats:
    """Return values within what [forces] takes: draws of a fit may lie beyond it."""
    quantity = declared(f"forces.{key}").quantity
    return values if quantity is None else np.clip(values, quantity.ge, quantity.le)


def _normal(key: np.uint64, count: int) -> Floats:
    return np.random.Generator(np.random.Philox(key=int(key))).standard_normal(count)


def _number(fit: xr.Dataset, name: str) -> float:
    """Return a number of the law as the fit's filter takes it."""
    return float(fit["number_value"].values[fit["number"].values.tolist().index(name)])
