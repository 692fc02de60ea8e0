"""Files of the figures of self-assembly: all written, the same each time, nothing cut off."""

from __future__ import annotations

import matplotlib
import numpy as np
import pytest
import xarray as xr
from matplotlib.text import Text
from synthetic_assembly import (
    assembly_path,
    class_times,
    components,
    distribution,
    one_axis,
    realisations,
    sensitivity,
)

from driftwalk.core.errors import InputError
from driftwalk.figures import assembly, sensitivity_figures
from driftwalk.figures.write import write_figures
from driftwalk.plot.outcome_bars import plot_outcomes
from driftwalk.plot.parts.style import figure_of, print_style
from driftwalk.plot.yields import plot_yield_front


@pytest.fixture(scope="module")
def study():
    return sensitivity(3, points=(5, 4))


@pytest.mark.slow
def test_every_figure_of_an_experiment_is_written(tmp_path) -> None:
    folder = tmp_path / "made" / "here"
    table = assembly.assembly_figures(
        distribution(),
        distribution(seed=2),
        class_times(),
        assembly_path(),
        labels=("fixed", "drawn"),
        realisations=realisations(),
    )
    written = write_figures(table, folder)
    names = ["outcomes", "class_times", "film_strip"]
    assert [path.name for path in written] == [f"{n}.{s}" for n in names for s in ("png", "svg")]
    assert all(path.stat().st_size > 10_000 for path in written)
    assert sorted(folder.iterdir()) == sorted(written)


@pytest.mark.slow
def test_only_what_is_given_is_drawn(tmp_path) -> None:
    written = write_figures(assembly.assembly_figures(distribution()), tmp_path, ["png"])
    assert [path.name for path in written] == ["outcomes.png"]


@pytest.mark.slow
def test_every_figure_of_a_study_is_written_the_same_each_time(study, tmp_path) -> None:
    first, again = (
        write_figures(sensitivity_figures(study, None, components(study)), tmp_path / name, ["svg"])
        for name in ("one", "two")
    )
    assert [path.stem for path in first] == ["l1_map", "class_panels", "biplot", "biplot_l1"]
    for one, other in zip(first, again, strict=True):
        assert one.read_bytes() == other.read_bytes(), one.name


@pytest.mark.slow
def test_a_study_along_one_axis_is_written(tmp_path) -> None:
    data = one_axis("latching", ["none", "collision", "connector"])
    assert len(write_figures(sensitivity_figures(data, None), tmp_path, ["png"])) == 2


def test_an_unknown_format_is_refused_before_anything_is_written(tmp_path) -> None:
    with pytest.raises(InputError, match="as gif: choose from png, svg, pdf"):
        write_figures(assembly.assembly_figures(distribution()), tmp_path / "x", ["gif"])
    assert not (tmp_path / "x").exists()


def two_drags():
    """Return a study along the diameter of the tank, with both ways to count drag."""
    return one_axis("tank_diameter", [0.2, 0.3]).expand_dims(hidden_face_drag=["none", "full"])


def outcomes_figure(*found, **options):
    return figure_of(plot_outcomes(*found, **options))


FIGURES = {
    "map of words": lambda: assembly.l1_map_figure(two_drags()),
    "panels of words": lambda: assembly.class_panels_figure(two_drags()),
    "outcomes": lambda: outcomes_figure(distribution()),
    "outcomes of 12": lambda: outcomes_figure(distribution(4, "distinct")),
    "outcomes of 68": lambda: outcomes_figure(distribution(6)),
    "pairs": lambda: outcomes_figure(
        distribution(), beside=distribution(seed=2), realisations=realisations()
    ),
    "class times": lambda: assembly.class_times_figure(class_times()),
    "class times of 68": lambda: assembly.class_times_figure(class_times(6)),
    "map": lambda: assembly.l1_map_figure(sensitivity(points=(8, 7))),
    "map of 68": lambda: assembly.l1_map_figure(sensitivity(6, points=(5, 5))),
    "panels": lambda: assembly.class_panels_figure(sensitivity(points=(5, 5))),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", FIGURES)
def test_every_text_lies_inside_its_figure(name) -> None:
    with print_style():
        figure = FIGURES[name]()
        figure.draw_without_rendering()
        # Labels of ticks beyond the limits are kept, not drawn.
        ticks = {
            id(text)
            for ax in figure.axes
            for axis in (ax.xaxis, ax.yaxis)
            for text in axis.get_ticklabels()
        }
        for text in figure.findobj(matplotlib.text.Text):
            if id(text) in ticks or not (text.get_text() and text.get_visible()):
                continue
            box = text.get_window_extent()
            if box.width == 0.0:
                continue
            assert box.x0 >= -0.5, text
            assert box.y0 >= -0.5, text
            assert box.x1 <= figure.bbox.x1 + 0.5, text
            assert box.y1 <= figure.bbox.y1 + 0.5, text


def two_settings(words: list[str]) -> xr.Dataset:
    """Return a `yield` of two settings that differ in two axes, each ahead for half of the time."""
    time = np.linspace(0.0, 300.0, 31)
    first, second = 0.5 * time / 300.0, np.minimum(0.4, time / 300.0)
    front = np.maximum(first, second)
    return xr.Dataset(
        {
            "share": (("setting", "time"), [first, second]),
            "front_yield": ("time", front),
            "front_yield_low": ("time", 0.9 * front),
            "front_yield_high": ("time", 1.1 * front),
            "front_setting": ("time", (second > first).astype(int)),
            "latching": ("setting", words),
            "flow_scale": ("setting", [1.469, 1.156]),
        },
        {"time": time, "setting": [0, 1]},
        {"kind": "yield", "best": 0, "by_s": 300.0, "confidence": 0.9, "target": "T"},
    )


@pytest.mark.parametrize("words", [["a", "b"], ["collision", "connector"]])
def test_long_names_of_settings_leave_room_for_the_yields(words: list[str]) -> None:
    with print_style():
        ax = plot_yield_front(two_settings(words))
        figure = figure_of(ax)
        figure.draw_without_rendering()
        legend = ax.get_legend().get_window_extent()
    assert 0.0 <= legend.x0 < legend.x1 <= figure.bbox.width
    assert ax.get_window_extent().width > 0.6 * figure.bbox.width


def test_all_names_of_classes_have_one_size() -> None:
    names = ["chain4", "star4", "paw", "chain3+1", "triangle+1", "2+2", "2+1+1", "1+1+1+1"]
    outcomes = distribution().isel({"class": slice(8)}).assign_coords({"class": names})
    with print_style():
        ax = plot_outcomes(outcomes)
        shown = [text for text in ax.findobj(Text) if text.get_text().partition("\n")[0] in names]
    assert {text.get_text().replace("\n", "") for text in shown} == {*names}
    assert {text.get_fontsize() for text in shown} == {7.0}
