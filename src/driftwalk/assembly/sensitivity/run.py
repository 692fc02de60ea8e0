"""Sensitivity map: outcomes over settings, compared with a reference; the datasets of both."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.outcomes.distribution import is_complete, outcome_distribution
from driftwalk.assembly.outcomes.l1 import l1_in_floors, l1_noise_floor, pairwise_l1
from driftwalk.assembly.outcomes.outcome_classes import listed_classes, sort_classes
from driftwalk.assembly.runs.dataset import assembly_attrs
from driftwalk.assembly.sensitivity.settings import (
    FIRST_TRIALS,
    Axes,
    Outcomes,
    OutcomeStudy,
    Settings,
    make_axes,
    make_settings,
    place_first,
    world_plan,
)
from driftwalk.assembly.sensitivity.times import map_courses, reference_courses
from driftwalk.core.errors import InputError
from driftwalk.core.progress import Progress
from driftwalk.core.text_files import parse_json
from driftwalk.schema.check import build_dataset, described
from driftwalk.schema.kinds.flow import FLOW_SERIES
from driftwalk.sweep import threads_of_unit

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.assembly.runs.plan import Plan
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
    each = threads_of_unit(threads, executor)
    settings = chosen.settings(flow, first_trial=FIRST_TRIALS.map, threads=each)
    if reference is None:
        reference = sensitivity_reference(chosen.study, flow, threads=threads, executor=executor)
    made = MapStudy(settings, chosen, reference)
    return made.sweep(store=store, progress=progress, executor=executor)


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
    made = _reference_study(study, flow, threads_of_unit(threads, executor))
    return made.sweep(store=store, progress=progress, executor=executor)


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
    settings = chosen.settings(flow, first_trial=FIRST_TRIALS.map, threads=threads)
    place_first(settings)
    _reference_study(chosen.study, flow, threads).check()
    return settings.size


def _reference_study(study: Study, flow: xr.Dataset, threads: int | None) -> ReferenceStudy:
    worlds = [world_plan(study, flow, threads=threads)]
    world = np.zeros(study.sensitivity.reference_realisations, dtype=np.int64)
    return ReferenceStudy(make_settings(worlds, world, first_trial=FIRST_TRIALS.reference))


NOT_COMMON: Final[dict[str, tuple[str, ...]]] = {
    "tank_diameter": ("arena",),
    "flow": tuple(one.name for one in FLOW_SERIES),
    "latching": (
        "latching",
        "connector_distance_m",
        "connector_axis_rad",
        "connector_rotation_rad",
    ),
}
"""Attributes that say nothing where an axis varies; of the other axes, the axis itself."""


@dataclass(frozen=True, eq=False)
class ReferenceStudy(OutcomeStudy):
    """Realisations of one setting."""

    def dataset(self, outcomes: Outcomes) -> xr.Dataset:
        """Return the `outcome_distribution` of all realisations, with that of each."""
        plan = self.settings.worlds[0]
        assembly = plan.study.assembly
        names = listed_classes(outcomes.occurred(), assembly.blocks, chirality=plan.chirality)
        count = outcomes.table(names)
        runs = count.sum(axis=1)
        if not runs.all():
            raise InputError(
                f"realisation {int(np.argmin(runs))} of the reference has no run with an outcome: "
                "all broke down; use a smaller time step"
            )
        total = dict(zip(names, count.sum(axis=0).tolist(), strict=True))
        courses, times = reference_courses(plan, outcomes.courses)
        found = outcome_distribution(total, confidence=assembly.confidence)
        found = found.assign_coords(times).assign(courses)
        share = count / runs[:, None]
        forces = plan.study.forces
        found = found.assign(
            realisation_count=(("realisation", "class"), count),
            realisation_proportion=(("realisation", "class"), share),
            standard_deviation=("class", share.std(axis=0, ddof=1)),
        ).assign_attrs(
            {
                **{k: v for k, v in assembly_attrs(plan).items() if k not in ("trial", "runs")},
                "left_out": int(outcomes.left_out.sum()),
                "realisations": len(count),
                "drag_coefficient": forces.drag_coefficient,
                "force_std_N": forces.force_std_N,
                "mean_pairwise_l1": pairwise_l1(list(share)).mean,
                "expected_pairwise_l1": l1_noise_floor(found, assembly.runs, assembly.runs).mean,
            }
        )
        return described(found)


@dataclass(frozen=True, eq=False)
class MapStudy(OutcomeStudy):
    """The settings of a map, compared with a reference."""

    axes: Axes
    reference: xr.Dataset

    def dataset(self, outcomes: Outcomes) -> xr.Dataset:
        """Return the `sensitivity`."""
        axes, settings, reference = self.axes, self.settings, self.reference
        names = _map_classes(settings, outcomes, reference)
        count = outcomes.table(names)
        runs = count.sum(axis=1)
        with np.errstate(invalid="ignore"):
            share = count / runs[:, None]
            # Whole numbers first: shares that are rounded one by one do not add up to 1.
            complete = count[:, is_complete(names)].sum(axis=1) / runs
        known = reference.reindex({"class": list(names)}, fill_value=0.0)["proportion"].values
        blocks_of_world = np.array([world.study.assembly.blocks for world in settings.worlds])
        reference_runs = int(reference.attrs["runs"])
        # Outcomes of other numbers of blocks have no class in common: there is nothing to compare.
        same = blocks_of_world[settings.world] == int(reference.attrs["blocks"])
        distance = np.abs(share - known).sum(axis=1)
        in_floors = l1_in_floors(share, known, runs=runs, reference_runs=reference_runs)
        floor = l1_noise_floor(reference, axes.study.sensitivity.runs, reference_runs)
        dims = tuple(axes.values)
        sizes = dict(zip(dims, axes.shape, strict=True))
        courses, times = map_courses(settings.worlds[0], outcomes.courses, reference, dims=sizes)
        of_setting: dict[str, npt.NDArray[Any]] = {
            "runs": runs,
            "left_out": outcomes.left_out,
            "complete": complete,
            "first_contact_median": outcomes.first_contact_median,
            "completion_median": outcomes.completion_median,
            "l1_distance": np.where(same, distance, np.nan),
            "l1_in_floors": np.where(same, in_floors, np.nan),
            "trial": settings.trial,
        }
        of_class = {"count": count, "proportion": share}
        return build_dataset(
            "sensitivity",
            {
                **{
                    name: ((*dims, "class"), values.reshape(*axes.shape, len(names)))
                    for name, values in of_class.items()
                },
                **{name: (dims, values.reshape(axes.shape)) for name, values in of_setting.items()},
                "reference": ("class", known),
                **courses,
            },
            {
                **axes.coordinates(),
                "class": ("class", np.array(names, dtype=object)),
                **times,
            },
            {
                **_common_attrs(axes, settings.worlds[0]),
                **_reference_attrs(reference),
                "noise_floor_mean": floor.mean,
                "noise_floor_95": floor.quantile,
            },
        )


def _map_classes(settings: Settings, outcomes: Outcomes, reference: xr.Dataset) -> tuple[str, ...]:
    first = settings.worlds[0].study.assembly
    other = reference.attrs.get("chirality", first.chirality)
    if other != first.chirality:
        raise InputError(
            f"the reference counts mirror images differently (chirality '{other}', the study has "
            f"'{first.chirality}'): make both in the same way"
        )
    listed = [
        name
        for blocks in {world.study.assembly.blocks for world in settings.worlds}
        # Beyond 8 blocks those that occurred are all there is to list.
        for name in listed_classes((), blocks, chirality=settings.worlds[0].chirality)
    ]
    return sort_classes([*listed, *outcomes.occurred(), *map(str, reference["class"].values)])


def _common_attrs(axes: Axes, plan: Plan) -> dict[str, Any]:
    """Return what all settings have in common."""
    gone = {"trial", *(key for name in axes.values for key in NOT_COMMON.get(name, (name,)))}
    attrs = {key: value for key, value in assembly_attrs(plan).items() if key not in gone}
    # The study as it was given, and not that of the first setting.
    return {**attrs, "study": axes.study.to_toml()}


def _reference_attrs(reference: xr.Dataset) -> dict[str, Any]:
    """Return where the reference lies, as far as it says."""
    facts = {"reference_runs": int(reference.attrs["runs"])}
    keys = (
        "blocks", "latching", "faces", "hidden_face_drag", "drag_coefficient", "force_std_N",
        "realisations", "mean_pairwise_l1", "expected_pairwise_l1",
    )  # fmt: skip
    facts |= {f"reference_{key}": reference.attrs[key] for key in keys if key in reference.attrs}
    arena = parse_json(reference.attrs.get("arena", "{}"))
    if "diameter_m" in arena:
        facts["reference_tank_diameter_m"] = arena["diameter_m"]
    return facts
