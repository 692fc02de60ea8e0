"""The part of a page on Sobol' indices."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Final

import numpy as np

from driftwalk.page.arrays import number
from driftwalk.page.axes import axis_words
from driftwalk.page.parts import Section, require, section

if TYPE_CHECKING:
    import xarray as xr

MOST_CLASSES_OF_INDICES: Final = 12
_INDICES: Final = (
    "first_order",
    "first_order_half_width",
    "total_order",
    "total_order_half_width",
)


def sobol_section(sobol: xr.Dataset) -> Section:
    """Return the Sobol' indices of the share of complete runs and of the largest classes."""
    require(sobol, "first_order", "total_order", "output", "input")
    inputs = [axis_words(str(name)) for name in sobol["input"].values]
    variance = sobol["variance"].values if "variance" in sobol else np.ones(sobol.sizes["output"])
    order = [0, *(1 + np.argsort(-variance[1:], kind="stable")[:MOST_CLASSES_OF_INDICES])]
    rows = []
    for output, k in product(sorted(map(int, order)), range(len(inputs))):
        found = {
            name: sobol[name].transpose("output", "input").values[output, k]
            for name in _INDICES
            if name in sobol
        }
        rows.append(
            [
                str(sobol["output"].values[output]),
                inputs[k],
                *(number(found.get(name)) for name in _INDICES),
            ]
        )
    columns = ["output", "input", "first order", "± half width", "total", "± half width"]
    return section(
        "sobol", "table", "Sobol' indices",
        "Share of an output's variance that an input explains alone (first order), "
        "and together with the others (total).",
        columns=columns, rows=rows,
    )  # fmt: skip
