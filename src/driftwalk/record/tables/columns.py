"""Column readings of a table: bodies, boxes, clock and units, of names and first rows."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Final

import numpy as np

from driftwalk.core.errors import InputError, argument_text, listed
from driftwalk.record.column_names import OF_BODY, QUATERNION, unit_of_name
from driftwalk.record.raw import LENGTH_UNITS, MISSING, ReadOptions
from driftwalk.record.tables.boxes import find_box
from driftwalk.record.tables.date_stamps import OF_DAY
from driftwalk.record.tables.in_memory import TableSource
from driftwalk.record.tables.named_columns import (
    ColumnReading,
    NamedColumns,
    TableReading,
    may_be_unit,
    shown,
)
from driftwalk.record.unit_and_column_words import ALLOWED, FRONT, LENGTHS, MIDDLE, PARTS, REAR

_ON_GLOBE: Final = ("lon", "lat")


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
        Whether to accept unknown units, as in the search for the names.

    Raises
    ------
    InputError
        When a column is missing, named twice, does not exist, or cannot be decided.
    """
    return _Reader(source, options, lenient=lenient).reading()


class _Reader(NamedColumns):
    """The columns of a table as far as they are decided."""

    def reading(self) -> TableReading:
        """Return the reading."""
        self.choose()
        if (box := find_box(self.source, self.options, self.meanings, self.chosen)) is not None:
            words = ("bbox", "bb", "box")
            around = {at for at, one in self.meanings.items() if one.body.lower() in words}
            self.drop({*box.replaced} | (around - {*box.sides.values()}), box.why)
            self.result.box = box if box.sides else None
            self.result.notes += box.notes
        self.leave_out_other_pairs()
        self.refuse_unknown_units()
        self._find_bodies()
        self._find_clock()
        self._find_units()
        self._describe()
        return self.result

    def _find_bodies(self) -> None:
        """Put the columns of each body together, and refuse what is ambiguous."""
        self._leave_out_the_third_axis()
        places: dict[str, dict[str, int]] = {}
        for at, meaning in sorted(self.meanings.items()):
            if meaning.quantity not in OF_BODY or meaning.quantity == "confidence":
                continue
            own = places.setdefault(meaning.body, {})
            if meaning.quantity in own:
                raise InputError(self.both(own[meaning.quantity], at, meaning.quantity))
            own[meaning.quantity] = at
        on_plane = any({"x", "y"} <= set(one) for one in places.values())
        pair, other = (("x", "y"), _ON_GLOBE) if on_plane else (_ON_GLOBE, ())
        bodies = {
            body: {quantity: at for quantity, at in one.items() if quantity not in other}
            for body, one in places.items()
            if set(pair) <= set(one)
        }
        box = self.result.box
        if box is not None and (not bodies or not {"x", "y"} <= set(box.sides)):
            bodies = {"": {**places.get("", {}), **box.sides}}
        elif box is not None:
            if len(bodies) > 1:
                raise InputError(
                    f"a box stands next to several bodies, {listed([*map(repr, bodies)])}: leave "
                    'out what it does not surround by `columns={"skip": "NAME+NAME"}`, or add '
                    '`box="none"`'
                )
            bodies = {name: {**one, **box.sides} for name, one in bodies.items()}
        if not bodies:
            raise InputError(
                f"no columns of x and y among {shown(self.names)}: name them with "
                '`columns={"x": "NAME", "y": "NAME"}` (or their numbers, from 1)'
            )
        if len(bodies) == 1:
            self._add_loose_angle(next(iter(bodies.values())), places, set(bodies))
        self.result.bodies = bodies
        self.result.body_column = self._single("body")
        self._find_parts()
        if self.options.min_confidence is not None:
            self._find_confidences()

    def _leave_out_the_third_axis(self) -> None:
        """Leave out heights that are not asked for, and parts of quaternions that are not whole."""
        turned = self._turned()
        parts = {at: one for at, one in self.meanings.items() if one.quantity in QUATERNION}
        loose = [at for at, one in parts.items() if one.body not in turned]
        self.drop(loose, "part of an incomplete quaternion, or of one next to an angle")
        if self.options.up is None:
            height = [at for at, one in self.meanings.items() if one.quantity == "z"]
            self.drop(height, "height: the plane of the water is x, y without `up`")

    def _turned(self) -> set[str]:
        """Return bodies with a quaternion and no angle; half of a chosen quaternion is refused."""
        counts = Counter((one.body, one.quantity) for one in self.meanings.values())
        bodies = {body for body, _ in counts}
        whole = {one for one in bodies if all(counts[one, part] == 1 for part in QUATERNION)}
        if any(part in self.chosen for part in QUATERNION) and whole != bodies:
            raise InputError(
                'an orientation in space has four parts: name each with `columns={"qx": "NAME"}`, '
                "qy, qz and qw"
            )
        return {body for body in whole if not counts[body, "theta"]}

    def _add_loose_angle(
        self, only: dict[str, int], places: dict[str, dict[str, int]], bodies: set[str]
    ) -> None:
        """Give the only body an orientation that stands without its number: x1, y1, heading."""
        angles = {body: one["theta"] for body, one in places.items() if "theta" in one}
        loose = [at for body, at in angles.items() if body not in bodies]
        if "theta" in only or not loose:
            return
        if len(loose) > 1:
            names = listed([repr(self.names[at]) for at in loose])
            choice = argument_text("columns", {"theta": self.names[loose[0]]})
            self.result.notes.append(
                f"no orientation is read from {names}: name one, as in {choice}"
            )
            return
        meaning = self.meanings[loose[0]]
        stem = meaning.ending.rstrip("0123456789")
        doubted = may_be_unit(stem) or (stem and stem != meaning.ending)
        if doubted and meaning.body == meaning.ending and not self.lenient:
            raise InputError(self.no_unit(loose[0], meaning.body))
        only["theta"] = loose[0]

    def _find_parts(self) -> None:
        """Find the middle and the front of one body among bodies that are its parts."""
        bodies = self.result.bodies
        lower = {body.lower(): body for body in bodies}
        turned = any("theta" in one for one in bodies.values())
        if len(lower) < 2 or set(lower) - PARTS or self.options.heading is not None or turned:
            return
        middle = [body for name, body in lower.items() if name in MIDDLE]
        front = [body for name, body in lower.items() if name in FRONT]
        rear = [body for name, body in lower.items() if name in REAR]
        if len(middle) == 1 and len(front or rear) == 1:
            other, what = (front[0], "front") if front else (rear[0], "rear")
            start, end = (middle[0], other) if front else (other, middle[0])
            self.result.parts = (middle[0], start, end)
            names = [self.names[bodies[body]["x"]] for body in (middle[0], other)]
            self.result.notes.append(
                f"'{names[0]}' and '{names[1]}' are read as the middle and the {what} of one body, "
                "whose orientation is the direction between them"
            )
        elif len(front) == len(rear) == 1:
            heading = f"{rear[0]},{front[0]}"
            self.result.notes.append(
                f"'{rear[0]}' and '{front[0]}' are read as two bodies: if they are parts of one, "
                f"add {argument_text('heading', heading)}"
            )

    def _find_confidences(self) -> None:
        """Give each body the column of its confidence."""
        found = {at: one.body for at, one in self.meanings.items() if one.quantity == "confidence"}
        for body, places in self.result.bodies.items():
            own = [at for at, of in found.items() if of == body]
            own = own or [at for at, of in found.items() if not of]
            if len(own) > 1:
                raise InputError(self.both(own[0], own[1], "confidence"))
            if own:
                places["confidence"] = own[0]

    def _single(self, quantity: str) -> int | None:
        """Return the column of a quantity that a table has once, None where there is none."""
        own = [(one.rank, at) for at, one in self.meanings.items() if one.quantity == quantity]
        if not own:
            return None
        (rank, at), *others = sorted(own)
        if others and others[0][0] == rank:
            rival = others[0][1]
            alike = self.lenient or (quantity == "t" and self._run_together(at, rival))
            if rank <= 1 or not alike:
                raise InputError(self.both(at, rival, quantity))
        name = self.result.columns[at].name
        self.drop((other for _, other in others), f"'{name}' is read as {quantity} instead")
        return at

    def _run_together(self, first: int, second: int) -> bool:
        """Whether two clocks differ by a constant in the first rows, to 1e-3 and rounding."""
        pairs = [(row[first], row[second]) for row in self.source.sample() if len(row) > second]
        known = [pair for pair in pairs if "" not in pair]
        try:
            apart = [float(b.replace(",", ".")) - float(a.replace(",", ".")) for a, b in known]
        except ValueError:
            return False
        return bool(apart) and float(np.ptp(apart)) <= 1e-3 + 1e-9

    def _find_clock(self) -> None:
        """Find the clock: frames, numbers, seconds and their fraction, or time stamps."""
        result, source = self.result, self.source
        frame, time, part, date = map(self._single, ("frame", "t", "t+", "date"))
        if time is None and part is not None:
            time, part = part, None
            self.meanings[time] = replace(self.meanings[time], quantity="t")
        if frame is not None and (time is None or self.options.frame_rate_hz is not None):
            result.numbers = (frame,)
            if time is not None:
                self.drop([time], "the frames are the clock, because their rate is given")
            return
        if frame is not None:
            self.drop([frame], "the table has times")
        form = None if time is None else source.stamps(time)
        if time is not None and form is None:
            meaning = self.meanings[time]
            result.clock_unit, result.numbers = meaning.unit or "s", (time,)
            result.bare_clock = not meaning.unit
            chosen = part is not None and self.meanings[part].rank < 0
            if part is not None and (chosen or self._is_fraction(time, part)):
                result.numbers = (time, part)
            first = next(iter(self._sampled(time)), "")
            # The stamp of a header of ROS counts whole nanoseconds since 1970.
            if meaning.rank == 0 and not meaning.unit and first.isdecimal() and len(first) >= 18:
                result.clock_unit, result.bare_clock = "ns", False
                self.meanings[time] = replace(meaning, unit="ns")
            return
        date_form = None if date is None else source.stamps(date)
        dated = () if date is None or date_form is None else (date,)
        if time is None or form is None:
            result.stamps = dated
        elif form.kind == OF_DAY and date_form is not None:
            # A date with its own time of day needs no second column.
            result.stamps = dated if date_form.kind and date_form.has_time else (*dated, time)
        else:
            result.stamps = (time,)
        if result.stamps:
            result.clock_unit = "ns"

    def _sampled(self, column: int) -> list[str]:
        rows = (row[column] for row in self.source.sample() if len(row) > column)
        return [one for one in rows if one not in MISSING]

    def _is_fraction(self, time: int, part: int) -> bool:
        """Whether a column holds less than a second, next to whole seconds."""
        whole = all(one.lstrip("-").isdecimal() for one in self._sampled(time))
        most = 10 ** {"ns": 9, "us": 6, "ms": 3}.get(self.meanings[part].unit, 0)
        return whole and all(one.isdecimal() and int(one) < most for one in self._sampled(part))

    def _find_units(self) -> None:
        result = self.result
        used = {at for one in result.bodies.values() for at in one.values()}
        wanted = {at: one for at, one in self.meanings.items() if at in used}
        units = {at: one.unit for at, one in wanted.items() if one.quantity in tuple("xyz")}
        if result.box is not None:
            units |= dict(zip(result.box.sides.values(), result.box.units, strict=False))
        if result.box is not None and result.box.image is not None:
            width, height = result.box.image
            sides = result.box.sides.items()
            result.factors = {at: width if side[0] in "xw" else height for side, at in sides}
            result.length_unit = "px"
        elif units and set(units.values()) <= set(LENGTH_UNITS):
            result.length_unit = units[min(units)]
            whole = LENGTH_UNITS[result.length_unit]
            factors = {at: LENGTH_UNITS[unit] / whole for at, unit in units.items()}
            result.factors = {at: factor for at, factor in factors.items() if factor != 1.0}
        else:
            result.length_unit = _agreed(list(units.values()), "positions", "x")
        known = [one.unit for one in wanted.values() if one.quantity == "theta"]
        result.angle_unit = _agreed(known, "angles", "theta")
        lengths = [one for one in wanted.values() if one.quantity in tuple("xyz")]
        result.bare = all(one.bare for one in lengths) and (result.box is None or bool(lengths))

    def _describe(self) -> None:
        """Write down what each column was taken for."""
        result = self.result
        used = {at: body for body, one in result.bodies.items() for at in one.values()}
        sides = {} if result.box is None else {at: side for side, at in result.box.sides.items()}
        clock = {*result.numbers, *result.stamps}
        for at, column in enumerate(result.columns):
            meaning = self.meanings.get(at)
            if at not in used and at not in clock and at != result.body_column:
                column.unit = self.unit_of(at)
                if meaning is not None and meaning.quantity == "confidence":
                    column.why = "confidence: read only with `min_confidence`"
                elif meaning is not None:
                    column.why = "it belongs to no pair of x and y, or to no body"
                continue
            column.role = sides.get(at, meaning.quantity if meaning else "")
            column.body = used.get(at, "")
            column.unit = meaning.unit if meaning else ""
            if column.why != self.options.columns_stated_by:
                column.why = "by its name"
                if at in sides and result.box is not None:
                    column.why = f"by its name: a side of a box ({result.box.form})"
            column.why += self._why_unit(at, column)

    def _why_unit(self, at: int, column: ColumnReading) -> str:
        if at in self.result.stamps:
            column.unit = "time stamp"
            return ""
        if column.unit and self.below[at]:
            return "; unit from the row below the names"
        if column.unit and unit_of_name(self.names[at]) == column.unit:
            return "; unit from its name"
        options = self.options
        if not column.unit and ALLOWED.get(column.role) == LENGTHS:
            if options.length_unit or options.metres_per_pixel is not None:
                column.unit = options.length_unit or "px"
                return "; unit as you stated it"
            if self.result.bare and self.result.clock_unit != "frame":
                column.unit = "m"
                return "; no unit named, so metres"
        elif not column.unit and column.role in ("t", "theta"):
            column.unit = {"t": "s", "theta": "rad"}[column.role]
            return f"; no unit named, so {column.unit}"
        return ""


def _agreed(units: list[str], what: str, quantity: str) -> str:
    if len(set(units)) > 1:
        shown = ", ".join(unit or "none" for unit in sorted(set(units)))
        raise InputError(
            f"the columns of {what} name different units ({shown}): state the unit of each, as in "
            f"{argument_text('columns', {quantity: 'NAME:UNIT'})}"
        )
    return units[0] if units else ""
