"""LaVision DaVis text: a line of sizes and units, then rows, with a decimal comma or point."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from driftwalk.core.errors import FormatError
from driftwalk.flow.readers.table import read_text
from driftwalk.flow.readers.text import masked_rows, read_rows
from driftwalk.flow.readers.units import RawField

_START: Final = "#DaVis"
_BINARY: Final = (".vc7", ".im7")
_UNITS: Final = re.compile(r'"([^"]*)"\s+"([^"]*)"')


def sniff(head: str, _path: Path) -> bool:
    """Recognise the first line."""
    return head.startswith(_START)


def refuse_binary(path: Path) -> None:
    """Refuse DaVis' own files, which only its maker's library reads.

    Raises
    ------
    FormatError
        Says what to do.
    """
    if path.suffix.lower() in _BINARY:
        raise FormatError(
            f"is a file of DaVis' own ({path.suffix.lower()}): export it from DaVis as txt",
            path=path,
        )


def read(path: Path) -> RawField:
    """Read the rows; DaVis writes the velocity 0, 0 where it has none, or none is allowed.

    Raises
    ------
    FormatError
        When the header is not of planar vectors, or a row cannot be read.
    """
    first, *rest = read_text(path).splitlines()
    units = [unit for _, unit in _UNITS.findall(first)]
    if "2D-vector" not in first or len(units) < 3 or units[0] != units[1]:
        raise FormatError(
            'expected "2D-vector" and the units of position, position and velocity in the header',
            path=path,
            line=1,
        )
    rows = [(n, line.replace(",", ".")) for n, line in enumerate(rest, 2) if line.strip()]
    width = len(rows[0][1].split("\t")) if rows else 0
    if rows and width < 4:
        raise FormatError(
            f"expected columns of x, y, u, v, got {width}", path=path, line=rows[0][0]
        )
    line, values = read_rows(rows, delimiter="\t", width=width, path=path)
    return RawField(
        masked_rows(line, values, (values[:, 2:4] == 0.0).all(axis=1), path),
        length_unit=units[0],
        velocity_unit=units[2],
    )
