"""Motion models with known parameters: the promised bits, starts, what the dataset says, errors."""

from __future__ import annotations

import json
from collections.abc import Callable

import numpy as np
import pytest
import xarray as xr
from scipy.stats import kstest
from walkers import diffuse

import driftwalk as dw
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.core.random_streams import world_keys
from driftwalk.model import Study, apply_overrides
from driftwalk.motion import BlockModel, MotionModel, estimated_values, known_values
from driftwalk.motion.simulated import simulate_motion
from driftwalk.schema import body_track
from driftwalk.schema.check import check_dataset
from driftwalk.simulation import Start

ACTIVE = {"speed": 0.04, "rotational_diffusion": 0.5, "turn_rate": 0.2}
DIFFUSE = {"diffusivity": 2e-5}
TIMES = np.arange(50) * 0.1
POINTS = 2000
# Two-sided Kolmogorov-Smirnov tests of fixed seeds; the chance that a sound start fails one.
FALSE_ALARM = 1e-3


def active(**choices: float) -> MotionModel:
    return dw.motion_model(
        "active+wall", wall_range=0.02, wall_slowing=0.1, wall_turn=1.0, **choices
    )


def function() -> MotionModel:
    return dw.motion_model(diffuse, diffusivity=(1e-6, 1e-4, "m2/s"))


def recording() -> xr.Dataset:
    return dw.tank30_recording().isel(time=slice(0, 200))


def study(**values: object) -> Study:
    return apply_overrides(dw.Study(), {key.replace("__", "."): one for key, one in values.items()})


def expected(model: MotionModel, values: dict[str, float], seed: int, count: int):
    """Return the worlds that the model itself makes under the conditions of the recording."""
    track = body_track(recording())
    camera = dw.conditions.recorded_camera(track, dw.Study(), position_quantum=0.0)
    like = dw.conditions.recorded_conditions(track, dw.Study(), camera=camera)
    keys = world_keys(seed, trial=0, replicate=np.arange(count))
    columns = {name: np.full(count, value) for name, value in values.items()}
    return model.simulate(columns, like, keys)


def same_bits(run: xr.Dataset, worlds) -> None:
    for name in ("x", "y", "theta"):
        found, wanted = run[name].values[:, :, 0], getattr(worlds, name)
        assert found.dtype == wanted.dtype
        assert found.tobytes() == wanted.tobytes()
    np.testing.assert_array_equal(run["status"], worlds.status)


# --- the bits -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "values"), [(active, ACTIVE), (function, DIFFUSE)], ids=["family", "function"]
)
def test_worlds_like_a_recording_are_those_of_the_model(
    make: Callable[[], MotionModel], values: dict[str, float]
) -> None:
    model = make()
    quiet = recording().assign_attrs(position_quantum_m=0.0)
    worlds = expected(model, values, seed=7, count=5)
    for threads in (1, 3):
        run = simulate_motion(
            model, values, dw.Study(), like=quiet, seed=7, replicates=5, threads=threads
        )
        same_bits(run, worlds)
    few = simulate_motion(model, values, dw.Study(), like=quiet, seed=7, replicates=2)
    np.testing.assert_array_equal(few["x"], run["x"][:2])
    other = simulate_motion(model, values, dw.Study(), like=quiet, seed=8, replicates=2)
    assert not np.isclose(other["x"], few["x"], atol=1e-6).all(axis=(1, 2)).any()


def test_known_and_given_values_are_the_same() -> None:
    fixed = active(turn_rate=ACTIVE["turn_rate"])
    given = {name: ACTIVE[name] for name in ("speed", "rotational_diffusion")}
    one = dw.simulate(fixed, parameters=given, sample_time=TIMES, replicates=3)
    two = dw.simulate(active(), parameters=ACTIVE, sample_time=TIMES, replicates=3)
    np.testing.assert_array_equal(one["x"], two["x"])
    assert json.loads(one.attrs["model_parameters"]) == json.loads(two.attrs["model_parameters"])


def test_the_block_through_the_door_has_the_bits_of_its_own_simulation() -> None:
    chosen = study(forces__drag_coefficient=0.4, forces__force_std_N=6e-4)
    values, flow = {"drag_coefficient": 0.4, "force_std": 6e-4}, dw.tank30_flow()
    common = {"replicates": 3, "seed": 5}
    model = BlockModel(chosen)
    for options in ({"like": recording()}, {"sample_time": TIMES}):
        own = dw.simulate(chosen, flow, **options, **common)
        run = dw.simulate(model, flow, parameters=values, study=chosen, **options, **common)
        for name in ("x", "y", "theta", "status"):
            assert run[name].values.tobytes() == own[name].values.tobytes()


