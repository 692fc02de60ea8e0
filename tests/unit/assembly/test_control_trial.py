"""The test of a policy: which worlds its arms have, and when a stopped one goes on."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from every_kind import every_kind

import driftwalk as dw
from driftwalk.assembly.control.worlds import Worlds
from driftwalk.runs import ControlTestWork
from driftwalk.sweep import WorkUnit

pytestmark = pytest.mark.slow


def test_the_best_constant_mode_is_chosen_in_other_worlds_than_it_is_reported_in(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # A mode that is best where it is chosen, and in no world of the report.
    policy, ran = every_kind("control_policy"), []
    target = policy["class"].values.tolist().index(policy.attrs["target"])

    def made_up(work: Worlds, unit: WorkUnit) -> dict[str, np.ndarray]:
        world = unit.settings["world"]
        ran.append((work.arm, work.only, int(world[0]), int(world[-1])))
        found = np.zeros((world.size, work.wanted.periods), dtype=np.int16)
        chosen = policy.attrs["worlds_used"] + 20 <= world[0] and work.only == 1
        after = found + (target if chosen else 0)
        return {"seen": found, "mode": found, "after": after, "entered": found}

    monkeypatch.setattr(Worlds, "__call__", made_up)
    found = dw.try_control(policy, worlds=20)
    assert found.attrs["constant_mode"] == policy["mode"].values[1]
    first = int(policy.attrs["worlds_used"])
    assert {one for one in ran if one[2] == first} == {
        (arm, only, first, first + 19)
        for arm, only in (("policy", None), ("constant", 1), ("random", None))
    }
    assert found["reached"][1] == 0.0


def test_a_stopped_test_does_not_go_on_with_another_policy(tmp_path: Path) -> None:
    policy = every_kind("control_policy")
    given = ControlTestWork(policy, 20).specification()
    policy.to_netcdf(tmp_path / "policy.nc")
    stored = xr.load_dataset(tmp_path / "policy.nc")
    assert ControlTestWork(policy.copy(deep=True), 20).specification() == given
    json.dumps(ControlTestWork(stored, 20).specification())
    for name in policy.data_vars:
        values = policy[name].values.copy()
        values.flat[0] += 1
        other = policy.assign({name: (policy[name].dims, values)})
        assert ControlTestWork(other, 20).specification() != given, name
    for name in policy.attrs:
        other = policy.assign_attrs({name: "another"})
        assert ControlTestWork(other, 20).specification() != given, name
