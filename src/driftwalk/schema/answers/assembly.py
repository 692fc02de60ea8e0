"""The answer of runs of many blocks: how often each class forms, or how large assemblies get.

Where bonds break: shares of time, lifetimes and rates of the classes.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.units import in_percent
from driftwalk.schema.answers.parts import Answer, Part, Table, by_name, each, interval_cells
from driftwalk.schema.kinds.assembly import ATTRACTION
from driftwalk.schema.kinds.flow import flow_series_words
from driftwalk.schema.shapes import short_class

if TYPE_CHECKING:
    import xarray as xr


MOST_ROWS: Final = 16
"""Classes in the table: all 12 of four blocks, and the frequent ones of more; chosen by hand."""
SHOWN_TIMES: Final = 4
"""Times in the table of sizes, equally far apart, the last one the end of the runs."""
_OVER_TIME: Final = {
    "mean_size": ("mean_size_blocks", "mean size"),
    "largest_share": ("largest_share", "in largest"),
    "free_share": ("free_share", "free"),
    "compactness": ("compactness", "compact"),
}
"""Variables over time, their keys in JSON and their headings. Older files have no compactness."""
_SETTINGS: Final = (
    *("confidence", "blocks", "duration_s", "seed", "latching", "hidden_face_drag", "chirality"),
    *("drag_coefficient", "force_std_N", "force_interval_s"),
    *("first_contact_median_s", "completion_median_s"),
)


def assembly_answer(
    found: xr.Dataset,
    *,
    times: xr.Dataset,
    settings: Mapping[str, Any],
    drawn: xr.Dataset | None = None,
    sizes: xr.Dataset | None = None,
    sizes_drawn: xr.Dataset | None = None,
    steady: xr.Dataset | None = None,
    apart: Mapping[str, float] | None = None,
    attraction: xr.Dataset | None = None,
) -> Answer:
    """Return the answer of an assembly run.

    Parameters
    ----------
    found : xarray.Dataset
        An `outcome_distribution`.
    times : xarray.Dataset
        The `class_times` of the same runs.
    settings : mapping
        ``drag_coefficient``, ``force_std_N`` and ``approach_resistance_N_s`` of these runs.
    drawn : xarray.Dataset, optional
        The `outcome_distribution` of runs with drawn parameters.
    sizes, sizes_drawn : xarray.Dataset, optional
        The `assembly_sizes` of both, where nearly every run is a class of its own.
    steady : xarray.Dataset, optional
        The `steady_state` of the runs, where bonds break.
    apart : mapping, optional
        ``l1_distance`` of the two distributions, ``l1_noise_floor`` and ``l1_noise_floor_95``.
    attraction : xarray.Dataset, optional
        The `attraction` of two blocks.
    """
    facts = {**times.attrs, **found.attrs, **settings}
    parts: list[Part] = [
        f"{facts['blocks']} blocks, {facts['runs']} runs of {facts['duration_s']:g} s; "
        f"C_d = {facts['drag_coefficient']:.4g}, σ_F = {1e3 * facts['force_std_N']:.4g} mN redrawn "
        f"every {1e3 * facts['force_interval_s']:g} ms"
    ]
    if "glued" in facts:
        parts.append(f"blocks start glued: {facts['glued']}")
    if "faces" in facts:
        parts.append(f"faces: {facts['faces']}")
    if attraction is not None:
        parts.append(attraction_words(attraction))
    if (resistance := facts.get("approach_resistance_N_s", 0.0)) > 0.0:
        parts.append(
            f"the water between two blocks resists: {resistance:.4g} N s times speed / gap"
        )
    if sizes is None:
        parts.append(_classes(found, drawn))
    else:
        parts += _sizes(found, sizes, "parameters found" if drawn is not None else "")
        # Many blocks hardly ever end in the same class: sizes are compared there, not classes.
        if drawn is not None and sizes_drawn is not None:
            parts += _sizes(drawn, sizes_drawn, "parameters drawn")
    for event in ("first_contact", "completion"):
        median = facts[f"{event}_median_s"]
        reached = f"median {median:.4g} s" if median == median else "not reached in half the runs"
        parts.append(f"{event.replace('_', ' ')}: {reached}")
    if drawn is not None:
        parts.append(f"drawn for each run: {', '.join(_drawn(drawn))}")
        if apart and sizes is None:
            parts.append(
                f"l1 distance of the two: {apart['l1_distance']:.4f}; by chance "
                f"{apart['l1_noise_floor']:.4f} (95 %: {apart['l1_noise_floor_95']:.4f})"
            )
    if steady is not None:
        parts += steady_parts(steady)
    answer = {
        **_json(found, sizes),
        **({} if steady is None else {"steady_state": steady_json(steady)}),
        **{key: facts[key] for key in _SETTINGS},
        **{key: facts[key] for key in ("glued", "faces") if key in facts},
        **({"approach_resistance_N_s": resistance} if resistance > 0.0 else {}),
        "drawn": None
        if drawn is None
        else {"parameters": _drawn(drawn), **_json(drawn, sizes_drawn)},
        **(apart or {}),
    }
    if attraction is not None:
        said = [one.name for one in ATTRACTION.attributes if one.name != "study"]
        answer["attraction"] = {key: attraction.attrs[key] for key in said}
    return Answer(
        parts,
        answer,
        [*flow_series_words(facts, holds="the intervals hold"), *_left_out(found, drawn)],
    )


def _left_out(found: xr.Dataset, drawn: xr.Dataset | None) -> list[str]:
    """Return a warning where runs have no outcome."""
    return [
        f"{one.attrs['left_out']} runs{what} broke down and are left out; use a smaller time step"
        for what, one in (("", found), (" with drawn parameters", drawn))
        if one is not None and one.attrs["left_out"]
    ]


def attraction_words(attraction: xr.Dataset) -> str:
    """Return what acts between two blocks, with the numbers that a balance measures."""
    facts = attraction.attrs
    cap = ""
    if facts["capped_below_m"] > 0.0:
        cap = (
            f"; simulated with at most {1e3 * facts['most_simulated_N']:.3g} mN, below a gap of "
            f"{1e3 * facts['capped_below_m']:.2g} mm (time step)"
        )
    return (
        f"between blocks: {facts['between']}: {1e3 * facts['force_at_contact_N']:.4g} mN at "
        f"contact, {1e3 * facts['force_at_10mm_N']:.3g} mN at 10 mm, binding energy "
        f"{1e6 * facts['binding_energy_J']:.4g} µJ{cap}"
    )


def _drawn(distribution: xr.Dataset) -> list[str]:
    """Return what was drawn for each run."""
    return str(distribution.attrs["drawn"]).split()


def _json(found: xr.Dataset, sizes: xr.Dataset | None) -> dict[str, Any]:
    facts = found.attrs
    return {
        "proportions": by_name(found, "class", "proportion"),
        "intervals": by_name(found, "class", partial(_ends, "interval")),
        "complete": facts["complete"],
        "complete_interval": [facts["complete_low"], facts["complete_high"]],
        "runs": facts["runs"],
        "left_out": facts["left_out"],
        **({} if sizes is None else {"sizes": _sizes_json(sizes)}),
    }


def _classes(found: xr.Dataset, drawn: xr.Dataset | None) -> Table:
    """Return how often each class came, the frequent ones only where there are many."""
    both = [found] if drawn is None else [found, drawn]
    interval = f"{in_percent(found.attrs['confidence'])} simultaneous intervals"
    heads = ["class", "share", interval, "parameters drawn", interval][: 1 + 2 * len(both)]
    shares = [by_name(one, "class", "proportion") for one in both]
    names = list(dict.fromkeys(name for one in shares for name in one))
    # Those too that never came, where there is room: two runs list the same classes.
    few = len(names) <= MOST_ROWS
    seen = [name for name in names if few or any(one.get(name, 0.0) > 0.0 for one in shares)]
    most = {name: max(one.get(name, 0.0) for one in shares) for name in seen}
    frequent = sorted(seen, key=lambda name: -most[name])[:MOST_ROWS]
    rest = [name for name in seen if name not in frequent]
    rows = [
        [name, *(cell for one in both for cell in _class_cells(one, name))]
        for name in seen
        if name in frequent
    ]
    if rest:
        sums = [sum(one.get(name, 0.0) for name in rest) for one in shares]
        rows.append([f"{len(rest)} others", *(cell for one in sums for cell in (f"{one:.4f}", ""))])
    complete = [interval_cells(one.attrs, "complete", ".4f") for one in both]
    rows.append(["complete", *(cell for cells in complete for cell in cells)])
    return Table(rows, heads)


def _class_cells(distribution: xr.Dataset, name: str) -> tuple[str, str]:
    if name not in distribution["class"].values:
        return "", ""
    row = distribution.sel({"class": name})
    return interval_cells(row.rename(proportion="interval"), "interval", ".4f")


def _sizes_json(sizes: xr.Dataset) -> dict[str, Any]:
    """Return the sizes for programs; all are means over runs."""
    facts = sizes.attrs
    over_time: dict[str, Any] = {"time_s": sizes["time"].values}
    for name, (key, _) in _OVER_TIME.items():
        if name in sizes:
            over_time |= _with_interval(sizes, name, key)
    return {
        "at_end": [
            {
                "from_blocks": int(row["size"]),
                "to_blocks": int(row["size_to"]),
                **_with_interval(row, "number", "assemblies_per_run"),
                **_with_interval(row, "block_share", "block_share"),
            }
            for row in each(sizes, "size")
        ],
        "over_time": over_time,
        "compactness": facts["compactness"],
        "compactness_interval": [facts[f"compactness_{end}"] for end in ("low", "high")],
        "method": facts["method"],
    }


def _sizes(distribution: xr.Dataset, sizes: xr.Dataset, what: str) -> list[Part]:
    """Return the sizes at the end of the runs, and how they grew."""
    facts = sizes.attrs
    interval = f"{in_percent(facts['confidence'])} interval"
    rows = []
    for row in each(sizes, "size"):
        if row["number"] > 0:
            first, last = int(row["size"]), int(row["size_to"])
            name = str(first) if first == last else f"{first} to {last}"
            rows.append([name, *interval_cells(row, "number"), *interval_cells(row, "block_share")])
    heads = ["blocks in it", "assemblies per run", interval, "share of blocks", interval]
    times = sizes.sizes["time"] - 1
    known = {name: words for name, (_, words) in _OVER_TIME.items() if name in sizes}
    chosen = [sizes.isel(time=round(times * (n + 1) / SHOWN_TIMES)) for n in range(SHOWN_TIMES)]
    course = [
        [f"{float(one['time']):.4g}", *(c for name in known for c in interval_cells(one, name))]
        for one in chosen
    ]
    over_time = [head for words in known.values() for head in (words, interval)]
    parts: list[Part] = [Table(rows, heads, what), Table(course, ["time (s)", *over_time])]
    if facts["compactness_runs"]:
        compactness, ends = interval_cells(facts, "compactness")
        within = f" ({interval} {ends})" if ends else ""
        parts.append(
            f"compactness: {compactness}{within}, least perimeter over perimeter, 1 at most"
        )
    share, ends = interval_cells(distribution.attrs, "complete", ".4f")
    return [*parts, f"complete: {share} of the runs ({interval} {ends})"]


def _with_interval(found: xr.Dataset, name: str, key: str) -> dict[str, Any]:
    mean, low, high = (found[f"{name}{end}"].values.tolist() for end in ("", "_low", "_high"))
    interval = [low, high] if found[name].ndim == 0 else np.stack([low, high], axis=1).tolist()
    return {key: mean, f"{key}_interval": interval}


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
    order = np.argsort(-np.nan_to_num(steady["time_share"].values), kind="stable")
    occurred = order[steady["class_time"].values[order] > 0][:MOST_ROWS]
    rows = []
    for one in each(steady.isel({"class": occurred}), "class"):
        rows.append([short_class(str(one["class"].values))])
        for name in COLUMNS:
            value, ends = interval_cells(one, name)
            rows[-1] += [value or "not reached", ends]
    return [Table(rows, columns, title), steady_words(steady)]


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
