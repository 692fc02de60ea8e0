"""Maps of the l1 distance and of every class: cells, floor, reference, and other axes."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.contour import ContourSet
from matplotlib.offsetbox import AnnotationBbox
from matplotlib.patches import Circle
from synthetic_assembly import one_axis, outcome_classes, sensitivity

from driftwalk.core.errors import InputError
from driftwalk.plot.parts.style import axes_or_new
from driftwalk.plot.sensitivity_maps import plot_class_key, plot_class_panels, plot_l1_map


def mesh_of(ax) -> QuadMesh:
    return next(artist for artist in ax.collections if isinstance(artist, QuadMesh))


def mesh_values(ax, shape) -> np.ndarray:
    return np.ma.filled(mesh_of(ax).get_array(), np.nan).reshape(shape[::-1]).T


def contours(ax) -> list[ContourSet]:
    return [artist for artist in ax.collections if isinstance(artist, ContourSet)]


def line_named(ax, label):
    return next(line for line in ax.lines if line.get_label() == label)


@pytest.fixture(scope="module")
def study():
    return sensitivity()


def test_map_is_the_distance_with_force_upwards_in_millinewtons(study) -> None:
    ax = plot_l1_map(study)
    np.testing.assert_allclose(mesh_values(ax, (16, 15)), study["l1_distance"])
    corners = mesh_of(ax).get_coordinates()
    inside_x = (corners[0, :-1, 0] + corners[0, 1:, 0]) / 2
    inside_y = (corners[:-1, 0, 1] + corners[1:, 0, 1]) / 2
    np.testing.assert_allclose(inside_x, study["drag_coefficient"], rtol=1e-12)
    np.testing.assert_allclose(inside_y, 1e3 * study["force_std"], rtol=1e-12)
    assert "mN" in ax.get_ylabel()
    assert "every 16 ms" in ax.get_ylabel()


def test_order_of_the_dimensions_does_not_matter(study) -> None:
    turned = study.transpose("class", "force_std", "drag_coefficient", ...)
    np.testing.assert_array_equal(
        mesh_values(plot_l1_map(study), (16, 15)), mesh_values(plot_l1_map(turned), (16, 15))
    )


def test_colours_start_at_no_distance(study) -> None:
    low, high = mesh_of(plot_l1_map(study)).get_clim()
    assert (low, high) == (0.0, pytest.approx(float(study["l1_distance"].max())))


def test_contour_lies_where_the_distance_is_the_noise_floor(study) -> None:
    ax = plot_l1_map(study)
    (lines,) = contours(ax)
    assert list(lines.levels) == [study.attrs["noise_floor_95"]]
    on_line = np.concatenate([path.vertices for path in lines.get_paths()])
    found = study["l1_distance"].interp(
        drag_coefficient=("point", on_line[:, 0]), force_std=("point", on_line[:, 1] / 1e3)
    )
    # Vertices of a contour lie on the edges between cells, where it is linear in one variable.
    np.testing.assert_allclose(found, 0.18, atol=1e-9)
    assert line_named(ax, "95 % noise floor (0.18)").get_color() is not None


@pytest.mark.parametrize("floor", [0.0001, 3.0, np.nan])
def test_a_floor_outside_the_map_has_no_contour(study, floor) -> None:
    assert not contours(plot_l1_map(study.assign_attrs(noise_floor_95=floor)))


def test_floor_is_also_a_line_in_the_colour_bar(study) -> None:
    bar = plot_l1_map(study).figure.axes[1]
    assert [line.get_ydata()[0] for line in bar.lines] == [0.18]


def test_reference_is_marked(study) -> None:
    (x,), (y,) = line_named(plot_l1_map(study), "reference").get_data()
    assert (x, y) == pytest.approx((0.45, 0.55))


def test_a_setting_without_distance_is_hatched(study) -> None:
    holed = study.copy(deep=True)
    holed["l1_distance"][3, 4] = np.nan
    (hatched,) = [patch for patch in plot_l1_map(holed).patches if patch.get_hatch()]
    middle = hatched.get_x() + hatched.get_width() / 2, hatched.get_y() + hatched.get_height() / 2
    expected = float(study["drag_coefficient"][3]), 1e3 * float(study["force_std"][4])
    assert middle == pytest.approx(expected)


def test_one_axis_of_numbers_is_a_line_over_the_band_of_the_floor() -> None:
    data = one_axis("tank_diameter", [0.2, 0.25, 0.3, 0.35]).assign_attrs(
        reference_tank_diameter_m=0.3
    )
    ax = plot_l1_map(data)
    line = next(line for line in ax.lines if line.get_marker() == "o")
    np.testing.assert_allclose(line.get_xdata(), [20, 25, 30, 35])
    np.testing.assert_allclose(line.get_ydata(), data["l1_distance"])
    (band,) = ax.patches
    assert (band.get_y(), band.get_y() + band.get_height()) == (0.0, 0.18)
    assert line_named(ax, "mean noise floor").get_ydata()[0] == 0.11
    assert line_named(ax, "reference").get_xdata()[0] == pytest.approx(30.0)
    assert ax.get_xlabel() == "tank diameter (cm)"


def test_words_have_a_row_each_and_their_points_are_not_joined() -> None:
    words = ["none", "collision", "connector"]
    data = one_axis("latching", words)
    ax = plot_l1_map(data.assign_attrs(reference_latching="collision"))
    points = next(line for line in ax.lines if line.get_marker() == "o")
    assert points.get_linestyle() == "None"
    np.testing.assert_allclose(points.get_xdata(), data["l1_distance"])
    low, high = ax.get_ylim()
    # The first word is the highest row.
    assert [points.get_ydata().tolist(), low > high] == [[0.0, 1.0, 2.0], True]
    assert [text.get_text() for text in ax.get_yticklabels()] == words
    assert line_named(ax, "reference").get_ydata()[0] == 1.0
    (band,) = ax.patches
    assert (band.get_x(), band.get_x() + band.get_width()) == (0.0, 0.18)


def test_no_label_of_a_study_of_words_is_turned() -> None:
    rows = one_axis("latching", ["none", "a very long word", "another very long word"])
    both = rows.expand_dims(hidden_face_drag=["none", "full"]).copy(deep=True)
    for ax in [plot_l1_map(both), *plot_class_panels(both)]:
        ax.figure.draw_without_rendering()
        labels = [*ax.get_xticklabels(), *ax.get_yticklabels()]
        assert all(text.get_rotation() == 0.0 for text in labels)


def test_a_setting_without_a_distance_is_marked() -> None:
    data = one_axis("blocks", [2, 3, 4, 5]).copy(deep=True)
    data["l1_distance"][:2] = np.nan
    ax = plot_l1_map(data)
    np.testing.assert_allclose(line_named(ax, "no distance").get_xdata(), [2, 3])
    low, high = ax.get_xlim()
    assert low < 2.0 < 5.0 < high
    assert all(tick % 1.0 == 0.0 for tick in ax.get_xticks())


def test_numbers_and_words_give_one_line_per_word() -> None:
    one = one_axis("drag_coefficient", [0.2, 0.5, 0.9])
    both = one.expand_dims(hidden_face_drag=["none", "full"]).copy(deep=True)
    both["l1_distance"][1] += 0.25
    ax = plot_l1_map(both)
    for word, more in (("none", 0.0), ("full", 0.25)):
        line = line_named(ax, f"drag on hidden faces: {word}")
        np.testing.assert_allclose(line.get_xdata(), [0.2, 0.5, 0.9])
        np.testing.assert_allclose(line.get_ydata(), one["l1_distance"] + more)


def test_three_axes_are_refused(study) -> None:
    with pytest.raises(InputError, match=r"3 axes .*select values along all but two"):
        plot_l1_map(study.expand_dims(latching=["none", "collision"]))
    with pytest.raises(InputError, match="lacks l1_distance"):
        plot_l1_map(study.drop_vars("l1_distance"))


def test_panels_hold_the_proportion_of_their_class_on_one_scale(study) -> None:
    panels = plot_class_panels(study)
    assert len(panels) == 10
    names = outcome_classes(4)
    for ax, name in zip(panels, names, strict=True):
        assert ax.get_title(loc="left") == name
        expected = study["proportion"].sel({"class": name})
        np.testing.assert_allclose(mesh_values(ax, (16, 15)), expected)
    top = float(study["proportion"].max())
    assert {mesh_of(ax).get_clim() for ax in panels} == {(0.0, top)}


def test_panels_along_one_axis_are_lines() -> None:
    data = one_axis("tank_diameter", [0.2, 0.25, 0.3])
    (ax,) = plot_class_panels(data, classes=["T"])
    np.testing.assert_allclose(ax.lines[0].get_ydata(), data["proportion"].sel({"class": "T"}))


@pytest.mark.slow
def test_panels_of_many_classes_leave_out_the_rare_ones() -> None:
    data = sensitivity(6, points=(4, 4))
    panels = plot_class_panels(data)
    largest = data["proportion"].max(["drag_coefficient", "force_std"]).values
    drawn = [mesh_values(ax, (4, 4)).max() for ax in panels]
    assert len(drawn) == 20
    np.testing.assert_allclose(sorted(drawn), np.sort(largest)[-20:])


def test_wrong_panels_are_refused(study) -> None:
    with pytest.raises(InputError, match="no class K"):
        plot_class_panels(study, classes=["I", "K"])
    with pytest.raises(InputError, match="got 1 axes, expected 10"):
        plot_class_panels(study, [axes_or_new(None)])


@pytest.mark.parametrize(("blocks", "chirality"), [(2, "merged"), (4, "distinct"), (5, "merged")])
def test_key_shows_every_class_once_and_none_on_another(blocks, chirality) -> None:
    names = outcome_classes(blocks, chirality)
    ax = plot_class_key(names)
    ax.figure.draw_without_rendering()
    boxes = [a.get_window_extent() for a in ax.artists if isinstance(a, AnnotationBbox)]
    boxes += [text.get_window_extent() for text in ax.texts if text.get_text()]
    written = [text.get_text() for text in ax.texts if text.get_text()]
    assert written == [name for name in names if "x" not in name]
    assert len(boxes) == len(names) + len(written)
    for index, box in enumerate(boxes):
        assert not any(box.overlaps(other) for other in boxes[:index])


def test_classes_of_discs_are_discs_and_counts_are_written() -> None:
    """A class such as 2+2 does not say of what; of more than eight discs there is no sketch."""
    ax = plot_class_key(["chain4", "2+2", "9 discs, 9 contacts"])
    sketches = [a.offsetbox for a in ax.artists if isinstance(a, AnnotationBbox)]
    shapes = [{type(one) for one in sketch.get_children()} for sketch in sketches]
    assert shapes == [{Circle}, {Circle}]
    assert ax.texts[2].get_text() == "9 discs, 9 contacts"
