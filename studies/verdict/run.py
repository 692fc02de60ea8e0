"""Ask driftwalk for its verdict on the recordings of a set, as a user would: one line for each.

    python studies/verdict/run.py SET OUT.jsonl [--program driftwalk] [--workers 1]
                                  [--kind NAME ...] [--calibrate] [--keep FOLDER]

SET is a folder that `make.py` filled. Blocks go through `driftwalk fit`, walkers through `driftwalk
compare-models`, with the options that their user knows; `--calibrate` asks `driftwalk calibrate
--model` too, for the numbers of walkers. Recordings that are in OUT.jsonl are not asked for again,
so a study that was stopped goes on where it was. `--program` names the program of another version.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any

VERDICTS = ("explains", "does not explain", "cannot tell")
NUMBERS = (
    "drag_coefficient",
    "force_std_N",
    "drag_power",
    "linear_drag_kg_s",
    "force_memory_s",
    "flow_strength_change",
    "pulse_amplitude",
    "orientation_offset_rad",
    "marker_x_m",
    "marker_y_m",
    "time_stamp_noise_s",
)
FACTS = (
    "force_law",
    "wall_share",
    "visited_share",
    "ks_distance",
    "ks_noise_floor",
    "law_settled_by",
)


def main() -> None:
    """Ask for the verdicts that are not there."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("set", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--program", default="driftwalk")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--kind", action="append")
    parser.add_argument("--calibrate", action="store_true")
    parser.add_argument("--keep", type=Path, help="folder for the runs, which are deleted else")
    parser.add_argument("--most-each", type=int, default=None, help="recordings of each kind")
    options = parser.parse_args()
    asked = {line["name"] for line in read_lines(options.out)}
    wanted = [
        truth
        for truth in chosen(options.set, options.kind, options.most_each)
        if truth["name"] not in asked
    ]
    with ThreadPoolExecutor(options.workers) as pool:
        jobs = [
            pool.submit(ask, truth, options.set, options.program, options.calibrate, options.keep)
            for truth in wanted
        ]
        for job in as_completed(jobs):
            line = job.result()
            with options.out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line, ensure_ascii=False) + "\n")
            print(
                line["name"], line["kind"], line["verdict"], f"{line['seconds']:.0f} s", flush=True
            )


def chosen(folder: Path, kinds: list[str] | None, most: int | None) -> list[dict[str, Any]]:
    """Return the truths of a set, or the first ones of some kinds."""
    truths = [json.loads(path.read_text("utf-8")) for path in sorted(folder.glob("*.json"))]
    found: dict[str, list[dict[str, Any]]] = {}
    for truth in truths:
        found.setdefault(truth["kind"], []).append(truth)
    return [
        truth
        for kind, some in found.items()
        if kinds is None or kind in kinds
        for truth in some[:most]
    ]


def ask(
    truth: dict[str, Any], folder: Path, program: str, calibrates: bool, keep: Path | None
) -> dict[str, Any]:
    """Return the line of one recording: the truth, the verdict and the numbers."""
    recording = folder / f"{truth['name']}.csv"
    place = Path(tempfile.mkdtemp(dir=keep)) if keep is None else keep / truth["name"]
    try:
        words = [truth["command"], str(recording), *truth["options"], "-o", str(place / "run")]
        answer, line = answered([program, *words])
        if answer is not None:
            line |= block_line(answer) if truth["command"] == "fit" else walker_line(answer)
        if calibrates and truth["command"] != "fit" and truth["model"] is not None:
            line |= calibrated(truth, recording, program, place)
    finally:
        if keep is None:
            shutil.rmtree(place, ignore_errors=True)
    return {"name": truth["name"], "kind": truth["kind"], **line}


def answered(words: list[str]) -> tuple[dict[str, Any] | None, dict[str, Any]]:
    """Run a command with --json; return its answer, if any, and how it went."""
    done, seconds = timed([*words, "--json"])
    if done.returncode:
        refusal = done.stderr.strip().splitlines()[-1:] or [f"exit {done.returncode}"]
        return None, {"verdict": "refused", "reasons": refusal, "seconds": seconds}
    return json.loads(done.stdout), {"seconds": seconds}


def timed(words: list[str]) -> tuple[subprocess.CompletedProcess[str], float]:
    """Run a command on one thread; return it and its processor time [s]."""
    script = "import resource, subprocess, sys; code = subprocess.call(sys.argv[2:]);" + (
        "used = resource.getrusage(resource.RUSAGE_CHILDREN);"
        "open(sys.argv[1], 'w').write(str(used.ru_utime + used.ru_stime)); sys.exit(code)"
    )
    with tempfile.NamedTemporaryFile() as clock:
        done = subprocess.run(
            ["python3", "-c", script, clock.name, *words],
            capture_output=True, text=True, check=False,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
        )  # fmt: skip
        return done, float(Path(clock.name).read_text("utf-8") or "nan")


def block_line(answer: dict[str, Any]) -> dict[str, Any]:
    """Return verdict and numbers of a fit, of this version or of one that knew two verdicts."""
    word, reasons = answer.get("verdict"), answer.get("verdict_reasons")
    if word not in VERDICTS:
        explained = answer.get("explained")
        word = {True: VERDICTS[0], False: VERDICTS[1], None: "not checked"}[explained]
        reasons = answer.get("findings", [])
    numbers = {
        name: {"value": answer[name], "interval": answer.get(f"{name}_interval")}
        for name in NUMBERS
        if answer.get(name) is not None
    }
    facts = {name: answer[name] for name in FACTS if name in answer}
    return {
        "verdict": word,
        "reasons": reasons,
        "numbers": numbers,
        "facts": facts,
        "warnings": answer.get("warnings", []),
    }


def walker_line(answer: dict[str, Any]) -> dict[str, Any]:
    """Return the verdict on each model of a comparison, and on all of them."""
    words: dict[str, str] = {}
    for model in answer["models"]:
        if model["baseline"]:
            continue
        word = model["verdict"]
        if word not in VERDICTS:
            word = VERDICTS[0] if model["explained"] else VERDICTS[1]
        words[model["model"]] = word
    explaining = [name for name, word in words.items() if word == VERDICTS[0]]
    speaks = [model["model"] for model in answer["models"] if model.get("named")]
    named = [name for name in explaining if name in speaks] or explaining
    cannot = any(word == VERDICTS[2] for word in words.values())
    best = named[0] if named else next(iter(words), None)
    return {
        "verdict": VERDICTS[0] if named else VERDICTS[2] if cannot else VERDICTS[1],
        "reasons": answer.get("findings", [])[:3],
        "named": best,
        "models": words,
        "warnings": answer.get("warnings", []),
    }


def calibrated(truth: dict[str, Any], recording: Path, program: str, place: Path) -> dict[str, Any]:
    """Return what `calibrate --model` says of the numbers of the true law."""
    words = [program, "calibrate", str(recording), "--model", truth["model"], *truth["options"]]
    words += ["--parameter", "clearance=0.015", "-o", str(place / "calibration")]
    answer, went = answered(words)
    if answer is None:
        return {"calibration": went}
    word = answer.get("verdict")
    if word not in VERDICTS:
        word = VERDICTS[0] if answer["explained"] else VERDICTS[1]
    return {
        "calibration": {
            "verdict": word,
            "misfit": answer.get("discrepancy"),
            "most_misfit": answer.get("discrepancy_q95"),
            "numbers": answer["parameters"],
            **went,
        }
    }


def read_lines(path: Path) -> list[dict[str, Any]]:
    """Return the lines of a file; none where it is not there."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text("utf-8").splitlines() if line]


if __name__ == "__main__":
    main()
