"""What is left out of a tracker's frames, and what is said of it."""

from __future__ import annotations

import copy
import json
from typing import Any

import pytest
from hypothesis import given, strategies as st

from driftwalk.viewer.hub import to_json
from driftwalk.viewer.live_client import SAID_EVERY_S, SoundFrames

BODY = {"id": "a", "seen": True, "x_m": 0.1, "y_m": -0.1, "theta_rad": None}


def body(name: str, **odd: Any) -> dict[str, Any]:
    return {**BODY, "id": name, **odd}


def without(key: str) -> dict[str, Any]:
    return {name: value for name, value in body("odd").items() if name != key}


def frame(*bodies: Any, **more: Any) -> dict[str, Any]:
    return {"type": "frame", "frame": 0, "time_s": 0.0, "bodies": list(bodies), **more}


def test_a_sound_frame_stays_as_it_is() -> None:
    frames = SoundFrames()
    event = {"time_s": 1.0, "kind": "join", "bodies": ["a", "b"], "faces": [0, 2], "outcome": "2"}
    given = frame(
        *(body("a"), body("b", seen=False, x_m=None, theta_rad=0.5, column_px=3.5)),
        **{"joined": [["a", 0, "b", 2]], "outcome": "2", "possible": ["2"], "hidden": []},
        **{"events": [event], "latency_s": None, "dropped_frames": 0, "later": {"key": 1}},
    )
    assert frames.take(copy.deepcopy(given)) == given
    assert frames.words(now=0.0, last=True) is None


@pytest.mark.parametrize(
    ("odd", "why"),
    [
        *[(body("odd", x_m=x), "x_m is not a number") for x in ("left", True, [], {})],
        *[(body("odd", y_m=y), "y_m is not a finite number") for y in (float("nan"), 1e999)],
        (body("odd", theta_rad=10**400), "theta_rad is not a finite number"),
        *[(without(key), f"{key} is missing") for key in ("id", "seen", "x_m", "y_m", "theta_rad")],
        *[(body("odd", id=name), "id is not text") for name in (None, 7, ["a"])],
        (body("odd", seen="yes"), "seen is not true or false"),
        (body("b"), "a frame has the same id twice"),
        *[(one, "it is not an object") for one in (None, "b", [1])],
    ],
)
def test_an_odd_body_costs_itself(odd: Any, why: str) -> None:
    frames = SoundFrames()
    kept = frames.take(frame(body("a"), body("b"), odd, body("c")))
    assert kept is not None
    assert [one["id"] for one in kept["bodies"]] == ["a", "b", "c"]
    words = frames.words(now=0.0)
    assert words == f"left out, since it cannot be drawn: 1 body of 1 frame ({why})"


def test_bodies_and_frames_are_counted() -> None:
    frames = SoundFrames()
    for number in range(9):
        odd = [without("x_m"), body("odd", y_m="up")][: number % 3]
        frames.take(frame(body("a"), *odd))
    # 0, 1 and 2 odd ones in turn: three of each in nine frames, six of which have any.
    assert frames.words(now=0.0) == (
        "left out, since it cannot be drawn: 9 bodies of 6 frames "
        "(x_m is missing, y_m is not a number)"
    )


def test_it_is_said_once_and_then_now_and_then() -> None:
    """600 odd frames of ten seconds are not 600 sentences; a new reason is one at once."""
    frames, said = SoundFrames(), []
    for number in range(600):
        now = number / 60.0
        frames.take(frame(body("a", **({"x_m": "?"} if number < 300 or number > 500 else {}))))
        if number == 100:
            frames.note_unreadable()
        if (words := frames.words(now=now)) is not None:
            said.append((number, words))
    at = [number for number, _ in said]
    # The new reason at frame 100, then every five seconds: at 400, and not again in these ten.
    assert at == [0, 100, 100 + round(60 * SAID_EVERY_S)]
    last = frames.words(now=0.0, last=True)
    assert last is not None
    assert "1 line (it is not a JSON object with a type)" in last
    assert "399 bodies of 399 frames" in last
    assert frames.words(now=1e9, last=True) is None


@pytest.mark.parametrize(
    ("odd", "why"),
    [
        ({"time_s": None}, "time_s is not a number"),
        ({"frame": "first"}, "frame is not a number"),
        ({"bodies": {"a": 1}}, "bodies is not a list"),
    ],
)
def test_a_frame_without_its_time_is_left_out_whole(odd: dict[str, Any], why: str) -> None:
    frames = SoundFrames()
    assert frames.take({**frame(body("a")), **odd}) is None
    assert frames.words(now=0.0) == f"left out, since it cannot be drawn: 1 whole frame ({why})"


def test_other_odd_values_cost_themselves() -> None:
    frames = SoundFrames()
    event = {"time_s": 1.0, "kind": "join", "bodies": ["a", "b"], "outcome": None}
    joins = [
        ["a", 0, "b", 2],
        ["a", 4, "b", 2],
        ["a", 0, "b"],
        ["a", True, "b", 1],
        [1, 0, 2, 0],
        5,
    ]
    kept = frames.take(
        frame(
            body("a"),
            **{"joined": joins, "events": [event, {**event, "bodies": "ab"}, {}, None]},
            **{"outcome": 7, "possible": "2", "hidden": [1], "latency_s": "soon"},
        )
    )
    assert kept is not None
    assert kept["joined"] == joins[:1]
    assert kept["events"] == [event]
    assert [kept[name] for name in ("outcome", "possible", "hidden", "latency_s")] == [None] * 4
    words = frames.words(now=0.0) or ""
    for part in ("5 entries of 'joined' of 1 frame", "3 events of 1 frame", "4 values of 1 frame"):
        assert part in words


JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=8,
)
KEYS = ("frame", "time_s", "bodies", "joined", "events", "outcome", "possible", "hidden")


@pytest.mark.slow
@given(
    st.fixed_dictionaries({}, optional=dict.fromkeys(KEYS, JSON)),
    st.lists(JSON | st.fixed_dictionaries({}, optional=dict.fromkeys(BODY, JSON)), max_size=4),
)
def test_whatever_comes_what_is_kept_can_be_drawn(top: dict[str, Any], bodies: list[Any]) -> None:
    frames = SoundFrames()
    kept = frames.take({**frame(body("good"), *bodies), **top})
    if kept is None:
        assert "whole frame" in (frames.words(now=0.0) or "")
        return
    sent = json.loads(to_json(kept))
    for one in sent["bodies"]:
        assert isinstance(one["id"], str)
        assert all(one[name] is None or abs(one[name]) < 1e309 for name in ("x_m", "y_m"))
    assert len({one["id"] for one in sent["bodies"]}) == len(sent["bodies"])
