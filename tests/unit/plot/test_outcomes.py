"""Bars of the outcome classes: what is drawn is what the dataset says."""

from __future__ import annotations

from contextlib import nullcontext
from itertools import pairwise

import numpy as np
import pytest
from matplotlib.container import BarContainer, ErrorbarContainer
from matplotlib.offsetbox import AnnotationBbox
from synthetic_assembly import distribution, outcome_classes, realisations

from driftwalk.core.errors import InputError
from driftwalk.plot.outcome_bars import plot_outcomes
from driftwalk.plot.parts.outcome_classes import classes_to_show
from driftwalk.plot.parts.style import print_style


def bars(ax) -> list[BarContainer]:
    return [artist for artist in ax.containers if isinstance(artist, BarContainer)]


def errors(ax) -> list[ErrorbarContainer]:
    return [artist for artist in ax.containers if isinstance(artist, ErrorbarContainer)]


def heights(container) -> list[float]:
    return [patch.get_height() for patch in container]


def upright(container) -> np.ndarray:
    """Return x, low and high of the error bars."""
    segments = np.array(container[2][0].get_segments())
    return np.column_stack([segments[:, 0, 0], segments[:, 0, 1], segments[:, 1, 1]])


@pytest.mark.parametrize(("blocks", "chirality"), [(2, "merged"), (4, "merged"), (4, "distinct")])
def test_bars_are_proportions_with_their_intervals(blocks, chirality) -> None:
    data = distribution(blocks, chirality)
    ax = plot_outcomes(data)
    (container,) = bars(ax)
    np.testing.assert_allclose(heights(container), data["proportion"])
    (interval,) = errors(ax)
    place, low, high = upright(interval).T
    np.testing.assert_allclose(place, np.arange(data.sizes["class"]), atol=1e-12)
    np.testing.assert_allclose(low, data["interval_low"], atol=1e-12)
    np.testing.assert_allclose(high, data["interval_high"])
    assert len([a for a in ax.artists if isinstance(a, AnnotationBbox)]) == data.sizes["class"]


def test_second_distribution_is_matched_by_name() -> None:
    first, second = distribution(), distribution(seed=5, tilt=0.5)
    turned = second.isel({"class": [3, 0, 9, 1, 2, 4, 5, 6, 7]})
    ax = plot_outcomes(first, beside=turned, labels=("none", "full"))
    one, two = bars(ax)
    np.testing.assert_allclose(heights(one), first["proportion"])
    expected = second["proportion"].values.copy()
    expected[8] = 0.0
    np.testing.assert_allclose(heights(two), expected)
    middles = [
        [patch.get_x() + patch.get_width() / 2 for patch in container] for container in (one, two)
    ]
    np.testing.assert_allclose(np.mean(middles, axis=0), np.arange(10), atol=1e-12)
    # A class that the second does not list has no interval: 10 bars, 9 intervals.
    assert [len(upright(container)) for container in errors(ax)] == [10, 9]
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts[0].startswith("none: 4 blocks, 1000 runs")
    assert texts[1].startswith("full: 4 blocks, 1000 runs")


@pytest.mark.slow
def test_of_68_classes_the_common_ones_are_shown_and_the_rest_is_summed() -> None:
    data = distribution(6)
    ax = plot_outcomes(data)
    drawn = np.array(heights(bars(ax)[0]))
    assert len(outcome_classes(6)) == 68
    assert len(drawn) == 21
    assert drawn.sum() == pytest.approx(1.0)
    largest = np.sort(data["proportion"].values)[::-1][:20]
    np.testing.assert_allclose(np.sort(drawn[:-1])[::-1], largest)
    assert len(upright(errors(ax)[0])) == 20
    assert "other: 48 rarer classes" in ax.get_xlabel()


@pytest.mark.parametrize(
    ("largest", "expected"),
    [
        ([0.2] * 3, [0, 1, 2]),
        ([0.0] * 16, list(range(16))),
        ([0.009, 0.5] + [0.0] * 15 + [0.02], [1, 17]),
        ([0.02] * 30, list(range(20))),
    ],
)
def test_choice_of_classes(largest, expected) -> None:
    names = [str(index) for index in range(len(largest))]
    assert classes_to_show(names, np.array(largest)) == expected


@pytest.mark.slow
@pytest.mark.parametrize("blocks", [4, 6])
def test_realisations_are_mean_and_standard_deviation(blocks) -> None:
    repeated = realisations(blocks=blocks)
    ax = plot_outcomes(distribution(blocks), realisations=repeated)
    spread = next(c for c in errors(ax) if "10 realisations" in str(c.get_label()))
    table = repeated["proportion"].values
    if blocks == 6:
        order = np.sort(np.argsort(-distribution(6)["proportion"].values, kind="stable")[:20])
        rest = np.delete(table, order, axis=1).sum(axis=1)
        table = np.column_stack([table[:, order], rest])
    _, low, high = upright(spread).T
    np.testing.assert_allclose((low + high) / 2, table.mean(axis=0), atol=1e-12)
    np.testing.assert_allclose((high - low) / 2, table.std(axis=0, ddof=1), atol=1e-12)


def test_legend_states_runs_completion_and_the_method() -> None:
    data = distribution()
    data.attrs |= {"complete": 0.931, "complete_low": 0.91, "complete_high": 0.95}
    data.attrs["method"] = "Clopper-Pearson, Bonferroni over the classes; more"
    texts = [text.get_text() for text in plot_outcomes(data).get_legend().get_texts()]
    assert texts == [
        "4 blocks, 1000 runs\none assembly in 93.1 % (91–95 %)",
        "95 % simultaneous intervals, Clopper-Pearson",
    ]


def test_line_divides_one_assembly_from_several() -> None:
    (line,) = [
        one for one in plot_outcomes(distribution()).lines if list(one.get_ydata()) == [0, 1]
    ]
    assert line.get_xdata()[0] == 4.5


def test_what_cannot_be_drawn_is_refused() -> None:
    data = distribution()
    with pytest.raises(InputError, match="dataset 'outcome_distribution', got assembly"):
        plot_outcomes(data.assign_attrs(kind="assembly"))
    with pytest.raises(InputError, match="lacks interval_low"):
        plot_outcomes(data.drop_vars("interval_low"))
    with pytest.raises(InputError, match="mirror images"):
        plot_outcomes(data, beside=distribution(chirality="distinct"))
    with pytest.raises(InputError, match="at least 2"):
        plot_outcomes(data, realisations=realisations(1))
    with pytest.raises(InputError, match="realisation, class"):
        plot_outcomes(data, realisations=data)


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("style", ["own", "print"])
@pytest.mark.parametrize("pair", [False, True])
def test_sketches_stay_apart_in_any_style(style, pair) -> None:
    """With the reader's large letters a wide legend once squeezed the bars together."""
    with print_style() if style == "print" else nullcontext():
        ax = plot_outcomes(
            distribution(4, "distinct"),
            beside=distribution(4, "distinct", seed=2) if pair else None,
            labels=("fixed parameters", "drawn from the region") if pair else ("", ""),
        )
        ax.figure.draw_without_rendering()
        boxes = [a.get_window_extent() for a in ax.artists if isinstance(a, AnnotationBbox)]
        legend = ax.get_legend().get_window_extent()
    assert len(boxes) == 12
    assert not any(left.overlaps(right) for left, right in pairwise(boxes))
    assert legend.x1 <= ax.figure.bbox.x1
