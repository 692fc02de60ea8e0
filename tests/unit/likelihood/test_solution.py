"""Recordings that the likelihood fit or its check cannot deal with: said in one sentence."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr
from fit_worlds import coarse_study, recording

import driftwalk as dw
from driftwalk.core.errors import InputError
from driftwalk.likelihood.check.errors import used_pairs
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.interval_inflation import parameter_facts
from driftwalk.likelihood.refuse import (
    cholesky,
    reason_of_no_solution,
    require_noise_below_motion,
    solved,
)
from driftwalk.model import Study, apply_overrides
from driftwalk.schema import Track, build_trajectory
from driftwalk.schema.answers.facts import facts_of

BLOCK = 2048
"""The check keeps the derivatives of so many samples at a time."""


def trajectory(time: np.ndarray, x: np.ndarray, y: np.ndarray) -> xr.Dataset:
    return build_trajectory(time, x[:, None], y[:, None], None, body=["0"], attrs={})


@pytest.mark.parametrize("size", [1, 2, 3, 8, 20, 21, 50])
def test_pairs_at_every_lag_by_brute_force(size: int) -> None:
    used = np.random.default_rng(size).random(size) < 0.7
    found = {lag: int(both.sum()) for lag, both in used_pairs(used, 20)}
    wanted = {
        lag: sum(bool(used[k] and used[k + lag]) for k in range(size - lag))
        for lag in range(21)
        if lag < size
    }
    assert found == wanted


@pytest.mark.slow
@pytest.mark.parametrize("left_over", [3, 8])
def test_a_last_part_shorter_than_the_lags_is_checked(left_over: int) -> None:
    """A tadpole's recording ended so: its last part had 8 samples, the check looks at 20 lags."""
    track = recording(600.0).isel(time=slice(0, BLOCK + left_over))
    check = dw.check_model(dw.fit_motion(track, coarse_study()), track)
    assert check["verdict"] == "explains"
    assert check.attrs["samples"] == BLOCK + left_over


@pytest.mark.slow
def test_too_few_used_intervals_are_no_check() -> None:
    track = recording(20.0)
    fit = dw.fit_motion(track, coarse_study())
    # Two thirds of the positions are jumps now: the filter of that fit takes none of them.
    jumps = np.arange(track.sizes["time"]) % 3 != 0
    broken = track.copy(deep=True)
    broken["x"].values[jumps] += 0.05
    with pytest.raises(InputError, match=r"cannot be checked: the fit used \d+ of 200 intervals"):
        dw.check_model(fit, broken)


@pytest.mark.slow
def test_few_used_intervals_are_a_warning() -> None:
    generator = np.random.default_rng(1)
    # A body that rests, but for a jump of some millimetres in every eighth interval.
    spread = np.where(np.arange(400) % 8 == 0, 5e-3, 1e-6)[:, None]
    x, y = np.clip(np.cumsum(spread * generator.normal(size=(400, 2)), axis=0), -0.1, 0.1).T
    fit = dw.fit_motion(trajectory(0.1 * np.arange(400), x, y), coarse_study())
    used, usable = facts_of(fit)["samples_used"], facts_of(fit)["intervals_usable"]
    assert used < 0.9 * usable
    wanted = f"the fit used {used} of {usable} intervals only"
    assert any(wanted in text for text in facts_of(fit)["warnings"])


def test_a_body_that_jumps_once_is_at_rest() -> None:
    time = 0.1 * np.arange(20_000)
    x = np.where(time < 1000.0, -0.05, 0.05)
    with pytest.raises(InputError, match="the body rests in 99 % of the recording"):
        dw.fit_motion(trajectory(time, x, 0.0 * x), coarse_study())


def test_a_search_that_runs_away_is_an_error_for_people() -> None:
    for error in (np.linalg.LinAlgError("803-th minor"), OverflowError("math range error")):
        with pytest.raises(InputError, match="has no solution") as caught, solved("why"):
            raise error
        assert str(error) not in str(caught.value)
    with pytest.raises(np.linalg.LinAlgError):
        cholesky(np.array([[np.nan, 0.0], [0.0, 1.0]]))


def along_a_line(length: float) -> Track:
    return Track(0.1 * np.arange(99), np.linspace(0.0, length, 99), np.zeros(99), np.full(99, 0.0))


