"""What the criteria of the check can find, by simulating the alternative; and the verdict on it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.stats import chi2, norm

import driftwalk as dw
from driftwalk.likelihood.check.criteria import Criterion, tail_criterion
from driftwalk.likelihood.check.posterior_predictive import Density, MotionComparison
from driftwalk.likelihood.check.power import detectable_noncentrality, detectable_sigmas
from driftwalk.likelihood.check.verdict import verdict_on
from driftwalk.model import Study
from driftwalk.schema import FLAGS


def test_nine_in_ten_simulated_alternatives_fail() -> None:
    generator = np.random.default_rng(1)
    shift = detectable_sigmas(5e-4)
    found = generator.normal(shift, 1.0, 20_000) > norm.isf(5e-4)
    assert found.mean() == pytest.approx(0.9, abs=0.01)
    size = detectable_noncentrality(60, 5e-4)
    normals = generator.normal(size=(20_000, 60))
    normals[:, 0] += np.sqrt(size)
    found = (normals**2).sum(axis=1) > chi2.isf(5e-4, 60)
    assert found.mean() == pytest.approx(0.9, abs=0.01)


def motion(*, distance: float, floor: float, between: np.ndarray) -> MotionComparison:
    none = Density(*np.zeros((5, 1)))
    drawn = np.full(16, distance)
    return MotionComparison(np.full(16, distance), np.full(64, floor), drawn, between, none, none)


def test_the_detectable_distance_fails_at_the_level_and_nine_times_in_ten() -> None:
    """At the limit p is the level; 1.28 spreads further nine in ten recordings are beyond it."""
    between = np.exp(np.random.default_rng(2).normal(np.log(0.05), 0.2, 16))
    found = motion(distance=0.05, floor=0.05, between=between).detectable(5e-4)
    spread = np.log(between).std(ddof=1) * np.sqrt(1.0 + 1.0 / 16)
    limit = found * np.exp(-1.2816 * spread)
    at_limit = motion(distance=float(limit), floor=0.05, between=between)
    assert at_limit.p_value == pytest.approx(5e-4, rel=1e-3)


def fit_of(*, measured: int, **facts: float) -> Any:
    """Return as much of a fit as a verdict asks for: 50 by 50 nodes of 6 mm."""
    flag = np.full((50, 50), FLAGS["filled"], dtype=np.int8)
    flag.ravel()[:measured] = FLAGS["measured"]
    interval = np.array([[0.4, 0.5], [4e-4, 6e-4]])
    data = {
        "flag": (("y", "x"), flag),
        "cell_size": 0.006,
        "estimate": ("parameter", [0.45, 5e-4]),
        "interval": (("parameter", "bound"), interval),
        "confidence": 0.9,
        "wall_share": 0.0,
        "restricted": True,
        "drag_coefficient_relative_std": 0.02,
        **facts,
    }
    coords = {
        "parameter": np.array(["drag_coefficient", "force_std"]),
        "unit": ("parameter", np.array(["1", "N"])),
        "bound": ["lower", "upper"],
    }
    return xr.Dataset(data, coords, {"kind": "fit", "force_law": "paper"})


GOOD = Criterion("steps", 0.5, "simulated recordings have different steps", 0.1, 0.3)
STUDY = Study()


def said(fit: xr.Dataset, *criteria: Criterion) -> tuple[str, str]:
    word, reasons = verdict_on(fit, criteria or (GOOD,), study=STUDY)
    return word, "; ".join(reasons)


def test_a_sound_fit_explains() -> None:
    assert said(fit_of(measured=1000)) == ("explains", "")


@pytest.mark.parametrize(
    ("facts", "why"),
    [
        ({"measured": 100}, "over 4 % of the tank, 4.0 times its own area"),
        ({"wall_share": 0.84}, "84 % of the intervals are at the wall"),
        (
            {"wall_share": 0.3, "drag_coefficient_relative_std": 0.06},
            "at the wall for 30 % of the time, and C_d is known to 6.0 % only",
        ),
        ({"restricted": False}, "the restricted likelihood has no minimum"),
        (
            {"angle_disagreement_std": 4.0, "drag_coefficient_angle_given": 0.8},
            "4.0 combined standard deviations away",
        ),
        ({"interval": (("parameter", "bound"), [[0.0, np.inf], [4e-4, 6e-4]])}, "drag_coefficient"),
    ],
)
def test_a_number_without_a_meaning_cannot_tell(facts: dict[str, Any], why: str) -> None:
    word, reasons = said(fit_of(**{"measured": 1000, **facts}))
    assert word == "cannot tell"
    assert why in reasons


@pytest.mark.parametrize(("share", "std"), [(0.3, 0.049), (0.19, 0.06), (0.79, 0.04)])
def test_contacts_do_not_matter_where_they_are_few_or_c_d_is_known_well(
    share: float, std: float
) -> None:
    fit = fit_of(measured=1000, wall_share=share, drag_coefficient_relative_std=std)
    assert said(fit) == ("explains", "")


def test_a_floating_body_may_stay_on_a_small_orbit() -> None:
    fit = fit_of(measured=100).assign_attrs(force_law="floating body")
    assert said(fit) == ("explains", "")


@pytest.mark.parametrize(("kurtosis", "fails"), [(0.29, False), (-0.29, False), (0.31, True)])
def test_tails_matter_from_an_excess_kurtosis_on(kurtosis: float, fails: bool) -> None:
    """At 0.3 the standard error of sigma_F is (1 + 0.15)^(1/2) - 1 = 7 % too small."""
    white: Any = SimpleNamespace(
        excess_kurtosis=np.array([0.0, kurtosis]), kurtosis_p_value=np.array([1.0, 1e-9]),
        kurtosis_std=np.array([0.05, 0.05]), tail_share=np.array([0.0027, 0.004]),
    )  # fmt: skip
    found = tail_criterion(white, ("x", "y"))
    assert found.failed is fails
    assert (found.note is None) is fails


def test_a_criterion_without_power_cannot_tell_unless_it_failed() -> None:
    blind = GOOD._replace(detectable=0.9)
    assert said(fit_of(measured=1000), blind)[0] == "explains"
    word, reasons = said(fit_of(measured=1000, drag_coefficient_relative_std=0.15), blind)
    assert word == "cannot tell"
    assert "'steps' has no power: the smallest misfit that it finds is 0.9 (KS distance)" in reasons
    assert said(fit_of(measured=1000), GOOD._replace(p_value=np.nan))[0] == "cannot tell"
    failed = blind._replace(p_value=1e-6)
    assert said(fit_of(measured=1000), failed) == ("does not explain", failed.sentence)


def test_a_block_of_another_size_has_another_area() -> None:
    """One of 2 cm has been over 9 times its own area where one of 3 cm has over 4 times."""
    small = dw.apply_overrides(STUDY, {"block.side_m": 0.02})
    assert verdict_on(fit_of(measured=100), [GOOD], study=small).word == "explains"


def test_steps_have_no_power_where_the_recording_is_far_and_the_replicates_too() -> None:
    between = np.exp(np.random.default_rng(3).normal(np.log(0.5), 0.4, 16))
    assert motion(distance=0.8, floor=0.13, between=between).far
    assert not motion(distance=0.2, floor=0.13, between=between).far
