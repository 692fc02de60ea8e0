"""Steps that no body makes are counted and warned of; bodies that are fast are left alone."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from driftwalk.conditions import jump_warnings
from driftwalk.record import load

Table = dict[str, Any]


def cups(number: int = 180, *, seed: int = 1) -> Table:
    """Return objects that float down a flume one after the other, in a table as of one body."""
    random = np.random.default_rng(seed)
    x, y = [], []
    for _ in range(number):
        samples = int(random.integers(20, 40))
        across = random.uniform(0.0, 0.1) + np.cumsum(random.normal(0.0, 3e-4, samples))
        x.append(np.linspace(0.0, random.uniform(0.25, 0.36), samples))
        y.append(across)
    columns = np.concatenate(x), np.concatenate(y)
    return {"t": np.arange(columns[0].size) / 25.0, "x_m": columns[0], "y_m": columns[1]}


def dart(every: int) -> Table:
    """Return a fish that rests and darts: a burst of 0.9 m/s that the water slows down."""
    random = np.random.default_rng(3)
    place, heading, places = np.zeros(2), 0.0, []
    for _ in range(60):
        heading += random.normal(0.0, 1.5)
        speed = np.append(np.zeros(25), 0.9 * np.exp(-np.arange(25) / 4.0))
        for one in speed:
            ahead = place + one / 30.0 * np.array([np.cos(heading), np.sin(heading)])
            if np.hypot(*ahead) > 0.3:
                heading += np.pi / 2.0
            else:
                place = ahead
            places.append(place)
    seen = (np.array(places) + random.normal(0.0, 2e-4, (len(places), 2)))[::every]
    return {"t": np.arange(len(seen)) * every / 30.0, "x_m": seen[:, 0], "y_m": seen[:, 1]}


def found(table: Any, **how: Any) -> tuple[int, list[str]]:
    counts = json.loads(load(table, **how).attrs["counts"])
    per_body = sum(one["impossible_steps"] for one in counts["per_body"].values())
    assert counts["impossible_steps"] == per_body
    return per_body, [text for text in counts["warnings"] if " jumps " in text]


def test_objects_one_after_the_other_are_no_single_body() -> None:
    table = cups()
    number, (warning,) = found(table)
    assert number == 179
    assert "jumps 179 times" in warning
    assert "several bodies?" in warning
    assert "`max_speed=" in warning
    assert jump_warnings(load(table)) == [warning]


def test_the_speed_that_is_advised_lies_between_both_kinds_of_step() -> None:
    table = cups(30)
    _, (warning,) = found(table)
    advised = float(warning.split("`max_speed=")[1].split("`")[0])
    length = np.hypot(np.diff(table["x_m"]), np.diff(table["y_m"])) * 25.0
    jumps = length > 3.0
    assert jumps.sum() == 29
    assert length[~jumps].max() < advised < length[jumps].min()


def test_one_slip_of_a_tracker_there_and_back_is_two_steps() -> None:
    time = np.arange(500) / 30.0
    x, y = 0.1 * np.cos(time), 0.1 * np.sin(time)
    assert found({"t": time, "x_m": x, "y_m": y}) == (0, [])
    x[200:202] += 0.2
    assert found({"t": time, "x_m": x, "y_m": y})[0] == 2
    assert found({"t": time, "x_m": x, "y_m": y}, max_speed=1.0) == (0, [])


def test_the_way_over_a_gap_is_no_jump() -> None:
    time = np.arange(500) / 30.0
    x = 0.01 * np.sin(time)
    x[250:] += 0.3
    time[250:] += 2.0
    assert found({"t": time, "x_m": x, "y_m": 0.0 * x}) == (0, [])


@pytest.mark.parametrize("every", [1, 2, 3, 5, 10])
def test_a_fish_that_darts_is_one_body(every: int) -> None:
    assert found(dart(every)) == (0, [])


@pytest.mark.parametrize("seed", range(3))
def test_a_body_that_is_seen_too_seldom_to_be_followed_is_left_alone(seed: int) -> None:
    x, y = np.random.default_rng(seed).uniform(-0.15, 0.15, (2, 5000))
    assert found({"t": np.arange(5000.0), "x_m": x, "y_m": y}) == (0, [])


def test_a_body_at_rest_beside_one_that_moves_does_not_jump() -> None:
    random = np.random.default_rng(2)
    time = np.tile(np.arange(1000) / 30.0, 2)
    round_ = 0.15 * np.exp(1j * time[:1000])
    still = 1e-5 * random.normal(size=1000) + np.where(random.random(1000) < 0.01, 1e-3, 0.0)
    table = {
        "t": time,
        "x_m": np.append(round_.real, still),
        "y_m": np.append(round_.imag, 0.0 * still),
        "id": np.repeat([1, 2], 1000),
    }
    assert found(table) == (0, [])


@pytest.mark.parametrize(
    ("file", "how"),
    [
        ("tracktor-mouse-termite/flume_video_tracked.csv", {"frame_rate": 30.0}),
        ("tracktor-mouse-termite/mouse_video_tracked.csv", {"frame_rate": 30.0}),
        ("tracktor-mouse-termite/termite_video_tracked.csv", {"frame_rate": 60.0}),
        ("format-optitrack/1blackTake 2024-04-10 03.24.49 PM.csv", {}),
        ("format-vicon/QBii_Square_2m_cw.csv", {}),
        ("trajr-walks/3537.csv", {"metres_per_pixel": 1e-3}),
    ],
)
def test_recordings_of_others_without_a_fault_are_not_warned_of(
    file: str, how: dict[str, Any], shared_data: Callable[[str], Path]
) -> None:
    if "tracktor" in file:
        how = {**how, "metres_per_pixel": 1e-3}
    folder, name = file.split("/")
    assert found(shared_data(folder) / name, **how) == (0, [])


def test_the_slips_of_a_tracker_in_a_recording_of_others(
    shared_data: Callable[[str], Path],
) -> None:
    path = shared_data("hexbug-gatech") / "training_video1-centroid_data"
    assert found(path, metres_per_pixel=1e-3, frame_rate=30.0)[0] == 6
