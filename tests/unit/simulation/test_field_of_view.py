"""What the camera does not see, and gaps that are left out."""

from __future__ import annotations

import numpy as np
import pytest

import driftwalk as dw
from driftwalk.calibration.problem import prepare_problem, score_settings
from driftwalk.core.errors import InputError
from driftwalk.model import apply_overrides
from driftwalk.schema import body_track
from driftwalk.simulation.backend import Camera

VIEWS = {
    "circle": {"shape": "circle", "diameter_m": 0.2, "center_m": (0.02, 0.0)},
    "rectangle": {"shape": "rectangle", "width_m": 0.2, "height_m": 0.1, "center_m": (0.0, 0.05)},
}


def seen(view, x, y):
    dx, dy = x - view["center_m"][0], y - view["center_m"][1]
    if view["shape"] == "circle":
        return np.hypot(dx, dy) <= view["diameter_m"] / 2
    return (np.abs(dx) <= view["width_m"] / 2) & (np.abs(dy) <= view["height_m"] / 2)


def minute(**changes):
    study = apply_overrides(dw.Study(), {"simulation.duration_s": 60.0, **changes})
    return dw.simulate(study, dw.tank30_flow(), replicates=5, seed=4)


@pytest.mark.parametrize("name", VIEWS)
def test_samples_outside_the_field_of_view_are_missing_and_no_others(name):
    view = VIEWS[name]
    everything = minute()
    part = minute(**{"observation.field_of_view": view})
    inside = seen(view, everything["x"].values, everything["y"].values)
    assert 0.1 < inside.mean() < 0.95
    for variable in ("x", "y", "theta"):
        np.testing.assert_array_equal(np.isfinite(part[variable].values), inside)
        np.testing.assert_array_equal(
            part[variable].values[inside], everything[variable].values[inside]
        )


def test_steps_that_the_camera_did_not_see_are_left_out_of_the_score():
    track = body_track(dw.tank30_recording().isel(time=slice(0, 1000)))
    pairs = {}
    for name in (None, "circle"):
        study = dw.Study()
        if name is not None:
            study = apply_overrides(study, {"observation.field_of_view": VIEWS[name]})
        problem = prepare_problem(track, study, dw.tank30_flow(), camera=Camera(), threads=1)
        found = score_settings(
            problem, (0.45, 6e-4), stage="coarse", numbers=[0], replicates=range(3)
        )
        pairs[name] = found["pairs"]
    assert (pairs[None] == 998).all()
    assert (pairs["circle"] < 998).all()
    assert (pairs["circle"] > 100).all()


def test_the_recordings_gaps_are_kept_unless_the_study_leaves_them_out():
    recording = dw.tank30_recording().isel(time=slice(0, 1000))
    holes = np.arange(1000) % 50 < 45
    gappy = recording.where(recording["time"].isin(recording["time"].values[holes]))
    with_gaps = dw.simulate_like(dw.Study(), dw.tank30_flow(), gappy)
    assert with_gaps.sizes["time"] == holes.sum()
    study = apply_overrides(dw.Study(), {"observation.gaps": "none"})
    without = dw.simulate_like(study, dw.tank30_flow(), gappy)
    assert without.sizes["time"] == 995
    np.testing.assert_allclose(np.diff(without["time"]), 0.1)
    track = body_track(gappy)
    pairs = [
        prepare_problem(track, chosen, dw.tank30_flow(), camera=Camera()).reference.plan.pairs
        for chosen in (dw.Study(), study)
    ]
    assert pairs == [20 * 43, 993]


def test_a_grid_too_fine_for_the_tank_is_refused():
    fine = dw.tank30_flow().isel(x=slice(0, 2), y=slice(0, 2))
    fine = fine.assign_coords(x=[0.0, 1e-6], y=[0.0, 1e-6])
    with pytest.raises(InputError, match="too fine"):
        dw.simulate(dw.Study(), fine, sample_time=[0.0, 0.1])


def test_the_water_s_acceleration_counts_as_tables_too():
    # 6,002 nodes a side fit once, but not twice.
    fine = dw.tank30_flow().isel(x=slice(0, 2), y=slice(0, 2))
    fine = fine.assign_coords(x=[0.0, 1e-4], y=[0.0, 1e-4])
    pushed = dw.Study(forces={"pressure_gradient": True})
    with pytest.raises(InputError, match=r"1 frames \(with the water's acceleration 2 tables\)"):
        dw.simulate(pushed, fine, sample_time=[0.0, 0.1])


@pytest.mark.parametrize("seed", [-1, 2**63])
def test_a_seed_out_of_range_is_refused(seed):
    with pytest.raises(InputError, match="seed"):
        dw.simulate(dw.Study(), dw.tank30_flow(), sample_time=[0.0, 0.1], seed=seed)
