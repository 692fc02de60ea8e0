"""Choose a member of the family: its parts, which numbers are searched, which are known."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from driftwalk.core.errors import ConfigurationError
from driftwalk.motion.family.members import MEMBERS, Member
from driftwalk.motion.family.particle import ParticleModel
from driftwalk.motion.family.parts import PARTS, Part
from driftwalk.motion.ranges import known_value, ranged
from driftwalk.schema import Parameter

Choice = float | tuple[float, float] | tuple[float, float, str]
"""A known value, or a range with or without its unit."""


def family_model(
    name: str, /, *parameters: Parameter, clearance: float | None = None, **choices: Choice
) -> ParticleModel:
    """Return a member of the family of self-propelled bodies, with parts.

    Parameters
    ----------
    name : str
        A member, then parts: "active", "run_rest+wall", "burst_coast+wall+follow". A hyphen counts
        as an underscore.
    *parameters : Parameter
        Parameters of the member with a range, step or scale of their own.
    clearance : float, optional
        Distance of the recorded point from the wall at contact [m]: half the body's width. Left
        out, a simulation takes 0 and a calibration of many parameters that of the recording.
    **choices : float or tuple
        Of the member's parameters by name: a value that is known, or a range ``(low, high)`` or
        ``(low, high, unit)``. The others keep their wide ranges.

    Raises
    ------
    ConfigurationError
        When there is no such member, part or parameter, or a value or range makes no sense.

    Examples
    --------
    >>> model = family_model("run-tumble+wall", turn_rate=0.0, speed=(0.01, 0.1))
    >>> model.name, len(model.parameters), model.parameters[0].high
    ('run_tumble+wall', 8, 0.1)
    """
    member, parts = _member_and_parts(name)
    if clearance is not None and not (math.isfinite(clearance) and clearance >= 0.0):
        raise ConfigurationError(f"clearance is {clearance}, expected a length from 0 m on")
    groups = [member.parameters, *(part.parameters for part in parts)]
    # Two parts that feel the wall have one range.
    usual = {one.name: one for group in groups for one in group}
    given: dict[str, Any] = {**{one.name: one for one in parameters}, **choices}
    twice = {one.name for one in parameters} & set(choices)
    if twice or len({one.name for one in parameters}) < len(parameters):
        raise ConfigurationError(f"a parameter of {name} is given twice")
    for unknown in given.keys() - usual.keys():
        raise ConfigurationError(
            f"the model {name} has no parameter {unknown!r}; it has {', '.join(usual)}"
        )
    fixed = {
        key: known_value(usual[key], choice)
        for key, choice in given.items()
        if not isinstance(choice, tuple | Parameter)
    }
    searched = tuple(
        _ranged(one, given[key]) if key in given else one
        for key, one in usual.items()
        if key not in fixed
    )
    return ParticleModel(member, parts, searched, fixed=fixed, clearance=clearance)


def _member_and_parts(name: str) -> tuple[Member, tuple[Part, ...]]:
    first, *rest = name.strip().replace("-", "_").split("+")
    if first not in MEMBERS:
        raise ConfigurationError(
            f"there is no motion model {first!r}; there are {', '.join(MEMBERS)}"
        )
    for part in rest:
        if part not in PARTS:
            raise ConfigurationError(
                f"a motion model has no part {part!r}; there are {', '.join(PARTS)}"
            )
    if len(set(rest)) < len(rest):
        raise ConfigurationError(f"a part of {name} is named twice")
    member = MEMBERS[first]
    unfit = [part for part in rest if member.kind == "inertial" and PARTS[part].parameters]
    if unfit:
        raise ConfigurationError(
            f"{first} has no heading: it takes the parts flow and reflect, not {', '.join(unfit)}"
        )
    if "reverse" in rest and member.name == "active":
        raise ConfigurationError(
            f"{first} has one bout without end, so none begins with a reversal: leave the part "
            "reverse out"
        )
    return member, tuple(PARTS[part] for part in rest)


def _ranged(usual: Parameter, choice: Parameter | tuple[Any, ...]) -> Parameter:
    """Return the parameter with another range, which has nothing below 0 if the usual has not."""
    chosen = ranged(usual, choice)
    if chosen.low < 0.0 <= usual.low:
        raise ConfigurationError(f"{usual.name}: a value below 0 [{usual.unit}] makes no sense")
    return chosen


def models() -> Mapping[str, Member]:
    """Return the family of self-propelled motion models: members by name.

    Each has a ``sentence``, a ``formula``, a ``source`` and ``parameters``, which have a unit, a
    range and a ``meaning``. `motion_model` makes one, with parts: "run_rest+wall".

    Examples
    --------
    >>> import driftwalk as dw
    >>> list(dw.models())
    ['inertial', 'active', 'run_tumble', 'run_rest', 'burst_coast', 'two_state']
    >>> dw.models()["run_rest"].sentence
    'Runs and rests in turn: beetles, mice, robots that stop.'
    """
    return MEMBERS
