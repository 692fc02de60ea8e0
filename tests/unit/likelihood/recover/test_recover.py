"""The recovery study: what is simulated, that it is what a hand-made fit gives, what it refuses."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from recovery_worlds import small_study

import driftwalk as dw
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.likelihood import FitRecovery, recovery as recovery_run
from driftwalk.model import apply_overrides
from driftwalk.model.recover import true_time_step_s
from driftwalk.schema.answers.facts import facts_of
from driftwalk.sweep import SweepError


@pytest.fixture(scope="module")
def flow() -> xr.Dataset:
    return dw.tank30_flow()


@pytest.fixture(scope="module")
def found(flow: xr.Dataset) -> xr.Dataset:
    study = small_study(durations_s=[60.0, 90.0], drag_coefficient_precision=0.1)
    return dw.recovery_study(study, flow)


def recorded(recover: dict, flow: xr.Dataset, duration: float = 60.0, number: int = 0) -> list:
    method = FitRecovery(small_study(**recover), flow)
    return method.simulate({"recording": number, "duration": duration}).tracks


def test_a_recording_is_what_was_asked_for(flow: xr.Dataset) -> None:
    """20 % of 1201 samples missing: 240 +- 14; 4 sd."""
    settings = {"sample_interval_s": 0.05, "missing_share": 0.2, "recordings_per_fit": 2}
    first, second = recorded(settings, flow)
    assert first["time"].values == pytest.approx(np.arange(1201) * 0.05)
    for track in (first, second):
        lost = np.isnan(track["x"].values)
        assert lost.sum() == pytest.approx(240, abs=56)
        assert (lost == np.isnan(track["theta"].values)).all()
    # Different starts, forces and gaps.
    both = np.isfinite(first["x"].values + second["x"].values)
    assert np.abs(first["x"].values - second["x"].values)[both].mean() > 0.01


def test_a_longer_recording_begins_with_the_shorter(flow: xr.Dataset) -> None:
    settings = {"missing_share": 0.1, "recordings_per_fit": 2}
    for short, long in zip(
        recorded(settings, flow, 60.0), recorded(settings, flow, 90.0), strict=True
    ):
        assert long.sizes["time"] == 901
        for name in ("x", "y", "theta"):
            np.testing.assert_array_equal(short[name].values, long[name].values[:601])


def test_the_camera_noise_is_what_the_truth_says(flow: xr.Dataset) -> None:
    """The same world seen by two cameras: 1202 numbers, the sd is known to 2 %; 4 of them."""
    study = small_study()
    noisy = recorded({}, flow)[0]
    clean_study = apply_overrides(study, {"observation.position_noise_m": 1e-12})
    (clean,) = FitRecovery(clean_study, flow).simulate({"recording": 0, "duration": 60.0}).tracks
    off = np.concatenate([(noisy[name] - clean[name]).values.ravel() for name in ("x", "y")])
    assert off.std() == pytest.approx(3e-4, rel=0.08)
    assert FitRecovery(study, flow).tracking_noise == 3e-4
    rounded = apply_overrides(study, {"observation.position_quantum_m": "1mm"})
    expected = np.sqrt(9e-8 + 1e-6 / 12)
    assert FitRecovery(rounded, flow).tracking_noise == pytest.approx(expected)


def test_recordings_are_other_worlds_and_random_flows_other_flows() -> None:
    truth = FitRecovery(small_study(flow="random"), None)
    flows = [truth.flow_of(number) for number in (0, 1, 0)]
    assert flows[0].equals(flows[2])
    assert not flows[0].equals(flows[1])
    one, other = (recorded({}, flows[0], number=number)[0] for number in (0, 1))
    assert np.abs(one["x"].values - other["x"].values).max() > 0.01
    again = recorded({}, flows[0])[0]
    np.testing.assert_array_equal(one["x"].values, again["x"].values)


@pytest.mark.parametrize(
    ("asked", "interval", "step"),
    [
        ("auto", 0.01, 0.0025),
        ("auto", 0.016, 0.016 / 7),
        ("auto", 0.001, 0.001),
        (0.002, 0.01, 0.002),
        (0.005, 0.01, 0.0025),
    ],
)
def test_the_step_of_a_truth(asked: str | float, interval: float, step: float) -> None:
    chosen = true_time_step_s(asked, force_interval_s=interval)  # type: ignore[arg-type]
    assert chosen == pytest.approx(step)


@pytest.mark.slow
def test_a_setting_is_the_fit_of_its_recording(found: xr.Dataset, flow: xr.Dataset) -> None:
    """Number 1 by hand, each value from where it belongs."""
    tracks = recorded({}, flow, number=1)
    fit = dw.fit_motion(tracks, small_study())
    part = found.sel(duration=60.0, angle="given", recording=1)
    for name, key in (
        ("drag_coefficient", "drag_coefficient"),
        ("force_std", "force_std_N"),
        ("tracking_noise", "tracking_noise_m"),
    ):
        assert float(part[name]) == pytest.approx(facts_of(fit)[key], rel=1e-9)
        low, high = facts_of(fit)[f"{key}_interval"]
        assert float(part[f"{name}_low"]) == pytest.approx(low, rel=1e-9)
        assert float(part[f"{name}_high"]) == pytest.approx(high, rel=1e-9)
    assert float(part["drag_coefficient_error"]) == pytest.approx(
        facts_of(fit)["drag_coefficient"] / 0.4 - 1.0, rel=1e-6
    )
    assert float(part["wall_share"]) == facts_of(fit)["wall_share"]
    assert float(part["samples_used"]) == facts_of(fit)["samples_used"]
    assert float(part["fit_time"]) > 0.0
    assert 0.0 < float(part["flow_error"]) < 1.0


@pytest.mark.slow
def test_the_dataset_is_whole(found: xr.Dataset) -> None:
    assert dict(found.sizes) == {"duration": 2, "angle": 1, "recording": 2, "parameter": 3}
    assert (found["status"].values == 0).all()
    assert found["force_std"].attrs["units"] == "N"
    for name, value in (("drag_coefficient", 0.4), ("force_std_N", 6e-4)):
        assert facts_of(found)[name] == value
    assert dw.model.parse_study(found.attrs["study"]).recover.recordings == 2
    assert np.isfinite(found["needed_duration"].values).all()
    assert found.attrs["flow"] == "flow_true.csv"


@pytest.mark.slow
def test_the_numbers_do_not_depend_on_the_other_lengths(
    found: xr.Dataset, flow: xr.Dataset
) -> None:
    alone = dw.recovery_study(small_study(durations_s=[90.0]), flow)
    for name in ("drag_coefficient", "flow_error", "force_std_z"):
        np.testing.assert_array_equal(alone[name].values[0], found[name].values[1])


def test_what_cannot_be_fitted_is_data() -> None:
    """A wind: the block lies at the wall, and no interval is left."""
    wind = dw.flow_from_function(lambda x, y: (0.2 + 0 * x, 0 * y))
    told: list[tuple[int, int]] = []
    found = dw.recovery_study(small_study(), wind, tell=lambda *done: told.append(done))
    assert (found["status"].values == 1).all()
    assert "at the wall" in str(found["message"].values[0, 0, 0])
    assert not found["used"].values.any()
    assert np.isnan(found["bias"].values).all()
    assert np.isnan(found["needed_duration"].values).all()
    assert told == [(0, 2), (1, 2), (2, 2)]


def test_a_block_for_which_there_is_no_start_is_refused(flow: xr.Dataset) -> None:
    study = apply_overrides(small_study(durations_s=[60.0]), {"block.side_m": 0.212})
    with pytest.raises(SweepError, match="no start pose was found"):
        dw.recovery_study(study, flow)


def test_a_simulation_that_breaks_is_data(
    flow: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    sound = dw.simulation.simulate

    def broken(*arguments: object, **options: object) -> xr.Dataset:
        run = sound(*arguments, **options)
        run["status"].values[-1] = 1
        return run

    monkeypatch.setattr(recovery_run, "simulate", broken)
    found = dw.recovery_study(small_study(recordings_per_fit=2), flow)
    assert (found["status"].values == 2).all()
    assert np.isnan(found["drag_coefficient"].values).all()
    assert not found["used"].values.any()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"forces.drag_coefficient": 0.0}, r"lacks \[forces\] drag_coefficient"),
        ({"forces.force_std_N": 0.0}, r"lacks \[forces\] force_std_N"),
        ({"observation.position_noise_m": "estimate"}, r"lacks \[observation\] position_noise_m"),
        ({"observation.orientation_noise_rad": "estimate"}, "lacks .* orientation_noise_rad"),
        ({"recover.durations_s": [5.0]}, "about 51 positions; the fit needs 100"),
        ({"recover.durations_s": [20.0], "recover.missing_share": 0.5}, "50 % of them missing"),
        ({"tank.diameter_m": 0.5}, "does not cover the tank"),
    ],
)
def test_refusals(changes: dict, words: str, flow: xr.Dataset) -> None:
    study = apply_overrides(small_study(), changes)
    with pytest.raises(InputError, match=words):
        FitRecovery(study, flow).check()
    with pytest.raises(InputError, match=words):
        dw.recovery_study(study, flow)


def test_refusals_of_flows(flow: xr.Dataset) -> None:
    with pytest.raises(InputError, match="the flow of the water is missing"):
        FitRecovery(small_study()).check()
    with pytest.raises(InputError, match=r"flow\.nc .* has to be loaded"):
        FitRecovery(small_study(flow="flow.nc")).check()
    frames = flow.expand_dims(time=[0.0, 1.0])
    with pytest.raises(InputError, match="frames"):
        FitRecovery(small_study(), frames).check()
    with pytest.raises(InputError, match="it spans x from"):
        FitRecovery(small_study(), dw.jets_flow(diameter=0.2)).check()
    narrow = flow.assign(flag=flow["flag"].where(abs(flow["x"]) < 0.1, 0))
    with pytest.raises(InputError, match="nodes in there are flagged as outside"):
        FitRecovery(small_study(), narrow).check()
    FitRecovery(small_study(flow="random")).check()


def test_without_orientation_its_noise_is_not_asked_for(flow: xr.Dataset) -> None:
    changes = {"observation.orientation_noise_rad": "estimate", "recover.angle": ["none"]}
    FitRecovery(apply_overrides(small_study(), changes), flow).check()


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"recordings": 1}, r"\[recover\] recordings: must be at least 2, got 1"),
        ({"durations_s": []}, "the list is empty"),
        ({"durations_s": [60, "1min"]}, "names a value twice"),
        ({"angle": ["givn"]}, "did you mean 'given'"),
        ({"flow_family": "swirls"}, "did you mean 'swirl'"),
        ({"sample_interval_s": 2.0}, "must be at most 1 s"),
        ({"missing_share": 1.0}, "at most 0.9"),
        ({"recording": 3}, "unknown key 'recording'; did you mean 'recordings'"),
    ],
)
def test_the_section_refuses(settings: dict, words: str) -> None:
    with pytest.raises(ConfigurationError, match=words):
        small_study(**settings)


def test_lengths_are_put_in_order() -> None:
    assert small_study(durations_s=["1h", 60]).recover.durations_s == (60.0, 3600.0)
