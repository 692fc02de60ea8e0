"""Simulated self-assembly: addresses, options, refusals. What blocks do is tested elsewhere."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from command_line import assert_same_bits
from quadratic_calibration import quadratic

import driftwalk as dw
from driftwalk.assembly.runs.draws import RUNS_PER_FLOW, draw_flow, draw_parameters
from driftwalk.assembly.runs.plan import make_plan
from driftwalk.assembly.runs.run import (
    assemble,
    assemble_drawn,
    assembly_path,
    check_assembly,
    runs_per_unit,
)
from driftwalk.core.errors import InputError
from driftwalk.model import Study
from driftwalk.sweep import MemoryStore

SHORT = {"blocks": 3, "runs": 60, "duration": 5.0}
ROWS = ("event_time", "event_block", "event_face", "x", "y", "theta", "end_time", "cell")


@pytest.fixture(scope="module")
def flow() -> xr.Dataset:
    return dw.tank30_flow()


@pytest.fixture(scope="module")
def found(flow: xr.Dataset) -> xr.Dataset:
    return assemble(Study(), flow, **SHORT)


def assert_same_rows(first: xr.Dataset, second: xr.Dataset) -> None:
    for name in ROWS:
        np.testing.assert_array_equal(first[name].values, second[name].values, err_msg=name)


def test_threads_do_not_change_a_bit(flow: xr.Dataset, found: xr.Dataset) -> None:
    assert_same_bits(assemble(Study(), flow, **SHORT, threads=1), found)
    assert_same_bits(assemble(Study(), flow, **SHORT, threads=3), found)


def test_a_run_depends_on_its_address_alone(flow: xr.Dataset, found: xr.Dataset) -> None:
    few = assemble(Study(), flow, **{**SHORT, "runs": 7})
    assert_same_rows(few, found.isel(run=slice(0, 7)))
    for other in ({"seed": 2}, {"trial": 3}):
        changed = assemble(Study(), flow, **{**SHORT, "runs": 7}, **other)
        assert (changed["x"].values != few["x"].values).all()


def test_options_go_over_the_study(flow: xr.Dataset, found: xr.Dataset) -> None:
    study = Study(assembly={"blocks": 3, "runs": 60, "duration_s": 5.0, "seed": 1})
    assert_same_bits(assemble(study, flow), found)
    assert found.sizes["run"] == 60
    assert found.attrs["drawn"] == "no"


def test_parameters_of_each_run(flow: xr.Dataset) -> None:
    """A run with parameters of its own is that run with these parameters for all."""
    drag, force = np.array([0.2, 0.6, 0.4]), np.array([0.3e-3, 0.9e-3, 0.6e-3])
    options = {**SHORT, "runs": 3}
    each = assemble(Study(), flow, **options, drag_coefficient=drag, force_std=force)
    np.testing.assert_array_equal(each["drag_coefficient"], drag)
    for run in range(3):
        same = assemble(Study(), flow, **options, drag_coefficient=drag[run], force_std=force[run])
        assert_same_rows(same.isel(run=[run]), each.isel(run=[run]))


def test_given_start(flow: xr.Dataset) -> None:
    """Without force in still water blocks stay where they are put."""
    start = [[0.0, 0.0, 0.3], [0.05, 0.0, 0.0], [-0.05, 0.02, -1.0]]
    still = dw.uniform_flow(0.0, 0.0)
    stay = assemble(Study(), still, **{**SHORT, "runs": 2}, start=start, force_std=0.0)
    for part, name in enumerate(("x", "y", "theta")):
        expected = np.tile(np.array(start)[:, part], (2, 1))
        np.testing.assert_allclose(stay[name], expected, atol=1e-7)
    assert (stay["event_count"] == 0).all()
    assert stay["class"].values[stay["outcome"].values].tolist() == ["1+1+1", "1+1+1"]


def test_random_starts_differ_and_lie_in_the_tank() -> None:
    """After one step of no force in still water the blocks are where they started."""
    still = dw.uniform_flow(0.0, 0.0)
    study = Study(assembly={"blocks": 12, "runs": 40, "duration_s": 0.01, "latching": "none"})
    first = assemble(study, still, force_std=0.0)
    turn = first["theta"].values[..., None] + np.pi * (0.25 + 0.5 * np.arange(4))
    reach = 0.03 / np.sqrt(2.0)
    x = first["x"].values[..., None] + reach * np.cos(turn)
    y = first["y"].values[..., None] + reach * np.sin(turn)
    assert np.hypot(x, y).max() <= 0.15 + 1e-6
    assert np.unique(first["x"].values).size == 480


def test_a_path_is_the_run_again(flow: xr.Dataset, found: xr.Dataset) -> None:
    options = {"blocks": 3, "duration": 5.0}
    path = assembly_path(Study(), flow, runs=[4, 11], sample_interval=0.5, **options)
    assert path["run"].values.tolist() == [4, 11]
    np.testing.assert_allclose(path["time"], np.arange(11) * 0.5)
    late = path.isel(time=-1)
    for index, run in enumerate((4, 11)):
        joined = found["event_time"].values[run]
        if found["end_time"].values[run] == 5.0:
            for name in ("x", "y"):
                end = found[name].values[run]
                np.testing.assert_allclose(late[name].values[index], end, atol=1e-6)
        # Assemblies merge in the first sample at or after an event.
        for sample, time in enumerate(path["time"].values):
            count = len(set(path["assembly"].values[index, sample].tolist()))
            assert count == 3 - int((joined <= time).sum())


def test_finished_units_are_not_computed_again(
    flow: xr.Dataset, found: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("driftwalk.assembly.runs.run.RUNS_TOGETHER", RUNS_PER_FLOW)
    store, told = MemoryStore(), []
    options: dict[str, Any] = {"store": store, "progress": lambda *done: told.append(done)}
    assert_same_bits(assemble(Study(), flow, **SHORT, **options), found)
    assert told == [(0, 60), (25, 60), (50, 60), (60, 60)]
    monkeypatch.setattr("driftwalk.assembly.runs.run.simulate_rows", None)
    assert_same_bits(assemble(Study(), flow, **SHORT, **options), found)


@pytest.mark.parametrize(("blocks", "runs"), [(1, 101), (4, 1000), (4, 90_000), (9, 5000)])
def test_runs_of_a_unit_share_whole_flows(flow: xr.Dataset, blocks: int, runs: int) -> None:
    found = runs_per_unit(make_plan(Study(), flow, settings={"blocks": blocks, "runs": runs}))
    assert found % RUNS_PER_FLOW == 0
    assert 0 < found < runs


def test_drawn_parameters_reach_their_runs(flow: xr.Dataset) -> None:
    known = quadratic()
    drawn = assemble_drawn(Study(), flow, known, **{**SHORT, "runs": 5}, seed=3)
    expected = draw_parameters(known, runs=5, seed=3, trial=1)
    np.testing.assert_array_equal(drawn["drag_coefficient"], expected.drag_coefficient)
    np.testing.assert_array_equal(drawn["force_std"], expected.force_std)
    assert drawn.attrs["drawn"] == "drag_coefficient force_std"
    assert "flow_draw" not in drawn
    same = assemble(
        Study(),
        flow,
        **{**SHORT, "runs": 5},
        seed=3,
        trial=1,
        drag_coefficient=expected.drag_coefficient,
        force_std=expected.force_std,
    )
    assert_same_rows(same, drawn)


def test_drawn_flows_reach_their_runs(flow: xr.Dataset) -> None:
    error = xr.full_like(flow["u"], 5e-3)
    unsure = flow.assign(u_standard_error=error, v_standard_error=error)
    known = quadratic()
    drawn = assemble_drawn(Study(), unsure, known, **SHORT)
    assert drawn["flow_draw"].values.tolist() == [run // 25 for run in range(60)]
    assert drawn.attrs["drawn"] == "drag_coefficient force_std flow"
    expected = draw_parameters(known, runs=60, seed=1, trial=1)
    second = assemble(
        Study(),
        draw_flow(unsure, seed=1, trial=1, draw=1),
        **SHORT,
        trial=1,
        drag_coefficient=expected.drag_coefficient,
        force_std=expected.force_std,
    )
    rows = slice(25, 50)
    assert_same_rows(drawn.isel(run=rows), second.isel(run=rows))
    assert (drawn["x"].values[:25] != second["x"].values[:25]).any(axis=1).all()
    plain = assemble_drawn(Study(), unsure, known, **SHORT, flow_draws="none")
    assert "flow_draw" not in plain


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"blocks": 0}, r"\[assembly\] blocks: must be at least 1, got 0"),
        ({"runs": 0}, r"\[assembly\] runs: must be at least 1, got 0"),
        ({"duration": 0.0}, r"\[assembly\] duration_s: must be more than 0 s"),
        ({"blocks": 200}, "200 blocks of 0.03 m do not fit into the tank"),
        (
            {"blocks": 70, "runs": 2},
            r"run 0: \d+ of 70 blocks found a place in the tank, a circle of diameter 0.3 m; use "
            r"fewer blocks \(`assembly.blocks`\)",
        ),
        ({"backend": "gpu"}, "backend must be one of cpu, reference, got 'gpu'"),
        ({"trial": -1}, "trial: expected a whole number from 0"),
        ({"drag_coefficient": [0.1, 0.2]}, "one for each of 60 runs, got shape"),
        ({"force_std": -1.0}, "force_std_N: must be at least 0 N"),
        ({"force_std": np.full(60, np.nan)}, "force_std: expected finite numbers from 0 on"),
        ({"start": [[0.0, 0.0, 0.0]]}, "expected poses of shape"),
        ({"duration": 1e6, "runs": 1, "blocks": 1}, "of every simulated world, some"),
    ],
)
def test_a_mistake_is_one_line(flow: xr.Dataset, options: dict[str, Any], words: str) -> None:
    study = Study(forces={"force_interval_s": 1e-4 if "world" in words else 0.01})
    with pytest.raises(InputError, match=words) as caught:
        assemble(study, flow, **{**SHORT, **options})
    assert "\n" not in str(caught.value)


def test_a_flow_that_does_not_cover_the_tank(flow: xr.Dataset) -> None:
    large = Study(tank={"diameter_m": 0.5})
    for refuse in (assemble, assembly_path, check_assembly):
        with pytest.raises(InputError, match="does not cover the tank"):
            refuse(large, flow)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"runs": []}, "expected the indices of runs"),
        ({"runs": [-1]}, "expected the indices of runs"),
        ({"runs": [0.5]}, "expected the indices of runs"),
        ({"sample_interval": 0.0}, "sample_interval must be above 0 s"),
    ],
)
def test_a_path_that_cannot_be(flow: xr.Dataset, options: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        assembly_path(Study(), flow, **options)


def test_flow_draws_is_one_of_two_words(flow: xr.Dataset) -> None:
    with pytest.raises(InputError, match="standard_error, none, got 'all'"):
        assemble_drawn(Study(), flow, quadratic(), flow_draws="all")  # type: ignore[arg-type]


def test_the_reference_agrees_over_a_short_time(flow: xr.Dataset) -> None:
    """Single and double precision drift apart slowly while no block has met another."""
    short = {"blocks": 2, "runs": 20, "duration": 0.5, "seed": 4}
    single = assemble(Study(), flow, **short)
    double = assemble(Study(), flow, **short, backend="reference")
    apart = np.isnan(single["first_contact_time"].values)
    assert apart.sum() >= 10
    for name in ("x", "y", "theta"):
        turn = single[name].values[apart] - double[name].values[apart]
        np.testing.assert_allclose(np.sin(turn), 0.0, atol=2e-5, err_msg=name)
