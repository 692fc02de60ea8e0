"""A page on self-assembly: what the blocks built, how surely, when, and sample runs.

Where bonds break: shares of time, rates and lifetimes of the classes.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.units import percent
from driftwalk.page import parts
from driftwalk.page.parts import Section, count, quantity, require, required, value_of
from driftwalk.page.sections.outcomes import (
    class_times_section,
    classes_section,
    size_numbers,
    size_sections,
)
from driftwalk.page.sections.replay import replay_section
from driftwalk.plot.parts.outcome_classes import class_names
from driftwalk.schema.answers.assembly import attraction_words, steady_parts, steady_words
from driftwalk.schema.answers.parts import Table
from driftwalk.schema.kinds.sensitivity import axis_number
from driftwalk.schema.shapes import short_class

if TYPE_CHECKING:
    import xarray as xr


FOUND, DRAWN = "parameters found", "parameters drawn"
SURVIVAL: Final = {
    "first_contact": "no two blocks have met yet",
    "completion": "not all blocks are in one assembly yet",
}


def assembly_sections(
    *,
    distribution: xr.Dataset | None = None,
    distribution_drawn: xr.Dataset | None = None,
    class_times: xr.Dataset | None = None,
    assembly: xr.Dataset | None = None,
    assembly_drawn: xr.Dataset | None = None,
    path: xr.Dataset | None = None,
    sizes: xr.Dataset | None = None,
    sizes_drawn: xr.Dataset | None = None,
    steady_state: xr.Dataset | None = None,
    attraction: xr.Dataset | None = None,
) -> list[Section]:
    """Return the sections of a page on self-assembly.

    Parameters
    ----------
    distribution, distribution_drawn : xarray.Dataset, optional
        The `outcome_distribution` of runs with the parameters found, and with drawn ones.
    class_times : xarray.Dataset, optional
        A `class_times`.
    assembly, assembly_drawn : xarray.Dataset, optional
        The `assembly` of every run.
    path : xarray.Dataset, optional
        An `assembly_path` of sample runs.
    sizes, sizes_drawn : xarray.Dataset, optional
        The `assembly_sizes` of both. They take the place of the classes.
    steady_state : xarray.Dataset, optional
        The `steady_state` of the runs, where bonds break.
    attraction : xarray.Dataset, optional
        The `attraction` of two blocks.

    Returns
    -------
    list of dict
        Sections; what cannot be shown is an empty one that says why.

    Examples
    --------
    >>> [part["kind"] for part in assembly_sections()]
    ['empty']
    """
    outcomes = _by_set(distribution, distribution_drawn)
    made = parts.sections_of(
        distribution,
        "There are no outcomes yet.",
        lambda found: assembly_summary(found, distribution_drawn, class_times, assembly, sizes),
        lambda _: _left_out(outcomes),
    )
    # Each part is attempted alone: one that a damaged file spoils must not take the page with it.
    # Of many blocks hardly two runs end in one class: their sizes stand instead.
    if outcomes and sizes is None:
        made += parts.attempt("classes", "Structures built", lambda: classes_section(outcomes))
    if sizes is not None:
        made += size_sections(_by_set(sizes, sizes_drawn))
    shares = class_times if sizes is None else None
    return made + parts.attempts(
        ("class-times", "Outcome classes over time", class_times_section, shares),
        ("survival", "Time to contact and completion", survival_section, class_times),
        ("steady-state", "Steady state", steady_sections, steady_state),
        ("attraction", "Force between two blocks", attraction_section, attraction),
        ("replay", "Sample runs", partial(replay_section, assembly=assembly), path),
        ("drawn", "The drawn parameters", drawn_section, assembly_drawn),
    )


def _by_set(found: xr.Dataset | None, drawn: xr.Dataset | None) -> dict[str, xr.Dataset]:
    """Return the results of the sets of runs that there are, by the name of the set."""
    if found is None:
        return {}
    return {"runs": found} if drawn is None else {FOUND: found, DRAWN: drawn}


def assembly_summary(
    distribution: xr.Dataset,
    drawn: xr.Dataset | None = None,
    times: xr.Dataset | None = None,
    assembly: xr.Dataset | None = None,
    sizes: xr.Dataset | None = None,
) -> Section:
    """Return the outcomes of self-assembly in words and numbers."""
    require(distribution, "class", "proportion")
    facts = distribution.attrs
    done = (
        f"{count(int(facts.get('blocks', 0)), 'block')} were simulated in "
        f"{count(int(facts.get('runs', 0)), 'run')}"
    )
    duration = value_of(distribution, "duration_s")
    done += f" of {quantity(duration, 's')}" if duration is not None else ""
    done += _parameters(distribution, assembly)
    rules = [
        f"{words} {facts[name]}"
        for name, words in (
            ("latching", "latching by"),
            ("faces", "faces:"),
            ("glued", "glued at the start as"),
            ("hidden_face_drag", "hidden-face drag"),
        )
        if name in facts
    ]
    done += f" ({', '.join(rules)})" if rules else ""
    paragraphs = [f"{done}.", _most_common(distribution, named=sizes is None)]
    shown = [parts.figure_with_ends(distribution, "complete", "complete: one assembly")]
    if drawn is not None:
        paragraphs.append(_comparison_with_drawn(distribution, drawn, classes=sizes is None))
        shown.append(parts.figure_with_ends(drawn, "complete", "complete, parameters drawn"))
    if sizes is not None:
        shown += size_numbers(sizes)
    paragraphs.append("These predictions use latching rules that no recording has settled.")
    if times is not None:
        shown += [_median(times, name) for name in SURVIVAL]
    return parts.summary_section(paragraphs, shown)


def survival_section(times: xr.Dataset) -> Section:
    """Return the shares of runs without contact yet, and without completion yet."""
    require(times, "time", *SURVIVAL)
    time = times["time"].values
    drawn = [parts.course(words, time, times, name) for name, words in SURVIVAL.items()]
    return parts.chart(
        x=parts.label("time", "s"), y=parts.label("share of runs"), series=drawn,
        marks=[parts.mark("half of the runs", y=0.5)],
    )  # fmt: skip


def attraction_section(attraction: xr.Dataset) -> Section:
    """Return the force between two blocks against their gap."""
    require(attraction, "gap", "force", "simulated_force")
    gap = attraction["gap"].values
    drawn = [
        parts.series(words, gap[found > 0.0], found[found > 0.0])
        for words, found in (
            ("as stated", attraction["force"].values),
            ("in the simulation", attraction["simulated_force"].values),
        )
    ]
    return parts.chart(
        f"{attraction_words(attraction)}.",
        x=parts.label("gap between the faces", "m"), y=parts.label("attraction", "N", log=True),
        series=drawn,
    )  # fmt: skip


def drawn_section(assembly: xr.Dataset) -> Section:
    """Return the parameters that were drawn for each run."""
    require(assembly, "force_std", "drag_coefficient")
    force, drag = (assembly[name].values for name in ("force_std", "drag_coefficient"))
    what = str(assembly.attrs.get("drawn", "")).split()
    every = value_of(assembly, "force_interval_s")
    redrawn = "" if every is None else f", redrawn every {quantity(every, 's')}"
    note = f"{count(int(force.size), 'run')}, each with its own parameters."
    if "flow" in what:
        note += " Each also has its own flow, drawn within the errors of the field."
    return parts.chart(
        note,
        x=parts.label(f"stochastic force σ_F{redrawn}", "N"), y=parts.label("drag coefficient C_d"),
        series=[parts.series("runs", force, drag, style="points")],
    )  # fmt: skip


def _parameters(distribution: xr.Dataset, assembly: xr.Dataset | None) -> str:
    if assembly is None or "drag_coefficient" not in assembly or "force_std" not in assembly:
        return ""
    drag, force = (np.unique(assembly[n].values) for n in ("drag_coefficient", "force_std"))
    if drag.size != 1 or force.size != 1:
        return ""
    every = value_of(distribution, "force_interval_s")
    redrawn = "" if every is None else f" redrawn every {quantity(every, 's')}"
    values = f" with C_d = {quantity(float(drag[0]))} and σ_F = {quantity(float(force[0]), 'N')}"
    return values + redrawn


def _comparison_with_drawn(distribution: xr.Dataset, drawn: xr.Dataset, *, classes: bool) -> str:
    """Return how far the runs with drawn parameters are from the others."""
    require(drawn, "class", "proportion")
    words = [axis_number(name).plain for name in str(drawn.attrs.get("drawn", "")).split()]
    what = " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
    said = (
        f"In a second set each run has its own {what or 'parameters'}, drawn from the "
        "uncertainty of the run that found them."
    )
    if not classes:
        return said
    apart, chance = l1_and_chance(distribution, drawn)
    return (
        f"{said} The l1 distance of the two sets is "
        f"{apart:.3g} (0: identical, 2: nothing in common); by chance alone it would "
        f"be {chance:.2g} on average."
    )


def l1_and_chance(first: xr.Dataset, second: xr.Dataset) -> tuple[float, float]:
    """Return the l1 distance of two distributions, and what chance alone makes on average.

    The second number is that of normal differences of the shares, with the variance that their
    common value gives.
    """
    runs = [float(required(one, "runs")) for one in (first, second)]
    names = list(dict.fromkeys([*class_names(first), *class_names(second)]))
    one, other = (
        found["proportion"].reindex({"class": names}, fill_value=0.0).values
        for found in (first, second)
    )
    common = (runs[0] * one + runs[1] * other) / sum(runs)
    spread = np.sqrt(common * (1.0 - common) * sum(1.0 / number for number in runs))
    return float(np.abs(one - other).sum()), float(np.sqrt(2.0 / np.pi) * spread.sum())


def _most_common(distribution: xr.Dataset, *, named: bool) -> str:
    names = [short_class(str(name)) for name in distribution["class"].values]
    share = distribution["proportion"].values
    first = np.argsort(-share, kind="stable")[:3]
    listed = ", ".join(f"{names[i]} in {percent(float(share[i]))}" for i in first if share[i] > 0)
    complete = value_of(distribution, "complete")
    if complete is None or not listed:
        return f"Most common: {listed or 'nothing'}."
    ends = [value_of(distribution, f"complete_{end}") for end in ("low", "high")]
    band = ""
    if ends[0] is not None and ends[1] is not None:
        band = f" ({percent(ends[0])} to {percent(ends[1])})"
    done = f"{percent(complete)}{band} of the runs end as one assembly."
    return f"{done} Most common: {listed}." if named else done


def _median(times: xr.Dataset, name: str) -> dict[str, Any]:
    known = value_of(times, f"{name}_median_s") is not None
    note = None if known else "not reached in half the runs"
    return parts.figure_with_ends(
        times, f"{name}_median", f"{axis_number(name).plain}, median", "s", suffix="_s", note=note
    )


def _left_out(found: dict[str, xr.Dataset]) -> list[str]:
    return [
        f"{count(int(one.attrs['left_out']), 'run')} ({name}) broke down and are left out; use a "
        "smaller time step"
        for name, one in found.items()
        if one.attrs.get("left_out")
    ]


MOST_CURVES = 8
"""Classes whose lifetimes are drawn, those with the most time; chosen by hand."""


def steady_sections(steady: xr.Dataset) -> list[Section]:
    """Return the table of the classes, and the survival of those with the most time.

    Parameters
    ----------
    steady : xarray.Dataset
        A `steady_state`.

    Raises
    ------
    InputError
        When it has no shares or no survival.
    """
    require(steady, "class", "time_share", "age", "survival", "class_time")
    table = next(part for part in steady_parts(steady) if isinstance(part, Table))
    note = f"{table.title[0].upper()}{table.title[1:]}. {steady_words(steady).capitalize()}."
    time = np.where(
        np.isfinite(steady["survival"].values).any(axis=0), steady["class_time"].values, 0.0
    )
    drawn = []
    for place in np.argsort(-time, kind="stable")[:MOST_CURVES].tolist():
        if time[place] > 0:
            one = steady.isel({"class": place})
            name = short_class(str(one["class"].values))
            drawn.append(parts.course(name, steady["age"].values, one, "survival"))
    return [
        parts.section_of_table(table, note),
        parts.chart(
            "Kaplan-Meier, censored at the end of a run; a stay ends with a joining or a parting.",
            x=parts.label("time since the class formed", "s"),
            y=parts.label("share that lasts longer"), series=drawn,
            marks=[parts.mark("half of the stays", y=0.5)],
            id="lifetimes", title="Lifetimes of the classes",
        ),
    ]  # fmt: skip
