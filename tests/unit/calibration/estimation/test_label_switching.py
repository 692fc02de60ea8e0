"""States of a model that change places, and models that have none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import ks_2samp

import driftwalk as dw
from driftwalk.calibration.estimation.label_switching import label_order
from driftwalk.calibration.held_out.candidates import Candidate
from driftwalk.calibration.held_out.recorded import Scales, recorded_ranges
from driftwalk.conditions import Conditions
from driftwalk.core.random_streams import world_keys
from driftwalk.model import Tank
from driftwalk.motion import MotionModel
from driftwalk.schema import Parameter
from driftwalk.simulation.backend import Camera
from driftwalk.simulation.initial import Start

SCALES = Scales(speed=0.02, fastest=0.06, interval=0.2, duration=600.0, size=0.1)
LIKE = Conditions(
    sample_time=np.arange(300) / 10.0,
    start=Start(0.0, 0.0, 0.3),
    camera=Camera(position_noise=0.0),
    tank=Tank(diameter_m=3.0),
    view=None,
    flow=None,
    threads=1,
)
STATES = ("speed", "time", "rotational_diffusion")


def entry_of(model: MotionModel, ranges: tuple[Parameter, ...] | None = None) -> Candidate:
    chosen = recorded_ranges(model.parameters, SCALES) if ranges is None else ranges
    return Candidate(model, LIKE, chosen, len(chosen), baseline=False)


def drawn(entry: Candidate, count: int = 200) -> np.ndarray:
    return np.random.default_rng(8).random((count, len(entry.ranges)))


@pytest.fixture
def two_state() -> Candidate:
    return entry_of(dw.motion_model("two_state"))


def test_the_slower_of_two_states_comes_first(two_state):
    settings = drawn(two_state)
    given = settings.copy()
    ordered = label_order(two_state)(settings)
    np.testing.assert_array_equal(settings, given)
    names = [one.name for one in two_state.ranges]
    turned = 0
    for before, after in zip(settings, ordered, strict=True):
        was, now = (dict(zip(names, row.tolist(), strict=True)) for row in (before, after))
        wanted = dict(was)
        if was["slow_speed"] > was["fast_speed"]:
            turned += 1
            for part in STATES:
                wanted[f"slow_{part}"], wanted[f"fast_{part}"] = (
                    was[f"fast_{part}"], was[f"slow_{part}"],
                )  # fmt: skip
        assert now == wanted
        assert now["slow_speed"] <= now["fast_speed"]
    assert 60 < turned < 140


def test_order_is_kept_where_it_is(two_state):
    order = label_order(two_state)
    once = order(drawn(two_state))
    np.testing.assert_array_equal(order(once), once)


def test_states_that_change_places_make_the_same_motion(two_state):
    """Paths and distances covered in 30 s by 400 worlds each: KS tests, each wrong at 1e-6.

    Paths show whether speeds and times have changed places, distances whether the turns have.
    """
    setting = np.array([[0.8, 0.2, 0.3, 0.3, 0.5, 0.9, 0.1, 0.5, 0.2]])
    ordered = label_order(two_state)(setting)
    assert not np.array_equal(setting, ordered)
    paths, ways = [], []
    for seed, one in enumerate((setting, ordered)):
        values = {
            parameter.name: np.full(400, parameter.value_at(one[0, at]))
            for at, parameter in enumerate(two_state.ranges)
        }
        keys = world_keys(seed, trial=0, replicate=np.arange(400))
        seen = two_state.model.simulate(values, LIKE, keys)
        paths.append(np.hypot(np.diff(seen.x), np.diff(seen.y)).sum(axis=1))
        ways.append(np.hypot(seen.x[:, -1] - seen.x[:, 0], seen.y[:, -1] - seen.y[:, 0]))
    assert ks_2samp(*paths).pvalue > 1e-6
    assert ks_2samp(*ways).pvalue > 1e-6


@pytest.mark.parametrize("name", ["active", "inertial", "run_rest", "burst_coast+wall"])
def test_models_without_such_states_stay_as_they_are(name):
    entry = entry_of(dw.motion_model(name))
    settings = drawn(entry)
    np.testing.assert_array_equal(label_order(entry)(settings), settings)


@pytest.mark.parametrize("other", ["fast_speed", "slow_time", "fast_rotational_diffusion"])
def test_states_with_ranges_of_their_own_are_told_apart_by_them(two_state, other):
    ranges = tuple(
        replace(one, high=0.5 * one.high) if one.name == other else one for one in two_state.ranges
    )
    entry = entry_of(two_state.model, ranges)
    settings = drawn(entry)
    np.testing.assert_array_equal(label_order(entry)(settings), settings)


@pytest.mark.parametrize("known", ["slow_time", "fast_speed"])
def test_a_state_of_which_something_is_known_keeps_its_place(known):
    model = dw.motion_model("two_state", **{known: 0.5})
    entry = entry_of(model)
    assert len(entry.ranges) == 8
    settings = drawn(entry)
    np.testing.assert_array_equal(label_order(entry)(settings), settings)
