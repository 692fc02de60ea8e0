"""Motion models compared on simulated recordings of known truth, with a small search."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import pytest
import xarray as xr
from self_propelled import moving

import driftwalk as dw
from driftwalk.calibration import check_models, compare_models
from driftwalk.calibration.estimation import gauss_newton, regression_abc, synthetic_likelihood
from driftwalk.calibration.evolution import Budget
from driftwalk.calibration.ranking import model_evidence
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.schema import Parameter
from driftwalk.schema.check import check_dataset
from driftwalk.sweep import MemoryStore, SweepError
from driftwalk.sweep.workers import single_threaded_processes

SMALL = Budget(design=32, starts=1, short=6, long=6, retest=2)
DISTANCES = dw.apply_overrides(dw.Study(), {"calibration.bootstrap": 0})
"""Leaves the summaries out."""
TRUTH = {
    "speed": 0.05, "speed_cv": 0.4, "run_time": 2.0, "turn_std": 1.2, "rotational_diffusion": 0.3,
    "turn_rate": 0.0,
}  # fmt: skip


def recording(seconds: float) -> xr.Dataset:
    """Return a run and tumble in the paper's tank."""
    moved = moving(dw.motion_model("run_tumble"), TRUTH, seconds, seed=5)
    return moved.assign_attrs(simulated="yes")


@pytest.fixture(scope="module")
def recorded() -> xr.Dataset:
    return recording(60.0)


@pytest.fixture(scope="module")
def found() -> xr.Dataset:
    return compare_models(
        recording(240.0), ["inertial", "run_tumble"], study=DISTANCES, budget=SMALL
    )


@pytest.mark.slow
def test_the_true_model_is_the_closest(found: xr.Dataset) -> None:
    names = found["model"].values.tolist()
    assert set(names) == {"inertial", "run_tumble", "resampled steps", "hidden Markov walk"}
    assert names[0] == "run_tumble"
    assert str(found["finding"].values[0]) == (
        "Cannot tell whether run_tumble explains the recording: the summaries of the motion were "
        "not matched: compare with `bootstrap` above 1"
    )


@pytest.mark.slow
def test_it_is_what_its_schema_says(found: xr.Dataset) -> None:
    check_dataset(found)
    assert found.attrs["simulated_recording"] == "yes"


@pytest.mark.slow
def test_models_come_from_the_closest_to_the_farthest(found: xr.Dataset) -> None:
    assert (np.diff(found["score"].values) >= 0.0).all()
    assert found["behind"].values[0] == found["behind_std"].values[0] == 0.0
    floors = (found["held_out_distance"] / found["floor"]).mean("aspect")
    # The score is a mean of ratios over worlds, the stored distances are medians.
    assert floors.values == pytest.approx(found["score"].values, rel=0.15)


@pytest.mark.slow
def test_walks_of_recorded_steps_are_near_in_steps_and_never_explained(found: xr.Dataset) -> None:
    resampling_baselines = found.isel(model=found["baseline"].values.astype(bool))
    assert (resampling_baselines["verdict"] == "does not explain").all()
    apart, best = (
        resampling_baselines["held_out_distance"],
        found["held_out_distance"].isel(model=0),
    )
    own = float(found["own_distance"].sel(aspect="steps"))
    assert float(apart.sel(model="resampled steps", aspect="steps")) < own + 0.05
    assert (apart.sel(aspect="wall") > 2.0 * best.sel(aspect="wall")).all()


@pytest.mark.slow
def test_each_model_has_values_of_its_own_parameters_alone(found: xr.Dataset) -> None:
    for name in ("inertial", "run_tumble"):
        values = found["estimate"].sel(model=name).dropna("parameter")
        wanted = [one.name for one in dw.motion_model(name).parameters]
        assert sorted(values["parameter"].values.tolist()) == sorted(wanted)


@pytest.mark.slow
def test_threads_do_not_change_the_answer(recorded: xr.Dataset) -> None:
    one, two = (
        compare_models(recorded, ["inertial"], study=DISTANCES, budget=SMALL, threads=threads)
        for threads in (1, 2)
    )
    xr.testing.assert_identical(one, two)