# --- the start ------------------------------------------------------------------------------------


def starts(model: MotionModel, values: dict[str, float], chosen: Study) -> xr.Dataset:
    run = dw.simulate(model, parameters=values, study=chosen, sample_time=[0, 1], replicates=POINTS)
    return run.isel(time=0, body=0)


@pytest.mark.parametrize("clearance", [0.0, 0.03])
def test_a_start_is_uniform_over_a_round_tank(clearance: float) -> None:
    """Of a uniform point the squared distance from the centre is uniform, and both angles are."""
    model = dw.motion_model("active", clearance=clearance)
    first = starts(model, ACTIVE, study(tank__diameter_m=0.2, simulation__seed=3))
    share = np.hypot(first["x"], first["y"]) / (0.1 - clearance)
    assert share.max() <= 1 + 1e-6
    angles = np.arctan2(first["y"], first["x"]), first["theta"]
    samples = [share.values**2, *(one.values / (2 * np.pi) + 0.5 for one in angles)]
    for sample in samples:
        assert kstest(sample, "uniform").pvalue > FALSE_ALARM / 6  # both clearances, three each


def test_a_start_is_uniform_over_a_rectangle() -> None:
    shape = {"tank.shape": "rectangle", "tank.width_m": 0.4, "tank.height_m": 0.1}
    model = dw.motion_model("active", clearance=0.02)
    first = starts(model, ACTIVE, apply_overrides(dw.Study(), shape))
    for name, half in (("x", 0.18), ("y", 0.03)):
        sample = first[name].values / (2 * half) + 0.5
        assert kstest(sample, "uniform").pvalue > FALSE_ALARM / 2


def test_no_room_is_said() -> None:
    with pytest.raises(
        InputError, match=r"no start pose was found for a body 0\.2 m from the wall"
    ):
        starts(dw.motion_model("active", clearance=0.2), ACTIVE, dw.Study())


def test_a_start_of_the_study_and_one_of_the_call() -> None:
    pose = {"x_m": 0.02, "y_m": -0.03, "theta_rad": 1.2}
    chosen = study(simulation__start=pose)
    run = dw.simulate(active(), parameters=ACTIVE, study=chosen, sample_time=TIMES, replicates=2)
    for name, value in zip(("x", "y", "theta"), pose.values(), strict=True):
        np.testing.assert_allclose(run[name][:, 0, 0], value, atol=1e-7)
    start = Start(0.01, 0.0, 0.0, vx=0.0, vy=0.5)
    run = dw.simulate(active(), parameters=ACTIVE, start=start, sample_time=TIMES)
    np.testing.assert_allclose(run["theta"][0, 0, 0], np.pi / 2, atol=1e-6)


def test_a_body_starts_at_rest_relative_to_the_water() -> None:
    """Without a force of its own it keeps the water's velocity; its heading is free of it."""
    flow, quiet = dw.uniform_flow(0.01, 0.02), {"speed_std": 1e-6, "memory_time": 100.0}
    drifting = dw.motion_model("inertial+flow", turn_rate=0.0)
    chosen = study(simulation__start={"x_m": 0.0, "y_m": 0.0, "theta_rad": 0.3})
    run = dw.simulate(drifting, flow, parameters=quiet, study=chosen, sample_time=[0.0, 1.0, 2.0])
    np.testing.assert_allclose(run["x"][0, :, 0], [0.0, 0.01, 0.02], atol=1e-5)
    np.testing.assert_allclose(run["y"][0, :, 0], [0.0, 0.02, 0.04], atol=1e-5)
    carried = dw.motion_model("active+flow")
    run = dw.simulate(carried, flow, parameters=ACTIVE, study=chosen, sample_time=[0.0, 1.0])
    np.testing.assert_allclose(run["theta"][0, 0, 0], 0.3, atol=1e-6)


# --- the dataset ----------------------------------------------------------------------------------


