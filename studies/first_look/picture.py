"""The picture of README.md: a recording, the flow that `driftwalk fit` finds, what blocks build.

$ driftwalk fit recording.csv --tank 30cm --force-interval 16ms -o fit/
$ driftwalk assemble --flow fit/flow.nc --drag-coefficient 0.3928 --force-std 0.6154mN \
    --force-interval 16ms -o four/
$ python studies/first_look/picture.py fit/ four/ docs/images/first_look.png

`recording.csv` is the one in src/driftwalk/datasets/tank30_ode_a.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import xarray as xr

import driftwalk as dw

WIDTH_IN, HEIGHT_IN, DOTS_PER_INCH = 10.5, 3.1, 100
EXCERPT_S = 120.0
TICKS_CM = (-15, 0, 15)


def draw(fit: Path, four: Path, target: Path) -> None:
    """Draw the three panels and write them as a PNG."""
    plt.rcParams["axes.titlesize"] = "medium"
    figure, axes = plt.subplots(
        1,
        3,
        figsize=(WIDTH_IN, HEIGHT_IN),
        width_ratios=(1.0, 1.0, 1.25),
        layout="constrained",
    )
    with xr.open_dataset(fit / "recording.nc", engine="h5netcdf") as recording:
        dw.plot.trajectory(recording, axes[0], stop=EXCERPT_S)
    axes[0].set_title("in: the track of a block (2 of 30 min)")
    with xr.open_dataset(fit / "flow.nc", engine="h5netcdf") as flow:
        dw.plot.flow(flow, axes[1])
    axes[1].set_title("out: the flow, with drag and noise")
    for tank in axes[:2]:
        tank.set_xticks(TICKS_CM)
        tank.set_yticks(TICKS_CM)
    with xr.open_dataset(four / "distribution.nc", engine="h5netcdf") as shares:
        dw.plot.outcomes(shares, axes[2])
    # The caption says how many runs and which intervals.
    axes[2].get_legend().remove()
    axes[2].set_title("next: what four such blocks build")
    figure.savefig(target, dpi=DOTS_PER_INCH)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name, meaning in (
        ("fit", "run directory of driftwalk fit"),
        ("four", "run directory of driftwalk assemble"),
        ("target", "the PNG to write"),
    ):
        parser.add_argument(name, type=Path, help=meaning)
    given = parser.parse_args()
    draw(given.fit, given.four, given.target)
