"""Functions of a user calibrated on synthetic recordings that the same functions made.

Error budgets. A recording of n steps tells the rate of tumbles to 1 / sqrt(number of tumbles), and
a diffusivity to 1 / sqrt(n): no estimator does better. The KS distance uses less than all of it;
an estimate is allowed 3.3 times twice that bound, which a sound calibration leaves in one of a
thousand recordings. The seeds are fixed.
"""

from __future__ import annotations

import json

import numpy as np
import pytest
from walkers import diffuse, tumble

import driftwalk as dw
from driftwalk.conditions import Conditions
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.core.random_streams import world_keys
from driftwalk.model import apply_overrides
from driftwalk.motion import Parameter, motion_model
from driftwalk.schema import build_trajectory
from driftwalk.schema.answers.facts import facts_of
from driftwalk.simulation import Start
from driftwalk.simulation.backend import Camera

DURATION, RATE_HZ = 300.0, 10.0
NOISE = 3e-4
FEW = {
    "calibration.replicates": 2,
    "calibration.refined_replicates": 2,
    "calibration.bootstrap": 40,
    "observation.position_noise_m": NOISE,
}
STUDY = apply_overrides(dw.Study(), FEW)
ALLOWED = 3.3 * 2.0
SPEED, TUMBLE_RATE = 0.03, 2.0
DIFFUSIVITY = 1e-5
TUMBLE = motion_model(
    tumble,
    Parameter("speed", "m/s", 0.01, 0.05, step=0.005, refined_step=0.0005),
    Parameter("tumble_rate", "1/s", 0.0, 5.0, step=0.5, refined_step=0.1, label="rate of tumbles"),
)
DIFFUSE = motion_model(diffuse, Parameter("diffusivity", "m2/s", 1e-6, 1e-4, step=0.1, scale="log"))


def synthetic_recording(model, duration=DURATION, **truth):
    """Return what the model and its camera give at an address that no calibration uses."""
    like = Conditions(
        sample_time=np.arange(int(duration * RATE_HZ) + 1) / RATE_HZ,
        start=Start(0.0, 0.0, 0.4),
        camera=Camera(position_noise=NOISE),
        tank=STUDY.tank,
        view=None,
        flow=None,
        threads=1,
    )
    keys = world_keys(77, trial=0, replicate=0)
    values = {name: np.array([value]) for name, value in truth.items()}
    worlds = model.simulate(values, like, keys)
    return build_trajectory(like.sample_time, worlds.x[0], worlds.y[0])


@pytest.fixture(scope="module")
def tumbling():
    recording = synthetic_recording(TUMBLE, speed=SPEED, tumble_rate=TUMBLE_RATE)
    return dw.calibrate(recording, TUMBLE, study=STUDY, threads=2)


@pytest.fixture(scope="module")
def diffusing():
    recording = synthetic_recording(DIFFUSE, diffusivity=DIFFUSIVITY)
    return dw.calibrate(recording, DIFFUSE, study=STUDY, threads=2)


@pytest.mark.slow
def test_both_parameters_of_a_tumbling_particle_are_found(tumbling):
    facts = facts_of(tumbling)
    tumbles = DURATION * TUMBLE_RATE
    assert facts["tumble_rate_per_s"] == pytest.approx(TUMBLE_RATE, rel=ALLOWED / np.sqrt(tumbles))
    # The noise of a step's length, sqrt(2) NOISE, is all that hides the speed.
    bound = np.sqrt(2.0) * NOISE * RATE_HZ / np.sqrt(DURATION * RATE_HZ)
    assert facts["speed_m_s"] == pytest.approx(SPEED, abs=ALLOWED * bound + 0.0005 / 4)
    assert facts["distance_to_floor_ratio"] < 2.0
    assert facts["warnings"] == []


@pytest.mark.slow
def test_the_bootstrap_scatters_by_no_less_than_the_information_allows(tumbling):
    rates = tumbling["bootstrap_tumble_rate"].values
    bound = TUMBLE_RATE / np.sqrt(DURATION * TUMBLE_RATE)
    # 40 estimates know their standard deviation to 11 %: four of these below, the budget above.
    assert (1 - 4 * 0.11) * bound < rates.std(ddof=1) < 2 * 1.44 * bound
    low, high = tumbling["interval"].sel(parameter="tumble_rate").values
    assert low < tumbling["estimate"].sel(parameter="tumble_rate") < high


