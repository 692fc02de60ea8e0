"""Sensitivity map: outcomes over settings, compared with a reference."""

from __future__ import annotations

import math
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.runs.plan import Plan
from driftwalk.assembly.sensitivity.dataset import map_dataset, reference_dataset
from driftwalk.assembly.sensitivity.settings import (
    FIRST_TRIALS,
    Progress,
    Settings,
    place_first,
    simulate_settings,
    world_plan,
)
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.sweep import threads_of_unit

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.sweep import Store


def sensitivity_map(
    study: Study,
    flow: xr.Dataset,
    *,
    axes: Mapping[str, Any] | None = None,
    reference: xr.Dataset | None = None,
    store: Store | None = None,
    progress: Progress | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
) -> xr.Dataset:
    """Simulate self-assembly at many settings, and measure how far outcomes lie from a reference.

    The paper's study is that of a default `Study`: C_d from 0 to 1.5, sigma_F from 0 to 1.5 mN,
    1000 runs of 5 minutes each.

    Parameters
    ----------
    study : Study
        Its [sensitivity] says what varies, how many runs a setting has, and the seed; all else,
        drag coefficient and force_std too, is as in the reference unless it varies.
    flow : xarray.Dataset
        The water's velocity, a `flow_field` that covers every tank. It does not change with the
        tank: a smaller one cuts it off.
    axes : mapping, optional
        Values to compare, by the names ``tank_diameter`` [m], ``blocks``, ``flow`` (datasets by
        name, or files), ``latching``, ``hidden_face_drag``, ``drag_coefficient``, ``force_std``
        [N]; every combination is simulated. Default: the axes of [sensitivity].
    reference : xarray.Dataset, optional
        An `outcome_distribution`; default: `sensitivity_reference` of the study, in memory.
    store : Store, optional
        Where finished work units are kept (`driftwalk.core.files.rundir`); memory when left out.
    progress : callable, optional
        Called with the number of finished settings and the total.
    threads : int, optional
        Default: all processors. The result does not depend on it.
    executor : concurrent.futures.Executor, optional
        Computes the work units elsewhere, see `driftwalk.sweep.run_sweep`; each then has one
        thread if `threads` is left out. The result does not depend on it.

    Returns
    -------
    xarray.Dataset
        Kind "sensitivity", dimensions in the order above. On (axes..., class) ``count`` and
        ``proportion``; on (axes...) ``runs`` (with an outcome), ``left_out``, ``complete`` (share
        of runs with one assembly), ``first_contact_median`` and ``completion_median`` [s, NaN when
        not reached], ``l1_distance`` to the reference, ``l1_in_floors`` (see the function of that
        name), both NaN where the number of blocks is another, and ``trial``: with it
        `assemble` simulates a setting again. On (class) ``reference``. On (axes..., time,
        class_over_time) ``count_over_time``, the runs in each class at 101 times, and on (time,
        class_over_time) ``reference_over_time``, the shares of a reference that has the same times;
        the classes are the 24 that are most frequent somewhere, and "other". ``attrs``:
        ``reference_runs``, ``noise_floor_mean`` and ``noise_floor_95``, the l1 distance that the
        reference itself would have with so many runs; with a reference of this study what it was
        made with, ``reference_drag_coefficient``, ``reference_force_std_N``, ...

    Raises
    ------
    InputError
        When an axis is not known, a value is out of range, blocks do not fit a tank, or a flow does
        not cover one.

    Examples
    --------
    >>> import driftwalk as dw
    >>> few = {"runs": 3, "reference_realisations": 2}
    >>> quick = dw.Study(assembly={"blocks": 2, "duration_s": 1.0}, sensitivity=few)
    >>> still = dw.uniform_flow(0.0, 0.0)
    >>> found = dw.sensitivity_map(quick, still, axes={"latching": ["collision", "none"]})
    >>> dict(found["proportion"].sizes)
    {'latching': 2, 'class': 2}
    """
    chosen = make_axes(study, axes)
    settings = _map_settings(chosen, flow, threads_of_unit(threads, executor))
    if reference is None:
        reference = sensitivity_reference(chosen.study, flow, threads=threads, executor=executor)
    outcomes = simulate_settings(settings, store=store, progress=progress, executor=executor)
    return map_dataset(chosen, settings, outcomes, reference)


