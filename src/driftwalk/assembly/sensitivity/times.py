"""Outcome classes over time: runs of each setting in each class, on one time grid."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.outcomes.outcome_classes import sort_classes
from driftwalk.assembly.outcomes.survival import class_counts
from driftwalk.assembly.runs.dataset import DECIMALS, times_of
from driftwalk.assembly.runs.plan import Plan, whole_steps
from driftwalk.core.arrays import Floats, Integers
from driftwalk.schema.shapes import all_single

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

Courses = dict[str, Integers]
"""By class, the number of runs that are in it at each of the times; classes that occur."""

TIMES: Final = 101
"""Times of the grid, from the start of the runs to their end; chosen by hand."""
OTHER: Final = "other"
DIMS: Final = ("time", "class_over_time")


def kept_times(study: Study) -> Floats:
    """Return the times of the grid [s]: from 0 to the end of the runs, rounded as events are."""
    last = float(times_of(np.array(whole_steps(study)), time_step=study.time_step_s))
    return np.round(np.linspace(0.0, last, TIMES), DECIMALS)


def courses_of(
    event_step: npt.ArrayLike, event_class: npt.NDArray[Any], classes: Sequence[str], plan: Plan
) -> Courses:
    """Return how many of some runs are in each class over time.

    Parameters
    ----------
    event_step : array_like of int, shape (runs, events)
        Step at the end of which blocks joined, -1 for none.
    event_class : ndarray of int, shape (runs, events)
        Class of the world afterwards, an index into `classes`.
    classes : sequence of str
        Names of the classes, that of single blocks among them.
    plan : Plan
        The simulated plan.
    """
    count = class_counts(
        times_of(np.asarray(event_step), time_step=plan.study.time_step_s),
        event_class.astype(np.int64),
        start=list(classes).index(all_single(plan.study.assembly.blocks)),
        time=kept_times(plan.study),
        classes=len(classes),
    )
    occurred = np.flatnonzero(count.any(axis=0)).tolist()
    return {classes[place]: count[:, place] for place in occurred}


def added(courses: Iterable[Courses]) -> Courses:
    """Return the courses of all runs together."""
    total: Courses = {}
    for one in courses:
        for name, row in one.items():
            total[name] = total[name] + row if name in total else row
    return total


def courses_to_text(courses: Courses) -> str:
    """Return courses as text: for each class the times at which they change, and by how much."""
    changes = {name: np.diff(row, prepend=0) for name, row in courses.items()}
    return json.dumps(
        {
            name: [np.flatnonzero(row).tolist(), row[row != 0].tolist()]
            for name, row in changes.items()
        }
    )


def courses_from_text(text: str | bytes) -> Courses:
    """Return the courses that `courses_to_text` wrote."""
    courses = {}
    for name, (places, changes) in json.loads(text).items():
        row = np.zeros(TIMES, dtype=np.int64)
        row[places] = changes
        courses[name] = row.cumsum()
    return courses


def time_coordinates(plan: Plan, names: Sequence[str]) -> dict[str, Any]:
    """Return the coordinates of what is kept over time."""
    return {
        "time": ("time", kept_times(plan.study)),
        "class_over_time": ("class_over_time", np.array(names, dtype=object)),
    }


def reference_courses(plan: Plan, texts: Sequence[str]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the courses of all realisations together, as variables and coordinates."""
    courses = added(map(courses_from_text, texts))
    names = sort_classes(courses)
    count = np.stack([courses[name] for name in names], axis=1)
    return {"count_over_time": (DIMS, count.astype(np.int32))}, time_coordinates(plan, names)


def map_courses(
    plan: Plan, texts: Sequence[str], reference: xr.Dataset, *, dims: Mapping[str, int]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the courses of the settings of a map, as variables and coordinates.

    The classes are those that have the largest share somewhere at some time, at most 24; what is
    in the others is summed as "other".

    Parameters
    ----------
    plan : Plan
        Whose times all settings have.
    texts : sequence of str
        The courses of every setting.
    reference : xarray.Dataset
        The reference; its shares over time are left out where it has none, or other times.
    dims : mapping of str to int
        Name and size of the axes.
    """
    known = _known_courses(plan, reference)
    # There is a class even where no run of any setting has an outcome.
    largest = {all_single(plan.study.assembly.blocks): 0.0}
    for courses in (known, *map(courses_from_text, texts)):
        runs = sum(int(row[0]) for row in courses.values())
        for name, row in courses.items():
            largest[name] = max(largest.get(name, 0.0), float(row.max()) / runs)
    # Classes with the same share are taken in their order, so that the choice is always the same.
    ranked = sorted(sort_classes(largest), key=lambda name: -largest[name])
    # All classes of up to five blocks are kept over time.
    names = sort_classes(ranked[:24])
    listed = (*names, OTHER) if len(ranked) > len(names) else names
    count = np.stack([course_table(courses_from_text(text), listed) for text in texts])
    shape = (*dims.values(), TIMES, len(listed))
    variables: dict[str, Any] = {
        "count_over_time": ((*dims, *DIMS), count.astype(np.int32).reshape(shape))
    }
    if known:
        table = course_table(known, listed)
        variables["reference_over_time"] = (DIMS, table / table.sum(axis=1, keepdims=True))
    return variables, time_coordinates(plan, listed)


def course_table(courses: Courses, listed: Sequence[str]) -> Integers:
    """Return courses as numbers of runs, shape (time, class); "other" at the end is the rest."""
    none = np.zeros(TIMES, dtype=np.int64)
    table = np.stack([courses.get(name, none) for name in listed], axis=1)
    if listed[-1] == OTHER:
        table[:, -1] = sum((row for name, row in courses.items() if name not in listed), none)
    return table


def _known_courses(plan: Plan, reference: xr.Dataset) -> Courses:
    """Return the courses of a reference, none where it does not say or has other times."""
    if "count_over_time" not in reference or not np.array_equal(
        reference["time"].values, kept_times(plan.study)
    ):
        return {}
    names = [str(name) for name in reference["class_over_time"].values]
    rows = reference["count_over_time"].transpose("class_over_time", "time").values
    return dict(zip(names, rows.astype(np.int64), strict=True))
