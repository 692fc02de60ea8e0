"""Each criterion of the check: its chance, the misfit it would find, and where the worst one is.

The misfit that is stated as detectable is put into the statistic's own distribution: then the
criterion has to fail nine times in ten.
"""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2, gamma, ncx2, norm

from driftwalk.likelihood.check.criteria import (
    LARGEST,
    LEAST,
    MODEL_CHECK,
    autocorrelation_criterion,
    change_criterion,
    distance_limit,
    drag_criterion,
    motion_criterion,
    noise_criterion,
    outlier_criterion,
    place_criterion,
    strength_criterion,
    tail_criterion,
    time_and_place_criterion,
)
from driftwalk.likelihood.check.place import Layout, LocalMeans, Spread, Trend
from driftwalk.likelihood.check.scan import Scan

LEVEL = MODEL_CHECK.level


def layout_of(parts: int = 4, cells: int = 3) -> Layout:
    axis = 0.02 * np.arange(float(cells))
    start = 60.0 * np.arange(parts)
    return Layout(axis, axis[:1], 0.02, np.zeros(parts, np.int64), start, start + 60.0, np.zeros(2))


def power_of_normal(shift: float, level: float) -> float:
    """Return how often a two-sided test at a level finds a shift, in its standard deviations."""
    return float(norm.sf(norm.isf(0.5 * level) - shift))


def whiteness(**more: Any) -> Any:
    found = {
        "largest": (1, 3),
        "autocorrelation": np.array([[0.01, 0.0, 0.02], [0.0, 0.0, 0.2]]),
        "expected": np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -0.01]]),
        "std": np.array([[0.02, 0.02, 0.02], [0.02, 0.02, 0.03]]),
        "portmanteau": 77.0,
        "portmanteau_dof": 6,
        "p_value": 1e-9,
        "excess_kurtosis": np.array([0.1, 0.4]),
        "kurtosis_p_value": np.array([1e-12, 1e-9]),
        "kurtosis_std": np.array([0.01, 0.05]),
        "tail_share": np.array([0.0027, 0.004]),
    }
    return SimpleNamespace(**{**found, **more})


def test_the_autocorrelation_names_its_largest_lag() -> None:
    found = autocorrelation_criterion(whiteness(), ("x", "y"))
    assert found.p_value == 1e-9
    assert found.failed
    assert "Ljung-Box statistic 77, expected 6 ± 3" in found.sentence
    assert "autocorrelation of y at lag 3 is +0.200, expected -0.010 ± 0.030" in found.sentence
    # One lag that is so far off adds its square to a chi squared of six numbers.
    size = (found.detectable / 0.02) ** 2
    assert ncx2.sf(chi2.isf(LEVEL, 6), 6, size) == pytest.approx(0.9, rel=1e-6)
    assert math.isnan(
        autocorrelation_criterion(whiteness(portmanteau_dof=0), ("x", "y")).detectable
    )


def test_tails_are_those_of_the_component_that_matters() -> None:
    """The other one is less like chance, and too small to matter."""
    found = tail_criterion(whiteness(), ("x", "y"))
    assert found.p_value == pytest.approx(2e-9)
    assert found.size == pytest.approx(0.4)
    assert "excess kurtosis of y +0.40, expected 0 ± 0.05" in found.sentence
    assert power_of_normal(found.detectable / 0.05, LEVEL / 2) == pytest.approx(0.9)
    small = tail_criterion(whiteness(excess_kurtosis=np.array([0.1, 0.2])), ("x", "y"))
    assert "excess kurtosis of x" in small.sentence
    assert (small.failed, small.note is None) == (False, False)
    sure = tail_criterion(whiteness(kurtosis_p_value=np.array([0.9, 0.8])), ("x", "y"))
    assert sure.p_value == 1.0


def errors(samples: int, outliers: int) -> Any:
    seen = np.arange(samples) < outliers
    return [SimpleNamespace(outlier=seen, used=~seen)]


@pytest.mark.parametrize(
    ("outliers", "before", "fails"),
    [(1, 0, False), (2, 0, True), (10, 40, False), (11, 40, True), (0, 0, False)],
)
def test_outliers_beyond_those_that_others_foretell(
    outliers: int, before: int, fails: bool
) -> None:
    """Of 1000 samples one; and a quarter of those that their neighbours show."""
    found = outlier_criterion(errors(1000, outliers), before)
    assert found.failed is fails
    assert found.p_value == (0.0 if fails else 1.0)
    expected = "none" if before == 0 else "10"
    assert f"{outliers} of 1000 samples" in found.sentence
    assert f"left out, expected {expected}:" in found.sentence
    # So many that nine in ten counts of that mean, with the scatter of a count, are one too many.
    least = (10 if before else 1) + 1
    count = 1000 * found.detectable
    assert count == pytest.approx(least + 1.2816 * math.sqrt(least), rel=1e-4)


