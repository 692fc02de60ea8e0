"""The paper's estimator: exact motions, brute-force cell means, a leave-one-out standard error."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr

from driftwalk.core.errors import InputError
from driftwalk.core.smoothing import local_quadratic
from driftwalk.flow import bilinear, extract_flow, inertia_correction
from driftwalk.schema import FLAGS, build_trajectory, check_flow_field

Array = npt.NDArray[np.float64]
ARENA = '{"shape": "circle", "diameter_m": 0.3, "center_m": [0, 0]}'
BLOCK: dict[str, Any] = {"mass": 0.0116, "side": 0.03}
MEASURED, FILLED, OUTSIDE = FLAGS["measured"], FLAGS["filled"], FLAGS["outside"]


def synthetic_track(x: Any, y: Any, interval: float = 0.1, **options: Any) -> xr.Dataset:
    options.setdefault("attrs", {"arena": ARENA, "source": "synthetic.csv"})
    return build_trajectory(np.arange(len(x)) * interval, x, y, **options)


def wandering_track(seed: int = 0, n: int = 4000) -> xr.Dataset:
    """Smooth noise inside the tank, synthetic: it crosses cells again and again."""
    noise = np.random.default_rng(seed).normal(size=(2, n + 99))
    x, y = (np.convolve(part, np.hanning(100), mode="valid") for part in noise)
    scale = 0.14 / np.hypot(x, y).max()
    return synthetic_track(scale * x, scale * y)


def circling_track(radius: float, rate: float, n: int = 3000) -> xr.Dataset:
    angle = rate * 0.1 * np.arange(n)
    return synthetic_track(radius * np.cos(angle), radius * np.sin(angle))


def test_steady_circles_show_the_flow_that_turns_the_block() -> None:
    """On a circle |a| = r w² points inward: the water needs the inward part of Eq. 4."""
    radius, rate = 0.1, 0.5
    flow = extract_flow(circling_track(radius, rate), **BLOCK, cells=20)
    passing = math.sqrt(0.0116 * radius * rate**2 / (0.5 * 1000.0 * 9e-4 * 1.05))
    measured = flow.flag.values == MEASURED
    y, x = np.meshgrid(flow.y, flow.x, indexing="ij")
    u, v = flow.u.values[measured], flow.v.values[measured]
    r = np.hypot(x, y)[measured]
    inward = -(u * x[measured] + v * y[measured]) / r
    along = (-u * y[measured] + v * x[measured]) / r
    often = flow["count"].values[measured] >= 50
    # A 15-mm cell holds up to 9 degrees of the circle, and its centre may lie beside it.
    np.testing.assert_allclose(np.median(inward[often]), passing, rtol=0.03)
    np.testing.assert_allclose(np.median(along[often]), radius * rate, rtol=0.03)
    speed = np.hypot(u, v)[often]
    np.testing.assert_allclose(speed, math.hypot(passing, radius * rate), rtol=0.08)


def test_without_inertia_the_water_moves_as_the_body() -> None:
    flow = extract_flow(circling_track(0.1, 0.5), inertia="none", cells=20)
    measured = flow.flag.values == MEASURED
    np.testing.assert_array_equal(flow.u.values[measured], flow.u_block.values[measured])
    np.testing.assert_array_equal(flow.v.values[measured], flow.v_block.values[measured])
    assert "mass_kg" not in flow.attrs


def test_a_block_without_acceleration_moves_as_the_water() -> None:
    x = np.linspace(-0.1, 0.1, 101)
    flow = extract_flow(synthetic_track(x, 0.02 + 0.0 * x), **BLOCK)
    measured = flow.flag.values == MEASURED
    # The rounding of a zero acceleration is under a square root: 1e-7 m/s is 1e-14 m/s².
    np.testing.assert_allclose(flow.u.values[measured], 0.02, atol=1e-6)
    np.testing.assert_allclose(flow.v.values[measured], 0.0, atol=1e-6)


def visits_of(track: xr.Dataset, window: float) -> dict[tuple[int, int], list[list[Array]]]:
    """Oracle: (vx, vy, ax, ay) of every visit to every 6-mm cell, by plain loops."""
    time = track.time.values
    position = np.column_stack([track.x.values[:, 0], track.y.values[:, 0]])
    at, velocity, acceleration = local_quadratic(time, position, window=window)
    cells: dict[tuple[int, int], list[list[Array]]] = {}
    last: dict[tuple[int, int], float] = {}
    for t, p, v, a in zip(time, at, velocity, acceleration, strict=True):
        if not np.isfinite(p).all():
            continue
        key = (int((p[1] + 0.15) // 0.006), int((p[0] + 0.15) // 0.006))
        if t - last.get(key, -np.inf) > window:
            cells.setdefault(key, []).append([])
        cells[key][-1].append(np.concatenate([v, a]))
        last[key] = t
    return cells


def flow_of(samples: list[Array]) -> Array:
    mean = np.mean(samples, axis=0)
    return np.asarray(mean[:2] + inertia_correction(mean[2:], mass=0.0116, area=9e-4))


@pytest.mark.slow
def test_means_counts_and_errors_against_plain_loops() -> None:
    track = wandering_track()
    flow = extract_flow(track, **BLOCK)
    cells = visits_of(track, 0.7)
    total = 0
    for (row, column), visits in cells.items():
        here = flow.isel(y=row, x=column)
        samples = [sample for visit in visits for sample in visit]
        total += len(samples)
        assert here["count"] == len(samples)
        assert here.flag == MEASURED
        mean = np.mean(samples, axis=0)
        np.testing.assert_allclose([here.u_block, here.v_block], mean[:2], rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose([here.u, here.v], flow_of(samples), rtol=1e-9, atol=1e-12)
        errors = [float(here.u_standard_error), float(here.v_standard_error)]
        if len(visits) < 2:
            assert np.isnan(errors).all()
            continue
        without = [
            flow_of([s for other in visits if other is not visit for s in other])
            for visit in visits
        ]
        k = len(visits)
        expected = np.sqrt((k - 1) / k * np.sum((without - np.mean(without, axis=0)) ** 2, axis=0))
        np.testing.assert_allclose(errors, expected, rtol=1e-7, atol=1e-12)
    assert total == flow.attrs["samples_used"] == int(flow["count"].sum())
    assert np.count_nonzero(flow.flag == MEASURED) == len(cells) > 500
    assert np.count_nonzero(np.isfinite(flow.u_standard_error)) > 100


def test_standard_error_of_equal_visits_is_the_textbook_one() -> None:
    """One pass after another through a cell, each at a constant speed of its own."""
    speeds = np.random.default_rng(1).uniform(0.02, 0.04, 12)
    time, x = [], []
    for number, speed in enumerate(speeds):
        # Each pass is a stretch of its own: a gap of 100 s parts it from the next.
        time.append(100.0 * number + np.arange(41) * 0.1)
        x.append(speed * (np.arange(41) - 20.5) * 0.1)
    track = build_trajectory(
        np.concatenate(time), np.concatenate(x), np.full(12 * 41, 0.01), attrs={"arena": ARENA}
    )
    flow = extract_flow(track, inertia="none", cell_size=0.15)
    covered = flow.isel(x=1, y=1)  # the 20 samples at x > 0
    # The last sample of a pass has 3 neighbours only and no velocity.
    assert covered["count"] == 12 * 19
    np.testing.assert_allclose(covered.u_block, speeds.mean(), rtol=1e-9)
    np.testing.assert_allclose(
        covered.u_standard_error, speeds.std(ddof=1) / math.sqrt(12), rtol=1e-9
    )


def test_flags_and_finiteness() -> None:
    flow = check_flow_field(extract_flow(wandering_track(), **BLOCK))
    r = np.hypot(*np.meshgrid(flow.x, flow.y))
    visited = flow["count"].values > 0
    np.testing.assert_array_equal(flow.flag.values == MEASURED, visited)
    np.testing.assert_array_equal(flow.flag.values == FILLED, ~visited & (r <= 0.15))
    np.testing.assert_array_equal(flow.flag.values == OUTSIDE, ~visited & (r > 0.15))
    np.testing.assert_array_equal(np.isnan(flow.u_block.values), ~visited)
    in_tank = flow.flag.values != OUTSIDE
    share = np.count_nonzero(visited) / np.count_nonzero(in_tank)
    assert flow.attrs["measured_share"] == pytest.approx(share)
    assert flow.attrs["filled_share"] == pytest.approx(1.0 - share)


def test_min_count_moves_cells_from_measured_to_filled() -> None:
    track = wandering_track()
    strict = extract_flow(track, **BLOCK, min_count=4)
    np.testing.assert_array_equal(strict.flag == MEASURED, strict["count"] >= 4)
    few = (strict["count"] > 0) & (strict["count"] < 4)
    assert few.any()
    assert np.isnan(strict.u_standard_error.values[few.values]).all()
    assert np.isfinite(strict.u_block.values[few.values]).all()


def test_bodies_are_pooled_and_each_has_its_own_clock() -> None:
    one, two = wandering_track(1, 500), wandering_track(2, 500)
    x = np.full((1000, 2), np.nan)
    y = x.copy()
    x[::2, 0], y[::2, 0] = one.x.values[:, 0], one.y.values[:, 0]
    x[1::2, 1], y[1::2, 1] = two.x.values[:, 0], two.y.values[:, 0]
    both = synthetic_track(x, y, interval=0.05, body=["a", "b"])
    pooled = extract_flow(both, body="all", **BLOCK)
    alone = [extract_flow(both, body=name, **BLOCK) for name in "ab"]
    counts = [np.nan_to_num(flow["count"].values) for flow in alone]
    np.testing.assert_array_equal(pooled["count"], counts[0] + counts[1])
    assert json.loads(pooled.attrs["bodies"]) == ["a", "b"]
    momentum = sum(np.nan_to_num(f.u_block.values) * c for f, c in zip(alone, counts, strict=True))
    np.testing.assert_allclose(
        np.nan_to_num(pooled.u_block.values) * pooled["count"].values, momentum, atol=1e-12
    )


def test_order_of_bodies_does_not_matter() -> None:
    one, two = wandering_track(1, 500), wandering_track(2, 500)
    tracks = [
        synthetic_track(
            np.column_stack([a.x.values[:, 0] for a in pair]),
            np.column_stack([a.y.values[:, 0] for a in pair]),
        )
        for pair in ((one, two), (two, one))
    ]
    first, second = (extract_flow(track, body="all", **BLOCK) for track in tracks)
    for name in ("u", "v", "u_standard_error", "count"):
        np.testing.assert_allclose(first[name], second[name], rtol=1e-9, atol=1e-12)


def test_every_setting_stands_in_the_attributes() -> None:
    flow = extract_flow(wandering_track(), mass=0.02, side=0.03, depth=0.01, window=0.9, cells=30)
    expected = {
        "cell_size_m": 0.01,
        "window_s": 0.9,
        "mass_kg": 0.02,
        "area_m2": 3e-4,
        "water_density_kg_m3": 1000.0,
        "flow_drag_coefficient": 1.05,
        "inertia": "corrected",
        "min_count": 1,
        "source": "synthetic.csv",
    }
    for name, value in expected.items():
        assert flow.attrs[name] == (pytest.approx(value) if isinstance(value, float) else value)
    assert json.loads(flow.attrs["arena"]) == json.loads(ARENA)
    assert "Eq. 4" in flow.attrs["method"]
    assert "warning" not in flow.attrs


def test_warns_when_most_of_the_tank_is_a_guess() -> None:
    flow = extract_flow(circling_track(0.1, 0.5), **BLOCK)
    assert "of the tank's cells are measured" in flow.attrs["warning"]


def test_samples_beyond_the_wall_are_left_out_and_named() -> None:
    x = np.linspace(-0.1, 0.2, 301)
    flow = extract_flow(synthetic_track(x, 0.0 * x), **BLOCK)
    assert flow.attrs["samples_outside_tank"] == pytest.approx(50, abs=1)
    assert "beyond the wall" in flow.attrs["warning"]
    assert flow["count"].sum() == flow.attrs["samples_used"]


def test_rectangle_and_polygon_tanks() -> None:
    track = wandering_track()
    for arena in (
        {"shape": "rectangle", "width_m": 0.4, "height_m": 0.3},
        {"shape": "polygon", "vertices_m": [[-0.3, -0.2], [0.3, -0.2], [0.0, 0.4]]},
    ):
        flow = extract_flow(track, arena=arena, **BLOCK)
        u, v = bilinear(flow, flow.x.values[20], flow.y.values[20])
        np.testing.assert_allclose((u, v), (flow.u[20, 20], flow.v[20, 20]), rtol=1e-9)
        assert json.loads(flow.attrs["arena"]) == arena


def refuse(message: str, track: xr.Dataset | None = None, **options: Any) -> None:
    with pytest.raises(InputError, match=message):
        extract_flow(wandering_track(n=100) if track is None else track, **{**BLOCK, **options})


def test_refuses_with_the_name_of_the_option() -> None:
    refuse("`mass`", mass=None)
    refuse("`side`", side=None)
    refuse("keep one", area=1e-4)
    refuse("`inertia`", inertia="full")
    refuse("`min_count`", min_count=0)
    refuse("`cells`", cells=1)
    refuse("no cell has 1000 samples", min_count=1000)
    refuse("window must be", window=-1.0)
    refuse("`window`", window=0.2)
    refuse("no body 'z'", body="z")
    refuse("mass must be a positive", mass=-1.0)
    refuse("not JSON", arena="circle")


def test_refuses_without_arena_or_body() -> None:
    x = np.linspace(-0.1, 0.1, 50)
    refuse("`tank` of `load`", track=synthetic_track(x, x, attrs={}))
    pair = np.column_stack([x, x])
    refuse("`body`", track=synthetic_track(pair, pair))
    refuse("no sample lies in the tank", track=synthetic_track(x + 10.0, x))
