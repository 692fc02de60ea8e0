"""The family of self-propelled bodies: names, parts, tables, and the contract of a motion model."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import weibull_min

import driftwalk as dw
from driftwalk import _core
from driftwalk.conditions import Neighbours
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.core.random_streams import world_keys
from driftwalk.motion.choose import family_model
from driftwalk.motion.family.columns import (
    INERTIAL,
    SHARED,
    STATE,
    State,
    dwell_law,
    switching_table,
)
from driftwalk.motion.family.members import MEMBERS
from driftwalk.motion.family.particle import time_step_of
from driftwalk.motion.family.parts import PARTS
from driftwalk.schema import Parameter, Track
from driftwalk.testing import MotionModelContract


class FamilyContract(MotionModelContract):
    name = ""

    def model(self):
        return family_model(self.name, clearance=0.01)


class TestInertial(FamilyContract):
    name = "inertial"


class TestInertialInTheFlow(FamilyContract):
    name = "inertial+flow+reflect"


class TestActive(FamilyContract):
    name = "active"


class TestRunTumble(FamilyContract):
    name = "run_tumble"


class TestRunRest(FamilyContract):
    name = "run_rest"


class TestBurstCoast(FamilyContract):
    name = "burst_coast"


class TestTwoState(FamilyContract):
    name = "two_state"


class TestActiveWithManyParts(FamilyContract):
    name = "active+wall+follow+slow+stroke+diffusion+flow+reflect"


class TestRunRestAmongOthers(FamilyContract):
    name = "run_rest+neighbours"

    def conditions(self):
        time = np.arange(0.0, 50.0, 0.2)
        other = Track(time, 0.05 * np.cos(time), 0.05 * np.sin(time), np.full(time.size, np.nan))
        return replace(super().conditions(), neighbours=Neighbours((other,)))


class TestRunRestBackAndForth(FamilyContract):
    name = "run_rest+keep+reverse"


def test_every_member_is_held_to_the_contract():
    tested = {one.name.split("+")[0] for one in FamilyContract.__subclasses__()}
    parts = {part for one in FamilyContract.__subclasses__() for part in one.name.split("+")[1:]}
    assert tested == set(MEMBERS)
    assert parts == set(PARTS)


@pytest.mark.parametrize("name", MEMBERS)
def test_every_member_says_what_it_is(name):
    member = MEMBERS[name]
    assert member.sentence.endswith((".",))
    assert member.formula
    assert member.source
    for parameter in family_model(name).parameters:
        assert parameter.meaning.endswith("."), parameter.name
        assert parameter.unit


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("fish", "there is no motion model 'fish'; there are inertial, active"),
        ("active+gills", "has no part 'gills'; there are wall, follow"),
        ("active+wall+wall", "is named twice"),
        ("inertial+wall", "inertial has no heading"),
        ("active+reverse", "has one bout without end"),
    ],
)
def test_a_wrong_name_says_which_there_are(name, words):
    with pytest.raises(ConfigurationError, match=words):
        family_model(name)


@pytest.mark.parametrize("clearance", [-0.1, np.nan, np.inf])
def test_a_clearance_is_a_length(clearance):
    with pytest.raises(ConfigurationError, match="clearance"):
        family_model("active", clearance=clearance)


def test_parts_that_feel_the_wall_share_its_range():
    names = [one.name for one in family_model("active+wall+follow").parameters]
    assert names.count("wall_range") == 1


def test_what_parts_say_of_a_state_is_said_of_those_that_move():
    model = family_model("run_rest+reverse")
    values = {one.name: np.full(2, one.low) for one in model.parameters}
    plain = family_model("run_rest").table(
        {name: value for name, value in values.items() if name != "reversal_share"}, 2
    )
    table = model.table({**values, "reversal_share": np.array([0.2, 0.7])}, 2)
    of_run = len(SHARED) + STATE.index("reversal_share")
    changed = np.flatnonzero((table.columns != plain.columns).any(axis=0))
    assert changed.tolist() == [of_run]
    np.testing.assert_allclose(table.columns[:, of_run], [0.2, 0.7], rtol=1e-7)


def test_a_hyphen_counts_as_an_underscore():
    assert family_model("run-rest").name == "run_rest"


def test_a_pickle_gives_the_same_bits():
    contract = TestRunRest()
    like, model = contract.conditions(), contract.model()
    values = {one.name: np.full(3, one.low) for one in model.parameters}
    keys = world_keys(5, trial=np.arange(3), replicate=0)
    first = model.simulate(values, like, keys)
    again = pickle.loads(pickle.dumps(model)).simulate(values, like, keys)
    for a, b in zip(first, again, strict=True):
        np.testing.assert_array_equal(a, b)


def test_others_that_push_have_to_be_there():
    contract = TestRunRestAmongOthers()
    like, model = replace(contract.conditions(), neighbours=None), contract.model()
    values = {one.name: np.full(1, one.low) for one in model.parameters}
    with pytest.raises(InputError, match="feels the other bodies of a recording"):
        model.simulate(values, like, np.array([1], dtype=np.uint64))


def test_water_that_carries_has_to_be_there():
    like = replace(TestInertialInTheFlow().conditions(), flow=None)
    model = family_model("active+flow")
    values = {one.name: np.full(1, one.low) for one in model.parameters}
    with pytest.raises(InputError, match="need a flow field"):
        model.simulate(values, like, world_keys(1, trial=0, replicate=np.arange(1)))


@pytest.mark.parametrize("cv", [0.0, 1e-3, 0.05, 0.5, 1.0, 2.0, 5.0])
def test_a_dwell_law_has_its_mean_and_spread(cv):
    scale, power = (float(one) for one in dwell_law(2.0, cv))
    if cv == 0.0:
        assert (scale, power) == (2.0, 0.0)
        return
    law = weibull_min(1.0 / power, scale=scale)
    assert law.mean() == pytest.approx(2.0, rel=1e-9)
    assert law.std() == pytest.approx(2.0 * cv, rel=1e-6)


def test_the_table_has_the_columns_of_the_core():
    for count in (1, 2, 4):
        states = [State(speed=0.1, dwell=1.0)] * count
        table = switching_table(states, {}, worlds=2)
        particle = _core.Particle(kind="switching", states=count, contact="slide", carried=False)
        assert table.columns.shape == (2, particle.columns)
        assert particle.columns == len(SHARED) + count * (len(STATE) + count)
    inertial = _core.Particle(kind="inertial", states=0, contact="slide", carried=False)
    assert inertial.columns == len(INERTIAL)


def test_a_world_begins_in_a_state_as_often_as_it_is_there():
    # Two of three bouts after A are B; the share of the time is entries times mean times.
    a = State(speed=0.1, dwell=2.0, next=(0.0, 2 / 3, 1 / 3))
    b = State(speed=0.1, dwell=4.0, next=(1.0, 0.0, 0.0))
    c = State(speed=0.1, dwell=8.0, next=(1.0, 0.0, 0.0))
    columns = switching_table([a, b, c], {}, worlds=1).columns[0]
    at = STATE.index("start_share")
    shares = [columns[len(SHARED) + k * (len(STATE) + 3) + at] for k in range(3)]
    time = np.array([3 * 2.0, 2 * 4.0, 1 * 8.0])
    np.testing.assert_allclose(shares, time / time.sum(), rtol=1e-6)


@pytest.mark.parametrize(
    "wrong", [{"kind": "block"}, {"states": 0}, {"states": 5}, {"contact": "stick"}]
)
def test_the_core_refuses_other_particles(wrong):
    given = {"kind": "switching", "states": 1, "contact": "slide", "carried": False} | wrong
    with pytest.raises(ValueError, match="no such particle"):
        _core.Particle(**given)


@pytest.mark.parametrize(
    ("interval", "step"), [(0.1, 0.02), (1.0, 0.02), (1 / 30, 1 / 60), (0.001, 0.0005)]
)
def test_a_time_step_is_a_part_of_the_sampling_interval(interval, step):
    assert time_step_of(np.arange(10) * interval) == pytest.approx(step)
    assert time_step_of(np.zeros(1)) == 0.02


def test_a_body_sets_out_in_the_direction_that_it_moves_in():
    like = TestActive().conditions()
    model = family_model("active")
    values = {"speed": [0.01], "rotational_diffusion": [1e-4], "turn_rate": [0.0]}
    worlds = model.simulate(
        {name: np.asarray(value) for name, value in values.items()},
        replace(like, camera=dw.simulation.backend.Camera()),
        world_keys(1, trial=0, replicate=np.arange(1)),
    )
    # The conditions of the contract: v = (0.01, 0.02) m/s.
    moved = np.array([worlds.x[0, 5] - worlds.x[0, 0], worlds.y[0, 5] - worlds.y[0, 0]])
    assert np.arctan2(moved[1], moved[0]) == pytest.approx(np.arctan2(2, 1), abs=0.1)


def test_a_known_value_is_not_searched():
    model = family_model("run_tumble", turn_rate=0.0, speed_cv=0.0, speed=(0.01, 0.1, "m/s"))
    assert [one.name for one in model.parameters] == [
        "speed",
        "run_time",
        "turn_std",
        "rotational_diffusion",
    ]
    assert (model.parameters[0].low, model.parameters[0].high) == (0.01, 0.1)
    assert model.parameters[0].scale == "log"
    assert model.describe()["fixed"] == {"turn_rate": 0.0, "speed_cv": 0.0}


def test_a_known_value_gives_the_bits_of_the_same_value():
    like = TestActive().conditions()
    keys = world_keys(5, trial=np.arange(2), replicate=0)
    values = {"speed": np.full(2, 0.02), "rotational_diffusion": np.full(2, 0.3)}
    known = family_model("active", turn_rate=0.5).simulate(values, like, keys)
    free = family_model("active").simulate({**values, "turn_rate": np.full(2, 0.5)}, like, keys)
    np.testing.assert_array_equal(known.x, free.x)


@pytest.mark.parametrize(
    ("choices", "words"),
    [
        ({"sped": 1.0}, "has no parameter 'sped'; it has speed, rotational_diffusion"),
        ({"speed": "fast"}, "expected a value or a range"),
        ({"speed": -1.0}, "speed is -1"),
        ({"speed": np.nan}, "speed is nan"),
        ({"speed": (0.1,)}, "expected a range"),
        ({"speed": (0.1, 0.2, "cm/s")}, "speed is in m/s, and its range in cm/s"),
        ({"speed": (0.2, 0.1)}, "below its beginning"),
        ({"wall_slowing": 1.5}, "wall_slowing is 1.5, expected a number from 0 to 1"),
        ({"wall_slowing": (-0.5, 0.5)}, "below 0"),
    ],
)
def test_a_wrong_choice_is_refused(choices, words):
    with pytest.raises(ConfigurationError, match=words):
        family_model("active+wall", **choices)


def test_a_parameter_is_given_once():
    speed = Parameter("speed", "m/s", 0.01, 0.1, step=0.01)
    with pytest.raises(ConfigurationError, match="given twice"):
        family_model("active", speed, speed=0.1)
    assert family_model("active", speed).parameters[0].step == 0.01


def test_a_motion_model_is_a_name_or_a_function():
    assert dw.motion_model("active").name == "active"
    with pytest.raises(ConfigurationError, match="a name or a function, got int"):
        dw.motion_model(3)
    with pytest.raises(ConfigurationError, match="leave out `settings`"):
        dw.motion_model("active", settings="many")
    with pytest.raises(ConfigurationError, match="no `clearance`"):
        dw.motion_model(lambda scene, speed: None, clearance=0.1, speed=(0, 1))


def test_a_body_that_drifts_with_the_water_starts_at_rest_in_it():
    """The start of a recording is seen from the ground."""
    contract = TestInertialInTheFlow()
    flow = dw.uniform_flow(0.02, 0.0, arena=dw.Study().tank.to_arena())
    like = replace(
        contract.conditions(),
        flow=flow,
        camera=dw.simulation.backend.Camera(),
        start=dw.simulation.Start(-0.1, 0.0, 0.0, 0.02, 0.0, 0.0),
    )
    model = family_model("inertial+flow", speed_std=0.0, turn_rate=0.0)
    worlds = model.simulate(
        {"memory_time": np.array([1.0])}, like, world_keys(1, trial=0, replicate=np.arange(1))
    )
    time = like.sample_time
    np.testing.assert_allclose(worlds.x[0][time < 8], -0.1 + 0.02 * time[time < 8], atol=1e-5)