def local(chi_squared: list[float], *, drag: float = 0.1, samples: float = 50.0) -> LocalMeans:
    size = len(chi_squared)
    return LocalMeans(
        np.full(size, samples), np.ones((size, 2)), np.array(chi_squared), np.full(size, drag)
    )


def test_the_worst_cell_counts_as_one_of_all_that_are_known() -> None:
    found = place_criterion(local([1.0, 36.0, math.nan]), layout_of())
    assert found.p_value == pytest.approx(2.0 * chi2.sf(36.0, 2))
    assert found.failed
    assert "is 6.0 sd from zero at x = 0.020 m, y = 0.000 m (50 samples)" in found.sentence
    assert f"below {math.sqrt(chi2.isf(0.025, 2)):.1f} in all 2 cells" in found.sentence
    assert found.size == pytest.approx(0.1)
    # A mean of 50 samples that is off by so much has 50 times its square for noncentrality.
    size = 50.0 * found.detectable**2
    assert ncx2.sf(chi2.isf(LEVEL / 2, 2), 2, size) == pytest.approx(0.9, rel=1e-6)
    usual = place_criterion(local([1.0, 1.2, 3.0]), layout_of())
    assert usual.p_value == pytest.approx(3.0 * chi2.sf(3.0, 2))
    assert usual.size == math.inf
    assert math.isnan(place_criterion(local([math.nan]), layout_of()).p_value)
    for cells, dof in ((1, 2), (40, 3)):
        assert chi2.sf(distance_limit(cells, dof) ** 2, dof) == pytest.approx(0.05 / cells)


def test_the_cells_of_a_part_add_up() -> None:
    """Of four parts with three cells the second is worst, and in it the third cell."""
    table = np.full((4, 3), 2.0)
    table[1] = [2.0, 20.0, 30.0]
    table[0, 2] = math.nan
    found = time_and_place_criterion(local(table.ravel().tolist()), layout_of())
    assert found.p_value == pytest.approx(4.0 * chi2.sf(52.0, 6))
    assert "between 60 s and 120 s" in found.sentence
    assert "add up to 52, expected 6 ± 3; most at x = 0.040 m" in found.sentence
    # Cells beyond what the largest of three exceeds once in twenty.
    limit = chi2.isf(0.05 / 3, 2)
    assert 2.0 < limit < 20.0
    assert found.size == pytest.approx(0.2)
    size = 150.0 * found.detectable**2
    assert ncx2.sf(chi2.isf(LEVEL / 4, 6), 6, size) == pytest.approx(0.9, rel=1e-6)
    nothing = local([math.nan] * 12)
    assert math.isnan(time_and_place_criterion(nothing, layout_of()).p_value)
    assert math.isnan(time_and_place_criterion(local([2.0] * 3), layout_of(1)).p_value)
    steady = time_and_place_criterion(local([2.0] * 12), layout_of())
    assert steady.p_value == 1.0
    assert steady.size == math.inf
    # Where the chance is 0 in double precision, the largest of all is worst.
    table[3] = 5e3
    assert "between 180 s and 240 s" in (
        time_and_place_criterion(local(table.ravel().tolist()), layout_of()).sentence
    )


def trend(change: list[float], std: list[float], visible: list[bool] | None = None) -> Trend:
    seen = np.ones(len(change), bool) if visible is None else np.array(visible)
    chi_squared = float((np.array(change) ** 2 / np.array(std) ** 2).sum())
    return Trend(np.array(change), np.array(std), chi_squared, len(change) - 1, seen)


def test_the_strength_of_the_flow_is_judged_where_it_is_seen() -> None:
    changes, stds = [0.01, -0.3, 0.9, 0.0], [0.02, 0.03, 0.04, 0.02]
    found = strength_criterion(trend(changes, stds, [True, True, False, True]), layout_of())
    whole = sum((a / b) ** 2 for a, b in zip(changes, stds, strict=True))
    assert found.p_value == pytest.approx(chi2.sf(whole, 3))
    assert "between 60 s and 120 s it is −30.0 % off" in found.sentence.replace("-", "−")
    assert found.size == pytest.approx(0.3)
    size = (found.detectable / 0.02) ** 2
    assert ncx2.sf(chi2.isf(LEVEL, 3), 3, size) == pytest.approx(0.9, rel=1e-6)
    assert (found.most, found.least) == (LARGEST.strength, LEAST.strength)
    blind = strength_criterion(trend(changes, stds, [False] * 4), layout_of())
    assert blind.size == pytest.approx(0.9)
    none = replace_dof(trend(changes, stds))
    assert math.isnan(strength_criterion(none, layout_of()).p_value)
    assert math.isnan(drag_criterion(none, np.zeros(5)).p_value)


