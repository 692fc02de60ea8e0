"""A measured flow that is mirrored or shifted is found where it belongs."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

from driftwalk.likelihood.check import measured as placed
from driftwalk.likelihood.check.measured import PLACEMENT, best_placement, left_out_sentence
from driftwalk.likelihood.spline import Spline
from driftwalk.schema import FLAGS

SPLINE = Spline(-0.12, -0.12, 0.04, 9, 9)
AXIS = np.linspace(-0.06, 0.06, 13)
WIDE = np.linspace(-0.08, 0.08, 17)
COEFFICIENTS = np.random.default_rng(1).normal(0.0, 0.02, (2, 9, 9))


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Try shifts of one centimetre, to either side, instead of four in half centimetres."""
    monkeypatch.setattr(placed, "PLACEMENT", PLACEMENT._replace(farthest_m=0.01, step_m=0.01))


def measured_at(nodes: np.ndarray = WIDE) -> Any:
    return SimpleNamespace(
        spline=SPLINE,
        own=COEFFICIENTS.reshape(2, -1),
        x=nodes,
        y=nodes,
        velocity=np.zeros((2, nodes.size, nodes.size)),
    )


def moved_by(
    monkeypatch: pytest.MonkeyPatch, signs: tuple[float, float], shift: tuple[float, float]
) -> xr.Dataset:
    """Return the fitted flow whose measurement has mirrored axes, and then is shifted."""
    at_x, at_y = signs[0] * AXIS + shift[0], signs[1] * AXIS + shift[1]
    u, v = SPLINE.values(COEFFICIENTS, at_x, at_y)
    flag = np.full(u.shape, FLAGS["measured"])
    data = {"u": signs[0] * u, "v": signs[1] * v, "flag": flag}
    flow = xr.Dataset(
        {name: (("y", "x"), values) for name, values in data.items()}, {"x": AXIS, "y": AXIS}
    )
    monkeypatch.setattr(placed, "fitted_flow", lambda fit, *, interval: flow)
    return flow


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize(
    ("signs", "shift", "words"),
    [
        ((1.0, 1.0), (0.0, 0.0), ""),
        ((-1.0, 1.0), (0.0, 0.0), "mirrored in x"),
        ((1.0, -1.0), (0.0, 0.0), "mirrored in y"),
        ((-1.0, -1.0), (0.0, 0.0), "turned by 180°"),
        ((1.0, 1.0), (0.01, 0.0), "shifted by -10 mm in x and 0 mm in y"),
        ((1.0, 1.0), (0.0, -0.01), "shifted by 0 mm in x and 10 mm in y"),
        ((-1.0, 1.0), (0.01, 0.01), "mirrored in x and shifted by 10 mm in x and -10 mm in y"),
    ],
)
def test_a_flow_is_found_where_it_was_put(
    monkeypatch: pytest.MonkeyPatch,
    signs: tuple[float, float],
    shift: tuple[float, float],
    words: str,
) -> None:
    """The words say how to move the measurement back onto the flow."""
    found = best_placement(measured_at(), moved_by(monkeypatch, signs, shift))
    assert found.words == words
    assert found.correlation == pytest.approx(1.0)


@pytest.mark.usefixtures("few")
def test_correlations_are_those_of_the_nodes_that_both_have(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Some of the fitted nodes are not measured, and the measurement has holes."""
    flow = moved_by(monkeypatch, (1.0, 1.0), (0.0, 0.0))
    noise = 0.01 * np.random.default_rng(2).normal(size=(2, 13, 13))
    flow["u"].values[:] += noise[0]
    flow["v"].values[:] += noise[1]
    flow["flag"].values[:, :4] = FLAGS["filled"]
    one = measured_at()
    one.velocity[:, 3:6, 9] = np.nan
    found = best_placement(one, flow)
    assert found.words == ""
    there = (flow["flag"].values == FLAGS["measured"]) & np.isfinite(one.velocity[0][2:15, 2:15])
    plain = SPLINE.values(COEFFICIENTS, AXIS, AXIS)[:, there]
    seen = np.stack([flow["u"].values, flow["v"].values])[:, there]
    wanted = (plain * seen).sum() / np.sqrt((plain**2).sum() * (seen**2).sum())
    assert wanted < 0.99
    assert found.correlation == pytest.approx(wanted)


def test_a_placement_that_covers_too_little_does_not_count() -> None:
    one = np.ones((2, 4, 5))
    known = np.arange(20).reshape(4, 5) < 10
    assert placed._correlation(one, one, known, 10.0) == pytest.approx(1.0)
    assert placed._correlation(one, one, known, 10.5) == -1.0
    assert placed._correlation(0.0 * one, one, known, 5.0) == -1.0
    assert placed._correlation(one, -2.0 * one, known, 5.0) == pytest.approx(-1.0)


def test_a_place_has_the_nearest_node_or_none() -> None:
    nodes = np.array([0.1, 0.2, 0.3])
    places = np.array([-9.0, 0.04, 0.06, 0.14, 0.16, 0.34, 0.36, 9.0])
    assert placed._nearest(nodes, places).tolist() == [0, 0, 1, 1, 2, 3, 4, 4]


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize(
    ("signs", "said"),
    [
        ((-1.0, 1.0), "mirrored in x it is the one that moves the block (correlation 1.00)"),
        ((1.0, 1.0), "it is another flow than the one that moves the block"),
    ],
)
def test_what_is_said_of_a_flow_that_contradicts_the_motion(
    monkeypatch: pytest.MonkeyPatch, signs: tuple[float, float], said: str
) -> None:
    moved_by(monkeypatch, signs, (0.0, 0.0))
    fit = xr.Dataset(
        {
            "estimate": ("parameter", [0.456]),
            "interval": (("parameter", "bound"), [[0.41, 0.51]]),
        },
        {"parameter": ["drag_coefficient"]},
    )
    sentence = left_out_sentence(measured_at(), fit)
    assert "with a C_d of 0.456 (0.41 to 0.51)" in sentence
    assert sentence.endswith(said)
