"""Fit recordings of worlds that are not as the model says, a line of JSON for each.

    python studies/misfit/run.py OUT [--set misfits] [--worlds 8] [--minutes 10] [--workers 2]
                                     [--case NAME ...]

The sets: `misfits`, of large ones (`cases.py`); `sizes`, of what can just be found (`sizes.py`);
`right`, of worlds that are as the model says (`right.py`). OUT keeps the motions (`motions/`) and a
file of results for each set. What is in there is not done again, so a study that was stopped goes
on where it was; a line names the version of the fit's source, and results of other versions are
computed again. The motions come from the Open Dynamics Engine, those of `right` from driftwalk.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import multiprocessing
import os
import sys
import time
import zlib
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any, Final

import numpy as np
from cases import CASES, Case, Seen
from right import right_motion
from scipy.interpolate import RegularGridInterpolator
from sizes import SIZES

ROOT: Final = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "studies" / "likelihood"))

from lines import read_lines  # noqa: E402
from ode import PROGRAM, build_ode, ode_poses, peer  # noqa: E402
from tracks import Poses, wall_share  # noqa: E402
from worlds import AXIS, FAMILIES, RADIUS_M, World, draw_flow  # noqa: E402

import driftwalk as dw  # noqa: E402
from driftwalk.core.errors import DriftwalkError  # noqa: E402
from driftwalk.likelihood import check_model  # noqa: E402
from driftwalk.model import Tank  # noqa: E402
from driftwalk.schema import build_trajectory  # noqa: E402

INTERVAL_S: Final = 0.1
NOISE: Final = (0.3e-3, 0.3e-3, np.deg2rad(0.5))
"""Of x, y [m] and theta [rad]."""
FIRST_SEED: Final = 40_000
"""Of the worlds, with the case and the number of each; no other study uses it."""
REFERENCE_M_S: Final = 0.03
"""Speed at which a drag of another power is that of C_d (benchmarks/ode/tank.hpp)."""
SOURCES: Final = ("src/driftwalk/likelihood/**/*.py", "cpp/include/driftwalk/infer/*.hpp")
ODE: Final = ROOT / "benchmarks" / "ode"
SKIPPED: Final = 77
RIGHT: Final = {"the model itself": Case()}
SETS: Final = {"misfits": CASES, "sizes": SIZES, "right": RIGHT}


def main() -> None:
    """Make the motions that are not there, then fit what is not in the results."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--worlds", type=int, default=8)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--set", dest="kind", choices=SETS, default="misfits")
    parser.add_argument("--case", dest="names", action="append")
    options = parser.parse_args()
    cases = SETS[options.kind]
    unknown = set(options.names or ()) - set(cases)
    if unknown:
        parser.error(f"no case {unknown.pop()!r}; there are: {', '.join(cases)}")
    motions, results = options.out / "motions", options.out / file_of(options.kind)
    motions.mkdir(parents=True, exist_ok=True)
    if options.kind != "right":
        try:
            build_ode(motions)
        except peer().PeerMissing as reason:
            print(f"skipped: {reason}")
            sys.exit(SKIPPED)
    done = {
        (one["case"], one["world"], one["minutes"])
        for one in read_lines(results)
        if one["fit"] == version()
    }
    wanted = [
        (name, k, options.minutes) for k in range(options.worlds) for name in options.names or cases
    ]
    missing = [one for one in wanted if one not in done]
    # The workers begin afresh and read this before they load numpy.
    os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    fresh = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(options.workers, mp_context=fresh) as pool:
        jobs = [pool.submit(fit_one, options.kind, *one, motions) for one in missing]
        for job in as_completed(jobs):
            line = job.result()
            with results.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line, allow_nan=False, ensure_ascii=False) + "\n")
            print(in_words(line), flush=True)


def file_of(kind: str) -> str:
    """Return the name of the file that holds the results of a set."""
    return "results.jsonl" if kind == "misfits" else f"{kind}.jsonl"


