"""The answers of control: what a policy reaches, and how much better that is than one mode."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.core.intervals import proportion_interval
from driftwalk.core.units import in_percent
from driftwalk.schema.answers.parts import (
    Answer,
    Following,
    Part,
    Row,
    Table,
    each,
    interval_cells,
    records,
)
from driftwalk.schema.shapes import short_class

if TYPE_CHECKING:
    import xarray as xr

USED = 0.01
"""Modes that are used in this share of the time are listed; chosen by hand."""
GAIN = "gain over the best constant mode"
CONSTANT = 1
"""Arm of a test: the best constant mode."""


def policy_answer(found: xr.Dataset) -> Answer:
    """Return the answer of a `control_policy`.

    Parameters
    ----------
    found : xarray.Dataset
        A `control_policy`.
    """
    facts = found.attrs
    parts: list[Part] = [
        f"{found.sizes['mode']} modes, a decision every {facts['every_s']:g} s, "
        f"{facts['worlds_used']} worlds of {facts['blocks']} blocks simulated",
        Row(
            f"{short_class(str(facts['target']))} by {facts['by_s']:g} s",
            f"{facts['reached']:.3f}   {in_percent(facts['confidence'])} interval "
            f"{facts['reached_low']:.3f} to {facts['reached_high']:.3f}, in {facts['worlds']} "
            "fresh worlds",
        ),
        mode_table(found),
    ]
    modes = records(found, "mode", ["constant_reached"])
    return Answer(parts, {**_facts(found), "modes": modes}, policy_warnings(found))


def policy_warnings(policy: xr.Dataset) -> list[str]:
    """Return that a policy is not worth it, where one mode reaches as much in the plan."""
    reached = policy["constant_reached"].values
    alone, stated = float(reached.max()), float(policy.attrs["reached"])
    if stated > alone:
        return []
    best = str(policy["mode"].values[reached.argmax()])
    return [
        f"the stated yield of {stated:.3f} does not exceed the {alone:.3f} of the best constant "
        f"mode: use {best} all the time, or plan with more `rounds` or `worlds`"
    ]


def mode_table(policy: xr.Dataset) -> Table:
    """Return the modes with what each reaches alone, and its exact interval."""
    count, confidence = int(policy.attrs["constant_worlds"]), float(policy.attrs["confidence"])
    rows = []
    for one in each(policy, "mode"):
        share = float(one["constant_reached"])
        low, high = proportion_interval(round(share * count), count, confidence=confidence)
        rows.append([str(one["mode"].values), f"{share:.3f}", f"{low:.3f} to {high:.3f}"])
    return Table(rows, ["mode", "reaches it alone", f"{in_percent(confidence)} interval"])


def trial_answer(found: xr.Dataset) -> Answer:
    """Return the answer of a `control_test`.

    Parameters
    ----------
    found : xarray.Dataset
        A `control_test`.
    """
    facts = found.attrs
    parts: list[Part] = [
        Row(GAIN, f"{gain_text(found)}: {gain_word(found)}"),
        f"{facts['worlds']} fresh worlds of each arm, with the same starts and forces",
        Row(
            "verdict",
            f"{facts['verdict']}: the plan states {facts['stated']:.3f}, "
            f"{facts['difference_low']:+.3f} to {facts['difference_high']:+.3f} from it",
        ),
        Row("best constant mode", str(facts["constant_mode"])),
        arm_table(found),
        usage_table(found),
    ]
    names = ("reached", "reached_low", "reached_high", "gain", "gain_low", "gain_high")
    arms = records(found, "arm", names)
    return Answer(parts, {"standing": gain_word(found), **_facts(found), "arms": arms}, [])


def gain_text(test: xr.Dataset) -> str:
    """Return the gain of the policy over the best constant mode, with its interval."""
    gain, ends = interval_cells(test.isel(arm=CONSTANT), "gain", "+.3f")
    return f"{gain} ({ends})"


def gain_word(test: xr.Dataset) -> str:
    """Return whether the policy is better than the best constant mode, as far as a test says."""
    if float(test["gain_low"][CONSTANT]) > 0.0:
        return "better"
    return "worse" if float(test["gain_high"][CONSTANT]) < 0.0 else "cannot be distinguished"


def after_test(test: xr.Dataset) -> Following:
    """Return what to do with a policy that was tested."""
    if gain_word(test) == "better":
        return Following(
            advice="Follow the policy over what a tracker publishes: `driftwalk control run`"
        )
    return Following(
        advice=f"Use {test.attrs['constant_mode']} all the time, or plan again with more rounds "
        "or worlds: `driftwalk control plan`"
    )


def arm_table(test: xr.Dataset) -> Table:
    """Return what each arm reaches, and the gain of the policy over it."""
    rows = [
        [
            str(one["arm"].values),
            *interval_cells(one, "reached", ".3f"),
            *(interval_cells(one, "gain", "+.3f") if at else ("", "")),
        ]
        for at, one in enumerate(each(test, "arm"))
    ]
    share = f"{in_percent(test.attrs['confidence'])} interval"
    target = short_class(str(test.attrs["target"]))
    columns = ["arm", f"{target} by {test.attrs['by_s']:g} s", share, "gain over it", share]
    return Table(rows, columns)


def usage_table(test: xr.Dataset) -> Table:
    """Return how often the policy uses each mode, over all classes and in each."""
    used = test["usage"].values[0]
    times = test["class_usage"]
    kept = [name for name, row in zip(times["class"].values, times.values, strict=True)
            if np.isfinite(row).all() and "+" in str(name)]  # fmt: skip
    rows = [
        [
            str(name),
            f"{used[at]:.3f}",
            *(f"{float(times.sel({'class': one}).values[at]):.2f}" for one in kept),
        ]
        for at, name in enumerate(test["mode"].values)
        if used[at] >= USED
    ]
    return Table(rows, ["mode", "share of the time", *(short_class(str(name)) for name in kept)])


def _facts(found: xr.Dataset) -> dict[str, Any]:
    hidden = ("kind", "schema_version", "study", "arena")
    return {str(key): value for key, value in found.attrs.items() if key not in hidden}
