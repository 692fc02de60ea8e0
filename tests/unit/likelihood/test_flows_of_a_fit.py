"""The flows of a fit with switched pumps: which one an interval has, and how they change."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr

from driftwalk.core.errors import InputError
from driftwalk.likelihood import flow_intervals
from driftwalk.likelihood.fitted_modes import StoredFrames
from driftwalk.likelihood.flow_intervals import Intervals, fitted_flow
from driftwalk.schema import FLAGS
from driftwalk.schema.kinds.flow import FIT_PREFIX

SWITCHED = Intervals((50.0, 80.0), (0, 1, 0), ("low", "high"))
STEADY = Intervals((), (0,), ("A",))
AXIS = np.array([-0.01, 0.0, 0.01])


def stored(patch: pytest.MonkeyPatch, intervals: Intervals, frames: Any = None) -> xr.Dataset:
    """Return as much of a fit as its flows take; the u of flow k is k + 1 everywhere."""
    flows = len(intervals.labels)
    shape = (flows, 3, 3)
    number = np.arange(1.0, flows + 1.0)[:, None, None]
    flag = np.full(shape, FLAGS["measured"], dtype=np.int8)
    flag[:, 0, 0] = FLAGS["filled"]
    values = {
        "u": number + np.zeros(shape),
        "v": -number + np.zeros(shape),
        "u_standard_error": 0.1 * number + np.zeros(shape),
        "v_standard_error": 0.2 * number + np.zeros(shape),
        "flag": flag,
        "count": np.full(shape, 5.0),
    }
    dims = ("flow", "y", "x")
    data: dict[str, Any] = {
        name: (dims if flows > 1 else dims[1:], one if flows > 1 else one[0])
        for name, one in values.items()
    }
    data |= {
        "cell_size": 0.01,
        "recording_start": 30.0,
        "force_interval": 0.02,
        "estimate": ("parameter", [0.5, 2e-3, 1e-3]),
        "interval": (("parameter", "bound"), [[0.4, 0.6], [1e-8, 2e-8], [1.0, 1.2]]),
    }
    if flows > 1:
        data |= {
            "flow_force_std": ("flow", [1.1, 3.0]),
            "flow_force_std_low": ("flow", [1.0, 2.0]),
            "flow_force_std_high": ("flow", [1.21, 4.5]),
        }
    logs = ["ln_drag_coefficient", "ln_noise_intensity"]
    coords = {
        "x": AXIS,
        "y": AXIS,
        "parameter": ["drag_coefficient", "force_noise_intensity", "force_std"],
        "bound": ["lower", "upper"],
        "log_parameter": logs,
        "other_log_parameter": logs,
    }
    data["covariance"] = (("log_parameter", "other_log_parameter"), [[4.0, 1.0], [1.0, 9.0]])
    arena = '{"shape": "circle", "diameter_m": 0.3}'
    attrs = {"arena": arena, "source": "film.csv"}
    patch.setattr(flow_intervals, "require_fit", lambda fit: fit)
    patch.setattr(flow_intervals, "fitted_intervals", lambda _: intervals)
    patch.setattr(flow_intervals, "stored_frames", lambda _: frames)
    return xr.Dataset(data, coords, attrs)


def test_a_steady_flow_has_its_errors_where_the_block_was(monkeypatch: pytest.MonkeyPatch) -> None:
    found = fitted_flow(stored(monkeypatch, STEADY))
    assert (found["u"].values == 1.0).all()
    assert (found["v"].values == -1.0).all()
    for name, error in (("u", 0.1), ("v", 0.2)):
        errors = found[f"{name}_standard_error"].values
        assert math.isnan(errors[0, 0])
        assert errors.ravel()[1:] == pytest.approx(np.full(8, error))
    assert found.attrs[f"{FIT_PREFIX}drag_coefficient"] == [0.4, 0.6]
    assert found.attrs[f"{FIT_PREFIX}force_noise_intensity"] == [1e-8, 2e-8]
    assert found.attrs["cell_size_m"] == 0.01
    assert found.attrs["source"] == "film.csv"
    assert fitted_flow(stored(monkeypatch, STEADY), interval=0).attrs == found.attrs
    for wrong in (1, -1):
        with pytest.raises(InputError, match=rf"no interval {wrong}: the fit has 1"):
            fitted_flow(stored(monkeypatch, STEADY), interval=wrong)


@pytest.mark.parametrize(("interval", "flow"), [(0, 0), (1, 1), (2, 0)])
def test_an_interval_has_the_flow_that_its_pumps_make(
    monkeypatch: pytest.MonkeyPatch, interval: int, flow: int
) -> None:
    """With the intensity of its own force, F^2 times the time that it lasts."""
    found = fitted_flow(stored(monkeypatch, SWITCHED), interval=interval)
    assert (found["u"].values == flow + 1.0).all()
    assert found.attrs["flow_label"] == SWITCHED.labels[flow]
    ends = [(1.0, 1.21), (2.0, 4.5)][flow]
    assert found.attrs[f"{FIT_PREFIX}force_noise_intensity"] == pytest.approx(
        [0.02 * end**2 for end in ends]
    )
    assert found.attrs["intervals"] == ["the start to 50 s, 80 s to the end", "50 s to 80 s"][flow]


def test_the_flow_changes_where_the_pumps_are_switched(monkeypatch: pytest.MonkeyPatch) -> None:
    """Times count from the first sample, at 30 s on the clock of the switches."""
    found = fitted_flow(stored(monkeypatch, SWITCHED))
    assert found.attrs["repeat"] == "hold"
    time, u = found["time"].values, found["u"].values[:, 1, 1]
    for at, wanted in ((0.0, 1.0), (19.9, 1.0), (20.1, 2.0), (49.9, 2.0), (50.1, 1.0), (99.0, 1.0)):
        assert np.interp(at, time, u) == pytest.approx(wanted)
    assert np.diff(time).min() < 1e-5


def test_a_strength_that_changes_goes_with_all_flows(monkeypatch: pytest.MonkeyPatch) -> None:
    frames = StoredFrames(np.array([0.0, 40.0]), np.array([1.0, 3.0]), np.zeros((0, 2)), "none")
    fit = stored(monkeypatch, SWITCHED, frames)
    found = fitted_flow(fit)
    time, u = found["time"].values, found["u"].values[:, 1, 1]
    assert {0.0, 40.0} <= set(time.tolist())
    for at, wanted in ((10.0, 1.5), (19.0, 1.95), (30.0, 5.0), (40.0, 6.0)):
        assert np.interp(at, time, u) == pytest.approx(wanted, rel=1e-3)
    # The mean flow of an interval does not change.
    assert "time" not in fitted_flow(fit, interval=1).dims


def test_what_is_known_of_a_force_is_that_of_its_flow(monkeypatch: pytest.MonkeyPatch) -> None:
    """ln(4.5 / 2) over ln(1.21) times the width, in the standard deviation of ln q."""
    fit = stored(monkeypatch, SWITCHED)
    found = flow_intervals._of_flow(fit, 1)
    part = math.log(4.5 / 2.0) / math.log(1.21)
    wanted = [[4.0, part], [part, 9.0 * part**2]]
    np.testing.assert_allclose(found["covariance"].values, wanted)
    assert found["estimate"].values.tolist() == [0.5, 2e-3, 3.0]
    np.testing.assert_allclose(
        flow_intervals._of_flow(fit, 0)["covariance"].values, fit["covariance"].values
    )
    steady = stored(monkeypatch, STEADY)
    assert flow_intervals._of_flow(steady, 0) is steady


def test_intervals_are_named_and_looked_up() -> None:
    assert SWITCHED.of_flow(0) == [0, 2]
    assert SWITCHED.describe_flow(1) == "flow high (50 s to 80 s)"
    assert SWITCHED.index_of(np.array([0.0, 50.0, 79.0, 80.0, 99.0])).tolist() == [0, 1, 1, 2, 2]
    assert STEADY.steady
    assert not SWITCHED.steady
    assert STEADY.describe(0) == "the start to the end"
