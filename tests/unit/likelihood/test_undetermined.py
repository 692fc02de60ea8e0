"""Numbers that a recording does not determine, and fits beside the main one that break down."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from command_line import here, leave_out_figures, refusal
from fit_worlds import coarse_study, fitted, recording

import driftwalk as dw
from driftwalk.conditions import estimated_study
from driftwalk.core.errors import InputError
from driftwalk.likelihood import angle_consistency, compare_laws, estimate_wall, judge_fit, reml
from driftwalk.likelihood.check import run
from driftwalk.likelihood.contacts import estimate as wall
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.interval_inflation import parameter_facts, strips_error
from driftwalk.likelihood.law.forward_selection import ForwardSelection, LawResult
from driftwalk.likelihood.law.search import LawSearch
from driftwalk.likelihood.newton import Mode, ModeSearch, require_mode
from driftwalk.likelihood.prior import Weights
from driftwalk.notebook.result import answer_lines
from driftwalk.page.sections.fit import fit_summary
from driftwalk.schema import build_trajectory
from driftwalk.schema.answers.facts import facts_of, sentences
from driftwalk.schema.answers.fit import fit_json
from driftwalk.schema.answers.force_law import law_limits

UNKNOWN = "not determined by this recording"


def driven_on_a_circle(seed: int = 1, samples: int = 400) -> xr.Dataset:
    """Return a body on a circle, with 1 mm of noise and an exact angle: no force drives it."""
    time, angle = 0.1 * np.arange(samples), 0.05 * np.arange(samples)
    noise = np.random.default_rng(seed).normal(0.0, 1e-3, (2, samples))
    x, y = 0.08 * np.cos(angle) + noise[0], 0.08 * np.sin(angle) + noise[1]
    return build_trajectory(time, x, y, angle)


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("circle") / "circle.csv"
    one = driven_on_a_circle().isel(body=0)
    rows = np.column_stack([one["time"], one["x"], one["y"], one["theta"]])
    np.savetxt(path, rows, delimiter=",", header="t,x,y,theta", comments="")
    return path


def test_a_profile_is_not_computed_twice_at_one_point(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The first guess of the minimum, two standard deviations down, is where the second profile is.
    A parabola and a straight line have their minimum at -sd^2 times the line's slope."""
    sd = 0.1

    def profile(_: Any, mode: Mode, log_drag: float, coefficients: np.ndarray) -> reml.Profile:
        slope, determinant = log_drag / sd**2, 2.0 * log_drag / sd
        return reml.Profile(log_drag, 0.0, slope, determinant, coefficients, reml.Pull())

    monkeypatch.setattr(reml, "profile_at", profile)
    point = Point(np.zeros((2, 1, 1)), log_drag=0.0, log_intensity=-10.0, log_noise=-8.0)
    mode = Mode(point, Weights(1.0, 1.0), np.diag([1.0, 1.0, sd**2, 1.0, 1.0]), 1, 1, True, 0.0)
    outline = SimpleNamespace(disc_radius_m=None)
    search: Any = SimpleNamespace(passes=SimpleNamespace(body=SimpleNamespace(outline=outline)))
    found = reml.restricted_drag(search, mode, intensity=False)
    assert [one.log_drag / sd for one in found.profiles] == pytest.approx(
        [-4.0, -2.0, 0.0], abs=0.01
    )
    assert found.point.log_drag == pytest.approx(-2.0 * sd, rel=1e-3)
    assert found.log_drag_std == pytest.approx(sd)


