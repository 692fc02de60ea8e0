"""Motion models compared on simulated recordings of known truth, with a small search."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
import xarray as xr
from self_propelled import moving

import driftwalk as dw
from driftwalk.calibration import check_models, compare_models
from driftwalk.calibration.evolution import Budget
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.schema.check import check_dataset
from driftwalk.sweep import MemoryStore, SweepError

SMALL = Budget(design=32, starts=1, short=6, long=6, retest=2)
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
    return compare_models(recording(240.0), ["inertial", "run_tumble"], budget=SMALL)


def test_the_true_model_is_the_closest(found: xr.Dataset) -> None:
    names = found["model"].values.tolist()
    assert set(names) == {"inertial", "run_tumble", "resampled steps", "hidden Markov walk"}
    assert names[0] == "run_tumble"
    assert str(found["finding"].values[0]).startswith("run_tumble is the closest model")


def test_it_is_what_its_schema_says(found: xr.Dataset) -> None:
    check_dataset(found)
    assert found.attrs["simulated_recording"] == "yes"


def test_models_come_from_the_closest_to_the_farthest(found: xr.Dataset) -> None:
    assert (np.diff(found["score"].values) >= 0.0).all()
    assert found["behind"].values[0] == found["behind_std"].values[0] == 0.0
    floors = (found["held_out_distance"] / found["floor"]).mean("aspect")
    # The score is a mean of ratios over worlds, the stored distances are medians.
    assert floors.values == pytest.approx(found["score"].values, rel=0.15)


def test_walks_of_recorded_steps_are_near_in_steps_and_never_explained(found: xr.Dataset) -> None:
    walks = found.isel(model=found["baseline"].values.astype(bool))
    assert not walks["explained"].values.any()
    apart, best = walks["held_out_distance"], found["held_out_distance"].isel(model=0)
    own = float(found["own_distance"].sel(aspect="steps"))
    assert float(apart.sel(model="resampled steps", aspect="steps")) < own + 0.05
    assert (apart.sel(aspect="wall") > 2.0 * best.sel(aspect="wall")).all()


def test_each_model_has_values_of_its_own_parameters_alone(found: xr.Dataset) -> None:
    for name in ("inertial", "run_tumble"):
        values = found["estimate"].sel(model=name).dropna("parameter")
        wanted = [one.name for one in dw.motion_model(name).parameters]
        assert sorted(values["parameter"].values.tolist()) == sorted(wanted)


def test_threads_do_not_change_the_answer(recorded: xr.Dataset) -> None:
    one, two = (
        compare_models(recorded, ["inertial"], budget=SMALL, threads=threads) for threads in (1, 2)
    )
    xr.testing.assert_identical(one, two)


class Interrupted(Exception):
    """Ends a comparison."""


def test_a_comparison_that_was_ended_goes_on_with_the_model_that_it_was_at(
    recorded: xr.Dataset,
) -> None:
    kept = MemoryStore()
    fingerprints: list[Mapping[str, Any]] = []

    def store(fingerprint: Mapping[str, Any]) -> MemoryStore:
        fingerprints.append(fingerprint)
        return kept

    def ended(done: int, total: int, text: str) -> None:
        if text == "inertial" and done:
            raise Interrupted

    models = ["active", "inertial"]
    with pytest.raises(SweepError) as error:
        compare_models(recorded, models, budget=SMALL, store=store, tell=ended)
    assert isinstance(error.value.__cause__, Interrupted)
    seen: list[str] = []
    again = compare_models(
        recorded, models, budget=SMALL, store=store, tell=lambda *said: seen.append(said[2])
    )
    assert "active" not in seen
    assert fingerprints[0] == fingerprints[1]
    xr.testing.assert_identical(again, compare_models(recorded, models, budget=SMALL))


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


def test_a_block_without_a_flow_is_left_out_with_its_reason(recorded: xr.Dataset) -> None:
    study = dw.apply_overrides(dw.Study(), {"flow.min_count": 5000})
    found = compare_models(recorded, ["block", "inertial"], study=study, budget=SMALL)
    assert "block" not in found["model"].values
    assert any("the block is left out" in str(text) for text in found["warning"].values)


def test_a_model_that_feels_others_is_left_out_where_there_are_none(recorded: xr.Dataset) -> None:
    found = compare_models(recorded, ["active+neighbours", "inertial"], budget=SMALL)
    assert "active+neighbours" not in found["model"].values
    said = [str(text) for text in found["warning"].values]
    assert any(text.startswith("active+neighbours is left out: the model") for text in said)
