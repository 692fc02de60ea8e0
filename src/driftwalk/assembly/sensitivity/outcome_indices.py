"""Sobol' sensitivity indices of assembly outcomes, and the share of noise."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.assembly.outcomes.classes import listed_classes
from driftwalk.assembly.outcomes.distribution import is_complete, sampling_variance
from driftwalk.assembly.sensitivity.axes import KEYS
from driftwalk.assembly.sensitivity.dataset import count_table
from driftwalk.assembly.sensitivity.settings import (
    FIRST_TRIALS,
    Outcomes,
    Progress,
    Settings,
    place_first,
    simulate_settings,
    world_plan,
)
from driftwalk.assembly.sensitivity.sobol import sobol_design, sobol_indices
from driftwalk.core.errors import InputError
from driftwalk.schema.check import described
from driftwalk.schema.kinds import KINDS
from driftwalk.sweep import threads_of_unit

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.sweep import Store

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
    design = _design(study, samples, bounds)
    settings = _settings(study, flow, design, threads_of_unit(threads, executor))
    outcomes = simulate_settings(settings, store=store, progress=progress, executor=executor)
    return _indices(study, design, outcomes)


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
    settings = _settings(study, flow, _design(study, samples, bounds), threads)
    if study.sensitivity.runs < 2:
        raise InputError(
            "Sobol' indices need at least 2 runs of each setting, got 1 (`sensitivity.runs`)"
        )
    place_first(settings)
    return settings.size


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
    size, forces = design.sizes["setting"], study.forces
    worlds, world = [study], np.zeros(size, dtype=np.int64)
    if "tank_diameter" in column:
        diameters, world = np.unique(column["tank_diameter"], return_inverse=True)
        worlds = [
            apply_overrides(study, {KEYS["tank_diameter"]: diameter})
            for diameter in diameters.tolist()
        ]
    return Settings(
        worlds=[world_plan(one, flow, threads=threads) for one in worlds],
        world=world,
        drag_coefficient=column.get("drag_coefficient", np.full(size, forces.drag_coefficient)),
        force_std=column.get("force_std", np.full(size, forces.force_std_N)),
        trial=FIRST_TRIALS.sobol + np.arange(size),
    )


def _indices(study: Study, design: xr.Dataset, outcomes: Outcomes) -> xr.Dataset:
    import xarray as xr

    assembly = study.assembly
    occurred = {name for count in outcomes.count for name in count}
    names = listed_classes(occurred, assembly.blocks, chirality=assembly.chirality)
    count = count_table(outcomes.count, names)
    runs = count.sum(axis=1)
    short = np.flatnonzero(runs < 2)
    if short.size:
        raise InputError(
            f"setting {int(short[0])} of the Sobol' design has {int(runs[short[0]])} runs with an "
            "outcome, at least 2 are needed; use more runs (`sensitivity.runs`) or a "
            "smaller time step"
        )
    share = count / runs[:, None]
    complete = share[:, is_complete(list(names))].sum(axis=1)
    # Sums of shares may exceed one by a hair.
    table = np.minimum(np.column_stack([complete, share]), 1.0)
    outputs = xr.DataArray(
        table,
        dims=("setting", "output"),
        coords={"output": np.array(["complete", *names], dtype=object)},
    )
    noise = sampling_variance(table, runs[:, None])
    found = sobol_indices(design, outputs, noise_variance=noise, seed=design.attrs["seed"])
    facts: dict[str, Any] = {
        "runs": study.sensitivity.runs,
        "left_out": int(outcomes.left_out.sum()),
        "blocks": assembly.blocks,
        "study": study.to_toml(),
        "input_units": " ".join(_unit(str(name)) for name in design["input"].values),
    }
    return described(
        found.assign(
            proportion=outputs, value=design["value"], low=design["low"], high=design["high"]
        ).assign_attrs(facts)
    )


def _unit(name: str) -> str:
    """Return the unit of an input, as the axis of a map has it."""
    return str(KINDS["sensitivity"].variable(name).units)
