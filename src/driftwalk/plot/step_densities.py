"""The joint distribution of step length and turning angle, with its marginals (Fig. 5b)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError
from driftwalk.plot.parts.labels import ANGLE_LABEL, FACTORS, LENGTH_LABEL
from driftwalk.plot.parts.style import DENSITY_COLORMAP, MUTED, PALE, add_colorbar, axes_or_new

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh

Array = npt.NDArray[np.float64]
Marginals = Literal["shown", "none"]
BINS = 48
# Axes and bins reach over the central part of the steps; one wild step must not squeeze the rest.
SHOWN_FRACTION = 0.9995
# Colour grows with the root of the density: the tails show, and so does the shape of the peak.
COLOR_POWER = 0.5
DENSITY_LABEL = "density of steps (% mm⁻¹ °⁻¹)"
MM_PER_M = FACTORS["m", "mm"]
DEGREES = FACTORS["rad", "°"]


def plot_steps(
    step_length: npt.ArrayLike,
    turning_angle: npt.ArrayLike,
    ax: Axes | None = None,
    *,
    bins: int = BINS,
    marginals: Marginals = "shown",
) -> Axes:
    """Draw the joint density of steps as a histogram, with the two marginals at its sides.

    Bins span the central 99.95 % of either quantity; steps beyond are left out of the picture, yet
    count in the shares.

    Parameters
    ----------
    step_length : array_like, shape (n,)
        Step lengths [m].
    turning_angle : array_like, shape (n,)
        Turning angles [rad, in (-pi, pi]] (the paper's step angles).
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.
    bins : int
        Bins along either axis.
    marginals : {"shown", "none"}
        Whether to draw the marginals.

    Returns
    -------
    matplotlib.axes.Axes
        The axes of the joint density.

    Raises
    ------
    InputError
        When the two differ in length, or no step is finite.

    Examples
    --------
    >>> plot_steps([0.005, 0.006], [0.1, 0.2]).get_xlabel()
    'step length (mm)'
    """
    length, angle = (
        np.asarray(values, dtype=np.float64) for values in (step_length, turning_angle)
    )
    if length.shape != angle.shape or length.ndim != 1:
        raise InputError(
            f"step lengths {length.shape} and turning angles {angle.shape} are not two lists of "
            "the same length"
        )
    finite = np.isfinite(length) & np.isfinite(angle)
    if not finite.any():
        raise InputError("there is no step to draw: no pair of length and angle is finite")
    length, angle = length[finite], angle[finite]
    edges = tuple(_edges(values, bins) for values in (length, angle))
    count, length_edge, angle_edge = np.histogram2d(length, angle, bins=edges)
    return plot_step_density(
        count / length.size, length_edge, angle_edge, ax, marginals=marginals, limits="all"
    )


def plot_step_density(
    density: npt.ArrayLike,
    step_length_edge: npt.ArrayLike,
    turning_angle_edge: npt.ArrayLike,
    ax: Axes | None = None,
    *,
    marginals: Marginals = "shown",
    limits: Literal["filled", "all"] = "filled",
    colorbar: Literal["beside", "none"] = "beside",
) -> Axes:
    """Draw steps that are already binned, as a calibration stores them, as a density.

    Parameters
    ----------
    density : array_like, shape (lengths, angles)
        Fraction of the steps in each bin.
    step_length_edge : array_like, shape (lengths + 1,)
        Edges of the bins [m].
    turning_angle_edge : array_like, shape (angles + 1,)
        Edges of the bins [rad].
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.
    marginals : {"shown", "none"}
        Whether to draw the marginals.
    limits : {"filled", "all"}
        Show the bins that hold the central 99.95 % of the steps, or every bin.
    colorbar : {"beside", "none"}
        Whether to add a colour bar.

    Returns
    -------
    matplotlib.axes.Axes
        The axes of the joint density.

    Raises
    ------
    InputError
        When the shape does not belong to the edges.

    Examples
    --------
    >>> plot_step_density([[0.5, 0.5]], [0.0, 0.01], [-1.0, 0.0, 1.0]).get_ylabel()
    'turning (step) angle (°)'
    """
    share, length_mm, angle_deg = _checked(density, step_length_edge, turning_angle_edge)
    ax = axes_or_new(ax)
    mesh = density_mesh(ax, share, length_mm, angle_deg)
    if limits == "filled":
        ax.set_xlim(*filled_range(share.sum(axis=1), length_mm))
        ax.set_ylim(*filled_range(share.sum(axis=0), angle_deg))
    ax.set_xlabel(LENGTH_LABEL)
    ax.set_ylabel(ANGLE_LABEL)
    if marginals == "shown":
        _draw_marginals(ax, share, length_mm, angle_deg)
    if colorbar == "beside":
        add_colorbar(mesh, ax, DENSITY_LABEL)
    return ax


def density_mesh(
    ax: Axes, share: Array, length_mm: Array, angle_deg: Array, *, top: float | None = None
) -> QuadMesh:
    """Draw shares [fraction per bin] as a density [% mm⁻¹ °⁻¹]; empty bins stay white.

    `top` is the top of the colour scale in the same unit; default: the largest density.
    """
    from matplotlib.colors import PowerNorm

    density = density_of(share, length_mm, angle_deg)
    highest = (float(density.max(initial=0.0)) if top is None else top) or 1.0
    mesh = ax.pcolormesh(
        length_mm,
        angle_deg,
        np.ma.masked_equal(density.T, 0.0),
        cmap=DENSITY_COLORMAP,
        norm=PowerNorm(COLOR_POWER, vmin=0.0, vmax=highest),
    )
    mesh.set_rasterized(True)
    ax.axhline(0.0, color=MUTED, lw=0.5, dashes=(4, 3))
    return mesh


def density_of(share: Array, length_mm: Array, angle_deg: Array) -> Array:
    """Return shares per bin [1] as a density [% mm⁻¹ °⁻¹], whatever the sizes of the bins."""
    density: Array = 100.0 * share / np.outer(np.diff(length_mm), np.diff(angle_deg))
    return density


def filled_range(marginal: Array, edge: Array) -> tuple[float, float]:
    """Return the outer edges of the bins that hold the central 99.95 % of a marginal."""
    total = marginal.sum()
    if not total > 0.0:
        return float(edge[0]), float(edge[-1])
    below = np.cumsum(marginal) / total
    tail = (1.0 - SHOWN_FRACTION) / 2.0
    first = int(np.searchsorted(below, tail, side="right"))
    last = int(np.searchsorted(below, 1.0 - tail, side="left"))
    return float(edge[first]), float(edge[min(last, marginal.size - 1) + 1])


def _draw_marginals(ax: Axes, share: Array, length_mm: Array, angle_deg: Array) -> None:
    """Add the two marginals along the upper and right edges."""
    from matplotlib.ticker import NullLocator

    top = ax.inset_axes((0.0, 1.02, 1.0, 0.16), sharex=ax)
    right = ax.inset_axes((1.02, 0.0, 0.16, 1.0), sharey=ax)
    style: dict[str, Any] = {"fill": True, "facecolor": PALE, "edgecolor": MUTED, "linewidth": 0.7}
    top.stairs(share.sum(axis=1) / np.diff(length_mm), length_mm, **style)
    right.stairs(
        share.sum(axis=0) / np.diff(angle_deg), angle_deg, orientation="horizontal", **style
    )
    top.set_ylim(bottom=0.0)
    right.set_xlim(left=0.0)
    for side, name in ((top, "step length"), (right, "turning angle")):
        side.set_label(f"marginal of {name}")
        side.spines[["top", "right", "left", "bottom"]].set_visible(False)
        side.tick_params(bottom=False, left=False, labelbottom=False, labelleft=False)
    top.yaxis.set_major_locator(NullLocator())
    right.xaxis.set_major_locator(NullLocator())


def _edges(values: Array, bins: int) -> Array:
    """Return even bin edges over the central part of the values."""
    tail = (1.0 - SHOWN_FRACTION) / 2.0
    low, high = np.quantile(values, [tail, 1.0 - tail])
    margin = 0.03 * (high - low) or 0.5 * abs(high) or 1.0
    edges: Array = np.linspace(low - margin, high + margin, bins + 1)
    return edges


def _checked(
    density: npt.ArrayLike, step_length_edge: npt.ArrayLike, turning_angle_edge: npt.ArrayLike
) -> tuple[Array, Array, Array]:
    share = np.nan_to_num(np.asarray(density, dtype=np.float64))
    length_mm = MM_PER_M * np.asarray(step_length_edge, dtype=np.float64)
    angle_deg = DEGREES * np.asarray(turning_angle_edge, dtype=np.float64)
    if share.shape != (length_mm.size - 1, angle_deg.size - 1):
        raise InputError(
            f"a density of shape {share.shape} does not belong to {length_mm.size} edges of step "
            f"length and {angle_deg.size} edges of turning angle: expected one bin less than edges"
        )
    return share, length_mm, angle_deg
