"""Panels on motion models that several figures have: distances by aspect, facts by ratio."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from driftwalk.plot.parts.labels import ratio_axis
from driftwalk.plot.parts.style import INK
from driftwalk.schema.answers.model_comparison import ASPECT_WORDS, CHECK_LABELS

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


def plot_own_aspects(found: xr.Dataset, ax: Axes, *, label: str) -> None:
    """Draw how far the parts of the recording are from each other, and name the aspects."""
    aspects = [str(name) for name in found["aspect"].values]
    place = np.arange(len(aspects))
    ax.plot(found["own_distance"].values, place, "|", ms=9.0, mew=1.4, color=INK, label=label)
    ax.set_yticks(place, [ASPECT_WORDS.get(name, name) for name in aspects])
    ax.invert_yaxis()
    ax.set_xlim(left=0.0)
    ax.set_xlabel("KS distance D")


def plot_check_ratios(
    one: xr.Dataset, ax: Axes, *, color: str, marker: str = "o", shift: float = 0.0
) -> None:
    """Draw the facts of one model's worlds over those of the recording."""
    recorded = one["check_recorded"].values
    place = np.arange(recorded.size, dtype=np.float64)
    low, middle, high = (one[f"check_{name}"].values for name in ("low", "median", "high"))
    # On a logarithmic axis there is no place for what is 0.
    known = (low > 0.0) & (recorded > 0.0) & np.isfinite(low + middle + high)
    low, middle, high = (part[known] / recorded[known] for part in (low, middle, high))
    ax.errorbar(
        middle, place[known] + shift, xerr=[middle - low, high - middle], fmt=marker, ms=3.0,
        lw=0.9, color=color,
    )  # fmt: skip


def label_checks(found: xr.Dataset, ax: Axes) -> None:
    """Name the facts, and draw the line on which model and recording agree."""
    names = [str(name) for name in found["check"].values]
    ax.axvline(1.0, color=INK, lw=0.6)
    ratio_axis(ax)
    ax.set_yticks(np.arange(len(names)), [CHECK_LABELS.get(name, name) for name in names])
    ax.invert_yaxis()
    ax.set_xlabel("model / recording")
