"""Pages on control: what a policy reaches, what it does when, and its test in fresh worlds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from driftwalk.core.intervals import proportion_interval
from driftwalk.core.units import in_percent
from driftwalk.page import parts
from driftwalk.page.parts import Maker, Section, require, required
from driftwalk.page.sections.replay import replay_section
from driftwalk.schema.answers.control import (
    CONSTANT,
    GAIN,
    arm_table,
    gain_text,
    gain_word,
    mode_table,
    policy_warnings,
    usage_table,
)
from driftwalk.schema.shapes import short_class

if TYPE_CHECKING:
    import xarray as xr


def policy_sections(*, policy: xr.Dataset | None = None) -> list[Section]:
    """Return the sections of a page on a policy.

    Parameters
    ----------
    policy : xarray.Dataset, optional
        A `control_policy`; None while there is none yet.

    Examples
    --------
    >>> [part["kind"] for part in policy_sections()]
    ['empty']
    """
    pieces: list[tuple[str, str, Maker]] = [
        ("rounds", "Rounds of planning", rounds_section),
        ("policy", "Modes chosen", action_section),
        parts.table_part("modes", "Modes alone", mode_table),
    ]
    return parts.sections_of(
        policy, "There is no policy yet.", policy_summary, policy_warnings, pieces
    )


def policy_summary(policy: xr.Dataset) -> Section:
    """Return what the policy reaches."""
    facts = policy.attrs
    target = short_class(str(required(policy, "target")))
    paragraphs = [
        f"The policy looks at the outcome class every {facts['every_s']:g} s and chooses one of "
        f"{policy.sizes['mode']} modes of agitation, by the class, the time since it was entered "
        f"and the time left, so that {target} is there at {facts['by_s']:g} s.",
        f"Safe mode, where nothing is seen: {facts['safe_mode']}.",
    ]
    shown = parts.figure_with_ends(policy, "reached", f"{target} in fresh worlds")
    return parts.summary_section(paragraphs, [shown])


def rounds_section(policy: xr.Dataset) -> Section:
    """Return what value iteration expects of the first rounds, and what each round reached."""
    require(policy, "promised", "round_reached")
    expected, reached = policy["promised"].values, policy["round_reached"].values
    rows = [
        [at, f"{got:.3f}", f"{said:.3f}" if np.isfinite(said) else ""]
        for at, (said, got) in enumerate(zip(expected, reached, strict=True), start=1)
    ]
    target = short_class(str(required(policy, "target")))
    columns = ["round", f"share of worlds in {target}", "value iteration (first two rounds)"]
    note = "Value iteration expects too much; only what was reached counts."
    return parts.table_section(columns, rows, note)


def action_section(policy: xr.Dataset) -> Section:
    """Return the modes that are chosen with all the time left, by class and time in it."""
    require(policy, "action", "phase", "age")
    names = [str(name) for name in policy["mode"].values]
    rows = [
        [short_class(str(name)), *(names[mode] for mode in policy["action"].values[-1, at])]
        for at, name in enumerate(policy["class"].values)
        if "+" in str(name)
    ]
    columns = ["class", *(f"after {age:g} s" for age in policy["age"].values)]
    note = f"With {policy['phase'].values[-1]:g} s left or more."
    return parts.table_section(columns, rows, note)


def trial_sections(
    *, control_test: xr.Dataset | None = None, path: xr.Dataset | None = None
) -> list[Section]:
    """Return the sections of a page on the test of a policy.

    Parameters
    ----------
    control_test : xarray.Dataset, optional
        A `control_test`; None while there is none yet.
    path : xarray.Dataset, optional
        The `assembly_path` of the run that it shows.

    Examples
    --------
    >>> [part["kind"] for part in trial_sections()]
    ['empty']
    """
    pieces: list[tuple[str, str, Maker]] = [
        ("share", "Target over time", share_section),
        ("film", "One run", film_section),
        parts.table_part("usage", "Modes used", usage_table),
    ]
    nothing = "There is no test yet."
    made = parts.sections_of(control_test, nothing, trial_summary, lambda _: [], pieces)
    return made + parts.attempts(("replay", "The run", replay_section, path))


def trial_summary(test: xr.Dataset) -> Section:
    """Return what each arm reached."""
    facts = test.attrs
    table = arm_table(test)
    words = [
        f"{row[0].capitalize()}: {row[1]} ({row[2]})"
        + (f", gain {row[3]} ({row[4]})." if row[3] else ".")
        for row in ([str(cell) for cell in one] for one in table.rows)
    ]  # fmt: skip
    ends = (test["reached_low"].values[0], test["reached_high"].values[0])
    gain, *limits = (float(test[f"gain{end}"][CONSTANT]) for end in ("", "_low", "_high"))
    gained = parts.figure(
        GAIN, gain, ends=(limits[0], limits[1]), confidence=facts["confidence"],
        note=gain_word(test),
    )  # fmt: skip
    share = parts.figure(
        "reached by the policy", test["reached"].values[0], ends=ends,
        confidence=facts["confidence"],
    )  # fmt: skip
    return parts.summary_section(
        [
            f"{GAIN.capitalize()}, {facts['constant_mode']}: {gain_text(test)}: {gain_word(test)}.",
            f"{required(test, 'worlds')} fresh worlds of each arm, with the same starts and "
            f"forces. The plan states {facts['stated']:.3f}: {facts['verdict']}.",
            *words,
        ],
        [gained, share],
    )


def share_section(test: xr.Dataset) -> Section:
    """Return the share of the worlds in the target over time."""
    require(test, "time", "share")
    time, facts = test["time"].values, test.attrs
    drawn = []
    for name, share in zip(test["arm"].values, test["share"].values, strict=True):
        count = np.rint(share * facts["worlds"])
        ends = proportion_interval(count, facts["worlds"], confidence=facts["confidence"])
        drawn.append(parts.series(str(name), time, share, ends=ends))
    target = short_class(str(required(test, "target")))
    return parts.chart(
        f"Bands: {in_percent(facts['confidence'])} intervals.",
        x=parts.label("time", "s"), y=parts.label(f"share of worlds in {target}"), series=drawn,
    )  # fmt: skip


def film_section(test: xr.Dataset) -> Section:
    """Return the decisions of one run, where class or mode changed."""
    require(test, "film_class", "film_mode")
    classes, modes = test["film_class"].values, test["film_mode"].values
    rows = []
    for at, time in enumerate(test["time"].values):
        if at and (classes[at], modes[at]) == (classes[at - 1], modes[at - 1]):
            continue
        mode = "" if modes[at] < 0 else str(test["mode"].values[modes[at]])
        rows.append([f"{time:g}", short_class(str(test["class"].values[classes[at]])), mode])
    return parts.table_section(["time (s)", "class", "mode from then on"], rows)
