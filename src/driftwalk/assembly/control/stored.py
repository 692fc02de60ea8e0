"""A policy as it is stored: its modes and rules, ready to run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from driftwalk.assembly.control.controller import Rules
from driftwalk.assembly.control.improvement import cells_like
from driftwalk.assembly.control.modes import Modes
from driftwalk.assembly.control.plan import Wanted
from driftwalk.core.errors import InputError
from driftwalk.schema.check import require_kind

if TYPE_CHECKING:
    import xarray as xr


def stored_wanted(policy: xr.Dataset) -> Wanted:
    """Return what a policy was planned for.

    Parameters
    ----------
    policy : xarray.Dataset
        A `control_policy`.
    """
    facts = policy.attrs
    names = ("by_s", "every_s", "latency_s", "missed", "dwell_s")
    return Wanted(str(facts["target"]), *(float(facts[name]) for name in names))


def stored_rules(policy: xr.Dataset) -> Rules:
    """Return the rules of a policy.

    Parameters
    ----------
    policy : xarray.Dataset
        A `control_policy`.

    Raises
    ------
    InputError
        When the dataset is of another kind, or its safe mode is none of its modes.
    """
    require_kind(policy, "control_policy", "plan one first (driftwalk control plan)")
    names = [str(name) for name in policy["mode"].values]
    if policy.attrs["safe_mode"] not in names:
        raise InputError(f"the safe mode {policy.attrs['safe_mode']} is none of {names}")
    action = policy["action"].values.astype("int64")
    if not ((action >= 0) & (action < len(names))).all():
        raise InputError(f"the policy chooses modes that are none of its {len(names)}")
    if action.shape != cells_like(policy.sizes["class"]):
        raise InputError(f"the policy has other phases or ages: {action.shape}")
    wanted = stored_wanted(policy)
    return Rules(action[None], names.index(policy.attrs["safe_mode"]), wanted.dwell)


def stored_modes(policy: xr.Dataset) -> Modes:
    """Return the modes of a policy, with their flows.

    Parameters
    ----------
    policy : xarray.Dataset
        A `control_policy`.
    """
    import xarray as xr

    from driftwalk.model import parse_study

    about = {"kind": "flow_field", "schema_version": 1, "arena": policy.attrs["arena"]}
    fields = (
        xr.Dataset(
            {name: (("y", "x"), policy[name].values[at]) for name in ("u", "v", "flag")},
            {name: (name, policy[name].values) for name in ("y", "x")},
            about,
        )
        for at in range(policy.sizes["field"])
    )
    return Modes(
        parse_study(policy.attrs["study"], source="the policy's study"),
        tuple(fields),
        tuple(str(name) for name in policy["mode"].values),
        policy["flow"].values.astype("int64"),
        policy["flow_scale"].values,
        policy["force_std"].values,
        policy["drag_coefficient"].values,
    )