def test_the_force_moves_by_the_slope_of_the_determinant_at_the_minimum(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The determinant has the slope 0.8 by ln q, and bends with C_d: no point between the profiles
    tells its value. Newton's step is the variance of ln q times the slope."""
    sd, variance, slope = 0.1, 0.02, 0.8

    def profile(_: Any, mode: Mode, log_drag: float, coefficients: np.ndarray) -> reml.Profile:
        bent = 50.0 * log_drag**2 + 2.0 * log_drag / sd + slope * mode.point.log_intensity
        return reml.Profile(log_drag, 0.0, log_drag / sd**2, bent, coefficients, reml.Pull())

    monkeypatch.setattr(reml, "profile_at", profile)
    point = Point(np.zeros((2, 1, 1)), log_drag=0.0, log_intensity=-10.0, log_noise=-8.0)
    covariance = np.diag([1.0, 1.0, sd**2, variance, 1.0])
    mode = Mode(point, Weights(1.0, 1.0), covariance, 1, 1, True, 0.0)
    outline = SimpleNamespace(disc_radius_m=None)
    search: Any = SimpleNamespace(passes=SimpleNamespace(body=SimpleNamespace(outline=outline)))
    found = reml.restricted_drag(search, mode)
    assert found.has_minimum
    assert found.point.log_drag < -0.5 * sd
    assert found.point.log_intensity == pytest.approx(-10.0 - variance * slope)


@pytest.mark.slow
def test_a_motion_without_random_force_has_no_numbers(
    table: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    leave_out_figures(monkeypatch)
    study = ("--tank", "30cm", "--spline-spacing", "5cm", "--no-check")
    done = here("fit", table, *study, "-o", tmp_path / "run")
    assert done.code == 0, done.err
    for label in ("drag coefficient C_d", "stochastic force σ_F", "tracking noise"):
        (row,) = [line for line in done.out.splitlines() if line.startswith(label)]
        assert row.split(maxsplit=label.count(" ") + 1)[-1] == UNKNOWN
    assert "standard deviations from a maximum of the likelihood" in done.err
    assert done.err.splitlines()[-1].startswith("next: driftwalk report")
    said = refusal(here("assemble", tmp_path / "run", "-o", tmp_path / "four"))
    assert "does not determine drag_coefficient" in said
    found = xr.load_dataset(tmp_path / "run" / "fit.nc", engine="h5netcdf")
    assert np.isinf(found["interval"].sel(bound="upper")).all()
    assert any(line.endswith(UNKNOWN) for line in answer_lines(found)[:2])
    (drag, *_), words = (fit_summary(found)[key] for key in ("numbers", "paragraphs"))
    assert (drag["value"], drag["note"]) == (None, UNKNOWN)
    assert f"The drag coefficient is {UNKNOWN}." in " ".join(words)
    with pytest.raises(InputError, match="does not determine drag_coefficient"):
        estimated_study(found)
    stated = {"forces.drag_coefficient": 0.4, "forces.force_std_N": 1e-3}
    assert estimated_study(found, stated).forces.drag_coefficient == 0.4
    answer = fit_json(found)
    assert answer["drag_coefficient"] is answer["tracking_noise_m"] is None


@pytest.mark.slow
def test_the_fit_with_the_angle_given_may_break_down_alone(monkeypatch: Any) -> None:
    study, track = coarse_study(), recording(60.0)

    class Diverged(ModeSearch):
        def find(self, *given: Any, **options: Any) -> Mode:
            mode = require_mode(super().find(*given, **options))
            # Beyond 709 the exponential of ln q is no longer a double.
            return replace(mode, point=replace(mode.point, log_intensity=2000.0))

    alone = dw.fit_motion(track, study)
    with monkeypatch.context() as patch:
        patch.setattr(angle_consistency, "ModeSearch", Diverged)
        patch.setattr(
            angle_consistency, "restricted_drag", lambda _, mode, *rest, **more: _at(mode)
        )
        left_out = dw.fit_motion(track, study)
    facts = facts_of(left_out)
    assert math.isnan(facts["angle_disagreement_std"])
    assert any("with the angle as an input has no solution" in one for one in facts["warnings"])
    np.testing.assert_array_equal(left_out["estimate"], alone["estimate"])
    np.testing.assert_array_equal(left_out["interval"], alone["interval"])


def _at(mode: Mode) -> Any:
    from driftwalk.likelihood.reml import Restricted

    return Restricted(mode.point, 0.1, [], has_minimum=False)


@pytest.mark.slow
@pytest.mark.parametrize("error", [OverflowError("math range error"), np.linalg.LinAlgError("no")])
def test_a_check_or_a_wall_that_breaks_down_leaves_the_fit(error: Any, monkeypatch: Any) -> None:
    def breaks(*given: Any, **options: Any) -> None:
        raise error

    track, fit = recording(60.0), fitted(60.0)
    monkeypatch.setattr(run, "check_model", breaks)
    found = judge_fit(fit, [track])
    assert found.check is None
    assert str(error) in found.fit.attrs["check_left_out"]
    monkeypatch.setattr(wall, "WALL_CONTACT", wall.WALL_CONTACT._replace(fewest=0))
    monkeypatch.setattr(wall, "search_walls", breaks)
    assert str(error) in estimate_wall(fit, [track]).attrs["wall_left_out"]


def test_nothing_stands_on_numbers_that_are_not_determined() -> None:
    track, fit = recording(60.0), fitted(60.0).copy(deep=True)
    fit["interval"].loc[{"bound": "upper"}] = math.inf
    fit["estimate"].loc[{"parameter": "force_std"}] = 0.0
    left_out = estimate_wall(fit, [track]).attrs["wall_left_out"]
    assert "needs drag_coefficient and force_std, which this recording does not" in left_out
    assert np.isnan(compare_laws(fit, [track])["compared_log_score"]).all()
    assert "does not determine" in judge_fit(fit, [track]).fit.attrs["check_left_out"]


def test_what_the_prior_alone_says_is_no_number() -> None:
    """Ten seconds of motion say less of C_d than that it is about 0.5."""
    facts = facts_of(dw.fit_motion(recording(10.5), coarse_study(), angle="given"))
    assert facts["drag_coefficient_interval"] == [0.0, math.inf]
    assert np.isfinite(facts["tracking_noise_m_interval"]).all()
    assert any("does not determine C_d" in one for one in facts["warnings"])


@pytest.mark.parametrize("share", [1.6, 1.0 - 1e-9, 0.97])
def test_a_quadratic_part_of_the_drag_at_or_below_zero_is_no_number(share: float) -> None:
    study, spline = coarse_study(), np.zeros((2, 4, 4))
    point = Point(spline, math.log(0.7), -9.0, -16.0, opened={"linear_share": share})
    facts = parameter_facts(point, np.diag([0.01, 0.01, 0.01, 0.01]), study)
    assert facts["drag_coefficient_interval"] == [0.0, math.inf]
    assert math.isfinite(facts["force_std_N_interval"][1])
    ends = {
        "drag_coefficient_any_added_mass_interval": facts["drag_coefficient_interval"],
        "force_std_any_added_mass_interval_N": facts["force_std_N_interval"],
    }
    said = law_limits({**facts, **ends, "force_law": "paper", "drag_law": "mixed"})[-1]
    assert "σ_F is between" in said
    assert "C_d is between" not in said


def test_an_ordinary_interval_is_as_before() -> None:
    point = Point(np.zeros((2, 4, 4)), math.log(0.7), -9.0, -16.0)
    facts = parameter_facts(point, np.diag([0.01, 0.01, 0.01]), coarse_study())
    width = 0.1 * 1.6448536269514722
    ends = [0.7 * math.exp(-width), 0.7 * math.exp(width)]
    np.testing.assert_allclose(facts["drag_coefficient_interval"], ends, rtol=1e-12)


@pytest.mark.parametrize("strips", [2, 8, 64])
def test_the_interval_of_a_turning_block_holds_the_drag_of_a_face_without_strips(
    strips: int,
) -> None:
    """The torque of a pure spin of a square with h = 1: r (1 + r^2) per length of a face."""
    half = strips // 2
    centres = (np.arange(half) + 0.5) / half
    integral = 0.5 + 0.25
    of_strips = float((centres * (1.0 + centres**2)).mean())
    assert strips_error(strips) == pytest.approx(1.0 - of_strips / integral, rel=1e-9)
    point = Point(np.zeros((2, 4, 4)), math.log(0.7), -9.0, -16.0, -8.0, -5.0)
    study = dw.apply_overrides(coarse_study(), {"block.strips_per_face": strips})
    facts = parameter_facts(point, np.diag([0.01] * 5), study)
    width = 0.1 * 1.6448536269514722
    ends = [0.7 * math.exp(-width) * of_strips / integral, 0.7 * math.exp(width)]
    np.testing.assert_allclose(facts["drag_coefficient_interval"], ends, rtol=1e-12)


BROKEN = [
    OverflowError("math range error"),
    np.linalg.LinAlgError("not positive definite"),
    ValueError("the filter refuses it"),
    FloatingPointError("divide by zero"),
]


@pytest.mark.parametrize("error", BROKEN)
def test_every_search_beside_the_law_may_break_down_alone(error: Any) -> None:
    def breaks(_: LawResult) -> LawResult:
        raise error

    search = object.__new__(LawSearch)
    law = LawResult(None, None, False, {}, math.inf, None)  # type: ignore[arg-type]
    for what in ("departures from it", "the other law"):
        law = search._try_search(law, what, breaks)
    assert law.left_out == ("departures from it", "the other law")
    other = replace(law, floating=True, left_out=())
    found = search._try_search(law, "another power of the drag", lambda _: other)
    assert (found.floating, found.left_out) == (True, law.left_out)


@pytest.mark.slow
def test_a_fit_without_its_departures_says_so(monkeypatch: Any) -> None:
    def breaks(*given: Any) -> None:
        raise OverflowError("math range error")

    monkeypatch.setattr(ForwardSelection, "select", breaks)
    found = dw.fit_motion(recording(15.0), coarse_study(), angle="given")
    assert np.isfinite(found["estimate"]).all()
    said = " ".join(sentences(found, "warning"))
    assert "the search for departures from it has no solution and was left out" in said
