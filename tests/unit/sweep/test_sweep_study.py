"""A study of a design: units, texts, and mistakes of the user."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from driftwalk.core.errors import InputError
from driftwalk.core.files.shards import Arrays
from driftwalk.sweep import Design, ShardStore, SweepError, SweepStudy, WorkUnit, grid


@dataclass(frozen=True)
class Words(SweepStudy["dict[str, list[list[str]]]"]):
    """Words of a length by row and column; some settings fail."""

    fault: Exception | None = None
    names_units: bool = False

    def check(self) -> None:
        if isinstance(self.fault, FileNotFoundError):
            raise self.fault

    def design(self) -> Design:
        return grid(row=np.arange(3), column=np.arange(2))

    @property
    def unit_size(self) -> int:
        return 4

    def __call__(self, unit: WorkUnit) -> Arrays:
        if self.fault and 5 in range(unit.start, unit.stop):
            raise self.fault
        rows, columns = unit.settings["row"], unit.settings["column"]
        words = ["ä" * (10 * row + column) for row, column in zip(rows, columns, strict=True)]
        return {"word": np.array(words, dtype=object)}

    def result(self, found: Arrays) -> dict[str, list[list[str]]]:
        return {name: values.tolist() for name, values in found.items()}


def test_results_have_the_dimensions_of_the_design(tmp_path: Path) -> None:
    calls: list[tuple[int, int]] = []
    store = ShardStore(tmp_path, fingerprint={})
    words = [["ä" * (10 * row + column) for column in range(2)] for row in range(3)]
    for _ in range(2):  # the second time from the files
        found = Words().sweep(store=store, progress=lambda done, total: calls.append((done, total)))
        assert found == {"word": words}
    assert calls == [(0, 6), (4, 6), (6, 6), (6, 6)]
    assert Words().sweep() == found


BUG, MISTAKE = ValueError("a bug"), InputError("no room for the blocks")


@pytest.mark.parametrize(
    ("fault", "names_units", "raised"),
    [(MISTAKE, False, InputError), (MISTAKE, True, SweepError), (BUG, False, SweepError)],
)
def test_a_mistake_of_the_user_is_raised_as_it_is_where_no_unit_is_named(
    fault: Exception, names_units: bool, raised: type[Exception]
) -> None:
    with pytest.raises(raised) as caught:
        Words(fault, names_units).sweep()
    assert fault in (caught.value, caught.value.__cause__)


def test_texts_of_fixed_length_are_continued(tmp_path: Path) -> None:
    store = ShardStore(tmp_path, fingerprint={})
    first = Words().design().units(4)[0]
    store.write(first, {"word": Words()(first)["word"].astype("U400")})
    assert Words().sweep(store=store) == Words().sweep()


def test_what_forbids_the_study_is_found_before_anything_is_computed(tmp_path: Path) -> None:
    store = ShardStore(tmp_path / "units", fingerprint={})
    with pytest.raises(FileNotFoundError):
        Words(FileNotFoundError("no flow")).sweep(store=store)
    assert len(store.missing(Words().design().units(4))) == 2
