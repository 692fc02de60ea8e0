"""From the units of a velocity field to SI: the only place for scale and interval."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.core.units import parse_quantity
from driftwalk.flow.grid import FieldRows


@dataclass(frozen=True)
class RawField:
    """A velocity field as a file has it, a row per node."""

    rows: FieldRows
    """Numbers of the file; a velocity is NaN where it is masked or was not measured."""
    length_unit: str = ""
    """Unit of positions, as the file writes it; ``""`` when it does not say."""
    velocity_unit: str = ""
    """Unit of velocities, likewise."""
    down: bool | None = None
    """Whether y and v count downwards, as in an image; None: in pixels, where the first row has the
    smallest y, as images are written from their top."""
    frame_interval: float | None = None
    """Time between the two images of a pair [s], when the file holds it."""
    notes: list[str] = field(default_factory=list)
    """Sentences for the person who loads the file."""
    reading: str = ""
    """Meaning of the columns, in a line."""


@dataclass(frozen=True)
class FieldOptions:
    """Facts that the person who loads a field knows and the file may not state."""

    metres_per_pixel: float | None = None
    """Scale of a field in pixels [m]."""
    frame_interval: float | None = None
    """Time between the two images of a pair [s], for velocities that are shifts in pixels."""
    length_unit: str | None = None
    """Unit of positions, and per second of velocities, in a file that does not say."""
    y_axis: str | None = None
    """Direction of y in the file, ``"up"`` or ``"down"``; None: as the format has it."""
    origin: tuple[float, float] | None = None
    """Point of the field that becomes its origin [m], with y up."""
    variables: Mapping[str, str] = field(default_factory=dict)
    """From u, v, x, y, time, mask to the variable of a NetCDF file."""


LENGTH_UNITS: Final = ("m", "cm", "mm", "um", "px")
_WORDS: Final = {
    **dict.fromkeys(("meters", "metres", "meter", "metre"), "m"),
    **dict.fromkeys(("seconds", "second", "sec", "secs"), "s"),
    **dict.fromkeys(("minutes", "minute"), "min"),
    **dict.fromkeys(("hours", "hour"), "h"),
    **dict.fromkeys(("px", "pix", "pixel", "pixels"), "px"),
    **dict.fromkeys(("frame", "frames", "dt", "deltat"), "frame"),
}
_IMPERIAL: Final = {
    **dict.fromkeys(("in", "inch", "inches"), 0.0254),
    **dict.fromkeys(("ft", "foot", "feet"), 0.3048),
    **dict.fromkeys(("yd", "yard", "yards"), 0.9144),
}
"""Metres of units that `parse_quantity` does not know."""
_DEGREES: Final = re.compile(r"degrees?(_?(east|west|north|south|e|n|w|s))?|°", re.IGNORECASE)
_SHIFTS: Final = ("px", "px/frame", "px / frame", "px frame-1")
"""Velocities that are shifts between the two images of a pair."""


class FieldScale:
    """Factors from a file's units to SI, and which of the user's facts they took."""

    def __init__(self, options: FieldOptions, frame_interval: float | None = None) -> None:
        self._options = options
        self._interval = frame_interval
        self._used: set[str] = set()
        if options.length_unit is not None and options.length_unit not in LENGTH_UNITS:
            raise InputError(
                f"`length_unit` is one of {', '.join(LENGTH_UNITS)}; got '{options.length_unit}'"
            )

    def length(self, unit: str) -> float:
        """Return the metres per unit of a position.

        Raises
        ------
        InputError
            When the unit is none of length, or a fact is missing.
        """
        known = words_of_unit(unit) or self._stated()
        return self._metres_per_pixel() if known == "px" else factor_to(known, "m")

    def velocity(self, unit: str) -> float:
        """Return the metres per second of a velocity in some unit, as `length` does."""
        known = words_of_unit(unit)
        if not known:
            stated = self._stated()
            known = stated if stated == "px" else f"{stated}/s"
        if known in _SHIFTS:
            return self._metres_per_pixel() / self._frame_interval()
        if known.endswith("/frame"):
            return self.length(known.removesuffix("/frame")) / self._frame_interval()
        if known.startswith("px"):
            return self._metres_per_pixel() * factor_to(f"m{known.removeprefix('px')}", "m/s")
        return factor_to(known, "m/s")

    def in_pixels(self, unit: str) -> bool:
        """Return whether positions of a unit are in pixels."""
        return (words_of_unit(unit) or self._stated()) == "px"

    def refuse_unused(self) -> None:
        """Refuse facts that the units of the file have no use for.

        Raises
        ------
        InputError
            Names the first one.
        """
        for name in ("metres_per_pixel", "frame_interval", "length_unit"):
            if getattr(self._options, name) is not None and name not in self._used:
                raise InputError(f"the file itself says what `{name}` would: leave it out")

    def _stated(self) -> str:
        """Return the unit of a file that names none."""
        if self._options.length_unit is not None:
            self._used.add("length_unit")
            return self._options.length_unit
        if self._options.metres_per_pixel is not None:
            return "px"
        raise InputError(
            "the file does not name its units: give `metres_per_pixel` and `frame_interval` for "
            "pixels and shifts between two images, or `length_unit` for positions in m, cm or mm "
            "and velocities in these per second; driftwalk flow FILE -o flow.nc takes them"
        )

    def _metres_per_pixel(self) -> float:
        return self._given("metres_per_pixel", "positions are in pixels")

    def _frame_interval(self) -> float:
        if self._interval is not None:
            return self._interval
        return self._given("frame_interval", "velocities are shifts between two images")

    def _given(self, name: str, what: str) -> float:
        """Return a number above zero among the user's facts; `what` says why it is needed."""
        self._used.add(name)
        value: float | None = getattr(self._options, name)
        if value is None:
            raise InputError(
                f"the {what}: give `{name}`, which driftwalk flow FILE -o flow.nc takes to make a "
                "field in metres"
            )
        if not (math.isfinite(value) and value > 0.0):
            raise InputError(f"`{name}` must be a number above zero, got {value}")
        return value


