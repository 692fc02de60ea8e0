"""Draw outcomes with and without drag on hidden faces: python picture.py FIGURE.png [LATCHING].

1000 runs of each; LATCHING is that of the study, by default "connector".
"""

from __future__ import annotations

import sys
from pathlib import Path

from model import simulate

import driftwalk as dw
from driftwalk.plot.parts.style import DOUBLE_COLUMN_MM, new_figure, print_style

RUNS = 1000
DPI = 130


def main(file: str, latching: str = "connector") -> None:
    """Simulate both and write the figure."""
    without, full = (
        simulate(faces, runs=RUNS, changes={"assembly.latching": latching})
        for faces in ("none", "full")
    )
    labels = ("hidden faces without drag", "with the drag of free faces")
    with print_style():
        figure = new_figure(width_mm=DOUBLE_COLUMN_MM, height_mm=76.0)
        dw.plot.outcomes(without, figure.add_subplot(), beside=full, labels=labels)
        figure.savefig(Path(file), dpi=DPI, metadata={"Software": None})


if __name__ == "__main__":
    main(*sys.argv[1:])
