"""Put the paper's method and the likelihood fit to the same recordings of known truth.

    python studies/methods/run.py OUT [--motions run/likelihood/recordings] [--store FOLDER]

OUT holds `results.jsonl`, a line for each recording and method, and the flows. What is in there is
not done again; after a change of a method remove its lines. `--store` copies the results
with their table and manifest.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from recordings import Known, recordings
from table import markdown

import driftwalk as dw
from driftwalk.core.files.atomic import write_atomic
from driftwalk.core.provenance import manifest, plain, write_manifest
from driftwalk.schema.answers.facts import facts_of

if TYPE_CHECKING:
    import xarray as xr

ANGLES: Final = ("state", "given", "none")
FLOWS: Final = ("own", "fitted", "true")
SEARCH: Final = {
    "calibration.drag_coefficient_step": 0.1,
    "calibration.force_std_step_N": 0.1e-3,
    "calibration.replicates": 2,
    "calibration.refined_drag_coefficient_step": 0.02,
    "calibration.refined_force_std_step_N": 0.04e-3,
    "calibration.refined_replicates": 4,
    "calibration.bootstrap": 40,
}
"""The paper's box (C_d to 2, sigma_F to 2 mN) in coarser steps, with fewer simulations."""
ROOT: Final = Path(__file__).resolve().parents[2]
SOURCES: Final = (
    "src/driftwalk/calibration/*.py",
    "src/driftwalk/likelihood/**/*.py",
    "cpp/include/driftwalk/**/*.hpp",
)
PARAMETERS: Final = ("drag_coefficient", "force_std_N")


def version_of_source() -> str:
    """Return a number that is another one for another version of the methods' source."""
    files = sorted(file for pattern in SOURCES for file in ROOT.glob(pattern))
    content = b"".join(file.read_bytes() for file in files)
    return hashlib.sha256(content).hexdigest()[:12]


VERSION: Final = version_of_source()
"""Of the source as it is read now, when the run begins."""


class Answer(NamedTuple):
    """What a method found."""

    facts: dict[str, Any]
    """With units in the keys."""
    flow: xr.Dataset
    distance: float
    floor: float
    findings: list[str]
    """What speaks against the model."""
    seconds: float
    check_seconds: float


