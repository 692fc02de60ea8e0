"""What is said of an answer that reaches the end of what was searched."""

from __future__ import annotations

import numpy as np
import pytest

from driftwalk.calibration.warnings import interval_warnings, optimum_warnings
from driftwalk.schema import Parameter

DRAG = Parameter("drag_coefficient", "1", 0.0, 2.0, step=0.1, label="drag coefficient")
SEARCH = (np.array(DRAG.coordinates),)
WINDOW = (np.linspace(0.4, 2.0, 17),)
MANY = np.linspace(0.8, 1.2, 50)[:, None]
REACHES = "the interval of the drag coefficient reaches the end of the "
REFINED = f"{REACHES}refined grid (0.4): it is wider than stated"
LARGER = f"{REACHES}search (2): extend the grid if larger values are possible"


def warned(
    low: float, high: float, *, window=WINDOW, estimates=MANY, border=MANY, known=()
) -> list[str]:
    ends = {
        "border": border, "search": SEARCH, "window": window, "lattice": window, "steps": [0.1],
    }  # fmt: skip
    return interval_warnings([DRAG], [(low, high)], estimates, **ends, known=known)


@pytest.mark.parametrize(
    ("low", "high", "said"),
    [
        (0.5, 1.9, []),
        (0.4, 1.9, [REFINED]),
        (0.5, 2.0, [LARGER]),
        (0.4, 2.0, [REFINED, LARGER]),
    ],
)
def test_an_interval_that_is_cut_off_is_named_with_the_end_that_cuts_it(low, high, said):
    assert warned(low, high) == said


def test_nothing_lies_below_a_drag_of_nothing():
    assert warned(0.0, 1.0, window=(np.linspace(0.0, 1.5, 16),)) == []


def test_what_was_said_of_the_optimum_is_not_said_again():
    optimum = optimum_warnings([DRAG], SEARCH, [1.96])
    assert list(optimum.values()) == [
        "the optimum lies at the edge of the grid: drag coefficient = 1.96 with the grid ending at "
        "2; extend the grid, or doubt the model"
    ]
    assert warned(0.5, 2.0, known=optimum) == []


def test_recordings_of_the_bootstrap_that_crowd_at_the_end_of_a_window_say_the_same():
    crowded = MANY.copy()
    crowded[:3] = 0.4
    assert warned(0.5, 1.9, estimates=crowded) == [REFINED]
    # At the end of the search they say nothing of the interval.
    crowded[:3] = 2.0
    assert warned(0.5, 1.9, estimates=crowded) == []


def test_a_region_that_is_cut_where_the_interval_is_not_is_named():
    reaches = "the joint region reaches, along the drag coefficient, the end of the "
    border = np.array([[0.5], [2.0], [1.0]])
    assert warned(0.5, 1.9, border=border) == [
        f"{reaches}search (2): extend the grid if larger values are possible"
    ]
    assert warned(0.5, 2.0, border=border) == [LARGER]
    border[0] = 0.4
    assert warned(0.5, 2.0, border=border)[0] == (
        f"{reaches}refined grid (0.4): it is wider than stated"
    )


def test_values_have_their_units_on_any_scale():
    """A rate of 1 has the coordinate 0, and is not the least that can be."""
    search = (np.linspace(0.0, 1.0, 3),)
    rate = Parameter("rate", "1/s", 1.0, 10.0, step=0.5, scale="log")
    ends = {"search": search, "window": search, "lattice": search, "steps": [0.5]}
    ends["border"] = MANY * 0.5
    assert interval_warnings([rate], [(0.0, 0.7)], MANY * 0.5, **ends) == [
        "the interval of the rate reaches the end of the search (1 1/s): extend the grid if "
        "smaller values are possible"
    ]


def test_a_parameter_with_one_value_is_at_its_only_end_once():
    assert len(optimum_warnings([DRAG], (np.array([0.3]),), [0.3])) == 1
