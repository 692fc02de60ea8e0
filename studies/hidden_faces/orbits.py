"""How assemblies of each size go round the tank: python orbits.py.

Prints, with and without drag on hidden faces: distance of the centre of mass from the tank's centre
(median), its speed, its turns about the tank's centre, and the spin of the assembly. 400 runs, from
10 s on.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from model import CALIBRATED, study_of

import driftwalk as dw

if TYPE_CHECKING:
    import xarray as xr

Floats = npt.NDArray[np.float64]

RUNS = 400
INTERVAL_S = 0.1
SETTLED_S = 10.0


def sizes_and_centres(path: xr.Dataset) -> tuple[npt.NDArray[np.int64], Floats]:
    """Return size and centre of mass (as a complex number) of every block's assembly."""
    root = path["assembly"].values
    together = root[..., :, None] == root[..., None, :]
    size = together.sum(axis=-1)
    place = path["x"].values + 1j * path["y"].values.astype(float)
    return size, (together * place[..., None, :]).sum(axis=-1) / size


def print_rows(faces: str) -> None:
    """Simulate with one rule for hidden faces, and print a row for every size."""
    path = dw.assembly_path(
        study_of(faces),
        dw.tank30_flow(),
        runs=range(RUNS),
        sample_interval=INTERVAL_S,
        drag_coefficient=CALIBRATED[0],
        force_std=CALIBRATED[1],
    )
    size, centre = sizes_and_centres(path)
    interval = np.diff(path["time"].values)[None, :, None]
    speed = np.abs(np.diff(centre, axis=1)) / interval
    orbit = np.angle(centre[:, 1:] / centre[:, :-1]) / interval
    spin = np.angle(np.exp(1j * np.diff(path["theta"].values, axis=1))) / interval
    kept = (size[:, 1:] == size[:, :-1]) & (path["time"].values[None, 1:, None] > SETTLED_S)
    for blocks in np.unique(size):
        of = kept & (size[:, 1:] == blocks)
        print(
            f"| {faces} | {blocks} | {100 * np.median(np.abs(centre[:, 1:])[of]):.1f} cm "
            f"| {100 * speed[of].mean():.1f} cm/s | {orbit[of].mean():.2f} rad/s "
            f"| {spin[of].mean():.2f} rad/s |"
        )


def main() -> None:
    """Print both tables."""
    print("| hidden faces | blocks | from the centre | speed | orbit | spin |")
    print("|---|---|---|---|---|---|")
    for faces in ("full", "none"):
        print_rows(faces)


if __name__ == "__main__":
    main()