def test_the_dataset_says_which_model_it_was() -> None:
    run = dw.simulate(active(), parameters=ACTIVE, sample_time=TIMES, seed=9)
    assert check_dataset(run) is run
    assert run.attrs["model"] == "active+wall"
    assert json.loads(run.attrs["model_parameters"]) == {
        "speed_m_s": 0.04,
        "rotational_diffusion_rad2_s": 0.5,
        "turn_rate_rad_s": 0.2,
        "wall_turn_rad_s": 1.0,
        "wall_slowing": 0.1,
        "wall_range_m": 0.02,
        "clearance_m": 0.0,
    }
    assert (run.attrs["seed"], run.attrs["time_step_s"]) == (9, pytest.approx(0.02))
    assert "drag_coefficient" not in run.attrs
    of_function = dw.simulate(function(), parameters=DIFFUSE, sample_time=TIMES)
    assert check_dataset(of_function) is of_function
    assert json.loads(of_function.attrs["model_parameters"]) == {"diffusivity_m2_s": 2e-5}
    assert len(of_function.attrs["model_source_sha256"]) == 64
    assert np.isnan(of_function["theta"]).all()


def test_the_camera_of_the_study() -> None:
    """The noise of 2000 samples at rest: its standard deviation is known to 1.6 %, 4 sd."""
    chosen = study(observation__position_noise_m=1e-3)
    still = {"diffusivity": 1e-30}
    times = np.arange(2000) * 0.1
    run = dw.simulate(function(), parameters=still, study=chosen, sample_time=times, seed=2)
    assert float(run["x"].std()) == pytest.approx(1e-3, rel=0.065)
    clean = dw.simulate(function(), parameters=still, sample_time=times, seed=2)
    assert float(clean["x"].std()) < 1e-9


def test_gaps_and_stamps_are_the_recordings() -> None:
    uneven = recording().isel(time=[0, 1, 2, 7, 8, 30, 31, 32])
    quiet = study(observation__position_noise_m=0.0)
    run = dw.simulate(active(), parameters=ACTIVE, study=quiet, like=uneven)
    np.testing.assert_array_equal(run["time"], uneven["time"] - uneven["time"][0])


@pytest.mark.slow
def test_the_tank_of_a_simulation_is_not_doubted(tmp_path) -> None:
    """At the wall half of the positions are outside by the noise; a smaller tank is refused."""
    fast = {**ACTIVE, "speed": 0.1}
    chosen = study(observation__position_noise_m=1e-3)
    times = np.arange(1000) * 0.1
    run = dw.simulate(dw.motion_model("active"), parameters=fast, study=chosen, sample_time=times)
    path = tmp_path / "run.nc"
    run.to_netcdf(path, engine="h5netcdf")
    read = dw.load(path)
    assert (np.hypot(read["x"], read["y"]) > 0.15).mean() > 0.1
    assert dw.conditions.study_for([read]).tank.diameter_m == 0.3
    for other in (read.drop_attrs(), read):
        small = study(tank__diameter_m=0.2)
        with pytest.raises(InputError, match=r"outside the tank|the study says"):
            dw.conditions.study_for([other], small)


# --- errors ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({}, r"no value for speed \(1e-06 to 10 m/s\), rotational_diffusion \(.* rad2/s\), turn"),
        ({"speed": 0.1, "turn_rate": 0.0}, r"no value for rotational_diffusion \(0.0001 to 100"),
        ({**ACTIVE, "sped": 1.0}, r"no parameter 'sped'; it has speed, .*did you mean 'speed'"),
        ({**ACTIVE, "wall_range": 1.0}, r"was made with wall_range=0\.02: leave it out"),
        ({**ACTIVE, "speed": -1.0}, r"speed is -1, expected a number from 0 to inf \[m/s\]"),
        ({**ACTIVE, "speed": np.nan}, r"speed is nan"),
        ({**ACTIVE, "speed": "fast"}, r"speed: expected a value"),
    ],
)
def test_values_that_are_missing_unknown_or_wrong(given: dict, said: str) -> None:
    with pytest.raises(ConfigurationError, match=said):
        dw.simulate(active(), parameters=given, sample_time=TIMES)


def test_a_value_outside_the_range_of_the_search_is_simulated() -> None:
    assert known_values(function(), {"diffusivity": 1.0}) == {"diffusivity": 1.0}


def test_a_flow_is_missing_or_has_no_use() -> None:
    flow = dw.uniform_flow(0.01, 0.0)
    with pytest.raises(InputError, match="give the flow of the water"):
        dw.simulate(dw.motion_model("active+flow"), parameters=ACTIVE)
    with pytest.raises(InputError, match=r"active does not feel the water.*active\+flow"):
        dw.simulate(dw.motion_model("active"), flow, parameters=ACTIVE)


