"""Filter for a tracker's frames: a body that cannot be drawn is left out, not its frame.

A stream comes from another program, and any of its values may be wrong. Wrong values are left out,
counted, and reported in one sentence that is brought up to date now and then.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from typing import Any, Final

SAID_EVERY_S: Final = 5.0
"""Time after which new counts are said [s]; a new reason is said at once."""
MOST_REASONS: Final = 3
"""Reasons that are named of each kind, the most frequent ones."""
KINDS: Final = {
    "line": ("line", "lines"),
    "frame": ("whole frame", "whole frames"),
    "body": ("body", "bodies"),
    "join": ("entry of 'joined'", "entries of 'joined'"),
    "event": ("event", "events"),
    "value": ("value", "values"),
}
"""Names of parts that can be left out, in singular and plural."""
FACES: Final = range(4)

Fault = str | None
Check = Callable[[Any], Fault]


class _Tally:
    """How many of a kind were left out, of how many frames, and why."""

    def __init__(self) -> None:
        self.parts, self.frames = 0, 0
        self.reasons: Counter[str] = Counter()

    def add(self, reasons: list[str]) -> None:
        self.parts += len(reasons)
        self.frames += 1
        self.reasons.update(reasons)


class SoundFrames:
    """Takes the frames of one stream and leaves out what cannot be drawn.

    Examples
    --------
    >>> frames = SoundFrames()
    >>> good = {"id": "a", "seen": True, "x_m": 0.1, "y_m": 0.0, "theta_rad": None}
    >>> odd = {**good, "id": "b", "x_m": "left"}
    >>> kept = frames.take({"frame": 0, "time_s": 0.0, "bodies": [good, odd]})
    >>> [body["id"] for body in kept["bodies"]]
    ['a']
    >>> frames.words(now=0.0)
    'left out, since it cannot be drawn: 1 body of 1 frame (x_m is not a number)'
    """

    def __init__(self) -> None:
        self._tallies = {kind: _Tally() for kind in KINDS}
        self._known: set[tuple[str, str]] = set()
        self._said = ""
        self._next = -math.inf

    def take(self, content: dict[str, Any]) -> dict[str, Any] | None:
        """Return a frame with all of it that can be drawn; None when nothing can.

        Parameters
        ----------
        content : dict
            A line of the stream, of type ``frame``.
        """
        fault = _first_fault(content, FRAME)
        if fault is not None:
            self._note("frame", [fault])
            return None
        found = {name: check(content.get(name)) for name, check in VALUES.items()}
        faults = {name: fault for name, fault in found.items() if fault is not None}
        self._note("value", [f"{name} {fault}" for name, fault in faults.items()])
        sound = {**content, **dict.fromkeys(faults), "bodies": self._bodies(content["bodies"])}
        for kind, name, check in (("join", "joined", _join), ("event", "events", _event)):
            if isinstance(sound.get(name), list):
                sound[name] = self._kept(kind, sound[name], check)
        return sound

    def note_unreadable(self) -> None:
        """Count a line of the stream that says nothing."""
        self._note("line", ["it is not a JSON object with a type"])

    def words(self, *, now: float, last: bool = False) -> str | None:
        """Return what there is to say of what was left out; None when there is nothing new.

        Parameters
        ----------
        now : float
            Time on any clock [s].
        last : bool
            Whether the stream ends: then the counts are said as they are.
        """
        if now < self._next and not last:
            return None
        found = [_sentence(kind, tally) for kind, tally in self._tallies.items() if tally.parts]
        words = "; ".join(found)
        if words == self._said:
            return None
        self._said, self._next = words, now + SAID_EVERY_S
        return f"left out, since it cannot be drawn: {words}"

    def _bodies(self, bodies: list[Any]) -> list[Any]:
        ids: set[str] = set()

        def check(body: Any) -> Fault:
            fault = _first_fault(body, BODY)
            if fault is None and body["id"] in ids:
                return "a frame has the same id twice"
            if fault is None:
                ids.add(body["id"])
            return fault

        return self._kept("body", bodies, check)

    def _kept(self, kind: str, parts: list[Any], check: Check) -> list[Any]:
        """Return the parts that are sound, and note the others."""
        faults = [check(part) for part in parts]
        self._note(kind, [fault for fault in faults if fault is not None])
        return [part for part, fault in zip(parts, faults, strict=True) if fault is None]

    def _note(self, kind: str, reasons: list[str]) -> None:
        if not reasons:
            return
        self._tallies[kind].add(reasons)
        new = {(kind, reason) for reason in reasons} - self._known
        if new:
            self._known |= new
            self._next = -math.inf


def _sentence(kind: str, tally: _Tally) -> str:
    one, several = KINDS[kind]
    named = [reason for reason, _ in tally.reasons.most_common(MOST_REASONS)]
    more = ["..."] if len(tally.reasons) > MOST_REASONS else []
    what = f"{tally.parts} {several if tally.parts > 1 else one}"
    if kind not in ("line", "frame"):
        what += f" of {tally.frames} frame{'s' if tally.frames > 1 else ''}"
    return f"{what} ({', '.join(named + more)})"


def _first_fault(content: Any, checks: dict[str, Check]) -> Fault:
    """Return what is wrong with an object of which every key is needed."""
    if not isinstance(content, dict):
        return "it is not an object"
    for name, check in checks.items():
        if name not in content:
            return f"{name} is missing"
        if (fault := check(content[name])) is not None:
            return f"{name} {fault}"
    return None


def _number(value: Any) -> Fault:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return "is not a number"
    try:
        finite = math.isfinite(value)
    except OverflowError:
        # A whole number that no float can hold.
        finite = False
    return None if finite else "is not a finite number"


def _text(value: Any) -> Fault:
    return None if isinstance(value, str) else "is not text"


def _flag(value: Any) -> Fault:
    return None if isinstance(value, bool) else "is not true or false"


def _list(value: Any) -> Fault:
    return None if isinstance(value, list) else "is not a list"


def _texts(value: Any) -> Fault:
    good = isinstance(value, list) and all(isinstance(one, str) for one in value)
    return None if good else "is not a list of text"


def _or_null(check: Check) -> Check:
    return lambda value: None if value is None else check(value)


def _join(entry: Any) -> Fault:
    match entry:
        case [str(), face, str(), other] if _is_face(face) and _is_face(other):
            return None
    return "it is not [block, face, other block, face]"


def _is_face(value: Any) -> bool:
    return type(value) is int and value in FACES


def _event(entry: Any) -> Fault:
    return _first_fault(entry, EVENT)


FRAME: Final[dict[str, Check]] = {"frame": _number, "time_s": _number, "bodies": _list}
"""Without these nothing of a frame can be drawn."""
BODY: Final[dict[str, Check]] = {
    "id": _text,
    "seen": _flag,
    "x_m": _or_null(_number),
    "y_m": _or_null(_number),
    "theta_rad": _or_null(_number),
}
"""Values of a body that the page draws."""
EVENT: Final[dict[str, Check]] = {
    "time_s": _number,
    "kind": _text,
    "bodies": _texts,
    "outcome": _or_null(_text),
}
VALUES: Final[dict[str, Check]] = {
    "joined": _or_null(_list),
    "events": _or_null(_list),
    "outcome": _or_null(_text),
    "possible": _or_null(_texts),
    "hidden": _or_null(_texts),
    "latency_s": _or_null(_number),
    "dropped_frames": _or_null(_number),
    "frames_lost_by_client": _or_null(_number),
    "jpeg_base64": _or_null(_text),
}
"""Optional values of a frame that the page shows."""
