"""A policy that follows a stream: decisions in time, missed classes, ends, and other tanks."""

from __future__ import annotations

import json
import re
from functools import cache

import numpy as np
import pytest
import xarray as xr

import driftwalk as dw
from driftwalk.assembly import LiveControl, ModeSource, make_modes
from driftwalk.core.errors import InputError

pytestmark = pytest.mark.slow

SINGLE, TARGET = "1+1", "2"


@cache
def policy() -> xr.Dataset:
    """A policy by hand: mode 1 while the blocks are apart, and mode 2 when that lasts 10 s."""
    one = ModeSource(dw.Study(assembly={"blocks": 2}), dw.tank30_flow())
    modes = make_modes([one], flow_scales=[0.0, 0.5, 1.0])
    found = dw.plan_control(modes, TARGET, 30.0, every=5.0, rounds=1, worlds=20)
    apart = found["class"].values.tolist().index(SINGLE)
    action = np.zeros_like(found["action"].values)
    action[:, apart, :2], action[:, apart, 2:] = 1, 2  # from 10 s on
    return found.assign(action=(found["action"].dims, action)).assign_attrs(
        safe_mode=str(found["mode"].values[0])
    )


def frame(time: float, outcome: str = SINGLE, bodies: int = 2) -> dict[str, object]:
    return {"type": "frame", "time_s": time, "outcome": outcome, "bodies": [{}] * bodies}


def modes_of(control: LiveControl, *frames: dict[str, object]) -> list[float | None]:
    said = [control.frame(one) for one in frames]
    return [None if one is None else one["flow_scale"] for one in said]


def hello(**changes: object) -> dict[str, object]:
    tank = dw.Study().tank.to_arena()
    return {"type": "hello", "tank": tank, "block_side_m": 0.03, "body_count": None} | changes


def test_a_decision_is_made_every_period_by_class_and_time_in_it() -> None:
    frames = [frame(t) for t in (100.0, 102.0, 104.9, 105.0, 109.0, 110.0, 115.0)]
    expected = [0.5, None, None, 0.5, None, 1.0, 1.0]
    assert modes_of(LiveControl(policy()), *frames) == expected


def test_without_a_class_the_mode_is_held() -> None:
    control = LiveControl(policy())
    assert modes_of(control, frame(0.0, "")) == [0.0], "the safe mode, where nothing was seen yet"
    assert modes_of(control, frame(5.0), frame(10.0, "")) == [0.5, 0.5]
    said = control.frame(frame(15.0, ""))
    assert said is not None
    assert said["reason"] == "class unknown, mode held"


def test_frames_that_come_late_are_no_decisions_of_the_past() -> None:
    control = LiveControl(policy())
    control.frame(frame(0.0))
    said = control.frame(frame(17.0))
    assert said is not None
    assert said["left_s"] == 13.0
    assert modes_of(control, frame(19.0), frame(20.0)) == [None, 1.0]


def test_it_ends_with_the_target_or_at_the_deadline() -> None:
    control = LiveControl(policy())
    control.frame(frame(0.0))
    end = control.frame(frame(7.0, TARGET))
    assert end is not None
    assert (end["type"], end["reached"], control.ended) == ("end", True, True)
    late = LiveControl(policy())
    late.frame(frame(0.0))
    end = late.frame(frame(30.0))
    assert end is not None
    assert (end["type"], end["reached"]) == ("end", False)


def test_a_clock_that_goes_back_begins_again() -> None:
    control = LiveControl(policy())
    control.frame(frame(50.0))
    control.frame(frame(61.0))
    said = control.frame(frame(0.5))
    assert said is not None
    assert said["left_s"] == 30.0


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"tank": {"shape": "circle", "diameter_m": 0.4, "center_m": [0, 0]}},
            "another tank: circle, diameter 0.4 m, and the policy was planned for circle, diameter",
        ),
        ({"tank": {"shape": "rectangle", "width_m": 0.3}}, "another tank: rectangle"),
        ({"block_side_m": 0.04}, "blocks of 0.04 m"),
        ({"body_count": 3}, "3 blocks, and the policy was planned for 2"),
    ],
)
def test_streams_of_other_tanks_are_refused(changes: dict[str, object], said: str) -> None:
    with pytest.raises(InputError, match=re.escape(said)):
        LiveControl(policy()).hello(hello(**changes))


def test_the_stream_of_its_own_tank_is_taken() -> None:
    moved = {"shape": "circle", "diameter_m": 0.3, "center_m": [0.1, 0.2]}
    LiveControl(policy()).hello(hello(tank=json.loads(json.dumps(moved)), body_count=2))


def test_another_number_of_blocks_is_refused_at_the_first_frame() -> None:
    with pytest.raises(InputError, match="3 blocks, and the policy was planned for 2"):
        LiveControl(policy()).frame(frame(0.0, bodies=3))