def test_the_reason_of_no_solution_is_named() -> None:
    wide = [along_a_line(0.1)]
    for share, said in ((0.97, "97 % of the intervals are at the wall"), (0.3, "at all, or the")):
        reason = reason_of_no_solution(share, wide, Study())
        with pytest.raises(InputError, match=said), solved(reason):
            raise np.linalg.LinAlgError
    # A standard deviation is the length of the line over the root of 12.
    reason = reason_of_no_solution(0.0, [along_a_line(0.02)], Study())
    assert reason.startswith("the block stays in one place (its positions scatter by 5.8 mm")
    with pytest.raises(InputError, match=r"scatter by 29.2 mm\); because"):
        require_noise_below_motion(0.1, wide, "because")


def test_a_fit_that_breaks_down_at_the_wall_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    def breaks(*_: object) -> None:
        raise np.linalg.LinAlgError

    monkeypatch.setattr("driftwalk.likelihood.fit.LawSearch.find", breaks)
    track = recording(60.0)
    # In this tank a block of 3 cm touches the wall from most of the places of the recording.
    reach = float(np.hypot(track["x"], track["y"]).max())
    narrow = apply_overrides(coarse_study(), {"tank.diameter_m": 2.0 * reach + 0.002})
    with pytest.raises(
        InputError, match=r"\d % of the intervals are at the wall and were left out"
    ):
        dw.fit_motion(track, narrow)


def test_motion_that_is_all_noise_is_no_solution() -> None:
    time = 0.1 * np.arange(200)
    track = Track(time, 0.02 * np.sin(time), 0.0 * time, np.full(200, np.nan))
    require_noise_below_motion(0.01, [track], "")
    with pytest.raises(InputError, match=r"noise \(174 mm, while the positions scatter by 14"):
        require_noise_below_motion(0.174, [track], "")


@pytest.mark.slow
def test_an_interval_without_an_end_is_infinite() -> None:
    track = recording(60.0)
    fit = dw.fit_motion(track, coarse_study())

    point = Point(np.zeros((2, 4, 4)), log_drag=0.0, log_intensity=-700.0, log_noise=-8.0)
    attrs = parameter_facts(point, np.diag([0.01, 1e6, 0.01]), coarse_study())
    assert attrs["force_std_N_interval"][1] == np.inf
    assert 0.0 <= attrs["force_std_N_interval"][0] < attrs["force_std_N"]
    assert np.isfinite(facts_of(fit)["force_std_N_interval"]).all()


def test_a_fitted_arena_that_excludes_its_own_positions_is_an_error() -> None:
    """A tracer in a vessel: the fitted tank was 8 mm across, and every position at its wall."""
    generator = np.random.default_rng(3)
    x, y = np.cumsum(2e-5 * generator.normal(size=(2, 600)), axis=1)
    track = trajectory(0.1 * np.arange(600), x, y)
    found = {"by": "fit", "radius_is": "lower bound of the tank"}
    arena = {"shape": "circle", "diameter_m": 0.008}
    track = track.assign_attrs(arena=json.dumps(arena), arena_found=json.dumps(found))
    study = apply_overrides(Study(), {"tank.diameter_m": 0.008, "block.side_m": 0.005})
    with pytest.raises(
        InputError, match=r"`tank=\"fit\"` found a tank 8 mm across, in which a block"
    ):
        dw.fit_motion(track, study)
    # A beetle in a dish, taken for the block of the paper.
    seconds = track["time"].values
    walk = trajectory(seconds, 0.006 * np.cos(0.3 * seconds), 0.006 * np.sin(0.3 * seconds))
    dish = walk.assign_attrs(
        arena_found=json.dumps(found), arena=json.dumps({"shape": "circle", "diameter_m": 0.05})
    )
    assumed = apply_overrides(Study(), {"tank.diameter_m": 0.05})
    with pytest.raises(InputError, match=r"30 mm is .* the side was not stated.*`block.side_m`"):
        dw.fit_motion(dish, assumed)
    # The same tank, stated: what it leaves is the subject then.
    with pytest.raises(InputError, match="all 599 intervals are at the wall of the tank"):
        dw.fit_motion(track.drop_attrs(), study)
