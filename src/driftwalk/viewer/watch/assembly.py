"""Self-assembly under way: shares of the classes, settings of a yield, the map of distances."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.assembly import (
    l1_distance,
    outcome_distribution,
    proportion_interval,
    sort_classes,
    world_class,
)
from driftwalk.assembly.lattice.polyomino import shape_size
from driftwalk.assembly.outcomes.outcome_classes import disc_class
from driftwalk.assembly.sensitivity.times import (
    Courses,
    added,
    course_table,
    courses_from_text,
    kept_times,
)
from driftwalk.core.units import in_percent
from driftwalk.model import Study
from driftwalk.page import encode_array
from driftwalk.page.parts import Section, axis, empty_section, section, table_section
from driftwalk.page.sections.outcomes import cells_of, class_items
from driftwalk.page.sections.sensitivity_maps import over_time_part
from driftwalk.plot.parts.outcome_classes import are_discs, class_names, classes_to_show
from driftwalk.schema.answers.yields import LISTED, point_words
from driftwalk.schema.kinds.sensitivity import axis_number, ranked_axes
from driftwalk.schema.shapes import counted_assemblies
from driftwalk.simulation.backend import BROKEN
from driftwalk.viewer.watch.run_page import NO_CELL, Running
from driftwalk.viewer.watch.shards import FinishedUnit

NAMES: Final = {"fixed": "parameters found", "drawn": "parameters drawn"}
"""The sweeps of such a run, and what their bars are called."""


class RunningAssembly(Running):
    """A study of self-assembly under way.

    Parameters
    ----------
    folder : Path
        The run directory.
    specification : mapping
        Everything that determines its numbers.
    """

    def __init__(self, folder: Path, specification: Mapping[str, Any]) -> None:
        super().__init__(folder, specification)
        self._study = Study(**specification["study"])
        both = specification.get("calibration_sha256") is not None
        self._sweeps = self._names = dict(NAMES) if both else {"fixed": "all runs"}
        self._count: dict[str, Counter[str]] = {name: Counter() for name in self._names}
        self._runs = dict.fromkeys(self._names, 0)
        self._class_of: dict[bytes, str] = {}

    def sections(self) -> list[Section]:
        """Return the shares of the classes up to now."""
        confidence = self._study.assembly.confidence
        return [
            section(
                "classes",
                "classes",
                "Structures built so far",
                "For the runs that have ended; the bars are simultaneous intervals with "
                f"{100.0 * confidence:g} % confidence.",
                confidence=confidence,
                runs=self._runs["fixed"],
                series=[
                    {"name": self._names[name], "items": _items(count, confidence)}
                    for name, count in self._count.items()
                    if count
                ],
            )
        ]

    def state(self) -> tuple[float | None, str]:
        """Return the share of the runs that have ended."""
        total = self._study.assembly.runs
        done = sum(self._runs.values())
        share = done / max(total * len(self._names), 1)
        return 0.95 * share, f"{done} of {total * len(self._names)} runs"

    def _take(self, name: str, unit: FinishedUnit) -> None:
        sound = (unit.arrays["status"].astype(np.int64) & BROKEN) == 0
        self._runs[name] += unit.stop - unit.start
        chirality, block = self._study.assembly.chirality, self._study.block
        places = unit.arrays["cell" if block.has_lattice else "pose"][sound]
        for place, assembly in zip(places, unit.arrays["assembly"][sound], strict=True):
            if not block.has_lattice:
                self._count[name][disc_class(place, assembly, **block.contact_size)] += 1
                continue
            # Few ways of lying on the lattice come again and again.
            key = place.tobytes() + assembly.tobytes()
            if key not in self._class_of:
                self._class_of[key] = world_class(place, assembly, chirality=chirality)
            self._count[name][self._class_of[key]] += 1


def _items(count: Counter[str], confidence: float) -> list[dict[str, Any]]:
    """Return the classes that have come, the most frequent first."""
    found = outcome_distribution(dict(count), confidence=confidence)
    names = sorted(class_names(found), key=lambda name: -count[name])
    return class_items(found, names, names)


class RunningYield(Running):
    """A search for the largest yield under way.

    Parameters
    ----------
    folder : Path
        The run directory.
    specification : mapping
        Everything that determines its numbers.
    """

    def __init__(self, folder: Path, specification: Mapping[str, Any]) -> None:
        super().__init__(folder, specification)
        self._confidence = float(specification["study"]["assembly"]["confidence"])
        self._runs: dict[bool, Counter[str]] = {False: Counter(), True: Counter()}
        self._reached: dict[bool, Counter[str]] = {False: Counter(), True: Counter()}

    def _take(self, name: str, unit: FinishedUnit) -> None:
        sweep = self._reader.sweeps[name].sweep
        words, each = [point_words(one) for one in sweep["settings"]], int(sweep["runs"])
        fresh = name.startswith("fresh")
        for row, hit in enumerate(unit.arrays["reached"][:, -1], start=unit.start):
            self._runs[fresh][words[row // each]] += 1
            self._reached[fresh][words[row // each]] += int(hit)

    def sections(self) -> list[Section]:
        """Return the settings up to now; fresh runs have a table of their own."""
        tables = [self._table(fresh) for fresh in (True, False) if self._runs[fresh]]
        return tables or [empty_section("chosen", self.title, "No run has ended yet.")]

    def state(self) -> tuple[float | None, str]:
        """Return how many runs have ended; how many are needed is not known before."""
        chosen, fresh = (self._runs[key].total() for key in (False, True))
        return None, f"{chosen} runs that choose" + (f", {fresh} fresh runs" if fresh else "")

    def _table(self, fresh: bool) -> Section:
        runs, reached = self._runs[fresh], self._reached[fresh]
        rows = []
        for words in sorted(runs, key=lambda one: -reached[one] / runs[one])[:LISTED]:
            k, n = reached[words], runs[words]
            low, high = proportion_interval(k, n, confidence=self._confidence)
            ends = f"{float(low):.3f} to {float(high):.3f}"
            rows.append([words, f"{k / n:.3f}", ends, n])
        title = "Fresh runs" if fresh else "Settings so far"
        columns = ["setting", "yield", f"{in_percent(self._confidence)} interval", "runs"]
        return table_section(columns, rows, id="fresh" if fresh else "chosen", title=title)


class RunningSensitivity(Running):
    """A sensitivity analysis under way.

    Parameters
    ----------
    folder : Path
        The run directory.
    specification : mapping
        Everything that determines its numbers.
    """

    def __init__(self, folder: Path, specification: Mapping[str, Any]) -> None:
        super().__init__(folder, specification)
        self._study = Study(**specification["study"])
        self._axes = dict(self._study.sensitivity.axes)
        self._shape = tuple(len(values) for values in self._axes.values())
        self._sweeps = ("reference", "map")
        self._count: dict[str, dict[int, Counter[str]]] = {name: {} for name in self._sweeps}
        # As text: few of the settings are ever asked for.
        self._courses: dict[str, dict[int, bytes]] = {name: {} for name in self._sweeps}

    def _take(self, name: str, unit: FinishedUnit) -> None:
        counts = (Counter(json.loads(text)) for text in unit.arrays["count"])
        self._count[name].update(enumerate(counts, unit.start))
        self._courses[name].update(enumerate(unit.arrays["courses"], unit.start))

    def sections(self) -> list[Section]:
        """Return the map up to now: of the last two axes, the others at their first value."""
        names = list(self._axes)
        fixed = names[: max(len(names) - 2, 0)]
        at = ", ".join(f"{axis_number(name).plain} {self._axes[name][0]}" for name in fixed)
        across, *up = ranked_axes(names[-2:])
        return [
            section(
                "l1",
                "l1_map",
                "Distance of the outcomes to the reference",
                f"Settings appear as they are simulated{f'; here {at}' if at else ''}.",
                x=_axis(across, self._axes[across]),
                y=_axis(up[0], self._axes[up[0]]) if up else _axis("", (0,)),
                value=encode_array(self._distances()[self._settings]),
                reference=None,
                noise=None,
                label="l1 distance",
                **self._outcomes(),
            )
        ]

    def state(self) -> tuple[float | None, str]:
        """Return the share of the settings that are done; Sobol' indices come on top."""
        done = sum(len(counts) for counts in self._count.values())
        wanted = int(np.prod(self._shape)) + self._study.sensitivity.reference_realisations
        words = f"{done} of {wanted} settings"
        if "sobol" in self._reader.sweeps:
            return None, f"{words}; Sobol' indices under way"
        return 0.95 * done / wanted, words

    def cell(self, row: int, column: int) -> dict[str, Any]:
        """Return the classes of a setting over time, next to those of the reference so far."""
        rows, columns = self._settings.shape
        if not (0 <= row < rows and 0 <= column < columns):
            return dict(NO_CELL)
        text = self._courses["map"].get(int(self._settings[row, column]))
        known = added(map(courses_from_text, self._courses["reference"].values()))
        if text is None:
            return dict(NO_CELL)
        return NO_CELL | {"over_time": self._over_time(courses_from_text(text), known)}

    def _over_time(self, courses: Courses, known: Courses) -> dict[str, Any] | None:
        """Return the courses of one setting as a page has those of a map of one cell."""
        import xarray as xr

        names = sort_classes({*courses, *known})
        if not names:
            return None
        count = course_table(courses, names)[None, None]
        one = xr.Dataset(
            {
                "count_over_time": (("y", "x", "time", "class_over_time"), count),
                "runs": (("y", "x"), count[:, :, 0].sum(axis=-1)),
            },
            coords={"time": kept_times(self._study), "class_over_time": list(names)},
        )
        if known:
            table = course_table(known, names)
            share = table / table.sum(axis=1, keepdims=True)
            one["reference_over_time"] = (("time", "class_over_time"), share)
        return over_time_part(one, "x", "y")

    @property
    def _settings(self) -> npt.NDArray[np.int64]:
        """The numbers of the settings that the map shows, (y, x)."""
        rows, columns = ([1, 1, *self._shape])[-2:]
        shown = np.arange(rows * columns).reshape(rows, columns)
        last = list(self._axes)[-2:]
        return shown.T if len(last) > 1 and ranked_axes(last)[0] == last[0] else shown

    def _outcomes(self) -> dict[str, Any]:
        """Return the classes of the settings that the map shows."""
        settings = self._settings
        found = {k: count for k, count in self._count["map"].items() if k < settings.size}
        names = sort_classes(name for count in found.values() for name in count)
        share = np.full((settings.size, len(names)), np.nan)
        for setting, count in found.items():
            if count:
                share[setting] = [count[name] / count.total() for name in names]
        shown = classes_to_show(list(names), share)
        return {
            "classes": [names[index] for index in shown],
            "cells": [cells_of(names[index], discs=are_discs(*names)) for index in shown],
            "shares": encode_array(share[settings][..., shown]) if shown else None,
        }

    def _distances(self) -> npt.NDArray[np.float64]:
        """Return the l1 distance of every setting to the pooled reference, NaN where unknown."""
        distance = np.full(int(np.prod(self._shape)), np.nan)
        pooled: Counter[str] = sum(self._count["reference"].values(), Counter())
        blocks = _blocks(pooled)
        for setting, count in self._count["map"].items():
            # Outcomes of another number of blocks have nothing in common with the reference.
            if pooled and count and _blocks(count) == blocks:
                distance[setting] = l1_distance(_shares(count), _shares(pooled))
        return distance


def _shares(count: Mapping[str, int]) -> dict[str, float]:
    total = sum(count.values())
    return {name: number / total for name, number in count.items()}


def _blocks(count: Mapping[str, int]) -> int:
    """Return the number of blocks of the classes that were counted, 0 where these do not say it."""
    name = next(iter(count), None)
    return 0 if name is None or counted_assemblies(name) else sum(map(shape_size, name.split("+")))


def _axis(name: str, values: tuple[Any, ...]) -> dict[str, Any]:
    """Return an axis; words stand as their numbers, and in the label."""
    number = axis_number(name)
    if any(isinstance(value, str) for value in values):
        words = ", ".join(f"{number}: {value}" for number, value in enumerate(values))
        return axis(name, f"{number.words} ({words})", number.unit, range(len(values)))
    return axis(name, number.words, number.unit, values)
