"""Clocks: plausibility, above all of one without a unit; counters that roll over or start over."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.errors import InputError, argument_text
from driftwalk.record.raw import CLOCK_UNITS, Array, RawRecording
from driftwalk.record.tables.date_stamps import count_on


class ClockPolicy(NamedTuple):
    """Which times of a clock without a unit can be seconds."""

    longest_interval_s: float = 1e4
    """Interval between samples beyond which the unit is another, unless it is whole hours;
    chosen by hand."""
    shortest_interval_s: float = 1e-6
    """No camera takes a million frames a second for long; chosen by hand."""
    usual_interval_s: float = 10.0
    """Interval beyond which milliseconds of a video are likelier than so slow a camera; chosen
    by hand."""
    last_day_s: float = 1e10
    """Seconds since 1970 until the year 2286; chosen by hand."""
    first_day_s: float = 1e8
    """Three years: a clock beyond them counts from 1970; chosen by hand."""
    longest_recording_s: float = 1e12
    """30,000 years; by the range of float64, in closed form: powers of much longer times are beyond
    float64."""
    first_serial: float = 15_000.0
    """Days since 1900 of the year 1941, as spreadsheets count them; chosen by hand."""
    last_serial: float = 80_000.0
    """The same of the year 2119; chosen by hand."""
    fastest_s: float = 1e-4
    """Shortest interval of a likely camera [s]; chosen by hand."""
    slowest_s: float = 2.0
    """Longest interval of a likely camera [s]; chosen by hand."""
    of_calendar: float = 0.9
    """Share of the steps that are whole hours in a calendar; chosen by hand."""


CLOCK: Final = ClockPolicy()


def check_clock(raw: RawRecording) -> list[str]:
    """Refuse times that cannot be, and return what to say about those that may not be seconds.

    Parameters
    ----------
    raw : RawRecording
        As a loader returned it.

    Returns
    -------
    list of str
        Sentences for the person who loads the file.

    Raises
    ------
    InputError
        When the clock names no unit and in seconds would begin after the year 2286, or have
        intervals that no camera has; when a clock of any unit lasts longer than 30,000 years.
    """
    if raw.clock_unit == "frame" or not raw.bodies:
        return []
    clocks = list({id(body.clock): body.clock for body in raw.bodies}.values())
    # One mask at a time, and no copies: a clock may have millions of times.
    first = min(float(clock.min(where=np.isfinite(clock), initial=np.inf)) for clock in clocks)
    last = max(float(clock.max(where=np.isfinite(clock), initial=-np.inf)) for clock in clocks)
    if last < first:
        return []
    first, last = first + raw.clock_origin, last + raw.clock_origin
    notes = []
    if raw.bare_clock is not None and raw.clock_unit == "s":
        notes = _check_bare(raw.bare_clock, _steps(clocks), first, last)
    lasts = (last - first) / CLOCK_UNITS[raw.clock_unit]
    if lasts > CLOCK.longest_recording_s:
        raise InputError(f"the times are {lasts:.3g} s apart: one of them, or their unit, is wrong")
    return notes


def _check_bare(column: str, steps: Array, first: float, last: float) -> list[str]:
    """Refuse what cannot be seconds, and say what may be milliseconds."""
    interval = float(np.median(steps)) if steps.size else 0.0
    long = interval > CLOCK.longest_interval_s and not _whole_hours(steps)
    short = 0.0 < interval < CLOCK.shortest_interval_s
    serial = CLOCK.first_serial <= first < CLOCK.last_serial and interval < CLOCK.fastest_s
    what = f"the clock{f' in column {column!r}' if column else ''} names no unit"
    if first >= CLOCK.last_day_s or long or short or (serial and interval > 0.0):
        raise InputError(
            f"{what}, and as seconds it would begin at {first:.3g} s, last {last - first:.3g} s "
            f"and have an interval of {interval:.3g} s: {_remedy(column, first, interval)}"
        )
    if interval >= CLOCK.usual_interval_s and column and not _whole_hours(steps):
        option = _option(column, "ms")
        return [f"{what}; read as seconds, its interval is {interval:.4g} s: if it is ms, {option}"]
    return []


def _steps(clocks: list[Array]) -> Array:
    """Return the sizes of the first steps of all clocks; rows at one time make none."""
    known = [start[np.isfinite(start)] for start in (clock[:100_000] for clock in clocks)]
    with np.errstate(over="ignore"):  # beyond float64 is as long as a step can be
        steps = np.concatenate([np.abs(np.diff(start)) for start in known])
    return np.asarray(np.minimum(steps[steps > 0], np.finfo(np.float64).max))


def _whole_hours(steps: Array) -> bool:
    """Whether the steps are those of a calendar: one sample every six hours, or a day."""
    return bool((steps % 3600.0 == 0.0).mean() > CLOCK.of_calendar)


def _remedy(column: str, first: float, interval: float) -> str:
    """Return what to do, with the units that would make sense."""
    if not column:
        return "the format has its times in seconds; write them so"
    units = [unit for unit in CLOCK_UNITS if unit != "s"]
    likely = [unit for unit in units if _likely(CLOCK_UNITS[unit], first, interval)]
    made = {unit: f"{interval / CLOCK_UNITS[unit]:.3g} s" for unit in likely}
    named = [f"{_option(column, unit)} makes it {length}" for unit, length in made.items()]
    named = named or [f"{_option(column, 'UNIT')}, of {', '.join(CLOCK_UNITS)}"]
    return f"name the unit ({'; '.join(named)}); if it is seconds, {_option(column, 's')}"


def _likely(ticks: float, first: float, interval: float) -> bool:
    """Whether a clock with these ticks per second starts and ticks like a camera's."""
    if first >= CLOCK.last_day_s and not CLOCK.first_day_s <= first / ticks < CLOCK.last_day_s:
        return False
    return interval == 0.0 or CLOCK.fastest_s <= interval / ticks <= CLOCK.slowest_s


