"""Records of observed and simulated runs, and the categories into which their data put them."""

from __future__ import annotations

import csv
import json
import re
from collections import Counter
from collections.abc import Hashable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from driftwalk.assembly.chains.histories import (
    Histories,
    blocks_of,
    histories,
    merged_history,
)
from driftwalk.assembly.outcomes.distribution import is_complete
from driftwalk.assembly.outcomes.outcome_classes import class_name, class_shapes, merge_chirality
from driftwalk.assembly.runs.dataset import DECIMALS
from driftwalk.core.arrays import Floats, Integers
from driftwalk.core.errors import FormatError, InputError
from driftwalk.core.units import parse_quantity
from driftwalk.schema.shapes import all_single, is_one_assembly

if TYPE_CHECKING:
    import numpy.typing as npt
    import xarray as xr

CLASSES: Final = "final classes"
TIMES: Final = "completion times"
BOTH: Final = "classes and times"
JOINS: Final = "joins over time"
EARLY: Final = "a tenth of the time"
KINDS: Final = (CLASSES, TIMES, BOTH, JOINS, EARLY)
"""Kinds of data: what is seen of every run."""
EARLY_PART: Final = 0.1
"""The part of the time that `EARLY` names; chosen by hand."""
REST: Final = "rest"


class CategoryPolicy(NamedTuple):
    """How runs are put into categories; no category depends on what was observed."""

    completion_bins: int = 4
    """Bins of completion times between quantiles of the simulated ones; chosen by hand."""
    join_times: int = 3
    """Quantiles of the simulated joins at which joins are counted, next to the end; chosen by
    hand."""
    least_share: float = 0.01
    """Categories with a smaller share of all simulated runs are one; chosen by hand."""
    most: int = 24
    """Categories at most, the most frequent ones; chosen by hand."""


CATEGORY_POLICY = CategoryPolicy()


