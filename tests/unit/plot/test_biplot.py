"""The biplot: scores, loadings and labels."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from matplotlib.collections import PathCollection
from matplotlib.offsetbox import AnnotationBbox
from matplotlib.text import Annotation
from synthetic_assembly import components, one_axis, outcome_classes, sensitivity

from driftwalk.core.errors import InputError
from driftwalk.plot.components import place_labels, plot_biplot
from driftwalk.plot.parts.style import print_style


@pytest.fixture(scope="module")
def study():
    return sensitivity(points=(8, 7))


@pytest.fixture(scope="module")
def parts(study):
    return components(study)


def arrows(ax) -> dict[str, Annotation]:
    return {text.get_gid(): text for text in ax.texts if text.arrow_patch is not None}


def labels(ax) -> list[AnnotationBbox]:
    return [artist for artist in ax.artists if isinstance(artist, AnnotationBbox)]


def dots(ax) -> PathCollection:
    return next(artist for artist in ax.collections if isinstance(artist, PathCollection))


def test_dots_are_the_first_two_scores(parts) -> None:
    (line,) = [line for line in plot_biplot(parts).lines if line.get_label() == "settings"]
    np.testing.assert_allclose(line.get_xydata(), parts["score"].values[..., :2].reshape(-1, 2))


@pytest.mark.parametrize("color", ["complete", "l1_distance"])
def test_colour_of_a_dot_belongs_to_its_setting(parts, study, color) -> None:
    turned = study.transpose("force_std", "drag_coefficient", "class", ...)
    ax = plot_biplot(parts, sensitivity=turned, color=color)
    np.testing.assert_allclose(dots(ax).get_array(), study[color].values.ravel())
    np.testing.assert_allclose(
        dots(ax).get_offsets(), parts["score"].values[..., :2].reshape(-1, 2)
    )


def test_arrows_are_loadings_times_the_factor_stated(parts) -> None:
    ax = plot_biplot(parts)
    factor = float(ax.get_title(loc="left").split("×")[1])
    found = arrows(ax)
    assert list(found) == outcome_classes(4)
    for name, arrow in found.items():
        loading = parts["loading"].sel({"class": name}).values[:2]
        np.testing.assert_allclose(arrow.xy, factor * loading)
        assert arrow.get_position() == (0.0, 0.0)


@pytest.mark.slow
def test_axes_state_their_share_of_the_variance_and_have_one_scale(parts) -> None:
    ax = plot_biplot(parts)
    share = 100.0 * parts["explained_variance_ratio"].values
    assert f"{share[0]:.3g} % of the variance" in ax.get_xlabel()
    assert f"{share[1]:.3g} % of the variance" in ax.get_ylabel()
    ax.figure.draw_without_rendering()
    box = ax.get_window_extent()
    per_pixel = np.ptp(ax.get_xlim()) / box.width, np.ptp(ax.get_ylim()) / box.height
    assert per_pixel[0] == pytest.approx(per_pixel[1], rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(("blocks", "chirality"), [(4, "merged"), (4, "distinct"), (6, "merged")])
def test_labels_lie_inside_and_not_on_each_other(blocks, chirality) -> None:
    data = sensitivity(blocks, chirality, points=(8, 7))
    with print_style():
        ax = plot_biplot(components(data), sensitivity=data)
        ax.figure.draw_without_rendering()
        renderer = ax.figure.canvas.get_renderer()
        boxes = [label.offsetbox.get_window_extent(renderer) for label in labels(ax)]
    assert 8 <= len(boxes) <= 14
    frame = ax.get_window_extent()
    for index, box in enumerate(boxes):
        assert frame.x0 <= box.x0
        assert box.x1 <= frame.x1
        assert frame.y0 <= box.y0
        assert box.y1 <= frame.y1
        assert not any(box.overlaps(other) for other in boxes[:index])


@pytest.mark.slow
@settings(deadline=None, max_examples=30)
@given(st.lists(st.tuples(st.floats(30.0, 270.0), st.floats(30.0, 270.0)), min_size=1, max_size=10))
def test_labels_never_overlap_where_there_is_room(tips) -> None:
    boxes = np.tile([20.0, 12.0], (len(tips), 1))
    room = np.array([300.0, 300.0])
    places = place_labels(np.array(tips), boxes, origin=np.array([150.0, 150.0]), room=room)
    assert (places >= boxes / 2).all()
    assert (places <= room - boxes / 2).all()
    for i in range(len(places)):
        for j in range(i):
            assert (np.abs(places[i] - places[j]) >= boxes[i] - 1e-3).any()


@pytest.mark.slow
def test_a_setting_left_out_and_a_class_that_never_varies_are_no_trouble(parts, study) -> None:
    holed = parts.copy(deep=True)
    holed["score"][2, 3] = np.nan
    holed["loading"][9] = 0.0
    ax = plot_biplot(holed, sensitivity=study)
    ax.figure.draw_without_rendering()
    assert "1+1+1+1" not in arrows(ax)
    assert np.isnan(np.ma.filled(dots(ax).get_offsets(), np.nan)).any(axis=1).sum() == 1


def test_what_cannot_be_drawn_is_refused(parts, study) -> None:
    with pytest.raises(InputError, match="two components"):
        plot_biplot(parts.isel(component=[0]))
    with pytest.raises(InputError, match="another study"):
        plot_biplot(parts, sensitivity=one_axis("tank_diameter", [0.2, 0.3]))
    with pytest.raises(InputError, match="choose one of complete, l1_distance"):
        plot_biplot(parts, sensitivity=study, color="runs")
