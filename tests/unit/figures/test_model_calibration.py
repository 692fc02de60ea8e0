"""The figures of a calibration of many parameters: a panel for each pair, labels that fit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from every_kind import every_kind

from driftwalk.core.errors import InputError
from driftwalk.figures import model_calibration_figures, write_figures
from driftwalk.figures.motion_models import pairs_figure, profiles_figure, quality_figure


@pytest.fixture(scope="module")
def found() -> xr.Dataset:
    return every_kind("model_calibration")


@pytest.mark.slow
def test_every_pair_has_a_panel_and_its_draws(found: xr.Dataset) -> None:
    figure = pairs_figure(found)
    shown = [ax for ax in figure.axes if ax.get_visible()]
    assert len(shown) == 6
    below = figure.axes[3]
    draws, estimate = below.lines
    assert draws.get_xdata().tolist() == found["posterior_sample"][:, 0].values.tolist()
    assert draws.get_ydata().tolist() == found["posterior_sample"][:, 1].values.tolist()
    assert estimate.get_xdata() == [float(found["estimate"][0])]


@pytest.mark.slow
def test_labels_have_units_and_stay_on_the_page(found: xr.Dataset) -> None:
    figure = pairs_figure(found)
    figure.draw_without_rendering()
    labels = [ax.xaxis.label for ax in figure.axes if ax.get_visible() and ax.get_xlabel()]
    assert [one.get_text().splitlines()[-1] for one in labels] == ["(m/s)", "(s)", "(rad/s)"]
    for one in labels:
        box = one.get_window_extent()
        assert 0.0 <= box.x0 < box.x1 <= figure.bbox.width


@pytest.mark.slow
def test_a_profile_is_least_at_its_middle_and_has_the_interval(found: xr.Dataset) -> None:
    panels = [ax for ax in profiles_figure(found).axes if ax.get_visible()]
    assert len(panels) == found.sizes["parameter"]
    for ax, interval in zip(panels, found["interval"].values, strict=True):
        rise = ax.lines[0].get_ydata()
        assert rise.argmin() == rise.size // 2
        assert [line.get_xdata()[0] for line in ax.lines[2:4]] == interval.tolist()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("interval", "half_width", "words"),
    [
        ((0.02, 0.03), 0.2, "(± 20 %)"),
        # Around 0 the half width is over a part of the range.
        ((-0.04, 0.09), 0.22, "(0 is within)"),
        ((0.0, 0.09), np.inf, "(to an end of the range)"),
        ((np.nan, np.nan), np.nan, ""),
    ],
)
def test_a_value_that_is_not_determined_says_how_wide_it_is(
    found: xr.Dataset, interval: tuple[float, float], half_width: float, words: str
) -> None:
    wide = found.copy(deep=True)
    changed = {
        "determined": False, "scale": "linear", "estimate": 0.025, "half_width": half_width,
        "interval": interval,
    }  # fmt: skip
    for name, value in changed.items():
        wide[name].values[:] = value
    for ax in profiles_figure(wide).axes:
        if ax.get_visible():
            assert ax.get_title(loc="left") == f"not determined\n{words}"


@pytest.mark.slow
def test_the_quality_shows_the_distances(found: xr.Dataset) -> None:
    aspects, checks = quality_figure(found).axes
    assert aspects.lines[0].get_xdata().tolist() == found["held_out_distance"].values.tolist()
    assert checks.get_xlabel() == "model / recording"


@pytest.mark.slow
def test_without_draws_there_are_no_pairs(found: xr.Dataset, tmp_path: Path) -> None:
    rest = found.drop_vars(["posterior_sample", "profile_value", "profile_discrepancy"])
    written = write_figures(model_calibration_figures(rest), tmp_path, ("png",))
    assert [path.name for path in written] == ["quality.png"]
    with pytest.raises(InputError, match="expected a dataset 'model_calibration'"):
        model_calibration_figures(xr.Dataset())
