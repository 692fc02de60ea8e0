"""Descriptions of kinds of datasets, as data: `driftwalk.schema.kinds` has one of each kind."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt

from driftwalk.schema.parameters import flat_name

Holds = Literal["float", "int", "bool", "text"]
Said = Literal["number", "numbers", "text", "yes or no", "object", "list"]
FREE: Final = "..."
"""Any dimensions, in front of the others: the axes of a map have the names of what varies."""


@dataclass(frozen=True)
class Variable:
    """A variable or coordinate.

    Attributes
    ----------
    name : str
        Its name.
    dims : str
        Its dimensions, separated by spaces; one in brackets may be absent, ``...`` in front means
        any. A scalar has none: "".
    units : str or None
        As the attribute ``units`` has them; None for names, indices and flags.
    long_name : str
        What it is, for the axis of a plot and for the reference page.
    holds : str
        What its values are. Single precision is a "float" too.
    when : str
        When it is there; always, where this is empty.
    note : str
        What else the reference page says.
    flags : mapping of str to int
        Meaning to value, of a variable that holds flags.
    bits : bool
        Whether several flags may be set at once.
    """

    name: str
    dims: str
    units: str | None
    long_name: str
    holds: Holds = "float"
    when: str = ""
    note: str = ""
    flags: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    bits: bool = False

    @property
    def fixed_dims(self) -> tuple[str, ...]:
        """Dimensions that it has at most, apart from free ones."""
        return tuple(one.strip("[]") for one in self.dims.split() if one != FREE)

    def lies_on(self, dims: tuple[str, ...]) -> bool:
        """Return whether these are its dimensions.

        Examples
        --------
        >>> u = Variable("u", "[time] y x", "m s-1", "flow velocity x")
        >>> u.lies_on(("y", "x")), u.lies_on(("x", "y"))
        (True, False)
        """
        said = self.dims.split()
        expected = tuple(one for one in self.fixed_dims if one in dims or f"[{one}]" not in said)
        if self.dims.startswith(FREE):
            return dims[len(dims) - len(expected) :] == expected
        return dims == expected

    def described(self, dtype: npt.DTypeLike) -> dict[str, Any]:
        """Return the attributes that it carries; flags have the type of the values."""
        found: dict[str, Any] = {} if self.units is None else {"units": self.units}
        found["long_name"] = self.long_name
        if self.flags:
            values = np.array(list(self.flags.values()), dtype=dtype)
            found["flag_masks" if self.bits else "flag_values"] = values
            found["flag_meanings"] = " ".join(self.flags)
        return found


@dataclass(frozen=True)
class Number:
    """A number of an answer: what the terminal, a notebook and a page call it.

    Attributes
    ----------
    name, unit : str
        Its name in the dataset, and its unit there; "1" for none.
    label, symbol : str
        Words and symbol for it; the label is the name in words where it is empty.
    shown : str
        Unit in which it is shown everywhere; where it is empty, a page chooses the prefix and a
        terminal shows mm and mN.
    note : str
        What else a page says of it.
    widest : float
        Width of an interval above which the number is not determined.
    """

    name: str
    unit: str = "1"
    label: str = ""
    symbol: str = ""
    shown: str = ""
    note: str = ""
    widest: float = math.inf

    @property
    def key(self) -> str:
        """Name with the unit, as JSON has it: "force_std_N"."""
        return flat_name(self.name, self.unit)

    @property
    def plain(self) -> str:
        """The label: "drag coefficient"."""
        return self.label or self.name.replace("_", " ")

    @property
    def words(self) -> str:
        """Label and symbol: "drag coefficient C_d"."""
        return f"{self.plain} {self.symbol}".rstrip()

    @property
    def short(self) -> str:
        """The symbol, or the label where there is none."""
        return self.symbol or self.plain

    @property
    def reader_unit(self) -> str:
        """Unit in a row: "mN"; empty for a number without a unit."""
        return self.shown or _READER_UNITS.get(self.unit, self.unit)

    @property
    def factor(self) -> float:
        """Number of these units in the SI unit."""
        return _FACTORS.get(self.reader_unit, 1.0)


_READER_UNITS: Final = MappingProxyType({"N": "mN", "m": "mm", "1": ""})
"""Units that suit a block of 3 cm."""
_FACTORS: Final = MappingProxyType(
    {"mN": 1e3, "cm": 1e2, "mm": 1e3, "ms": 1e3, "g/s": 1e3, "%": 1e2, "°": math.degrees(1.0)}
)
"""From SI to the unit that a reader sees."""


@dataclass(frozen=True)
class Attribute:
    """An attribute of the whole dataset.

    Attributes
    ----------
    name : str
        Its name; the unit stands in it where it has one.
    says : str
        What it holds. An "object" and a "list" are JSON text.
    meaning : str
        What it is.
    when : str
        When it is there; always, where this is empty.
    """

    name: str
    says: Said
    meaning: str
    when: str = ""


@dataclass(frozen=True)
class Kind:
    """A kind of dataset.

    Attributes
    ----------
    name : str
        What its attribute ``kind`` says.
    version : int
        What its attribute ``schema_version`` says.
    dimensions : mapping of str to str
        Dimension to what lies along it.
    variables : tuple of Variable
        What it may hold.
    attributes : tuple of Attribute
        What it may say of itself, next to ``kind`` and ``schema_version``.
    read, read_attributes : str
        Names of the variables and of the attributes without which a stored one cannot be read,
        separated by spaces. Files of other programs have less than
        driftwalk writes.
    """

    name: str
    version: int
    dimensions: Mapping[str, str]
    variables: tuple[Variable, ...]
    attributes: tuple[Attribute, ...]
    read: str = ""
    read_attributes: str = ""

    def variable(self, name: str) -> Variable:
        """Return the variable of a name; `KeyError` where it has none."""
        return {one.name: one for one in self.variables}[name]


COMMON: Final = {
    one.name: one
    for one in (
        Attribute("source", "text", "name of the file that it was made from"),
        Attribute("study", "text", "the whole study, as TOML"),
        Attribute("arena", "object", "the tank: a circle, rectangle or polygon in m"),
        Attribute("warnings", "list", "sentences"),
        Attribute("simulated_recording", "yes or no", "whether a model made the motion"),
        Attribute("seed", "number", "seed of the random numbers"),
    )
}
"""Attributes of many kinds, by the name under which their texts list them."""

# No space within the brackets: "p < 0.05, |r| > 2" holds no choice.
_CHOICES: Final = re.compile(r"<(\S[^<>]*\|[^<>]*(?<! ))>")
_HEAD: Final = re.compile(r"(dimensions|variables|attributes)(?: \((.+)\))?:")
_VARIABLE: Final = re.compile(
    r"(?P<name>\w+)(?:\((?P<dims>.*?)\))?(?: \[(?P<units>.*?)\])?"
    r"(?: (?P<holds>int|bool|text|flags|bits))?(?:: (?P<words>.*))?"
)
_ATTRIBUTE: Final = re.compile(r"(\w+) (numbers?|text|yes or no|object|list): (.*)")


def kind(
    text: str,
    *more: Variable | Attribute,
    flags: Mapping[str, Mapping[str, int]] = MappingProxyType({}),
) -> Kind:
    """Return the kind that a text describes, in a notation like the CDL of NetCDF.

    Parameters
    ----------
    text : str
        On each line a fact (``kind``, ``version``, ``read``, ``read_attributes``), or under the
        heads ``dimensions:``, ``variables:`` and ``attributes:`` rows such as::

            name(dimensions) [units] int: long name; note
            name number: meaning

        A head may say in brackets when its rows are there. A variable with its name alone is a
        coordinate that is called as it is named, which a row of its dimension may say too
        (``name [units] int: words``); an attribute with its name alone is one of `COMMON`. A row
        with choices in angle brackets, ``<low|high>``, is read as so many rows: one with all the
        first words, one with all the second ones, and so on.
    *more : Variable or Attribute
        Further ones.
    flags : mapping
        By name the meanings of variables that hold ``flags``, or ``bits`` of which several may be
        set.
    """
    rows = _rows_of(text)
    facts = dict(row.split(": ", 1) for row, _ in rows[""])
    along = dict(row.split(": ", 1) for row, _ in rows["dimensions"])
    own = [_variable(*row, flags) for row in rows["variables"]]
    own += [_variable(head, "", {}) for head in along if " " in head]
    said = [_attribute(*row) for row in rows["attributes"]]
    return Kind(
        name=facts["kind"],
        version=int(facts["version"]),
        dimensions={head.split()[0]: words for head, words in along.items()},
        variables=(*own, *(one for one in more if isinstance(one, Variable))),
        attributes=(*said, *(one for one in more if isinstance(one, Attribute))),
        read=facts.get("read", ""),
        read_attributes=facts.get("read_attributes", ""),
    )


def variables(text: str) -> tuple[Variable, ...]:
    """Return the variables of a part of a kind's text; without a head they are always there.

    Examples
    --------
    >>> [one] = variables("position(time) [m]: place of the body; NaN is a gap")
    >>> one.dims, one.units, one.long_name, one.note
    ('time', 'm', 'place of the body', 'NaN is a gap')
    """
    return tuple(_variable(*row, {}) for row in _rows_of(f"variables:\n{text}")["variables"])


def attributes(text: str) -> tuple[Attribute, ...]:
    """Return the attributes of a part of a kind's text; without a head they are always there."""
    return tuple(_attribute(*row) for row in _rows_of(f"attributes:\n{text}")["attributes"])