def main() -> None:
    """Do what is not done, and store when asked to."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--motions", type=Path, default=Path("run/likelihood/recordings"))
    parser.add_argument("--store", type=Path, default=None)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    results = options.out / "results.jsonl"
    done = {(line["recording"], line["method"]) for line in read_lines(results)}
    for known in recordings(options.motions):
        for line in lines_of(known, options.out, done):
            with results.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line, allow_nan=False) + "\n")
            print(in_words(line), flush=True)
    lines = read_lines(results)
    print(markdown(lines))
    if options.store is not None:
        store(options.store, lines, results)


def lines_of(known: Known, out: Path, done: set[tuple[str, str]]) -> Iterator[dict[str, Any]]:
    """Yield a line for each method that is not in the results."""
    wanted = [f"fit, angle {angle}" for angle in ANGLES] + [f"KS grid, {one} flow" for one in FLOWS]
    if all((known.name, method) in done for method in wanted):
        return
    begin = time.process_time()
    fits = {"state": dw.fit_motion(known.recording, known.study, angle="state")}
    seconds = {"state": time.process_time() - begin}
    for angle in ANGLES:
        if (known.name, f"fit, angle {angle}") in done:
            continue
        if angle not in fits:
            begin = time.process_time()
            fits[angle] = dw.fit_motion(known.recording, known.study, angle=angle)
            seconds[angle] = time.process_time() - begin
        answer = by_likelihood(known, fits[angle], seconds[angle])
        yield line_of(known, f"fit, angle {angle}", answer, fits["state"], out)
    flows: dict[str, Callable[[], xr.Dataset]] = {
        "own": lambda: dw.conditions.recording_flow(known.recording, known.study),
        "fitted": lambda: dw.fitted_flow(fits["state"]),
        "true": lambda: known.flow,
    }
    for name in FLOWS:
        if (known.name, f"KS grid, {name} flow") not in done:
            answer = by_distance(known, flows[name])
            yield line_of(known, f"KS grid, {name} flow", answer, fits["state"], out)


def by_likelihood(known: Known, fit: xr.Dataset, seconds: float) -> Answer:
    """Return what a fit found, and its check."""
    begin = time.process_time()
    check = dw.check_model(fit, known.recording)
    return Answer(
        facts_of(fit),
        dw.fitted_flow(fit),
        check.attrs["ks_distance"],
        check.attrs["ks_noise_floor"],
        check["verdict_reason"].values.tolist(),
        seconds,
        time.process_time() - begin,
    )


def by_distance(known: Known, flow_of: Callable[[], xr.Dataset]) -> Answer:
    """Return what the search for the smallest KS distance finds in a flow."""
    begin = time.process_time()
    flow = flow_of()
    study = dw.apply_overrides(known.study, SEARCH)
    calibration = dw.calibrate(known.recording, study, flow=flow, threads=1)
    found = facts_of(calibration)
    distance, floor = found["ks_distance"], found["noise_floor"]
    warnings = found["warnings"]
    findings = calibration["verdict_reason"].values.tolist()
    return Answer(
        found | {"warnings": warnings},
        flow,
        distance,
        floor,
        findings,
        time.process_time() - begin,
        0.0,
    )


def line_of(
    known: Known, method: str, answer: Answer, fit: xr.Dataset, out: Path
) -> dict[str, Any]:
    """Hold an answer beside the truth."""
    found: dict[str, Any] = {
        "recording": known.name,
        "method": method,
        "estimator": VERSION,
        "ks_distance": answer.distance,
        "ks_noise_floor": answer.floor,
        "explained": not answer.findings,
        "findings": answer.findings,
        "seconds": round(answer.seconds, 1),
        "check_seconds": round(answer.check_seconds, 1),
        "wall_share": fit["wall_share"].item(),
        "warnings": answer.facts["warnings"],
    }
    for name in PARAMETERS:
        truth = getattr(known, name)
        low, high = answer.facts[f"{name}_interval"]
        found |= {
            name: answer.facts[name],
            f"{name}_true": truth,
            f"{name}_low": low,
            f"{name}_high": high,
            f"{name}_error": answer.facts[name] / truth - 1.0,
            f"{name}_covered": bool(low <= truth <= high),
        }
    flow = answer.flow
    found["flow_error"] = 0.0 if flow is known.flow else flow_error(known, flow, fit)
    flow.to_netcdf(out / f"{known.name} - {method}.nc", engine="h5netcdf")
    return dict(plain(found))


def flow_error(known: Known, flow: xr.Dataset, fit: xr.Dataset) -> float:
    """Return the block flow error of a flow, as `score_fit` defines it.

    All flows are judged in the same cells: the nodes are those of the fit, and so is where the
    block has been.
    """
    at_nodes = dw.flow.bilinear(flow, *np.meshgrid(fit["x"].values, fit["y"].values))
    other = fit.assign(
        {name: fit[name].copy(data=part) for name, part in zip("uv", at_nodes, strict=True)}
    )
    score = dw.score_fit(
        other,
        drag_coefficient=known.drag_coefficient,
        force_std=known.force_std_N,
        tracking_noise=known.tracking_noise_m,
        flow=known.flow,
        recordings=known.recording,
    )
    return float(score["flow_error"])


def read_lines(path: Path) -> list[dict[str, Any]]:
    """Return the lines of a file of results, none where there is no file."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def in_words(line: dict[str, Any]) -> str:
    """Return a result on one line."""
    return (
        f"{line['recording']}, {line['method']}: C_d {line['drag_coefficient_error']:+.1%}, "
        f"sigma_F {line['force_std_N_error']:+.1%}, flow {line['flow_error']:.1%}, "
        f"D {line['ks_distance']:.3f} ({line['ks_noise_floor']:.3f}), {line['seconds']:.0f} s"
    )


def store(folder: Path, lines: list[dict[str, Any]], results: Path) -> None:
    """Write results, table and manifest."""
    folder.mkdir(parents=True, exist_ok=True)
    write_atomic(folder / "results.json", (json.dumps(lines, indent=1) + "\n").encode())
    write_atomic(folder / "table.md", (markdown(lines) + "\n").encode())
    study = dw.apply_overrides(dw.Study(), SEARCH)
    facts = manifest(
        command=["python", *sys.argv],
        study=study.to_dict(),
        seeds={"calibration": study.calibration.seed, "check": 0},
        inputs={"results": results},
    )
    write_manifest(folder / "manifest.json", facts)


if __name__ == "__main__":
    main()