def sensitivity_reference(
    study: Study,
    flow: xr.Dataset,
    *,
    store: Store | None = None,
    progress: Progress | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
) -> xr.Dataset:
    """Simulate the reference of a sensitivity analysis: several realisations of one setting.

    Parameters
    ----------
    study : Study
        Its [sensitivity] says how many realisations there are, of how many runs each, and the
        seed; parameters and blocks are the study's.
    flow, store, threads, executor
        As in `sensitivity_map`.
    progress : callable, optional
        Called with the number of finished realisations and the total.

    Returns
    -------
    xarray.Dataset
        Kind "outcome_distribution" of all runs, with ``realisation_count`` and
        ``realisation_proportion`` (realisation, class), ``standard_deviation`` (class) over the
        realisations, ``count_over_time`` (time, class_over_time) as in `sensitivity_map`, of every
        class that occurs, and the attributes ``realisations``, ``mean_pairwise_l1`` (the mean l1
        distance of two realisations; the paper has 0.065 for 10 realisations of 1000 runs) and
        ``expected_pairwise_l1``: what multinomial sampling predicts for it.

    Raises
    ------
    InputError
        When the blocks do not fit the tank, the flow does not cover it, or no run of a realisation
        has an outcome.

    Examples
    --------
    >>> import driftwalk as dw
    >>> few = {"runs": 3, "reference_realisations": 2}
    >>> quick = dw.Study(assembly={"blocks": 2, "duration_s": 1.0}, sensitivity=few)
    >>> found = dw.sensitivity_reference(quick, dw.uniform_flow(0.0, 0.0))
    >>> found.attrs["runs"], dict(found["realisation_count"].sizes)
    (6, {'realisation': 2, 'class': 2})
    """
    settings = _reference_settings(study, flow, threads_of_unit(threads, executor))
    outcomes = simulate_settings(settings, store=store, progress=progress, executor=executor)
    return reference_dataset(settings.worlds[0], outcomes)


def check_sensitivity(
    study: Study,
    flow: xr.Dataset,
    *,
    axes: Mapping[str, Any] | None = None,
    threads: int | None = None,
) -> int:
    """Raise the errors that `sensitivity_map` would raise, before any run is simulated.

    Parameters
    ----------
    study, flow, axes, threads
        As in `sensitivity_map`.

    Returns
    -------
    int
        Number of settings.

    Raises
    ------
    InputError
        As `sensitivity_map`.

    Examples
    --------
    >>> import driftwalk as dw
    >>> dw.assembly.check_sensitivity(dw.Study(), dw.uniform_flow(0.0, 0.0))
    961
    """
    chosen = make_axes(study, axes)
    settings = _map_settings(chosen, flow, threads)
    place_first(settings)
    place_first(_reference_settings(chosen.study, flow, threads))
    return settings.size


def _map_settings(axes: Axes, flow: xr.Dataset, threads: int | None) -> Settings:
    return axes.settings(flow, first_trial=FIRST_TRIALS.map, threads=threads)


def _reference_settings(study: Study, flow: xr.Dataset, threads: int | None) -> Settings:
    number, forces = study.sensitivity.reference_realisations, study.forces
    return Settings(
        worlds=[world_plan(study, flow, threads=threads)],
        world=np.zeros(number, dtype=np.int64),
        drag_coefficient=np.full(number, forces.drag_coefficient),
        force_std=np.full(number, forces.force_std_N),
        trial=FIRST_TRIALS.reference + np.arange(number),
    )


KEYS: Final[dict[str, str]] = {
    "tank_diameter": "tank.diameter_m",
    "blocks": "assembly.blocks",
    "flow": "",
    "latching": "assembly.latching",
    "hidden_face_drag": "assembly.hidden_face_drag",
    "drag_coefficient": "forces.drag_coefficient",
    "force_std": "forces.force_std_N",
}
"""From the name of an axis to the parameter of the study that it varies."""
OF_EACH_RUN: Final = ("drag_coefficient", "force_std")
"""The axes along which runs can be simulated side by side."""


