"""Sobol' sensitivity indices of outputs that are themselves estimates.

An output of the self-assembly stage is a proportion of finitely many runs, so part of its variance
over the design is sampling noise, and noise looks like a further input that acts together with
every other one. The indices therefore come with the share of noise, and without it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from statistics import NormalDist
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.outcomes.distribution import is_complete, sampling_variance
from driftwalk.assembly.outcomes.outcome_classes import listed_classes
from driftwalk.assembly.runs.plan import chirality_of
from driftwalk.assembly.sensitivity.settings import (
    FIRST_TRIALS,
    KEYS,
    Outcomes,
    OutcomeStudy,
    Settings,
    make_settings,
    world_plan,
)
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.core.intervals import check_confidence
from driftwalk.core.progress import Progress
from driftwalk.schema.check import build_dataset, described, require_kind
from driftwalk.schema.kinds import KINDS
from driftwalk.sweep import threads_of_unit

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.sweep import Store


MEASURES = (
    "first_order",
    "first_order_half_width",
    "total_order",
    "total_order_half_width",
)


def sobol_design(
    bounds: Mapping[str, tuple[float, float]], *, samples: int, seed: int
) -> xr.Dataset:
    """Return the settings at which a function must be evaluated for its Sobol' indices.

    Saltelli's extension of a scrambled Sobol' sequence, for first and total order:
    ``samples * (inputs + 2)`` settings, uniform within the bounds.

    Parameters
    ----------
    bounds : mapping of str to (float, float)
        Lowest and highest value of each input, by name, at least two inputs.
    samples : int
        Base samples, a power of two of at least 8; the error of an index goes down as
        1 / sqrt(samples) or faster.
    seed : int
        Seed of the scrambling, 0 <= seed < 2**31.

    Returns
    -------
    xarray.Dataset
        Kind "sobol_design": ``value`` (setting, input), ``low`` and ``high`` (input);
        ``attrs["samples"]``, ``attrs["seed"]``. The order of the settings matters: evaluate the
        function for each and keep the order.

    Raises
    ------
    InputError
        When a bound or an option is out of range.

    Examples
    --------
    >>> design = sobol_design({"a": (0.0, 1.0), "b": (5.0, 6.0)}, samples=8, seed=1)
    >>> dict(design["value"].sizes)
    {'setting': 32, 'input': 2}
    """
    from scipy.stats import qmc

    low, high = _checked_bounds(bounds)
    if samples < 8 or samples & (samples - 1):
        raise InputError(f"samples must be a power of two of at least 8, got {samples}")
    _check_seed(seed)
    count = len(bounds)
    # SciPy's newer `rng` would spawn from the seed, and make other settings of it than `seed` does.
    a, b = np.split(qmc.Sobol(2 * count, seed=seed).random(samples), 2, axis=1)
    # In each group of settings: A, A with one input of B after the other, B.
    unit = np.repeat(a[:, None, :], count + 2, axis=1)
    unit[:, np.arange(1, count + 1), np.arange(count)] = b
    unit[:, -1] = b
    value = qmc.scale(unit.reshape(-1, count), low, high)
    return build_dataset(
        "sobol_design",
        {
            "value": (("setting", "input"), value),
            "low": ("input", low),
            "high": ("input", high),
        },
        {"input": ("input", np.array(list(bounds), dtype=object))},
        {"samples": samples, "seed": seed},
    )


def sobol_indices(
    design: xr.Dataset,
    outputs: xr.DataArray | npt.ArrayLike,
    *,
    noise_variance: npt.ArrayLike = 0.0,
    confidence: float = 0.9,
    seed: int = 1,
) -> xr.Dataset:
    """Return first and total order Sobol' indices of one or more outputs, and the effect of noise.

    Parameters
    ----------
    design : xarray.Dataset
        Result of `sobol_design`.
    outputs : xarray.DataArray or array_like, shape (setting,) or (setting, output)
        Outputs of the function in the order of the design, all finite. A DataArray keeps its second
        dimension, ``class`` for example.
    noise_variance : array_like, shape of `outputs` or one number
        Sampling variance of each output, independent between settings: `sampling_variance` for
        proportions. 0 for an exact function.
    confidence : float
        Confidence of the half widths, in (0, 1).
    seed : int
        Seed of the bootstrap behind the half widths, 0 <= seed < 2**31.

    Returns
    -------
    xarray.Dataset
        Kind "sobol_indices". By output (if there is that dimension) and ``input``:
        ``first_order``, ``total_order`` with ``_half_width``, as the outputs show them, and
        ``first_order_corrected``, ``total_order_corrected`` with the noise taken out. By output:
        ``variance``, and ``noise_share``, the share s of the variance that is sampling noise.
        ``attrs``: ``samples``, ``confidence``, and what pure noise would show:
        ``pure_noise_first_order_half_width`` around 0, and ``pure_noise_total_order`` (1). An
        output that is the same in all settings has no indices: NaN.

    Raises
    ------
    InputError
        When the outputs do not fit the design or are not all finite, or an option is out of range.

    Notes
    -----
    Y = f(X) + noise, with variance V = V_f + V_noise and s = V_noise / V. The noise is redrawn
    at every setting, so it does not favour any input, but two settings that differ in one input
    differ by their noise too. The expected indices are ``S (1 - s)`` and ``T (1 - s) + s``: an
    input without any influence shows a total index of s, in pure noise of 1. The corrected indices
    are ``S / (1 - s)`` and ``(T - s) / (1 - s)``, NaN where s >= 1. Of pure noise the first index
    has standard deviation ``sqrt(2 / samples)``; what lies within that half width means nothing.
    Settings that share their random numbers have less noise between them than this assumes, and
    would be corrected too far.

    Examples
    --------
    >>> design = sobol_design({"a": (0.0, 1.0), "b": (0.0, 1.0)}, samples=256, seed=1)
    >>> found = sobol_indices(design, design["value"].values @ [2.0, 1.0])
    >>> found["first_order"].values.round(2).tolist(), found["total_order"].values.round(2).tolist()
    ([0.8, 0.2], [0.8, 0.2])
    """
    require_kind(design, "sobol_design", "sobol_design makes one")
    inputs, samples = design.sizes["input"], int(design.attrs["samples"])
    settings = samples * (inputs + 2)
    table, other = _checked_outputs(outputs, settings)
    noise = _checked_noise(noise_variance, np.shape(outputs)).reshape(table.shape)
    check_confidence(confidence)
    _check_seed(seed)
    # The first and last of each group of settings are independent draws: Saltelli's A and B.
    place = np.arange(settings) % (inputs + 2)
    independent = (place == 0) | (place == inputs + 1)
    varies = np.ptp(table[independent], axis=0) > 0
    variance = np.where(varies, table[independent].var(axis=0), 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(varies, noise[independent].mean(axis=0) / variance, np.nan)
    # The seed itself is usually that of the design; the two draws stay apart.
    drawn = np.random.default_rng(seed + 1).integers(samples, size=(samples, 200)).T
    # Half the width of a normal interval, in standard deviations.
    sigmas = NormalDist().inv_cdf(0.5 + confidence / 2)
    indices = np.full((len(MEASURES), table.shape[1], inputs), np.nan)
    for i in np.flatnonzero(varies):
        groups = table[:, i].reshape(samples, inputs + 2)
        found = _estimates(groups[np.vstack([np.arange(samples), drawn])])
        indices[0::2, i] = found[:, 0]
        indices[1::2, i] = sigmas * found[:, 1:].std(axis=1, ddof=1)
    by_input = dict(zip(MEASURES, indices, strict=True))
    # What the outputs would show without noise.
    signal = np.where(share < 1, 1 - share, np.nan)[:, None]
    by_input["first_order_corrected"] = by_input["first_order"] / signal
    by_input["total_order_corrected"] = (by_input["total_order"] - share[:, None]) / signal
    by_output = {"variance": variance, "noise_share": share}
    one_output = np.ndim(outputs) == 1
    data: dict[str, Any] = {}
    for measures, dims in ((by_input, (*other, "input")), (by_output, (*other,))):
        for name, values in measures.items():
            data[name] = (dims, values[0] if one_output else values)
    return build_dataset(
        "sobol_indices",
        data,
        {"input": design["input"], **other},
        {
            "samples": samples,
            "confidence": confidence,
            "seed": seed,
            "pure_noise_first_order_half_width": sigmas * math.sqrt(2 / samples),
            "pure_noise_total_order": 1.0,
        },
    )


def _checked_bounds(bounds: Mapping[str, tuple[float, float]]) -> tuple[Floats, Floats]:
    if len(bounds) < 2:
        raise InputError(f"bounds: indices compare at least two inputs, got {len(bounds)}")
    for name, (low, high) in bounds.items():
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise InputError(
                f"bounds of '{name}': expected two finite numbers, the lower first, got {low}, "
                f"{high}"
            )
    table = np.array(list(bounds.values()), dtype=np.float64)
    return table[:, 0], table[:, 1]


def _check_seed(seed: int) -> None:
    if not 0 <= seed < 2**31:
        raise InputError(f"seed: expected a whole number from 0 to 2**31 - 1, got {seed}")


def _checked_outputs(
    outputs: xr.DataArray | npt.ArrayLike, settings: int
) -> tuple[Floats, dict[str, Any]]:
    """Return outputs, shape (setting, output), and the coordinate of the second dimension."""
    import xarray as xr

    values = np.asarray(outputs, dtype=np.float64)
    if values.ndim not in (1, 2) or values.shape[0] != settings or not values.size:
        raise InputError(
            f"outputs of shape {values.shape} do not fit the design of {settings} settings: "
            "expected one row per setting, in the order of the design"
        )
    wrong = int((~np.isfinite(values.reshape(settings, -1)).all(axis=1)).sum())
    if wrong:
        raise InputError(
            f"outputs: {wrong} of {settings} settings have none that is finite; Sobol indices need "
            "every setting of the design"
        )
    other: dict[str, Any] = {}
    if values.ndim == 2:
        name, labels = "output", np.arange(values.shape[1])
        if isinstance(outputs, xr.DataArray):
            name = str(outputs.dims[1])
            labels = outputs[name].values
        other = {name: (name, labels)}
    return values.reshape(settings, -1), other


def _checked_noise(noise_variance: npt.ArrayLike, shape: tuple[int, ...]) -> Floats:
    noise = np.asarray(noise_variance, dtype=np.float64)
    if noise.shape not in ((), shape):
        raise InputError(
            f"noise_variance of shape {noise.shape} does not fit outputs of shape {shape}"
        )
    if not (np.isfinite(noise) & (noise >= 0)).all():
        raise InputError("noise_variance: a variance is negative or not finite")
    return np.broadcast_to(noise, shape)


def _estimates(groups: Floats) -> Floats:
    """Return first and total order indices, shape (2, resample, input), of at least two resamples.

    To SciPy every resample is a separate output: its bootstrap takes no seed. One that happens
    to hold a single value has indices of 0. `groups`: shape (resample, sample, input + 2).
    """
    from scipy.stats import sobol_indices as indices_of

    a, b = groups[..., 0], groups[..., -1]
    between = np.moveaxis(groups[..., 1:-1], -1, 0)
    found = indices_of(func={"f_A": a, "f_B": b, "f_AB": between}, n=groups.shape[1])
    return np.stack([found.first_order, found.total_order])


INPUTS: Final = ("drag_coefficient", "force_std", "tank_diameter")


def sensitivity_indices(
    study: Study,
    flow: xr.Dataset,
    *,
    samples: int,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    store: Store | None = None,
    progress: Progress | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
) -> xr.Dataset:
    """Return the Sobol' indices of the outcomes of self-assembly, with the share of noise.

    Parameters
    ----------
    study, flow, store, threads, executor
        As in `sensitivity_map`.
    samples : int
        Base samples, a power of two of at least 8; ``samples * (inputs + 2)`` settings are
        simulated.
    bounds : mapping of str to (float, float), optional
        Lowest and highest value of ``drag_coefficient``, ``force_std`` [N], ``tank_diameter`` [m];
        default: those of the study's map, with the tank's diameter where that is a list of at least
        two.
    progress : callable, optional
        Called with the number of finished settings and the total.

    Returns
    -------
    xarray.Dataset
        Kind "sobol_indices", see the function of that name, by ``output`` and ``input``: "complete"
        (share of runs with one assembly) and the proportion of every outcome class. With them, by
        ``setting``, ``value`` of the inputs and ``proportion`` of the outputs.

    Raises
    ------
    InputError
        When an input is not known, a bound is out of range, a setting has fewer than two runs with
        an outcome, or as `sensitivity_map`.

    Examples
    --------
    >>> import driftwalk as dw
    >>> quick = dw.Study(assembly={"blocks": 2, "duration_s": 1.0}, sensitivity={"runs": 4})
    >>> found = dw.sensitivity_indices(quick, dw.uniform_flow(0.0, 0.0), samples=8)
    >>> found["output"].values.tolist(), found["input"].values.tolist()
    (['complete', '2', '1+1'], ['drag_coefficient', 'force_std'])
    """
    made = _indices_study(study, flow, samples, bounds, threads_of_unit(threads, executor))
    return made.sweep(store=store, progress=progress, executor=executor)


def check_indices(
    study: Study,
    flow: xr.Dataset,
    *,
    samples: int,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    threads: int | None = None,
) -> int:
    """Raise the errors that `sensitivity_indices` would raise, before any run is simulated.

    Parameters
    ----------
    study, flow, samples, bounds, threads
        As in `sensitivity_indices`.

    Returns
    -------
    int
        Number of settings.

    Raises
    ------
    InputError
        As `sensitivity_indices`.

    Examples
    --------
    >>> import driftwalk as dw
    >>> dw.assembly.check_indices(dw.Study(), dw.uniform_flow(0.0, 0.0), samples=8)
    32
    """
    made = _indices_study(study, flow, samples, bounds, threads)
    made.check()
    return made.settings.size


@dataclass(frozen=True, eq=False)
class IndicesStudy(OutcomeStudy):
    """The settings of a Sobol' design."""

    study: Study
    inputs: xr.Dataset

    def check(self) -> None:
        """Refuse single runs, of which no variance is known, and blocks that find no place."""
        if self.study.sensitivity.runs < 2:
            raise InputError(
                "Sobol' indices need at least 2 runs of each setting, got 1 (`sensitivity.runs`)"
            )
        super().check()

    def dataset(self, outcomes: Outcomes) -> xr.Dataset:
        """Return the `sobol_indices`."""
        import xarray as xr

        study, inputs = self.study, self.inputs
        assembly = study.assembly
        names = listed_classes(outcomes.occurred(), assembly.blocks, chirality=chirality_of(study))
        count = outcomes.table(names)
        runs = count.sum(axis=1)
        short = np.flatnonzero(runs < 2)
        if short.size:
            raise InputError(
                f"setting {int(short[0])} of the Sobol' design has {int(runs[short[0]])} runs with "
                "an outcome, at least 2 are needed; use more runs (`sensitivity.runs`) or a "
                "smaller time step"
            )
        share = count / runs[:, None]
        complete = share[:, is_complete(names)].sum(axis=1)
        # Sums of shares may exceed one by a hair.
        table = np.minimum(np.column_stack([complete, share]), 1.0)
        outputs = xr.DataArray(
            table,
            dims=("setting", "output"),
            coords={"output": np.array(["complete", *names], dtype=object)},
        )
        noise = sampling_variance(table, runs[:, None])
        found = sobol_indices(inputs, outputs, noise_variance=noise, seed=inputs.attrs["seed"])
        facts: dict[str, Any] = {
            "runs": study.sensitivity.runs,
            "left_out": int(outcomes.left_out.sum()),
            "blocks": assembly.blocks,
            "study": study.to_toml(),
            # As the axes of a map have them.
            "input_units": " ".join(
                str(KINDS["sensitivity"].variable(str(name)).units)
                for name in inputs["input"].values
            ),
        }
        return described(
            found.assign(
                proportion=outputs, value=inputs["value"], low=inputs["low"], high=inputs["high"]
            ).assign_attrs(facts)
        )


