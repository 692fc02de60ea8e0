"""Column reading: what each column of a table was taken for, in which unit, and why."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.core.text.argument_text import argument_text
from driftwalk.core.text.did_you_mean import listed
from driftwalk.record.column_names import (
    OF_BODY,
    QUATERNION,
    ColumnMeaning,
    column_meaning,
    unit_of_name,
)
from driftwalk.record.raw import MISSING, ReadOptions
from driftwalk.record.tables.boxes import Box, find_box
from driftwalk.record.tables.source import TableSource
from driftwalk.record.tables.stamps import OF_DAY
from driftwalk.record.vocabulary import (
    ALLOWED,
    FRONT,
    MIDDLE,
    REAR,
    ROOTS,
    SETPOINTS,
    UNITS,
    VARIANTS,
)

_SKIP: Final = "skip"
LEFT_OUT: Final = "you left it out"
_OTHER_BODY: Final = "what it was to do, or what moved it: no body where another is"
_SAME_BODY: Final = "the same body, before or after a computation"
_WORDS: Final = {"t": "time", "t+": "fraction of the time", "frame": "frame number", "w": "width"}
_WORDS_MORE: Final = {"h": "height", "theta": "orientation", "body": "name of the body"}


@dataclass
class ColumnReading:
    """What one column was taken for."""

    name: str
    role: str = ""
    """A quantity of `ALLOWED`, ``"t+"``, or ``""``: it is not read."""
    body: str = ""
    unit: str = ""
    """Of `UNITS`; ``""`` where nothing names it."""
    why: str = "its name says nothing that is known"

    def described(self) -> dict[str, str]:
        """Return the reading for people."""
        words = {**_WORDS, **_WORDS_MORE}.get(self.role, self.role)
        meaning = f"{words} of '{self.body}'" if self.body and words else words
        return {
            "column": self.name,
            "meaning": meaning or "not read",
            "unit": self.unit,
            "why": self.why,
        }


@dataclass
class TableReading:
    """What the columns (from 0) of a table were taken for, as the reader executes it."""

    columns: list[ColumnReading]
    bodies: dict[str, dict[str, int]] = field(default_factory=dict)
    """Body to quantity (x, y, theta, ..., sides of a box) to column."""
    numbers: tuple[int, ...] = ()
    """The clock: one column of numbers, or seconds and their fraction; empty: none, or stamps."""
    stamps: tuple[int, ...] = ()
    """The clock: time stamps, or dates and times of day."""
    clock_unit: str = "frame"
    bare_clock: bool = False
    """Whether the clock has times of an unnamed unit."""
    body_column: int | None = None
    length_unit: str = ""
    angle_unit: str = ""
    bare: bool = True
    """Whether the names of positions are plain symbols, which mean metres beside seconds."""
    box: Box | None = None
    parts: tuple[str, str] | None = None
    """Two bodies that are the middle and the front of one."""
    notes: list[str] = field(default_factory=list)

    @property
    def clock(self) -> int | None:
        """The column whose values are the clock's once the table is read."""
        return next(iter((*self.stamps, *self.numbers)), None)


def read_columns(
    source: TableSource, options: ReadOptions, *, lenient: bool = False
) -> TableReading:
    """Return what each column of a table is, by its names, its first rows and what the user says.

    Parameters
    ----------
    source : TableSource
        Names of the columns, units below them, and the first rows.
    options : ReadOptions
        What is known about the table.
    lenient : bool
        Whether a unit that is not known is no error, as in the search for the names.

    Raises
    ------
    InputError
        When a column is missing, named twice, does not exist, or cannot be decided.
    """
    return _Reader(source, options, lenient=lenient).reading()


