"""How large assemblies are, and how they grow: for many blocks, where classes say little."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.plot.class_courses import TIME_LABEL
from driftwalk.plot.parts.assembly_labels import check_kind, percent, runs_text
from driftwalk.plot.parts.style import BLUE, ORANGE, axes_or_new

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

BAR_WIDTH: Final = 0.76
GROWTH: Final = {
    "mean size": {"mean_size": "mean size"},
    "shares": {"largest_share": "in the largest assembly", "free_share": "alone"},
}
DASHES: Final = ("-", (0, (5, 2)))


def plot_assembly_sizes(
    sizes: xr.Dataset,
    ax: Axes | None = None,
    *,
    beside: xr.Dataset | None = None,
    labels: tuple[str, str] = ("", ""),
) -> Axes:
    """Draw which share of the blocks is in assemblies of each size at the end of the runs.

    Parameters
    ----------
    sizes : xarray.Dataset
        An `assembly_sizes`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.
    beside : xarray.Dataset, optional
        A second one of as many blocks, drawn next to the first.
    labels : tuple of str
        Names of the first and the second, for the legend.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When a dataset is of another kind or lacks what is drawn.

    Examples
    --------
    ``plot_assembly_sizes(sizes).figure.savefig("sizes.png")``
    """
    both = [sizes] if beside is None else [sizes, beside]
    for one in both:
        check_kind(one, "assembly_sizes", "size", "size_to", "block_share")
    ax = axes_or_new(ax, height_mm=65.0)
    place = np.arange(sizes.sizes["size"])
    width = BAR_WIDTH / len(both)
    for index, (one, color) in enumerate(zip(both, (BLUE, ORANGE), strict=False)):
        share, low, high = (one[f"block_share{end}"].values for end in ("", "_low", "_high"))
        ax.bar(
            place + (index - (len(both) - 1) / 2) * width, share, width, color=color,
            yerr=None if np.isnan(low).any() else [share - low, high - share],
            error_kw={"elinewidth": 0.8}, label=labels[index] or None,
        )  # fmt: skip
    ends = zip(sizes["size"].values, sizes["size_to"].values, strict=True)
    ax.set_xticks(place, [str(a) if a == b else f"{a}–{b}" for a, b in ends], rotation=45)
    ax.set_ylim(bottom=0.0)
    ax.set_xlabel("blocks in the assembly")
    ax.set_ylabel("share of the blocks")
    _finish(ax, both)
    return ax


def plot_growth(
    sizes: xr.Dataset,
    ax: Axes | None = None,
    *,
    beside: xr.Dataset | None = None,
    labels: tuple[str, str] = ("", ""),
    what: Literal["mean size", "shares"] = "mean size",
) -> Axes:
    """Draw how assemblies grow over time, with the bands of the means over runs.

    Parameters
    ----------
    sizes : xarray.Dataset
        An `assembly_sizes`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.
    beside : xarray.Dataset, optional
        A second one, drawn in the second colour.
    labels : tuple of str
        Names of the first and the second, for the legend.
    what : {"mean size", "shares"}
        The mean size of the assemblies, or the shares of the blocks that are in the largest
        assembly and alone.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When a dataset is of another kind or lacks what is drawn, or `what` is not known.

    Examples
    --------
    ``plot_growth(sizes, what="shares")``
    """
    if what not in GROWTH:
        raise InputError(f"what='{what}': choose {' or '.join(GROWTH)}")
    both = [sizes] if beside is None else [sizes, beside]
    curves = GROWTH[what]
    for one in both:
        check_kind(one, "assembly_sizes", "time", *curves)
    ax = axes_or_new(ax, height_mm=65.0)
    time = sizes["time"].values
    for one, color, label in zip(both, (BLUE, ORANGE), labels, strict=False):
        for (name, words), dashes in zip(curves.items(), DASHES, strict=False):
            text = ", ".join(part for part in (words if len(curves) > 1 else "", label) if part)
            ax.plot(one["time"], one[name], color=color, ls=dashes, lw=1.3, label=text or None)
            ends = (one[f"{name}_low"].values, one[f"{name}_high"].values)
            ax.fill_between(one["time"].values, *ends, color=color, alpha=0.2, lw=0)
    ax.set_xlim(time[0], time[-1])
    ax.set_ylim(bottom=0.0)
    if what == "shares":
        ax.set_ylim(0.0, 1.02)
    ax.set_xlabel(TIME_LABEL)
    ax.set_ylabel("blocks per assembly, mean" if what == "mean size" else "share of the blocks")
    _finish(ax, both)
    return ax


def _finish(ax: Axes, both: list[xr.Dataset]) -> None:
    """Say of how many runs it is, and name the curves where there are several."""
    ax.spines[["top", "right"]].set_visible(False)
    intervals = f"intervals: {percent(both[0].attrs['confidence'])}"
    ax.set_title(", ".join(part for part in (runs_text(both[0]), intervals) if part), loc="left")
    if ax.get_legend_handles_labels()[1]:
        ax.legend()
