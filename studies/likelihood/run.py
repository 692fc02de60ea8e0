"""Fit recordings of known truth, a line of JSON for each.

    python studies/likelihood/run.py OUT --set synthetic --angle given [--workers 2] [--count 16]

OUT holds the motions (`recordings/`, shared by all estimators) and `SET-ANGLE.jsonl`. What is in
there already is not done again, so a study that was stopped goes on where it was. Each line names
the version of the estimator's source: after a change, begin with no `.jsonl`.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import multiprocessing
import os
import sys
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any, Final, get_args

from lines import read_lines
from study_sets import WORLDS, Case, cases_of, keep_motion, load_motion, record

import driftwalk as dw
from driftwalk.core.errors import DriftwalkError
from driftwalk.core.provenance import plain
from driftwalk.likelihood.preparation import AngleUse
from driftwalk.schema.answers.facts import facts_of

ROOT: Final = Path(__file__).resolve().parents[2]
INFER: Final = "cpp/include/driftwalk/infer"
SKIPPED: Final = 77
KEPT: Final = (
    "wall_share", "samples_used", "maximum_likelihood_drag_coefficient", "iterations", "converged",
    "restricted", "chi_squared_per_dof", "autocorrelation",
)  # fmt: skip
"""Facts of the fit that are kept beside the score."""


def main() -> None:
    """Make the recordings that are not there, then fit those that are not in the results."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--set", dest="set_name", choices=WORLDS, required=True)
    parser.add_argument("--angle", choices=get_args(AngleUse), default="given")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--count", type=int, default=None, help="worlds; default: all of the set")
    options = parser.parse_args()
    recordings = options.out / "recordings"
    recordings.mkdir(parents=True, exist_ok=True)
    if options.set_name == "ode":
        prepare_ode(recordings)
    results = options.out / f"{options.set_name}-{options.angle}.jsonl"
    cases = cases_of(options.set_name, options.count)
    done = {(line["number"], line["condition"]) for line in read_lines(results)}
    missing = [case for case in cases if case.key not in done]
    # The workers begin afresh and read this before they load numpy.
    os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    fresh = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(options.workers, mp_context=fresh) as pool:
        worlds = {case.number: case for case in missing}.values()
        list(pool.map(keep_motion, worlds, [recordings] * len(worlds)))
        lines = fit_all(pool, missing, recordings, options.angle)
        for line in lines:
            with results.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line, allow_nan=False) + "\n")
            print(in_words(line), flush=True)


def prepare_ode(folder: Path) -> None:
    """Compile the program that makes the recordings, or leave with a reason."""
    from ode import build_ode, peer

    try:
        build_ode(folder)
    except peer().PeerMissing as reason:
        print(f"skipped: {reason}")
        sys.exit(SKIPPED)


def fit_all(
    pool: ProcessPoolExecutor, cases: Iterable[Case], folder: Path, angle: str
) -> Iterator[dict[str, Any]]:
    """Fit recordings, and yield results as they come."""
    for one in as_completed([pool.submit(fit_one, case, folder, angle) for case in cases]):
        yield one.result()


def fit_one(case: Case, folder: Path, angle: str) -> dict[str, Any]:
    """Fit one recording and hold it beside its truth."""
    world, poses = load_motion(folder / case.file)
    recording = record(case, poses)
    facts = {
        "estimator": estimator(),
        "set": case.set_name,
        "number": case.number,
        "family": case.family,
        "condition": case.condition.name,
        "angle": angle,
    }
    begin = time.process_time()
    try:
        fit = dw.fit_motion(recording, dw.Study(), angle=angle)
    except DriftwalkError as error:
        return {**facts, "error": str(error)}
    seconds = time.process_time() - begin
    score = dw.score_fit(
        fit,
        drag_coefficient=world.drag_coefficient,
        force_std=world.force_std_N,
        tracking_noise=case.condition.camera.position_m,
        flow=world.flow(),
        recordings=recording,
    )
    kept = {name: facts_of(fit)[name] for name in KEPT}
    return dict(plain({**facts, **score, **kept, "seconds": round(seconds, 2)}))


def estimator() -> str:
    """Return a number that is another one for another version of the estimator's source."""
    files = [*ROOT.glob("src/driftwalk/likelihood/*.py"), *ROOT.glob(f"{INFER}/*.hpp")]
    content = b"".join(file.read_bytes() for file in sorted(files))
    return hashlib.sha256(content).hexdigest()[:12]


def in_words(line: dict[str, Any]) -> str:
    """Return a result on one line."""
    head = f"{line['set']} {line['number']} {line['family']}, {line['condition']}: "
    if "error" in line:
        return head + line["error"]
    drag, force = line["drag_coefficient_error"], line["force_std_N_error"]
    return head + (
        f"C_d {line['drag_coefficient_true']:.2f} {drag:+.1%} (z {line['drag_coefficient_z']:+.1f})"
        f", sigma_F {1e3 * line['force_std_N_true']:.2f} mN {force:+.1%}"
        f", flow {float(line['flow_error']):.1%}"
        f", wall {line['wall_share']:.0%}, {line['seconds']:.1f} s"
    )


if __name__ == "__main__":
    main()
