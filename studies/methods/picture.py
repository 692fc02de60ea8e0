"""Draw the results: python studies/methods/picture.py OUT FOLDER, with the OUT of run.py."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from recordings import Known, bundled
from run import read_lines

import driftwalk as dw
from driftwalk.likelihood.score import block_flow
from driftwalk.plot.parts.arena import draw_arena, label_position
from driftwalk.plot.parts.style import (
    DOUBLE_COLUMN_MM,
    INK,
    MUTED,
    PALE,
    add_colorbar,
    letter_panels,
    new_figure,
    print_style,
    speed_colormap,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DPI = 130
STYLES = {
    "fit, angle state": ("likelihood fit, orientation as a state", "#0072B2", "o"),
    "fit, angle given": ("likelihood fit, orientation as input", "#56B4E9", "s"),
    "fit, angle none": ("likelihood fit without orientation", "#009E73", "^"),
    "KS grid, own flow": ("the paper's: KS grid, flow by cell means", "#D55E00", "X"),
    "KS grid, fitted flow": ("KS grid in the fitted flow", "#E69F00", "D"),
    "KS grid, true flow": ("KS grid in the true flow", "#6b6b6b", "P"),
}
"""Name, colour (Okabe and Ito) and marker of each method."""
LEAST_SAMPLES = 3
RATIOS = (0.23, 5.0)
"""Ratio of an estimate to the truth; an arrow at the edge marks a ratio beyond it."""


def main() -> None:
    """Write the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("folder", type=Path)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    lines = read_lines(options.out / "results.jsonl")
    with print_style():
        for name, figure in (
            ("estimates", estimates(lines)),
            ("distances", distances(lines)),
            ("flow_errors", flow_errors(next(bundled()), options.out)),
        ):
            path = options.folder / f"{name}.png"
            figure.savefig(path, dpi=DPI, metadata={"Software": None})


def estimates(lines: list[dict[str, Any]]) -> Figure:
    """Draw estimates over truth with their intervals, and the error of the flow."""
    names = list(dict.fromkeys(line["recording"] for line in lines))
    figure = new_figure(width_mm=DOUBLE_COLUMN_MM, height_mm=140.0)
    axes = figure.subplots(1, 3, sharey=True, width_ratios=(1.0, 1.0, 0.7))
    order = list(STYLES)
    for line in lines:
        label, color, marker = STYLES[line["method"]]
        place = order.index(line["method"])
        y = names.index(line["recording"]) + 0.13 * (place - 2.5)
        for ax, name in zip(axes, ("drag_coefficient", "force_std_N"), strict=False):
            truth = line[f"{name}_true"]
            low, high = line[f"{name}_low"] / truth, line[f"{name}_high"] / truth
            ratio = float(np.clip(line[name] / truth, *RATIOS))
            shown = {RATIOS[0]: "<", RATIOS[1]: ">"}.get(ratio, marker)
            ax.plot(np.clip([low, high], *RATIOS), [y, y], color=color, linewidth=1.2)
            ax.plot(
                ratio, y, shown, color=color, markersize=4.0,
                label=label if shown == marker else None,
            )  # fmt: skip
        if line["method"] != "KS grid, true flow":
            axes[2].plot(100.0 * line["flow_error"], y, marker, color=color, markersize=4.0)
    for ax, label in zip(axes, ("$C_d$ / truth", r"$\sigma_F$ / truth"), strict=False):
        ax.axvline(1.0, color=INK, linewidth=0.7, zorder=0)
        ax.set_xscale("log")
        ax.set_xticks([0.25, 0.5, 1.0, 2.0, 4.0], ["¼", "½", "1", "2", "4"])
        ax.minorticks_off()
        ax.set_xlim(0.9 * RATIOS[0], 1.1 * RATIOS[1])
        ax.set_xlabel(label)
    axes[2].set_xscale("log")
    axes[2].set_xticks([0.5, 1, 2, 5, 10, 20, 50], ["0.5", "1", "2", "5", "10", "20", "50"])
    axes[2].minorticks_off()
    axes[2].set_xlabel("block flow error (%)")
    axes[0].set_yticks(range(len(names)), names)
    axes[0].invert_yaxis()
    for ax in axes:
        for row in range(1, len(names)):
            ax.axhline(row - 0.5, color=PALE, linewidth=0.8, zorder=0)
    letter_panels(list(axes), ["drag coefficient", "stochastic force", "flow"])
    handles, labels = axes[0].get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    wanted = [STYLES[name][0] for name in order if STYLES[name][0] in unique]
    figure.legend([unique[name] for name in wanted], wanted, loc="outside lower center", ncols=3)
    return figure


