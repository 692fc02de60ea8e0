"""The datasets of a sensitivity analysis: the map, and the reference that it is compared with."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.outcomes.class_names import listed_classes, sort_classes
from driftwalk.assembly.outcomes.distribution import is_complete, outcome_distribution
from driftwalk.assembly.outcomes.l1 import l1_in_floors, l1_noise_floor, pairwise_l1
from driftwalk.assembly.runs.dataset import assembly_attrs
from driftwalk.assembly.sensitivity.settings import Axes, Outcomes, Settings
from driftwalk.assembly.sensitivity.times import map_courses, reference_courses
from driftwalk.core.errors import InputError
from driftwalk.core.text.json_text import parse_json
from driftwalk.schema.check import build_dataset, described
from driftwalk.schema.kinds.flow import FLOW_SERIES

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.assembly.runs.plan import Plan


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


def reference_dataset(plan: Plan, outcomes: Outcomes) -> xr.Dataset:
    """Return the `outcome_distribution` of all realisations, with that of each."""
    assembly = plan.study.assembly
    names = listed_classes(outcomes.occurred(), assembly.blocks, chirality=plan.chirality)
    count = outcomes.table(names)
    runs = count.sum(axis=1)
    if not runs.all():
        raise InputError(
            f"realisation {int(np.argmin(runs))} of the reference has no run with an outcome: all "
            "broke down; use a smaller time step"
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


def map_dataset(
    axes: Axes, settings: Settings, outcomes: Outcomes, reference: xr.Dataset
) -> xr.Dataset:
    """Return the `sensitivity` dataset of a map."""
    names = _map_classes(settings, outcomes, reference)
    count = outcomes.table(names)
    runs = count.sum(axis=1)
    with np.errstate(invalid="ignore"):
        share = count / runs[:, None]
        # Whole numbers first: shares that are rounded one by one do not add up to 1.
        complete = count[:, is_complete(list(names))].sum(axis=1) / runs
    known = reference.reindex({"class": list(names)}, fill_value=0.0)["proportion"].values
    blocks = np.array([world.study.assembly.blocks for world in settings.worlds])[settings.world]
    reference_runs = int(reference.attrs["runs"])
    # Outcomes of other numbers of blocks have no class in common: there is nothing to compare.
    same = blocks == int(reference.attrs["blocks"])
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
    """Return the classes of all settings and of the reference, in order."""
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
