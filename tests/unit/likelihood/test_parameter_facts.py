"""Intervals of the stated numbers: errors of logarithms, propagated by differences."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from fit_worlds import coarse_study

from driftwalk.core.arrays import Floats
from driftwalk.likelihood.filter.filter_pass import Sums
from driftwalk.likelihood.filter.parameters import Body, Point
from driftwalk.likelihood.interval_inflation import (
    INFLATION,
    inflated,
    open_where_undetermined,
    parameter_covariance,
    parameter_facts,
    strips_error,
)
from driftwalk.likelihood.law.candidate_laws import CHANGES, STRENGTHS
from driftwalk.likelihood.law.force_law import effective_logs, side_slopes, stated_drag
from driftwalk.likelihood.newton import Mode
from driftwalk.likelihood.prior import PRIOR, Weights
from driftwalk.likelihood.reml import Restricted
from driftwalk.model import Study, apply_overrides

Z = 1.6448536269514722
FLOW = np.zeros((2, 2, 2))
POINT = Point(FLOW, math.log(0.5), math.log(2e-3), math.log(3e-4), math.log(1e-4), math.log(0.01))
WEIGHTS = Weights(1.0, 1.0)


def study_with(**changes: Any) -> Study:
    return apply_overrides(
        coarse_study("auto"),
        {
            "fit.confidence": 0.9,
            **{key.replace("__", "."): value for key, value in changes.items()},
        },
    )


def covariance_of(point: Point, seed: int = 1) -> Floats:
    size = 1 + len(point.extras)
    half = np.random.default_rng(seed).normal(size=(size, 3 * size))
    return 1e-3 * half @ half.T / size


def std_of(point: Point, covariance: Floats, what: Callable[[Point], float]) -> float:
    """Return the standard deviation of a function of the parameters, by its differences."""
    count = point.coefficients.size
    slopes = []
    for k in range(len(covariance)):
        step = np.zeros(count + len(covariance))
        step[count + k] = 1e-6
        slopes.append((what(point.moved(step)) - what(point.moved(-step))) / 2e-6)
    return math.sqrt(float(np.array(slopes) @ covariance @ np.array(slopes)))


def log_drag_of(point: Point) -> float:
    return math.log(1.0 - point.number("linear_share")) + point.log_drag


@pytest.mark.parametrize("opened", [{}, {"linear_share": 0.3, "marker_x": 1e-3}])
def test_intervals_are_those_of_the_logarithms(opened: dict[str, float]) -> None:
    study, point = study_with(), replace(POINT, opened=opened)
    covariance = covariance_of(point)
    facts = parameter_facts(point, covariance, study)
    interval, mass = study.forces.force_interval_s, study.block.mass_kg
    share = opened.get("linear_share", 0.0)
    wanted: dict[str, tuple[float, Callable[[Point], float]]] = {
        "drag_coefficient": (0.5 * (1.0 - share), log_drag_of),
        "force_std_N": (mass * math.sqrt(2e-3 / interval), lambda one: 0.5 * one.log_intensity),
        "force_noise_intensity_N2_s": (mass**2 * 2e-3, lambda one: one.log_intensity),
        "tracking_noise_m": (3e-4, lambda one: one.log_noise),
        "force_lever_m": (1e-4, lambda one: float(one.log_lever or 0.0)),
        "orientation_noise_rad": (0.01, lambda one: float(one.log_angle_noise or 0.0)),
    }
    for name, (value, log) in wanted.items():
        assert facts[name] == pytest.approx(value), name
        reach = Z * std_of(point, covariance, log)
        low, high = facts[f"{name}_interval"]
        # The strips of a face underrate the drag of a block that turns.
        strips = 1.0 - strips_error(8) if name == "drag_coefficient" else 1.0
        assert low == pytest.approx(value * strips * math.exp(-reach), rel=1e-5), name
        assert high == pytest.approx(value * math.exp(reach), rel=1e-5), name
    assert "effective_drag_coefficient" not in facts
    assert facts["confidence"] == 0.9
    assert facts["force_interval_s"] == interval


def test_an_uncertain_mass_and_side_widen_the_intervals() -> None:
    """Independent errors of the logarithm: mass and added mass, and the side by its slopes."""
    study = study_with(
        fit__mass_std_kg=0.0005, fit__added_mass_share=0.4, fit__added_mass_share_std=0.1,
        fit__side_std_m=1e-3, fit__pressure_gradient="on",
    )  # fmt: skip
    covariance = covariance_of(POINT)
    facts = parameter_facts(POINT, covariance, study, by_side=(-1.5, 0.5))
    mass = study.block.mass_kg
    inertia = math.hypot(0.1 / 1.4, 0.0005 / mass)
    side = 1e-3 / 0.03
    for name, log, slope, value in (
        ("drag_coefficient", log_drag_of, -1.5, 1.4 * 0.5),
        ("force_std_N", lambda one: 0.5 * one.log_intensity, 0.5,
         1.4 * mass * math.sqrt(2e-3 / study.forces.force_interval_s)),
    ):  # fmt: skip
        own = std_of(POINT, covariance, log)
        std = math.sqrt(own**2 + inertia**2 + (side * slope) ** 2)
        assert facts[name] == pytest.approx(value)
        assert facts[f"{name}_interval"][1] == pytest.approx(value * math.exp(Z * std), rel=1e-5)
        effective = facts[f"effective_{name}_interval"][1]
        assert facts[f"effective_{name}"] == pytest.approx(value / 1.4)
        assert effective == pytest.approx(value / 1.4 * math.exp(Z * own), rel=1e-5)
    assert facts["added_mass_share"] == 0.4
    assert facts["added_mass_share_interval"] == pytest.approx([0.4 - 0.1 * Z, 0.4 + 0.1 * Z])
    assert facts["force_noise_intensity_N2_s"] == pytest.approx(1.96 * mass**2 * 2e-3)
    assert stated_drag(POINT, study) == pytest.approx(0.7)


def test_without_a_word_of_the_added_mass_intervals_for_any_are_said() -> None:
    study = study_with()
    facts = parameter_facts(POINT, covariance_of(POINT), study)
    # Under the paper's law nothing is known of it: up to 0.5 and 1.64 times 0.2 more.
    most = 1.5 + 0.2 * Z
    for name, unit in (("drag_coefficient", ""), ("force_std", "_N")):
        low, high = facts[f"{name}{unit}_interval"]
        assert facts[f"{name}_any_added_mass_interval{unit}"] == [low, pytest.approx(most * high)]


@pytest.mark.parametrize(("log_std", "known"), [(2.2, True), (2.4, False)])
def test_beyond_a_power_of_ten_an_interval_is_open(log_std: float, known: bool) -> None:
    covariance = np.diag(np.array([log_std, 2.0 * log_std, 0.1, 0.1, 0.1]) ** 2)
    facts = parameter_facts(POINT, covariance, study_with())
    for name in ("drag_coefficient", "force_std_N"):
        low, high = facts[f"{name}_interval"]
        assert math.isfinite(high) is known
        assert (low > 0.0) is known


def test_numbers_of_departures_have_even_intervals() -> None:
    """Of a share of linear drag that of the friction; of the strength that of its change."""
    opened = {
        "linear_share": 0.3, "time_variance": 1e-6, "angle_offset": 0.1, "hidden_share": 0.2,
        "pulse_cosine": 0.03, "pulse_sine": 0.04,
        **{name: 0.01 * (k + 1) for k, name in enumerate(STRENGTHS)},
    }  # fmt: skip
    point, study = replace(POINT, opened=opened, fixed={"force_memory": 0.3}), study_with()
    covariance = 1e-2 * covariance_of(point)
    at = 1 + list(point.extras).index("time_variance")
    covariance[at] *= 1e-5
    covariance[:, at] *= 1e-5
    facts = parameter_facts(point, covariance, study)

    def check(key: str, value: float, what: Callable[[Point], float], *, rel: float = 1e-5) -> None:
        assert facts[key] == pytest.approx(value)
        reach = Z * std_of(point, covariance, what)
        wanted = [value - reach, value + reach]
        assert facts[f"{key}_interval"] == pytest.approx(wanted, rel=rel)

    check("orientation_offset_rad", 0.1, lambda one: one.number("angle_offset"))
    check("hidden_face_drag_share", 0.2, lambda one: one.number("hidden_share"))
    assert facts["hidden_face_drag_half_width"] == pytest.approx(
        Z * std_of(point, covariance, lambda one: one.number("hidden_share"))
    )
    change = -2.0 * sum(opened[name] for name in CHANGES)
    check(
        "flow_strength_change",
        change,
        lambda one: -2.0 * sum(one.number(name) for name in CHANGES),
    )
    assert facts["force_memory_s"] == 0.3
    assert facts["force_memory_s_interval"] == [0.3, 0.3]
    assert facts["time_stamp_noise_s"] == pytest.approx(1e-3)
    reach = Z * math.sqrt(covariance[at, at])
    ends = [math.sqrt(max(1e-6 + sign * reach, 0.0)) for sign in (-1, 1)]
    assert facts["time_stamp_noise_s_interval"] == pytest.approx(ends)
    assert facts["pulse_amplitude"] == pytest.approx(0.05)
    rows = [1 + list(point.extras).index(name) for name in ("pulse_cosine", "pulse_sine")]
    widest = Z * math.sqrt(max(covariance[row, row] for row in rows))
    assert facts["pulse_amplitude_interval"] == pytest.approx([0.05 - widest, 0.05 + widest])
    # Four faces of a side times the depth, each with a quarter of what a side a second pulls.
    side, depth = study.block.side_m, study.wetted_depth_m
    friction = 0.5 * study.water.density_kg_m3 * 0.5 * side * depth * side
    assert facts["linear_drag_kg_s"] == pytest.approx(0.3 * friction)
    share = 1 + list(point.extras).index("linear_share")
    width = Z * math.hypot(math.sqrt(covariance[share, share]), 0.3 * math.sqrt(covariance[0, 0]))
    assert facts["linear_drag_kg_s_interval"] == pytest.approx(
        [(0.3 - width) * friction, (0.3 + width) * friction]
    )


def test_the_force_of_each_flow_has_the_error_of_its_own_q() -> None:
    """What is common to all flows, as the error of the mass, counts in each."""
    contrasts = {"flow_intensity_1": math.log(4.0), "flow_intensity_2": -0.6}
    point = replace(POINT, coefficients=np.zeros((3, 2, 2, 2)), opened=contrasts)
    covariance = covariance_of(point, 5)
    study = study_with(fit__mass_std_kg=0.0005)
    facts = parameter_facts(point, covariance, study)
    first = facts["force_std_N"]
    assert facts["flow_force_std_N"] == pytest.approx([first, 2.0 * first, first * math.exp(-0.3)])
    inertia = 0.0005 / study.block.mass_kg
    for flow in range(3):
        name = f"flow_intensity_{flow}"

        def log(one: Point, name: str = name) -> float:
            return 0.5 * (one.log_intensity + one.opened.get(name, 0.0))

        reach = Z * math.hypot(std_of(point, covariance, log), inertia)
        value = facts["flow_force_std_N"][flow]
        ends = [facts[f"flow_force_std_{end}_N"][flow] for end in ("low", "high")]
        assert ends == pytest.approx([value * math.exp(-reach), value * math.exp(reach)], rel=1e-5)


@pytest.mark.parametrize("oriented", [True, False])
def test_c_d_has_the_error_of_its_own_criterion(oriented: bool) -> None:
    """Correlations stay, and each standard deviation has its calibrated factor."""
    angle = {} if oriented else {"log_lever": None, "log_angle_noise": None}
    point = replace(POINT, opened={"marker_x": 1e-3}, **angle)  # type: ignore[arg-type]
    size = 8 + 1 + len(point.extras)
    half = np.random.default_rng(2).normal(size=(size, 40))
    mode = Mode(point, WEIGHTS, half @ half.T, 1, 1, True, 0.0)
    both = [8, size - 1]
    known = 1.0 / np.linalg.inv(mode.covariance[np.ix_(both, both)])[0, 0]
    restricted = Restricted(point, 1.7 * math.sqrt(known), [], True)
    found = parameter_covariance(mode, restricted)
    own = mode.covariance[8:, 8:]
    std = np.sqrt(np.diag(found) / np.diag(own))
    factors = INFLATION.with_angle if oriented else INFLATION.without_angle
    assert std == pytest.approx([1.7 * factors[0], *factors[1:], INFLATION.number])
    np.testing.assert_allclose(found / own, np.outer(std, std))
    np.testing.assert_allclose(np.diag(inflated(np.eye(len(found)), point)) ** 0.5, [*factors, 1.3])


def test_c_d_that_its_prior_knows_as_well_is_open() -> None:
    """Where data and prior tell as much the posterior has 1 / sqrt(2) of the prior's deviation."""
    mode = Mode(POINT, WEIGHTS, np.eye(13), 1, 1, True, 0.0)
    covariance = np.eye(5)
    limit = PRIOR.log_drag_std / math.sqrt(2.0)
    for std, known in ((0.99 * limit, True), (1.01 * limit, False)):
        found = open_where_undetermined(covariance, mode, Restricted(POINT, std, [], True))
        assert math.isfinite(found[0, 0]) is known
        assert found[1, 1] == 1.0
    away = replace(mode, converged=False, left=2.1)
    found = open_where_undetermined(covariance, away, Restricted(POINT, 0.1, [], True))
    assert np.isinf(np.diag(found)).all()
    near = replace(mode, converged=False, left=1.9)
    assert open_where_undetermined(covariance, near, Restricted(POINT, 0.1, [], True))[1, 1] == 1.0


