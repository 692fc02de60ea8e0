"""Ask whether the other smarticles explain how far one gets.

    python studies/motion_models/neighbours.py DATA OUT.jsonl [--body 1 ...] [--model NAME ...]

First it prints what the recording shows: in which direction steps go, by the distance of another
body and the length of the step. Then models are searched on the even blocks of time as in a
comparison, but with the mean squared displacement besides: the score gets 1.5 times the mean of
|log(simulated / recorded)| over 10, 30 and 100 step intervals. So this tells what a model can do,
and is no judgement: the displacements are those of the whole recording. OUT gets a line of JSON for
each search; what is there is not done again.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np
from recordings import RECORDINGS, read_lines

import driftwalk as dw
from driftwalk.calibration.evolution import AspectObjective, Budget, search_minimum
from driftwalk.calibration.held_out.candidates import prepare_candidates
from driftwalk.calibration.held_out.held_out_score import (
    HELD_OUT_REPLICATES,
    checks_off,
    even_blocks,
)
from driftwalk.calibration.held_out.recorded import CHECKS, RecordedMotion, body_motion
from driftwalk.comparison.aspects import resampled
from driftwalk.conditions import read_recordings
from driftwalk.model import load_study

MODELS: Final = ("run_rest+wall", "run_rest+wall+reverse", "run_rest+wall+neighbours")
RANGES: Final = {
    "neighbour_push": (0.7, 3.0), "neighbour_range": (0.03, 0.09),
    "wall_range": (0.025, 0.09),
}  # fmt: skip
"""Of the model with neighbours. On body 2 a search of the widest ranges ends in another valley."""
LONG: Final = slice(2, 5)
"""The facts of `motion_checks` that are added: displacement over 10, 30 and 100 intervals."""
WEIGHT: Final = 1.5
SEED: Final = 1
LENGTHS_MM: Final = (1.5, 4.0, 8.0, 20.0)
DISTANCES_MM: Final = (35.0, 60.0, 80.0, 100.0, 120.0)

Floats = np.ndarray


@dataclass(frozen=True, eq=False)
class FarObjective(AspectObjective):
    """The score of a comparison, and how far a body gets."""

    motion: RecordedMotion

    def __call__(self, settings: Floats, first: int, replicates: int) -> Floats:
        """Return the mean score of each setting."""
        seen = self.simulated(settings, replicates, stage="evolution", first=first)
        near = self.reference.overall(
            self.reference.distances(self.aspects(seen), threads=self.like.threads)
        )
        far = np.array([self.motion.checks(x, y) for x, y in zip(seen.x, seen.y, strict=True)])
        ratio = far[:, LONG] / self.motion.recorded_checks[LONG]
        off = np.abs(np.log(ratio)).mean(axis=1)
        return np.asarray((near + WEIGHT * off).reshape(len(settings), replicates).mean(axis=1))


def prepared(data: Path, body: str, threads: int) -> RecordedMotion:
    """Return a smarticle among the others."""
    recording = RECORDINGS[f"smarticle-{body}"]
    read = read_recordings(
        [data / recording.file], load_study(recording.study_file), {"body": body}, body=body,
        bodies="all",
    )  # fmt: skip
    return body_motion(read.trajectories[0], read.study, flow=None, body=body, threads=threads)


def print_directions(motion: RecordedMotion) -> None:
    """Print the mean cosine between a step and the direction to another body."""
    plan = motion.own_plan.short
    x, y, time = (
        resampled(plan, values) for values in (motion.track.x, motion.track.y, motion.track.time)
    )
    z = x + 1j * y
    places = motion.like.neighbours.at(time[:-1])
    to = places[..., 0] + 1j * places[..., 1] - z[:-1, None]
    step = np.diff(z)
    length, distance = 1e3 * np.abs(step), 1e3 * np.abs(to)
    cosine = np.cos(np.angle(to) - np.angle(step)[:, None])
    for low, high in pairwise(LENGTHS_MM):
        long = ((length >= low) & (length < high))[:, None]
        row = []
        for near, far in pairwise(DISTANCES_MM):
            found = cosine[long & (distance >= near) & (distance < far)]
            error = found.std() / np.sqrt(found.size)
            row.append(f"{near:.0f} to {far:.0f} mm {found.mean():+.2f} ± {error:.2f}")
        print(f"  steps of {low:g} to {high:g} mm: {', '.join(row)}")


def searched(motion: RecordedMotion, name: str) -> dict[str, Any]:
    """Search a model on the even blocks with the displacements besides."""
    ranges = RANGES if "neighbours" in name else {}
    model = dw.motion_model(name, clearance=motion.clearance.distance, **ranges)
    (entry,), _ = prepare_candidates([model], motion)
    objective = FarObjective(**{**vars(even_blocks(entry, motion)), "seed": SEED}, motion=motion)
    found = search_minimum(objective, len(entry.ranges), budget=Budget(), seed=SEED)
    seen = objective.simulated(found.best[None], HELD_OUT_REPLICATES, stage="judged")
    aspects = objective.aspects(seen)
    facts = np.array([motion.checks(x, y) for x, y in zip(seen.x, seen.y, strict=True)])
    off = checks_off(facts, motion.recorded_checks)
    held = np.median(motion.held.distances(aspects), axis=0)
    return {
        "model": name,
        "score": found.score,
        "held_out_score": float(motion.held.overall(motion.held.distances(aspects)).mean()),
        "held_out_over_own": dict(
            zip(motion.held.names, (held / motion.own).tolist(), strict=True)
        ),
        "facts_over_recorded": {
            key: float(ratio)
            for key, ratio, known in zip(
                CHECKS, np.median(facts, axis=0), motion.recorded_checks, strict=True
            )
            for ratio in [ratio / known if known else np.nan]
            if np.isfinite(ratio)
        },
        "facts_off": [key for key, is_off in zip(CHECKS, off, strict=True) if is_off],
        "values": {key: float(one[0]) for key, one in objective.values(found.best).items()},
    }


def main() -> None:
    """Do what is not done yet."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--body", action="append", choices=("1", "2", "3"))
    parser.add_argument("--model", action="append")
    parser.add_argument("--threads", type=int, default=2)
    given = parser.parse_args()
    done = {(one["body"], one["model"]) for one in read_lines(given.out)}
    for body in given.body or ("1", "2", "3"):
        motion = prepared(given.data, body, given.threads)
        print(f"smarticle {body}: mean cosine between a step and the direction to another")
        print_directions(motion)
        for model in given.model or MODELS:
            if (body, model) in done:
                continue
            line = {"body": body, **searched(motion, model)}
            with given.out.open("a") as file:
                file.write(json.dumps(line) + "\n")
            ratios = [line["facts_over_recorded"][key] for key in CHECKS[LONG]]
            print(
                f"  {model}: displacement over 10, 30, 100 intervals "
                f"{', '.join(f'{one:.2f}' for one in ratios)} of the recorded; odd blocks "
                f"{line['held_out_score']:.2f}; facts far off: {len(line['facts_off'])}",
                flush=True,
            )


if __name__ == "__main__":
    main()
