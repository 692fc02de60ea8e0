"""How long the fit of a long recording and its check take, by stage, and their memory.

    python benchmarks/bench_fit.py [--rates 10 100] [--minutes 30]

Recordings of the default study in the bundled flow, simulated, with 0.3 mm and 0.5 degrees of
noise, at each rate [Hz]. One run each in a process of its own, on one thread: processor time of the
fit, of its longest stages and of the check, and the largest resident memory. Compared with the aim:
10 s at 10 Hz, 20 s and 500 MB at 100 Hz, for half an hour.

Checked, else the script fails: C_d and sigma_F are within a fifth of the truth.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from timing import machine

import driftwalk as dw
from driftwalk.likelihood import check_model, fit
from driftwalk.likelihood.law.search import LawSearch
from driftwalk.model import apply_overrides
from driftwalk.schema import build_trajectory

AIM = {10.0: "10 s", 100.0: "20 s, 500 MB"}
TOLERANCE = 0.2
CAMERA = {"observation.position_noise_m": 3e-4, "observation.orientation_noise_rad": 0.00873}
SETTLING_S = 20.0
STAGES: dict[str, tuple[Any, str]] = {
    "prepare": (fit, "prepare"),
    "laws": (LawSearch, "find"),
    "restricted": (fit, "restricted_drag"),
    "angle": (fit, "angle_given_facts"),
}
"""From a stage to where its function stands."""


def recording(rate: float, minutes: float) -> Any:
    """A simulated recording of the default study, as its camera would see it."""
    study = apply_overrides(dw.Study(), CAMERA)
    clock = np.arange(round(60.0 * minutes * rate) + 1) / rate
    run = dw.simulate(
        study, dw.tank30_flow(), sample_time=SETTLING_S + clock, replicates=1, seed=7, threads=1
    )
    pose = (run[name].values[0, :, 0].astype(np.float64) for name in ("x", "y", "theta"))
    return build_trajectory(clock, *pose, attrs={"source": "simulated", "simulated": "yes"})


def timed(stage: str, call: Callable[..., Any], taken: dict[str, float]) -> Callable[..., Any]:
    """A function of the fit that adds its processor time."""

    def found(*args: Any, **options: Any) -> Any:
        begin = time.process_time()
        try:
            return call(*args, **options)
        finally:
            taken[stage] += time.process_time() - begin

    return found


def bench(rate: float, minutes: float) -> None:
    """Fit and check one recording, and print a row."""
    seen, taken = recording(rate, minutes), dict.fromkeys(STAGES, 0.0)
    for stage, (place, name) in STAGES.items():
        setattr(place, name, timed(stage, getattr(place, name), taken))
    begin = time.process_time()
    found = fit.fit_motion(seen)
    middle = time.process_time()
    checked = check_model(found, [seen])
    end = time.process_time()
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    parts = " ".join(f"{one:>10.1f}" for one in taken.values())
    print(
        f"{rate:>7g} {middle - begin:>8.1f} {parts} {end - middle:>8.1f} {end - begin:>8.1f} "
        f"{memory:>9.0f}  {AIM.get(rate, '')}; {checked['verdict'].item()}",
        flush=True,
    )
    forces = dw.Study().forces
    for name, truth in (
        ("drag_coefficient", forces.drag_coefficient),
        ("force_std", forces.force_std_N),
    ):
        value = float(found["estimate"].sel(parameter=name))
        if abs(value / truth - 1.0) > TOLERANCE:
            sys.exit(f"wrong answer: {name} is {value:.4g}, and was {truth:.4g}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rates", type=float, nargs="+", default=[10.0, 100.0])
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--here", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.here:
        bench(options.rates[0], options.minutes)
        return
    print(machine())
    print(f"Processor time [s] of {options.minutes:g} minutes on one thread; memory [MB].")
    stages = " ".join(f"{stage:>10}" for stage in STAGES)
    print(
        f"{'Hz':>7} {'fit':>8} {stages} {'check':>8} {'both':>8} {'memory':>9}  aim; verdict",
        flush=True,
    )
    for rate in options.rates:
        words = [sys.executable, __file__, "--here", "--rates", f"{rate:g}"]
        words += ["--minutes", f"{options.minutes:g}"]
        alone = {**os.environ, "OMP_NUM_THREADS": "1"}
        if subprocess.run(words, check=False, env=alone).returncode:
            sys.exit(1)


if __name__ == "__main__":
    main()