def replace_dof(one: Trend) -> Trend:
    return one._replace(dof=0)


def test_the_drag_at_a_speed_has_the_error_of_the_fit_too() -> None:
    """A hypotenuse of 3, 4 and 5: 0.12 with the 0.05 that the fit itself brings about is 0.13."""
    found = drag_criterion(trend([0.65, -0.2, 0.1], [0.12] * 3), np.array([0.01, 0.02, 0.04, 0.08]))
    assert found.p_value == pytest.approx(2.0 * 3.0 * norm.sf(5.0))
    assert "at 0.01 to 0.02 m/s past the block" in found.sentence
    assert power_of_normal(found.detectable / 0.13, LEVEL / 3) == pytest.approx(0.9)
    assert found.most == LARGEST.drag
    assert drag_criterion(trend([0.01, 0.01], [0.12] * 2), np.arange(3.0)).p_value == 1.0


@pytest.mark.parametrize(("by", "place"), [("place", "at x = 0.040 m"), ("time", "between 120 s")])
def test_the_noise_of_a_group_is_a_mean_of_squares(by: str, place: str) -> None:
    """A scaled chi squared of 2 / std^2 degrees of freedom; the lower tail counts as well."""
    for ratio, tail in ((1.9, "above"), (0.3, "below")):
        spread = Spread(np.array([1.0, math.nan, ratio, 1.05]), np.array([0.1, math.nan, 0.2, 0.1]))
        found = noise_criterion(spread, layout_of(4, 4), by=by)
        dof = 2.0 / 0.2**2
        chance = chi2.sf(ratio * dof, dof) if tail == "above" else chi2.cdf(ratio * dof, dof)
        assert found.p_value == pytest.approx(2.0 * 3.0 * chance)
        assert chance == pytest.approx(
            gamma.sf(ratio, 25.0, scale=0.04)
            if tail == "above"
            else gamma.cdf(ratio, 25.0, scale=0.04)
        )
        assert place in found.sentence
        assert f"is {ratio:.2f} of the overall one, expected 1 ± 0.20" in found.sentence
        assert found.name == f"noise by {by}"
        assert power_of_normal(found.detectable / 0.1, LEVEL / 3) == pytest.approx(0.9)
    alone = Spread(np.array([1.0, math.nan]), np.array([0.1, math.nan]))
    assert math.isnan(noise_criterion(alone, layout_of(2, 2), by=by).p_value)


def test_a_change_has_its_time_and_its_size() -> None:
    scan = Scan(1, 2, 0.0312, 0.011, 0.002, 1e-5, 0.02)
    found = change_criterion(scan, layout_of())
    assert (found.p_value, found.detectable) == (1e-5, 0.02)
    assert "between 60 s and 180 s the velocities differ by 0.0312 m/s" in found.sentence
    assert "expected 0.011 ± 0.002 m/s" in found.sentence
    assert found.failed
    assert math.isnan(change_criterion(None, layout_of()).p_value)


@pytest.mark.parametrize("far", [True, False])
def test_steps_have_a_limit_of_power_where_the_recording_is_far(far: bool) -> None:
    motion: Any = SimpleNamespace(
        drawn_distance=np.array([0.2, 0.3]), drawn_between=np.array([0.1, 0.2]), p_value=1e-4,
        far=far, detectable=lambda level: 0.4 if level == LEVEL else 0.0,
    )  # fmt: skip
    found = motion_criterion(motion, angle="given")
    assert found.size == pytest.approx(0.25)
    assert found.powerless is far
    assert "KS distance 0.250 to those" in found.sentence
    assert "expected 0.150 ± 0.071" in found.sentence


def test_a_part_of_several_recordings_is_named_with_its_recording() -> None:
    two = replace(layout_of(), series=np.array([0, 0, 1, 1]))
    assert two.time_of(2) == "between 120 s and 180 s of recording 2"
    assert two.time_of(0, 1) == "between 0 s and 120 s of recording 1"
    assert layout_of().time_of(1) == "between 60 s and 120 s"
    cut = replace(two, sources=((0, 0), (0, 1)))
    assert [cut.flow(part) for part in range(4)] == [0, 0, 1, 1]
    assert cut.time_of(3) == "between 180 s and 240 s"
