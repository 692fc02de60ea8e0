"""Calibrate models on simulated recordings of known truth, and count how well it goes.

    python studies/motion_models/recover.py OUT.jsonl [--model NAME] [--first 0] [--recordings 20]
    python studies/motion_models/recover.py SEARCHED.jsonl --search-alone [--recordings 5]

Every recording lasts half an hour at 10 Hz, in a round arena of 30 cm, with 0.3 mm of noise. The
truth is drawn for each: the values below, times a factor from 1/2 to 2. OUT gets a line of JSON for
each recording; what is there is not done again. With --search-alone the values come from the six
KS distances, without the summaries.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr
from recordings import read_lines

import driftwalk as dw
from driftwalk.conditions import recorded_conditions
from driftwalk.core.random_streams import world_keys
from driftwalk.model import apply_overrides
from driftwalk.schema import Track, build_trajectory
from driftwalk.simulation.backend import Camera

USUAL: Final[dict[str, dict[str, float]]] = {
    "inertial": {"speed_std": 0.02, "memory_time": 1.0, "turn_rate": 0.3},
    "active": {"speed": 0.03, "rotational_diffusion": 0.5, "turn_rate": 0.3},
    "run_tumble": {
        "speed": 0.03, "speed_cv": 0.3, "run_time": 2.0, "turn_std": 1.2,
        "rotational_diffusion": 0.1, "turn_rate": 0.1,
    },
    "run_rest": {
        "speed": 0.03, "speed_cv": 0.3, "run_time": 2.0, "run_time_cv": 0.7, "rest_time": 1.5,
        "rest_time_cv": 0.8, "turn_std": 1.0, "rotational_diffusion": 0.1,
    },
    "burst_coast": {
        "kick_speed": 0.06, "kick_speed_cv": 0.3, "kick_time": 1.0, "kick_time_cv": 0.4,
        "glide_time": 0.6, "turn_std": 0.6,
    },
    "two_state": {
        "slow_speed": 0.01, "fast_speed": 0.04, "speed_cv": 0.2, "slow_time": 2.0,
        "fast_time": 3.0, "slow_rotational_diffusion": 0.5, "fast_rotational_diffusion": 0.05,
        "turn_std": 1.0, "relaxation_time": 0.3,
    },
}  # fmt: skip
"""Values about which the truth is drawn."""
FACTOR: Final = 2.0
DURATION_S: Final = 1800.0
RATE_HZ: Final = 10.0
NOISE_M: Final = 3e-4
SEED: Final = 2011


def truth_of(model: str, number: int) -> dict[str, float]:
    """Return the values of a recording."""
    random = np.random.default_rng((SEED, sorted(USUAL).index(model), number))
    return {
        name: value * FACTOR ** random.uniform(-1.0, 1.0) for name, value in USUAL[model].items()
    }


def simulated(model: str, number: int) -> xr.Dataset:
    """Return a recording of known truth."""
    study = dw.Study()
    time_s = np.arange(int(DURATION_S * RATE_HZ)) / RATE_HZ
    # The body sets out in the middle of the arena, along the first recorded step.
    begun = Track(time_s, 1e-3 * time_s, 0.0 * time_s, np.full(time_s.size, np.nan))
    like = recorded_conditions(
        begun, study, camera=Camera(position_noise=NOISE_M), flow=None, threads=1
    )
    values = {name: np.array([value]) for name, value in truth_of(model, number).items()}
    keys = world_keys(SEED, trial=np.array([number]), replicate=0)
    seen = dw.motion_model(model).simulate(values, like, keys)
    arena = {"arena": study.tank.to_arena_json(), "simulated": "yes"}
    return build_trajectory(time_s, seen.x[0], seen.y[0], attrs=arena)


def recovered(model: str, number: int, threads: int) -> dict[str, Any]:
    """Calibrate the model on a recording of its own."""
    truth = truth_of(model, number)
    began, used = time.perf_counter(), time.process_time()
    found = dw.calibration.calibrate(
        simulated(model, number), dw.motion_model(model, clearance=0.0), threads=threads
    )
    draws = found["posterior_sample"].transpose("parameter", "draw").values
    return {
        "model": model,
        "recording": number,
        "truth": truth,
        "estimate": _by_name(found, "estimate"),
        "interval": _by_name(found, "interval"),
        "half_width": _by_name(found, "half_width"),
        "determined": _by_name(found, "determined"),
        "searched": _by_name(found, "searched_estimate") if "searched_estimate" in found else None,
        "rank": {
            name: float((row < truth[name]).mean())
            for name, row in zip(found["parameter"].values.tolist(), draws, strict=True)
        },
        "estimate_from": found.attrs["estimate_from"],
        "misfit": [
            float(found[name]) for name in ("discrepancy", "discrepancy_median", "discrepancy_q95")
        ],
        "score": float(found["score"]),
        "explained": str(found["verdict"].values) == "explains",
        "seconds": round(time.perf_counter() - began, 1),
        "processor_seconds": round(time.process_time() - used, 1),
    }


def searched(model: str, number: int, threads: int) -> dict[str, Any]:
    """Search the parameters of a recording by KS distances alone."""
    # One world judges no misfit, so that the summaries are left out.
    alone = apply_overrides(dw.Study(), {"calibration.bootstrap": 1})
    began = time.perf_counter()
    found = dw.calibration.calibrate(
        simulated(model, number),
        dw.motion_model(model, clearance=0.0),
        study=alone,
        threads=threads,
    )
    return {
        "model": model,
        "recording": number,
        "truth": truth_of(model, number),
        "estimate": _by_name(found, "searched_estimate"),
        "score": float(found["score"]),
        "seconds": round(time.perf_counter() - began, 1),
    }


def _by_name(found: xr.Dataset, variable: str) -> dict[str, Any]:
    return dict(
        zip(found["parameter"].values.tolist(), found[variable].values.tolist(), strict=True)
    )


def main() -> None:
    """Do what is not done yet."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--model", action="append", choices=USUAL)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--recordings", type=int, default=20)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--search-alone", action="store_true")
    given = parser.parse_args()
    done = {(one["model"], one["recording"]) for one in read_lines(given.out)}
    for number in range(given.first, given.first + given.recordings):
        for model in given.model or USUAL:
            if (model, number) in done:
                continue
            make = searched if given.search_alone else recovered
            line = make(model, number, given.threads)
            with given.out.open("a") as file:
                file.write(json.dumps(line) + "\n")
            print(_told(line), flush=True)


def _told(line: dict[str, Any]) -> str:
    known = line.get("determined", {})
    errors = ", ".join(
        f"{name} {'' if known.get(name) else '('}"
        f"{line['estimate'][name] / value - 1.0:+.0%}{'' if known.get(name) else ')'}"
        for name, value in line["truth"].items()
    )
    stage = line.get("estimate_from", "search alone")
    return (
        f"{line['model']} {line['recording']}, {line['seconds']:.0f} s, from the {stage}: {errors}"
    )


if __name__ == "__main__":
    main()
