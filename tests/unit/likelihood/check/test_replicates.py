"""Replicates of a recording: what is simulated, what a camera sees of it, and what is drawn."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

from driftwalk.comparison import plan_steps
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.core.random_streams import CheckStream
from driftwalk.flow.arena import outline_of
from driftwalk.likelihood.check import replicates as made
from driftwalk.likelihood.check.replicates import Replicated
from driftwalk.likelihood.check.restarts import Sections
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.filter.series import Series
from driftwalk.model import Study
from driftwalk.simulation import Start

STUDY = Study(tank={"diameter_m": 0.3})
POINT = Point(np.zeros((2, 1, 1)), 0.0, 0.0, 0.0)


def replicated(time: Floats, angle: str, **problem: Any) -> Replicated:
    """Return a series without restarts, of a block of 3 cm in a tank of 30 cm."""
    of: Any = SimpleNamespace(
        study=STUDY, like=SimpleNamespace(sample_time=time, **problem), **problem
    )
    outline = outline_of(STUDY.tank.to_arena())
    return Replicated(of, np.array([0]), [], plan_steps(time, step_interval=0.1), outline, angle)


def along_the_wall(time: Floats) -> tuple[Floats, Floats]:
    """Return a path that comes near the wall and goes away from it."""
    out = 0.09 + 0.05 * np.sin(0.5 * time)
    return out * np.cos(0.3 * time), out * np.sin(0.3 * time)


def steps_by_hand(x: Floats, y: Floats, left_out: np.ndarray) -> Floats:
    """Return lengths and turns of the steps whose three samples are all away from the wall."""
    place = x + 1j * y
    rows = []
    for k in range(len(x) - 2):
        if not left_out[k : k + 3].any():
            first, second = np.diff(place[k : k + 3])
            rows.append((abs(second), np.angle(second / first)))
    return np.array(rows)


@pytest.mark.parametrize(
    ("angle", "turned"), [("none", 0.0), ("none", 0.7), ("given", 0.0), ("given", math.pi / 4)]
)
def test_steps_away_from_the_wall_count(angle: str, turned: float) -> None:
    """A corner may touch it; without orientations it is the circle about the block that may.

    A square that moves towards the wall reaches 15 mm where it is flat, and 21.2 mm with a corner.
    """
    time = 0.1 * np.arange(240)
    x, y = along_the_wall(time)
    theta = np.arctan2(y, x) + turned
    found = replicated(time, angle).steps(x, y, theta)
    ahead_x, ahead_y = (
        axis[:-1] + np.concatenate([[0, 0], (axis[2:-1] - axis[:-3]) / 2.0]) for axis in (x, y)
    )
    corners = 0.03 / math.sqrt(2.0) * np.exp(1j * (math.pi / 4 + math.pi / 2 * np.arange(4)))
    turn = np.unwrap(theta)
    ahead_turn = turn[:-1] + np.concatenate([[0, 0], (turn[2:-1] - turn[:-3]) / 2.0])

    def near(x: Floats, y: Floats, theta: Floats) -> np.ndarray:
        if angle == "none":
            return np.hypot(x, y) > 0.15 - 0.03 / math.sqrt(2.0) - 0.002
        reach = np.abs((x + 1j * y)[:, None] + np.exp(1j * theta)[:, None] * corners).max(axis=1)
        return reach > 0.15 - 0.002

    interval = np.zeros(time.size, dtype=bool)
    interval[1:] = near(x[:-1], y[:-1], turn[:-1]) | near(ahead_x, ahead_y, ahead_turn)
    left_out = interval.copy()
    left_out[:-1] |= interval[1:]
    wanted = steps_by_hand(x, y, left_out)
    assert 20 < len(wanted) < 230
    np.testing.assert_allclose(found, wanted, atol=1e-9)


def part(number: float, *, sound: bool = True, path: bool = False) -> Any:
    place = (np.array([number]),) * 3 if path else None
    return made._Replicate(np.array([[number, number]]), place, sound)


def test_the_recordings_of_a_replicate_are_put_together_and_broken_ones_left_out() -> None:
    found = made._joined(
        [[part(1.0), part(2.0), part(3.0)], [part(4.0), part(5.0, sound=False), part(6.0)]]
    )
    assert found.broken == 1
    assert [one[:, 0].tolist() for one in found.steps] == [[1.0, 4.0], [3.0, 6.0]]
    assert found.paths == [[], []]
    alone = made._joined([[part(1.0, path=True), part(2.0, path=True)]])
    assert [one[:, 0].tolist() for one in alone.steps] == [[1.0], [2.0]]
    assert [[path[0][0] for path in one] for one in alone.paths] == [[1.0], [2.0]]
    assert alone.broken == 0


def test_a_marker_that_is_off_is_seen_where_it_is() -> None:
    """In the frame of the recorded angle, that of the faces and an offset."""
    theta = np.linspace(0.0, 6.0, 40)
    x, y = 0.1 * np.sin(theta), 0.05 * theta
    numbers = {"marker_x": 2e-3, "marker_y": -1e-3, "angle_offset": 0.4}
    seen = made._as_seen(x, y, theta, time=theta, point=replace(POINT, opened=numbers), key=1)
    wanted = x + 1j * y + (2e-3 - 1e-3j) * np.exp(1j * (theta + 0.4))
    np.testing.assert_allclose(seen[0] + 1j * seen[1], wanted, atol=1e-15)
    for none in (POINT, replace(POINT, opened={"angle_offset": 0.4})):
        assert made._as_seen(x, y, theta, time=theta, point=none, key=1)[0] is x


def test_a_wrong_time_is_seen_as_a_place_on_the_way() -> None:
    """Of a body at constant velocity both coordinates are late by the same time.

    4000 times have a standard deviation that is off by 0.011 of itself; five of those are allowed.
    """
    time = np.linspace(0.0, 10.0, 4000)
    late = replace(POINT, opened={"time_variance": 4e-6})
    x, y = made._as_seen(0.3 * time, -0.2 * time, 0 * time, time=time, point=late, key=3)
    off = (x - 0.3 * time) / 0.3
    np.testing.assert_allclose((y + 0.2 * time) / -0.2, off, atol=1e-12)
    assert off.std() == pytest.approx(2e-3, rel=0.056)
    other, _ = made._as_seen(0.3 * time, 0 * time, 0 * time, time=time, point=late, key=4)
    assert np.abs(np.corrcoef(other - 0.3 * time, off)[0, 1]) < 0.1


def test_the_force_in_a_flow_goes_with_the_root_of_its_intensity() -> None:
    point = replace(POINT, opened={"flow_intensity_1": math.log(9.0), "flow_intensity_2": 0.0})
    factors = [made._force_factor(point, series_in(flow)) for flow in range(3)]
    assert factors == pytest.approx([1.0, 3.0, 1.0])


def series_in(flow: int) -> Series:
    some = np.zeros(3)
    return Series(np.arange(3.0), some, some, some, some, some.astype(np.uint8), flow=flow)


def test_no_two_sections_share_their_random_numbers() -> None:
    one: Any = SimpleNamespace(first=np.arange(3))
    found = [
        made._keys(7, kind, index, one, 5)
        for kind in (CheckStream.ESTIMATE, CheckStream.DRAWN)
        for index in range(4)
    ]
    assert all(keys.shape == (5, 3) for keys in found)
    assert np.unique(found).size == 8 * 15
    assert not np.isin(made._keys(8, CheckStream.DRAWN, 0, one, 5), found).any()


NAMES = ["drag_coefficient", "intensity", "tracking_noise", "force_lever", "strength_1"]


def stored_covariance(scale: float = 1.0) -> xr.Dataset:
    """Return the covariance of a stored fit, of ln C_d, ln q, ln r, ln lever, and a strength."""
    half = np.random.default_rng(3).normal(size=(5, 12))
    found = scale * 1e-3 * half @ half.T
    coords = {"log_parameter": NAMES, "other": NAMES}
    return xr.Dataset({"covariance": (("log_parameter", "other"), found)}, coords=coords)


@pytest.mark.slow
def test_draws_have_the_spread_of_the_fit() -> None:
    """Moments of 20,000 draws, within five of their standard errors.

    ln C_d has the variance that the fit states. Of the flow the spread is that of the filter, with
    what goes along with C_d as much wider as C_d is.
    """
    check_draws(20_000)


def check_draws(count: int) -> None:
    fit = stored_covariance()
    size = 6
    spread = 1e-2 * np.random.default_rng(4).normal(size=(size + 1, size + 1))
    own = spread @ spread.T
    coefficients = np.arange(6.0).reshape(2, 1, 3)
    point = replace(POINT, coefficients=coefficients, opened={"strength_1": 0.3})
    estimate: Any = SimpleNamespace(point=point)
    points, factors = made._posterior_samples(fit, estimate, spread, count, 5)
    stated = fit["covariance"].values
    flows = np.array([one.coefficients.ravel() for one in points]) - np.arange(6.0)
    strength = np.array([one.number("strength_1") for one in points]) - 0.3
    # q goes with the square of the force.
    logs = np.log(factors) * (1.0, 2.0, 1.0)
    drawn = np.column_stack([logs, strength, flows])
    along = own[:size, size] / own[size, size]
    wanted = np.zeros((4 + size, 4 + size))
    wanted[:4, :4] = stated[np.ix_([0, 1, 2, 4], [0, 1, 2, 4])]
    wanted[4:, :4] = np.outer(along, wanted[0, :4])
    wanted[:4, 4:] = wanted[4:, :4].T
    wanted[4:, 4:] = own[:size, :size] + (stated[0, 0] - own[size, size]) * np.outer(along, along)
    found = np.cov(drawn.T)
    scale = np.sqrt(np.outer(np.diag(wanted), np.diag(wanted)))
    assert np.abs((found - wanted) / scale).max() < 5.0 * math.sqrt(2.0 / count)
    error = np.sqrt(np.diag(wanted) / count)
    assert (np.abs(drawn.mean(axis=0)) < 5.0 * error).all()


def test_draws_have_the_spread_of_the_fit_roughly() -> None:
    """The same of 2000 draws."""
    check_draws(2000)


def test_draws_of_what_is_known_to_a_factor_of_ten_are_refused() -> None:
    estimate: Any = SimpleNamespace(point=replace(POINT, opened={"strength_1": 0.0}))
    with pytest.raises(InputError, match="by more than a factor of ten"):
        made._posterior_samples(stored_covariance(1e3), estimate, np.eye(3), 10, 1)


def section(
    time: Floats, begin: list[float], sample: list[int], which: list[int], place: list[int]
) -> Sections:
    some = np.zeros(len(begin))
    start = Start(*(some + k for k in range(6)))
    return Sections(
        time, np.array(begin), start, np.array(sample), np.array(which), np.array(place),
        np.zeros((len(begin), 6, 6)),
    )  # fmt: skip


@dataclass(frozen=True)
class Conditions:
    """What `dataclasses.replace` needs of the conditions of a simulation."""

    sample_time: Floats
    flow: xr.Dataset
    start: Any = None
    flow_start: Any = None


class Coded:
    """Simulates worlds whose poses say which world and sample they are."""

    def __init__(self, broken: int = -1) -> None:
        self.asked: list[tuple[dict[str, Floats], Any, np.ndarray]] = []
        self.broken = broken

    def simulate(self, values: dict[str, Floats], like: Any, keys: np.ndarray) -> Any:
        self.asked.append((values, like, keys))
        sample = np.arange(like.sample_time.size)
        x = (100.0 * keys[:, None] + sample).astype(np.float32)
        return SimpleNamespace(
            x=x, y=x + 1e5, theta=x + 2e5, status=(keys == self.broken).astype(int)
        )


@pytest.mark.parametrize(
    ("broken", "sound"), [(-1, [True, True]), (4, [True, False]), (2, [False, True])]
)
def test_samples_are_those_of_their_section(broken: int, sound: list[bool]) -> None:
    """Three sections of two replicates; two of them are simulated together, one alone."""
    time = 0.1 * np.arange(7)
    sections = [
        section(time[:3], [0.0, 0.3], [0, 1, 2, 3, 4], [0, 0, 0, 1, 1], [0, 1, 2, 0, 2]),
        section(time[:2], [0.5], [5, 6], [0, 0], [0, 1]),
    ]
    model = Coded(broken)
    like = Conditions(time, xr.Dataset(coords={"time": [0.0, 1.0]}))
    one: Any = SimpleNamespace(
        problem=SimpleNamespace(like=like, model=model),
        sections=sections,
        first=np.array([0, 3, 5]),
    )
    keys = np.arange(6).reshape(2, 3)
    poses, found = made._poses(one, keys, 0.4, 7e-4)
    for replicate in range(2):
        own = 100 * keys[replicate]
        wanted = [own[0], own[0] + 1, own[0] + 2, own[1], own[1] + 2, own[2], own[2] + 1]
        np.testing.assert_array_equal(poses[0, replicate], wanted)
        np.testing.assert_array_equal(poses[1, replicate] - poses[0, replicate], 1e5)
        np.testing.assert_array_equal(poses[2, replicate] - poses[0, replicate], 2e5)
    assert found.tolist() == sound
    values, first, _ = model.asked[0]
    assert values["drag_coefficient"].tolist() == [0.4] * 4
    assert values["force_std"].tolist() == [7e-4] * 4
    # The flow changes in time: each world begins when its section does.
    assert first.flow_start.tolist() == [0.0, 0.3, 0.0, 0.3]
    assert first.start.x.shape == (4,)
    assert model.asked[1][1].flow_start.tolist() == [0.5, 0.5]


@pytest.mark.parametrize("with_path", [False, True])
def test_the_last_sample_of_a_section_is_not_shown(
    monkeypatch: pytest.MonkeyPatch, with_path: bool
) -> None:
    """Across a restart no velocity is taken; a replicate without a step is not sound."""
    time = 0.1 * np.arange(240)
    x, y = along_the_wall(time)
    steps = replicated(time, "none")
    one = replace(steps, first=np.array([0, 100, 200]))
    poses = np.zeros((3, 3, time.size), dtype=np.float32)
    poses[0], poses[1] = x, y
    poses[0, 2], poses[1, 2] = 0.15, 0.0  # at the wall all the time
    sound = np.array([True, False, True])
    monkeypatch.setattr(made, "_poses", lambda *_: (poses, sound))
    keys = np.arange(9).reshape(3, 3)
    found = made._simulated(one, keys, 0.4, 7e-4, POINT, 5.0 if with_path else None)
    if not with_path:
        assert [one.sound for one in found] == [True, False, False]
        assert [one.path for one in found] == [None] * 3
        wanted = steps.steps(*(axis.astype(np.float32).astype(float) for axis in (x, y)), 0 * x)
        np.testing.assert_allclose(found[0].steps, wanted)
        return
    assert [one.sound for one in found] == [True, False, True]
    shown = [k for k in range(240) if k not in (99, 199, 239)]
    assert found[0].path is not None
    np.testing.assert_allclose(found[0].path[0], 5.0 + time[shown])
    np.testing.assert_array_equal(found[0].path[1], x[shown].astype(np.float32))
    np.testing.assert_array_equal(found[1].path[2], y[shown].astype(np.float32))


def test_a_recording_that_keeps_to_the_wall_has_no_steps_to_compare() -> None:
    time = 0.1 * np.arange(240)
    x, y = along_the_wall(time)
    one = replicated(time, "given")
    hole = np.where(np.arange(240) % 7 == 0, np.nan, 0.4)
    series: Any = SimpleNamespace(angle=np.full(240, 0.4))
    track = SimpleNamespace(x=x, y=y, theta=hole)
    estimate: Any = SimpleNamespace(passes=SimpleNamespace(series=[series]), tracks=[track])
    # The smooth angle fills the holes of the recorded one.
    np.testing.assert_array_equal(
        made.recorded_steps([one], estimate), one.steps(x, y, np.full(240, 0.4))
    )
    track.x, track.y = np.full(240, 0.14), np.zeros(240)
    with pytest.raises(InputError, match="has 0 pairs of steps away from the wall"):
        made.recorded_steps([one], estimate)
