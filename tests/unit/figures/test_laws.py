"""The figure of compared laws: an axis that can be read, and nothing left out in silence."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from driftwalk.figures import laws_figures, write_figures
from driftwalk.figures.fit import plot_laws
from driftwalk.plot.parts.style import new_figure


def compared(scores: list[float]) -> xr.Dataset:
    values = {"compared_log_score": ("compared_law", scores)}
    values["compared_log_score_std"] = ("compared_law", [0.05] * len(scores))
    values["compared_log_evidence"] = ("compared_law", scores)
    return xr.Dataset(values, {"compared_law": [f"law {k}" for k in range(len(scores))]})


@pytest.mark.parametrize(("worst", "scale"), [(0.9, "linear"), (-9.0, "symlog")])
def test_the_axis_fits_the_losses(worst: float, scale: str) -> None:
    figure = new_figure(width_mm=120.0, height_mm=55.0)
    ax = plot_laws(compared([1.0, 0.98, worst]), figure.add_subplot())
    assert ax.get_xscale() == scale
    assert [label.get_text() for label in ax.get_yticklabels()] == ["law 2", "law 1", "law 0"]
    assert ax.get_title() == ""
    figure.draw_without_rendering()
    boxes = [one.get_window_extent() for one in ax.get_xticklabels() if one.get_text()]
    low, high = sorted(ax.transData.transform([(x, 0.0) for x in ax.get_xlim()])[:, 0])
    shown = sorted((b for b in boxes if low <= 0.5 * (b.x0 + b.x1) <= high), key=lambda b: b.x0)
    assert all(left.x1 < right.x0 for left, right in pairwise(shown))
    label = ax.xaxis.label.get_window_extent()
    assert 0.0 <= label.x0 < label.x1 <= figure.bbox.width


def test_laws_without_a_solution_are_counted(tmp_path: Path) -> None:
    fit = compared([1.0, np.nan, 0.9])
    ax = plot_laws(fit, new_figure(width_mm=120.0, height_mm=55.0).add_subplot())
    assert ax.get_title(loc="right") == "not shown, without a solution: 1"
    written = write_figures(laws_figures(fit), tmp_path)
    assert [path.name for path in written] == ["laws.png", "laws.svg"]
