"""The other bodies of a recording: where they are, who counts, and how they are read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import driftwalk as dw
from driftwalk.calibration import check_models
from driftwalk.conditions import Neighbours, neighbours_of, read_recordings
from driftwalk.core.errors import InputError
from driftwalk.model import Tank
from driftwalk.motion import feels_others, motion_model
from driftwalk.schema import Track, body_track, build_trajectory

VALUES = {
    "speed": 0.05,
    "rotational_diffusion": 0.5,
    "turn_rate": 0.0,
    "neighbour_push": 2.0,
    "neighbour_range": 0.03,
}


def track(time: np.ndarray, x: np.ndarray) -> Track:
    return Track(time, x, 2.0 * x, np.full(time.size, np.nan))


def test_places_are_on_straight_lines_between_samples():
    time = np.array([2.0, 2.1, 2.2, 2.4])
    found = Neighbours((track(time, time**2),)).at([2.05, 2.2, 2.3])
    x = np.array([(4.0 + 2.1**2) / 2, 2.2**2, (2.2**2 + 2.4**2) / 2])
    np.testing.assert_allclose(found[:, 0, 0], x, rtol=1e-12)
    np.testing.assert_allclose(found[:, 0, 1], 2 * x, rtol=1e-12)


def test_nobody_knows_where_a_body_is_in_a_long_gap_or_outside_its_samples():
    # Six intervals of 0.1 s without a sample; four are bridged.
    time = np.concatenate([np.arange(0.0, 1.01, 0.1), [1.4, 1.5, 2.1, 2.2]])
    found = Neighbours((track(time, time),)).at([-0.01, 0.0, 1.2, 1.55, 2.05, 2.15, 2.2, 2.21])
    there = np.isfinite(found[:, 0, 0])
    assert there.tolist() == [False, True, True, False, False, True, True, False]


def test_since_moves_the_clock():
    others = Neighbours((track(np.arange(5.0), np.arange(5.0)),))
    np.testing.assert_array_equal(others.since(1.5).at([0.0]), others.at([1.5]))


@pytest.fixture
def recording():
    """Return a body, one beside it that begins later, and one in another tank."""
    time = np.arange(60) * 0.1
    wave = 0.02 * np.sin(time)
    x = np.column_stack([wave, wave + 0.05, wave + 0.6])
    x[:20, 1] = np.nan
    return build_trajectory(time + 3.0, x, 0.1 * x, body=["a", "b", "c"], attrs={})


TANKS = {
    "circle": Tank(diameter_m=0.3),
    "rectangle": Tank(shape="rectangle", width_m=0.3, height_m=0.2),
}


@pytest.mark.parametrize("shape", TANKS)
def test_who_is_in_another_tank_is_no_neighbour(recording, shape):
    found = neighbours_of(recording, "a", TANKS[shape])
    assert found is not None
    assert len(found.tracks) == 1
    np.testing.assert_array_equal(found.tracks[0].x, body_track(recording, "b").x)
    assert neighbours_of(recording[["x", "y", "theta"]].isel(body=[0]), "a", TANKS[shape]) is None
    assert neighbours_of(recording.isel(body=[0, 2]), "a", TANKS[shape]) is None
    assert neighbours_of(recording.assign_attrs(bodies_apart="yes"), "a", TANKS[shape]) is None


def test_a_body_that_begins_later_keeps_its_time(recording):
    study = dw.apply_overrides(dw.Study(), {"simulation.replicates": 1})
    model = motion_model("active+neighbours", **VALUES, clearance=0.0)
    alone = motion_model(
        "active", **{key: VALUES[key] for key in ("speed", "rotational_diffusion", "turn_rate")}
    )
    with_b, without = (
        dw.motion.simulate_motion(one, {}, study, like=recording, body="a")
        for one in (model, alone)
    )
    apart = np.abs(with_b["x"] - without["x"]).values[0, :, 0]
    # b is there from 2.0 s on.
    assert apart[:21].max() < 1e-9
    assert apart[-1] > 1e-3


def test_a_name_says_whether_the_model_feels_others():
    assert feels_others("run-rest+neighbours")
    assert feels_others(motion_model("active+neighbours"))
    assert not feels_others("active+wall")
    assert not feels_others("neighbours.py:make")
    assert not feels_others(None)


def test_without_others_the_model_is_refused():
    alone = dw.tank30_recording().isel(time=slice(0, 2000))
    with pytest.raises(InputError, match="feels the other bodies of a recording, and there are"):
        check_models(alone, ["active+neighbours"])


def test_all_bodies_are_read_in_the_arena_of_the_named_one(tmp_path: Path):
    path = tmp_path / "two.csv"
    time = np.arange(200) * 0.1
    rows = ["t,x,y,body"]
    for name, shift in (("a", 0.5), ("b", 0.6)):
        x, y = shift + 0.1 * np.cos(time), 0.2 + 0.1 * np.sin(time)
        rows += [f"{t},{p},{q},{name}" for t, p, q in zip(time, x, y, strict=True)]
    path.write_text("\n".join(rows))
    given = {"body": "a", "tank": "fit"}
    named = read_recordings([path], dw.Study(), given, body="a").trajectories[0]
    every = read_recordings([path], dw.Study(), given, body="a", bodies="all")
    both = every.trajectories[0]
    assert every.body == "a"
    assert both["body"].values.tolist() == ["a", "b"]
    assert both.attrs["arena"] == named.attrs["arena"]
    for one, other in zip(body_track(both, "a"), body_track(named, "a"), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)
    np.testing.assert_allclose(body_track(both, "b").x - body_track(both, "a").x, 0.1, atol=1e-9)
