"""The part of a page on principal components: settings as points, classes as arrows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from driftwalk.page.arrays import numbers
from driftwalk.page.axes import axis_words, require_axes, value_words
from driftwalk.page.parts import Section, section, settings_of
from driftwalk.page.sections.assemblies.classes import cells_of
from driftwalk.plot.components import biplot_of

if TYPE_CHECKING:
    import xarray as xr

MOST_ARROWS: Final = 20


def biplot_section(components: xr.Dataset, sensitivity: xr.Dataset) -> Section:
    """Return the settings on their first two principal components, the classes as arrows."""
    require_axes(sensitivity)
    found = biplot_of(components)
    dims = [str(dim) for dim in components["score"].dims if dim != "component"]
    order = np.argsort(-np.hypot(*found.tips.T), kind="stable")[:MOST_ARROWS]
    values = {
        name: numbers(sensitivity[name].transpose(*dims).values.ravel())
        for name in ("complete", "l1_distance")
        if name in sensitivity and set(map(str, sensitivity[name].dims)) == set(dims)
    }
    settings = settings_of(
        *([f"{axis_words(n)} {value_words(n, v)}" for v in sensitivity[n].values] for n in dims)
    )
    return section(
        "biplot", "biplot", "Principal components",
        "Points are settings, arrows the loadings of the classes, "
        f"{found.factor:.3g} times as long.",
        axes=[
            {"label": f"component {k}", "share": share}
            for k, share in enumerate(found.shares.tolist(), start=1)
        ],
        points={
            "x": numbers(found.points[:, 0]), "y": numbers(found.points[:, 1]),
            "names": [", ".join(words) for words in settings], "values": values or None,
        },
        arrows=[
            {
                "name": found.names[k], "x": float(found.tips[k, 0]), "y": float(found.tips[k, 1]),
                "cells": cells_of(found.names[k]),
            }
            for k in sorted(order.tolist())
        ],
    )  # fmt: skip
