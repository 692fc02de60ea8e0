"""Clocks that run over: counters of few bits, and those that start over."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.record.raw import CLOCK_UNITS, Array, RawRecording


class CounterPolicy(NamedTuple):
    """When a step back is a counter that runs over, and when the clock starts over."""

    near: float = 0.1
    """Share of its range that a counter is from its end before it runs over, and from its
    beginning afterwards; chosen by hand."""
    steps: float = 50.0
    """Usual steps that it goes on by at most when it runs over; chosen by hand."""
    displaced: int = 3
    """Usual steps that rows out of order are displaced by at least for a clock that starts over;
    chosen by hand."""
    seldom: float = 0.05
    """Share of the steps that go back, up to which the clock starts over; chosen by hand."""


COUNTER: Final = CounterPolicy()
_BITS: Final = (8, 10, 12, 15, 16, 20, 24, 31, 32)
_DAY_S: Final = 86_400.0


def unwrap_counters(raw: RawRecording) -> list[str]:
    """Make clocks that run over go on, in place; return what was done.

    Parameters
    ----------
    raw : RawRecording
        As a loader returned it.
    """
    moduli = [(float(1 << bits), f"{bits} bits") for bits in _BITS]
    moduli += [(10.0**digits, f"{digits} digits") for digits in range(2, 7)]
    if raw.clock_unit != "frame":
        ticks = CLOCK_UNITS[raw.clock_unit]
        moduli += [(2.0**32 / 1e6 * ticks, "32 bits of microseconds")]
        moduli += [(2.0**32 / 1e3 * ticks, "32 bits of milliseconds")]
        moduli += [(_DAY_S * ticks, "a day")] if raw.calendar == "" else []
    notes: list[str] = []
    clocks = {id(body.clock): body.clock for body in raw.bodies}
    unwrapped: dict[int, Array] = {}
    for key, clock in clocks.items():
        back = _steps_back(clock)
        if not back.size:
            continue
        known = clock[np.isfinite(clock)]
        for modulus, what in sorted(moduli):
            if _runs_over(known, modulus):
                unwrapped[key] = _unwrapped(clock, modulus)
                note = f"the clock runs over after {modulus:.10g} ({what}): it is counted on"
                notes += [] if note in notes else [note]
                break
    for body in raw.bodies:
        body.clock = unwrapped.get(id(body.clock), body.clock)
    return notes


def _steps_back(clock: Array) -> npt.NDArray[np.int64]:
    """Return where a clock goes back; of rows without a time nothing is known."""
    with np.errstate(invalid="ignore"):
        back = np.flatnonzero(clock[1:] < clock[:-1])
    if not back.size and not np.isfinite(clock).all():
        known = clock[np.isfinite(clock)]
        return np.flatnonzero(known[1:] < known[:-1])
    return back


def _runs_over(known: Array, modulus: float) -> bool:
    """Whether all steps back of a clock are those of a counter with this modulus."""
    low = float(known.min())
    # A signed counter runs from the negative half on.
    first = -0.5 * modulus if low < 0.0 else 0.0
    if low < first or float(known.max()) >= first + modulus:
        return False
    steps = np.diff(known)
    back = np.flatnonzero(steps < 0)
    ahead = steps[steps > 0]
    if not ahead.size:
        return False
    over = steps[back] + modulus
    before, after = known[back] - first, known[back + 1] - first
    return bool(
        (over > 0).all()
        and (over <= COUNTER.steps * np.median(ahead)).all()
        and (before >= (1.0 - COUNTER.near) * modulus).all()
        and (after <= COUNTER.near * modulus).all()
    )


def _unwrapped(clock: Array, modulus: float) -> Array:
    known = np.flatnonzero(np.isfinite(clock))
    counted = clock.copy()
    counted[known[1:]] += modulus * np.cumsum(np.diff(clock[known]) < 0)
    return counted


def starts_over(clock: Array) -> bool:
    """Whether a clock that goes back starts over, and is not only out of order here and there.

    Parameters
    ----------
    clock : array, shape (n,)
        Times, all of them finite.
    """
    steps = np.diff(clock)
    back = steps[steps < 0]
    ahead = steps[steps > 0]
    if not back.size or not ahead.size:
        return False
    usual = float(np.median(ahead))
    far = (-back > COUNTER.displaced * usual).all()
    return bool(far and back.size <= max(1.0, COUNTER.seldom * steps.size))


def overlap(clock: Array) -> bool:
    """Whether the parts of a clock that starts over would be mixed by sorting.

    Parts with most of their times in common are several bodies, which another check refuses.
    """
    if np.unique(clock).size < 0.9 * clock.size:
        return False
    starts = np.append(0, np.flatnonzero(np.diff(clock) < 0) + 1)
    ends = np.append(starts[1:], clock.size) - 1
    order = np.argsort(clock[starts], kind="stable")
    return bool((clock[starts][order][1:] <= clock[ends][order][:-1]).any())
