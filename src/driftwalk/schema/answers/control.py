"""The answers of control: what a policy reaches, and how much better that is than one mode."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.schema.answers.parts import Answer, Part, Row, Table, each
from driftwalk.schema.shapes import short_class

if TYPE_CHECKING:
    import xarray as xr

USED = 0.01
"""Modes that are used in this share of the time are listed; chosen by hand."""


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
            f"{facts['reached']:.3f}   {facts['confidence']:.0%} interval "
            f"{facts['reached_low']:.3f} to {facts['reached_high']:.3f}, in {facts['worlds']} "
            "fresh worlds",
        ),
        mode_table(found),
    ]
    return Answer(parts, _facts(found, {"modes": ("mode", ("constant_reached",))}), [])


def mode_table(policy: xr.Dataset) -> Table:
    """Return the modes with what each reaches alone."""
    rows = [
        [str(one["mode"].values), f"{float(one['constant_reached']):.3f}"]
        for one in each(policy, "mode")
    ]
    return Table(rows, ["mode", "reaches it alone"])


def trial_answer(found: xr.Dataset) -> Answer:
    """Return the answer of a `control_test`.

    Parameters
    ----------
    found : xarray.Dataset
        A `control_test`.
    """
    facts = found.attrs
    parts: list[Part] = [
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
    return Answer(parts, _facts(found, {"arms": ("arm", names)}), [])


def arm_table(test: xr.Dataset) -> Table:
    """Return what each arm reaches, and the gain of the policy over it."""
    rows = [
        [
            str(one["arm"].values),
            f"{float(one['reached']):.3f}",
            f"{float(one['reached_low']):.3f} to {float(one['reached_high']):.3f}",
            *(
                ["", ""]
                if at == 0
                else [
                    f"{float(one['gain']):+.3f}",
                    f"{float(one['gain_low']):+.3f} to {float(one['gain_high']):+.3f}",
                ]
            ),
        ]
        for at, one in enumerate(each(test, "arm"))
    ]
    share = f"{test.attrs['confidence']:.0%} interval"
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
    return Table(rows, ["mode", "time", *(short_class(str(name)) for name in kept)])


def _facts(found: xr.Dataset, tables: dict[str, tuple[str, tuple[str, ...]]]) -> dict[str, Any]:
    hidden = ("kind", "schema_version", "study", "arena")
    own = {key: value for key, value in found.attrs.items() if key not in hidden}
    return own | {
        key: [
            {dim: str(one[dim].values), **{name: float(one[name]) for name in names}}
            for one in each(found, dim)
        ]
        for key, (dim, names) in tables.items()
    }
