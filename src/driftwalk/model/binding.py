"""Typed faces: kinds of blocks, which faces latch, and what a block becomes when one has.

A table of the rules is a graph grammar of binary rules: two labelled blocks latch and get new
labels (Klavins, Ghrist and Lipsky, IEEE Trans. Autom. Control 51, 949, 2006).
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, ClassVar, Final, Literal, Self

from pydantic import AfterValidator, model_validator

from driftwalk.core.errors import ConfigurationError, FormatError, did_you_mean
from driftwalk.core.text_files import MOST_TOML_BYTES, parse_toml, read_bounded
from driftwalk.model.section import Quantity, Section

MOST: Final = 32
"""Kinds, and types of faces: the native core has a bit for each."""
NO_TYPE: Final = "none"
"""The type of a face that latches with none."""
POLES: Final = {"N": 1, "S": -1}
"""Types of faces that are fixed magnets."""
SIDES: Final = ("+x", "+y", "-x", "-y")
"""Faces of a block in its own frame, in their order."""
_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


class Kind(Section):
    """A kind of block: the types of its faces, and how many blocks are of it at the start."""

    section_name: ClassVar[str] = "kinds"

    name: str
    """Name of the kind."""
    faces: tuple[str, ...]
    """Types of the faces +x, +y, -x, -y."""
    count: Annotated[int, Quantity("1", ge=0, le=1_000_000, whole=True)] = 0
    """Blocks of this kind at the start."""

    @model_validator(mode="after")
    def _named(self) -> Self:
        for name in (self.name, *self.faces):
            if not _NAME.fullmatch(name):
                raise ConfigurationError(
                    f"a kind and a type have a name of letters and digits, got '{name}'"
                )
        if len(self.faces) != len(SIDES):
            raise ConfigurationError(
                f"'{self.name}' has {len(self.faces)} faces: name the types of 4, in the order "
                f"{', '.join(SIDES)}"
            )
        return self


class Rewrite(Section):
    """The kind that a block is of after one of its faces has latched."""

    section_name: ClassVar[str] = "after"

    kind: str
    """Kind of the block."""
    face: Literal["+x", "+y", "-x", "-y"]
    """Its face that latched, in its own frame."""
    meets: str | None = None
    """Type of the face that it latched with; not set: any that no other rule names."""
    becomes: str
    """Kind that the block is of from then on."""


class Binding(Section):
    """Rules of typed faces.

    Raises
    ------
    ConfigurationError
        When a kind or a type is not known, stands twice, or has no use.

    Examples
    --------
    >>> Binding(kinds=[{"name": "A", "count": 4, "faces": ["N", "S", "N", "S"]}]).words
    '4 A (N,S,N,S); N latches with S'
    """

    section_name: ClassVar[str] = "assembly.binding"

    kinds: tuple[Kind, ...]
    """Kinds of blocks; the blocks at the start are of them in this order."""
    latches: tuple[tuple[str, ...], ...] = (("N", "S"),)
    """Pairs of types of faces that latch; no others do."""
    after: tuple[Rewrite, ...] = ()
    """Rules of the kinds that blocks are of after a latch."""

    @model_validator(mode="after")
    def _known(self) -> Self:
        names, types = [kind.name for kind in self.kinds], self.types
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise ConfigurationError(f"the kind '{twice}' stands twice in kinds")
        if len(names) > MOST or len(types) > MOST:
            raise ConfigurationError(
                f"at most {MOST} kinds and {MOST} types of faces, got {len(names)} and {len(types)}"
            )
        if not self.blocks:
            raise ConfigurationError("kinds: no block at the start; give a count")
        if any(len(pair) != 2 for pair in self.latches):
            raise ConfigurationError('latches: expected pairs of types, such as [["N", "S"]]')
        if "latches" in self.model_fields_set:
            for name in (name for pair in self.latches for name in pair):
                _require(name, types, "no face has the type", "in latches")
            self._refuse_idle(types)
        seen: set[tuple[str, str, str | None]] = set()
        for rule in self.after:
            _require(rule.kind, names, "there is no kind", "in after")
            _require(rule.becomes, names, "there is no kind", "in after")
            if rule.meets is not None:
                _require(rule.meets, types, "no face has the type", "in after")
            address = (rule.kind, rule.face, rule.meets)
            if address in seen:
                raise ConfigurationError(
                    f"after: two rules for '{rule.kind}' whose face {rule.face} meets "
                    f"{rule.meets or 'any type'}: leave one out"
                )
            seen.add(address)
        return self

    def _refuse_idle(self, types: tuple[str, ...]) -> None:
        used = {name for pair in self.latches for name in pair}
        idle = [name for name in types if name not in used and name not in (NO_TYPE, *POLES)]
        if idle:
            raise ConfigurationError(
                f"faces of the type '{idle[0]}' latch with none: name it in latches, or call it "
                f'"{NO_TYPE}"{did_you_mean(idle[0], used)}'
            )

    @property
    def types(self) -> tuple[str, ...]:
        """Types of faces, in the order in which they come."""
        return tuple(dict.fromkeys(name for kind in self.kinds for name in kind.faces))

    @property
    def blocks(self) -> int:
        """Number of blocks at the start."""
        return sum(kind.count for kind in self.kinds)

    @property
    def words(self) -> str:
        """The rules in a sentence."""
        kinds = ", ".join(f"{k.count} {k.name} ({','.join(k.faces)})" for k in self.kinds)
        pairs = ", ".join(f"{one} latches with {other}" for one, other in self.latches)
        after = (
            f"{rule.kind} becomes {rule.becomes} after {rule.face} meets {rule.meets or 'any'}"
            for rule in self.after
        )
        return "; ".join([kinds, pairs, *after])


def _require(name: str, known: Iterable[str], what: str, where: str) -> None:
    if name not in known:
        raise ConfigurationError(f"{what} '{name}', {where}{did_you_mean(name, known)}")


def face_types(text: str) -> tuple[str, ...] | None:
    """Return the types of a block's faces, None where any face latches with any.

    Parameters
    ----------
    text : str
        ``"any"``, or the types of the faces +x, +y, -x, -y: ``"N,S,N,S"``, ``"NSNS"``; ``-`` or
        ``none`` is a face that latches with none.

    Raises
    ------
    ConfigurationError
        When there are not four, or a type is none of these.

    Examples
    --------
    >>> face_types("NS--")
    ('N', 'S', 'none', 'none')
    """
    if text == "any":
        return None
    parts = [part.strip() for part in text.split(",")] if "," in text else list(text.strip())
    found = tuple(NO_TYPE if part == "-" else part for part in parts)
    wrong = [name for name in found if name not in (*POLES, NO_TYPE)]
    if wrong and "," in text:
        raise ConfigurationError(
            f"a face is N, S or none, got '{wrong[0]}'; other types stand in a table of kinds"
        )
    if wrong or len(found) != len(SIDES):
        raise ConfigurationError(
            f'expected "any" or the types of 4 faces, in the order {", ".join(SIDES)}, such as '
            f"N,S,N,S; got '{text}'"
        )
    return found


def faces_text(text: str) -> str:
    """Return the types of a block's faces as a study has them: "any" or "N,S,N,S"."""
    types = face_types(text)
    return "any" if types is None else ",".join(types)


