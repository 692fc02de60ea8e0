"""The lines that driftwalk and a program exchange: what is asked, and what counts as an answer."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats, Keys
from driftwalk.core.errors import ConfigurationError, FormatError, did_you_mean
from driftwalk.core.text_files import MIB, json_value, parse_json
from driftwalk.motion.external_program.process import ProgramFault, Request
from driftwalk.motion.protocol import in_words, world_seeds, world_starts
from driftwalk.schema import Parameter

if TYPE_CHECKING:
    from driftwalk.conditions.recorded import Conditions

UNITS: Final = {
    "x": "x_m",
    "y": "y_m",
    "theta": "theta_rad",
    "vx": "vx_m_s",
    "vy": "vy_m_s",
    "omega": "omega_rad_s",
}
"""From the names of a start to the keys of its numbers."""
STEPS: Final = ("step", "refined_step")
KEYS_OF_A_PARAMETER: Final = ("name", "unit", "low", "high", *STEPS, "scale", "meaning")


class Positions(NamedTuple):
    """True positions of worlds, shape (worlds, samples)."""

    x: Floats
    y: Floats
    theta: Floats | None


@dataclass(frozen=True)
class WorldRequest(Request):
    """A request for worlds of one setting."""

    number: int
    shape: tuple[int, int]
    """Worlds and samples of the answer."""


PARAMETERS_REQUEST: Final = Request(
    json.dumps({"driftwalk": 1, "request": "parameters"}).encode() + b"\n",
    "when it was asked for its parameters",
    MIB,
)
"""The first line that a program gets."""


def world_request(
    number: int,
    setting: Mapping[str, float],
    like: Conditions,
    keys: Keys,
    *,
    flow: str | None = None,
) -> WorldRequest:
    """Return the request for the worlds of one setting, one per key; `flow` is a file."""
    start = world_starts(like.start, keys)._asdict()
    asked: dict[str, Any] = {
        "id": number,
        "parameters": dict(setting),
        "times_s": like.sample_time.tolist(),
        "start": {key: json_value(start[name]) for name, key in UNITS.items()},
        "seeds": world_seeds(keys),
        "tank": like.tank.to_arena(),
    }
    if flow is not None:
        asked["flow_file"] = flow
    shape = keys.size, like.sample_time.size
    # 17 digits need 25 bytes; 64 leave room for indentation.
    most = MIB + 3 * 64 * keys.size * like.sample_time.size
    line = json.dumps(asked, separators=(",", ":")).encode() + b"\n"
    return WorldRequest(line, f"at {in_words(setting)}", most, number, shape)


def read_parameters(line: bytes) -> dict[str, Parameter]:
    """Return the parameters that a program has, by name.

    Raises
    ------
    ProgramFault
        When the answer is no list of parameters.
    """
    where = PARAMETERS_REQUEST.where
    listed = _read_object(line, where).get("parameters")
    if not isinstance(listed, list) or not listed:
        raise _fault(where, "its answer has no list of parameters", line)
    found = {}
    for one in listed:
        try:
            parameter = _parameter(one)
        except ConfigurationError as error:
            raise ProgramFault(where, str(error)) from error
        if parameter.name in found:
            raise ProgramFault(where, f"it has two parameters {parameter.name}")
        found[parameter.name] = parameter
    return found


def read_positions(line: bytes, request: WorldRequest) -> Positions:
    """Return the positions that a program answers with.

    Raises
    ------
    ProgramFault
        When the answer is none to this request.
    """
    answer = _read_object(line, request.where)
    number = answer.get("id")
    if isinstance(number, bool) or number != request.number:
        reason = f"it answered with the id {number!r}, expected {request.number}"
        raise _fault(request.where, reason, line)
    x, y = (_rows(answer, key, request, line) for key in ("x_m", "y_m"))
    has_theta = answer.get("theta_rad") is not None
    return Positions(x, y, _rows(answer, "theta_rad", request, line) if has_theta else None)


def _read_object(line: bytes, where: str) -> dict[str, Any]:
    try:
        answer = parse_json(line)
    except FormatError as error:
        hint = "standard output is for answers, standard error for messages"
        raise _fault(where, f"{error.reason} ({hint})", line) from error
    if not isinstance(answer, dict):
        raise _fault(where, "its answer is no object of JSON", line)
    if "error" in answer:
        reported = " ".join(str(answer["error"]).split())
        raise ProgramFault(where, f"it reported: {reported}")
    return answer


def _rows(answer: Mapping[str, Any], key: str, request: WorldRequest, line: bytes) -> Floats:
    samples = request.shape[1]
    found = answer.get(key)
    if not isinstance(found, list):
        raise _fault(request.where, f"its answer has no list {key}", line)
    expected = f"expected {request.shape}: (worlds, times)"
    try:
        # A world that failed may be null as a whole.
        array = np.array([[None] * samples if row is None else row for row in found])
    except ValueError:
        raise _fault(
            request.where, f"the rows of {key} differ in length; {expected}", line
        ) from None
    if array.shape != request.shape:
        raise _fault(request.where, f"{key} has the shape {array.shape}, {expected}", line)
    if array.dtype.kind not in "fiu" and not all(_is_number_or_null(one) for one in array.flat):
        raise _fault(request.where, f"{key} holds something that is no number", line)
    return array.astype(np.float64)


def _is_number_or_null(value: object) -> bool:
    return value is None or (isinstance(value, (int, float)) and not isinstance(value, bool))


def _parameter(given: Any) -> Parameter:
    if not isinstance(given, dict) or not isinstance(given.get("name"), str):
        raise ConfigurationError(f"expected a parameter with a name, got {given!r:.80}")
    name = given["name"]
    for key in given:
        if key not in KEYS_OF_A_PARAMETER:
            known = did_you_mean(key, KEYS_OF_A_PARAMETER)
            raise ConfigurationError(f"its parameter {name} has an unknown key {key!r}{known}")
    for key in ("low", "high"):
        value = given.get(key)
        if value is None or not _is_number_or_null(value) or not math.isfinite(value):
            raise ConfigurationError(f"its parameter {name} has no number {key}: {value!r:.80}")
    for key in STEPS:
        value = given.get(key)
        if not _is_number_or_null(value) or (value is not None and not 0.0 < value < math.inf):
            raise ConfigurationError(f"its parameter {name} has no {key} above 0: {value!r:.80}")
    scale: Any = given.get("scale") or "linear"
    unit, meaning = str(given.get("unit") or "1"), str(given.get("meaning") or "")
    low, high = float(given["low"]), float(given["high"])
    step, refined = (float(given.get(key) or 0.0) for key in STEPS)
    return Parameter(
        name, unit, low, high, step, scale=scale, refined_step=refined, meaning=meaning
    )


def _fault(where: str, reason: str, line: bytes) -> ProgramFault:
    # A letter takes four bytes at most.
    begun = line[: 4 * 80].decode("utf-8", "replace")
    shown = begun[:80] + ("…" if len(begun) > 80 else "")
    return ProgramFault(where, f"{reason}; the answer begins {shown!r}")
