"""Ranges that a user gives for the parameters of a motion model."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from driftwalk.core.errors import ConfigurationError
from driftwalk.schema import Parameter

Range = tuple[float, float] | tuple[float, float, str]
Given = Mapping[str, Parameter | Range]
"""Ranges by the name of the parameter."""


def given_by_name(
    parameters: tuple[Parameter, ...], ranges: Mapping[str, Any]
) -> Mapping[str, Any]:
    """Return all ranges that a user gave, by name; refuse a parameter that is given twice."""
    names = [*(one.name for one in parameters), *ranges]
    if len(set(names)) < len(names):
        raise ConfigurationError(f"a parameter is given twice: {', '.join(names)}")
    return {**{one.name: one for one in parameters}, **ranges}


def with_given(usual: Mapping[str, Parameter], given: Given) -> tuple[Parameter, ...]:
    """Return the usual parameters, each with the range given for it, and then the other ones."""
    return (
        *(ranged(one, given[name]) if name in given else one for name, one in usual.items()),
        *(range_parameter(name, one) for name, one in given.items() if name not in usual),
    )


def range_parameter(name: str, given: Parameter | Range, unit: str = "1") -> Parameter:
    """Return a parameter about which nothing but its range is known; `unit` where it has none."""
    if isinstance(given, Parameter):
        return given
    if not isinstance(given, tuple) or len(given) not in (2, 3):
        raise ConfigurationError(f"{name}: expected a range such as (0, 0.1, 'm/s'), got {given!r}")
    low, high, unit = (*given, unit)[:3]
    try:
        ends = float(low), float(high)
    except (TypeError, ValueError) as error:
        raise ConfigurationError(f"{name}: its range is no two numbers: {given!r}") from error
    return Parameter(name, str(unit), *ends)


def ranged(usual: Parameter, choice: Parameter | Range) -> Parameter:
    """Return a parameter with another range: its scale and meaning stay."""
    given = range_parameter(usual.name, choice, usual.unit)
    if given.unit != usual.unit:
        raise ConfigurationError(f"{usual.name} is in {usual.unit}, and its range in {given.unit}")
    if given is choice:
        return replace(given, meaning=given.meaning or usual.meaning)
    return replace(usual, low=given.low, high=given.high, step=0.0, refined_step=0.0)


def known_value(usual: Parameter, choice: Any) -> float:
    """Return a known value: not below 0 where the range has nothing below, no share above 1."""
    try:
        value = float(choice)
    except (TypeError, ValueError) as error:
        raise ConfigurationError(
            f"{usual.name}: expected a value or a range such as (0, 0.1), got {choice!r}"
        ) from error
    least = 0.0 if usual.low >= 0.0 else -math.inf
    most = 1.0 if usual.unit == "1" and usual.high == 1.0 else math.inf
    if not (math.isfinite(value) and least <= value <= most):
        raise ConfigurationError(
            f"{usual.name} is {value:g}, expected a number from {least:g} to {most:g} "
            f"[{usual.unit}]"
        )
    return value
