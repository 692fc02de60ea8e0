"""Fit self-propelled models to real recordings, on half of their blocks, and judge on the other.

    python studies/motion_models/run.py DATA OUT.jsonl [--recording NAME ...] [--model NAME ...]

DATA holds the recordings, one folder for each source. A recording is cut into 20 blocks of time:
models are searched on the even ones, by six two-dimensional distances over the recording's own
floors, and judged on the odd ones. OUT gets a line of JSON for each recording and model; what is
there is not done again.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any, Final

import numpy as np
from recordings import RECORDINGS, Recording, read_lines

import driftwalk as dw
from driftwalk.calibration.evolution import (
    AspectObjective,
    Budget,
    search_minimum,
    wall_distance,
)
from driftwalk.calibration.held_out.recorded import recorded_ranges, scales_of
from driftwalk.comparison.aspects import (
    AspectReference,
    aspect_reference,
    form_aspects,
    interleaved,
    plan_aspects,
)
from driftwalk.conditions import load_with_study, recorded_camera, recorded_conditions, study_for
from driftwalk.schema import body_track

MODELS: Final = (
    "inertial", "active+wall", "run_tumble+wall", "run_tumble+wall+slow", "run_rest+wall",
    "run_rest+wall+stroke", "burst_coast+wall", "two_state+wall", "run_rest+wall+reverse",
    "run_tumble+wall+follow+keep", "run_tumble+wall+slow+follow+keep",
)  # fmt: skip
SEED: Final = 1
JUDGED: Final = 16
"""Worlds by which the answer of a search is judged."""


class Prepared:
    """A recording, ready for any model."""

    def __init__(self, data: Path, recording: Recording, threads: int) -> None:
        from driftwalk.model import load_study

        study = load_study(recording.study_file)
        given = {} if recording.body is None else {"body": recording.body}
        loaded = load_with_study(data / recording.file, study, given)
        self.loaded = loaded
        self.study = study_for([loaded], study, **given)
        track = body_track(loaded, body=recording.body)
        camera = recorded_camera(
            track, self.study, position_quantum=float(loaded.attrs.get("position_quantum_m", 0.0))
        )
        self.like = recorded_conditions(track, self.study, camera=camera, threads=threads)
        interval = float(self.study.steps.step_interval_s)
        self.plan = plan_aspects(self.like.sample_time, step_interval=interval)
        self.duration = float(self.like.sample_time[-1])
        self.aspects = form_aspects(self.plan, track.x, track.y, wall=wall_distance(self.like))
        steps = next(one for one in self.aspects if one.name == "steps").points[:, 0]
        self.scales = scales_of(track, step_interval=interval, steps=steps)
        self.fitted, self.held = interleaved(self.aspects, duration=self.duration)

    def objective(self, name: str) -> AspectObjective:
        """Return the objective of a model on the even blocks."""
        model = dw.motion_model(name, clearance=self.clearance)
        return AspectObjective(
            model,
            recorded_ranges(model.parameters, self.scales),
            self.like,
            self.plan,
            aspect_reference(self.fitted, duration=self.duration),
            SEED,
        )

    @property
    def clearance(self) -> float:
        """Smallest distance of the recording from the wall [m], but for one sample in a hundred."""
        wall = next(one for one in self.aspects if one.name == "wall").points[:, 0]
        return max(float(np.quantile(wall, 0.01)), 0.0)


def judged(prepared: Prepared, name: str) -> dict[str, Any]:
    """Search a model on the even blocks, and judge it on the odd ones."""
    began = time.perf_counter()
    objective = prepared.objective(name)
    found = search_minimum(objective, len(objective.ranges), budget=Budget(), seed=SEED)
    seconds = time.perf_counter() - began
    worlds = objective.aspects(objective.simulated(found.best[None], JUDGED, stage="judged"))
    held = aspect_reference(prepared.held, duration=prepared.duration)
    apart = held.distances(worlds)
    again = aspect_reference(worlds[0], duration=prepared.duration)
    values = {key: float(value[0]) for key, value in objective.values(found.best).items()}
    return {
        "model": name,
        "parameters": len(values),
        "seconds": round(seconds, 1),
        "evaluations": found.evaluations,
        "score": found.score,
        "ends": found.ends.tolist(),
        "values": values,
        "trained": medians(objective.reference, objective.reference.distances(worlds)),
        "held_out": medians(held, apart),
        "own": medians(held, held.distances([prepared.fitted])),
        "model_floor": medians(again, again.distances(worlds[1:])),
        "held_out_score": float(held.overall(apart).mean()),
    }


def medians(reference: AspectReference, distances: np.ndarray) -> dict[str, float]:
    """Return the median distance over worlds in each aspect that the reference has."""
    return dict(zip(reference.names, np.median(distances, axis=0).tolist(), strict=True))


def main() -> None:
    """Do what is not done yet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--recording", action="append", choices=RECORDINGS)
    parser.add_argument("--model", action="append")
    parser.add_argument("--threads", type=int, default=2)
    given = parser.parse_args()
    done = {(one["recording"], one["model"]) for one in read_lines(given.out)}
    for name in given.recording or RECORDINGS:
        prepared = Prepared(given.data, RECORDINGS[name], given.threads)
        for model in given.model or MODELS:
            if (name, model) in done:
                continue
            line = {"recording": name, **judged(prepared, model)}
            with given.out.open("a") as file:
                file.write(json.dumps(line) + "\n")
            print(
                f"{name}, {model}: held out D {line['held_out']['steps']:.3f}, the recording's own "
                f"{line['own']['steps']:.3f}; score {line['held_out_score']:.2f}; "
                f"{line['seconds']:.0f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
