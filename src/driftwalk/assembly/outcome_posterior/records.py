"""Records of runs, and the categories into which each kind of data puts them."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Hashable, Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from driftwalk.assembly.runs.dataset import DECIMALS
from driftwalk.core.arrays import Floats, Integers
from driftwalk.schema.shapes import all_single, is_one_assembly

if TYPE_CHECKING:
    import numpy.typing as npt

    from driftwalk.assembly.chains.histories import Histories

CLASSES: Final = "final classes"
TIMES: Final = "completion times"
BOTH: Final = "classes and times"
JOINS: Final = "joins over time"
EARLY: Final = "a tenth of the time"
KINDS: Final = (CLASSES, TIMES, BOTH, JOINS, EARLY)
"""Kinds of data: what is seen of every run."""
EARLY_PART: Final = 0.1
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
        entry = [0.0, *at[real].tolist()]
        changed = [0, *(k for k in range(1, len(passed)) if passed[k] != passed[k - 1])]
        found.append(record_of([passed[k] for k in changed], [entry[k] for k in changed], end))
    return found


def records_to_text(records: Sequence[Record]) -> str:
    """Return records as text."""
    return json.dumps([[*one[:1], one.completion, one.joins, one.early] for one in records])


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
