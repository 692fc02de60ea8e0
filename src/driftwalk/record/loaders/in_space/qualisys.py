"""Qualisys Track Manager TSV: lines of facts, then markers (3D) or rigid bodies (6D) [mm], z up."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from driftwalk.core.errors import FormatError
from driftwalk.record.bad_row import is_number
from driftwalk.record.raw import RawRecording, ReadOptions, TableLayout
from driftwalk.record.space import MATRIX, SpaceColumns, read_in_space
from driftwalk.record.text import header_rows

_FIRST: Final = b"NO_OF_FRAMES\t"
_BODIES: Final = ("BODY_NAMES", "MARKER_NAMES")
_MOST_HEAD: Final = 40
"""Lines among which the first row is looked for; chosen by hand."""
_WIDTH: Final = {"3D": 3, "6D": 16}
"""Columns of a marker: X, Y, Z; of a rigid body: with three angles, the residual, nine of the
rotation matrix."""


class QualisysLoader:
    """Every body, or every marker of a file without bodies."""

    name = "qualisys"
    description = "Qualisys Track Manager TSV, 3D and 6D (mm; z up)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the first line."""
        return 0.95 if head.startswith(_FIRST) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the frames; the unit, the rate and the names stand above them."""
        facts, skip, fields = _head(path)
        kind = (facts.get("DATA_INCLUDED") or ["3D"])[0].strip()
        names = next((facts[one] for one in _BODIES if one in facts), [])
        names = [name for name in names if name]
        if kind not in _WIDTH or not names:
            raise FormatError(
                "expected DATA_INCLUDED 3D with MARKER_NAMES, or 6D with BODY_NAMES: export these "
                "from Qualisys Track Manager"
            )
        # Frame and time may stand before the positions, and a tab at the end.
        first = len(fields) - _WIDTH[kind] * len(names) - (not fields[-1].strip())
        if not 0 <= first <= 2:
            raise FormatError(
                f"expected {_WIDTH[kind]} columns for each of {len(names)} names, after frame and "
                f"time or none; got {len(fields)}",
                line=skip + 1,
            )
        bodies = {}
        for name in names:
            turns = range(first + 7, first + 16) if kind == "6D" else ()
            bodies[name] = SpaceColumns(range(first, first + 3), turns, MATRIX)
            first += _WIDTH[kind]
        return read_in_space(
            path,
            TableLayout("\t", [""] * len(fields), skip),
            bodies,
            options.up or "z",
            zero_is_missing=True,
            length_unit="mm",
            frame_rate_hz=_rate(facts),
        )


def _head(path: Path) -> tuple[dict[str, list[str]], int, list[str]]:
    """Return the facts above the rows, how many lines they take, and the first row's fields."""
    facts: dict[str, list[str]] = {}
    for at, line in enumerate(header_rows(path, _MOST_HEAD)):
        fields = line.split("\t")
        if is_number(fields[0]):
            return facts, at, fields
        facts[fields[0]] = fields[1:]
    raise FormatError("has no rows under its head")


def _rate(facts: dict[str, list[str]]) -> float:
    """Return the frames per second [Hz]."""
    text = (facts.get("FREQUENCY") or [""])[0]
    if not is_number(text) or not float(text) > 0.0:
        raise FormatError(f"FREQUENCY is '{text}', and no rate of frames")
    return float(text)


LOADER = QualisysLoader()
