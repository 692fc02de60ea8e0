"""Write two recordings of the other engine as small files, for the tests.

    python studies/likelihood/bundle.py OUT tests/data/ode_recordings

OUT is that of run.py. Lengths in 10 µm, angles in 0.1 mrad, velocities in 10 µm/s, all whole.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from study_sets import Case, cases_of, load_motion, record

NUMBERS = (2, 3)
"""One of each family."""
METRE, RADIAN = 1e5, 1e4


def write_small(case: Case, recordings: Path, folder: Path) -> None:
    """Write a recording with its noise, its flow and its parameters."""
    world, poses = load_motion(recordings / case.file)
    seen = record(case, poses)
    whole = {
        "x": seen["x"].values[:, 0] * METRE,
        "y": seen["y"].values[:, 0] * METRE,
        "theta": seen["theta"].values[:, 0] * RADIAN,
        "u": world.u * METRE,
        "v": world.v * METRE,
    }
    np.savez_compressed(
        folder / case.file,
        drag_coefficient=world.drag_coefficient,
        force_std_N=world.force_std_N,
        **{name: np.round(values).astype(np.int16) for name, values in whole.items()},
    )


def main() -> None:
    """Write the files."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("folder", type=Path)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    for case in cases_of("ode"):
        if case.number in NUMBERS:
            write_small(case, options.out / "recordings", options.folder)


if __name__ == "__main__":
    main()