def fit_one(kind: str, name: str, number: int, minutes: float, motions: Path) -> dict[str, Any]:
    """Fit one recording, check the model, and hold both beside the truth."""
    case = SETS[kind][name]
    if kind == "right":
        world, poses = right_motion(number, motions, minutes)
    else:
        world, poses = motion(case, draws(kind, name, number), number, motions, minutes)
    recording = record(case, poses, draws(kind, name, number, "camera"))
    study = dw.Study()
    wrong = {key: factor * _number_at(study, key) for key, factor in case.told.items()}
    facts: dict[str, Any] = {
        "fit": version(),
        "case": name,
        "world": number,
        "minutes": minutes,
        "wall_share": round(wall_share(poses), 3),
    }
    begin = time.process_time()
    try:
        told = dw.apply_overrides(study, wrong | dict(case.stated))
        fit = dw.fit_motion(recording, told, angle=case.angle)
    except DriftwalkError as error:
        return {**facts, "error": str(error)}
    facts["seconds"] = round(time.process_time() - begin, 1)
    truth = {
        "drag_coefficient": world.drag_coefficient,
        "force_std": world.force_std_N,
        "tracking_noise": NOISE[0],
    }
    for parameter, true in truth.items():
        value = float(fit["estimate"].sel(parameter=parameter))
        low, high = (float(bound) for bound in fit["interval"].sel(parameter=parameter))
        facts[f"{parameter}_error"] = value / true - 1.0
        facts[f"{parameter}_covered"] = bool(low <= true <= high)
    if {"drag_power", "linear_drag"} & set(case.law):
        facts["slip_m_s"] = slip = median_slip(world, poses)
        facts["drag_force_error"] = fitted_force(fit, slip) / true_force(world, case, slip) - 1.0
    facts["law"] = str(fit.attrs["force_law"])
    facts["evidence"] = round(float(fit["law_settled_by"]), 1) if "law_settled_by" in fit else None
    facts["numbers"] = {
        str(name): [
            float(fit["estimate"].sel(parameter=name)),
            *fit["interval"].sel(parameter=name).values.tolist(),
        ]
        for name in fit["parameter"].values[6 if "force_lever" in fit["parameter"] else 4 :]
    }
    if "departure" in fit.coords:
        names, std = fit["departure"].values, fit["departure_std"].values
        facts["departure_std"] = {
            str(name): float(one) for name, one in zip(names, std, strict=True)
        }
    if "drag_coefficient_any_added_mass_interval" in fit:
        for parameter in ("drag_coefficient", "force_std"):
            low, high = fit[f"{parameter}_any_added_mass_interval"].values
            facts[f"{parameter}_any_covered"] = bool(low <= truth[parameter] <= high)
    try:
        check = check_model(fit, recording)
        facts["explained"] = str(check["verdict"].values) == "explains"
        facts["findings"] = [str(text) for text in check["verdict_reason"].values]
        facts["least_p_value"] = float(check["p_value"].min())
    except DriftwalkError as error:
        facts["explained"], facts["findings"] = None, [str(error)]
    facts["warnings"] = [str(text) for text in fit["warning"].values]
    return facts


def median_slip(world: World, poses: Poses) -> float:
    """Return the median speed of the water past the centre of the block [m/s]."""
    velocity = [np.gradient(part, INTERVAL_S) for part in (poses.x, poses.y)]
    places = np.stack([poses.y, poses.x], axis=1)
    water = [
        RegularGridInterpolator((AXIS, AXIS), part, bounds_error=False, fill_value=None)(places)
        for part in (world.u, world.v)
    ]
    return float(np.median(np.hypot(water[0] - velocity[0], water[1] - velocity[1])))


def true_force(world: World, case: Case, slip: float) -> float:
    """Return the drag [N] at a slip, the mean over orientations, of the engine's law."""
    power = case.law.get("drag_power", 2.0)
    return _force(world.drag_coefficient, power, case.law.get("linear_drag", 0.0), slip)


def fitted_force(fit: Any, slip: float) -> float:
    """Return the same of a fit."""
    known = {
        str(name): float(fit["estimate"].sel(parameter=name)) for name in fit["parameter"].values
    }
    power = known.get("drag_power", 2.0)
    return _force(known["drag_coefficient"], power, known.get("linear_drag", 0.0), slip)