def distances(lines: list[dict[str, Any]]) -> Figure:
    """Draw how wrong C_d is against the distance that the method reached."""
    figure = new_figure(width_mm=120.0, height_mm=86.0)
    ax = figure.subplots()
    seen: set[str] = set()
    for line in lines:
        label, color, marker = STYLES[line["method"]]
        ax.plot(
            line["ks_distance"] / line["ks_noise_floor"],
            max(100.0 * abs(line["drag_coefficient_error"]), 0.1),
            marker,
            color=color,
            markersize=5.0,
            label=None if label in seen else label,
            linestyle="none",
        )
        seen.add(label)
    ax.axvline(2.0, color=MUTED, linewidth=0.8, linestyle="--", zorder=0)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xticks([1, 2, 5, 10, 20], ["1", "2", "5", "10", "20"])
    ax.set_yticks([0.1, 1, 10, 100], ["0.1", "1", "10", "100"])
    ax.minorticks_off()
    ax.annotate(
        "from here on\ncalibrate warns", (2.0, 0.13), xytext=(3, 0), textcoords="offset points",
        fontsize=6.5, color=MUTED,
    )  # fmt: skip
    ax.set_xlabel("KS distance D at the estimate / its noise floor")
    ax.set_ylabel("error of $C_d$, size (%)")
    figure.legend(loc="outside lower center", ncols=2)
    return figure


def flow_errors(known: Known, out: Path) -> Figure:
    """Draw the true flow of a recording, and the errors of the paper's and of the fitted flow."""
    found = {
        method: xr.load_dataset(out / f"{known.name} - {method}.nc", engine="h5netcdf")
        for method in ("KS grid, own flow", "fit, angle state")
    }
    figure = new_figure(width_mm=DOUBLE_COLUMN_MM, height_mm=62.0, layout="compressed")
    axes = list(figure.subplots(1, 3))
    dw.plot.flow(known.flow, axes[0])
    grid = found["fit, angle state"]
    x, y = grid["x"].values, grid["y"].values
    at_x, at_y = (part.ravel() for part in np.meshgrid(x, y))
    side = known.study.block.side_m
    truth = block_flow(known.flow, at_x, at_y, side=side)
    visited = grid["count"].values.ravel() >= LEAST_SAMPLES
    errors = [
        np.where(
            visited,
            100.0 * np.hypot(*(block_flow(flow, at_x, at_y, side=side) - truth).T),
            np.nan,
        ).reshape(y.size, x.size)
        for flow in found.values()
    ]
    top = float(np.nanquantile(errors[0], 0.98))
    for ax, error in zip(axes[1:], errors, strict=True):
        mesh = draw_error(ax, x, y, error, top, known)
    add_colorbar(mesh, axes[1:], "error (cm/s)")
    letter_panels(axes, ["the true flow", "error: the paper's flow", "error: driftwalk fit"])
    return figure


def draw_error(
    ax: Axes, x: np.ndarray, y: np.ndarray, error: np.ndarray, top: float, known: Known
) -> Any:
    """Draw one map of errors [cm/s]; where the block has not been it is blank."""
    mesh = ax.pcolormesh(
        100.0 * x, 100.0 * y, error, cmap=speed_colormap(), vmin=0.0, vmax=top, shading="nearest"
    )
    outline = draw_arena(ax, known.study.tank.to_arena())
    if outline is not None:
        mesh.set_clip_path(outline)
    label_position(ax)
    return mesh


if __name__ == "__main__":
    main()