@dataclass(frozen=True, eq=False)
class Axes:
    """The axes of a map, and what the settings along them are.

    Attributes
    ----------
    study : Study
        With the values of the axes in its [sensitivity].
    values : dict of str to tuple
        The values of each axis, in the order of the dimensions.
    flows : dict of str to xarray.Dataset
        The flow fields of the axis ``flow``.
    """

    study: Study
    values: dict[str, tuple[Any, ...]]
    flows: dict[str, xr.Dataset]

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each axis."""
        return tuple(len(values) for values in self.values.values())

    def coordinates(self) -> dict[str, tuple[str, npt.NDArray[Any]]]:
        """Return the coordinates of the axes for a dataset."""
        return {name: (name, _array(values)) for name, values in self.values.items()}

    def settings(self, flow: xr.Dataset, *, first_trial: int, threads: int | None) -> Settings:
        """Return every combination of the values, the last axis fastest.

        Raises
        ------
        InputError
            When the blocks of a setting have no room, or its flow does not cover its tank.
        """
        apart = [name for name in self.values if name not in OF_EACH_RUN]
        along = [name for name in self.values if name in OF_EACH_RUN]
        worlds = [
            self._world(dict(zip(apart, chosen, strict=True)), flow, threads)
            for chosen in product(*(self.values[name] for name in apart))
        ]
        size = math.prod(self.shape)
        forces = self.study.forces
        table = dict.fromkeys(OF_EACH_RUN, np.empty(0)) | {
            "drag_coefficient": np.full(size, forces.drag_coefficient),
            "force_std": np.full(size, forces.force_std_N),
        }
        inner = np.meshgrid(*(np.array(self.values[name]) for name in along), indexing="ij")
        for name, values in zip(along, inner, strict=True):
            table[name] = np.tile(values.ravel(), len(worlds))
        return Settings(
            worlds=worlds,
            world=np.repeat(np.arange(len(worlds)), size // len(worlds)),
            drag_coefficient=table["drag_coefficient"],
            force_std=table["force_std"],
            trial=first_trial + np.arange(size),
        )

    def _world(self, chosen: dict[str, Any], flow: xr.Dataset, threads: int | None) -> Plan:
        from driftwalk.model import apply_overrides

        changes = {KEYS[name]: value for name, value in chosen.items() if KEYS[name]}
        field = self.flows[chosen["flow"]] if "flow" in chosen else flow
        try:
            return world_plan(apply_overrides(self.study, changes), field, threads=threads)
        except InputError as error:
            if not chosen:
                raise
            where = ", ".join(f"{name} = {value}" for name, value in chosen.items())
            raise InputError(f"at {where}: {error}") from error


def make_axes(study: Study, axes: Mapping[str, Any] | None) -> Axes:
    """Return the axes that a study names, or the given ones in their place.

    Parameters
    ----------
    study : Study
        Its [sensitivity] holds when `axes` is left out.
    axes : mapping, optional
        Values by the name of an axis; for ``flow`` the datasets by name, or files.

    Raises
    ------
    InputError
        When there is no such axis, or a value is out of range.
    """
    from driftwalk.model import apply_overrides
    from driftwalk.model.sensitivity import AXES

    flows: dict[str, xr.Dataset] = {}
    if axes is not None:
        unknown = [name for name in axes if name not in KEYS]
        if unknown or not axes:
            raise InputError(
                f"axes: there is no {', '.join(map(repr, unknown)) or '(none was named)'}; "
                f"choose from {', '.join(KEYS)}"
            )
        if isinstance(axes.get("flow"), Mapping):
            flows = dict(axes["flow"])
        given = {
            f"sensitivity.{key}": _plain(axes[name]) if name in axes else None
            for name, key in AXES.items()
        }
        try:
            study = apply_overrides(study, given)
        except ConfigurationError as error:
            raise InputError(f"axes: {error}") from error
    values = study.sensitivity.axes
    missing = [name for name in values.get("flow", ()) if name not in flows]
    return Axes(study, values, flows | {name: _load(name, study) for name in missing})


def _load(path: str, study: Study) -> xr.Dataset:
    from driftwalk.flow import load_flow

    return load_flow(path, arena=study.tank.to_arena(), own_flags="keep")


def _plain(values: Any) -> list[Any]:
    if isinstance(values, Mapping):
        return [str(name) for name in values]
    if isinstance(values, str):
        raise InputError(f"axes: expected a list of values, got '{values}'")
    return list(np.asarray(values).tolist())


def _array(values: tuple[Any, ...]) -> npt.NDArray[Any]:
    return np.array(values, dtype=object if isinstance(values[0], str) else None)