def _indices_study(
    study: Study,
    flow: xr.Dataset,
    samples: int,
    bounds: Mapping[str, tuple[float, float]] | None,
    threads: int | None,
) -> IndicesStudy:
    inputs = _design(study, samples, bounds)
    return IndicesStudy(_settings(study, flow, inputs, threads), study, inputs)


def _design(
    study: Study, samples: int, bounds: Mapping[str, tuple[float, float]] | None
) -> xr.Dataset:
    chosen = _bounds_of(study) if bounds is None else bounds
    unknown = [name for name in chosen if name not in INPUTS]
    if unknown:
        raise InputError(f"bounds: there is no '{unknown[0]}'; choose from {', '.join(INPUTS)}")
    # The seed of the study may be larger than what the scrambling takes.
    seed = study.sensitivity.seed % 2**31
    return sobol_design(chosen, samples=samples, seed=seed)


def _bounds_of(study: Study) -> dict[str, tuple[float, float]]:
    """Return the ends of the study's map."""
    chosen = study.sensitivity
    values = {
        "drag_coefficient": chosen.drag_coefficient or chosen.drag_coefficients,
        "force_std": chosen.force_std_N or chosen.force_stds_N,
        "tank_diameter": chosen.tank_diameter_m or (),
    }
    return {
        name: (min(row), max(row))
        for name, row in values.items()
        if len(row) > 1 or name != "tank_diameter"
    }


def _settings(study: Study, flow: xr.Dataset, design: xr.Dataset, threads: int | None) -> Settings:
    """Return the settings of a design; those of one tank share a world."""
    from driftwalk.model import apply_overrides

    names = [str(name) for name in design["input"].values]
    column = dict(zip(names, design["value"].values.T, strict=True))
    studies, world = [study], np.zeros(design.sizes["setting"], dtype=np.int64)
    if "tank_diameter" in column:
        diameters, world = np.unique(column.pop("tank_diameter"), return_inverse=True)
        studies = [
            apply_overrides(study, {KEYS["tank_diameter"]: diameter})
            for diameter in diameters.tolist()
        ]
    worlds = [world_plan(one, flow, threads=threads) for one in studies]
    return make_settings(worlds, world, first_trial=FIRST_TRIALS.sobol, **column)
