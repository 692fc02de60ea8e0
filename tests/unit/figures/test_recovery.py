"""The figures of a recovery study: what is drawn is what is in the dataset."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.axes import Axes
from recovery_worlds import synthetic_recovery

from driftwalk.core.errors import InputError
from driftwalk.figures import (
    plot_flow_recovery,
    plot_recovery,
    plot_recovery_error,
    recovery_figures,
    write_figures,
)
from driftwalk.page.sections.recovery import recovery_sections


@pytest.fixture(scope="module")
def recovery() -> xr.Dataset:
    return synthetic_recovery(recordings=4)


def points(ax: Axes) -> np.ndarray:
    """Return the heights of all markers, sorted."""
    lines = [line for line in ax.lines if line.get_marker() == "o"]
    return np.sort(np.concatenate([np.asarray(line.get_ydata(), float) for line in lines]))


@pytest.mark.parametrize(
    ("name", "factor", "truth", "label"),
    [
        ("drag_coefficient", 1.0, 0.4, "$C_d$"),
        ("force_std", 1e3, 0.6, "$\\sigma_F$ (mN)"),
        ("tracking_noise", 1e3, 0.3, "tracking noise (mm)"),
    ],
)
def test_estimates_beside_the_truth(
    recovery: xr.Dataset, name: str, factor: float, truth: float, label: str
) -> None:
    ax = plot_recovery(recovery, name)
    assert points(ax) == pytest.approx(np.sort(factor * recovery[name].values.ravel()))
    level = [line for line in ax.lines if line.get_label() == "truth"]
    assert list(level[0].get_ydata()) == pytest.approx([truth, truth])
    assert ax.get_ylabel() == label
    assert [text.get_text() for text in ax.get_xticklabels()] == ["10 min", "40 min"]
    # An interval is a segment from its low to its high end.
    segments = [path for item in ax.collections for path in item.get_segments()]
    lows = np.sort([segment[0, 1] for segment in segments])
    assert lows == pytest.approx(np.sort(factor * recovery[f"{name}_low"].values.ravel()))


def test_what_is_not_used_is_open(recovery: xr.Dataset) -> None:
    ax = plot_recovery(recovery)
    faces = {
        float(y): line.get_markerfacecolor()
        for line in ax.lines
        if line.get_marker() == "o"
        for y in line.get_ydata()
    }
    values, used = recovery["drag_coefficient"].values.ravel(), recovery["used"].values.ravel()
    assert [faces[value] == "white" for value in values] == [kept == 0 for kept in used]


def test_flow_error_in_percent(recovery: xr.Dataset) -> None:
    ax = plot_flow_recovery(recovery)
    assert points(ax) == pytest.approx(np.sort(100 * recovery["flow_error"].values.ravel()))
    assert ax.get_ylim()[0] == 0.0
    assert "%" in ax.get_ylabel()


def test_error_by_length_with_its_law(recovery: xr.Dataset) -> None:
    ax = plot_recovery_error(recovery)
    rms = recovery["rms_error"].sel(parameter="drag_coefficient").values
    assert points(ax) == pytest.approx(np.sort(100 * rms.ravel()))
    laws = [line for line in ax.lines if len(line.get_xdata()) == 50]
    for line, scale in zip(laws, recovery["drag_coefficient_error_scale"].values, strict=True):
        minutes, percent = (np.asarray(values) for values in line.get_data())
        assert percent == pytest.approx(100 * scale / np.sqrt(60 * minutes))
    assert "(min)" in ax.get_xlabel()
    crosses = [line for line in ax.lines if line.get_marker() == "x"]
    assert np.concatenate([line.get_ydata() for line in crosses]) == pytest.approx([10.0] * 4)


@pytest.mark.slow
def test_files(recovery: xr.Dataset, tmp_path: Path) -> None:
    files = write_figures(recovery_figures(recovery), tmp_path, ("png",))
    assert [path.name for path in files] == ["recovery.png", "error_by_length.png"]
    assert min(path.stat().st_size for path in files) > 5000


@pytest.mark.slow
def test_a_study_without_a_single_fit_is_drawn(recovery: xr.Dataset, tmp_path: Path) -> None:
    nothing = recovery.copy(deep=True)
    for name in nothing.data_vars:
        if nothing[name].dtype.kind == "f":
            nothing[name].values[...] = np.nan
    nothing["used"].values[...] = 0
    assert len(write_figures(recovery_figures(nothing), tmp_path, ("png",))) == 2


def test_refusals(recovery: xr.Dataset) -> None:
    with pytest.raises(InputError, match="parameter must be one of"):
        plot_recovery(recovery, "mass")
    for plot in (plot_recovery, plot_flow_recovery, plot_recovery_error):
        with pytest.raises(InputError, match="expected a dataset 'recovery'"):
            plot(xr.Dataset())


@pytest.mark.slow
def test_a_page_of_far_too_many_durations_is_one_sentence(recovery: xr.Dataset) -> None:
    """Found by damaging files: an axis of 100,000 took the page over half a minute."""
    long = recovery.isel(duration=np.zeros(100_000, dtype=int))
    (part,) = recovery_sections(long)
    assert part["kind"] == "empty"
    assert "rows of estimates are more than the 1000 of a page" in part["reason"]
