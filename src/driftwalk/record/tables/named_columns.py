"""Columns by their names: which the user named, which are not a body, which have no known unit."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final

from driftwalk.core.errors import InputError, argument_text, listed
from driftwalk.record.column_names import ColumnMeaning, column_meaning, unit_of_name
from driftwalk.record.raw import ReadOptions
from driftwalk.record.space import Plane
from driftwalk.record.tables.boxes import Box
from driftwalk.record.tables.in_memory import TableSource
from driftwalk.record.unit_and_column_words import ALLOWED, PARTS, ROOTS, SETPOINTS, UNITS, VARIANTS

_WORDS: Final = {"t": "time", "t+": "fraction of the time", "frame": "frame number", "w": "width"}
_WORDS_MORE: Final = {"h": "height", "theta": "orientation", "body": "name of the body"}


@dataclass
class ColumnReading:
    """Reading of one column: what it was taken for, in which unit, and why."""

    name: str
    role: str = ""
    """A quantity of `ALLOWED`, ``"t+"``, or ``""``: it is not read."""
    body: str = ""
    unit: str = ""
    """Of `UNITS`; ``""`` where nothing names it."""
    why: str = "its name is not known"

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
    """Reading of the columns (from 0) of a table, as the reader executes it."""

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
    factors: dict[int, float] = field(default_factory=dict)
    """Columns of positions in another unit than that, and what makes it of them."""
    angle_unit: str = ""
    bare: bool = True
    """Whether the names of positions are plain symbols, which mean metres next to seconds."""
    box: Box | None = None
    planes: dict[str, Plane] = field(default_factory=dict)
    """Body to the plane that it is laid into, of those in space."""
    parts: tuple[str, str, str] | None = None
    """Bodies that are parts of one: its middle, and those from and to which it points."""
    notes: list[str] = field(default_factory=list)

    @property
    def clock(self) -> int | None:
        """The column whose values are the clock's once the table is read."""
        return next(iter((*self.stamps, *self.numbers)), None)

    @property
    def confidences(self) -> list[int]:
        """The columns of confidences that are read."""
        return sorted({one["confidence"] for one in self.bodies.values() if "confidence" in one})


_SKIP: Final = "skip"
LEFT_OUT: Final = "you left it out"
_OTHER_BODY: Final = "a setpoint, or something that moves the body, rather than a body"
_SAME_BODY: Final = "the same body, before or after processing"


