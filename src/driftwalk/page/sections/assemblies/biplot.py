"""The part of a page on principal components: settings as points, classes as arrows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.page.arrays import number, numbers
from driftwalk.page.axes import MAP_AXES, axis_words, require_axes, value_words
from driftwalk.page.parts import Section, require, section, settings_of
from driftwalk.plot.parts.assembly_labels import class_names

if TYPE_CHECKING:
    import xarray as xr

LONGEST_ARROW: Final = 0.9
MOST_ARROWS: Final = 20


def biplot_section(components: xr.Dataset, sensitivity: xr.Dataset) -> Section:
    """Return the settings on their first two principal components, the classes as arrows."""
    require(components, "score", "loading", "explained_variance_ratio", "class")
    require_axes(sensitivity)
    if components.sizes["component"] < MAP_AXES:
        raise InputError("all outcomes lie on one line: there is one principal component")
    dims = [str(dim) for dim in components["score"].dims if dim != "component"]
    score = (
        components["score"]
        .transpose(*dims, "component")
        .values.reshape(-1, components.sizes["component"])[:, :2]
    )
    loading = components["loading"].transpose("class", "component").values[:, :2]
    reach, longest = (float(np.nanmax(np.hypot(*v.T), initial=0.0)) for v in (score, loading))
    factor = LONGEST_ARROW * reach / longest if reach and longest else 1.0
    tips = factor * loading
    order = np.argsort(-np.hypot(*tips.T), kind="stable")[:MOST_ARROWS]
    names = class_names(components)
    share = components["explained_variance_ratio"].values
    values = {
        name: numbers(sensitivity[name].transpose(*dims).values.ravel())
        for name in ("complete", "l1_distance")
        if name in sensitivity and set(map(str, sensitivity[name].dims)) == set(dims)
    }
    return section(
        "biplot", "biplot", "Principal components",
        f"Points are settings, arrows the loadings of the classes, {factor:.3g} times as long.",
        axes=[{"label": f"component {k + 1}", "share": number(share[k])} for k in range(2)],
        points={
            "x": numbers(score[:, 0]), "y": numbers(score[:, 1]),
            "names": _setting_names(sensitivity, dims), "values": values or None,
        },
        arrows=[
            {"name": names[k], "x": float(tips[k, 0]), "y": float(tips[k, 1])}
            for k in sorted(order.tolist())
        ],
    )  # fmt: skip


def _setting_names(sensitivity: xr.Dataset, dims: list[str]) -> list[str]:
    every = [[f"{axis_words(n)} {value_words(n, v)}" for v in sensitivity[n].values] for n in dims]
    return [", ".join(words) for words in settings_of(*every)]
