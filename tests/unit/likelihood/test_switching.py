"""A flow that changes at named times: cut, fitted together, given out, and what is refused."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from switching_worlds import (
    DRAG,
    FORCE_N,
    NOISE_M,
    START_S,
    SWITCH_S,
    coarse_study,
    true_flows,
    two_flows,
)

import driftwalk as dw
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.core.units import in_percent
from driftwalk.flow import bilinear
from driftwalk.likelihood.filter.filter_pass import Passes
from driftwalk.likelihood.filter.parameters import Body, Point
from driftwalk.likelihood.flow_intervals import Intervals, cut_track, intervals_of, switched_frames
from driftwalk.likelihood.preparation import prepare, spline_of
from driftwalk.likelihood.prior import Prior, Weights
from driftwalk.likelihood.refuse import in_words, length_advice, needed_duration
from driftwalk.likelihood.warnings import precision_facts, warnings_of
from driftwalk.model.block import Block
from driftwalk.schema import Track, body_track, build_trajectory
from driftwalk.schema.answers.facts import facts_of

SWITCHED = {"switching_times_s": [START_S + SWITCH_S]}


@pytest.fixture(scope="module")
def fit() -> xr.Dataset:
    return dw.fit_motion(two_flows(), coarse_study(**SWITCHED))


@pytest.mark.slow
def test_both_flows_and_the_parameters_are_recovered(fit: xr.Dataset) -> None:
    """4 sd for each of three parameters: once in 5000 runs, if the errors are right."""
    truth = {"drag_coefficient": DRAG, "force_std": FORCE_N, "tracking_noise": NOISE_M}
    recordings = two_flows()
    assert facts_of(fit)["converged"] == "yes"
    for interval, flow in enumerate(true_flows()):
        score = dw.score_fit(fit, **truth, flow=flow, recordings=recordings, interval=interval)
        for name in ("drag_coefficient", "force_std_N", "tracking_noise_m"):
            assert abs(score[f"{name}_z"]) < 4.0
        assert score["flow_cells"] > 100
        assert score["flow_error"] < 0.1
        # The two flows are nothing like each other: a fit that mixes them fails above.
        other = true_flows()[1 - interval]
        swapped = dw.score_fit(fit, **truth, flow=other, recordings=recordings, interval=interval)
        assert swapped["flow_error"] > 0.3


@pytest.mark.slow
def test_it_holds_every_flow_and_the_times(fit: xr.Dataset) -> None:
    assert fit["u"].dims == ("flow", "y", "x")
    assert fit["coefficient"].dims == ("flow", "component", "knot_y", "knot_x")
    assert fit["flow"].values.tolist() == ["A", "B"]
    assert fit["interval_flow"].values.tolist() == [0, 1]
    assert facts_of(fit)["switching_times_s"] == [START_S + SWITCH_S]
    assert facts_of(fit)["recordings"] == 1
    # All but the interval that holds the switch: one sample every 0.1 s.
    assert facts_of(fit)["duration_s"] == pytest.approx(2.0 * SWITCH_S - 0.1)
    assert facts_of(fit)["samples"] == two_flows().sizes["time"]


@pytest.mark.slow
def test_the_flow_field_jumps_at_the_switch(fit: xr.Dataset) -> None:
    """Its times count from the first sample, as those of a simulation do."""
    whole = dw.fitted_flow(fit)
    for interval, times in enumerate(((0.0, SWITCH_S - 0.001), (SWITCH_S + 0.001, 1e4))):
        steady = dw.fitted_flow(fit, interval=interval)
        assert "time" not in steady.dims
        assert steady["u"].values == pytest.approx(fit["u"].values[interval])
        for time in times:
            found = bilinear(whole, [0.01, -0.07], [0.02, 0.05], time=time)
            assert np.array(found) == pytest.approx(
                np.array(bilinear(steady, [0.01, -0.07], [0.02, 0.05]))
            )


@pytest.mark.slow
def test_a_simulation_in_it_is_one_in_each_flow(fit: xr.Dataset) -> None:
    """Up to the switch it is the simulation in the first flow, number by number."""
    clock = SWITCH_S + np.arange(-2.0, 2.0, 0.1)
    flows = (dw.fitted_flow(fit), dw.fitted_flow(fit, interval=0))
    runs = [
        dw.simulate(coarse_study(), flow, sample_time=clock, replicates=1, seed=5)["x"].values
        for flow in flows
    ]
    runs = [run.ravel() for run in runs]
    before = clock <= SWITCH_S
    assert np.array_equal(runs[0][before], runs[1][before])
    assert np.abs(runs[0][~before] - runs[1][~before]).max() > 1e-3


@pytest.mark.slow
def test_a_stored_fit_gives_the_same_flow(fit: xr.Dataset, tmp_path: Path) -> None:
    """netCDF turns a list of one time into a number."""
    fit.to_netcdf(tmp_path / "fit.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "fit.nc", engine="h5netcdf") as stored:
        xr.testing.assert_equal(dw.fitted_flow(stored), dw.fitted_flow(fit))


@pytest.mark.slow
def test_which_flow_must_be_said(fit: xr.Dataset) -> None:
    truth = {"drag_coefficient": DRAG, "force_std": FORCE_N, "tracking_noise": NOISE_M}
    with pytest.raises(InputError, match="the fit has 2 flows: name the interval"):
        dw.score_fit(fit, **truth, flow=true_flows()[0])
    with pytest.raises(InputError, match="no interval 2: the fit has 2, counted from 0"):
        dw.fitted_flow(fit, interval=2)


def prepared(**settings: object) -> tuple[Passes, Point]:
    """Return the filter over the recording and a point with different flows."""
    study = coarse_study(**settings)
    ready = prepare([two_flows()], study, None, None)
    spline = spline_of(study)
    flows = len(ready.intervals.labels)
    passes = Passes(ready.series, Body(study, ready.angle), spline, flows)
    generator = np.random.default_rng(2)
    coefficients = 0.05 * generator.normal(size=(flows, 2, spline.rows, spline.columns))
    return passes, Point(coefficients, np.log(0.4), np.log(6e-7), np.log(3e-4))


@pytest.mark.slow
def test_every_flow_adds_to_its_own_block() -> None:
    """The sums of two flows are those of each alone, side by side; the shared ones are added."""
    passes, point = prepared(**SWITCHED)
    whole = passes.sums(point)
    count = 2 * passes.spline.size
    shared = slice(2 * count, None)
    information, score = np.zeros_like(whole.information), np.zeros_like(whole.score)
    deviance = 0.0
    for flow in (0, 1):
        own = [replace(one, flow=0) for one in passes.series if one.flow == flow]
        alone = Passes(own, passes.body, passes.spline).sums(point.in_flow(flow))
        index = np.r_[flow * count : (flow + 1) * count, 2 * count : 2 * count + 3]
        information[np.ix_(index, index)] += alone.information
        score[index] += alone.score
        deviance += alone.deviance
    np.testing.assert_allclose(whole.information, information, rtol=1e-12, atol=1e-12)
    assert whole.score == pytest.approx(score, rel=1e-12, abs=1e-9)
    assert whole.deviance == pytest.approx(deviance)
    assert not whole.information[:count, count : 2 * count].any()
    assert (np.diag(whole.information)[shared] > 0.0).all()


@pytest.mark.slow
def test_the_prior_of_several_flows_is_that_of_each() -> None:
    passes, point = prepared(**SWITCHED)
    prior, weights = Prior(passes), Weights(2.0, 3.0)
    sums = passes.sums(point)._replace(
        deviance=0.0, score=np.zeros(2 * 2 * passes.spline.size + 3), information=0.0
    )
    sums = sums._replace(information=np.zeros((sums.score.size, sums.score.size)))
    found = prior.add(sums, point, weights)
    precision = prior.matrix(weights)
    rows = point.coefficients.reshape(4, -1)
    size = len(precision)
    for k, row in enumerate(rows):
        block = slice(k * size, (k + 1) * size)
        assert found.information[block, block] == pytest.approx(precision)
        assert found.score[block] == pytest.approx(-precision @ row)
    quadratic = 0.5 * sum(row @ precision @ row for row in rows)
    drag = 0.5 * (np.log(0.4 / 0.5) / 0.7) ** 2
    assert found.deviance == pytest.approx(quadratic + drag)
    # The evidence sees all four components; half of the prior's freedom is taken here.
    inverse = np.linalg.inv(precision)
    updated = prior.updated(weights, point, 0.5 * np.kron(np.eye(4), inverse))
    for old, new, form in (
        (2.0, updated.roughness, prior.roughness),
        (3.0, updated.size, prior.size),
    ):
        freedom = 0.5 * 4 * np.trace(form @ inverse)
        wanted = old * freedom / sum(row @ form @ row for row in rows)
        assert new == pytest.approx(np.clip(wanted, old / 10.0, old * 10.0))


@pytest.mark.slow
def test_a_flow_that_comes_back_is_one_flow() -> None:
    """Three intervals in two flows: the first flow's block has both its intervals."""
    middle = START_S + SWITCH_S
    settings = {
        "switching_times_s": [middle - 60.0, middle + 60.0],
        "flow_labels": ["still", "fast", "still"],
    }
    passes, point = prepared(**settings)
    assert [one.flow for one in passes.series] == [0, 1, 0]
    assert passes.flows == 2
    assert passes.sums(point).score.size == 2 * 2 * passes.spline.size + 3
    assert intervals_of(coarse_study(**settings)).of_flow(0) == [0, 2]


