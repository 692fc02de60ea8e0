"""Classes over time and survival curves."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings, strategies as st
from matplotlib.collections import PolyCollection
from matplotlib.offsetbox import AnnotationBbox
from scipy.optimize import minimize
from synthetic_assembly import class_times, outcome_classes

from driftwalk.core.errors import InputError
from driftwalk.plot.assembly_courses import plot_class_times, plot_survival, spread_apart
from driftwalk.plot.kinetics import class_graph_of
from driftwalk.plot.parts.outcome_classes import class_colors
from driftwalk.plot.parts.style import print_style


def areas(ax) -> dict[str, PolyCollection]:
    found = [artist for artist in ax.collections if isinstance(artist, PolyCollection)]
    return {str(area.get_label()): area for area in found}


def height_at_end(area, time) -> float:
    vertices = area.get_paths()[0].vertices
    return float(np.ptp(vertices[np.isclose(vertices[:, 0], time), 1]))


@pytest.mark.parametrize(("blocks", "chirality"), [(2, "merged"), (4, "merged"), (4, "distinct")])
def test_areas_are_as_thick_as_the_proportions(blocks, chirality) -> None:
    times = class_times(blocks, chirality)
    ax = plot_class_times(times)
    found = areas(ax)
    assert list(found) == outcome_classes(blocks, chirality)
    for name, area in found.items():
        line = times["proportion"].sel({"class": name})
        assert height_at_end(area, 300.0) == pytest.approx(float(line[-1]), abs=1e-12)
        assert height_at_end(area, 150.0) == pytest.approx(float(line[30]), abs=1e-12)


def test_lines_are_the_proportions() -> None:
    times = class_times()
    ax = plot_class_times(times, form="lines")
    lines = {str(line.get_label()): line for line in ax.lines}
    for name in outcome_classes(4):
        np.testing.assert_allclose(lines[name].get_xdata(), times["time"])
        np.testing.assert_allclose(
            lines[name].get_ydata(), times["proportion"].sel({"class": name})
        )
    assert ax.get_xlabel() == "time (s)"


def test_of_68_classes_the_rest_is_summed() -> None:
    ax = plot_class_times(class_times(6))
    found = areas(ax)
    assert len(found) == 21
    assert sum(height_at_end(area, 300.0) for area in found.values()) == pytest.approx(1.0)
    assert "other" in found


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize("form", ["lines", "stacked"])
@pytest.mark.parametrize(("blocks", "chirality"), [(2, "merged"), (4, "distinct"), (6, "merged")])
def test_labels_lie_beside_the_axes_and_apart(form, blocks, chirality) -> None:
    with print_style():
        ax = plot_class_times(class_times(blocks, chirality), form=form)
        ax.figure.draw_without_rendering()
        sketches = [a.get_window_extent() for a in ax.artists if isinstance(a, AnnotationBbox)]
    assert len(sketches) >= len(areas(ax) if form == "stacked" else outcome_classes(blocks)[:2]) - 1
    edge = ax.get_window_extent().x1
    for index, box in enumerate(sketches):
        assert box.x0 > edge
        assert box.x1 <= ax.figure.bbox.x1
        for other in sketches[:index]:
            assert box.y0 >= other.y1 - 0.5 or box.y1 <= other.y0 + 0.5


def test_one_assembly_has_a_hue_and_several_are_grey() -> None:
    for name, color in class_colors(outcome_classes(4, "distinct")).items():
        red, green, blue = (int(color[i : i + 2], 16) for i in (1, 3, 5))
        assert (max(red, green, blue) - min(red, green, blue) < 10) == ("+" in name)


def test_survival_curves_have_their_bands() -> None:
    times = class_times()
    ax = plot_survival(times)
    assert len(ax.lines) == len(ax.collections) == 2
    for line, band, name in zip(
        ax.lines, ax.collections, ("first_contact", "completion"), strict=True
    ):
        np.testing.assert_allclose(line.get_ydata(), times[name])
        box = band.get_paths()[0].get_extents()
        assert box.y0 == pytest.approx(float(times[f"{name}_low"].min()))
        assert box.y1 == pytest.approx(float(times[f"{name}_high"].max()))
    assert ax.get_title(loc="left") == "4 blocks, 1000 runs, bands: 95 %"


def test_what_cannot_be_drawn_is_refused() -> None:
    times = class_times()
    with pytest.raises(InputError, match="choose lines or stacked"):
        plot_class_times(times, form="area")
    with pytest.raises(InputError, match="lacks first_contact and completion"):
        plot_survival(times.drop_vars(["first_contact", "completion"]))
    assert len(plot_survival(times.drop_vars("completion")).lines) == 1


@settings(deadline=None, max_examples=40)
@given(st.lists(st.tuples(st.floats(0.0, 1.0), st.floats(0.01, 0.2)), min_size=1, max_size=12))
def test_things_on_a_line_are_apart_and_inside(pairs) -> None:
    wanted, size = np.array(pairs).T
    place = spread_apart(wanted, size)
    size = size / max(1.0, size.sum())
    order = np.argsort(wanted, kind="stable")
    assert place.min() >= size[order[0]] / 2 - 1e-9
    assert place.max() <= 1.0 - size[order[-1]] / 2 + 1e-9
    gaps = np.diff(place[order]) - (size[order][1:] + size[order][:-1]) / 2
    assert (gaps >= -1e-9).all()


def test_places_are_moved_as_little_as_possible() -> None:
    """A general optimiser finds nothing better."""
    wanted = np.array([0.05, 0.06, 0.4, 0.5, 0.52, 0.97])
    size = np.array([0.1, 0.06, 0.1, 0.12, 0.08, 0.1])
    place = spread_apart(wanted, size)
    apart = (size[1:] + size[:-1]) / 2
    best = minimize(
        lambda x: ((x - wanted) ** 2).sum(),
        np.linspace(0.1, 0.9, 6),
        constraints=[{"type": "ineq", "fun": lambda x: np.diff(x) - apart}],
        bounds=[(half, 1 - half) for half in size / 2],
        options={"ftol": 1e-12},
    )
    np.testing.assert_allclose(place, best.x, atol=1e-5)


def test_the_graph_of_classes_shows_the_largest_of_a_column() -> None:
    names = ["1+1", *(f"end{number}" for number in range(12))]
    one_each = (("source", "transition"), np.ones((1, 12)))
    kinetics = xr.Dataset(
        {"rate": one_each, "count": one_each, "share": (("time", "class"), [np.arange(13.0)])},
        coords={"class": names, "transition": [f"1+1 -> {name}" for name in names[1:]]},
        attrs={"kind": "kinetics"},
    )
    place, rows, kept, title = class_graph_of(kinetics)
    assert set(place) == {"1+1", *names[-8:]}
    assert (rows, len(kept)) == (8, 8)
    assert title.endswith("4 rarer classes are left out")
