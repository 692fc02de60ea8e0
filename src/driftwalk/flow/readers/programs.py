"""Programs that write velocity fields as text: what each does not say in its names of columns."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import FormatError

_QUOTED: Final = re.compile(r'VARIABLES\s*=\s*((?:"[^"]*"\s*,?\s*)+)', re.IGNORECASE)
_UNQUOTED: Final = re.compile(r'VARIABLES\s*=\s*([^"\n]+)', re.IGNORECASE)
HEAD: Final = 1 << 14
"""Length of a text's start by which its program is known; chosen by hand."""


@dataclass(frozen=True)
class Program:
    """Facts on a program that the names of its columns leave out."""

    name: str
    title: str
    sign: str = ""
    """Regular expression by which the head of its files is known, ``""`` for none."""
    y: Literal["up", "down", "rows", ""] = ""
    """Direction of y; "rows": down where the first row has the smallest; ``""``: the same in
    pixels alone, else up."""
    columns: tuple[str, ...] = ()
    """Names of its columns where it writes none."""
    zero_is_missing: bool = False
    """Whether a velocity of 0, 0 is none, where no column says so."""
    units: tuple[str, str] = ("", "")
    """Units of positions and velocities where the names have none."""
    pixels_unless: str = ""
    """Regular expression of the factor to metres: 1 where positions are in pixels."""
    interval: str = ""
    """Regular expression of the time between the two images [us]."""

    def counts_down(self, y: npt.NDArray[np.float64]) -> bool | None:
        """Return whether y counts down; None where that depends on the unit."""
        if self.y == "rows":
            return bool(y[0] < y[-1])
        return None if not self.y else self.y == "down"

    def without_units(self) -> Program:
        """Return the program where bare names have no unit."""
        return replace(self, units=("", ""))

    def units_in(self, text: str) -> tuple[str, str]:
        """Return the units where the names have none."""
        match = re.search(self.pixels_unless, text[:HEAD]) if self.pixels_unless else None
        if match is None:
            return self.units
        return ("px", "px/frame") if float(match[1]) == 1.0 else ("m", "m/s")

    def interval_in(self, text: str) -> float | None:
        """Return the time between the two images [s], None where the text does not say it."""
        match = re.search(self.interval, text[:HEAD]) if self.interval else None
        try:
            found = float(match[1]) * 1e-6 if match else 0.0
        except ValueError:
            return None
        return found if found > 0.0 else None

    def names_in(self, text: str) -> list[str]:
        """Return names of columns that stand in words of the head, [] where there are none.

        Raises
        ------
        FormatError
            When the head says that these are no planar vectors.
        """
        head = text[:HEAD]
        if head.startswith("#DaVis"):
            first = head.splitlines()[0]
            units = [unit for _, unit in re.findall(r'"([^"]*)"\s+"([^"]*)"', first)]
            if "2D-vector" not in first or len(units) < 3:
                raise FormatError(
                    'expected "2D-vector" and the units of position, position and velocity in the '
                    "header",
                    line=1,
                )
            each = [units[0], units[1], units[2], units[2]]
            return [f"{name} [{unit}]" for name, unit in zip("xyuv", each, strict=True)]
        if (match := _QUOTED.search(head)) is not None:
            return re.findall(r'"([^"]*)"', match[1])
        match = _UNQUOTED.search(head)
        return re.split(r"[\s,]+", match[1].strip().strip(",")) if match is not None else []


PLAIN: Final = Program("csv", "plain table", units=("m", "m/s"))
_FIJI: Final = Program(
    "fiji",
    "PIV plugin of ImageJ",
    y="down",
    columns=("x", "y", "ux1", "uy1", "mag1", "ang1", "p1", "second x", "second y", "mag2",
             "ang2", "p2", "former x", "former y", "mag0", "fiji flag"),
    units=("px", "px/frame"),
)  # fmt: skip
PROGRAMS: Final = (
    Program("davis", "DaVis text", r"\A#DaVis", y="up", zero_is_missing=True),
    Program(
        "insight",
        "Insight",
        r'(?i)\A\s*TITLE(?s:.*)"CHC"',
        y="up",
        interval=r'MicrosecondsPerDeltaT\s*=\s*"([\d.eE+-]+)"',
    ),
    Program(
        "pivlab",
        "PIVlab text",
        r"PIVlab|Vector type \[-\]",
        y="down",
        columns=("x", "y", "u", "v", "vector type"),
        pixels_unless=r"conversion factor xy \(px -> m\): *-?([\d.eE+-]+)",
    ),
    Program("dantec", "Dantec DynamicStudio", r">>\*HEADER\*<<|>>\*DATA\*<<|DSExport", y="up"),
    Program("tecplot", "Tecplot", r"(?i)\bVARIABLES\s*="),
    Program(
        "davis",
        "DaVis table",
        r'(?m)^"?x \[\w+\]"?[;,\t]"?y \[.*Velocity u \[',
        zero_is_missing=True,
    ),
    replace(_FIJI, sign=r"(?im)^\W*x\W+y\W+ux1\W+uy1\b"),
    Program("openpiv", "OpenPIV", r"(?i)\A\s*#\s*x\s+y\s+u\s+v\b", y="rows"),
)
_BY_WIDTH: Final = {
    16: _FIJI,
    **dict.fromkeys(
        range(4, 8), Program("openpiv", "rows of numbers", y="rows", columns=("x", "y", "u", "v"))
    ),
}
"""Programs that write neither names nor a sign, by how many columns they write."""


def program_of(text: str, *, width: int = 0) -> Program:
    """Return the program whose sign a text has, or that writes rows of some width without one."""
    if width:
        return _BY_WIDTH.get(width, PLAIN)
    head = text[:HEAD]
    return next((one for one in PROGRAMS if re.search(one.sign, head)), PLAIN)
