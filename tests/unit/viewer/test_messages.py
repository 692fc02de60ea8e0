"""What waits for a browser: the newest of each kind, and frames only after the last was drawn."""

from __future__ import annotations

import asyncio
import json
import math
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import given, strategies as st

from driftwalk.viewer.app import _listen
from driftwalk.viewer.hub import Outbox, Source, make_message, parsed, to_json

loop: asyncio.Runner


@pytest.fixture(autouse=True)
def _loop() -> Iterator[None]:
    """Let all of a test run in one loop, as a server does."""
    global loop
    with asyncio.Runner() as loop:
        yield


def waiting(box: Outbox) -> list[dict[str, Any]]:
    """Return what the box hands out at once."""

    async def take() -> list[dict[str, Any]]:
        found = []
        while True:
            try:
                found.append(json.loads(await asyncio.wait_for(box.next(), 0.01)))
            except TimeoutError:
                return found

    return loop.run(take())


def put(box: Outbox, **content: Any) -> None:
    box.put(make_message(content))


def section(name: str, value: int) -> dict[str, Any]:
    return {"type": "section", "section": {"id": name, "value": value}}


def test_newest_of_each_kind_is_kept() -> None:
    box = Outbox()
    for number in range(1000):
        put(box, type="state", number=number)
        put(box, **section("map", number))
        put(box, **section("bootstrap", number))
    state, first, second = waiting(box)
    assert state["number"] == first["section"]["value"] == second["section"]["value"] == 999


def test_a_frame_waits_for_the_browser() -> None:
    box = Outbox()
    put(box, type="tank", number=1)
    assert [c["number"] for c in waiting(box)] == [1]
    put(box, type="tank", number=2)
    put(box, type="tank", number=3)
    assert waiting(box) == []
    box.drawn()
    assert [c["number"] for c in waiting(box)] == [3]
    assert waiting(box) == []


def test_other_messages_do_not_wait_for_it() -> None:
    box = Outbox()
    put(box, type="tank")
    waiting(box)
    put(box, type="tank")
    put(box, type="state")
    assert [c["type"] for c in waiting(box)] == ["state"]


def test_a_page_replaces_its_sections() -> None:
    box = Outbox()
    put(box, **section("map", 1))
    put(box, type="state")
    put(box, type="note", words="stays")
    put(box, type="page", page={})
    put(box, **section("map", 2))
    assert [c["type"] for c in waiting(box)] == ["note", "page", "section"]


def test_a_new_stream_voids_the_frames_of_the_old_one() -> None:
    box = Outbox()
    put(box, type="frame")
    put(box, type="lost")
    assert [c["type"] for c in waiting(box)] == ["lost"]
    put(box, type="lost")
    put(box, type="hello")
    assert [c["type"] for c in waiting(box)] == ["hello"]


def test_next_waits_for_a_message_to_come() -> None:
    async def run() -> str:
        box = Outbox()
        taken = asyncio.create_task(box.next())
        await asyncio.sleep(0)
        box.put(make_message({"type": "state"}))
        return await asyncio.wait_for(taken, 1.0)

    assert json.loads(loop.run(run())) == {"type": "state"}


@pytest.mark.slow
@given(
    st.recursive(
        st.none() | st.floats() | st.text() | st.integers(),
        lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    )
)
def test_every_message_is_json(value: Any) -> None:
    def refuse(word: str) -> None:
        raise AssertionError(word)

    message = make_message({"type": "state", "value": value})
    read = json.loads(message.text, parse_constant=refuse)["value"]
    assert read == (None if isinstance(value, float) and not math.isfinite(value) else read)


@pytest.mark.parametrize("text", ["", "{", "[1]", "1", "null", '"text"', "[" * 100_000, "\0"])
def test_what_is_no_message_is_nothing(text: str) -> None:
    assert parsed(text) is None


def test_numbers_that_json_lacks_are_null_at_any_depth() -> None:
    content = {"a": [math.nan, (1.5, math.inf)], "b": {"c": -math.inf, "d": True, "e": 10**400}}
    found = json.loads(to_json(content))
    assert found == {"a": [None, [1.5, None]], "b": {"c": None, "d": True, "e": 10**400}}


def test_a_flood_of_messages_lets_others_have_their_turn() -> None:
    class Flood:
        """A WebSocket on which there is always another message."""

        left = 200

        async def receive(self) -> dict[str, Any]:
            self.left -= 1
            kind = "receive" if self.left else "disconnect"
            return {"type": f"websocket.{kind}", "text": '{"type": "any"}'}

    async def run() -> int:
        turns = 0

        async def others() -> None:
            nonlocal turns
            while True:
                turns += 1
                await asyncio.sleep(0)

        task = asyncio.create_task(others())
        await _listen(Flood(), Outbox(), Source())  # type: ignore[arg-type]
        task.cancel()
        return turns

    assert asyncio.run(run()) > 150
