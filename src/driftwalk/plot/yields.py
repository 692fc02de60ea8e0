"""The yield of self-assembly: the front of yield and time, and the settings with their standing."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from driftwalk.plot.assembly_courses import TIME_LABEL
from driftwalk.plot.parts import style
from driftwalk.plot.parts.labels import set_symbols
from driftwalk.plot.parts.outcome_classes import check_kind
from driftwalk.schema.answers.yields import point_words, varied
from driftwalk.schema.shapes import short_class

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

MOST_SETTINGS = 16
"""Settings that are drawn as rows; chosen by hand."""
MARKERS = {"best": "o", "alike": "s", "worse": "x"}
WORDS = {"alike": "cannot be distinguished"}


def plot_yield_front(found: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the largest yield over time with its exact interval, and the settings that give it.

    Parameters
    ----------
    found : xarray.Dataset
        A `yield`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When the dataset is of another kind.

    Examples
    --------
    ``plot_yield_front(found)``
    """
    check_kind(found, "yield", "time", "share", "front_yield", "front_setting")
    ax = style.axes_or_new(ax, height_mm=80.0)
    time = found["time"].values
    ax.fill_between(
        time, found["front_yield_low"], found["front_yield_high"], color=style.MUTED, alpha=0.3,
        lw=0, label=f"best of each time, {100 * found.attrs['confidence']:.3g} % interval",
    )  # fmt: skip
    ahead = np.bincount(found["front_setting"].values, minlength=found.sizes["setting"])
    ahead[int(found.attrs["best"])] += time.size
    leading = np.argsort(-ahead, kind="stable")[: int((ahead > 0).sum())]
    words, shared = _setting_labels(found, leading)
    for at, label in zip(leading, words, strict=True):
        ax.plot(time, found["share"].values[at], label=label)
    by = found.attrs["by_s"]
    ax.axvline(by, color=style.MUTED, lw=0.6, ls="--", label=f"deadline {by:g} s")
    target = short_class(str(found.attrs["target"]))
    ax.set(
        xlabel="\n".join(filter(None, [TIME_LABEL, shared])), xlim=(time[0], time[-1]),
        ylabel=f"share of runs with {target}", ylim=(0.0, None),
    )  # fmt: skip
    # Above: the band is anywhere.
    style.legend_on_axes(ax)
    ax.spines[["top", "right"]].set_visible(False)
    return ax


def plot_yield_settings(found: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw how much less than the best each setting gives, with its interval, the best on top.

    Parameters
    ----------
    found : xarray.Dataset
        A `yield`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When the dataset is of another kind.

    Examples
    --------
    ``plot_yield_settings(found)``
    """
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    check_kind(found, "yield", "difference", "standing")
    behind = found["difference"].values
    order = np.argsort(behind + (found["standing"].values == "worse"), kind="stable")
    order = order[:MOST_SETTINGS]
    words, shared = _setting_labels(found, order)
    # Twenty letters leave half of one column of a page to the points; 6 mm for a setting, 32 mm for
    # legend and axis.
    wide = max(map(len, words)) > 20
    ax = style.axes_or_new(ax, height_mm=6.0 * len(order) + 32.0, wide=wide)
    for row, at in enumerate(order):
        one = found.isel(setting=at)
        less, low, high = (float(one[f"difference{end}"]) for end in ("", "_low", "_high"))
        word = str(one["standing"].values)
        color = style.MUTED if word == "worse" else style.BLUE
        ax.errorbar(
            -less, row, xerr=[[high - less], [less - low]], fmt=MARKERS[word], color=color,
            ms=3.0, lw=0.8, label=WORDS.get(word, word),
        )  # fmt: skip
    within = found.attrs["indifference"]
    ax.axvspan(-within, 0.0, color=style.MUTED, alpha=0.2, lw=0, label=f"within {100 * within:g} %")
    ax.set_yticks(range(len(order)), words)
    ax.set_ylim(len(order) - 0.4, -0.6)
    ax.locator_params(axis="x", nbins=5)
    ax.set_xlabel("\n".join(filter(None, ["yield, less the best one", shared])))
    ax.spines[["top", "right"]].set_visible(False)
    handles, texts = ax.get_legend_handles_labels()
    keys = dict(zip(texts, handles, strict=True))
    ax.legend(
        list(keys.values()), list(keys), loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2,
    )  # fmt: skip
    engine = style.figure_of(ax).get_layout_engine()
    if isinstance(engine, ConstrainedLayoutEngine):
        # Long labels are wider in the file than as the layout measures them.
        engine.set(w_pad=0.1)
    return ax


def _setting_labels(found: xr.Dataset, shown: npt.NDArray[np.intp]) -> tuple[list[str], str]:
    """Return what tells the shown settings apart, of each, and what they have in common."""
    points = [{name: found[name].values[at] for name in varied(found)} for at in shown]
    alike = [name for name in points[0] if all(one[name] == points[0][name] for one in points)]
    several = [name for name in points[0] if name not in alike or len(points) == 1]
    each = [{name: one[name] for name in several} for one in points]
    shared = {name: points[0][name] for name in alike if name not in several}
    return [set_symbols(point_words(one)) for one in each], set_symbols(point_words(shared))
