"""The answer of a sensitivity study: distances to the reference, components, Sobol' indices."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.units import in_percent
from driftwalk.schema.answers.parts import Answer, Part, Table, by_name, each
from driftwalk.schema.kinds.sensitivity import axis_number
from driftwalk.schema.shapes import short_class

if TYPE_CHECKING:
    import xarray as xr

LISTED_COMPONENTS: Final = 3
"""Components whose shares are listed: with three of them, most of the variance is said."""
_REFERENCE: Final = (
    *("complete", "runs", "realisations", "left_out", "blocks", "latching", "hidden_face_drag"),
    *("drag_coefficient", "force_std_N", "force_interval_s"),
    *("mean_pairwise_l1", "expected_pairwise_l1"),
)
_INDICES: Final = tuple(
    f"{order}{what}"
    for order in ("first_order", "total_order")
    for what in ("", "_half_width", "_corrected")
)


def sensitivity_answer(
    found: xr.Dataset,
    *,
    reference: xr.Dataset,
    components: xr.Dataset | None = None,
    sobol: xr.Dataset | None = None,
    aligned: Mapping[str, float] | None = None,
) -> Answer:
    """Return the answer of a sensitivity study; the caller knows its warnings.

    Parameters
    ----------
    found : xarray.Dataset
        A `sensitivity`.
    reference : xarray.Dataset
        The `outcome_distribution` that it is compared with.
    components, sobol : xarray.Dataset, optional
        Its `components` and `sobol_indices`.
    aligned : mapping, optional
        How the first component is aligned with the disconnected classes.
    """
    settings, facts = found.attrs, reference.attrs
    axes = [str(name) for name in found["l1_distance"].dims]
    l1, smallest = _l1(found), _smallest(found)
    parts: list[Part] = [
        f"{' x '.join(str(found.sizes[name]) for name in axes)} settings ({', '.join(axes)}), "
        f"{settings['runs']} runs of {settings['duration_s']:g} s each",
        f"reference: {facts['blocks']} blocks, C_d = {facts['drag_coefficient']:.4g}, "
        f"σ_F = {1e3 * facts['force_std_N']:.4g} mN, {facts['realisations']} realisations",
        _reference_table(reference),
        # Said before the map: a distance below it is no difference.
        f"l1 distance of two realisations: {facts['mean_pairwise_l1']:.4f} on average; "
        f"{facts['expected_pairwise_l1']:.4f} is expected from the number of runs alone",
        *_distances(l1, smallest),
    ]
    if components is not None:
        parts.append(_variance(components, aligned))
    if sobol is not None:
        parts += _index_table(sobol)
    answer = {
        "settings": int(found["l1_distance"].size),
        "runs": settings["runs"],
        "axes": {key_of(name): found[name].values for name in axes},
        "classes": [str(name) for name in found["class"].values],
        "blocks": facts["blocks"],
        "duration_s": settings["duration_s"],
        "seed": settings["seed"],
        "reference": {
            "proportions": by_name(reference, "class", "proportion"),
            "standard_deviations": by_name(reference, "class", "standard_deviation"),
            **{key: facts[key] for key in _REFERENCE},
        },
        "l1": l1,
        "smallest_distance": smallest,
        "components": None
        if components is None
        else {
            "explained_variance_ratio": components["explained_variance_ratio"].values,
            "noise_share": components.attrs["noise_share"],
            "disconnected_alignment": aligned,
        },
        "sobol": None if sobol is None else _sobol(sobol),
    }
    return Answer(parts, answer, [])


def key_of(axis: str) -> str:
    """Return the name of an axis with its unit.

    Examples
    --------
    >>> key_of("force_std"), key_of("blocks")
    ('force_std_N', 'blocks')
    """
    return axis_number(axis).key


def _l1(found: xr.Dataset) -> dict[str, Any]:
    """Return the range of the distances; null where no setting can be compared."""
    distance = found["l1_distance"].values
    known = distance[np.isfinite(distance)]
    floors = {name: found.attrs[name] for name in ("noise_floor_mean", "noise_floor_95")}
    if not known.size:
        return {**dict.fromkeys(("min", "median", "max", "share_above_floor")), **floors}
    return {
        "min": known.min(),
        "median": np.median(known),
        "max": known.max(),
        "share_above_floor": float((known > floors["noise_floor_95"]).mean()),
        **floors,
    }


def _smallest(found: xr.Dataset) -> dict[str, Any] | None:
    """Return the setting that is closest to the reference."""
    distance = found["l1_distance"]
    if not np.isfinite(distance.values).any():
        return None
    at = np.unravel_index(int(np.nanargmin(distance.values)), distance.shape)
    place = zip(distance.dims, at, strict=True)
    return {
        **{key_of(str(name)): found[name].values[index] for name, index in place},
        "l1_distance": distance.values[at],
    }


def _sobol(sobol: xr.Dataset) -> dict[str, Any]:
    inputs = [key_of(str(name)) for name in sobol["input"].values]
    width = "pure_noise_first_order_half_width"
    return {
        "samples": sobol.attrs["samples"],
        "settings": sobol.sizes["setting"],
        width: sobol.attrs[width],
        "outputs": by_name(
            sobol,
            "output",
            lambda one: {
                "noise_share": float(one["noise_share"]),
                **{key: dict(zip(inputs, one[key].values, strict=True)) for key in _INDICES},
            },
        ),
    }


def _reference_table(reference: xr.Dataset) -> Table:
    rows = [
        [
            short_class(str(one["class"].values)),
            f"{float(one['proportion']):.4f}",
            f"{float(one['standard_deviation']):.4f}",
        ]
        for one in each(reference, "class")
        if one["count"] > 0
    ]
    rows.append(["complete", f"{reference.attrs['complete']:.4f}"])
    return Table(rows, ["class", "share", "sd over realisations"])


def _distances(l1: dict[str, Any], smallest: dict[str, Any] | None) -> list[Part]:
    if smallest is None:
        return ["l1 distance to the reference: no setting has its number of blocks"]
    place = ", ".join(
        f"{name} = {value if isinstance(value, str) else format(value, '.6g')}"
        for name, value in list(smallest.items())[:-1]
    )
    return [
        f"l1 distance to the reference: {l1['min']:.4f} to {l1['max']:.4f}, median "
        f"{l1['median']:.4f}; by chance {l1['noise_floor_mean']:.4f} (95 %: "
        f"{l1['noise_floor_95']:.4f}), which {in_percent(l1['share_above_floor'])} of the settings "
        "exceed",
        f"smallest: {smallest['l1_distance']:.4f} at {place}",
    ]


def _variance(components: xr.Dataset, aligned: Mapping[str, float] | None) -> str:
    ratio = components["explained_variance_ratio"].values
    shares = ", ".join(in_percent(share, decimals=1) for share in ratio[:LISTED_COMPONENTS])
    more = ", ..." if ratio.size > LISTED_COMPONENTS else ""
    text = f"principal components: {shares}{more} of the variance"
    if aligned is None or not isfinite(aligned["complete_correlation"]):
        return text
    return (
        f"{text}; the first has correlation {aligned['complete_correlation']:.2f} with the share "
        "of complete runs"
    )


def _index_table(sobol: xr.Dataset) -> list[Part]:
    inputs = [str(name) for name in sobol["input"].values]
    orders = ("first_order_corrected", "total_order_corrected")
    rows = [
        [
            str(one["output"].values),
            in_percent(float(one["noise_share"]), decimals=1),
            *(f"{v:.2f}" if isfinite(v) else "" for key in orders for v in one[key].values),
        ]
        for one in each(sobol, "output")
        if isfinite(one["noise_share"])
    ]
    width = sobol.attrs["pure_noise_first_order_half_width"]
    return [
        Table(rows, ["Sobol' indices", "noise", *inputs, *(f"total {name}" for name in inputs)]),
        f"the indices are corrected for noise; those within {width:.2f} mean nothing",
    ]
