"""Compare models on simulated recordings of known truth; count how often it is named.

    python studies/motion_models/truth.py DATA OUT.jsonl [--recording NAME ...] [--model NAME ...]
        [--stated-noise] [--seed 77]

A recording is simulated under the conditions of a real one, by a model with the values that it got
there (`results/models.jsonl`). OUT gets a line of JSON for each; what is there is not done again.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any, Final

import numpy as np
from recordings import RECORDINGS, read_lines
from run import Prepared

import driftwalk as dw
from driftwalk.calibration import DEFAULT_MODELS
from driftwalk.core.random_streams import world_keys
from driftwalk.schema import build_trajectory

RESULTS: Final = Path(__file__).resolve().parent / "results" / "models.jsonl"
SEED: Final = 77


def simulated(prepared: Prepared, line: dict[str, Any], seed: int) -> Any:
    """Return a recording by a model, with the values and conditions of a real one."""
    model = dw.motion_model(line["model"], clearance=prepared.clearance)
    values = {name: np.array([value]) for name, value in line["values"].items()}
    keys = world_keys(seed, trial=0, replicate=0)
    seen = model.simulate(values, prepared.like, keys)
    return build_trajectory(
        prepared.like.sample_time,
        seen.x[0],
        seen.y[0],
        attrs={"arena": prepared.study.tank.to_arena_json(), "simulated": "yes"},
    )


def compared(
    prepared: Prepared, line: dict[str, Any], threads: int, *, seed: int, stated_noise: bool
) -> dict[str, Any]:
    """Compare models on a recording of the line's model."""
    began = time.perf_counter()
    study = prepared.study
    if stated_noise:
        noise = prepared.like.camera.position_noise
        study = dw.apply_overrides(study, {"observation.position_noise_m": noise})
    found = dw.calibration.compare_models(
        simulated(prepared, line, seed), DEFAULT_MODELS, study=study, threads=threads
    )
    names = [str(name) for name in found["model"].values]
    at = names.index(line["model"])
    return {
        "recording": line["recording"],
        "model": line["model"],
        "seed": seed,
        "ranking": names,
        "behind": float(found["behind"][at]),
        "behind_std": float(found["behind_std"][at]),
        "explained": [
            name
            for name, one in zip(names, found["verdict"].values, strict=True)
            if one == "explains"
        ],
        "verdict_reason": str(found["verdict_reason"].values[at]),
        "summaries": summaries_of(found),
        "held_out_distance": found["held_out_distance"].values.tolist(),
        "own_distance": found["own_distance"].values.tolist(),
        "checks": {
            name: found[f"check_{name}"].values.tolist()
            for name in ("recorded", "low", "median", "high")
        },
        "findings": [str(text) for text in found["finding"].values],
        "errors": {
            name: float(found["estimate"].sel(parameter=name)[at]) / value - 1.0
            for name, value in line["values"].items()
        },
        "seconds": round(time.perf_counter() - began, 1),
    }


def summaries_of(found: Any) -> dict[str, dict[str, Any]]:
    """Return what the summaries of the motion say of each model that was asked."""
    if "asked" not in found:
        return {}
    asked = found.isel(model=np.flatnonzero(found["asked"].values))
    return {
        str(name): {
            "named": bool(asked["named"][at]),
            **{
                key: float(asked[key][at])
                for key in ("discrepancy", "discrepancy_median", "discrepancy_q95", "deviance")
            },
        }
        for at, name in enumerate(asked["model"].values)
    }


def main() -> None:
    """Do what is not done yet."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--recording", action="append", choices=RECORDINGS)
    parser.add_argument("--model", action="append")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument(
        "--stated-noise", action="store_true", help="state the camera's noise, do not estimate it"
    )
    parser.add_argument("--seed", type=int, default=SEED, help="of the simulated recordings")
    given = parser.parse_args()
    done = {(one["recording"], one["model"], one["seed"]) for one in read_lines(given.out)}
    for line in read_lines(RESULTS):
        wanted = line["model"] in (given.model or DEFAULT_MODELS)
        here = line["recording"] in (given.recording or RECORDINGS)
        if not (wanted and here) or (line["recording"], line["model"], given.seed) in done:
            continue
        prepared = Prepared(given.data, RECORDINGS[line["recording"]], given.threads)
        found = compared(
            prepared, line, given.threads, seed=given.seed, stated_noise=given.stated_noise
        )
        with given.out.open("a") as file:
            file.write(json.dumps(found) + "\n")
        print(
            f"{line['recording']}, {line['model']}: {found['ranking'][:3]}, "
            f"explained {found['explained']}, named "
            f"{[name for name, one in found['summaries'].items() if one['named']]}; "
            f"{found['seconds']:.0f} s",
            flush=True,
        )


if __name__ == "__main__":
    main()