def test_a_track_is_cut_at_the_switch_and_nowhere_else() -> None:
    """A sample at the very time of the switch belongs to what follows."""
    track = body_track(two_flows())
    times = (START_S + 100.0, START_S + 200.05)
    intervals = Intervals(times, (0, 1, 2), ("A", "B", "C"))
    parts = cut_track(track, intervals, fewest=100, where="")
    assert [part.time.size for part in parts] == [1000, 1001, 2000]
    for name in Track._fields:
        joined = np.concatenate([getattr(part, name) for part in parts])
        assert np.array_equal(joined, getattr(track, name), equal_nan=True)
    assert parts[1].time[0] == pytest.approx(times[0])
    assert parts[2].time[0] > times[1] > parts[1].time[-1]


def test_frames_stand_on_either_side_of_every_switch() -> None:
    steps = Intervals((10.0, 20.0), (0, 1, 0), ("A", "B"))
    time, frames = switched_frames(steps, {"u": [np.full(2, 3.0), np.full(2, 7.0)]}, first=4.0)
    at = [np.interp(t, time, frames["u"][:, 0]) for t in (0.0, 5.999, 6.001, 15.999, 16.001, 99.0)]
    assert at == pytest.approx([3.0, 3.0, 7.0, 7.0, 3.0, 3.0])


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (
            {"switching_times_s": [40.0]},
            "switching time 40 s is outside the recording .50 s to 450",
        ),
        ({"switching_times_s": [50.0]}, "switching time 50 s is outside"),
        ({"switching_times_s": [700.0]}, "switching time 700 s is outside"),
        (
            {"switching_times_s": [100.0, 105.0]},
            "the interval from 100 s to 105 s has 50 positions; the fit needs 100",
        ),
        ({"switching_times_s": [445.0]}, "the interval from 445 s to the end has 51 positions"),
        (
            {"switching_times_s": [100.0 + 15.0 * k for k in range(20)]},
            "21 flows of 392 coefficients are too many.* GB and .* min, 11 can be fitted",
        ),
    ],
)
def test_switching_times_that_do_not_fit_are_refused(
    settings: dict[str, object], message: str
) -> None:
    with pytest.raises(InputError, match=message) as caught:
        dw.likelihood.check_fit(two_flows(), coarse_study(**settings))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"switching_times_s": [600.0, 500.0]}, "must increase, got 500 s after 600 s"),
        ({"switching_times_s": [600.0, 600.0]}, "must increase"),
        ({"switching_times_s": []}, "the list is empty"),
        ({"flow_labels": ["A", "B"]}, "2 names, but switching_times_s makes 1 interval:"),
        ({"switching_times_s": [1.0], "flow_labels": ["A", "A"]}, "is named twice in a row"),
        (
            {"switching_times_s": [1.0], "flow_labels": ["A", "b/c"]},
            "is not a valid name of a flow",
        ),
        ({"drag_coefficient_precision": 1.5}, "must be less than 1"),
    ],
)
def test_what_the_section_refuses(settings: dict[str, object], message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        coarse_study(**settings)


def moving(count: int = 3000, **changed: np.ndarray) -> xr.Dataset:
    """Return a track round a circle of 6 cm, with 0.3 mm of noise."""
    time = 0.1 * np.arange(count)
    noise = 3e-4 * np.random.default_rng(1).normal(size=(2, count))
    values = {
        "x": 0.06 * np.cos(0.5 * time) + noise[0],
        "y": 0.06 * np.sin(0.5 * time) + noise[1],
        "theta": 0.1 * time,
    }
    return build_trajectory(time, **(values | changed), attrs={"source": "made.csv"})


def remembering(count: int, size: float, memory: float) -> np.ndarray:
    """Return noise whose correlation from one sample to the next is `memory`."""
    generator, values = np.random.default_rng(3), np.zeros(count)
    for k in range(1, count):
        values[k] = memory * values[k - 1] + generator.normal() * size * np.sqrt(1.0 - memory**2)
    return values


def test_a_moving_block_is_not_refused() -> None:
    dw.likelihood.check_fit(moving(), coarse_study())


@pytest.mark.parametrize(
    ("size", "memory"),
    [(0.0, 0.0), (3e-6, 0.0), (3e-4, 0.0), (4e-3, 0.0), (3e-6, 0.98), (3e-4, 0.98)],
)
def test_a_block_that_only_seems_to_move_is_refused(size: float, memory: float) -> None:
    """White jitter of any size; one that remembers while it stays within a tenth of the side."""
    x, y = 0.02 + remembering(3000, size, memory), 0.03 + remembering(3000, size, memory)[::-1]
    words = r"made\.csv: the body never moves: .*nothing to fit"
    with pytest.raises(InputError, match=words) as caught:
        dw.likelihood.check_fit(moving(x=x, y=y), coarse_study())
    assert "\n" not in str(caught.value)


def test_jumps_of_the_tracker_are_no_motion() -> None:
    x = 0.02 + 3e-4 * np.random.default_rng(4).normal(size=3000)
    x[::1000] = 0.1
    with pytest.raises(InputError, match="never moves"):
        dw.likelihood.check_fit(moving(x=x, y=np.full(3000, 0.01)), coarse_study())


def test_a_block_at_rest_in_one_interval_is_refused_by_its_times() -> None:
    track = moving()
    for name in ("x", "y"):
        track[name].values[1000:2000] = track[name].values[1000]
    study = coarse_study(switching_times_s=[100.0, 200.0])
    with pytest.raises(InputError, match=r"made\.csv: 100 s to 200 s: the body never moves"):
        dw.likelihood.check_fit(track, study)


def test_all_intervals_at_the_wall() -> None:
    angle = 0.05 * np.arange(3000)
    track = moving(x=0.135 * np.cos(angle), y=0.135 * np.sin(angle))
    with pytest.raises(InputError, match="all 2999 intervals are at the wall of the tank"):
        dw.likelihood.check_fit(track, coarse_study())


def test_a_flow_with_the_block_at_the_wall_is_named() -> None:
    track = moving()
    angle = 0.05 * np.arange(1000)
    track["x"].values[1000:2000, 0] = 0.135 * np.cos(angle)
    track["y"].values[1000:2000, 0] = 0.135 * np.sin(angle)
    study = coarse_study(switching_times_s=[100.0, 200.0], flow_labels=["A", "pump", "A"])
    with pytest.raises(InputError, match="flow pump \\(100 s to 200 s\\): all 999 intervals"):
        dw.likelihood.check_fit(track, study)


@pytest.mark.parametrize("angle", ["state", "given"])
def test_angles_that_are_not_there(angle: str) -> None:
    blind = moving(theta=np.full(3000, np.nan))
    with pytest.raises(InputError, match=r"made\.csv: the recording has no orientations") as caught:
        dw.likelihood.check_fit([moving(), blind], coarse_study(), angle=angle)
    assert angle in str(caught.value)


def test_too_short_says_how_long() -> None:
    with pytest.raises(InputError, match=r"10 to 30 min give C_d to 10 %.* about 5 %"):
        dw.likelihood.check_fit(moving(50), coarse_study())
    # The sd falls with the root of the length: 20 min for 5 % with angles, so 125 for 2 %.
    with pytest.raises(InputError, match=r"For C_d to 2 % record some 2.1 h with .* 8.4 h without"):
        dw.likelihood.check_fit(moving(50), coarse_study(drag_coefficient_precision=0.02))


def test_lengths_in_words() -> None:
    assert needed_duration(600.0, 0.17, 0.1) == pytest.approx(600.0 * 2.89)
    assert [in_words(s) for s in (9.2, 90.0, 119.0, 700.0, 5000.0, 7200.0, 1e6)] == [
        *("9.2 s", "90 s", "120 s", "12 min", "84 min", "2 h", "280 h")
    ]
    assert "10 to 30 min" in length_advice(None)


def facts(std: float, duration: float, study_settings: dict[str, object]) -> dict[str, object]:
    study = coarse_study(**study_settings)
    found = {"wall_share": 0.0, "converged": "yes", "restricted": "yes", "angle": "given"}
    found |= {"samples_used": 1000, "intervals_usable": 1000, "outliers": 0}
    found |= {"dropped_frames": 0, "jumps_removed": 0}
    found |= {"autocorrelation": 0.0, "autocorrelation_std": 0.01}
    return {**found, "duration_s": duration, **precision_facts(std, duration, study)}


@pytest.mark.parametrize(
    ("std", "wanted", "words"),
    [
        (0.2, {}, "known to 20 % only .* from 10 min: for 10 % about 40 min like this"),
        (0.06, {}, None),
        (0.06, {"drag_coefficient_precision": 0.03}, "known to 6 % only .* for 3 % about 40 min"),
        (0.12, {"drag_coefficient_precision": 0.15}, None),
    ],
)
def test_a_vague_answer_says_how_long_to_record(
    std: float, wanted: dict[str, object], words: str | None
) -> None:
    found = warnings_of(
        facts(std, 600.0, wanted),
        [0.5],
        Intervals((), (0,), ("A",)),
        block=Block(),
    )
    assert bool(found) == (words is not None)
    assert words is None or re.search(words, found[0])


def test_a_vague_dimer_says_how_long_to_record() -> None:
    """Twice as narrow takes four times as long."""
    given = {"hidden_face_drag_half_width": 0.2, "stirring_misfit_std": 5.0}
    vague, contradicted = warnings_of(
        {**facts(0.06, 600.0, {}), **given}, [0.5], Intervals((), (0,), ("A",)), block=Block()
    )
    assert "within 0.2 only from 10 min: for 0.1 about 40 min like this" in vague
    assert "5.0 standard deviations apart" in contradicted


@pytest.mark.slow
def test_a_region_never_visited_is_filled_and_warned_of() -> None:
    """The block goes round one circle of 4 cm: it sees a ring, 9 to 25 % of the tank."""
    time = 0.1 * np.arange(1500)
    generator = np.random.default_rng(8)
    wander = np.cumsum(0.002 * generator.normal(size=(2, 1500)), axis=1) * 0.05
    ring = moving(
        1500,
        x=0.04 * np.cos(time) + wander[0] + 3e-4 * generator.normal(size=1500),
        y=0.04 * np.sin(time) + wander[1] + 3e-4 * generator.normal(size=1500),
    )
    found = dw.fit_motion(ring, coarse_study())
    share = facts_of(found)["visited_share"]
    inside = found["flag"].values != 0
    measured = found["flag"].values == 1
    assert share == pytest.approx(measured.sum() / inside.sum())
    radius = np.hypot(*np.meshgrid(found["x"].values, found["y"].values))
    assert (found["flag"].values[inside & (radius > 0.09)] == 2).all()
    assert np.isnan(dw.fitted_flow(found)["u_standard_error"].values[~measured]).all()
    warnings = facts_of(found)["warnings"]
    assert any(f"over {in_percent(share)} of the tank only" in one for one in warnings)


@pytest.mark.slow
def test_two_recordings_are_cut_by_their_own_clocks() -> None:
    track = two_flows()
    later = track.assign_coords(time=track["time"] + 20.0)
    ready = prepare([track, later], coarse_study(**SWITCHED), None, None)
    assert [(one.flow, one.recording) for one in ready.series] == [(0, 0), (1, 0), (0, 1), (1, 1)]
    assert [one.time.size for one in ready.series] == [2000, 2001, 1800, 2201]
    assert [one.time[0] for one in ready.series] == pytest.approx([0.0, 200.0, 0.0, 180.0])
