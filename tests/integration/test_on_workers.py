"""Every stage that sweeps gives the same bits on two worker processes as in this one."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from chain_runs import chain_runs
from command_line import GRID, assert_same_bits, leave_out_figures
from every_kind import every_kind
from few_simulations import simulate_little
from recovery_worlds import small_study
from self_propelled import moving
from small_sensitivity import FLOW, small

import driftwalk as dw
from driftwalk.assembly import Wanted
from driftwalk.calibration import compare_models, recover_model
from driftwalk.calibration.evolution import Budget
from driftwalk.cluster import Cluster, connect, parse_address
from driftwalk.core.files.shards import ShardStore
from driftwalk.model import parse_study
from driftwalk.runs import (
    ControlPlanWork,
    ControlTestWork,
    KineticsWork,
    OutcomePosteriorWork,
    YieldWork,
    run_work,
)

pytestmark = pytest.mark.slow
if find_spec("distributed") is None:  # found, not loaded: that takes a second of every run
    pytest.skip("workers need driftwalk[cluster]", allow_module_level=True)

ACTIVE = {"speed": 0.03, "rotational_diffusion": 0.5, "turn_rate": 0.3}


@pytest.fixture(scope="module")
def workers() -> Iterator[Cluster]:
    """Two worker processes, to which nothing happens while the tests use them."""
    with connect(parse_address("local:2")) as cluster:
        yield cluster
        assert cluster.report() == ""
        assert cluster.words.endswith("units, 2 workers")


@pytest.fixture(scope="module")
def short() -> xr.Dataset:
    """Return two minutes of the bundled recording."""
    return dw.tank30_recording().sel(time=slice(0.0, 120.0))


@pytest.fixture(scope="module")
def active() -> xr.Dataset:
    """Return a minute of an active body (synthetic)."""
    return moving(dw.motion_model("active", clearance=0.015), ACTIVE, 60.0, seed=2, noise=3e-4)


def noisy(**calibration: object) -> dw.Study:
    return dw.Study(observation={"position_noise_m": 3e-4}, calibration=calibration)


def test_a_calibration_with_its_bootstrap_and_halves(workers: Cluster, short: xr.Dataset) -> None:
    told: set[str] = set()
    options = {"study": parse_study(GRID), "flow": dw.tank30_flow()}
    calibrate = dw.calibration.calibrate
    there = calibrate(
        short, executor=workers.executor, tell=lambda stage, *_: told.add(stage), **options
    )
    assert {"coarse", "refined", "bootstrap", "validation"} <= told
    assert_same_bits(there, calibrate(short, **options))


def test_a_calibration_of_three_parameters(
    workers: Cluster, active: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    simulate_little(monkeypatch)
    model, study = dw.motion_model("active", clearance=0.015), noisy(bootstrap=10)
    there = dw.calibrate(active, model, study=study, executor=workers.executor)
    assert_same_bits(there, dw.calibrate(active, model, study=study))


def test_a_comparison_of_models(workers: Cluster, active: xr.Dataset) -> None:
    budget = Budget(design=16, starts=1, short=2, long=3)
    told: list[tuple[int, int]] = []
    options = {"models": ["inertial", "active"], "study": noisy(bootstrap=0), "budget": budget}
    there = compare_models(
        active,
        executor=workers.executor,
        tell=lambda done, total, _: told.append((done, total)),
        **options,
    )
    # Two models and two walks: one unit each.
    assert {250, 500, 750, 1000} <= {done for done, _ in told}
    assert_same_bits(there, compare_models(active, **options))


def test_recovery_studies(workers: Cluster) -> None:
    study = small_study()
    there, here = (
        # How long a fit takes is measured.
        dw.recovery_study(study, dw.tank30_flow(), **how).drop_vars("fit_time")
        for how in ({"executor": workers.executor}, {"threads": 1})
    )
    assert_same_bits(there, here)
    chosen = dw.apply_overrides(
        noisy(refine="none", bootstrap=0, replicates=1),
        {"recover.recordings": 2, "recover.durations_s": [40.0]},
    )
    model = dw.motion_model("active", turn_rate=0.3)
    truth = {name: ACTIVE[name] for name in ("speed", "rotational_diffusion")}
    found = recover_model(model, truth, chosen, executor=workers.executor)
    assert_same_bits(found, recover_model(model, truth, chosen))


def test_self_assembly_and_its_sensitivity(workers: Cluster) -> None:
    flow = dw.tank30_flow()
    study = dw.Study(
        assembly={"blocks": 4, "runs": 200, "duration_s": 5.0},
        sensitivity={"runs": 20, "reference_realisations": 4},
    )
    axes = {"drag_coefficient": np.array([0.2, 0.4]), "force_std": np.array([2e-4, 6e-4, 1e-3])}
    for made in (
        lambda executor: dw.assemble(study, flow, executor=executor),
        lambda executor: dw.sensitivity_map(study, flow, axes=axes, executor=executor),
    ):
        xr.testing.assert_identical(made(workers.executor), made(None))


def work_of(kind: str) -> Any:
    """Return a small run of a kind."""
    few = small(assembly={"blocks": 2}, sensitivity={"force_std_N": [2e-4, 1e-3]})
    modes = dw.make_modes([dw.ModeSource(few, FLOW)], flow_scales=[0.0, 1.0])
    counts, quick = {"2": 12, "1+1": 8}, {"after": 4.0, "runs": 20, "truths": 20}
    searched = {"target": "2", "by": 10.0, "ranges": {}, "runs": 160, "fresh_runs": 20}
    return {
        "kinetics": lambda: KineticsWork([[chain_runs(30, 1)]], target="T"),
        "outcome_posterior": lambda: OutcomePosteriorWork(counts, FLOW, few, quick),
        "yield": lambda: YieldWork(few, FLOW, searched),
        "control_policy": lambda: ControlPlanWork(modes, Wanted("2", 10.0, 5.0), 3, 20, seed=1),
        "control_test": lambda: ControlTestWork(every_kind("control_policy"), worlds=20),
    }[kind]()


@pytest.mark.parametrize(
    "kind", ["outcome_posterior", "yield", "control_policy", "control_test", "kinetics"]
)
def test_a_run_that_workers_left_off_is_continued(
    workers: Cluster, kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Workers begin and end it, and it has the bytes of a run at home without a stop."""
    leave_out_figures(monkeypatch)
    work, write, written = work_of(kind), ShardStore.write, count()
    run_work(work, tmp_path / "whole")

    def stopped(self: ShardStore, *given: Any) -> None:
        if next(written) == 2:
            raise KeyboardInterrupt
        write(self, *given)

    with monkeypatch.context() as patch:
        patch.setattr(ShardStore, "write", stopped)
        with pytest.raises(KeyboardInterrupt):
            run_work(work, tmp_path / "parts", executor=workers.executor)
    run_work(work, tmp_path / "parts", executor=workers.executor)
    one, other = (
        {path.name: path.read_bytes() for path in (tmp_path / name).glob("*.nc")}
        for name in ("whole", "parts")
    )
    assert one
    assert one == other
