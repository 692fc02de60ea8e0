"""Compare all models on the real recordings, as `driftwalk compare-models --models all` does.

    python studies/motion_models/compare.py DATA OUT.jsonl [--recording NAME ...] [--model NAME ...]

OUT gets a line of JSON for each recording; what is there is not done again.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

from recordings import RECORDINGS, read_lines

import driftwalk as dw
from driftwalk.calibration import ALL_MODELS
from driftwalk.conditions import read_recordings
from driftwalk.model import load_study
from driftwalk.schema.answers.model_comparison import comparison_answer


def compared(data: Path, name: str, models: list[str] | None, threads: int) -> dict[str, Any]:
    """Compare all models, or some, on a recording."""
    recording = RECORDINGS[name]
    read = read_recordings(
        [data / recording.file],
        load_study(recording.study_file),
        {} if recording.body is None else {"body": recording.body},
        body=recording.body,
        # Of a recording of several bodies the others are a condition of models that feel them.
        bodies="all",
    )
    began = time.perf_counter()
    found = dw.calibration.compare_models(
        read.trajectories[0],
        models or ALL_MODELS,
        study=read.study,
        body=recording.body,
        threads=threads,
    )
    seconds = round(time.perf_counter() - began, 1)
    return {"recording": name, "seconds": seconds, **comparison_answer(found).facts}


def main() -> None:
    """Do what is not done yet."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--recording", action="append", choices=RECORDINGS)
    parser.add_argument("--model", action="append")
    parser.add_argument("--threads", type=int, default=2)
    given = parser.parse_args()
    done = {one["recording"] for one in read_lines(given.out)}
    for name in given.recording or RECORDINGS:
        if name in done:
            continue
        line = compared(given.data, name, given.model, given.threads)
        with given.out.open("a") as file:
            file.write(json.dumps(line) + "\n")
        print(f"{name}, {line['seconds']:.0f} s: {'. '.join(line['findings'])}", flush=True)


if __name__ == "__main__":
    main()
