"""Self-assembly under way: shares of the classes as runs end, settings of a search for a yield."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.assembly import outcome_distribution, proportion_interval, world_class
from driftwalk.assembly.outcomes.class_names import disc_class
from driftwalk.core.units import in_percent
from driftwalk.page.parts import empty_section, section, table_section
from driftwalk.page.sections.outcomes import class_items
from driftwalk.plot.parts.outcome_classes import class_names
from driftwalk.schema.answers.yields import LISTED, point_words
from driftwalk.simulation.backend import BROKEN
from driftwalk.viewer.watch.run_page import Running, Section
from driftwalk.viewer.watch.shards import FinishedUnit

if TYPE_CHECKING:
    from driftwalk.model import Study

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
        from driftwalk.model import Study

        super().__init__(folder, specification)
        self._study: Study = Study(**specification["study"])
        both = specification.get("calibration_sha256") is not None
        self._names = dict(NAMES) if both else {"fixed": "all runs"}
        self._count: dict[str, Counter[str]] = {name: Counter() for name in self._names}
        self._runs = dict.fromkeys(self._names, 0)
        self._class_of: dict[bytes, str] = {}

    def look(self) -> list[Section]:
        """Read the new shards; return the proportions if there are any."""
        units = list(self._reader.new_units(self._names))
        for name, unit in units:
            self._take(name, unit)
        return self.sections() if units else []

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
        if not block.has_lattice:
            for pose, assembly in zip(
                unit.arrays["pose"][sound], unit.arrays["assembly"][sound], strict=True
            ):
                self._count[name][disc_class(pose, assembly, **block.contact_size)] += 1
            return
        for cell, assembly in zip(
            unit.arrays["cell"][sound], unit.arrays["assembly"][sound], strict=True
        ):
            # Few ways of lying on the lattice come again and again.
            key = cell.tobytes() + assembly.tobytes()
            if key not in self._class_of:
                self._class_of[key] = world_class(cell, assembly, chirality=chirality)
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

    def look(self) -> list[Section]:
        """Read the new shards; return the settings if there are any."""
        units = list(self._reader.new_units())
        for name, unit in units:
            sweep = self._reader.sweeps[name].sweep
            words, each = [point_words(one) for one in sweep["settings"]], int(sweep["runs"])
            fresh = name.startswith("fresh")
            for row, hit in enumerate(unit.arrays["reached"][:, -1], start=unit.start):
                self._runs[fresh][words[row // each]] += 1
                self._reached[fresh][words[row // each]] += int(hit)
        return self.sections() if units else []

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
        return table_section("fresh" if fresh else "chosen", title, columns, rows)