class _Reader:
    """The columns of a table as far as they are decided."""

    def __init__(self, source: TableSource, options: ReadOptions, *, lenient: bool) -> None:
        self._source, self._options, self._lenient = source, options, lenient
        self._names, self._below = source.names, source.units or [""] * len(source.names)
        labels = [name or str(at) for at, name in enumerate(self._names, start=1)]
        self._result = TableReading([ColumnReading(label) for label in labels])
        self._chosen = {key: one for key, one in options.columns.items() if key != _SKIP}
        pairs = zip(self._names, self._below, strict=True)
        known = [column_meaning(name, unit) for name, unit in pairs]
        self._meanings = {at: one for at, one in enumerate(known) if one is not None}

    def reading(self) -> TableReading:
        """Return the reading."""
        self._choose()
        box = find_box(self._source, self._options, self._meanings, self._chosen)
        if box is not None:
            self._drop((at for at in box.replaced), box.why)
            self._result.box = box if box.sides else None
            self._result.notes += box.notes
        self._leave_out_other_pairs()
        self._refuse_unknown_units()
        self._find_bodies()
        self._find_clock()
        self._find_units()
        self._describe()
        return self._result

    def _drop(self, columns: Iterable[int], why: str) -> None:
        for at in list(columns):
            self._meanings.pop(at, None)
            self._result.columns[at].why = why

    def _choose(self) -> None:
        """Take the columns that the user names for what they are said to be."""
        skipped = self._options.columns.get(_SKIP, "")
        for name in filter(None, skipped.split("+")):
            index, _ = self._find(name, _SKIP)
            self._drop([index], LEFT_OUT)
        for quantity, reference in self._chosen.items():
            first, *more = self._references(reference, quantity)
            for part, (index, unit) in zip((quantity, "t+"), (first, *more), strict=False):
                if unit and unit not in ALLOWED[quantity]:
                    raise InputError(
                        f"{argument_text('columns', {quantity: reference})}: '{unit}' is not a "
                        f"unit of {quantity}"
                    )
                known = self._meanings.get(index)
                kept = {
                    other: meaning
                    for other, meaning in self._meanings.items()
                    if meaning.quantity != part and other != index
                }
                stated = self._unit_of(index)
                inferred = stated if stated in ALLOWED[quantity] else ""
                unknown = known.unknown if known and not unit and known.quantity == quantity else ""
                kept[index] = ColumnMeaning(
                    part, unit or inferred, "", bool(known and known.bare), unknown, rank=-1
                )
                self._meanings = kept
                self._result.columns[index].why = "you named it"

    def _unit_of(self, at: int) -> str:
        """Return the unit of any column, as its name or the row below states it."""
        below = self._below[at]
        return unit_of_name(f"_ {below}") if below else unit_of_name(self._names[at])

    def _references(self, reference: str, quantity: str) -> list[tuple[int, str]]:
        """Return the columns that are named; of a time there may be two, with a plus between."""
        try:
            return [self._find(reference, quantity)]
        except InputError:
            parts = reference.split("+")
            if quantity != "t" or len(parts) != 2:
                raise
            return [self._find(part, quantity) for part in parts]

    def _find(self, reference: str, quantity: str) -> tuple[int, str]:
        names = self._names
        if quantity not in ALLOWED and quantity != _SKIP:
            raise InputError(
                f"{argument_text('columns', {quantity: reference})}: unknown quantity; name "
                f"{', '.join([*ALLOWED, _SKIP])}"
            )
        with_units = [f"{name} [{unit}]" for name, unit in zip(names, self._below, strict=True)]
        with_marks = [f"{name} {unit}" for name, unit in zip(names, self._below, strict=True)]
        for text, unit in ((reference, ""), reference.rpartition(":")[::2]):
            for known in (names, with_units, with_marks):
                if text in known:
                    return known.index(text), UNITS.get(unit.lower(), unit)
            if text.isdecimal() and 1 <= int(text) <= len(names):
                return int(text) - 1, UNITS.get(unit.lower(), unit)
        raise InputError(
            f"{argument_text('columns', {quantity: reference})}: no such column; the file has "
            f"{len(names)}: {_shown(names)}"
        )

    def _bodies(self, quantity: str = "x") -> dict[str, int]:
        """Return the names of the bodies that have a quantity, and its column."""
        return {one.body: at for at, one in self._meanings.items() if one.quantity == quantity}

    def _leave_out_other_pairs(self) -> None:
        """Leave out pairs that are no body, or a body once more, where another pair is."""
        bodies = [body for body in self._bodies("x") if body in self._bodies("y")]
        kinds = {one.body: _kinds(one.body) for one in self._meanings.values() if one.body}
        real = [body for body in bodies if body not in kinds or not any(kinds[body])]
        setpoints = [body for body in bodies if body in kinds and kinds[body][0]]
        variants = [
            body for body in bodies if body in kinds and kinds[body][1] and not kinds[body][0]
        ]
        left = dict.fromkeys(setpoints, _OTHER_BODY) if real or variants else {}
        if self._result.box is not None:
            left = dict.fromkeys(setpoints, _OTHER_BODY)
        if len(setpoints) > 1 and not left and not self._lenient:
            raise InputError(self._one_of([f"x_{body}" for body in setpoints], setpoints))
        of_base: dict[str, list[str]] = {}
        for body in variants:
            of_base.setdefault(_base(body), []).append(body)
        for base, several in of_base.items():
            if base in real or (not base and self._result.box is not None):
                left |= dict.fromkeys(several, _SAME_BODY)
            elif len(several) > 1 and not self._lenient:
                raise InputError(self._one_of([], several))
        for body, kind in kinds.items():
            # An angle of a setpoint stands alone where its position has other names.
            if kind[0] and body not in bodies:
                left[body] = _OTHER_BODY
            if kind[1] and body not in bodies and _base(body) in self._bodies("theta"):
                left[body] = _SAME_BODY
        for body, why in left.items():
            self._drop([at for at, one in self._meanings.items() if one.body == body], why)
        named = [body for body in left if body in bodies]
        if named:
            self._result.notes.append(
                f"pairs of x and y that are read as no body: {listed(named)} (name one by "
                f"{argument_text('columns', {'x': 'NAME', 'y': 'NAME'})} if it is the one)"
            )

    def _one_of(self, _names: list[str], bodies: list[str]) -> str:
        columns = self._bodies("x")
        found = [self._names[columns[body]] for body in bodies]
        other = {"x": found[0], "y": self._names[self._bodies("y")[bodies[0]]]}
        return (
            f"{listed([repr(name) for name in found])} hold one body more than once, or none: name "
            f"the one to read, as in {argument_text('columns', other)}"
        )

    def _refuse_unknown_units(self) -> None:
        """Refuse positions, angles and times whose unit is none that is known."""
        options = self._options
        stated = options.length_unit is not None or options.metres_per_pixel is not None
        unknown = {at: one for at, one in self._meanings.items() if one.unknown}
        for at, meaning in unknown.items():
            length = meaning.quantity in ("x", "y", "z")
            if (length and stated) or self._lenient:
                continue
            same = [
                other
                for other, one in self._meanings.items()
                if (one.quantity, one.body) == (meaning.quantity, meaning.body) and not one.unknown
            ]
            if (
                same
                or meaning.quantity == "z"
                or (meaning.quantity == "t" and self._bodies("frame"))
            ):
                self._drop([at], f"'{meaning.unknown}' is no unit that is known")
                continue
            raise InputError(self._no_unit(at, meaning.unknown))
        if stated or self._lenient:
            return
        bodies = self._bodies("y")
        pairs = {
            at: one
            for at, one in self._meanings.items()
            if one.quantity in ("x", "y") and one.body in bodies
        }
        words = {one.ending for one in pairs.values()}
        word = next(iter(words)) if len(words) == 1 else ""
        if _may_be_unit(word) and not any(one.unit for one in pairs.values()):
            raise InputError(
                self._no_unit(next(iter(pairs)), word)
                + "; if it names the body, state the unit of its positions with `length_unit`"
            )

    def _no_unit(self, at: int, word: str) -> str:
        quantity = self._meanings[at].quantity
        allowed = ", ".join(sorted(ALLOWED[quantity]))
        choice = argument_text("columns", {quantity: f"{self._names[at]}:UNIT"})
        return (
            f"'{word}' in column '{self._names[at]}' is no unit that is known: say which of "
            f"{allowed} it is, as in {choice}"
        )

    def _find_bodies(self) -> None:
        """Put the columns of each body together, and refuse what is ambiguous."""
        self._leave_out_the_third_axis()
        places: dict[str, dict[str, int]] = {}
        for at, meaning in sorted(self._meanings.items()):
            if meaning.quantity not in OF_BODY or meaning.quantity == "confidence":
                continue
            own = places.setdefault(meaning.body, {})
            if meaning.quantity in own:
                raise InputError(self._both(own[meaning.quantity], at, meaning.quantity))
            own[meaning.quantity] = at
        bodies = {
            body: columns
            for body, columns in places.items()
            if {"x", "y"} <= set(columns) or {"lon", "lat"} <= set(columns)
        }
        if any({"x", "y"} <= set(columns) for columns in bodies.values()):
            bodies = {body: one for body, one in bodies.items() if {"x", "y"} <= set(one)}
        box = self._result.box
        if box is not None and (not bodies or not {"x", "y"} <= set(box.sides)):
            name = next((body for body in bodies if not body), "")
            bodies = {name: {**places.get(name, {}), **box.sides}}
        elif box is not None and len(bodies) == 1:
            bodies = {name: {**one, **box.sides} for name, one in bodies.items()}
        if not bodies:
            raise InputError(
                f"no columns of x and y among {_shown(self._names)}: name them with "
                '`columns={"x": "NAME", "y": "NAME"}` (or their numbers, from 1)'
            )
        if len(bodies) == 1:
            self._add_loose_angle(next(iter(bodies.values())), places, set(bodies))
        self._result.bodies = bodies
        self._result.body_column = self._single("body")
        self._find_parts()
        if self._options.min_confidence is not None:
            self._find_confidences()

    def _leave_out_the_third_axis(self) -> None:
        """Leave out heights that nobody asks for, and parts of quaternions that are not whole."""
        meanings = self._meanings
        turned = {body for body in {one.body for one in meanings.values()} if self._is_turned(body)}
        parts = [at for at, one in meanings.items() if one.quantity in QUATERNION]
        loose = [at for at in parts if meanings[at].body not in turned]
        self._drop(loose, "no whole quaternion, or an angle beside it")
        if self._options.up is None:
            height = [at for at, one in meanings.items() if one.quantity == "z"]
            self._drop(height, "height: the plane of the water is x, y without `up`")

    def _is_turned(self, body: str) -> bool:
        """Whether a body has a quaternion and no angle; half of a chosen quaternion is refused."""
        own = [one.quantity for one in self._meanings.values() if one.body == body]
        whole = all(own.count(part) == 1 for part in QUATERNION)
        if not whole and any(part in self._chosen for part in QUATERNION):
            raise InputError(
                'an orientation in space has four parts: name each with `columns={"qx": "NAME"}`, '
                "qy, qz and qw"
            )
        return whole and "theta" not in own

    def _add_loose_angle(
        self, only: dict[str, int], places: dict[str, dict[str, int]], bodies: set[str]
    ) -> None:
        """Give the only body an orientation that stands without its number: x1, y1, heading."""
        loose = [
            one["theta"] for body, one in places.items() if body not in bodies and "theta" in one
        ]
        if "theta" in only or not loose:
            return
        if len(loose) > 1:
            names = listed([repr(self._names[at]) for at in loose])
            choice = argument_text("columns", {"theta": self._names[loose[0]]})
            self._result.notes.append(
                f"no orientation is read of {names}: name one, as in {choice}"
            )
            return
        meaning = self._meanings[loose[0]]
        if _may_be_unit(meaning.ending) and meaning.body == meaning.ending and not self._lenient:
            raise InputError(self._no_unit(loose[0], meaning.body))
        only["theta"] = loose[0]

    def _find_parts(self) -> None:
        """Find the middle and the front of one body among bodies that are its parts."""
        bodies = self._result.bodies
        lower = {body.lower(): body for body in bodies}
        if (
            len(lower) < 2
            or set(lower) - MIDDLE - FRONT - REAR
            or self._options.heading is not None
        ):
            return
        middle = [body for name, body in lower.items() if name in MIDDLE]
        front = [body for name, body in lower.items() if name in FRONT]
        if len(middle) == len(front) == 1 and not any("theta" in one for one in bodies.values()):
            self._result.parts = (middle[0], front[0])
            names = [self._names[bodies[body]["x"]] for body in self._result.parts]
            self._result.notes.append(
                f"'{names[0]}' and '{names[1]}' are read as the middle and the front of one body, "
                "whose orientation is the direction between them"
            )

    def _find_confidences(self) -> None:
        """Give each body the column of its confidence."""
        found: dict[str, list[int]] = {}
        for at, one in self._meanings.items():
            if one.quantity == "confidence":
                found.setdefault(one.body, []).append(at)
        for body, places in self._result.bodies.items():
            own = found.get(body) or found.get("", [])
            if len(own) > 1:
                raise InputError(self._both(own[0], own[1], "confidence"))
            if own:
                places["confidence"] = own[0]

    def _both(self, first: int, second: int, quantity: str) -> str:
        return (
            f"columns '{self._names[first]}' and '{self._names[second]}' could both be "
            f"{quantity}: name one with {argument_text('columns', {quantity: 'NAME'})}"
        )

    def _single(self, quantity: str) -> int | None:
        """Return the column of a quantity that a table has once, None where there is none."""
        found = [(one.rank, at) for at, one in self._meanings.items() if one.quantity == quantity]
        if not found:
            return None
        found.sort()
        rank, at = found[0]
        rivals = [other for other_rank, other in found[1:] if other_rank == rank]
        alike = rank > 1 and (
            self._lenient or (quantity == "t" and rivals and self._run_together(at, rivals[0]))
        )
        if rivals and not alike:
            raise InputError(self._both(at, rivals[0], quantity))
        name = self._result.columns[at].name
        self._drop((other for _, other in found[1:]), f"'{name}' is the {quantity} that counts")
        return at

    def _run_together(self, first: int, second: int) -> bool:
        """Whether two clocks differ by the same in the first rows."""
        texts = [(row[first], row[second]) for row in self._source.sample() if len(row) > second]
        try:
            values = np.array(
                [[float(one.replace(",", ".")) for one in pair] for pair in texts if "" not in pair]
            )
        except ValueError:
            return False
        return values.size > 0 and float(np.ptp(values[:, 1] - values[:, 0])) <= 1e-9 + 1e-3

    def _find_clock(self) -> None:
        """Find the clock: frames, numbers, seconds and their fraction, or time stamps."""
        result, source = self._result, self._source
        frame, time, part = (self._single(quantity) for quantity in ("frame", "t", "t+"))
        date = self._single("date")
        if time is None and part is not None:
            time, part = part, None
            self._meanings[time] = replace(self._meanings[time], quantity="t")
        if frame is not None and (time is None or self._options.frame_rate_hz is not None):
            result.numbers = (frame,)
            if time is not None:
                self._drop([time], "frames are counted, because their rate is given")
            return
        if frame is not None:
            self._drop([frame], "the table has times")
        form = None if time is None else source.stamps(time)
        if time is not None and form is None:
            meaning = self._meanings[time]
            result.clock_unit, result.numbers = meaning.unit or "s", (time,)
            result.bare_clock = not meaning.unit
            if part is not None and (
                part in self._chosen_columns() or self._is_fraction(time, part)
            ):
                result.numbers = (time, part)
            if meaning.rank == 0 and not meaning.unit and self._is_of_ros(time):
                result.clock_unit, result.bare_clock = "ns", False
                self._meanings[time] = replace(meaning, unit="ns")
            return
        date_form = None if date is None else source.stamps(date)
        if time is None:
            result.stamps = () if date is None or date_form is None else (date,)
        elif (
            form is not None and form.kind == OF_DAY and date is not None and date_form is not None
        ):
            # A date that has its own time of day says all.
            result.stamps = (date,) if date_form.kind and date_form.has_time else (date, time)
        else:
            result.stamps = (time,)
        if result.stamps:
            result.clock_unit = "ns"

    def _chosen_columns(self) -> set[int]:
        return {at for at, one in self._meanings.items() if one.rank < 0}

    def _sampled(self, column: int) -> list[str]:
        rows = (row[column] for row in self._source.sample() if len(row) > column)
        return [one for one in rows if one not in MISSING]

    def _is_fraction(self, time: int, part: int) -> bool:
        """Whether a column holds less than a second, beside whole seconds."""
        whole = all(one.lstrip("-").isdecimal() for one in self._sampled(time))
        ticks = {"ns": 9, "us": 6, "ms": 3}.get(self._meanings[part].unit, 0)
        parts = self._sampled(part)
        return whole and all(one.isdecimal() and int(one) < 10**ticks for one in parts)

    def _is_of_ros(self, time: int) -> bool:
        """Whether the stamp of a header counts whole nanoseconds since 1970."""
        first = next(iter(self._sampled(time)), "")
        return first.isdecimal() and len(first) >= 18

    def _find_units(self) -> None:
        result = self._result
        lengths = ("x", "y", "z")
        used = {at for one in result.bodies.values() for at in one.values()}
        wanted = [
            one for at, one in self._meanings.items() if one.quantity in lengths and at in used
        ]
        units = [one.unit for one in wanted]
        if result.box is not None:
            units += result.box.units
        result.length_unit = _agreed(units, "positions")
        angles = [
            one for at, one in self._meanings.items() if one.quantity == "theta" and at in used
        ]
        result.angle_unit = _agreed([one.unit for one in angles], "angles") if angles else ""
        result.bare = all(one.bare for one in wanted) and (result.box is None or bool(wanted))

    def _describe(self) -> None:
        """Write down what each column was taken for."""
        result = self._result
        used = {at: body for body, one in result.bodies.items() for at in one.values()}
        sides = {} if result.box is None else {at: side for side, at in result.box.sides.items()}
        clock = {*result.numbers, *result.stamps}
        for at, column in enumerate(result.columns):
            meaning = self._meanings.get(at)
            if at not in used and at not in clock and at != result.body_column:
                column.unit = self._unit_of(at)
                if meaning is not None and meaning.quantity == "confidence":
                    column.why = "confidence, of use with `min_confidence`"
                elif meaning is not None:
                    column.why = "no pair of x and y, or no body, goes with it"
                continue
            column.role = sides.get(at, meaning.quantity if meaning else "")
            column.body = used.get(at, "")
            column.unit = meaning.unit if meaning else ""
            if column.why != "you named it":
                column.why = "by its name"
                if at in sides and result.box is not None:
                    column.why = f"by its name: a side of a box ({result.box.form})"
            column.why += self._why_unit(at, column)

    def _why_unit(self, at: int, column: ColumnReading) -> str:
        if at in self._result.stamps:
            column.unit = "time stamp"
            return ""
        if column.unit and self._below[at]:
            return "; unit from the row below the names"
        if column.unit and unit_of_name(self._names[at]) == column.unit:
            return "; unit from its name"
        options, length = (
            self._options,
            column.role in ("x", "y", "z", "x1", "y1", "x2", "y2", "w", "h"),
        )
        if not column.unit and length:
            if options.length_unit or options.metres_per_pixel is not None:
                column.unit = options.length_unit or "px"
                return "; unit as you stated it"
            if self._result.bare and self._result.clock_unit != "frame":
                column.unit = "m"
                return "; no unit named, so metres"
        elif not column.unit and column.role in ("t", "theta"):
            column.unit = {"t": "s", "theta": "rad"}[column.role]
            return f"; no unit named, so {column.unit}"
        return ""