def raw_to_si(raw: RawField, options: FieldOptions) -> tuple[FieldRows, list[str], str]:
    """Return the rows in m and m/s with y up, sentences about them, and how they were read.

    Raises
    ------
    InputError
        When a unit is none, or a fact is missing, or is given and of no use.
    """
    scale = FieldScale(options, raw.frame_interval)
    length, velocity = scale.length(raw.length_unit), scale.velocity(raw.velocity_unit)
    scale.refuse_unused()
    rows = raw.rows
    found = raw.down
    if found is None:
        found = bool(scale.in_pixels(raw.length_unit) and rows.y[0] < rows.y[-1])
    down = found if options.y_axis is None else options.y_axis == "down"
    sign = -1.0 if down else 1.0
    x0, y0 = options.origin or (0.0, 0.0)
    x, y = length * rows.x - x0, sign * length * rows.y - y0
    si = FieldRows(rows.line, x, y, velocity * rows.u, sign * velocity * rows.v)
    notes = [*raw.notes]
    if found and options.y_axis is None:
        notes.append("y counts downwards in the file: y and v are negated (`y_axis`)")
    return si, notes, f"{raw.reading}; {y_words(options, down=down)}"


def y_words(options: FieldOptions, *, down: bool) -> str:
    """Return how y was taken, in words."""
    stated = "" if options.y_axis is None else ", as stated"
    return f"y counts down{stated}: y and v negated" if down else f"y counts up{stated}"


def words_of_unit(text: str) -> str:
    """Return a unit in symbols that `parse_quantity` knows, pixels as ``px``.

    Examples
    --------
    >>> words_of_unit("meters second-1"), words_of_unit("pixel/frame"), words_of_unit("m.s-1")
    ('m s-1', 'px/frame', 'm s-1')
    """
    # UDUNITS joins with dots.
    return re.sub(
        r"[A-Za-z]+", lambda word: _WORDS.get(word[0].lower(), word[0]), text.replace(".", " ")
    ).strip()


def factor_to(unit: str, wanted: str) -> float:
    """Return the factor from a unit, in the words of `words_of_unit`, to one in SI.

    Raises
    ------
    InputError
        When it is no such unit, or degrees.
    """
    if _DEGREES.fullmatch(unit.split(" ")[0]):
        raise InputError(
            "the positions are degrees of longitude and latitude: project the field to metres "
            "first, for example with pyproj"
        )
    word = re.match(r"[A-Za-z]*", unit)
    if word is not None and word[0].lower() in _IMPERIAL:
        return _IMPERIAL[word[0].lower()] * factor_to(f"m{unit[word.end() :]}", wanted)
    try:
        return parse_quantity(f"1 {unit}", wanted)
    except ConfigurationError as error:
        raise InputError(str(error)) from error
