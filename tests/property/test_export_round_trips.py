"""What is exported and read again is the same recording, to the last digit of a double."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hypothesis import assume, given, settings, strategies as st

from driftwalk.export.data.motion import Motion, frame_numbers, frame_rate
from driftwalk.export.data.writers import particle_numbers, write_csv, write_movement, write_trackpy
from driftwalk.record import load
from driftwalk.schema import body_names, body_track, build_trajectory

ARENA = json.dumps({"shape": "rectangle", "width_m": 0.3, "height_m": 0.2, "center_m": [0.0, 0.0]})
# A position below 1e-25 is refused as no camera sees it.
POSITIONS = st.floats(-50.0, 50.0).map(lambda at: at if abs(at) > 1e-20 else 0.0)
ANGLES = st.floats(-3.2, 3.2)
NAMES = st.text(alphabet="abXY019 ,;é'", min_size=1, max_size=6).filter(
    lambda name: name == name.strip() and not name.isdecimal()
)


@st.composite
def recordings(draw: st.DrawFn) -> xr.Dataset:
    """Draw some bodies with gaps, with or without orientation, on an even or an uneven clock."""
    samples, bodies = draw(st.integers(2, 9)), draw(st.integers(1, 3))
    if draw(st.booleans()):
        rate = draw(st.sampled_from([25.0, 29.97, 100.0, 1000.0 / 7.0, 1.0 / 3.0]))
        steps = draw(st.lists(st.integers(1, 4), min_size=samples, max_size=samples))
        time = draw(st.floats(-5.0, 5000.0)) + np.cumsum(steps) / rate
    else:
        steps_s = draw(st.lists(st.floats(1e-3, 5.0), min_size=samples, max_size=samples))
        time = np.cumsum(steps_s)
    shape = (samples, bodies)

    def column(values: st.SearchStrategy[float]) -> np.ndarray:
        listed = draw(st.lists(values, min_size=samples * bodies, max_size=samples * bodies))
        return np.array(listed).reshape(shape)

    seen = column(st.sampled_from([1.0, 1.0, 1.0, np.nan]))
    # A table in which every body has one row says nothing of how the rows belong together.
    assume((np.isfinite(seen).sum(axis=0) > 1).any())
    x, y = column(POSITIONS) * seen, column(POSITIONS) * seen
    theta = column(st.one_of(ANGLES, st.just(np.nan))) if draw(st.booleans()) else None
    numbered = st.lists(st.integers(0, 10**12).map(str), min_size=bodies, max_size=bodies)
    named = st.lists(NAMES, min_size=bodies, max_size=bodies)
    names = draw(st.one_of(numbered, named).filter(lambda found: len(set(found)) == bodies))
    return build_trajectory(time, x, y, theta, body=names, attrs={"arena": ARENA})


def assert_same_tracks(
    back: xr.Dataset, recording: xr.Dataset, names: dict[str, str] | None = None
) -> None:
    """Compare every sample that is present, bit for bit."""
    seen = [name for name in body_names(recording) if body_track(recording, name).time.size]
    renamed = names or {name: name for name in seen}
    assert sorted(body_names(back)) == sorted(renamed[name] for name in seen)
    for name in seen:
        found = body_track(back, renamed[name])
        for one, other in zip(found, body_track(recording, name), strict=True):
            np.testing.assert_array_equal(one, other)


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(recordings())
def test_csv(recording: xr.Dataset) -> None:
    with tempfile.TemporaryDirectory() as folder:
        (file,) = write_csv(Motion("a", recording), Path(folder))
        back = load(file)
    seen = set(body_names(back))
    # A time at which nothing is seen has a row without a position, of the first body.
    empty = ~np.isfinite(recording["x"].values).any(axis=1)
    first = body_names(recording)[0]
    if empty.any() and not body_track(recording, first).time.size:
        back = back.sel(body=sorted(seen - {first}))
    assert_same_tracks(back, recording)
    np.testing.assert_array_equal(back["time"].values, recording["time"].values)


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(recordings())
def test_trackpy(recording: xr.Dataset) -> None:
    with tempfile.TemporaryDirectory() as folder:
        (file,) = write_trackpy(Motion("a", recording), Path(folder))
        back = load(file)
    numbers = map(str, particle_numbers(recording).tolist())
    assert_same_tracks(back, recording, dict(zip(body_names(recording), numbers, strict=True)))


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(recordings())
def test_movement_holds_everything(recording: xr.Dataset) -> None:
    with tempfile.TemporaryDirectory() as folder:
        (file,) = write_movement(Motion("a", recording), Path(folder))
        back = load(file)
    assert body_names(back) == body_names(recording)
    for name in ("time", "x", "y", "theta"):
        np.testing.assert_array_equal(back[name].values, recording[name].values)
    assert json.loads(back.attrs["arena"]) == json.loads(ARENA)


@pytest.mark.slow
@given(
    st.floats(0.5, 500.0),
    st.lists(st.integers(1, 50), min_size=1, max_size=30),
    st.floats(-1000.0, 1000.0),
)
def test_frames_of_an_even_clock_are_found_again(
    rate: float, steps: list[int], start: float
) -> None:
    """Whatever frames are missing, as long as two neighbours are there."""
    frames = np.concatenate([[0], np.cumsum([1, *steps])])
    time = start + frames / rate
    found = build_trajectory(time, 0.0 * time, 0.0 * time)
    assert abs(frame_rate(found) / rate - 1.0) < 1e-3
    np.testing.assert_array_equal(frame_numbers(found), frames)


@pytest.mark.slow
@given(st.lists(st.floats(0.3, 0.7), min_size=3, max_size=20))
def test_an_uneven_clock_has_no_rate_that_was_not_there(jitter: list[float]) -> None:
    """Times that are off by up to half a frame are no frames unless all happen to be near one."""
    time = np.cumsum(np.asarray(jitter) + 0.5)
    found = build_trajectory(time, 0.0 * time, 0.0 * time)
    rate = frame_rate(found)
    if rate is None:
        np.testing.assert_array_equal(frame_numbers(found), np.arange(time.size))
    else:
        ticks = (time - time[0]) * rate
        assert (np.abs(ticks - np.rint(ticks)) <= 0.25).all()
