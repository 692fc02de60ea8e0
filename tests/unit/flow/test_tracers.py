"""Tracers made a flow: a known flow within its errors, false links, gaps and identities."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr
from drifting_tracers import RADIUS, TANK, seeded_tank, vortex
from hypothesis import given, settings, strategies as st
from scipy.stats import binom, t as student

from driftwalk.core.errors import InputError
from driftwalk.flow import extract_flow, flow_from_tracers, load_flow, save_flow, tracers
from driftwalk.flow.tracers import LINKS, Steps, judge_steps, step_noise, track_steps
from driftwalk.schema import FLAGS, build_trajectory

Array = npt.NDArray[np.float64]
MEASURED = FLAGS["measured"]


def cell_averages(flow: xr.Dataset) -> tuple[Array, Array]:
    """Return the true mean velocity of every cell, over 100 points in it."""
    x, y = np.meshgrid(flow.x, flow.y)
    part = flow.attrs["cell_size_m"] * ((np.arange(10) + 0.5) / 10 - 0.5)
    points = [vortex(x + a, y + b) for a in part for b in part]
    return np.mean([u for u, _ in points], axis=0), np.mean([v for _, v in points], axis=0)


@pytest.mark.false_alarm(1e-3)
def test_the_errors_cover_the_known_flow(fresh_seed: Callable[[int], int]) -> None:
    """95 % of the cells lie within Student's interval for their number of tracks.

    The components of a cell, and cells that a track joins, are not independent: a third of them
    are counted as if they were, at a two-sided level of 1e-3.
    """
    seeded = seeded_tank(fresh_seed(1), tracers=2000, samples=8, false_links=0.01)
    flow = flow_from_tracers(seeded.recording, cells=20)
    x, y = np.meshgrid(flow.x, flow.y)
    # A cell at the wall is seeded in part, and its tracers say nothing of the rest.
    whole = np.hypot(x, y) < RADIUS - 0.75 * flow.attrs["cell_size_m"]
    chosen = whole & (flow.tracks.values >= 4)
    limit = student.ppf(0.975, flow.tracks.values[chosen] - 1)
    inside = []
    for name, true in zip("uv", cell_averages(flow), strict=True):
        error = flow[f"{name}_standard_error"].values[chosen]
        inside.append(np.abs(flow[name].values[chosen] - true[chosen]) <= limit * error)
    number = int(np.count_nonzero(chosen) * 2 / 3)
    low, high = binom.ppf([5e-4, 1 - 5e-4], number, 0.95) / number
    assert number > 150
    assert low <= np.mean(inside) <= high


@pytest.mark.false_alarm(1e-4)
def test_false_links_are_left_out_and_right_ones_kept(fresh_seed: Callable[[int], int]) -> None:
    seeded = seeded_tank(fresh_seed(2), tracers=600, samples=10, false_links=0.01)
    steps = track_steps(seeded.recording).steps
    noise = step_noise(steps)
    # The noise that was put in; its median is good to some percent.
    assert noise == pytest.approx(1e-4, rel=0.15)
    found = judge_steps(steps, noise=noise) > LINKS.threshold
    false = seeded.false.T.ravel()
    assert found[false].mean() > 0.85
    assert found[~false].mean() < 2e-3
    flow = flow_from_tracers(seeded.recording, cells=15)
    kept = flow_from_tracers(seeded.recording, cells=15, outlier_threshold=np.inf)
    true = np.stack(cell_averages(flow))
    whole = (flow.flag.values == MEASURED) & (flow.tracks.values >= 4)

    def error(field: xr.Dataset) -> float:
        return float(np.std((np.stack([field.u, field.v]) - true)[:, whole]))

    # Of 60 seeds the ratio is 2.7, give or take 0.24.
    assert error(kept) > 1.5 * error(flow)
    assert flow.attrs["samples_rejected"] == pytest.approx(np.count_nonzero(false), rel=0.25)


@pytest.mark.false_alarm(1e-4)
def test_scatter_alone_loses_two_steps_in_a_thousand(fresh_seed: Callable[[int], int]) -> None:
    random, n = np.random.default_rng(fresh_seed(3)), 20_000
    at, velocity = random.uniform(size=(n, 2)), random.normal(size=(n, 2))
    number = np.arange(n)
    steps = Steps(number, 2 * number, 0.0 * number, 1.0 + 0.0 * number, at, velocity)
    # 0.17 %: 34 of 20,000, give or take 6.
    assert 12 <= np.count_nonzero(judge_steps(steps, noise=0.0) > LINKS.threshold) <= 60


def test_the_neighbours_of_a_step_are_looked_up_once(monkeypatch: pytest.MonkeyPatch) -> None:
    import scipy.spatial

    looked_up: list[int] = []

    class Counting(scipy.spatial.cKDTree):
        def query(self, x: Array, k: int) -> Any:
            looked_up.append(len(x))
            return super().query(x, k)

    monkeypatch.setattr(scipy.spatial, "cKDTree", Counting)
    monkeypatch.setattr(tracers, "_CHUNK", 100)
    number, at = np.arange(450), np.random.default_rng(2).uniform(size=(450, 2))
    judge_steps(Steps(number, 2 * number, 0.0 * number, 1.0 + 0.0 * number, at, at), noise=0.0)
    assert looked_up == [100, 100, 100, 100, 50]


def test_no_step_crosses_a_gap_or_goes_from_one_body_to_another() -> None:
    """The oracle is a loop over every pair of samples of the same body."""
    random = np.random.default_rng(4)
    time = 0.1 * np.arange(12)
    x, y = random.normal(size=(2, 12, 5))
    x[random.uniform(size=x.shape) < 0.3] = np.nan
    found = track_steps(build_trajectory(time, x, y))
    expected = [
        (body, (x[k + 1, body] - x[k, body]) / 0.1, (y[k + 1, body] + y[k, body]) / 2)
        for body in range(5)
        for k in range(11)
        if np.isfinite(x[[k, k + 1], body]).all()
    ]
    steps = found.steps
    got = zip(steps.body, steps.velocity[:, 0], steps.position[:, 1], strict=True)
    np.testing.assert_allclose([list(one) for one in got], expected, rtol=1e-9)
    pairs = sum(max(0, int(np.isfinite(x[:, body]).sum()) - 1) for body in range(5))
    assert found.across_gaps == pairs - len(expected)


def test_no_step_where_identities_could_have_been_exchanged() -> None:
    time, x = 0.1 * np.arange(6), np.tile(np.arange(6.0)[:, None], (1, 2))
    two = build_trajectory(time, x, x + np.array([0.0, 1.0]))
    unsure = np.zeros((6, 2))
    unsure[3, 1] = 0.4
    found = track_steps(two.assign(ambiguous=(("time", "body"), unsure)))
    assert found.ambiguous == 2
    assert found.steps.body.tolist() == [0] * 5 + [1] * 3


def test_the_error_is_that_of_tracks_left_out_one_at_a_time() -> None:
    """Two cells, eight tracks with means of their own: a loop that leaves out each."""
    random = np.random.default_rng(5)
    speed = 0.01 + 0.002 * random.normal(size=8)
    time = 0.1 * np.arange(9)
    start = np.where(np.arange(8) < 4, -0.05, 0.05)
    x = start + speed * time[:, None]
    x[6:, 2] = np.nan  # a shorter track counts less
    tank = {"shape": "rectangle", "width_m": 0.2, "height_m": 0.2}
    recording = build_trajectory(time, x, np.zeros_like(x) + 0.01)
    flow = flow_from_tracers(recording, arena=tank, cells=2)
    weight = np.array([8, 8, 5, 8])
    mean = np.average(speed[:4], weights=weight)
    rest = [np.average(np.delete(speed[:4], k), weights=np.delete(weight, k)) for k in range(4)]
    error = np.sqrt(3 / 4 * np.sum((rest - np.mean(rest)) ** 2))
    here = flow.sel(x=-0.05, y=0.05)
    assert (int(here["count"]), int(here.tracks)) == (29, 4)
    np.testing.assert_allclose([here.u, here.u_standard_error], [mean, error], rtol=1e-9)
    assert flow.flag.sel(y=-0.05).values.tolist() == [FLAGS["filled"]] * 2


def test_a_shear_is_no_false_link_and_a_track_of_its_own_speed_none_either() -> None:
    """Neighbours differ by the shear; the steps of the same track do not."""
    time, y = 0.1 * np.arange(8), np.linspace(-0.1, 0.1, 40)
    x = np.where(y > 0.0, 0.2, 0.0) * time[:, None]
    flow = flow_from_tracers(build_trajectory(time, x, 0.0 * x + y), cells=10, position_noise=1e-5)
    assert flow.attrs["samples_rejected"] == 0


@pytest.mark.slow
def test_without_a_tank_the_field_is_the_box_of_the_tracks(tmp_path: Path) -> None:
    recording = seeded_tank(6, tracers=200, samples=6).recording
    bounded = flow_from_tracers(recording, cells=12)
    free = flow_from_tracers(recording.assign_attrs(arena=""), cells=12)
    assert (free.flag.values != FLAGS["outside"]).all()
    assert "arena" not in free.attrs
    assert (bounded.flag.values == FLAGS["outside"]).any()
    # A stream is continued where there is no wall: no filled cell turns along the box.
    time, start = 0.1 * np.arange(5), np.random.default_rng(7).uniform(-0.1, 0.1, (2, 60))
    x = start[0] + 0.02 * time[:, None]
    stream = flow_from_tracers(build_trajectory(time, x, 0.0 * x + start[1]), cells=10)
    np.testing.assert_allclose(stream.u, 0.02, rtol=1e-9)
    np.testing.assert_allclose(stream.v, 0.0, atol=1e-12)
    path = save_flow(stream, tmp_path / "flow.nc")
    xr.testing.assert_identical(load_flow(path).drop_attrs(), stream.drop_attrs())


@pytest.mark.slow
@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**31), shift=st.floats(-1.0, 1.0))
def test_neither_the_order_of_the_bodies_nor_the_place_matters(seed: int, shift: float) -> None:
    random = np.random.default_rng(seed)
    time, start = 0.1 * np.arange(4), random.uniform(-0.1, 0.1, (2, 25))
    drift = random.normal(0.0, 0.01, (2, 25))
    x, y = (start[k] + drift[k] * time[:, None] for k in (0, 1))
    tank = {"shape": "circle", "diameter_m": 0.4}
    whole = flow_from_tracers(build_trajectory(time, x, y), arena=tank, cells=8)
    turned = random.permutation(25)
    again = flow_from_tracers(
        build_trajectory(time, x[:, turned], y[:, turned]), arena=tank, cells=8
    )
    for name in ("u", "v", "count", "tracks", "flag", "u_standard_error"):
        np.testing.assert_allclose(again[name], whole[name], rtol=1e-6, atol=1e-9)
    assert int(whole["count"].sum()) + whole.attrs["samples_rejected"] == 75
    assert (whole.tracks.values <= whole["count"].values).all()
    moved = {**tank, "center_m": [shift, -shift]}
    there = flow_from_tracers(build_trajectory(time, x + shift, y - shift), arena=moved, cells=8)
    # A midpoint on the edge of two cells may change sides when it is moved: rounding.
    same = (there["count"].values == whole["count"].values) & (whole.flag.values == MEASURED)
    np.testing.assert_allclose(there.u.values[same], whole.u.values[same], atol=1e-7)


@pytest.mark.parametrize(
    ("x", "options", "message"),
    [
        ([[0.0, 1.0]], {}, "no body has two positions"),
        ([[0.0, 1.0], [0.0, 1.0]], {"min_count": 0}, "`min_count` must be at least 1"),
        ([[0.0, 1.0], [0.0, 1.0]], {"min_count": 9}, "no cell has 9 steps of tracers"),
        ([[0.0, 0.0], [0.0, 0.0]], {}, "all tracers are at one point"),
        ([[0.0, 1.0], [0.0, 1.0]], {"arena": TANK}, ""),
        ([[7.0, 8.0], [7.1, 8.1]], {"arena": TANK}, "no tracer is in the tank"),
        ([[0.0, 1.0], [0.0, 1.0]], {"outlier_threshold": 0.0}, "`outlier_threshold` must be above"),
        ([[0.0, 1.0], [0.0, 1.0]], {"position_noise": -1.0}, "`position_noise` must be a length"),
    ],
)
def test_what_is_refused(x: list[list[float]], options: dict[str, Any], message: str) -> None:
    at = np.array(x)
    recording = build_trajectory(0.1 * np.arange(len(at)), at, 0.0 * at)
    if not message:
        assert "No cell has two tracks" in flow_from_tracers(recording, **options).attrs["warning"]
        return
    with pytest.raises(InputError, match=message):
        flow_from_tracers(recording, **options)


def test_the_estimator_of_one_body_names_that_of_many() -> None:
    recording = seeded_tank(8, tracers=3, samples=6).recording
    with pytest.raises(InputError, match=r"3 bodies.*`flow_from_tracers` makes one flow"):
        extract_flow(recording, inertia="none")


def test_long_steps_and_wrong_links_are_said() -> None:
    mixed_up = seeded_tank(9, tracers=300, samples=8, interval=0.1, false_links=0.3)
    said = flow_from_tracers(mixed_up.recording, cells=15).attrs["warning"]
    assert "were left out: are the tracks linked rightly" in said
    coarse = seeded_tank(9, tracers=300, samples=4, interval=0.8)
    said = flow_from_tracers(coarse.recording, cells=20).attrs["warning"]
    assert "the steps blur the field" in said