class Interrupted(Exception):
    """Ends a comparison."""


class Counted(MemoryStore):
    """Counts what is written."""

    written = 0

    def write(self, *unit: Any) -> None:
        self.written += 1
        super().write(*unit)


@pytest.mark.slow
def test_a_comparison_that_was_ended_goes_on_with_the_model_that_it_was_at(
    recorded: xr.Dataset,
) -> None:
    kept = MemoryStore()
    fingerprints: list[dict[str, Any]] = []

    def stores(name: str, fingerprint: dict[str, Any]) -> MemoryStore:
        assert name == "models"
        fingerprints.append(fingerprint)
        return kept

    def ended(done: int, total: int, text: str) -> None:
        if text == "inertial" and done:
            raise Interrupted

    models = ["active", "inertial"]
    with pytest.raises(SweepError) as error:
        compare_models(
            recorded,
            models,
            study=DISTANCES,
            threads=1,
            budget=SMALL,
            stores=stores,
            tell=ended,
        )
    assert isinstance(error.value.__cause__, Interrupted)
    seen: list[str] = []
    again = compare_models(
        recorded,
        models,
        study=DISTANCES,
        budget=SMALL,
        stores=stores,
        tell=lambda *said: seen.append(said[2]),
    )
    assert "active" not in seen
    assert fingerprints[0] == fingerprints[1]
    xr.testing.assert_identical(
        again, compare_models(recorded, models, study=DISTANCES, budget=SMALL)
    )


@pytest.mark.slow
def test_models_searched_at_the_same_time_that_were_ended_go_on(recorded: xr.Dataset) -> None:
    kept = Counted()
    models = ["run_tumble", "active", "inertial"]
    under_way: set[str] = set()

    def ended(_done: int, _total: int, text: str) -> None:
        under_way.add(text)
        if kept.written:
            raise Interrupted

    def compared(tell: Any = None) -> xr.Dataset:
        return compare_models(
            recorded, models, study=DISTANCES, threads=2, budget=SMALL, tell=tell,
            stores=lambda *_: kept,
        )  # fmt: skip

    with pytest.raises(SweepError):
        compared(ended)
    assert any(", " in text for text in under_way)
    before = kept.written
    assert 0 < before < 5
    again = compared()
    assert kept.written == 5
    xr.testing.assert_identical(
        again, compare_models(recorded, models, study=DISTANCES, threads=1, budget=SMALL)
    )


@pytest.mark.slow
def test_a_users_own_model_is_asked_by_one_thread_alone(recorded: xr.Dataset) -> None:
    seen: set[str] = set()

    def jitter(scene: Any, *, step: Any) -> tuple[Any, Any]:
        seen.add(threading.current_thread().name)
        steps = step * scene.random.normal(scene.times.size, 2)
        walk = np.cumsum(steps, axis=1)
        return scene.start.x[:, None] + walk[..., 0], scene.start.y[:, None] + walk[..., 1]

    own = dw.motion_model(jitter, step=Parameter("step", "m", 1e-4, 1e-2, scale="log"))
    compare_models(recorded, ["inertial", "active", own], study=DISTANCES, budget=SMALL, threads=2)
    assert seen == {threading.current_thread().name}


