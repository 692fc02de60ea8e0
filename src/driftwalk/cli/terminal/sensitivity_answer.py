"""Output of `driftwalk sensitivity`: one JSON object, or a page for people."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.cli.terminal.answer import print_figures
from driftwalk.cli.terminal.output import print_table
from driftwalk.core.errors import InputError
from driftwalk.schema.shapes import short_class

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.runs import SensitivityResult

UNITS: Final = {"force_std": "_N", "tank_diameter": "_m"}
"""Suffixes that turn names of axes into keys of JSON."""
LISTED_COMPONENTS: Final = 3


def summary(study: Study, result: SensitivityResult) -> dict[str, Any]:
    """Return what ``--json`` prints: the answer with units in its keys."""
    found = result.sensitivity
    settings = study.assembly
    return {
        "settings": int(found["l1_distance"].size),
        "runs": study.sensitivity.runs,
        "axes": {key_of(str(name)): found[name].values for name in found["l1_distance"].dims},
        "classes": [str(name) for name in found["class"].values],
        "blocks": settings.blocks,
        "duration_s": found.attrs["duration_s"],
        "seed": study.sensitivity.seed,
        "reference": _reference(result.reference),
        "l1": _l1(found),
        "smallest_distance": _smallest(found),
        "components": _components(result.components),
        "sobol": _sobol(result.indices),
    }


def key_of(axis: str) -> str:
    """Return the name of an axis with its unit.

    Examples
    --------
    >>> key_of("force_std"), key_of("blocks")
    ('force_std_N', 'blocks')
    """
    return f"{axis}{UNITS.get(axis, '')}"


def _reference(reference: xr.Dataset) -> dict[str, Any]:
    facts = reference.attrs
    names = [str(name) for name in reference["class"].values]
    by_class = {
        key: dict(zip(names, reference[name].values, strict=True))
        for key, name in (
            ("proportions", "proportion"),
            ("standard_deviations", "standard_deviation"),
        )
    }
    keys = (
        "complete", "runs", "realisations", "left_out", "blocks", "latching", "hidden_face_drag",
        "drag_coefficient", "force_std_N", "force_interval_s",
        "mean_pairwise_l1", "expected_pairwise_l1",
    )  # fmt: skip
    return {**by_class, **{key: facts[key] for key in keys}}


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


def _components(components: xr.Dataset | None) -> dict[str, Any] | None:
    from driftwalk.assembly import disconnected_alignment

    if components is None:
        return None
    try:
        aligned: dict[str, float] | None = disconnected_alignment(components)._asdict()
    except InputError:
        # All classes that vary are of one kind.
        aligned = None
    return {
        "explained_variance_ratio": components["explained_variance_ratio"].values,
        "noise_share": components.attrs["noise_share"],
        "disconnected_alignment": aligned,
    }


def _sobol(indices: xr.Dataset | None) -> dict[str, Any] | None:
    if indices is None:
        return None
    inputs = [key_of(str(name)) for name in indices["input"].values]
    orders = ("first_order", "total_order")
    keys = [f"{order}{what}" for order in orders for what in ("", "_half_width", "_corrected")]
    return {
        "samples": indices.attrs["samples"],
        "settings": indices.sizes["setting"],
        "pure_noise_first_order_half_width": indices.attrs["pure_noise_first_order_half_width"],
        "outputs": {
            str(name): {
                "noise_share": indices["noise_share"].values[row],
                **{key: dict(zip(inputs, indices[key].values[row], strict=True)) for key in keys},
            }
            for row, name in enumerate(indices["output"].values)
        },
    }


def print_answer(study: Study, result: SensitivityResult, folder: Path) -> None:
    """Print the answer for people, and where the figures are."""
    found, facts = result.sensitivity, result.reference.attrs
    shape = " x ".join(str(found.sizes[name]) for name in found["l1_distance"].dims)
    names = ", ".join(str(name) for name in found["l1_distance"].dims)
    print(
        f"{shape} settings ({names}), {study.sensitivity.runs} runs of "
        f"{found.attrs['duration_s']:g} s each"
    )
    print(
        f"reference: {facts['blocks']} blocks, C_d = {facts['drag_coefficient']:.4g}, "
        f"σ_F = {1e3 * facts['force_std_N']:.4g} mN, {facts['realisations']} realisations"
    )
    _print_reference(result.reference)
    print(
        f"l1 distance of two realisations: {facts['mean_pairwise_l1']:.4f} on average; "
        f"{facts['expected_pairwise_l1']:.4f} is expected from the number of runs alone"
    )
    _print_distances(found)
    _print_components(result.components)
    if result.indices is not None:
        _print_indices(result.indices)
    print_figures(folder)


def _print_reference(reference: xr.Dataset) -> None:
    seen = reference.isel({"class": reference["count"].values > 0})
    rows = [
        [short_class(str(name)), f"{share:.4f}", f"{spread:.4f}"]
        for name, share, spread in zip(
            seen["class"].values,
            seen["proportion"].values,
            seen["standard_deviation"].values,
            strict=True,
        )
    ]
    rows.append(["complete", f"{reference.attrs['complete']:.4f}", ""])
    print_table(rows, columns=["class", "share", "sd over realisations"])


def _print_distances(found: xr.Dataset) -> None:
    l1, smallest = _l1(found), _smallest(found)
    if smallest is None:
        print("l1 distance to the reference: no setting has its number of blocks")
        return
    print(
        f"l1 distance to the reference: {l1['min']:.4f} to {l1['max']:.4f}, median "
        f"{l1['median']:.4f}; by chance {l1['noise_floor_mean']:.4f} (95 %: "
        f"{l1['noise_floor_95']:.4f}), which {l1['share_above_floor']:.0%} of the settings exceed"
    )
    place = ", ".join(f"{name} = {_text(v)}" for name, v in list(smallest.items())[:-1])
    print(f"smallest: {smallest['l1_distance']:.4f} at {place}")


def _print_components(components: xr.Dataset | None) -> None:
    if components is None:
        return
    ratio = components["explained_variance_ratio"].values
    shares = ", ".join(f"{share:.1%}" for share in ratio[:LISTED_COMPONENTS])
    more = ", ..." if ratio.size > LISTED_COMPONENTS else ""
    text = f"principal components: {shares}{more} of the variance"
    aligned = (_components(components) or {})["disconnected_alignment"]
    if aligned is not None and math.isfinite(aligned["complete_correlation"]):
        text += (
            f"; the first has correlation {aligned['complete_correlation']:.2f} with the share of "
            "complete runs"
        )
    print(text)


def _print_indices(indices: xr.Dataset) -> None:
    inputs = [str(name) for name in indices["input"].values]
    heads = ["Sobol' indices", "noise", *inputs, *(f"total {name}" for name in inputs)]
    rows = []
    for name, noise, first, total in zip(
        indices["output"].values,
        indices["noise_share"].values,
        indices["first_order_corrected"].values,
        indices["total_order_corrected"].values,
        strict=True,
    ):
        if math.isfinite(noise):
            cells = [f"{value:.2f}" if math.isfinite(value) else "" for value in (*first, *total)]
            rows.append([str(name), f"{noise:.1%}", *cells])
    print_table(rows, columns=heads)
    width = indices.attrs["pure_noise_first_order_half_width"]
    print(f"the indices are corrected for noise; those within {width:.2f} mean nothing")


def _text(value: Any) -> str:
    return str(value) if isinstance(value, str) else f"{value:.6g}"
