"""A live tank is one run of `assembly_path`, in whatever pieces it is advanced."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings, strategies as st

import driftwalk as dw
from driftwalk.assembly.runs.plan import make_plan, simulate_rows, start_poses

STEP = 0.01
# Crowded tanks, so that blocks join within seconds; 26 blocks are beyond looking at all pairs.
DIAMETERS = {1: 0.1, 3: 0.12, 9: 0.2, 26: 0.3}


def study(blocks: int, latching: Any, interval: int) -> dw.Study:
    return dw.Study(
        tank={"diameter_m": DIAMETERS[blocks]},
        forces={"force_std_N": 2e-3, "force_interval_s": interval * STEP},
        simulation={"time_step_s": STEP},
        assembly={"blocks": blocks, "latching": latching},
    )


def growing(flow: xr.Dataset) -> xr.Dataset:
    """Return a flow that grows from nothing in a second, and goes again, over and over."""
    from driftwalk.schema import build_flow_field

    rise = np.array([0.0, 1.0])[:, None, None]
    frames = {name: flow[name].values * rise for name in "uv"} | {
        "flag": np.stack([flow["flag"].values] * 2)
    }
    return build_flow_field(
        flow["x"].values,
        flow["y"].values,
        **frames,
        time=np.array([0.0, 1.0]),
        attrs={"repeat": "mirror"},
    )


def whole_run(study: dw.Study, flow: xr.Dataset, seed: int, steps: int) -> dict[str, Any]:
    """Return what the reference backend makes of run 0, in double precision."""
    plan = make_plan(
        study, flow, settings={"seed": seed, "duration_s": steps * STEP}, index=np.arange(1),
        backend="reference",
    )  # fmt: skip
    found = simulate_rows(plan, start_poses(plan), sample_every=steps)
    return {name: values[0] for name, values in found.items()}


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(
    blocks=st.sampled_from(sorted(DIAMETERS)),
    latching=st.sampled_from(["collision", "connector", "none"]),
    interval=st.sampled_from([1, 2, 5]),
    steady=st.booleans(),
    seed=st.integers(0, 1000),
    pieces=st.lists(st.floats(0.0, 1.0), min_size=1, max_size=30),
)
def test_pieces_do_not_matter(
    blocks: int, latching: str, interval: int, steady: bool, seed: int, pieces: list[float]
) -> None:
    model = study(blocks, latching, interval)
    flow = dw.vortex_flow(angular_velocity=0.8, core_radius=0.04, arena=model.tank.to_arena())
    flow = flow if steady else growing(flow)
    tank = dw.LiveTank(model, flow, seed=seed)
    for piece in pieces:
        tank.advance(piece)
    assert abs(tank.time - sum(pieces)) < STEP * (1 + 1e-6)
    steps = round(tank.time / STEP)
    if steps == 0:
        return
    found = whole_run(model, flow, seed, steps)
    assert np.array_equal(np.stack([tank.x, tank.y, tank.theta], axis=1), found["pose"])
    assert np.array_equal(tank.assembly, found["assembly"])
    assert tank.outcome == dw.assembly.world_class(found["cell"], found["assembly"])
    events = tank.events()
    count = int(found["event_count"])
    assert [round(event.time / STEP) for event in events] == found["event_step"][:count].tolist()
    assert [list(event.blocks) for event in events] == found["event_block"][:count].tolist()


def test_poses_and_classes_are_those_of_the_public_functions() -> None:
    model = study(9, "collision", 1)
    flow = dw.vortex_flow(angular_velocity=0.8, core_radius=0.04, arena=model.tank.to_arena())
    path = dw.assembly_path(
        model, flow, duration=20.0, sample_interval=0.5, seed=4, backend="reference"
    )
    run = dw.assembly.assemble(model, flow, duration=20.0, runs=1, seed=4, backend="reference")
    tank = dw.LiveTank(model, flow, seed=4)
    for sample in range(path.sizes["time"]):
        assert tank.time == path["time"].values[sample]
        for name in ("x", "y", "theta", "assembly"):
            expected = path[name].values[0, sample]
            assert np.array_equal(getattr(tank, name).astype(expected.dtype), expected)
        tank.advance(0.5)
    count = int(run["event_count"][0])
    classes = run["class"].values[run["event_class"].values[0, :count]].tolist()
    events = [event for event in tank.events() if event.time <= 20.0]
    assert count > 3
    assert [event.time for event in events] == run["event_time"].values[0, :count].tolist()
    assert [event.outcome for event in events] == classes