def test_what_contradicts() -> None:
    known = {"parameters": ACTIVE}
    with pytest.raises(InputError, match="gives times and start"):
        dw.simulate(active(), **known, like=recording(), sample_time=TIMES)
    with pytest.raises(InputError, match="none is given"):
        dw.simulate(active(), **known, body="a")
    with pytest.raises(InputError, match=r"begins at 0\.1 s"):
        dw.simulate(active(), **known, sample_time=[0.1, 0.2])
    with pytest.raises(InputError, match="finite, increasing"):
        dw.simulate(function(), parameters=DIFFUSE, sample_time=[0.0, 0.2, 0.1])
    with pytest.raises(InputError, match="leave out `backend`"):
        dw.simulate(active(), **known, backend="reference")
    with pytest.raises(InputError, match="are for a motion model"):
        dw.simulate(dw.Study(), dw.tank30_flow(), **known)
    with pytest.raises(InputError, match=r"`motion_model` makes .* xarray\.open_dataset opens"):
        dw.simulate("active")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="replicates must be at least 1"):
        dw.simulate(active(), **known, replicates=0)
    with pytest.raises(TypeError, match="integer"):
        dw.simulate(active(), **known, replicates=1.5)  # type: ignore[arg-type]


def test_worlds_without_numbers() -> None:
    """One that fails is data; all that fail are an error."""

    def some(scene, *, share):
        x = np.broadcast_to(scene.start.x[:, None], (scene.worlds, scene.times.size))
        drawn = scene.random.uniform(1)
        return np.where(drawn < share, np.nan, x + 0.01 * scene.times), x

    model = dw.motion_model(some, share=(0.0, 1.0))
    run = dw.simulate(model, parameters={"share": 0.5}, sample_time=TIMES, replicates=40, seed=1)
    broken = run["status"].values & 1 != 0
    assert 0 < broken.sum() < 40
    np.testing.assert_array_equal(np.isnan(run["x"].values[:, :, 0]).all(axis=1), broken)
    with pytest.raises(InputError, match=r"no finite numbers in every world .* share=1"):
        dw.simulate(model, parameters={"share": 1.0}, sample_time=TIMES, replicates=3)


# --- values of a calibration ----------------------------------------------------------------------


def found(model: str | None, **values: float) -> xr.Dataset:
    """Return estimates as any calibration stores them (synthetic)."""
    estimate = xr.DataArray(list(values.values()), {"parameter": list(values)}, "parameter")
    attrs = {"kind": "model_calibration", **({} if model is None else {"model": model})}
    return xr.Dataset({"estimate": estimate}, attrs=attrs)


def test_values_of_a_calibration() -> None:
    model = dw.motion_model("active", turn_rate=0.0)
    calibrated = found("active", speed=0.04, rotational_diffusion=0.5)
    one = dw.simulate(model, parameters=calibrated, sample_time=TIMES)
    given = {"speed": 0.04, "rotational_diffusion": 0.5}
    two = dw.simulate(model, parameters=given, sample_time=TIMES)
    np.testing.assert_array_equal(one["x"], two["x"])


def test_values_of_a_comparison_are_those_of_its_model() -> None:
    names = {"model": ["inertial", "active"], "parameter": ["relaxation_time", "speed"]}
    table = xr.DataArray([[0.7, 0.1], [np.nan, 0.2]], names, ("model", "parameter"))
    compared = xr.Dataset({"estimate": table}, attrs={"kind": "model_comparison"})
    assert estimated_values(compared, dw.motion_model("active")) == {"speed": 0.2}
    with pytest.raises(
        InputError, match="about inertial, active, and not about the model run_rest"
    ):
        estimated_values(compared, dw.motion_model("run_rest"))


def test_calibrations_that_have_no_values_of_this_model() -> None:
    model = dw.motion_model("active")
    with pytest.raises(InputError, match="about run_rest, and not about the model active"):
        estimated_values(found("run_rest", speed=0.1), model)
    with pytest.raises(InputError, match="about block"):
        estimated_values(found(None, drag_coefficient=0.4), model)
    with pytest.raises(InputError, match="the trajectory has no estimate"):
        estimated_values(recording(), model)
    # NaN: it was not determined, and somebody has to say it.
    unsure = found("active", speed=0.04, rotational_diffusion=np.nan, turn_rate=0.0)
    with pytest.raises(ConfigurationError, match="no value for rotational_diffusion"):
        dw.simulate(model, parameters=unsure, sample_time=TIMES)
    with pytest.raises(InputError, match="about the model active, of which it holds the numbers"):
        dw.simulate(unsure)
