"""Base of every section of a study: declared quantities and readable errors.

A field is declared once: type, unit, range, default and meaning stand together, and the same
declaration checks the value, writes the commented template and makes the reference page. The text
below a field is its description; where it has two paragraphs, the first one says in a sentence what
the help of its option says.
"""

from __future__ import annotations

import ast
import inspect
import json
import re
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Final, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler, ValidationError
from pydantic_core import CoreSchema, ErrorDetails, core_schema

from driftwalk.core.errors import ConfigurationError, did_you_mean
from driftwalk.core.units import parse_quantity

Item = TypeVar("Item")

SMALLEST: Final = 1e-25
"""Least value, in SI, of a number that must be more than 0: below every length, mass, time and
force of a laboratory, and its third and fourth powers are still numbers. The square of 1e-320 is
0."""


@dataclass(frozen=True)
class Quantity:
    """Declares a number of a study: its unit and its range.

    Words of the field's type, `Literal["auto"]`, may stand in place of a number.

    Parameters
    ----------
    unit : str
        SI unit of the stored value, ``"1"`` for none. Text such as ``"0.55mN"`` is read.
    ge, gt, le, lt : float, optional
        Bounds: at least, more than, at most, less than.
    whole : bool
        Whether only whole numbers are accepted.
    """

    unit: str
    ge: float | None = None
    gt: float | None = None
    le: float | None = None
    lt: float | None = None
    whole: bool = False

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Put `check` in front of the type's own validation."""
        check = partial(self.check, words=_words_in(source))
        return core_schema.no_info_before_validator_function(check, handler(source))

    def check(self, value: Any, words: tuple[str, ...]) -> Any:
        """Return the value in the declared unit, or a word as it is.

        Raises
        ------
        ConfigurationError
            When it is neither, or out of range.
        """
        if value is None or (isinstance(value, str) and value in words):
            return value
        unit = f" {self.unit}" if self.unit != "1" else ""
        if words and isinstance(value, str) and value[:1].isalpha():
            raise ConfigurationError(
                f"expected a number{unit and f' in{unit}'} or {quoted(words)}, got '{value}'"
                f"{did_you_mean(value, words)}"
            )
        if self.whole:
            if isinstance(value, bool) or not isinstance(value, int):
                raise ConfigurationError(f"expected a whole number, got {value!r}")
            number: float = value
        else:
            number = parse_quantity(value, self.unit)
            if self.gt == 0 and 0.0 < number < SMALLEST:
                raise ConfigurationError(f"must be at least {SMALLEST:g}{unit}, got {value}")
        for bound, holds, text in (
            (self.ge, number >= (self.ge or 0.0), "at least"),
            (self.gt, number > (self.gt or 0.0), "more than"),
            (self.le, number <= (self.le or 0.0), "at most"),
            (self.lt, number < (self.lt or 0.0), "less than"),
        ):
            if bound is not None and not holds:
                raise ConfigurationError(f"must be {text} {bound:g}{unit}, got {value}")
        return number

    def range_text(self) -> str:
        """Return the range in words, empty when there is none."""
        parts = [
            f"{sign} {bound:.15g}"
            for sign, bound in ((">=", self.ge), (">", self.gt), ("<=", self.le), ("<", self.lt))
            # The largest integer of a file format says nothing to a reader.
            if bound is not None and bound < 1e18
        ]
        return ", ".join(parts)


Seed = Annotated[int, Quantity("1", ge=0, le=2**63 - 1, whole=True)]
"""The largest is that of a 64-bit integer of a NetCDF file."""


def not_set(example: Any) -> Any:
    """Return a field that is not set by default, with an example for the template."""
    return Field(default=None, examples=[example])


@dataclass(frozen=True)
class OrNumber:
    """Declares that a word may be given as a number instead, which has its own key."""

    key: str


@dataclass(frozen=True)
class Placeholder:
    """Declares the placeholder of a text in the help of an option, such as ``FILE``."""

    text: str


class _Signature:
    """The signature of a section whose validator is not made yet: makes it, for help and hover."""

    def __get__(self, section: Section | None, kind: type[Section]) -> inspect.Signature:
        kind.model_rebuild()
        # pydantic has put its own into the class now.
        signature: inspect.Signature = vars(kind)["__signature__"].__get__(None, kind)
        return signature


class _WithSignature:
    __signature__ = _Signature()


class Section(_WithSignature, BaseModel):
    """Base of every section: frozen, no unknown keys, errors that name section and key."""

    # The validator of a section is made for its first object: help needs the declarations alone.
    model_config = ConfigDict(frozen=True, extra="forbid", strict=False, defer_build=True)

    section_name: ClassVar[str] = ""
    """Name of the section in a study file, empty for the study itself."""

    def __init__(self, /, **data: Any) -> None:
        try:
            super().__init__(**data)
        except ValidationError as error:
            raise _SectionError(_describe(type(self), error)) from None

    def is_default(self, key: str) -> bool:
        """Return whether a key has its default value: a study file may hold it all the same."""
        return bool(getattr(self, key) == type(self).model_fields[key].default)

    @classmethod
    def replaced_by(cls, keys: set[str]) -> set[str]:  # noqa: ARG003
        """Return the keys that lose their meaning when the keys given are set."""
        return set()

    @classmethod
    def expanded(cls, values: dict[str, Any]) -> dict[str, Any]:
        """Return values of keys, with a value that holds several split into its keys."""
        return values


class _SectionError(ConfigurationError):
    """An error whose message names its section already."""


# A sentence may begin with a word in quotes; "Eq. 4" is no end of one.
_END_OF_SENTENCE: Final = re.compile(r'(?<=\.) (?=[A-Z"])')


