"""Fit pairs of free blocks that share the force over a known length, and print what is found.

    python studies/bodies/pairs.py [--worlds 8] [--minutes 20] [--lengths 0 0.03 0.1]

The generator is that of the tests, Euler and Maruyama's scheme in plain NumPy.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[2] / "tests" / "helpers"))

from euler_blocks import DEPTH_M, DRAG, MASS_KG, SIDE_M, euler_recordings, stirred

import driftwalk as dw


def main() -> None:
    """Print a row for each world."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--worlds", type=int, default=8)
    parser.add_argument("--minutes", type=float, default=20.0)
    parser.add_argument("--lengths", type=float, nargs="+", default=[0.0, 0.03, 0.1])
    parser.add_argument("--seed", type=int, default=11)
    options = parser.parse_args()
    study = dw.apply_overrides(
        dw.Study(),
        {
            "tank.diameter_m": 0.32,
            "block.side_m": SIDE_M,
            "block.mass_kg": MASS_KG,
            "block.depth_m": DEPTH_M,
            "fit.interaction": True,
        },
    )
    print("| L | distance, 5 % and median | found | 90 % interval | departure | C_d holds |")
    print("| --- | --- | --- | --- | --- | --- |")
    for length in options.lengths:
        for recording in euler_recordings(
            lambda x, y, _: stirred(x, y), worlds=options.worlds, seconds=60.0 * options.minutes,
            seed=options.seed, stirring_length=length,
        ):  # fmt: skip
            apart = np.hypot(*(np.diff(recording[axis].values, axis=1)[:, 0] for axis in "xy"))
            fit = dw.fit_motion(recording, study)
            ends = fit["interval"].sel(parameter=["stirring_length", "drag_coefficient"]).values
            found = float(fit["estimate"].sel(parameter="stirring_length"))
            words = f"{1e3 * found:.1f} mm" if found else "cannot tell"
            near, usual = 100.0 * np.quantile(apart, [0.05, 0.5])
            print(
                f"| {1e3 * length:g} mm | {near:.1f}, {usual:.1f} cm | {words} "
                f"| {1e3 * ends[0, 0]:.1f} to {1e3 * ends[0, 1]:.1f} mm "
                f"| {float(fit['stirring_misfit_std']):.1f} "
                f"| {'yes' if ends[1, 0] <= DRAG <= ends[1, 1] else 'no'} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