class Record(NamedTuple):
    """Everything known of one run."""

    final: str
    """Outcome class at the end."""
    completion: float = np.nan
    """When all blocks had become one assembly [s], inf where never; NaN where it is not known."""
    joins: tuple[float, ...] | None = None
    """Times of the changes of class [s]."""
    early: str | None = None
    """Outcome class after a tenth of the time."""

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kinds of data that the record holds."""
        timed = not np.isnan(self.completion)
        known = (True, timed, timed, self.joins is not None, self.early is not None)
        return tuple(kind for kind, there in zip(KINDS, known, strict=True) if there)


def record_of(classes: Sequence[str], entry: Sequence[float], end: float) -> Record:
    """Return the record of a run from the classes it passed, their entry times [s], and its end.

    Examples
    --------
    >>> record_of(["1+1", "2"], [0.0, 4.0], 60.0)
    Record(final='2', completion=4.0, joins=(4.0,), early='2')
    """
    passed = [(name, at) for name, at in zip(classes, entry, strict=True) if at <= end]
    done = [at for name, at in passed if is_one_assembly(name)]
    joins = tuple(at for _, at in passed[1:])
    early = [name for name, at in passed if at <= EARLY_PART * end][-1]
    return Record(passed[-1][0], min(done, default=np.inf), joins, early)


def records_of_histories(found: Histories, end: float) -> list[Record]:
    """Return the records of histories of outcome classes, read until a time [s]."""
    rows = np.flatnonzero(np.append(found.first, True))
    entry = np.round(found.entry, DECIMALS)  # sums of sojourns differ in the last digits
    return [
        record_of(
            [found.classes[k] for k in found.state[begin:stop]], entry[begin:stop].tolist(), end
        )
        for begin, stop in pairwise(rows.tolist())
    ]


def records_of_events(
    time: Floats,
    became: npt.NDArray[np.integer],
    classes: Sequence[str],
    *,
    blocks: int,
    end: float,
) -> list[Record]:
    """Return the records of simulated runs.

    Parameters
    ----------
    time : ndarray, shape (runs, events)
        Times of the events [s], in order; NaN where there is none.
    became : ndarray of int, shape (runs, events)
        Class of the world afterwards, index into `classes`.
    """  # fmt: skip
    start = all_single(blocks)
    found = []
    for at, names in zip(time, became, strict=True):
        real = np.isfinite(at)
        passed = [start, *(classes[k] for k in names[real])]
        changed, entry = merged_history(passed, np.append(0.0, at[real]))
        found.append(record_of(changed, entry.tolist(), end))
    return found


def records_to_text(records: Sequence[Record]) -> str:
    """Return records as text."""
    return json.dumps(records)


def records_from_text(text: str) -> list[Record]:
    """Return the records that `records_to_text` wrote."""
    return [
        Record(final, completion, None if joins is None else tuple(joins), early)
        for final, completion, joins, early in json.loads(text)
    ]


class Categories(NamedTuple):
    """The categories of one kind of data."""

    kind: str
    cuts: tuple[float, ...]
    """Times [s] between which completions are binned, or at which joins are counted."""
    labels: tuple[Hashable, ...]
    """The last one is the rest."""

    @classmethod
    def of(cls, kind: str, nodes: Sequence[Sequence[Record]]) -> Categories:
        """Return the categories that simulated runs fall into."""
        policy, every = CATEGORY_POLICY, [one for node in nodes for one in node]
        cuts: tuple[float, ...] = ()
        if kind in (TIMES, BOTH):
            done = [one.completion for one in every if np.isfinite(one.completion)]
            inner = np.linspace(0.0, 1.0, policy.completion_bins + 1)[1:-1]
            cuts = tuple(np.quantile(done, inner).tolist()) if done else ()
        elif kind == JOINS:
            times = [at for one in every for at in one.joins or ()]
            inner = np.linspace(0.0, 1.0, policy.join_times + 2)[1:-1]
            cuts = tuple(np.quantile(times, inner).tolist()) if times else ()
        count = Counter(label_of(kind, cuts, one) for one in every)
        kept = [
            label
            for label, number in sorted(count.items(), key=lambda pair: (-pair[1], str(pair[0])))
            if number >= policy.least_share * len(every)
        ]
        return cls(kind, cuts, (*kept[: policy.most - 1], REST))

    def counts(self, records: Sequence[Record]) -> Integers:
        """Return how many records are in each category."""
        number = Counter(label_of(self.kind, self.cuts, one) for one in records)
        row = [number[label] for label in self.labels[:-1]]
        return np.array([*row, len(records) - sum(row)], dtype=np.int64)

    def table(self, sets: Sequence[Sequence[Record]]) -> Integers:
        """Return the counts of several sets of records, shape (set, category)."""
        return np.stack([self.counts(one) for one in sets])


def label_of(kind: str, cuts: tuple[float, ...], one: Record) -> Hashable:
    """Return the category of a run by one kind of data."""
    if kind == CLASSES:
        return one.final
    if kind == EARLY:
        return one.early
    if kind == JOINS:
        return tuple(sum(at <= cut for at in one.joins or ()) for cut in (*cuts, np.inf))
    if not np.isfinite(one.completion):
        return one.final if kind == BOTH else "never"
    bin = int(np.searchsorted(cuts, one.completion))
    return (one.final, bin) if kind == BOTH else bin


def records_of_counts(counts: Mapping[str, int]) -> list[Record]:
    """Return the records of final classes that were counted."""
    return [Record(name) for name, number in counts.items() for _ in range(int(number))]


Outcomes = Mapping[str, int] | Sequence[Record] | Sequence["xr.Dataset"]
COLUMNS = ("class", "count", "completion_time_s", "join_times_s", "run")


class Observed(NamedTuple):
    """Outcomes of real runs."""

    records: list[Record]
    blocks: int
    after: float | None
    """When the classes were read, as far as the data say [s]."""


def observed_of(given: Outcomes, *, after: float | None, breaks: bool = False) -> Observed:
    """Return observed outcomes in their common form.

    Parameters
    ----------
    given : mapping of str to int, sequence of Record, or sequence of xarray.Dataset
        Counts by class, records of runs, or `assembly` and `classification` datasets.
    after : float or None
        When the final classes are read [s].
    breaks : bool
        Whether bonds break, so that a complete run may change.

    Raises
    ------
    InputError
        When there is no run, a name is no class, a count is no number from 0 on, blocks differ, or
        a run that may still change ends before the classes are read.
    """
    if isinstance(given, Mapping):
        for name, number in given.items():
            if not (float(number).is_integer() and number >= 0):
                raise InputError(f"class {name}: expected a whole number from 0 on, got {number}")
        records = records_of_counts(given)
    elif all(isinstance(one, Record) for one in given):
        records = [one for one in given if isinstance(one, Record)]
    else:
        datasets = [one for one in given if not isinstance(one, Record)]
        found = histories(datasets)
        breaks |= any("event_kind" in one for one in datasets)
        length, until = _known_until(found, breaks=breaks)
        earliest = int(until.argmin())
        # All runs are read at one time, the last at which the class of each of them is known.
        if after is None:
            after = float(min(until[earliest], length.max()))
        if after > until[earliest]:
            raise InputError(
                f"run {earliest + 1} of {found.runs} ends after {until[earliest]:g} s, before the "
                f"final classes are read ({after:g} s), and could still change: give a time up to "
                "its end (after), or leave it out"
            )
        records = records_of_histories(found, after)
    if not records:
        raise InputError("no run was counted: there is nothing to infer from")
    names = list(dict.fromkeys(one.final for one in records))
    known = {name: _named(name) for name in names}
    sizes = {blocks_of(name): name for name in names}
    if len(sizes) > 1:
        (first, one), (second, other), *_ = sizes.items()
        raise InputError(
            f"the classes {one} and {other} have {first} and {second} blocks: give the outcomes of "
            "one number of blocks"
        )
    if after is not None:
        late = [one.completion for one in records if after < one.completion < np.inf]
        if late:
            raise InputError(
                f"a run was complete after {min(late):g} s, later than the final classes "
                f"({after:g} s)"
            )
    renamed = [one._replace(final=known[one.final]) for one in records]
    return Observed(renamed, next(iter(sizes)), after)


def _named(name: str) -> str:
    """Return a class with its shapes in order."""
    try:
        return class_name(class_shapes(name))
    except InputError as error:
        raise InputError(f"class {name}: {error}") from error


def _known_until(found: Histories, *, breaks: bool) -> tuple[Floats, Floats]:
    """Return the lengths of the runs [s], and until when their classes are known, inf: for good."""
    length: Floats = np.round(np.bincount(found.run, found.duration), DECIMALS)
    parts = np.array([len(class_shapes(name)) for name in found.classes])
    whole = is_complete(found.classes)
    known, ends = length.copy(), found.target < 0
    parted = parts[found.target[~ends]] > parts[found.state[~ends]]
    if not (breaks or parted.any()):
        known[whole[found.state[ends]]] = np.inf
    return length, known


def merged(records: Sequence[Record]) -> list[Record]:
    """Return records in which mirror images are one class."""
    return [
        one._replace(
            final=merge_chirality(one.final),
            early=None if one.early is None else merge_chirality(one.early),
        )
        for one in records
    ]


def read_outcomes(path: str | Path) -> list[Record]:
    """Return the outcomes of a table: counts of classes, or a row per run.

    Parameters
    ----------
    path : path-like
        CSV with the columns ``class`` and ``count``; or a row per run with ``class`` and, where
        they are known, ``completion_time_s`` (empty where the run did not become one assembly) and
        ``join_times_s`` (times, with spaces between them).

    Returns
    -------
    list of Record
        One for each run, as `infer_outcomes` takes them.

    Raises
    ------
    FormatError
        With file and line: an unknown column, no number, a negative count, an unknown class.

    Examples
    --------
    ``read_outcomes("counts.csv")``
    """
    try:
        with Path(path).open(newline="", encoding="utf-8-sig") as file:
            rows = [row for row in csv.reader(file) if any(map(str.strip, row))]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise FormatError(f"cannot be read as a table of outcomes: {error}", path=path) from error
    if not rows:
        raise FormatError("is empty; expected the columns class, count", path=path)
    heads = [head.strip().lower() for head in rows[0]]
    unknown = [head for head in heads if head not in COLUMNS]
    if unknown or "class" not in heads:
        raise FormatError(
            f"has the columns {', '.join(heads)[:80]}; expected class, count, or a row per run "
            "with class, completion_time_s, join_times_s",
            path=path,
        )
    if timed := [head for head in heads if "count" in heads and head.endswith("_s")]:
        raise FormatError(
            f"has the columns count and {timed[0]}: times belong to one run, so give a row per run "
            "without count",
            path=path,
        )
    found: list[Record] = []
    for line, row in enumerate(rows[1:], start=2):
        if len(row) > len(heads):
            raise FormatError(
                f"has {len(row)} values in {len(heads)} columns", path=path, line=line
            )
        cell = dict(zip(heads, (*map(str.strip, row), *[""] * len(heads)), strict=False))
        try:
            found += _row(cell)
        except (InputError, ValueError) as error:
            raise FormatError(str(error), path=path, line=line) from error
    if not found:
        raise FormatError("counts no run", path=path)
    return found


def _row(cell: Mapping[str, str]) -> list[Record]:
    """Return the records of a row: as many as it counts, or one with its times."""
    name = _named(cell["class"])
    if "count" in cell:
        if not re.fullmatch("[0-9]+", cell["count"]):
            raise InputError(f"count: expected a whole number from 0 on, got '{cell['count']}'")
        return records_of_counts({name: int(cell["count"])})
    completion, joins = np.nan, None
    if "completion_time_s" in cell:
        completion = _time(cell["completion_time_s"]) if cell["completion_time_s"] else np.inf
        if np.isfinite(completion) != is_one_assembly(name):
            raise InputError(
                f"completion_time_s: a run of class {name} has "
                + ("no completion time" if np.isfinite(completion) else "one; it is missing")
            )
    if "join_times_s" in cell:
        joins = tuple(_time(word) for word in cell["join_times_s"].split())
        if list(joins) != sorted(joins):
            raise InputError("join_times_s: expected times in order")
    return [Record(name, completion, joins)]


def _time(word: str) -> float:
    found = parse_quantity(word, "s")
    if not 0.0 <= found < np.inf:
        raise InputError(f"expected a time from 0 on, got '{word}'")
    return found