def _option(column: str, unit: str) -> str:
    return argument_text("columns", {"t": f"{column}:{unit}"})


class CounterPolicy(NamedTuple):
    """When a step back is a counter that rolls over, and when the clock starts over."""

    near: float = 0.1
    """Share of its range that a counter is from its end before it rolls over, and from its
    beginning afterwards; chosen by hand."""
    steps: float = 50.0
    """Usual steps that it advances by at most when it rolls over; chosen by hand."""
    displaced: int = 3
    """Usual steps that rows out of order are displaced by at least for a clock that starts over;
    chosen by hand."""
    seldom: float = 0.05
    """Share of the steps that go back, up to which the clock starts over; chosen by hand."""
    own: float = 0.9
    """Share of the times that are of one part alone, with fewer of which the parts are bodies;
    chosen by hand."""


COUNTER: Final = CounterPolicy()
_BITS: Final = (8, 10, 12, 15, 16, 20, 24, 31, 32)
"""Widths of counters of cameras and controllers that are known to roll over."""


def unwrap_counters(raw: RawRecording) -> list[str]:
    """Unwrap clocks that roll over, in place; return what was done.

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
        moduli += [(86_400.0 * ticks, "a day")] if raw.calendar == "" else []
    moduli.sort()
    notes: dict[str, None] = {}
    for clock in {id(body.clock): body.clock for body in raw.bodies}.values():
        finite = np.isfinite(clock)
        known = clock if finite.all() else clock[finite]
        if not (known[1:] < known[:-1]).any():
            continue
        if found := next((one for one in moduli if _rolls_over(known, one[0])), None):
            modulus, what = found
            count_on(clock, modulus)
            notes[f"the clock rolls over after {modulus:.10g} ({what}): it is unwrapped"] = None
    return list(notes)


def _rolls_over(known: Array, modulus: float) -> bool:
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
    fits = (over > 0.0) & (over <= COUNTER.steps * np.median(ahead))
    fits &= (before >= (1.0 - COUNTER.near) * modulus) & (after <= COUNTER.near * modulus)
    return bool(fits.all())


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
    far = (-back > COUNTER.displaced * np.median(ahead)).all()
    return bool(far and back.size <= max(1.0, COUNTER.seldom * steps.size))


def overlap(clock: Array) -> bool:
    """Whether the parts of a clock that starts over would be mixed by sorting.

    Parts with most of their times in common are several bodies, which another check refuses.
    """
    if np.unique(clock).size < COUNTER.own * clock.size:
        return False
    starts = np.append(0, np.flatnonzero(np.diff(clock) < 0) + 1)
    ends = np.append(starts[1:], clock.size) - 1
    order = np.argsort(clock[starts], kind="stable")
    return bool((clock[starts][order][1:] <= clock[ends][order][:-1]).any())
