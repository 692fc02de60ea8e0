"""Figures and pages of models that are not the block: everything by the parameters' names."""

from __future__ import annotations

import json
import re
from itertools import pairwise

import numpy as np
import pytest
from matplotlib.patches import StepPatch
from synthetic_calibration import bundled_recording
from user_calibration import one_parameter, two_parameters

from driftwalk.core.errors import InputError
from driftwalk.figures import calibration_figures, write, write_figures
from driftwalk.figures.calibration import panels_figure
from driftwalk.page.sections.calibration import calibration_sections
from driftwalk.plot import (
    bootstrap as plot_bootstrap,
    distance_profile as plot_distance_profile,
    map as plot_ks_map,
    refined_map as plot_refined_map,
)
from driftwalk.plot.parts.labels import logarithmic
from driftwalk.plot.parts.style import new_figure, print_style
from driftwalk.plot.step_densities import shared_setting_text
from driftwalk.schema.parameters import stored_parameters

BLOCK_WORDS = re.compile("drag|force|C_d|σ_F|mN", re.IGNORECASE)


def laid_out(figure, stem, formats):
    """Lay a figure out, which draws all of it, and write no pixel."""
    figure.draw_without_rendering()
    return [stem.with_suffix(f".{name}") for name in formats]


def texts_of(value):
    """Return every text of a section that a reader sees."""
    if isinstance(value, dict):
        hidden = {"data", "id", "kind", "name"}
        return [text for key, part in value.items() if key not in hidden for text in texts_of(part)]
    if isinstance(value, list):
        return [text for part in value for text in texts_of(part)]
    return [value] if isinstance(value, str) else []


def test_parameters_are_read_from_the_dimensions():
    stored = stored_parameters(two_parameters())
    assert [one.key for one in stored] == ["speed_m_s", "tumble_rate_per_s"]
    assert [one.label for one in stored] == ["speed", "rate of tumbles"]
    assert [one.scale for one in stored_parameters(one_parameter())] == ["log"]


@pytest.mark.parametrize(
    "limits", [(0.028, 0.033), (0.18, 1.05), (0.3, 0.45), (0.02, 4.0), (1e-6, 12.0)]
)
def test_numbers_along_a_logarithmic_axis_do_not_overlap(limits):
    with print_style():
        ax = new_figure(width_mm=45.0, height_mm=45.0).add_subplot()
        ax.set_xlim(limits)
        logarithmic(ax, "x")
        ax.figure.draw_without_rendering()
        every = zip(ax.get_xticks(), ax.get_xticklabels(), strict=True)
        shown = [text for at, text in every if limits[0] <= at <= limits[1] and text.get_text()]
        boxes = [text.get_window_extent() for text in shown]
    assert len(shown) >= 2
    assert all(left.x1 < right.x0 for left, right in pairwise(boxes))


@pytest.mark.parametrize("draw", [plot_ks_map, plot_refined_map, plot_bootstrap])
def test_a_plane_has_the_labels_and_the_estimate_of_the_model(draw):
    calibration = two_parameters()
    ax = draw(calibration)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("speed (m/s)", "rate of tumbles (1/s)")
    places = [container[0].get_xydata()[0] for container in ax.containers]
    assert places[0] == pytest.approx(calibration["estimate"].values)


@pytest.mark.parametrize("draw", [plot_ks_map, plot_refined_map])
def test_a_map_of_one_parameter_is_refused(draw):
    with pytest.raises(InputError, match="has 1 parameter, and a map shows two"):
        draw(one_parameter())


def test_one_parameter_has_a_curve_and_a_histogram_on_its_scale():
    calibration = one_parameter()
    ax = plot_distance_profile(calibration)
    assert ax.get_xscale() == "log"
    assert ax.get_xlabel() == "rate of tumbles (1/s)"
    fitted = next(line for line in ax.lines if line.get_label() == "fitted curve")
    np.testing.assert_allclose(fitted.get_ydata(), calibration["refined_surface"])
    ax = plot_bootstrap(calibration)
    (histogram,) = [patch for patch in ax.patches if isinstance(patch, StepPatch)]
    counts, edges, _ = histogram.get_data()
    assert counts.sum() == calibration.sizes["bootstrap"]
    estimates = calibration["bootstrap_tumble_rate"].values
    assert (edges[0], edges[-1]) == pytest.approx((estimates.min(), estimates.max()))
    assert ax.get_xscale() == "log"


@pytest.mark.slow
def test_panels_name_what_differs_and_what_stays():
    calibration = two_parameters()
    assert shared_setting_text(calibration, parameter="speed") == "rate of tumbles = 0.0005 1/s"
    assert shared_setting_text(one_parameter(), parameter="tumble_rate") == ""
    row = new_figure(width_mm=180, height_mm=60).subplots(1, 4)
    from driftwalk.plot import density_panels as plot_density_panels

    plot_density_panels(calibration, row, parameter="speed")
    assert row[1].get_title(loc="left") == "(b) speed\n= 0 m/s"
    assert panels_figure(one_parameter(), "tumble_rate").get_suptitle() == ""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("make", "panels"),
    [
        (two_parameters, ["speed_panels", "tumble_rate_panels"]),
        (one_parameter, ["tumble_rate_panels"]),
    ],
)
def test_every_figure_is_written_under_the_names_of_the_parameters(
    make, panels, tmp_path, monkeypatch
):
    monkeypatch.setattr(write, "_save", laid_out)
    files = write_figures(
        calibration_figures(make(), bundled_recording(rows=200)), tmp_path, formats=("png",)
    )
    names = [file.stem for file in files]
    assert names == ["trajectory", "steps", "ks_map", *panels, "validation"]


@pytest.mark.parametrize(("make", "count"), [(two_parameters, 2), (one_parameter, 1)])
def test_a_page_speaks_of_the_models_own_parameters(make, count):
    calibration = make()
    made = {part["id"]: part for part in calibration_sections(calibration)}
    assert not [
        part for part in made.values() if part["kind"] == "empty" and part["id"] != "validation"
    ]
    assert ("map" in made) == (count == 2)
    json.dumps(list(made.values()), allow_nan=False)
    words = " ".join(texts_of(list(made.values())))
    assert not BLOCK_WORDS.search(words), BLOCK_WORDS.search(words)
    assert "rate of tumbles" in words
    assert [one["label"] for one in made["summary"]["numbers"]][:count] == [
        "speed", "rate of tumbles"
    ][-count:]  # fmt: skip
    assert made["profile-tumble-rate"]["x"]["label"] == "rate of tumbles"
    assert made["bootstrap"]["kind"] == "lines"
    if count == 1:
        assert made["profile-tumble-rate"]["x"]["log"] is True
        shares = made["bootstrap"]["series"][0]
        assert shares["style"] == "line"
