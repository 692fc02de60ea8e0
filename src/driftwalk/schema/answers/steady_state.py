"""The answer of runs whose bonds break: shares of time, lifetimes and rates of the classes."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.units import in_percent
from driftwalk.schema.answers.parts import Part, Table, by_name
from driftwalk.schema.shapes import short_class

if TYPE_CHECKING:
    import xarray as xr

MOST_ROWS: Final = 16
"""Classes in the table, those with the most time."""
COLUMNS: Final = {
    "time_share": ("share of time", ""),
    "lifetime_median": ("median lifetime (s)", "_s"),
    "joining_rate": ("joinings (1/s)", "_per_s"),
    "parting_rate": ("partings (1/s)", "_per_s"),
}
"""Variables with intervals: head of the column, and what a key of JSON has more."""


def steady_parts(steady: xr.Dataset) -> list[Part]:
    """Return the table of the classes and the verdict of the test.

    Parameters
    ----------
    steady : xarray.Dataset
        A `steady_state`.
    """
    facts = steady.attrs
    interval = f"{in_percent(facts['confidence'])} interval"
    heads = [head for head, _ in COLUMNS.values()]
    title = f"bonds break at {_law(facts)}; shares of time from {facts['from_s']:.4g} s on"
    columns = ["class", *(column for head in heads for column in (head, interval))]
    return [Table(list(rate_rows(steady, tuple(COLUMNS))), columns, title), steady_words(steady)]


def rate_rows(found: xr.Dataset, names: tuple[str, ...]) -> list[list[str]]:
    """Return a row per class that occurred: value and interval of some variables.

    Parameters
    ----------
    found : xarray.Dataset
        With variables on ``class``, each with ``_low`` and ``_high``.
    names : tuple of str
        The variables; the first says in which order the classes come.
    """
    order = np.argsort(-np.nan_to_num(found[names[0]].values), kind="stable")
    rows: list[list[str]] = []
    for place in order.tolist():
        one = found.isel({"class": place})
        if not float(one["class_time"]) > 0 or len(rows) == MOST_ROWS:
            continue
        cells = [short_class(str(one["class"].values))]
        for name in names:
            value, low, high = (float(one[f"{name}{end}"]) for end in ("", "_low", "_high"))
            cells += [f"{value:.3g}" if value == value else "not reached", interval_text(low, high)]
        rows.append(cells)
    return rows


def interval_text(low: float, high: float) -> str:
    """Return an interval in words; one end may be missing."""
    if low != low:
        return ""
    return f"{low:.3g} to {high:.3g}" if np.isfinite(high) else f"{low:.3g} or more"


def steady_words(steady: xr.Dataset) -> str:
    """Return whether the shares of time are steady, with the false-alarm rate of the test."""
    facts = steady.attrs
    alarms = f"{in_percent(facts['false_alarms'])} false alarms"
    if facts["steady"] == "yes":
        return (
            "steady state: the third and the fourth quarter of the runs do not differ "
            f"(p = {facts['steady_p']:.2g}; {alarms})"
        )
    return (
        "no steady state yet: the third and the fourth quarter of the runs differ "
        f"(p = {facts['steady_p']:.2g}; {alarms}); the shares need longer runs"
    )


def steady_json(steady: xr.Dataset) -> dict[str, Any]:
    """Return the same for programs, with units in the keys."""
    facts = steady.attrs
    found: dict[str, Any] = {
        "steady": facts["steady"] == "yes",
        **{key: facts[key] for key in ("steady_p", "false_alarms", "from_s", "confidence")},
        **{key: facts[key] for key in BOND_FACTS},
    }
    for name, (_, unit) in COLUMNS.items():
        found[f"{name}{unit}"] = by_name(steady, "class", name)
        found[f"{name}_interval{unit}"] = by_name(steady, "class", partial(_ends, name))
    return found


def _ends(name: str, one: xr.Dataset) -> list[float]:
    return [float(one[f"{name}_{end}"]) for end in ("low", "high")]


BOND_FACTS: Final = ("bond_rate_per_s", "bond_force_N", "bond_strength_N", "relatch_clearance")
"""Attributes that say how bonds break, as of the runs."""


def _law(facts: dict[str, Any]) -> str:
    said = f"{facts['bond_rate_per_s']:g} /s"
    if facts["bond_force_N"]:
        said += f", e times as fast for {1e3 * facts['bond_force_N']:g} mN of tension"
    if facts["bond_strength_N"]:
        said += f", at once beyond {1e3 * facts['bond_strength_N']:g} mN"
    return f"{said}; parted blocks latch again from {facts['relatch_clearance']:g} sides on"