@dataclass(frozen=True)
class Told:
    """Passes whose step goes with the logarithm of the side."""

    body: Any
    slopes: Floats

    def sums(self, point: Point) -> Sums:
        score = 0.01 + self.slopes * math.log(self.body.side / 0.03)
        return Sums(0.0, 4.0 * score, 4.0 * np.eye(self.slopes.size), 1)


def test_slopes_by_the_side_are_a_difference_of_steps() -> None:
    """Sums whose step goes with the logarithm of the side: the slope is what was put in."""
    study = study_with(fit__side_std_m=1e-4)
    slopes = np.zeros(13)
    slopes[8:10] = [-1.2, 0.7]

    body: Any = SimpleNamespace(side=0.03, orientation="state")
    search: Any = SimpleNamespace(
        passes=Told(body, slopes), prior=SimpleNamespace(add=lambda sums, *_: sums)
    )
    mode: Any = SimpleNamespace(weights=WEIGHTS)
    restricted = Restricted(POINT, 0.1, [], True)
    found = side_slopes(search, mode, restricted, study)
    assert found == pytest.approx((-1.2, 0.35), rel=1e-6)
    assert side_slopes(search, mode, restricted, study_with()) == (0.0, 0.0)


def test_a_stored_fit_gives_the_filter_its_numbers_back() -> None:
    import xarray as xr

    study = study_with()
    interval, mass = 0.02, study.block.mass_kg
    force = mass * math.sqrt(2e-3 / interval)
    data = {
        "estimate": ("parameter", [0.7, force, 9.0]),
        "force_interval": interval,
        "filter_drag_coefficient": 0.5,
    }
    names = ["drag_coefficient", "effective_force_std", "force_std"]
    fit = xr.Dataset(data, {"parameter": names})
    assert effective_logs(fit, study) == pytest.approx((math.log(0.5), math.log(2e-3)))
    plain = xr.Dataset(
        {**data, "estimate": ("parameter", [0.7, 1.0, force])},
        {"parameter": ["drag_coefficient", "tracking_noise", "force_std"]},
    )
    assert effective_logs(plain, study) == pytest.approx((math.log(0.5), math.log(2e-3)))


def test_a_body_is_that_of_its_study() -> None:
    study = study_with()
    found = Body(study, "given")
    assert isinstance(found, Body)
    numbers = found.native(POINT)
    assert (found.side, numbers["mass"]) == (study.block.side_m, study.block.mass_kg)
    assert numbers["side"] == found.side
    assert numbers["depth"] == study.wetted_depth_m
    assert found.orientation == numbers["orientation"] == "given"
