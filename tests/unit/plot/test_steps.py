"""Figures of the joint density of step length and turning angle."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.patches import StepPatch
from synthetic_calibration import recording_steps

from driftwalk.core.errors import InputError
from driftwalk.plot import step_density as plot_step_density, steps as plot_steps
from driftwalk.plot.step_densities import density_of, filled_range


def _mesh(ax) -> QuadMesh:
    return next(artist for artist in ax.collections if isinstance(artist, QuadMesh))


def _marginals(ax) -> dict[str, np.ndarray]:
    return {
        child.get_label(): next(p for p in child.patches if isinstance(p, StepPatch)).get_data()
        for child in ax.child_axes
    }


def test_drawn_density_integrates_to_the_share_of_steps_inside() -> None:
    ax = plot_steps(*recording_steps())
    mesh = _mesh(ax)
    corners = mesh.get_coordinates()
    area = np.diff(corners[0, :, 0])[None, :] * np.diff(corners[:, 0, 1])[:, None]
    total = (np.ma.filled(mesh.get_array(), 0.0).reshape(area.shape) * area).sum()
    assert 99.8 < total <= 100.0


def test_density_of_two_known_steps() -> None:
    # One bin of 2 mm by 90 degrees holds a quarter, another three quarters of the steps.
    ax = plot_step_density(
        [[0.25, 0.0], [0.0, 0.75]], [0.0, 0.002, 0.004], [-np.pi / 2, 0.0, np.pi / 2]
    )
    drawn = np.ma.filled(_mesh(ax).get_array(), np.nan).reshape(2, 2)
    # Rows of the mesh are angles, columns are lengths; nothing is drawn in an empty bin.
    np.testing.assert_allclose(drawn, [[25 / 180, np.nan], [np.nan, 75 / 180]])


def test_density_does_not_depend_on_the_widths_of_bins() -> None:
    even = density_of(np.full((4, 1), 0.25), np.linspace(0, 4, 5), np.array([0.0, 1.0]))
    uneven = density_of(np.array([[0.25], [0.75]]), np.array([0.0, 1.0, 4.0]), np.array([0.0, 1.0]))
    assert set(even.ravel()) == set(uneven.ravel()) == {25.0}


def test_marginals_are_those_of_the_steps() -> None:
    length, angle = recording_steps()
    marginals = _marginals(plot_steps(length, angle, bins=20))
    for name, values, factor in (
        ("step length", length, 1e3),
        ("turning angle", angle, 180 / np.pi),
    ):
        data = marginals[f"marginal of {name}"]
        width = np.diff(data.edges)
        mean = (data.values * width * (data.edges[1:] + data.edges[:-1]) / 2).sum()
        assert (data.values * width).sum() == pytest.approx(1.0, abs=2e-3)
        assert mean == pytest.approx(factor * values.mean(), abs=0.02 * factor * values.std())


def test_labels_name_both_words_for_the_angle_and_the_units() -> None:
    ax = plot_steps(*recording_steps())
    assert ax.get_xlabel() == "step length (mm)"
    assert ax.get_ylabel() == "turning (step) angle (°)"
    assert ax.figure.axes[-1].get_ylabel() == "density of steps (% mm⁻¹ °⁻¹)"


@pytest.mark.slow
def test_marginals_can_be_left_out() -> None:
    assert plot_steps([0.001, 0.002], [0.0, 0.1], marginals="none").child_axes == []


def test_steps_without_a_number_are_left_out() -> None:
    ax = plot_steps([0.001, 0.002, np.nan], [0.0, 0.1, 0.2], bins=2, marginals="none")
    assert np.ma.count(_mesh(ax).get_array()) == 2


@pytest.mark.slow
def test_equal_steps_are_drawn() -> None:
    plot_steps([0.001, 0.001], [0.0, 0.0]).figure.draw_without_rendering()


def test_filled_range_cuts_the_tails_only() -> None:
    marginal = np.array([0.0, 1e-5, 0.5, 0.5 - 2e-5, 1e-5, 0.0])
    assert filled_range(marginal, np.arange(7.0)) == (2.0, 4.0)
    assert filled_range(np.array([0.0, 1.0, 0.0]), np.arange(4.0)) == (1.0, 2.0)
    assert filled_range(np.array([0.5, 0.5]), np.arange(3.0)) == (0.0, 2.0)
    assert filled_range(np.zeros(3), np.arange(4.0)) == (0.0, 3.0)


def test_wrong_shapes_are_refused() -> None:
    with pytest.raises(InputError, match="not two lists of the same length"):
        plot_steps([0.1, 0.2], [0.0])
    with pytest.raises(InputError, match="no step to draw"):
        plot_steps([np.nan], [0.0])
    with pytest.raises(InputError, match="does not belong to 3 edges"):
        plot_step_density([[1.0]], [0.0, 1.0, 2.0], [0.0, 1.0])