def _kinds(body: str) -> tuple[bool, bool]:
    words = {word.lower().rstrip("0123456789") for word in body.split("_")}
    return bool(words & SETPOINTS), bool(words & VARIANTS)


def _base(body: str) -> str:
    """Return the name of a body without the words of a computation."""
    return "_".join(word for word in body.split("_") if word.lower() not in VARIANTS)


def _may_be_unit(word: str) -> bool:
    """Whether a word beside a coordinate may be a unit rather than the name of a body."""
    lower = word.lower()
    other = lower in VARIANTS or lower in SETPOINTS or lower in MIDDLE | FRONT | REAR
    return lower.isalpha() and len(lower) > 1 and not other and ROOTS.get(lower) != "body"


def _shown(names: list[str]) -> str:
    return ", ".join(repr(name) for name in names[:12]) + (", …" if len(names) > 12 else "")


def _agreed(units: list[str], what: str) -> str:
    distinct = sorted(set(units))
    if len(distinct) > 1:
        shown = ", ".join(unit or "none" for unit in distinct)
        raise InputError(f"the columns of {what} name different units ({shown}): name them alike")
    return distinct[0] if distinct else ""


def described(columns: list[ColumnReading]) -> list[dict[str, Any]]:
    """Return what columns were taken for, for people."""
    return [column.described() for column in columns]
