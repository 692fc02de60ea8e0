"""Time stamps of ISO 8601 to the nanosecond, and times of day across midnight."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Bools, Codes, Floats, Integers
from driftwalk.record.raw import MISSING, Array

Ticks = Integers
Texts = npt.NDArray[np.bytes_]

SECOND_NS: Final = 1_000_000_000
"""Nanoseconds of a second."""
DAY_NS: Final = 86_400 * SECOND_NS
"""Nanoseconds of a day without a leap second, as in POSIX time."""
_BYTES: Final = 201
"""More bytes than a time stamp has, of some 40 as a rule; chosen by hand."""
NO_TIME: Final = int(np.iinfo(np.int64).min)
"""In place of the nanoseconds of a row without a time."""

MOMENT: Final = "moment"
OF_DAY: Final = "time of day"
UTC: Final = "UTC"
LOCAL: Final = "local"
DAY: Final = "day"

_REST: Final = r":(?P<minute>\d\d)(?::(?P<second>\d\d)(?:[.,](?P<fraction>\d+))?)?"
_TIME: Final = rf"(?P<hour>\d\d){_REST}"
_HALF: Final = rf"(?P<hour>\d{{1,2}}){_REST} ?(?P<half>[AaPp])\.?[Mm]\.?"
"""A time of day that counts twelve hours twice."""
_DATES: Final = (
    r"(?P<year>\d{4})-(?P<month>\d\d)-(?P<day>\d\d)",
    r"(?P<year>\d{4})/(?P<month>\d\d)/(?P<day>\d\d)",
    r"(?P<day>\d\d)\.(?P<month>\d\d)\.(?P<year>\d{4})",  # calendars in German and others
)
_ZONE: Final = r"(?: ?(?P<zone>[Zz]|[+-](?P<zone_hour>\d\d)(?::?(?P<zone_minute>\d\d))?))?"
_MOMENTS: Final = (
    *(re.compile(rf"{date}(?:[T ]{_TIME}{_ZONE})?") for date in _DATES),
    *(re.compile(f"{date} {_HALF}") for date in _DATES),
    re.compile(
        r"(?P<year>\d{4})(?P<month>\d\d)(?P<day>\d\d)T(?P<hour>\d\d)(?P<minute>\d\d)(?P<second>\d\d)"
        rf"(?:[.,](?P<fraction>\d+))?{_ZONE}"
    ),
)
_OF_DAY: Final = re.compile(
    r"(?P<hour>\d{1,4}):(?P<minute>\d\d):(?P<second>\d\d)(?:[.,](?P<fraction>\d+))?"
)
_HALF_DAY: Final = re.compile(_HALF)
_UNCLEAR: Final = re.compile(
    r"\d{1,2}/\d{1,2}/\d{2,4}.*|\d{1,2}-\d{1,2}-\d{2,4}.*|\d{1,2}\.\d{1,2}\.\d{2,4}.*"
    r"|\d{4}/\d.*|\d{1,3}:\d{2}(?:[.,]\d+)?"
    r"|\d{1,2}:\d\d:\d\d:\d+"  # a fourth part may count frames, hundredths or thousandths
)
"""Dates and times that can be read in more than one way."""


class RowError(ValueError):
    """Raised by a value that is not of the kind that its column has to be of."""

    def __init__(self, row: int, reason: str) -> None:
        super().__init__(reason)
        self.row = row
        """Row among those that were given, from 0."""


@dataclass(frozen=True)
class StampForm:
    """How a time stamp is written."""

    kind: str
    """``MOMENT``, ``OF_DAY``, or ``""`` of one that can be read in several ways."""
    has_time: bool = True
    """Whether it has a time of day."""


def stamp_form(text: str) -> StampForm | None:
    """Return how a time stamp is written, None of any other text.

    Examples
    --------
    >>> stamp_form("2024-05-01")
    StampForm(kind='moment', has_time=False)
    """
    if (match := _match(text)) is not None:
        return StampForm(_kind(match), match["hour"] is not None)
    return StampForm("") if _UNCLEAR.fullmatch(text) else None


def _match(text: str) -> re.Match[str] | None:
    matches = (form.fullmatch(text) for form in (*_MOMENTS, _OF_DAY, _HALF_DAY))
    return next((match for match in matches if match is not None), None)


def _kind(match: re.Match[str]) -> str:
    return MOMENT if "year" in match.re.groupindex else OF_DAY


class StampReader:
    """Turns the time stamps of a column into whole nanoseconds, block by block.

    The first stamp decides the kind, and whether there is a zone; those after it have to agree.
    """

    dtype: Final = f"S{_BYTES}"
    """Type of a column of stamps in pandas, which then makes no object of each of them."""

    def __init__(self, *, zoned: bool = False) -> None:
        self.kind = ""
        """``MOMENT`` or ``OF_DAY``, ``""`` as long as there was no stamp."""
        self.zoned = zoned

    @property
    def calendar(self) -> str:
        """Origin of the nanoseconds: 1970 in ``UTC`` or in a ``LOCAL`` zone, or a ``DAY``."""
        if self.kind == OF_DAY:
            return DAY
        return UTC if self.zoned else LOCAL

    def read(self, texts: npt.NDArray[Any]) -> Ticks:
        """Return nanoseconds since 1970, or since midnight; `NO_TIME` where there is no stamp.

        Parameters
        ----------
        texts : array of str or bytes, shape (n,)
            Time stamps without blanks around them, or words for a missing one; bytes are UTF-8, and
            of a longer text no more than `dtype` holds.

        Raises
        ------
        RowError
            At a text that is no stamp, or of another kind than the first.
        """
        if texts.dtype.kind != "S":
            starts = [text[:_BYTES].encode("utf-8", "replace") for text in texts.tolist()]
            texts = np.array(starts, dtype="S")
        ascii_texts = _ascii(np.ascontiguousarray(texts))
        found = np.full(ascii_texts.size, NO_TIME, dtype=np.int64)
        for rows in _of_one_shape(ascii_texts):
            first = ascii_texts[rows[0]].decode()
            if first not in MISSING:
                match = self._checked(first, int(rows[0]))
                found[rows] = _nanoseconds(ascii_texts[rows], match, rows)
        return found

    def _checked(self, text: str, row: int) -> re.Match[str]:
        """Return the parts of a stamp that is like those before it."""
        match = _match(text)
        if match is None:
            raise RowError(row, f"'{text:.40}' is no time stamp{how_to_write(text)}")
        kind = _kind(match)
        zoned = match.groupdict().get("zone") is not None
        if not self.kind:
            self.kind, self.zoned = kind, zoned
        if kind != self.kind:
            raise RowError(row, f"'{text}' is a {kind}, and the first time is a {self.kind}")
        if zoned != self.zoned:
            other, own = ("no zone", "a zone") if self.zoned else ("a zone", "no zone")
            raise RowError(row, f"'{text}' has {other}, and the first time has {own}")
        return match


def how_to_write(text: str) -> str:
    """Return what to do about a date or time that can be read in several ways, ``""`` of others.

    Examples
    --------
    >>> how_to_write("5/1/2024")
    ': it can be read in several ways, so write it as 2024-05-31T13:30:00 or 13:30:00'
    """
    if text.count(":") == 3:
        return (
            ": its last part may be frames, hundredths or thousandths, so write it as 13:30:00.25"
        )
    if _UNCLEAR.fullmatch(text) is None:
        return ""
    return ": it can be read in several ways, so write it as 2024-05-31T13:30:00 or 13:30:00"


def _ascii(texts: Texts) -> Texts:
    """Return texts in an array as wide as the longest of them; a word that is no ASCII is empty."""
    letters = texts.view(np.uint8).reshape(texts.size, -1)
    highest = letters.max(axis=0, initial=0)
    if highest.max() > 127 or highest[_BYTES - 1 :].any():
        texts = texts.copy()
        wrong = (letters > 127).any(axis=1) | letters[:, _BYTES - 1 :].any(axis=1)
        for row in np.flatnonzero(wrong).tolist():
            text = texts[row].decode("utf-8", "ignore")
            if text not in MISSING:
                raise RowError(row, f"'{text:.40}' is no time stamp")
            texts[row] = b""
    return texts.astype(f"S{1 + np.flatnonzero(highest).max(initial=0)}")


def _of_one_shape(texts: Texts) -> list[Integers]:
    """Return the rows of each class of texts that differ in their digits alone, as they come."""
    if not texts.size:
        return []
    letters = texts.view(np.uint8).reshape(texts.size, -1)
    digits = letters - np.uint8(ord("0")) < 10  # those before "0" are the largest numbers
    shapes = np.ascontiguousarray(np.where(digits, np.uint8(ord("0")), letters))
    if (shapes == shapes[0]).all():
        return [np.arange(texts.size)]
    words = shapes.view(texts.dtype).ravel()
    _, first, codes = np.unique(words, return_index=True, return_inverse=True)
    return [np.flatnonzero(codes == at) for at in np.argsort(first)]


def _nanoseconds(texts: Texts, match: re.Match[str], rows: Integers) -> Ticks:
    """Return the nanoseconds of texts whose parts stand at the places of those of the first."""
    letters = texts.view(np.uint8).reshape(texts.size, -1)

    def part(name: str, digits: int = 0) -> Ticks:
        # Decimals of a second beyond nine are left out.
        places = range(*match.span(name))[:9] if name in match.re.groupindex else range(0)
        number = np.zeros(texts.size, dtype=np.int64)
        for place in places:
            number = 10 * number + (letters[:, place] - np.int64(ord("0")))
        return np.asarray(number * 10 ** max(digits - len(places), 0))

    hour, minute, second = (part(name) for name in ("hour", "minute", "second"))
    wrong = (minute > 59) | (second > 59)
    if "half" in match.re.groupindex:
        wrong |= (hour < 1) | (hour > 12)
        hour = hour % 12 + (12 if match["half"] in "Pp" else 0)
    ticks: Ticks = SECOND_NS * (second + 60 * (minute + 60 * hour)) + part("fraction", 9)
    if _kind(match) == MOMENT:
        days, no_day = _days(part("year"), part("month"), part("day"))
        offset = 60 * (part("zone_minute") + 60 * part("zone_hour"))
        wrong |= no_day | (hour > 23) | (part("zone_minute") > 59) | (part("zone_hour") > 23)
        # This fits in 64 bits, because the years of a valid day do.
        ticks += DAY_NS * np.where(no_day, 0, days)
        zone = match.groupdict().get("zone") or ""
        ticks -= SECOND_NS * offset * (-1 if zone.startswith("-") else 1)
    if wrong.any():
        at = int(np.argmax(wrong))
        raise RowError(int(rows[at]), f"'{texts[at].decode()}' is not a valid date and time")
    return ticks


def _days(year: Ticks, month: Ticks, day: Ticks) -> tuple[Ticks, Bools]:
    """Return days since 1970, and where there is no such day."""
    wrong = (year < 1678) | (year > 2261) | (month < 1) | (month > 12) | (day < 1)
    months = np.where(wrong, 0, 12 * (year - 1970) + month - 1).astype("datetime64[M]")
    days = months.astype("datetime64[D]") + (day - 1)
    wrong |= days.astype("datetime64[M]") != months
    return np.asarray(days.astype(np.int64)), wrong


def calendar_of(readers: list[StampReader]) -> str:
    """Return what the sum of the columns that were read counts from, ``""`` where there are none.

    Examples
    --------
    >>> calendar_of([])
    ''
    """
    found = [reader.calendar for reader in readers]
    return next((calendar for calendar in found if calendar != DAY), found[0] if found else "")


def clock_of_stamps(columns: list[Ticks], origin: int | None) -> tuple[Floats, int | None]:
    """Return the sum of columns of time stamps from an origin on [ns], and that origin.

    Parameters
    ----------
    columns : list of array, shape (n,)
        Nanoseconds, as `StampReader.read` returns them; of several the first are dates.
    origin : int or None
        Nanoseconds to subtract; None: the first that there are.

    Raises
    ------
    RowError
        When a date has its own time of day and times have a column of their own.

    Examples
    --------
    >>> clock_of_stamps([np.array([7, 9])], None)
    (array([0., 2.]), 7)
    """
    if len(columns) > 1:
        late = (columns[0] != NO_TIME) & (columns[0] % DAY_NS != 0)
        if late.any():
            row = int(np.argmax(late))
            raise RowError(row, "a date has a time itself, and times have a column of their own")
    known = np.all([ticks != NO_TIME for ticks in columns], axis=0)
    total = np.sum(columns, axis=0, where=known[None, :])
    if origin is None and known.any():
        origin = int(total[np.argmax(known)])
    return np.where(known, total - (origin or 0), np.nan), origin


def moment_text(nanoseconds: int, calendar: str) -> str:
    """Return a moment as ISO 8601 writes it, with as many decimals as it has.

    Examples
    --------
    >>> moment_text(1714566600250000000, "UTC")
    '2024-05-01T12:30:00.25Z'
    """
    seconds, fraction = divmod(nanoseconds, SECOND_NS)
    text = str(np.datetime64(seconds, "s"))
    decimals = f".{fraction:09d}".rstrip("0") if fraction else ""
    return f"{text}{decimals}{'Z' if calendar == UTC else ''}"


def count_days(clock: Array, codes: Codes | None) -> None:
    """Add a day to times of day after each midnight, in place.

    Rows of several bodies that take turns are in the order of their times: midnight is the same row
    for all. Where bodies stand one below the other, each has its own midnights.

    Parameters
    ----------
    clock : array, shape (n,)
        The clock of all rows, in nanoseconds since midnight.
    codes : array of int32, shape (n,), optional
        Index of each row's body, from 0 on; None: all share the clock.
    """
    changes = np.flatnonzero(np.diff([] if codes is None else codes)) + 1
    in_turns = codes is not None and changes.size > codes.max()
    for part in [clock] if in_turns else np.split(clock, changes):
        count_on(part, DAY_NS)


def count_on(clock: Array, period: float) -> None:
    """Let a clock that starts over after each period count on, in place.

    A step back by more than half a period is a start.

    Parameters
    ----------
    clock : array, shape (n,)
        Times since the last start, NaN where there is no time.
    period : float
        In the unit of the clock.

    Examples
    --------
    >>> clock = np.array([23.0, 1.0])
    >>> count_on(clock, 24.0)
    >>> clock.tolist()
    [23.0, 25.0]
    """
    known = np.flatnonzero(np.isfinite(clock))
    clock[known[1:]] += period * np.cumsum(np.diff(clock[known]) < -0.5 * period)
