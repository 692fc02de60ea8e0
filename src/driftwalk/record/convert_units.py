"""Convert a recording to SI: clock, scale, direction of y. The only place for units.

The resolution of a file's numbers is found here too.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from driftwalk.core.errors import InputError, argument_text
from driftwalk.record.arena import implied_scale
from driftwalk.record.cleaning.clock import CLOCK
from driftwalk.record.cleaning.warn import refuse_far, span_of
from driftwalk.record.raw import (
    ANGLE_UNITS,
    CLOCK_UNITS,
    LENGTH_UNITS,
    Array,
    RawRecording,
    ReadOptions,
)
from driftwalk.record.tables.date_stamps import DAY, LOCAL, UTC, moment_text


def detect_quantum(values: Array) -> float:
    """Return the spacing that all values are multiples of, apart from rounding; 0 when unknown.

    First the decimal places: values written with six decimals are multiples of 1e-6. Then a coarser
    lattice: pixels that were scaled to metres before they were written leave the differences of
    neighbouring distinct values at multiples of the pixel.

    Parameters
    ----------
    values : array, shape (n,)
        Positions in the file's own unit; NaN is left out.

    Examples
    --------
    >>> detect_quantum(np.arange(100) % 7 * 0.25)
    0.25
    """
    present = np.isfinite(values)
    count = int(np.count_nonzero(present))
    every = count // 50_000 + 1 if count > 50_000 else 1  # of many every second, third, ... one
    known = values[::every] if count == values.size else values[np.flatnonzero(present)[::every]]
    if known.size < 2:
        return 0.0
    decimal = _decimal_quantum(known)
    return _lattice_quantum(known, decimal) or decimal


def _decimal_quantum(values: Array) -> float:
    """Return the spacing of values with few decimals, 0 for more than nine.

    The greatest common divisor of their differences; of few values, which may have a common divisor
    by chance, the last decimal place.
    """
    for decimals in range(10):
        scaled = values * 10.0**decimals
        whole = np.round(scaled)
        if np.abs(whole).max() > 2.0**52:
            return 0.0
        # One unit in the last place of the value, scaled, is all that rounding may leave.
        if (np.abs(scaled - whole) <= 4.0 * np.spacing(np.abs(scaled) + 1.0)).all():
            steps = (whole - whole[0]).astype(np.int64)
            divisor = int(np.gcd.reduce(steps)) if values.size >= 30 else 1
            return float(divisor) / 10.0**decimals
    return 0.0


def _lattice_quantum(values: Array, decimal: float) -> float:
    """Return a lattice spacing well above the decimal one, 0 when there is none."""
    distinct = np.unique(values)
    if distinct.size < 8:
        return 0.0
    steps = np.diff(distinct)
    steps = steps[steps > 3.0 * decimal + 1e-9 * np.ptp(distinct)]
    if steps.size < 8:
        return 0.0
    spacing = float(np.median(steps[steps < 1.5 * np.percentile(steps, 10)]))
    multiples = np.round(steps / spacing)
    tolerance = decimal + 1e-3 * spacing * np.sqrt(multiples)
    regular = float((np.abs(steps - multiples * spacing) <= tolerance).mean())
    # Every recording has a smallest step; a lattice has hardly any other, and far more samples
    # than sites.
    sites = np.ptp(distinct) / spacing
    few_sites = distinct.size < 0.5 * values.size or sites < 4.0 * distinct.size
    return spacing if regular > 0.99 and few_sites and spacing > 3.0 * decimal else 0.0


def convert_units(
    raw: RawRecording,
    options: ReadOptions,
    *,
    y_axis: str | None = None,
    tank: str | None = None,
) -> dict[str, object]:
    """Convert the bodies to s, m and rad with y up; return the attributes that say what was done.

    The arrays of `raw` are converted in place, so that a large recording is held once.

    Parameters
    ----------
    raw : RawRecording
        Result of a loader.
    options : ReadOptions
        Frame rate, scale and unit.
    y_axis : {"up", "down"}, optional
        Direction of y in the file, for positions and angles; None: as the format has it.
    tank : str, optional
        The tank as `load` takes it; for the error, which says what scale a known one implies.

    Raises
    ------
    InputError
        When scale or frame rate are neither in the file nor given (the message names the argument),
        or are given though the file holds them; when a number is far too large for a position.
    """
    if y_axis not in (None, "up", "down"):
        raise InputError(f"`y_axis` is 'up' or 'down', got '{y_axis}'")
    scale_text = scale_wanted(raw.length_unit, raw.bare_length_is_si, options)
    rate_text = ""
    if raw.clock_unit == "frame" and options.frame_rate_hz is None and raw.frame_rate_hz is None:
        rate_text = "the file counts frames: give their rate in Hz with `frame_rate`"
    if scale_text or rate_text:
        implied = implied_scale(raw.bodies, tank) if scale_text else ""
        raise InputError("; ".join(text for text in (scale_text, rate_text, implied) if text))
    scale, in_pixels = _length_scale(raw, options)
    ticks, rate = _ticks(raw, options)
    refuse_far(raw.bodies, scale)
    positions = y_axis or raw.y_axis or ("down" if in_pixels else "up")
    flip, flip_theta = positions == "down", (y_axis or raw.theta_axis or positions) == "down"
    # The finest resolution among coordinates that vary.
    series = (values for body in raw.bodies[:4] for values in (body.x, body.y))
    quantum = min((detect_quantum(one) for one in series if span_of([one]) > 0.0), default=0.0)
    attrs: dict[str, object] = dict(raw.attrs)
    negated = _describe_negated(raw, flip, flip_theta)
    attrs["y_axis"] = f"{raw.plane}; {negated}" if raw.plane else negated
    attrs.setdefault("position_quantum_m", float(quantum * scale))
    if rate is not None:
        attrs["sample_rate_Hz"] = rate
    if in_pixels:
        attrs["metres_per_pixel"] = scale
    _convert_clocks(raw, ticks, attrs)
    turn = ANGLE_UNITS[raw.angle_unit] * (-1.0 if flip_theta else 1.0)
    for body in raw.bodies:
        body.x *= scale
        body.y *= -scale if flip else scale
        if body.theta is not None and turn != 1.0:
            body.theta *= turn
    return attrs


def scale_wanted(length_unit: str, bare_is_si: bool, options: ReadOptions) -> str:
    """Return what is to be given so that lengths are known, empty where nothing is.

    Parameters
    ----------
    length_unit : str
        Unit in the file, empty where it names none.
    bare_is_si : bool
        Whether positions without a unit are in metres.
    options : ReadOptions
        Scale and unit that are given.
    """
    unit = _unit(length_unit, bare_is_si, options)
    if options.metres_per_pixel is not None or unit not in ("", "px"):
        return ""
    if unit:
        return "the positions are in pixels: give the scale with `metres_per_pixel`"
    return (
        "the file does not name the unit of its positions: give `metres_per_pixel` for pixels, "
        "or `length_unit` m, cm or mm"
    )


def _unit(length_unit: str, bare_is_si: bool, options: ReadOptions) -> str:
    """Return the unit of positions, ``""`` where nothing says it."""
    usual = "px" if options.metres_per_pixel is not None else "m" if bare_is_si else ""
    return options.length_unit or length_unit or usual


def _length_scale(raw: RawRecording, options: ReadOptions) -> tuple[float, bool]:
    """Return (metres per unit of the file, whether that unit is the pixel)."""
    unit = options.length_unit
    if unit is not None and unit not in (*LENGTH_UNITS, "px"):
        raise InputError(f"`length_unit` is one of {', '.join(LENGTH_UNITS)}, px; got '{unit}'")
    if unit is not None and raw.length_unit not in ("", "px", unit):
        stated = argument_text("length_unit", unit)
        raise InputError(f"{stated} contradicts the file, whose positions are in {raw.length_unit}")
    unit = _unit(raw.length_unit, raw.bare_length_is_si, options)
    if unit == "px":
        return _positive(options.metres_per_pixel, "metres_per_pixel"), True
    if options.metres_per_pixel is not None:
        raise InputError(
            f"`metres_per_pixel` is for positions in pixels, and these are in {unit}: leave it out"
        )
    return LENGTH_UNITS[unit], False


def _ticks(raw: RawRecording, options: ReadOptions) -> tuple[float, float | None]:
    """Return (units of the clock per second, frame rate if the clock counts frames)."""
    if raw.clock_unit != "frame":
        if options.frame_rate_hz is not None:
            raise InputError(
                "the file has its own clock: leave `frame_rate` out, or name the column that "
                'counts frames, as in `columns={"frame": "NAME"}`'
            )
        return CLOCK_UNITS[raw.clock_unit], None
    rate = options.frame_rate_hz if options.frame_rate_hz is not None else raw.frame_rate_hz
    return _positive(rate, "frame_rate"), rate


def _positive(value: float | None, argument: str) -> float:
    if value is None or not (np.isfinite(value) and value > 0):
        raise InputError(f"`{argument}` must be a number above zero, got {value}")
    return float(value)


def _describe_negated(raw: RawRecording, flip: bool, flip_theta: bool) -> str:
    has_theta = any(body.theta is not None for body in raw.bodies)
    if not flip and not (flip_theta and has_theta):
        return "up in the file: kept"
    if not has_theta or flip == flip_theta:
        return f"down in the file: y {'and theta ' if has_theta else ''}negated"
    kept, negated = ("theta", "y") if flip else ("y", "theta")
    return f"{kept} kept, {negated} negated (measured in the image)"


def _convert_clocks(raw: RawRecording, ticks: float, attrs: dict[str, object]) -> None:
    """Convert each distinct clock array to seconds, in place, and say when it begins."""
    arrays = {id(body.clock): body.clock for body in raw.bodies}
    # Without copies: a clock may have millions of times. An infinite one is no time.
    known = [(clock, np.isfinite(clock)) for clock in arrays.values()]
    starts = [float(c.min(where=k, initial=np.inf)) for c, k in known if k.any()]
    origin = min(starts, default=0.0)
    # As fractions, because float64 rounds nanoseconds since 1970.
    begin = float((Fraction(raw.clock_origin) + Fraction(origin)) / Fraction(ticks))
    dated = raw.calendar in (UTC, LOCAL)
    if raw.clock_unit == "frame" or (begin < CLOCK.first_day_s and not dated):
        origin = -float(raw.clock_origin)
    elif raw.calendar != LOCAL:
        attrs["time_origin_unix_s"] = begin
    if dated:
        attrs["time_origin"] = moment_text(raw.clock_origin + int(origin), raw.calendar)
    elif raw.calendar == DAY:
        attrs["time_origin"] = "00:00:00"
    for clock in arrays.values():
        with np.errstate(invalid="ignore"):  # damage may leave a NaN that signals
            np.subtract(clock, origin, out=clock)
            np.divide(clock, ticks, out=clock)
