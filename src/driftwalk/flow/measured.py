"""Flags and warnings of a field that was taken from a recording."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from driftwalk.flow.arena import Outline
from driftwalk.flow.grid import Grid
from driftwalk.schema import FLAGS

Mask = npt.NDArray[np.bool_]


def flags_of(grid: Grid, outline: Outline | None, measured: Mask) -> npt.NDArray[np.int8]:
    """Return the flag of every cell.

    Parameters
    ----------
    grid : Grid
        The cells.
    outline : Outline or None
        The tank. A cell that its wall cuts belongs to it when its centre does or when it is
        measured; without a tank every cell does.
    measured : ndarray of bool, shape (ny, nx)
        Which cells have data.
    """
    in_tank = np.ones(grid.shape, dtype=bool)
    if outline is not None:
        x, y = (part.ravel() for part in grid.nodes())
        in_tank = measured | (outline.depth(x, y) >= 0.0).reshape(grid.shape)
    flag = np.where(in_tank, FLAGS["filled"], FLAGS["outside"])
    flag[measured] = FLAGS["measured"]
    return flag.astype(np.int8)


def measured_share(flag: npt.NDArray[np.int8]) -> float:
    """Return the share of measured cells among those of the tank."""
    in_tank = np.count_nonzero(flag != FLAGS["outside"])
    return float(np.count_nonzero(flag == FLAGS["measured"]) / in_tank)


def coverage_warnings(
    share: float, *, used: int, beyond: int, cells: str = "the tank's cells"
) -> list[str]:
    """Return what the user of a field has to know of its coverage, in sentences.

    Parameters
    ----------
    share : float
        Share of the cells that are measured.
    used, beyond : int
        Samples in the tank, and beyond its wall.
    cells : str, optional
        What the share is of.

    Examples
    --------
    >>> coverage_warnings(0.9, used=100, beyond=0)
    []
    """
    sentences = []
    # With fewer measured cells the field is mostly a guess; chosen by hand.
    if share < 0.25:
        sentences.append(
            f"Only {100.0 * share:.0f} % of {cells} are measured, the others are filled "
            "in: record for longer, or use larger cells."
        )
    if beyond > math.ceil(0.01 * used):
        sentences.append(
            f"{beyond} of {used + beyond} samples lie beyond the wall of the tank and were left "
            "out: check the scale, the origin and the arena."
        )
    return sentences