def test_a_users_own_model_that_fails_is_not_waited_for(recorded: xr.Dataset) -> None:
    kept = Counted()

    def broken(scene: Any, *, step: Any) -> tuple[Any, Any]:
        raise ValueError("no such motor")

    own = dw.motion_model(broken, step=(0.1, 1.0, "m"))
    with pytest.raises((InputError, SweepError), match="no such motor"):
        compare_models(
            recorded, ["inertial", own], study=DISTANCES, budget=SMALL, threads=2,
            stores=lambda *_: kept,
        )  # fmt: skip
    assert kept.written == 0


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let every model be asked, and simulate little for it."""
    every = model_evidence.EVIDENCE._replace(tied_sigmas=1e6)
    monkeypatch.setattr(model_evidence, "EVIDENCE", every)
    wide = regression_abc.REGRESSION._replace(simulations=64, most_rounds=2)
    monkeypatch.setattr(regression_abc, "REGRESSION", wide)
    narrow = gauss_newton.GAUSS_NEWTON._replace(fewest_simulations=(128, 128), most_rounds=2)
    monkeypatch.setattr(gauss_newton, "GAUSS_NEWTON", narrow)
    fewer = synthetic_likelihood.SYNTHETIC._replace(simulations=256)
    monkeypatch.setattr(synthetic_likelihood, "SYNTHETIC", fewer)


def with_summaries(recorded: xr.Dataset, **options: Any) -> xr.Dataset:
    study = dw.apply_overrides(dw.Study(), {"calibration.bootstrap": 8})
    models = ["inertial", "run_tumble"]
    return compare_models(recorded, models, study=study, budget=SMALL, **options)


@pytest.mark.slow
@pytest.mark.usefixtures("asked")
def test_summaries_are_matched_and_kept(recorded: xr.Dataset) -> None:
    kept: dict[str, Counted] = {}
    said: list[tuple[int, int, str]] = []

    def stores(name: str, _: dict[str, Any]) -> Counted:
        return kept.setdefault(name, Counted())

    found = with_summaries(recorded, stores=stores, tell=lambda *all_of: said.append(all_of))
    check_dataset(found)
    assert found["asked"].values.tolist() == (~found["baseline"].values.astype(bool)).tolist()
    assert (np.isfinite(found["discrepancy"].values) == found["asked"].values).all()
    done, most = np.array([one[:2] for one in said]).T
    assert (np.diff(done) >= 0).all()
    assert len(set(most)) == 1
    assert done[-1] == most[0]
    # No model is searched again, and the summaries are read, not simulated.
    written = {name: one.written for name, one in kept.items()}
    assert set(written) == {"models", "summaries-0", "summaries-1"}
    said.clear()
    again = with_summaries(recorded, stores=stores, tell=lambda *all_of: said.append(all_of))
    xr.testing.assert_identical(found, again)
    assert {text.partition(" of ")[0] for *_, text in said} == {"summaries", "figures"}
    assert written == {name: one.written for name, one in kept.items()}
    with single_threaded_processes(2) as executor:
        there = with_summaries(recorded, executor=executor)
    xr.testing.assert_identical(found, there)


def test_mistakes_are_said(recorded: xr.Dataset) -> None:
    with pytest.raises(ConfigurationError, match="given twice: active"):
        check_models(recorded, ["active", "inertial", "active"])
    with pytest.raises(ConfigurationError, match="no motion model is given"):
        check_models(recorded, [])
    with pytest.raises(ConfigurationError, match="run_tumbel"):
        check_models(recorded, ["run_tumbel"])
    still = recorded.copy(deep=True)
    still["x"][:] = still["y"][:] = 0.0
    with pytest.raises(InputError):
        check_models(still, ["active"])
    with pytest.raises(InputError, match="fewer than 30 steps with a direction"):
        check_models(recorded.isel(time=slice(0, 40)), ["active"])
    with pytest.raises(InputError, match="at least 3"):
        check_models(recorded.isel(time=slice(0, 2)), ["active"])


@pytest.mark.slow
def test_a_block_without_a_flow_is_left_out_with_its_reason(recorded: xr.Dataset) -> None:
    study = dw.apply_overrides(dw.Study(), {"flow.min_count": 5000, "calibration.bootstrap": 0})
    found = compare_models(recorded, ["block", "inertial"], study=study, budget=SMALL)
    assert "block" not in found["model"].values
    assert any("the block is left out" in str(text) for text in found["warning"].values)


@pytest.mark.slow
def test_a_model_that_feels_others_is_left_out_where_there_are_none(recorded: xr.Dataset) -> None:
    found = compare_models(
        recorded, ["active+neighbours", "inertial"], study=DISTANCES, budget=SMALL
    )
    assert "active+neighbours" not in found["model"].values
    said = [str(text) for text in found["warning"].values]
    assert any(text.startswith("active+neighbours is left out: the model") for text in said)