def description_of(section: type[Section], key: str) -> str:
    """Return the description of a field: the last paragraph of the text below it."""
    return _paragraphs(section, key)[-1]


def meaning_of(section: type[Section], key: str) -> str:
    """Return the description of a field in one sentence: its first paragraph, or sentence."""
    first, *more = _paragraphs(section, key)
    return first if more else _END_OF_SENTENCE.split(first)[0]


def _paragraphs(section: type[Section], key: str) -> list[str]:
    """Return the paragraphs below a field in the source of its class, each in one line.

    Only options and templates need them. pydantic would read those of every section at import.
    """
    stated = section.model_fields[key].description
    owners = (kind for kind in section.__mro__ if key in vars(kind).get("__annotations__", {}))
    owner = next(owners, section)
    text = stated or _texts_of(owner.__module__).get((owner.__name__, key), "")
    return [" ".join(part.split()) for part in text.split("\n\n")]


@lru_cache
def _texts_of(module: str) -> dict[tuple[str, str], str]:
    """Return the texts below the fields of a module's classes, by class and field."""
    try:
        tree = ast.parse(inspect.getsource(sys.modules[module]))
    except OSError:  # a program that was frozen without its source
        return {}
    return {
        (kind.name, field.target.id): text.value.value
        for kind in tree.body
        if isinstance(kind, ast.ClassDef)
        for field, text in pairwise(kind.body)
        if isinstance(field, ast.AnnAssign)
        and isinstance(field.target, ast.Name)
        and isinstance(text, ast.Expr)
        and isinstance(text.value, ast.Constant)
        and isinstance(text.value.value, str)
    }


_UNIT_OF_KEY: Final = re.compile(r"_(m_s|per_s|Hz|[msN])$")


def without_unit(key: str) -> str:
    """Return a key without the unit that its name ends with."""
    return _UNIT_OF_KEY.sub("", key)


def distinct(values: tuple[Item, ...]) -> tuple[Item, ...]:
    """Return the values of a list; refuse an empty one, and one that names a value twice."""
    if not values:
        raise ConfigurationError("the list is empty; leave the key out or name a value")
    if len(set(values)) < len(values):
        raise ConfigurationError(f"the list names a value twice: {list(values)}")
    return values


def quoted(words: Iterable[str]) -> str:
    """Return words in quotes, joined for a sentence."""
    return " or ".join(f'"{word}"' for word in words)


def quantity_of(section: type[Section], key: str) -> Quantity | None:
    """Return the declared quantity of a field, or of the items of a list; None for other fields."""
    field = section.model_fields[key]
    parts = [*field.metadata, *_parts(field.annotation)]
    return next((part for part in parts if isinstance(part, Quantity)), None)


def is_list(section: type[Section], key: str) -> bool:
    """Return whether a field is a list of any length."""
    return Ellipsis in _parts(section.model_fields[key].annotation)


def words_of(section: type[Section], key: str) -> tuple[str, ...]:
    """Return the words that a field, or an item of a list, accepts; empty for any or none."""
    return _words_in(section.model_fields[key].annotation)


def _words_in(annotation: Any) -> tuple[str, ...]:
    return tuple(dict.fromkeys(part for part in _parts(annotation) if isinstance(part, str)))


def _parts(annotation: Any) -> Iterator[Any]:
    """Yield everything that an annotation is made of, itself first."""
    yield annotation
    for part in get_args(annotation):
        yield from _parts(part)


def _describe(section: type[Section], error: ValidationError) -> str:
    """Return one sentence for the first problem, and how many more there are."""
    problems = error.errors(include_url=False)
    sentence = _sentence(section, problems[0])
    more = len({problem["loc"][:1] for problem in problems}) - 1
    if more > 0:
        sentence += f" (and {more} more problem{'s' if more > 1 else ''})"
    return sentence


def _sentence(section: type[Section], problem: ErrorDetails) -> str:
    cause = problem.get("ctx", {}).get("error")
    if isinstance(cause, _SectionError):
        return str(cause)
    location, value, kind = problem["loc"], problem.get("input"), problem["type"]
    name = section.section_name
    if not location:
        return f"[{name}] {cause}" if name else str(cause or problem["msg"])
    key = str(location[0])
    if kind == "extra_forbidden":
        unknown = f"[{name}] unknown key" if name else "unknown section or key"
        return f"{unknown} '{key}'{did_you_mean(key, section.model_fields)}"
    if not name and kind in ("model_type", "model_attributes_type", "dict_type"):
        return f"[{key}] must be a section of keys, got {value!r}"
    where = f"[{name}] {key}" if name else key
    if cause is not None:
        return f"{where}: {cause}"
    if kind == "tuple_type":
        return f"{where} must be a list, got {value!r}"
    if kind == "missing":
        return f"{where} is missing"
    if kind == "literal_error":
        words = words_of(section, key)
        hint = did_you_mean(str(value), words)
        return f"{where} must be {quoted(words)}, got {value!r}{hint}"
    if kind.startswith("bool_"):
        return f"{where} must be true or false, got {value!r}"
    message = problem["msg"].replace("Input should be", "must be")
    return f"{where} {message}, got {value!r}"


def toml_lines(section: Section) -> list[str]:
    """Return the keys of a section that are set, as lines of TOML."""
    return [f"{key} = {toml_text(value)}" for key, value in section if value is not None]


def toml_text(value: Any) -> str:
    """Return a value as TOML; its strings are JSON's, but for the delete character."""
    if isinstance(value, Section):
        inner = ", ".join(toml_lines(value))
        return f"{{ {inner} }}" if inner else "{}"
    if isinstance(value, (tuple, list)):
        return "[" + ", ".join(toml_text(item) for item in value) + "]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value)
