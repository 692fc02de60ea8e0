"""A search for the largest yield under way: the settings so far, the best ones first."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from driftwalk.assembly import proportion_interval
from driftwalk.core.units import in_percent
from driftwalk.page.parts import empty_section, table_section
from driftwalk.schema.answers.yields import LISTED, point_words
from driftwalk.viewer.watch.run_page import Running, Section


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