def _force(drag_coefficient: float, power: float, linear: float, slip: float) -> float:
    # Of one face and of two at 45 degrees, 4 / pi in the mean over the orientations.
    study = dw.Study()
    area = study.block.side_m * study.wetted_depth_m
    scale = 0.5 * study.water.density_kg_m3 * drag_coefficient * area
    faced = scale * REFERENCE_M_S ** (2.0 - power) * slip**power
    return 4.0 / np.pi * faced + linear * slip


def draws(kind: str, name: str, number: int, what: str = "world") -> np.random.Generator:
    """Return the random numbers of a recording, for its world or its camera.

    Each misfit has worlds of its own, so that those of one table are independent of each other.
    The sizes of misfits share theirs: what differs between two sizes is then their size.
    """
    of_case = zlib.crc32(name.encode()) if kind == "misfits" else 0
    return np.random.default_rng([FIRST_SEED, of_case, number, zlib.crc32(what.encode())])


def motion(
    case: Case, rng: np.random.Generator, number: int, folder: Path, minutes: float
) -> tuple[World, Poses]:
    """Return a world and the block's motion in it; both are kept."""
    world, seed = world_of(case, number, rng), int(rng.integers(2**31))
    words = [f"{name}={value:.9g}" for name, value in case.law.items()]
    if case.growth:
        # The engine begins a minute before the first sample.
        words.append(f"flow_growth={case.growth / (60.0 * minutes + 60.0):.9g}")
    program = "".join(path.read_text() for path in sorted(ODE.glob("*.?pp")))
    label = hashlib.sha256(
        " ".join([*words, f"{minutes:g}", str(seed), str(case.carried), program]).encode()
    ).hexdigest()[:12]
    path = folder / f"{number:03d}-{label}.npz"
    if not path.exists():
        poses = ode_poses(folder / PROGRAM, world, duration=60.0 * minutes, seed=seed, law=words)
        partial = path.with_suffix(f".{os.getpid()}.npz")
        np.savez(partial, **poses._asdict())
        partial.replace(path)
    with np.load(path) as stored:
        return world, Poses(*(stored[name] for name in Poses._fields))


def world_of(case: Case, number: int, rng: np.random.Generator) -> World:
    """Draw a world: C_d 0.4 to 0.5, sigma_F 0.5 to 0.7 mN, a flow of one of the two families."""
    drag, force = float(rng.uniform(0.4, 0.5)), float(rng.uniform(0.5e-3, 0.7e-3))
    if case.carried:
        return World(drag, force, *draw_flow(rng, "regular", sink_share=0.0))
    return World(drag, force, *draw_flow(rng, FAMILIES[number % len(FAMILIES)]))


def record(case: Case, poses: Poses, rng: np.random.Generator) -> Any:
    """Return the `trajectory` that the camera of a case makes of the motion."""
    time = INTERVAL_S * np.arange(poses.x.size)
    noisy = [
        part + std * rng.normal(size=time.size) for part, std in zip(poses, NOISE, strict=True)
    ]
    seen = Seen(time, *noisy)
    if case.mistake is not None:
        seen = case.mistake(seen, rng)
    return build_trajectory(
        *seen,
        attrs={
            "arena": Tank(diameter_m=2.0 * RADIUS_M).to_arena_json(),
            "source": "simulated",
            "simulated": "yes",
        },
    )


def version() -> str:
    """Return a number that is another one for another version of the fit's source."""
    files = sorted(file for pattern in SOURCES for file in ROOT.glob(pattern))
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()[:12]


def current(path: Path, minutes: float | None = None) -> list[dict[str, Any]]:
    """Return the results of this version of the fit, of one length where it is given."""
    lines = [one for one in read_lines(path) if one["fit"] == version()]
    return [one for one in lines if minutes is None or one["minutes"] == minutes]


def in_words(line: dict[str, Any]) -> str:
    """Return a result on one line."""
    head = f"{line['case']}, world {line['world']}: "
    if "error" in line:
        return head + line["error"]
    verdict = {True: "explained", False: "not explained", None: "not checked"}[line["explained"]]
    return head + (
        f"C_d {line['drag_coefficient_error']:+.1%}, σ_F {line['force_std_error']:+.1%}, {verdict}"
    )


def _number_at(study: dw.Study, key: str) -> float:
    section, name = key.split(".")
    return float(getattr(getattr(study, section), name))


if __name__ == "__main__":
    main()