class NamedColumns:
    """The columns of a table as far as their names decide."""

    def __init__(self, source: TableSource, options: ReadOptions, *, lenient: bool) -> None:
        self.source, self.options, self.lenient = source, options, lenient
        self.names, self.below = source.names, source.units or [""] * len(source.names)
        labels = [name or str(at) for at, name in enumerate(self.names, start=1)]
        self.result = TableReading([ColumnReading(label) for label in labels])
        self.chosen = {key: one for key, one in options.columns.items() if key != _SKIP}
        pairs = zip(self.names, self.below, strict=True)
        known = [column_meaning(name, unit) for name, unit in pairs]
        self.meanings = {at: one for at, one in enumerate(known) if one is not None}

    def drop(self, columns: Iterable[int], why: str) -> None:
        """Leave columns out, and say why."""
        for at in list(columns):
            self.meanings.pop(at, None)
            self.result.columns[at].why = why

    def choose(self) -> None:
        """Take the columns that the user names for what they are said to be."""
        for name in filter(None, self.options.columns.get(_SKIP, "").split("+")):
            index, _ = self._find(name, _SKIP)
            self.drop([index], LEFT_OUT)
        for quantity, reference in self.chosen.items():
            places = self._references(reference, quantity)
            for part, (index, unit) in zip((quantity, "t+"), places, strict=False):
                if unit and unit not in ALLOWED[quantity]:
                    where = argument_text("columns", {quantity: reference})
                    raise InputError(f"{where}: '{unit}' is not a unit of {quantity}")
                known = self.meanings.get(index)
                stated = self.unit_of(index)
                inferred = stated if stated in ALLOWED[quantity] else ""
                unknown = known.unknown if known and not unit and known.quantity == quantity else ""
                own = [at for at, one in self.meanings.items() if one.quantity == part]
                for other in (index, *own):
                    self.meanings.pop(other, None)
                self.meanings[index] = ColumnMeaning(
                    part, unit or inferred, "", bool(known and known.bare), unknown, rank=-1
                )
                self.result.columns[index].why = self.options.columns_stated_by

    def unit_of(self, at: int) -> str:
        """Return the unit of any column, as its name or the row below states it."""
        below = self.below[at]
        return unit_of_name(f"_ {below}") if below else unit_of_name(self.names[at])

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
        names, where = self.names, argument_text("columns", {quantity: reference})
        if quantity not in ALLOWED and quantity != _SKIP:
            raise InputError(f"{where}: unknown quantity; name {', '.join([*ALLOWED, _SKIP])}")
        pairs = list(zip(names, self.below, strict=True))
        written = [[form.format(*pair) for pair in pairs] for form in ("{}", "{} [{}]", "{} {}")]
        for text, unit in ((reference, ""), reference.rpartition(":")[::2]):
            places = [known.index(text) for known in written if text in known]
            if not places and text.isdecimal() and 1 <= int(text) <= len(names):
                places = [int(text) - 1]
            if places:
                return places[0], UNITS.get(unit.lower(), unit)
        raise InputError(f"{where}: no such column; the file has {len(names)}: {shown(names)}")

    def bodies_with(self, quantity: str = "x") -> dict[str, int]:
        """Return the names of the bodies that have a quantity, and its column."""
        return {one.body: at for at, one in self.meanings.items() if one.quantity == quantity}

    def leave_out_other_pairs(self) -> None:
        """Leave out pairs that are not a body, or repeat one, where there is another pair."""
        ys, thetas = self.bodies_with("y"), self.bodies_with("theta")
        bodies = [body for body in self.bodies_with("x") if body in ys]
        words = {
            one.body: {word.lower().rstrip("0123456789") for word in one.body.split("_")}
            for one in self.meanings.values()
        }
        setpoints = [body for body in bodies if words[body] & SETPOINTS]
        variants = [body for body in bodies if words[body] & VARIANTS and body not in setpoints]
        real = [body for body in bodies if body not in (*setpoints, *variants)]
        left: dict[str, str] = {}
        if real or variants or self.result.box is not None:
            left = dict.fromkeys(setpoints, _OTHER_BODY)
        elif setpoints and not self.lenient:
            if len(setpoints) > 1:
                raise InputError(self._one_of(setpoints))
            self.result.notes.append(
                f"'{setpoints[0]}' is read as a body, though its name belongs to a setpoint: there "
                "is no other pair of x and y"
            )
        left |= self._computed(variants, real)
        for body in [one for one in words if one not in bodies]:
            # An angle of a setpoint stands alone where its position has other names.
            if words[body] & SETPOINTS:
                left[body] = _OTHER_BODY
            if words[body] & VARIANTS and _base(body) in thetas:
                left[body] = _SAME_BODY
        for body, why in left.items():
            self.drop([at for at, one in self.meanings.items() if one.body == body], why)
        self._doubt(set(bodies) - set(left))
        if named := [body for body in left if body in bodies]:
            self.result.notes.append(
                f"pairs of x and y that are not read as bodies: {listed(named)} (if one is the "
                f"body, name it with {argument_text('columns', {'x': 'NAME', 'y': 'NAME'})})"
            )

    def _doubt(self, bodies: set[str]) -> None:
        """Say that pairs next to plain x and y are read as bodies: they may be something else."""
        others = sorted(body for body in bodies if body.lower() not in PARTS)
        if "" not in bodies or not others or self.chosen:
            return
        columns = {quantity: self.bodies_with(quantity)[others[0]] for quantity in "xy"}
        names = [self.names[at] for at in columns.values()]
        self.result.notes.append(
            f"{listed([repr(name) for name in names])} are read as another body, next to x and "
            f"y: if they are not one, add {argument_text('columns', {'skip': '+'.join(names)})}"
        )

    def _computed(self, variants: list[str], real: list[str]) -> dict[str, str]:
        """Return the pairs that repeat a body; of several, one has to be named."""
        left: dict[str, str] = {}
        of_base: dict[str, list[str]] = {}
        for body in variants:
            of_base.setdefault(_base(body), []).append(body)
        for base, several in of_base.items():
            if base in real or (not base and self.result.box is not None):
                left |= dict.fromkeys(several, _SAME_BODY)
            elif len(several) > 1 and not self.lenient:
                raise InputError(self._one_of(several))
        return left

    def _one_of(self, bodies: list[str]) -> str:
        """Return what to do about several bodies that may be one."""
        columns = self.bodies_with("x")
        found = [self.names[columns[body]] for body in bodies]
        other = {"x": found[0], "y": self.names[self.bodies_with("y")[bodies[0]]]}
        return (
            f"{listed([repr(name) for name in found])} may be one body several times, or none: "
            f"name the one to read, as in {argument_text('columns', other)}"
        )

    def refuse_unknown_units(self) -> None:
        """Refuse positions, angles and times whose unit is not known."""
        options = self.options
        stated = options.length_unit is not None or options.metres_per_pixel is not None
        for at, meaning in list(self.meanings.items()):
            length = meaning.quantity in ("x", "y", "z")
            if not meaning.unknown or (length and stated) or self.lenient:
                continue
            known = {(one.quantity, one.body) for one in self.meanings.values() if not one.unknown}
            counted = meaning.quantity == "t" and self.bodies_with("frame")
            if meaning.quantity == "z" or counted or (meaning.quantity, meaning.body) in known:
                self.drop([at], f"'{meaning.unknown}' is not a known unit")
                continue
            raise InputError(self.no_unit(at, meaning.unknown))
        if stated or self.lenient:
            return
        bodies = {"x": self.bodies_with("y"), "lon": self.bodies_with("lat")}
        bodies |= {"y": bodies["x"], "lat": bodies["lon"]}
        pairs = {
            at: one for at, one in self.meanings.items() if one.body in bodies.get(one.quantity, ())
        }
        word, *more = {one.ending for one in pairs.values()} or [""]
        if not more and may_be_unit(word) and not any(one.unit for one in pairs.values()):
            raise InputError(
                self.no_unit(next(iter(pairs)), word)
                + "; if it names the body, state the unit of its positions with `length_unit`"
            )

    def no_unit(self, at: int, word: str) -> str:
        """Return what to do about a column whose unit is not known."""
        quantity = self.meanings[at].quantity
        allowed = ", ".join(sorted(ALLOWED[quantity]))
        choice = argument_text("columns", {quantity: f"{self.names[at]}:UNIT"})
        return (
            f"'{word}' in column '{self.names[at]}' is not a known unit: say which of "
            f"{allowed} it is, as in {choice}"
        )

    def both(self, first: int, second: int, quantity: str) -> str:
        """Return what to do about two columns that could be one quantity."""
        return (
            f"columns '{self.names[first]}' and '{self.names[second]}' could both be "
            f"{quantity}: name one with {argument_text('columns', {quantity: 'NAME'})}"
        )


def _base(body: str) -> str:
    """Return the name of a body without the words of a computation."""
    return "_".join(word for word in body.split("_") if word.lower() not in VARIANTS)


def may_be_unit(word: str) -> bool:
    """Whether a word next to a coordinate may be a unit rather than the name of a body."""
    lower = word.lower()
    other = lower in VARIANTS | SETPOINTS | PARTS
    return lower.isalpha() and len(lower) > 1 and not other and ROOTS.get(lower) != "body"


def shown(names: list[str]) -> str:
    """Return the first names of columns."""
    return ", ".join(repr(name) for name in names[:12]) + (", …" if len(names) > 12 else "")
