"""A calibration of many parameters as a whole, on simulated recordings of real models.

The quick tests make every stage with few simulations: their answers are coarse, but must not depend
on threads, interruptions or chance. The slow ones make them as they are made for users.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from few_simulations import simulate_little
from self_propelled import moving

import driftwalk as dw
from driftwalk.calibration.estimation import estimate as matching, run
from driftwalk.calibration.estimation.estimate import MATCHING
from driftwalk.calibration.evolution import Budget
from driftwalk.calibration.run import calibrate
from driftwalk.sweep import ShardStore

ACTIVE = {"speed": 0.03, "rotational_diffusion": 0.8, "turn_rate": 0.3}
RESTING = {
    "speed": 0.04, "speed_cv": 0.2, "run_time": 1.0, "run_time_cv": 0.5, "rest_time": 1.0,
    "rest_time_cv": 0.5, "turn_std": 1.0, "rotational_diffusion": 0.1,
}  # fmt: skip
NOISE = 2e-4
SHORT_SEARCH = Budget(design=64, starts=1, short=8, long=8)


@pytest.fixture(scope="module")
def recording() -> xr.Dataset:
    return moving(dw.motion_model("active"), ACTIVE, 60.0, seed=3, noise=NOISE)


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let every stage simulate little."""
    simulate_little(monkeypatch)


def study(*, bootstrap: int = 10, seed: int = 1) -> dw.Study:
    return dw.apply_overrides(
        dw.Study(),
        {
            "calibration.bootstrap": bootstrap,
            "calibration.seed": seed,
            "observation.position_noise_m": NOISE,
        },
    )


def calibrated(recording: xr.Dataset, model: str = "active", **options: Any) -> xr.Dataset:
    chosen = options.pop("study", study())
    options.setdefault("threads", 1)
    return calibrate(recording, dw.motion_model(model), study=chosen, **options)


@pytest.mark.slow
@pytest.mark.usefixtures("few")
def test_neither_threads_nor_repetition_change_anything(recording: xr.Dataset) -> None:
    first = calibrated(recording)
    assert "posterior_sample" in first
    xr.testing.assert_identical(first, calibrated(recording, threads=2))


class Interrupted(Exception):
    pass


@pytest.mark.slow
@pytest.mark.usefixtures("few")
def test_an_interrupted_calibration_goes_on_where_it_was(tmp_path: Path) -> None:
    """A recording of another model needs both stages; each is interrupted once."""
    resting = moving(dw.motion_model("run_rest"), RESTING, 60.0, seed=5, noise=NOISE)
    whole = calibrated(resting, "inertial")

    def stores(name: str, fingerprint: dict[str, Any]) -> ShardStore:
        return ShardStore(tmp_path / name, fingerprint=fingerprint)

    kept = []
    for stage in ("summaries", "search"):
        told: list[str] = []

        def stop(name: str, done: int, most: int, stage: str = stage) -> None:
            told.append(name)  # noqa: B023
            assert done <= most
            if told.count(stage) == 5:  # noqa: B023
                raise Interrupted

        with pytest.raises(Interrupted):
            calibrated(resting, "inertial", stores=stores, tell=stop)
        kept.append({path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.npz")})
    assert 1 < len(kept[0]) < len(kept[1])
    again = calibrated(resting, "inertial", stores=stores)
    xr.testing.assert_identical(again, whole)
    # What had been finished was not made a second time.
    for path, written in {**kept[0], **kept[1]}.items():
        assert path.stat().st_mtime_ns == written


@pytest.mark.usefixtures("few")
def test_without_a_bootstrap_there_is_one_stage(recording: xr.Dataset) -> None:
    told: list[str] = []
    found = calibrated(
        recording, study=study(bootstrap=0), tell=lambda stage, _done, _most: told.append(stage)
    )
    assert list(dict.fromkeys(told)) == ["search", "judged"]
    assert found.attrs["estimate_from"] == "search"
    assert np.isnan(found["interval"]).all()
    assert np.isnan(found["half_width"]).all()
    assert not found["determined"].any()
    assert "posterior_sample" not in found
    np.testing.assert_array_equal(found["estimate"], found["searched_estimate"])


@pytest.mark.slow
def test_a_model_that_ignores_its_parameters_is_refused() -> None:
    """Without noise of the camera nothing varies at all."""

    def straight(
        scene: dw.motion.Scene, speed: float, first: float, second: float
    ) -> tuple[np.ndarray, np.ndarray]:
        way = np.tile(0.001 * np.sin(scene.times), (scene.worlds, 1))
        return scene.start.x[:, None] + way, scene.start.y[:, None] + 0.0 * way

    model = dw.motion_model(
        straight, speed=(0.01, 0.1, "m/s"), first=(0.0, 1.0, "1/s"), second=(0.0, 1.0, "1/s")
    )
    recording = moving(dw.motion_model("active"), ACTIVE, 60.0, seed=3)
    chosen = dw.apply_overrides(study(), {"observation.position_noise_m": 0.0})
    with pytest.raises(dw.InputError, match="in the same way at all settings of its parameters"):
        calibrate(recording, model, study=chosen, threads=1)


@pytest.mark.study
def test_summaries_like_the_models_own_count_however_close_a_search_comes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """No end of a descent matches, so a search is made; no score is close enough to its own.

    In every run: summaries that count without a search, and a search that none of them follows.
    """
    strict = MATCHING._replace(matches=0.0, as_close=0.0)
    monkeypatch.setattr(matching, "MATCHING", strict)
    monkeypatch.setattr(run, "MATCHING", strict)
    monkeypatch.setattr(run, "SEARCH", SHORT_SEARCH)
    recording = moving(dw.motion_model("active"), ACTIVE, 60.0, seed=3, noise=NOISE)
    told: list[str] = []
    found = calibrated(recording, tell=lambda stage, _done, _most: told.append(stage))
    assert "search" in told
    assert "longer-search" not in told
    assert float(found["discrepancy"]) <= float(found["discrepancy_q95"])
    assert found.attrs["estimate_from"] == "summaries"
    assert bool(found.sel(parameter="speed")["determined"])


@pytest.mark.slow
def test_another_model_is_not_believed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A body without rests on the recording of one that rests half of the time."""
    monkeypatch.setattr(run, "SEARCH", SHORT_SEARCH)
    resting = moving(dw.motion_model("run_rest"), RESTING, 60.0, seed=3, noise=NOISE)
    told: list[str] = []
    found = calibrated(resting, "inertial", tell=lambda stage, _done, _most: told.append(stage))
    assert "search" in told
    assert float(found["discrepancy"]) > 3 * float(found["discrepancy_q95"])
    warnings = " ".join(found["warning"].values.tolist())
    assert float(found["discrepancy"]) > MATCHING.undetermined_above * float(
        found["discrepancy_median"]
    )
    assert not found["determined"].any()
    if found.attrs["estimate_from"] == "search":
        assert "the summaries of the motion lead to a worse fit" in warnings
    else:
        assert float(found["matched_score"]) <= MATCHING.as_close * float(found["searched_score"])
        assert float(found["interval_stretch"]) > 2.0
        assert "nothing is determined" in warnings
    assert any(
        text.startswith("summaries of the motion: discrepancy ")
        for text in found["verdict_reason"].values
    )
    assert found["verdict"] == "does not explain"
