"""The likelihood fit as a whole, on parts of the bundled recording, and what it refuses."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import xarray as xr
from fit_worlds import DRAG, FORCE_N, NOISE_M, coarse_study, fitted, recording

import driftwalk as dw
from driftwalk.core.errors import InputError
from driftwalk.flow.grid import Grid
from driftwalk.likelihood.filter.series import Series
from driftwalk.likelihood.result import footprint_count, whiteness_of
from driftwalk.model import apply_overrides
from driftwalk.schema import FLAGS, build_trajectory
from driftwalk.schema.answers.facts import facts_of


@pytest.fixture(scope="module")
def track() -> xr.Dataset:
    return recording(600.0)


@pytest.fixture(scope="module")
def fit() -> xr.Dataset:
    return fitted(600.0)


STEP_16_MS = 0.014
"""By which ln C_d comes out too large because the bundled recordings were integrated in Euler steps
of 16 ms, in which speeds fall by more than in smooth motion: in eight worlds of ten minutes +2.0 %
at 16 ms and +0.7 % at 2 ms, the force the same. With the angle in the state two sd are not more."""


NAMES = ("drag_coefficient", "force_std_N", "tracking_noise_m")


def standard_deviations(fit: xr.Dataset) -> np.ndarray:
    """Return those of the logarithms of the parameters."""
    return np.sqrt(np.diag(fit["covariance"].values))[:3] * (1.0, 0.5, 1.0)


def deviations(fit: xr.Dataset) -> np.ndarray:
    """Return how far the parameters are from the truth, in their standard deviations."""
    truth = np.array([DRAG * np.exp(STEP_16_MS), FORCE_N, NOISE_M])
    return np.log(np.array([facts_of(fit)[name] for name in NAMES]) / truth) / standard_deviations(
        fit
    )


def test_the_truth_is_within_the_errors(fit: xr.Dataset) -> None:
    """4 sd for each of three: once in 5000 runs, if the errors are right."""
    assert np.abs(deviations(fit)).max() < 4.0
    assert facts_of(fit)["converged"] == "yes"
    for name in ("drag_coefficient", "force_std_N", "force_noise_intensity_N2_s"):
        low, high = facts_of(fit)[f"{name}_interval"]
        assert low < facts_of(fit)[name] < high
    assert facts_of(fit)["force_noise_intensity_N2_s"] == pytest.approx(
        facts_of(fit)["force_std_N"] ** 2 * facts_of(fit)["force_interval_s"]
    )
    # 90 % of a normal: 1.645 sd on either side, in logarithms; a face without strips besides.
    low, high = np.log(facts_of(fit)["drag_coefficient_interval"])
    assert high - low + np.log(1.0 - 2.0 / 192.0) == pytest.approx(2 * 1.644854 * np.sqrt(fit["covariance"].values[0, 0]))


def test_restricted_likelihood_lowers_the_drag(fit: xr.Dataset) -> None:
    assert facts_of(fit)["drag_coefficient"] < facts_of(fit)["maximum_likelihood_drag_coefficient"]


def test_innovations_are_white(fit: xr.Dataset) -> None:
    """Some 12,000 numbers: 4 sd of the mean square are 5 %, and the fit takes less than 1 %."""
    assert facts_of(fit)["chi_squared_per_dof"] == pytest.approx(1.0, abs=0.06)
    assert abs(facts_of(fit)["autocorrelation"]) < 4.0 * facts_of(fit)["autocorrelation_std"]
    assert facts_of(fit)["warnings"] == []


def test_the_flow_is_within_its_standard_errors(fit: xr.Dataset) -> None:
    flow = dw.fitted_flow(fit)
    truth = dw.tank30_flow()
    assert flow["x"].values == pytest.approx(truth["x"].values)
    true = {name: truth[name].values for name in ("u", "v")}
    measured = flow["flag"].values == FLAGS["measured"]
    assert measured.sum() > 500
    for name, value in true.items():
        error = (flow[name].values - value)[measured]
        assert np.sqrt((error**2).mean()) < 0.15 * np.sqrt((value[measured] ** 2).mean())
        ratio = error / flow[f"{name}_standard_error"].values[measured]
        assert 0.2 < np.sqrt((ratio**2).mean()) < 2.5
    assert np.isnan(flow["u_standard_error"].values[~measured]).all()
    assert np.isfinite(fit["u_standard_error"].values).all()


def test_the_flow_is_taken_by_the_others(fit: xr.Dataset) -> None:
    run = dw.simulate(
        coarse_study(), dw.fitted_flow(fit), sample_time=np.arange(0.0, 5.0, 0.1), replicates=1
    )
    assert int(run["status"].values[0]) == 0
    assert np.isfinite(run["x"].values).all()


@pytest.mark.slow
@pytest.mark.false_alarm(2e-4)
def test_a_recording_with_holes_gives_the_same_within_errors(
    track: xr.Dataset, fit: xr.Dataset, fresh_seed: Callable[[int], int]
) -> None:
    """A fifth of the samples and 100 s are missing; the rest are the same motion and noise.

    So the two answers are nearer to each other than either is to the truth: the estimate of a part
    is that of the whole and an independent error, of the variance that the part has more (Hausman
    1978). 4 sd of it for each of three: once in 5000 choices of what is missing.
    """
    generator = np.random.default_rng(fresh_seed(7))
    time = track["time"].values
    lost = (generator.random(time.size) < 0.2) | ((time > 200.0) & (time < 300.0))
    holes = track.copy(deep=True)
    for name in ("x", "y"):
        holes[name].values[lost] = np.nan
    holes["theta"].values[generator.random(time.size) < 0.1] = np.nan
    found = dw.fit_motion(holes, coarse_study())
    part, whole = (np.array([facts_of(one)[name] for name in NAMES]) for one in (found, fit))
    more = standard_deviations(found) ** 2 - standard_deviations(fit) ** 2
    assert (more > 0.0).all()
    assert np.abs(np.log(part / whole) / np.sqrt(more)).max() < 4.0
    assert facts_of(found)["samples"] == np.count_nonzero(~lost)


@pytest.mark.study
def test_two_recordings_are_better_than_one(track: xr.Dataset, fit: xr.Dataset) -> None:
    """In every run: `test_several_recordings` of the command line."""
    both = dw.fit_motion([track, recording(600.0, "second")], coarse_study())
    ratio = np.sqrt(np.diag(both["covariance"].values) / np.diag(fit["covariance"].values))
    # Twice the data: 1 / sqrt(2), as far as the information does not vary from one to the other.
    lever = 3  # known from its prior alone
    assert np.delete(ratio, lever) == pytest.approx(np.full(4, np.sqrt(0.5)), rel=0.25)
    assert facts_of(both)["recordings"] == 2
    assert np.abs(deviations(both)).max() < 4.0


@pytest.mark.study
def test_without_angles_the_drag_is_averaged(track: xr.Dataset) -> None:
    """In every run: `test_people_read_the_answer` of the command line fits without angles."""
    blind = track.copy(deep=True)
    blind["theta"].values[:] = np.nan
    found = dw.fit_motion(blind, coarse_study())
    assert found.attrs["angle"] == "none"
    assert "no orientation" in " ".join(facts_of(found)["warnings"])
    # The mean over all orientations makes C_d up to 16 % too small (docs: what `none` costs); what
    # its sd adds to that is 4 of them, as for the others: once in 5000 if they are right.
    sd, off = standard_deviations(found), deviations(found)
    assert sd[0] < 0.15
    assert np.log(1.0 - 0.16) / sd[0] - 4.0 < off[0] < 4.0
    assert np.abs(off[1:]).max() < 4.0
    same = dw.fit_motion(track, coarse_study(), angle="none")
    assert facts_of(same)["drag_coefficient"] == pytest.approx(facts_of(found)["drag_coefficient"])


@pytest.mark.slow
def test_force_std_follows_its_interval() -> None:
    other = apply_overrides(coarse_study(), {"forces.force_interval_s": 0.064})
    found, known = facts_of(dw.fit_motion(recording(200.0), other)), facts_of(fitted(200.0))
    name = "force_noise_intensity_N2_s"
    assert found[name] == pytest.approx(known[name])
    assert found["force_std_N"] == pytest.approx(known["force_std_N"] / 2.0)


def still(count: int, **changed: np.ndarray) -> xr.Dataset:
    time = 0.1 * np.arange(count)
    values = {"x": 0.02 * np.cos(time), "y": 0.02 * np.sin(time), "theta": time} | changed
    return build_trajectory(time, **values, attrs={"source": "made.csv"})


@pytest.mark.parametrize(
    ("tracks", "options", "message"),
    [
        ([still(50)], {}, "has 50 positions of this body; the fit needs 100"),
        ([still(200, x=np.zeros(200), y=np.zeros(200))], {}, "never moves"),
        ([still(200, theta=np.full(200, np.nan))], {"angle": "given"}, "has no orientations"),
        ([still(200, theta=np.full(200, np.nan))], {"angle": "state"}, "has no orientations"),
        # Two are taken together: each has to have what is asked for.
        (
            [still(200), still(200, theta=np.full(200, np.nan))],
            {"angle": "state"},
            "has no orientations",
        ),
        ([still(200)], {"angle": "maybe"}, "must be 'auto', 'state', 'given' or 'none'"),
        ([still(200)], {"body": "7"}, "no body '7'"),
        ([still(200, x=np.linspace(0.13, 0.14, 200))], {}, "are at the wall of the tank"),
        ([], {}, "no recording"),
    ],
)
def test_what_cannot_be_fitted_is_refused(
    tracks: list[xr.Dataset], options: dict[str, str], message: str
) -> None:
    with pytest.raises(InputError, match=message) as caught:
        dw.fit_motion(tracks, coarse_study(), **options)
    assert "\n" not in str(caught.value)


def test_two_bodies_are_refused_with_their_names() -> None:
    x = np.random.default_rng(1).normal(size=(200, 2))
    pair = build_trajectory(0.1 * np.arange(200), x, x, body=["left", "right"])
    with pytest.raises(InputError, match="2 bodies \\(left, right\\)"):
        dw.fit_motion(pair, coarse_study())


def test_a_flow_is_not_made_of_something_else() -> None:
    with pytest.raises(InputError, match="expected a dataset 'fit'"):
        dw.fitted_flow(dw.tank30_flow())


def test_footprint_by_brute_force() -> None:
    grid = Grid(np.linspace(-0.05, 0.05, 21), np.linspace(-0.04, 0.04, 17), 0.005)
    generator = np.random.default_rng(6)
    x, y, theta = generator.uniform(-0.06, 0.06, (3, 40)) * [[1.0], [1.0], [50.0]]
    excluded = (generator.random(40) < 0.3).astype(np.uint8)
    series = Series(np.arange(40.0), x, y, theta, 0.0 * x, excluded)
    for oriented in (True, False):
        count = footprint_count(grid, [series], side=0.03, oriented=oriented)
        for j, node_y in enumerate(grid.y):
            for i, node_x in enumerate(grid.x):
                ahead = (node_x - x) + 1j * (node_y - y)
                own = ahead * np.exp(-1j * theta)
                over = np.maximum(abs(own.real), abs(own.imag)) <= 0.015
                over = over if oriented else abs(ahead) <= 0.015
                assert count[j, i] == np.count_nonzero(over & (excluded == 0))


@pytest.mark.false_alarm(1e-5)
def test_whiteness_sees_correlated_errors(fresh_seed: Callable[[int], int]) -> None:
    """A moving average (1, 1/2) has the autocorrelation 0.4."""
    noise = np.random.default_rng(fresh_seed(2)).normal(size=(20_001, 2))
    errors = noise[1:] + 0.5 * noise[:-1]
    used = np.ones(20_000, dtype=bool)
    used[::50] = False
    found = whiteness_of([(errors, used)])
    assert found.autocorrelation == pytest.approx(0.4, abs=0.03)
    assert found.chi_squared_per_dof == pytest.approx(1.25, abs=0.05)
    assert found.autocorrelation_std == pytest.approx(1 / np.sqrt(2 * 20_000 * 0.96), rel=0.01)
