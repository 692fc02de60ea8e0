"""`driftwalk control plan` and `test`: runs, what they hold, what they refuse, and resuming."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
import xarray as xr
from command_line import FLOW, here
from every_kind import every_kind
from made_up_fit import made_up_fit
from small_sensitivity import FLOW as STREAM, small

import driftwalk as dw
from driftwalk.assembly import Modes, Wanted
from driftwalk.assembly.control.plan import stored_modes, stored_rules
from driftwalk.assembly.control.worlds import Rules, Worlds
from driftwalk.core.intervals import difference_interval
from driftwalk.page.run_page import in_chapters
from driftwalk.page.sections.control import trial_sections
from driftwalk.runs import ControlPlanWork
from driftwalk.schema.answers.parts import lines_of
from driftwalk.schema.kinds.fit import FIT
from driftwalk.schema.runs import answer_of
from driftwalk.sweep import grid

pytestmark = pytest.mark.slow

TWO = (
    *("--flow", FLOW, "--tank", "30cm", "--blocks", "2", "--target", "2", "--by", "20s"),
    *("--vary", "flow-scale=0,1", "--vary", "force-std=0.2mN,1mN", "--rounds", "3"),
    *("--worlds", "40"),
)


def modes() -> Modes:
    one = dw.ModeSource(small(), STREAM)
    return dw.make_modes([one], flow_scales=[0.0, 1.0], force_stds=[2e-4, 1e-3])


def test_a_plan_and_its_test_hold_what_they_say(tmp_path: Path) -> None:
    done = here("control", "plan", *TWO, "-o", tmp_path / "policy", "--json")
    assert done.code == 0, done.err
    policy = xr.load_dataset(tmp_path / "policy" / "policy.nc")
    assert json.loads(done.out)["reached"] == policy.attrs["reached"]
    done = here("control", "test", tmp_path / "policy", "--worlds", "40", "-o", tmp_path / "test")
    assert done.code == 0, done.err
    test = xr.load_dataset(tmp_path / "test" / "control_test.nc")
    np.testing.assert_allclose(test["usage"].sum("mode"), 1.0)
    np.testing.assert_allclose(test["share"][:, -1], test["reached"])
    facts = test.attrs
    count = [round(40 * float(test["reached"][0])), round(80 * policy.attrs["reached"])]
    limits = difference_interval(count, [40, 80], confidence=0.9)
    assert (facts["difference_low"], facts["difference_high"]) == pytest.approx(limits)
    assert facts["verdict"] == "not " * (not limits[0] <= 0.0 <= limits[1]) + "as stated"
    again = dw.try_control(policy, worlds=40)
    assert again["share"].equals(test["share"])
    # The film is the run that the test shows: the same classes at the decisions.
    path = xr.load_dataset(tmp_path / "test" / "path.nc").isel(run=0)
    joined = path["assembly"].sel(time=test["time"], method="nearest").values
    single = test["class"].values.tolist().index("1+1")
    assert ((joined[:, 0] != joined[:, 1]) == (test["film_class"].values == single)).all()
    for folder, names in (("policy", ["policy"]), ("test", ["film_strip", "run", "shares"])):
        assert sorted(path.stem for path in tmp_path.glob(f"{folder}/figures/*.png")) == names
    page = tmp_path / "page.html"
    assert here("report", tmp_path / "policy", tmp_path / "test", "-o", page).code == 0


def test_a_policy_no_better_than_one_mode_is_not_recommended() -> None:
    policy, test = every_kind("control_policy").copy(), every_kind("control_test").copy()
    alone = policy["constant_reached"].copy(data=[0.1, 0.5])
    for reached, warned in ((0.6, 0), (0.5, 1), (0.3, 1)):
        one = policy.assign(constant_reached=alone).assign_attrs(reached=reached)
        answer = answer_of(one)
        assert answer is not None
        assert len(answer.warnings) == warned
        assert all(f"use {one['mode'].values[1]} all the time" in said for said in answer.warnings)
    for low, high, word, next_step in (
        (0.01, 0.2, "better", "control run"),
        (-0.1, 0.2, "cannot be distinguished", "all the time"),
        (-0.2, -0.1, "worse", "all the time"),
    ):
        ends = {"gain_low": ("arm", [0.0, low, 0.3]), "gain_high": ("arm", [0.0, high, 0.5])}
        one = test.assign(ends)
        answer = answer_of(one)
        assert answer is not None
        assert lines_of(answer.parts)[0].endswith(f"({low:+.3f} to {high:+.3f}): {word}")
        assert answer.facts["standing"] == word
        assert next_step in str(in_chapters(trial_sections(control_test=one), one)[0]["next"])


def test_a_policy_is_that_of_its_modes_again() -> None:
    policy = every_kind("control_policy")
    found = stored_modes(policy)
    assert found.flow_scale.tolist() == [0.0, 1.0]
    assert found.study.assembly.blocks == 3
    np.testing.assert_array_equal(found.flows[0]["u"], STREAM["u"])
    assert stored_rules(policy).action.shape == (1, 3, 4, 6)


def test_worlds_do_not_depend_on_units_and_constant_ones_are_those_of_a_batch() -> None:
    classes = dw.assembly.outcome_classes(3)
    rules = Rules(np.zeros((1, 3, len(classes), 6), dtype=np.int64))
    work = Worlds(modes(), classes, Wanted("L3", 15.0, 5.0), rules, seed=4, arm="constant", only=3)
    whole = work(next(iter(grid(world=np.arange(8)).units(8))))
    parts = [work(unit) for unit in grid(world=np.arange(8)).units(3)]
    for name, values in whole.items():
        np.testing.assert_array_equal(values, np.concatenate([one[name] for one in parts]))
    batch = dw.TankBatch(small(), STREAM, worlds=8, seed=4)
    batch.set(force_std=1e-3, flow_scale=1.0)
    batch.advance(15.0)
    assert [classes[at] for at in whole["after"][:, -1]] == batch.outcome.tolist()


def test_a_latency_delays_every_mode_but_the_first() -> None:
    # Modes differ in the flow alone: in still water without force nothing moves.
    one = dw.ModeSource(small(forces={"force_std_N": 0.0}), STREAM)
    still = dw.make_modes([one], flow_scales=[0.0, 1.0])
    classes = dw.assembly.outcome_classes(3)
    # The flow runs in the last phase alone, which begins at the third of six decisions.
    action = np.zeros((1, 3, len(classes), 6), dtype=np.int64)
    action[:, 0] = 1
    unit = next(iter(grid(world=np.arange(40)).units(40)))
    prompt, late = (
        Worlds(still, classes, Wanted("L3", 12.0, 2.0, latency), Rules(action), seed=1)(unit)
        for latency in (0.0, 1.9)
    )
    assert (prompt["entered"][:, :2] == 0).all()
    early, delayed = (one["entered"][:, 2:].sum(axis=1) for one in (prompt, late))
    assert early.sum() >= delayed.sum() > 0


def test_missed_looks_hold_the_mode() -> None:
    classes = dw.assembly.outcome_classes(3)
    action = np.ones((1, 3, len(classes), 6), dtype=np.int64)
    rules = Rules(action, safe=0)
    unit = next(iter(grid(world=np.arange(200)).units(200)))
    found = Worlds(modes(), classes, Wanted("L3", 0.3, 0.1, missed=0.5), rules, seed=1)(unit)
    # In the safe mode until the first look: 1/2, 1/4, 1/8 of the worlds; 4 standard errors.
    for period in range(3):
        share = 0.5 ** (period + 1)
        seen = (found["mode"][:, period] == 0).mean()
        assert abs(seen - share) < 4.0 * np.sqrt(share * (1.0 - share) / 200)


def test_draws_from_a_fit_are_those_of_its_uncertainty() -> None:
    names = ["ln_drag_coefficient", "ln_noise_intensity"]
    axes = ("log_parameter", "other_log_parameter")
    fit = made_up_fit().assign(covariance=(axes, np.diag([0.01, 0.04])))
    fit = fit.assign_coords(log_parameter=names, other_log_parameter=names)
    fit.attrs["schema_version"] = FIT.version
    study = small()
    one = dw.ModeSource(study, STREAM, fit)
    found = dw.make_modes([one], flow_scales=[0.0, 1.0], force_stds=[2e-4, 4e-4], seed=3)
    drawn = dw.assembly.draw_parameters(fit, runs=99, seed=3)
    ratio = drawn.force_std / study.forces.force_std_N
    np.testing.assert_allclose(found.force_std[0], np.r_[2e-4, 2e-4 * ratio])
    np.testing.assert_allclose(found.drag_coefficient[3, 1:], drawn.drag_coefficient)


@pytest.mark.parametrize(("arm", "tables"), [("constant", 1), ("policy", 4)])
def test_modes_and_policies_in_turn_meet_every_draw_equally_often(
    monkeypatch: pytest.MonkeyPatch, arm: Literal["constant", "policy"], tables: int
) -> None:
    # Six draws; four modes, or four policies of one mode each: 24 worlds have each pair once.
    many = replace(
        modes(), force_std=np.arange(24.0).reshape(4, 6), drag_coefficient=np.ones((4, 6))
    )
    classes = dw.assembly.outcome_classes(3)
    action = np.broadcast_to(np.arange(tables)[:, None, None, None], (tables, 3, len(classes), 6))
    given: list[float] = []
    monkeypatch.setattr(dw.TankBatch, "set", lambda _, **to: given.extend(to["force_std"].tolist()))
    for first in (0, 24):
        work = Worlds(
            many, classes, Wanted("L3", 0.1, 0.1), Rules(action), 4, first, turn=4, arm=arm
        )
        for unit in grid(world=np.arange(first, first + 24)).units(7):
            work(unit)
        assert sorted(given) == list(range(24))
        given.clear()


def test_modes_of_different_tanks_or_blocks_are_refused() -> None:
    one = dw.ModeSource(small(), STREAM, name="fit-a")
    for other, said in (
        (small(tank={"diameter_m": 0.2}), "different tanks: fit-a .* fit-b"),
        (small(assembly={"blocks": 2}), r"differ in \[assembly\] blocks: fit-a has 3, fit-b 2"),
        (small(forces={"force_interval_s": 0.02}), r"\[forces\] force_interval_s"),
    ):
        with pytest.raises(dw.InputError, match=said):
            dw.make_modes([one, dw.ModeSource(other, STREAM, name="fit-b")])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--target", "T"], "target T has 4 blocks, and the runs have 2"),
        (["--target", "q"], "target q: no shape"),
        (["--every", "30s"], "the deadline must not be shorter than the decision period"),
        (
            ["--every", "1ms"],
            "decisions every 0.001 s are below the 0.0[0-9]+ s between two forces",
        ),
        (["--every", "6s"], "not a whole number of periods of 6 s"),
        (["--latency", "5s"], "latency has to be below the 5 s"),
        (["--missed", "1"], "missed looks is from 0 to below 1"),
        (["--chirality", "distinct"], "control needs chirality merged"),
        (["--dwell", "60s"], "dwell must lie between 0 s and the deadline"),
        (["--blocks", "8"], "planned for 2 to 7 blocks, got 8"),
        (["--vary", "flow-scale=2"], "flow-scale is varied twice"),
        (["--vary", "drag=2"], "expected NAME=VALUES with a name out of flow-scale, force-std"),
    ],
)
def test_bad_plans_are_one_line(tmp_path: Path, words: list[str], said: str) -> None:
    refused("plan", *TWO, *words, out=tmp_path / "out", said=said)


def test_the_shapes_of_a_target_come_in_any_order() -> None:
    work = ControlPlanWork(modes(), Wanted("1+2", 20.0, 5.0), rounds=1, worlds=20, seed=1)
    assert work.checked().wanted == Wanted("2+1", 20.0, 5.0)


def test_bad_policies_are_one_line(tmp_path: Path) -> None:
    every_kind("control_policy").to_netcdf(tmp_path / "policy.nc")
    every_kind("class_times").to_netcdf(tmp_path / "other.nc")
    out = tmp_path / "out"
    refused("test", tmp_path / "other.nc", out=out, said="other.nc holds no policy")
    (tmp_path / "empty").mkdir()
    refused("test", tmp_path / "empty", out=out, said="empty holds no policy")
    refused("run", tmp_path / "other.nc", "--live", "127.0.0.1:5000", out=out, said="no policy")
    good = tmp_path / "policy.nc"
    refused("run", good, "--live", "5000", out=out, said="expected HOST:PORT")
    refused("run", good, "--live", "127.0.0.1:1", out=out, said="no tracker on 127.0.0.1:1")
    refused("test", good, "--latency", "9s", out=out, said="latency has to be below")
    refused("test", good, "--force-factor", "0", out=out, said="above 0")


def refused(command: str, *words: object, out: Path, said: str) -> None:
    done = here("control", command, *words, *(() if command == "run" else ("-o", out)))
    assert done.code == 2
    assert re.search(said, done.err), done.err
    assert len(done.err.strip().splitlines()) == 1
    assert not out.exists()