def _rows_of(text: str) -> dict[str, list[tuple[str, str]]]:
    """Return by section each row, and when it is there; one space stands between words."""
    rows, section, when = defaultdict[str, list[tuple[str, str]]](list), "", ""
    for line in text.splitlines():
        row = " ".join(line.split())
        if head := _HEAD.fullmatch(row):
            section, when = head[1], head[2] or ""
        elif row:
            rows[section] += [(one, when) for one in _chosen(row)]
    return rows


def _chosen(row: str) -> list[str]:
    """Return the rows that one with choices is read as, else itself alone."""
    found = [choices.split("|") for choices in _CHOICES.findall(row)]
    if len({len(words) for words in found}) > 1:
        raise ValueError(f"not as many words in each choice: {row}")
    rest = _CHOICES.split(row)[::2]
    rows = [
        "".join(part for pair in zip(rest, (*words, ""), strict=True) for part in pair)
        for words in zip(*found, strict=True)
    ]
    return rows or [row]


def _variable(row: str, when: str, flags: Mapping[str, Mapping[str, int]]) -> Variable:
    match = _VARIABLE.fullmatch(row)
    if match is None:
        raise ValueError(f"not a row of a variable: {row}")
    name, holds, words = match["name"], match["holds"] or "float", match["words"]
    dims = match["dims"] or ("" if words else name)
    long_name, _, note = (words or name.replace("_", " ")).partition("; ")
    meanings = flags[name] if holds in ("flags", "bits") else {}
    kept: Any = "int" if meanings else holds
    return Variable(
        name, dims, match["units"], long_name, kept, when, note, meanings, holds == "bits"
    )


def _attribute(row: str, when: str) -> Attribute:
    if row in COMMON:
        return replace(COMMON[row], when=when)
    match = _ATTRIBUTE.fullmatch(row)
    if match is None:
        raise ValueError(f"not a row of an attribute: {row}")
    says: Any = match[2]
    return Attribute(match[1], says, match[3], when)


def limited(given: Iterable[Attribute], when: str, *, without: str = "") -> Iterator[Attribute]:
    """Yield attributes that are there in some cases alone, but for those of the names."""
    for one in given:
        if one.name not in without.split():
            yield replace(one, when=one.when or when)


SOURCE_WARNINGS: Final = attributes("""
attributes (what the parameters were taken from has any):
    warnings
""")
"""Of results of simulations."""