FacesText = Annotated[str, AfterValidator(faces_text)]


def read_binding(path: str | Path) -> Binding:
    """Read a table of the rules of typed faces.

    Parameters
    ----------
    path : path-like
        A TOML file with ``[[kinds]]`` (name, faces, count), ``latches`` (pairs of types) and
        ``[[after]]`` (kind, face, meets, becomes).

    Returns
    -------
    Binding
        The rules, frozen.

    Raises
    ------
    ConfigurationError
        When a key is unknown or a rule is wrong; names file, line and column.
    OSError
        When the file cannot be read.

    Examples
    --------
    >>> read_binding("rules.toml").blocks  # doctest: +SKIP
    4
    """
    text = read_bounded(path, most=MOST_TOML_BYTES)
    try:
        return Binding(**parse_toml(text))
    except FormatError as error:
        raise ConfigurationError(f"{path}: {error.reason}") from error
    except ConfigurationError as error:
        # In its own file the section has no parent.
        reason = str(error).replace("[assembly.binding]", "[binding]")
        where = _place(text.decode("utf-8-sig"), reason)
        raise ConfigurationError(f"{path}{where}: {reason}") from error


def _place(text: str, message: str) -> str:
    """Return line and column of the last place of the word that a message quotes first."""
    word = re.search(r"'([^']+)'", message)
    if word is None:
        return ""
    # A kind stands where it is named; anything else where it comes last.
    for place in (rf'(?<=name = "){re.escape(word[1])}"', rf"(?<!\w){re.escape(word[1])}(?!\w)"):
        starts = [spot.start() for spot in re.finditer(place, text)]
        if starts:
            break
    else:
        return ""
    line = text.count("\n", 0, starts[-1]) + 1
    return f", line {line}, column {starts[-1] - text.rfind(chr(10), 0, starts[-1])}"
