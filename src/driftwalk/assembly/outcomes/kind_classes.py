"""Outcome classes that know the kinds of the blocks: coloured polyominoes.

A shape is written with the kinds of its blocks, row by row from the top as the shape is drawn:
``T:ABAA`` has the bar A B A and an A below. Of the ways to lay the shape on its drawing the one
with the kinds first in the alphabet counts. Faces do not count, only kinds.
"""

from __future__ import annotations

from collections import Counter
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from driftwalk.assembly.lattice.polyomino import (
    Chirality,
    name_of,
    orientations,
    polyomino_cells,
    shape_order,
    shape_size,
)
from driftwalk.core.errors import InputError
from driftwalk.schema.check import require_kind
from driftwalk.schema.shapes import Cell, moved_to_origin

if TYPE_CHECKING:
    import xarray as xr


def kind_classes(assembly: xr.Dataset) -> dict[str, int]:
    """Count the runs by outcome class with the kinds of the blocks, the most frequent first.

    Parameters
    ----------
    assembly : xarray.Dataset
        An `assembly` of blocks of several kinds, ``[assembly] binding`` of its study.

    Returns
    -------
    dict of str to int
        Number of runs by class, such as ``"2:AB+1:A+1:B"``; names of several letters are parted by
        commas. Runs without an outcome are left out.

    Raises
    ------
    InputError
        When the dataset is of another kind, or its blocks are all of one.

    Examples
    --------
    >>> import driftwalk as dw
    >>> kinds = [{"name": n, "count": 1, "faces": ["N", "S", "N", "S"]} for n in "AB"]
    >>> study = dw.Study(assembly={"blocks": 2, "binding": {"kinds": kinds}})
    >>> found = dw.assembly.assemble(study, dw.uniform_flow(0.0, 0.0), runs=3, duration=0.1)
    >>> dw.assembly.kind_classes(found)
    {'1:A+1:B': 3}
    """
    from driftwalk.model import parse_study

    require_kind(assembly, "assembly")
    if "kind" not in assembly:
        raise InputError(
            "the blocks are all of one kind: outcome_distribution counts their classes"
        )
    settings = parse_study(assembly.attrs["study"]).assembly
    names = [kind.name for kind in settings.binding.kinds] if settings.binding is not None else []
    whole = (assembly[name].values for name in ("outcome", "cell", "kind", "assembly"))
    found = Counter[str]()
    for outcome, cell, kind, label in zip(*whole, strict=True):
        if outcome < 0:
            continue
        shapes = []
        for one in np.unique(label):
            own = label == one
            cells = tuple(map(tuple, cell[own].tolist()))
            kinds = tuple(names[place] for place in kind[own])
            shapes.append(_coloured(cells, kinds, settings.chirality))
        found["+".join(sorted(shapes, key=_order))] += 1
    return dict(found.most_common())


@lru_cache(maxsize=1 << 16)
def _coloured(cells: tuple[Cell, ...], kinds: tuple[str, ...], chirality: Chirality) -> str:
    name = name_of(moved_to_origin(cells), chirality)
    drawn = sorted(map(tuple, polyomino_cells(name).tolist()))
    ways = []
    for turned in orientations(cells, chirality):
        low = min(x for x, _ in turned), min(y for _, y in turned)
        placed = {
            (x - low[0], y - low[1]): kind for (x, y), kind in zip(turned, kinds, strict=True)
        }
        if sorted(placed) == drawn:
            ways.append([placed[at] for at in sorted(placed, key=lambda at: (-at[1], at[0]))])
    parted = "," if any(len(kind) > 1 for kind in kinds) else ""
    return f"{name}:{parted.join(min(ways))}"


def _order(shape: str) -> tuple[int, tuple[int, int, str, str], str]:
    name, _, kinds = shape.partition(":")
    return -shape_size(name), shape_order(name), kinds
