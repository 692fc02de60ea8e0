"""One real dataset of every kind, each made by the stage that makes it, as small as it allows."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import pytest
import xarray as xr
from chain_runs import chain_runs
from drifting_tracers import seeded_tank
from few_simulations import simulate_little
from fit_worlds import coarse_study, recording
from fits_of_effects import (
    fit_of_a_flawed_recording,
    fit_of_free_bodies,
    fit_of_glued_blocks,
    fit_that_estimates_the_wall,
    fit_with_a_measured_flow,
    fit_with_a_measured_series,
    fit_with_modes,
    flawed,
    in_the_alternating_flow,
    in_the_stirred_flow,
)
from made_once import made_once
from recovery_worlds import small_study
from self_propelled import moving
from small_sensitivity import FLOW, small
from switching_worlds import START_S, coarse_study as switched_study, two_flows
from walkers import diffuse, tumble

import driftwalk as dw
from driftwalk.assembly import assemble, infer_outcomes, kinetics, sobol_design, sobol_indices
from driftwalk.calibration import calibrate, compare_models
from driftwalk.calibration.evolution import Budget
from driftwalk.comparison import compare
from driftwalk.model import apply_overrides
from driftwalk.motion import MotionModel, Parameter, motion_model
from driftwalk.simulation import simulate

SECONDS = 120.0
FEW_SETTINGS = {
    "calibration.drag_coefficient_min": 0.2,
    "calibration.drag_coefficient_max": 0.8,
    "calibration.drag_coefficient_step": 0.2,
    "calibration.force_std_min_N": 0.2e-3,
    "calibration.force_std_max_N": 1.0e-3,
    "calibration.force_std_step_N": 0.2e-3,
    "calibration.replicates": 2,
    "calibration.refined_drag_coefficient_step": 0.05,
    "calibration.refined_force_std_step_N": 0.1e-3,
    "calibration.refined_replicates": 2,
    "calibration.bootstrap": 10,
}
MAP = {"drag_coefficient": [0.3, 0.6], "force_std_N": [5e-4, 1e-3]}
TUMBLE = motion_model(
    tumble,
    Parameter("speed", "m/s", 0.01, 0.05, step=0.02, refined_step=0.005),
    Parameter("tumble_rate", "1/s", 0.0, 4.0, step=2.0, refined_step=0.5, label="rate of tumbles"),
)
DIFFUSE = motion_model(
    diffuse,
    Parameter("diffusivity", "m2/s", 1e-6, 1e-4, step=0.5, refined_step=0.1, scale="log"),
)
BLOCK = {"mass": 0.0116, "side": 0.03, "depth": 0.03}


def track() -> xr.Dataset:
    return recording(SECONDS)


def simulated() -> xr.Dataset:
    times = track()["time"]
    return simulate(coarse_study(), FLOW, sample_time=times, replicates=2, seed=1)


def path_seen() -> xr.Dataset:
    return dw.path_recording(every_kind("assembly_path"))


def design() -> xr.Dataset:
    return sobol_design({"a": (0.0, 1.0), "b": (0.0, 1.0)}, samples=8, seed=1)


def switched_fit() -> xr.Dataset:
    times = {"switching_times_s": [START_S + SECONDS]}
    return dw.fit_motion(two_flows(SECONDS), switched_study(**times))


def recovery() -> xr.Dataset:
    precise = {"durations_s": [60.0], "drag_coefficient_precision": 0.1}
    return dw.recovery_study(small_study(**precise), dw.tank30_flow())


def calibration() -> xr.Dataset:
    study = apply_overrides(coarse_study(), FEW_SETTINGS)
    return calibrate(track(), study, flow=dw.tank30_flow(), threads=2)


def calibration_of_a_function(model: MotionModel) -> xr.Dataset:
    study = apply_overrides(dw.Study(), {**FEW_SETTINGS, "observation.position_noise_m": 3e-4})
    return calibrate(track(), model, study=study, threads=2)


def model_comparison() -> xr.Dataset:
    few = Budget(design=16, starts=1, short=2, long=2, retest=2)
    study = apply_overrides(dw.Study(), {"calibration.bootstrap": 0})
    return compare_models(track(), ["inertial", "active+wall"], study=study, budget=few, threads=2)


def model_calibration(*, matched: bool) -> xr.Dataset:
    model = motion_model("inertial")
    values = {"speed_std": 0.02, "memory_time": 0.8, "turn_rate": 0.5}
    with pytest.MonkeyPatch.context() as patch:
        simulate_little(patch, matched=matched)
        return calibrate(moving(model, values, 40.0, seed=1), model, threads=2)


def model_recovery() -> xr.Dataset:
    values = {"speed": 0.03, "rotational_diffusion": 0.5}
    short = {"recover.recordings": 2, "recover.durations_s": [40.0], "calibration.bootstrap": 10}
    coarse = {"calibration.replicates": 1, "calibration.refined_replicates": 1}
    study = apply_overrides(dw.Study(), {**short, **coarse})
    model = motion_model(
        "active",
        Parameter("speed", "m/s", 0.01, 0.1, step=0.2, refined_step=0.1, scale="log"),
        Parameter(
            "rotational_diffusion", "rad2/s", 0.1, 2.5, step=0.2, refined_step=0.1, scale="log"
        ),
        turn_rate=0.0,
    )
    return dw.recover_model(model, values, study, threads=2)


def control_policy() -> xr.Dataset:
    one = dw.ModeSource(small(assembly={"blocks": 3}), FLOW)
    modes = dw.make_modes([one], flow_scales=[0.0, 1.0])
    return dw.plan_control(modes, "L3", 20.0, rounds=3, worlds=20)


def checked(form: str, recording: xr.Dataset) -> xr.Dataset:
    return dw.check_model(every_kind(form), recording, replicates=4)


def check() -> xr.Dataset:
    return checked("fit with the angle in the state", track())


FORMS: dict[str, Callable[[], xr.Dataset]] = {
    "trajectory": track,
    "simulation": simulated,
    "flow_field of a formula": lambda: FLOW,
    "flow_field of a recording": lambda: dw.extract_flow(track(), **BLOCK),
    "flow_field of tracers": lambda: dw.flow_from_tracers(
        seeded_tank(1, tracers=40, samples=5).recording, cells=8
    ),
    "flow_field of a fit": lambda: dw.fitted_flow(every_kind("fit")),
    "steps": lambda: dw.steps(track()),
    "comparison": lambda: compare(track(), recording(SECONDS, "second"), permutations=19),
    "replicate_comparison": lambda: dw.compare_replicates(track(), every_kind("simulation")),
    "calibration": calibration,
    "calibration of one parameter": lambda: calibration_of_a_function(DIFFUSE),
    "calibration of two parameters": lambda: calibration_of_a_function(TUMBLE),
    "model_comparison": model_comparison,
    "model_calibration": lambda: model_calibration(matched=True),
    "model_calibration whose summaries are hardly matched": lambda: model_calibration(
        matched=False
    ),
    "fit": lambda: dw.fit_motion(track(), coarse_study(), angle="none"),
    "fit with the angle in the state": lambda: dw.fit_motion(
        track(), coarse_study(), angle="state"
    ),
    "fit of several flows": switched_fit,
    "fit with a measured flow": fit_with_a_measured_flow,
    "fit with a measured series": fit_with_a_measured_series,
    "fit with modes of the flow": fit_with_modes,
    "fit of glued blocks": fit_of_glued_blocks,
    "fit of free bodies": fit_of_free_bodies,
    "fit of a flawed recording": fit_of_a_flawed_recording,
    "fit that estimates the wall": fit_that_estimates_the_wall,
    "model_check": check,
    "model_check with a measured flow": lambda: checked(
        "fit with a measured flow", in_the_stirred_flow()
    ),
    "model_check with a measured series": lambda: checked(
        "fit with a measured series", in_the_alternating_flow()
    ),
    "model_check of a flawed recording": lambda: checked("fit of a flawed recording", flawed()),
    "recovery": recovery,
    "model_recovery": model_recovery,
    "assembly": lambda: assemble(small(), FLOW, runs=12, seed=5),
    "assembly whose bonds break": lambda: assemble(
        small(assembly={"bond_rate_per_s": 0.5}), FLOW, runs=12, seed=5
    ),
    "steady_state": lambda: dw.steady_state(every_kind("assembly whose bonds break")),
    "kinetics": lambda: kinetics(chain_runs(60, 1), chain_runs(30, 2), target="T", blocks=3),
    "outcome_posterior": lambda: infer_outcomes(
        {"2": 12, "1+1": 8},
        FLOW,
        small(assembly={"blocks": 2, "duration_s": 4.0}),
        runs=20,
        truths=20,
    ),
    "yield": lambda: dw.assembly.maximise_yield(
        small(),
        FLOW,
        target="2+1",
        by=10.0,
        axes={"latching": ["collision", "none"]},
        ranges={"force_std": (2e-4, 1e-3)},
        runs=3200,
        fresh_runs=40,
    ),
    "control_policy": control_policy,
    "control_test": lambda: dw.try_control(every_kind("control_policy"), worlds=20),
    "attraction": lambda: dw.attraction(dw.Study(interaction={"magnets": "5x5x2mm,1.3T"})),
    "assembly_path": lambda: dw.assembly_path(small(), FLOW, runs=[0], seed=5),
    "outcome_distribution": lambda: dw.outcome_distribution(every_kind("assembly")),
    "outcome_distribution of realisations": lambda: dw.sensitivity_reference(small(), FLOW),
    "assembly_sizes": lambda: dw.assembly_sizes(every_kind("assembly")),
    "class_times": lambda: dw.class_times(every_kind("assembly")),
    "classification": lambda: dw.classify(path_seen(), side=0.03),
    "classification with blocks hidden": lambda: dw.observe(path_seen(), side=0.03),
    "sensitivity": lambda: dw.sensitivity_map(
        small(sensitivity=MAP), FLOW, reference=every_kind("outcome_distribution of realisations")
    ),
    "components": lambda: dw.principal_components(every_kind("sensitivity")),
    "sobol_design": design,
    "sobol_indices": lambda: sobol_indices(design(), design()["value"].sum("input")),
    "sobol_indices of a tank": lambda: dw.sensitivity_indices(small(), FLOW, samples=8),
}
"""By what they are, the kind first; several of one kind where it has several forms."""


@cache
def every_kind(form: str) -> xr.Dataset:
    """Return the dataset of a form, made once in a session."""
    return made_once(f"kind {form}", FORMS[form])
