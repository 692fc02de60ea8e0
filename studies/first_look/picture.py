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

WIDTH_IN, HEIGHT_IN, DOTS_PER_INCH = 8.35, 2.8, 220
# All three axes stand on one line and have one height: left, width [in].
BOTTOM_IN, AXES_IN = 0.78, 1.7
PLACES_IN = ((0.55, 1.7), (3.4, 1.7), (6.35, 1.9))
EXCERPT_S = 120.0
LEAST_SHARE = 0.01
TICKS_CM = (-15, 0, 15)


def draw(fit: Path, four: Path, target: Path) -> None:
    """Draw the three panels and write them as a PNG."""
    plt.rcParams.update({"font.size": 8.0, "axes.titlesize": 8.5, "axes.titlepad": 7.0})
    figure = plt.figure(figsize=(WIDTH_IN, HEIGHT_IN))
    axes = [
        figure.add_axes(
            (left / WIDTH_IN, BOTTOM_IN / HEIGHT_IN, width / WIDTH_IN, AXES_IN / HEIGHT_IN)
        )
        for left, width in PLACES_IN
    ]
    with xr.open_dataset(fit / "recording.nc", engine="h5netcdf") as recording:
        dw.plot.trajectory(recording, axes[0], stop=EXCERPT_S)
    axes[0].set_title("in: a block's track (2 of 30 min)")
    with xr.open_dataset(fit / "flow.nc", engine="h5netcdf") as flow:
        dw.plot.flow(flow, axes[1])
    axes[1].set_title("out: flow, drag and noise")
    axes[1].set_xlabel("x (cm); hatched: not measured")
    for tank, (left, width) in zip(axes[:2], PLACES_IN, strict=False):
        tank.set_xticks(TICKS_CM)
        tank.set_yticks(TICKS_CM)
        tank.set_position(
            (left / WIDTH_IN, BOTTOM_IN / HEIGHT_IN, width / WIDTH_IN, AXES_IN / HEIGHT_IN)
        )
    bars = [ax for ax in figure.axes if ax not in axes]
    for bar, (left, width) in zip(bars, PLACES_IN, strict=False):
        place = ((left + width + 0.06) / WIDTH_IN, BOTTOM_IN / HEIGHT_IN)
        bar.set_axes_locator(None)
        bar.set_position((*place, 0.09 / WIDTH_IN, AXES_IN / HEIGHT_IN))
        bar.set_aspect("auto")
    with xr.open_dataset(four / "distribution.nc", engine="h5netcdf") as shares:
        # What nearly no run builds needs no bar in a first look: the label says so.
        shown = shares.isel({"class": shares["proportion"].values >= LEAST_SHARE})
        dw.plot.outcomes(shown, axes[2])
    # The caption says how many runs and which intervals.
    axes[2].get_legend().remove()
    axes[2].set_xlabel(
        f"classes of {100 * LEAST_SHARE:g} % or more", labelpad=axes[2].xaxis.labelpad
    )
    axes[2].set_title("next: what four blocks build")
    axes[2].spines[["top", "right"]].set_visible(False)
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
