"""Principal component analysis of the class proportions over settings.

The proportions are centred and not scaled. They have one unit already, and scaling would lift a
class that comes once in a thousand runs, which is mostly noise, to the weight of the common ones.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.outcomes.distribution import is_complete, sampling_variance
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.schema.check import build_dataset, require_kind

if TYPE_CHECKING:
    import xarray as xr


# Singular values below this part of the largest are rounding; chosen by hand.
RANK_TOLERANCE = 1e-9


class Alignment(NamedTuple):
    """Result of `disconnected_alignment`."""

    loading_share: float
    """Share of the squared loadings that lies on disconnected classes, 0 to 1."""
    class_share: float
    """Share of disconnected classes among those that vary: `loading_share` of a component that
    prefers none."""
    cosine: float
    """Cosine between the component and the direction from complete to disconnected, -1 to 1."""
    complete_correlation: float
    """Correlation over settings between the score and the share of complete runs, -1 to 1; NaN when
    that share does not vary."""


def principal_components(
    sensitivity_or_proportions: xr.Dataset | xr.DataArray | npt.ArrayLike,
    *,
    components: int | None = None,
    classes: Sequence[str] | None = None,
) -> xr.Dataset:
    """Return the principal components of class proportions over settings.

    Parameters
    ----------
    sensitivity_or_proportions : xarray.Dataset, xarray.DataArray or array_like
        A `sensitivity` dataset, proportions with a dimension ``class``, or an array, shape
        (..., class). A setting with a proportion that is not finite is left out; its scores are
        NaN.
    components : int, optional
        Number of components, >= 1; default: all along which the settings vary.
    classes : sequence of str, optional
        Class names, for an array; default: "0", "1", ...

    Returns
    -------
    xarray.Dataset
        Kind "components": ``score`` (axes..., component), ``loading`` (class, component),
        ``explained_variance_ratio`` (component), ``mean`` (class), ``complete_correlation``
        (component), see `Alignment`; components are counted from 1.
        Loadings have length 1 and the largest of a component in size is positive; a class that is
        the same in all settings, one that never occurs for example, has loading 0. ``attrs``: the
        dataset's, ``settings``, ``left_out``, ``total_variance`` (sum over the classes of the
        variance over settings) and ``noise_share``: the part of it that comes from the finite
        number of runs, NaN where their number is not known.

    Raises
    ------
    InputError
        When there are fewer than two settings, they do not vary, or more components are asked for
        than there are.

    Notes
    -----
    With X the settings by classes, minus the mean over settings, and X = U S V^T: loadings V,
    scores U S, explained variance S^2 / sum S^2. Proportions sum to 1, so C classes have at most
    C - 1 components.

    Examples
    --------
    >>> found = principal_components([[1.0, 0.0, 0.0], [0.5, 0.5, 0.0]], classes=["O", "2+2", "I"])
    >>> found["loading"].values.round(3).tolist()
    [[0.707], [-0.707], [0.0]]
    """
    proportion, runs, attrs = _as_proportions(sensitivity_or_proportions, classes)
    table = proportion.values.reshape(-1, proportion.sizes["class"])
    used = np.isfinite(table).all(axis=1)
    mean, own, loading, ratio, variance = _decompose(table[used], components)
    score = np.full((len(table), ratio.size), np.nan)
    score[used] = own
    complete = table[used][:, is_complete([str(name) for name in proportion["class"].values])]
    shape = (*proportion.shape[:-1], ratio.size)
    return build_dataset(
        "components",
        {
            "score": ((*proportion.dims[:-1], "component"), score.reshape(shape)),
            "loading": (("class", "component"), loading),
            "explained_variance_ratio": ("component", ratio),
            "complete_correlation": ("component", _correlation(own, complete.sum(axis=1))),
            "mean": ("class", mean),
        },
        {
            **{str(name): one for name, one in proportion.coords.items()},
            "component": ("component", np.arange(1, ratio.size + 1)),
        },
        {
            **attrs,
            "settings": int(used.sum()),
            "left_out": int((~used).sum()),
            "total_variance": variance,
            "noise_share": _noise_variance(table[used], runs[used]) / variance,
        },
    )


def disconnected_alignment(components: xr.Dataset, *, component: int = 1) -> Alignment:
    """Return how strongly a principal component is aligned with the disconnected classes.

    A class with "+" in its name is disconnected. Classes with loading 0 in every component do not
    vary and do not count.

    Parameters
    ----------
    components : xarray.Dataset
        A `components` dataset.
    component : int
        Which component, counted from 1.

    Returns
    -------
    Alignment
        The share of the squared loadings on disconnected classes, the share of these classes, and
        the cosine with the direction in which every disconnected class gains alike and every
        complete one loses alike, ``+1/n_disconnected`` and ``-1/n_complete``, normed; and the
        correlation of the score with the share of complete runs. Signs are the component's.

    Raises
    ------
    InputError
        When it is no `components` dataset, has no such component, or all classes that vary are
        complete, or all are disconnected.

    Examples
    --------
    >>> found = principal_components([[1.0, 0.0], [0.2, 0.8]], classes=["O", "2+2"])
    >>> alignment = disconnected_alignment(found)
    >>> round(alignment.loading_share, 12), round(abs(alignment.cosine), 12)
    (0.5, 1.0)
    """
    require_kind(components, "components", "principal_components makes one")
    there = [int(number) for number in components["component"].values]
    if component not in there:
        raise InputError(f"there is no component {component}: there are {len(there)}, from 1")
    loading = components["loading"].sel(component=component).values
    varies = (components["loading"].values != 0).any(axis=1)
    apart = ~is_complete([str(name) for name in components["class"].values]) & varies
    whole = varies & ~apart
    if not apart.any() or not whole.any():
        raise InputError(
            "no direction from complete to disconnected: among the classes that vary there must "
            "be both"
        )
    direction = apart / apart.sum() - whole / whole.sum()
    return Alignment(
        loading_share=float((loading[apart] ** 2).sum() / (loading**2).sum()),
        class_share=float(apart.sum() / varies.sum()),
        cosine=float(loading @ direction / (np.linalg.norm(loading) * np.linalg.norm(direction))),
        complete_correlation=float(components["complete_correlation"].sel(component=component)),
    )


def _as_proportions(
    given: xr.Dataset | xr.DataArray | npt.ArrayLike, classes: Sequence[str] | None
) -> tuple[xr.DataArray, Floats, dict[str, Any]]:
    """Return proportions (..., class), the runs of every setting (NaN unknown), attributes."""
    import xarray as xr

    named = isinstance(given, xr.Dataset | xr.DataArray)
    if named and classes is not None:
        raise InputError("classes: only for an array; a dataset has its class names")
    attrs: dict[str, Any] = {}
    runs = None
    if isinstance(given, xr.Dataset):
        if "proportion" not in given:
            raise InputError("no class proportions to decompose: 'proportion' is missing")
        attrs = {k: v for k, v in given.attrs.items() if k not in ("kind", "schema_version")}
        runs = given.get("runs")
        given = given["proportion"]
    if not isinstance(given, xr.DataArray):
        given = _named_array(np.asarray(given, dtype=np.float64), classes)
    if "class" not in given.dims or "class" not in given.coords or given.ndim < 2:
        raise InputError(
            "proportions need a dimension 'class' with names and at least one other, got "
            f"dimensions {given.dims}"
        )
    proportion = given.transpose(..., "class")
    present = proportion.values[np.isfinite(proportion.values)]
    if ((present < 0) | (present > 1 + RANK_TOLERANCE)).any():
        raise InputError("proportions must lie between 0 and 1: divide counts by the runs")
    axes = proportion.dims[:-1]
    if runs is None:
        return proportion, np.full(math.prod(proportion.shape[:-1]), np.nan), attrs
    return proportion, runs.transpose(*axes).values.astype(np.float64).ravel(), attrs


def _named_array(values: Floats, classes: Sequence[str] | None) -> xr.DataArray:
    import xarray as xr

    if values.ndim < 2:
        raise InputError(f"proportions: expected shape (..., class), got {values.shape}")
    number = values.shape[-1]
    names = [str(i) for i in range(number)] if classes is None else [str(c) for c in classes]
    if len(names) != number:
        raise InputError(f"classes: {len(names)} names for {number} classes")
    axes = ["setting"] if values.ndim == 2 else [f"axis_{i}" for i in range(values.ndim - 1)]
    return xr.DataArray(
        values, dims=(*axes, "class"), coords={"class": np.array(names, dtype=object)}
    )


def _decompose(
    table: Floats, components: int | None
) -> tuple[Floats, Floats, Floats, Floats, float]:
    """Return mean, scores, loadings, ratios and variance of settings by classes, all finite."""
    settings = len(table)
    if settings < 2:
        raise InputError(f"principal components need at least two settings, got {settings}")
    if components is not None and components < 1:
        raise InputError(f"components must be at least 1, got {components}")
    mean = table.mean(axis=0)
    # A class that does not vary is taken out, so its loading is 0 and no rounding.
    varies = np.ptp(table, axis=0) > RANK_TOLERANCE
    if not varies.any():
        raise InputError("the proportions are the same in all settings: nothing varies")
    u, size, v = np.linalg.svd((table - mean)[:, varies], full_matrices=False)
    rank = int((size > RANK_TOLERANCE * size[0]).sum())
    kept = rank if components is None else components
    if kept > rank:
        raise InputError(
            f"components: asked for {components}, but these settings vary along {rank} only"
        )
    v = v[:kept]
    sign = np.sign(v[np.arange(kept), np.abs(v).argmax(axis=1)])
    loading = np.zeros((table.shape[1], kept))
    loading[varies] = (v * sign[:, None]).T
    score, ratio = u[:, :kept] * size[:kept] * sign, size[:kept] ** 2 / (size**2).sum()
    return mean, score, loading, ratio, float((size**2).sum() / (settings - 1))


def _correlation(score: Floats, complete: Floats) -> Floats:
    """Return the correlation of each column of scores with the share of complete runs."""
    if np.ptp(complete) <= RANK_TOLERANCE:
        return np.full(score.shape[1], np.nan)
    deviation = complete - complete.mean()
    size = np.linalg.norm(score, axis=0) * np.linalg.norm(deviation)
    return np.asarray(score.T @ deviation / size)


def _noise_variance(table: Floats, runs: Floats) -> float:
    """Return the mean over settings of the classes' summed sampling variance; NaN when unknown."""
    if not (runs >= 2).all():
        return float("nan")
    return float(sampling_variance(np.minimum(table, 1.0), runs[:, None]).sum(axis=1).mean())
