"""How long a recording has to be for C_d to be known as well as is asked."""

from __future__ import annotations

import math
from typing import Final, NamedTuple


class LengthPolicy(NamedTuple):
    """The precision of C_d that a recording of usual length gives."""

    usual_precision: float = 0.1
    """Standard error of ln C_d above which a fit warns, where the user states no precision. Chosen
    by hand."""
    usual_s: float = 1200.0
    """Length [s] in which C_d comes out to the two precisions that follow: 20 minutes, 10 to 30 by
    the flow. A rule of thumb."""
    without_angle: float = 0.1
    """Standard error of ln C_d in that time without orientations. Cautious: half an hour has 6 % on
    the bundled recording (docs/explanation/likelihood.md)."""
    with_angle: float = 0.05
    """Standard error of ln C_d in that time with orientations. Cautious: half an hour has 1 % on
    the bundled recording."""


LENGTH: Final = LengthPolicy()


def needed_duration(duration: float, std: float, precision: float) -> float:
    """Return how long a recording like this one has to be for a precision [s].

    Examples
    --------
    >>> needed_duration(600.0, 0.2, 0.1)
    2400.0
    """
    return duration * (std / precision) ** 2


def in_words(seconds: float) -> str:
    """Return a length of time, rounded up to two digits.

    Examples
    --------
    >>> in_words(61.0), in_words(1234.0), in_words(30000.0)
    ('61 s', '21 min', '8.4 h')
    """
    unit, name = (1.0, "s") if seconds < 120 else (60.0, "min") if seconds < 5400 else (3600.0, "h")
    value = seconds / unit
    grain = 10.0 ** (math.floor(math.log10(max(value, 1e-9))) - 1)
    return f"{grain * math.ceil(value / grain - 1e-9):.6g} {name}"


def length_advice(precision: float | None) -> str:
    """Return the sentence on how long to record, for a precision or in general."""
    if precision is None:
        return (
            "As a rule 10 to 30 min give C_d to 10 % without orientations, to about 5 % with them"
        )
    with_angle, without = (
        in_words(needed_duration(LENGTH.usual_s, usual, precision))
        for usual in (LENGTH.with_angle, LENGTH.without_angle)
    )
    return (
        f"For C_d to {100 * precision:.3g} % record some {with_angle} with orientations, "
        f"{without} without, as a rule"
    )