@pytest.mark.slow
def test_everything_stands_under_the_names_of_the_parameters(tumbling):
    assert tumbling["ks_distance"].dims == ("speed", "tumble_rate")
    assert tumbling["refined_surface"].dims == ("refined_speed", "refined_tumble_rate")
    assert tumbling["tumble_rate"].attrs == {"units": "1/s", "long_name": "rate of tumbles"}
    assert tumbling["region_speed"].attrs["units"] == "m/s"
    assert tumbling.attrs["model"] == "tumble"
    assert tumbling["parameter"].values.tolist() == ["speed", "tumble_rate"]
    assert tumbling["unit"].values.tolist() == ["m/s", "1/s"]
    assert not {"drag_coefficient", "force_interval_s"} & set(facts_of(tumbling))
    assert tumbling["step_density"].shape == (9, 11, 32, 32)
    border = tumbling["region_speed"], tumbling["region_tumble_rate"]
    assert border[0][0] == border[0][-1]
    assert border[1].min() < tumbling["estimate"].sel(parameter="tumble_rate") < border[1].max()


@pytest.mark.slow
def test_one_parameter_on_a_logarithmic_scale_is_found(diffusing):
    found = diffusing["estimate"].sel(parameter="diffusivity").item()
    allowed = ALLOWED / np.sqrt(DURATION * RATE_HZ) + np.log(10.0) * 0.1 / 5 / 4
    assert abs(np.log(found / DIFFUSIVITY)) < allowed
    low, high = diffusing["interval"].sel(parameter="diffusivity").values
    assert low < found < high
    assert high / low < np.exp(2 * allowed)
    assert diffusing["ks_distance"].dims == ("diffusivity",)
    assert diffusing["diffusivity"].attrs["scale"] == "log"
    assert diffusing["diffusivity"].values[[0, 10, 20]] == pytest.approx([1e-6, 1e-5, 1e-4])
    ends = diffusing["region_diffusivity"].values
    assert ends == pytest.approx([low, high])
    first = diffusing["first_half_estimate"].item()
    assert first == pytest.approx(DIFFUSIVITY, rel=0.25)


@pytest.mark.slow
def test_threads_and_company_of_settings_do_not_change_a_single_bit(diffusing):
    recording = synthetic_recording(DIFFUSE, diffusivity=DIFFUSIVITY)
    many = motion_model(diffuse, *DIFFUSE.parameters, settings="many")
    again = dw.calibrate(recording, many, study=STUDY, threads=1)
    assert again.identical(diffusing)


def test_the_block_is_a_model_among_others():
    study = apply_overrides(
        dw.Study(), {**FEW, "calibration.refine": "none", "calibration.drag_coefficient_step": 0.5,
                     "calibration.force_std_step_N": 5e-4}
    )  # fmt: skip
    recording = dw.tank30_recording().isel(time=slice(0, 600))
    flow = dw.tank30_flow()
    as_study = dw.calibrate(recording, study, flow=flow)
    assert dw.calibrate(recording, dw.motion.BlockModel(study), flow=flow).identical(as_study)
    assert dw.calibrate(recording, study=study, flow=flow).identical(as_study)


@pytest.mark.slow
def test_without_a_study_the_tank_is_the_arena_of_the_recording():
    radii = set()

    def told(scene, *, diffusivity):
        radii.add(scene.tank.radius_m)
        return diffuse(scene, diffusivity=diffusivity)

    model = motion_model(told, Parameter("diffusivity", "m2/s", 1e-5, 2e-5, step=1e-5))
    arena = json.dumps({"shape": "circle", "diameter_m": 0.08, "center_m": [0.0, 0.0]})
    recording = synthetic_recording(DIFFUSE, duration=20.0, diffusivity=DIFFUSIVITY)
    found = dw.calibrate(recording.assign_attrs(arena=arena), model, threads=1)
    assert radii == {0.04}
    assert dw.model.parse_study(found.attrs["study"]).tank.diameter_m == 0.08


def still(scene, *, a, b=0.0, c=0.0):
    return (np.zeros((scene.worlds, scene.times.size)),) * 2


@pytest.mark.parametrize(
    ("model", "message"),
    [
        (
            motion_model(lambda scene, *, status: still(scene, a=status), status=(0, 1)),
            "a parameter 'status', a name that a calibration uses itself",
        ),
        (
            motion_model(lambda scene, *, duration: 0, duration=(0, 1, "s")),
            "a parameter 'duration'",
        ),
    ],
)
def test_a_model_that_no_grid_can_be_laid_over_is_refused(model, message):
    recording = dw.tank30_recording().isel(time=slice(0, 100))
    with pytest.raises(ConfigurationError, match=message):
        dw.calibrate(recording, model)


def test_a_bare_function_is_no_model():
    recording = dw.tank30_recording().isel(time=slice(0, 100))
    with pytest.raises(InputError, match="becomes one by motion_model"):
        dw.calibrate(recording, still)
