"""Datasets for the tests of the figures of self-assembly, made up: no block was simulated."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import xarray as xr

ARENA = json.dumps({"shape": "circle", "diameter_m": 0.3, "center_m": [0.0, 0.0]})
CLASSES: dict[tuple[int, str], list[str]] = {
    (2, "merged"): ["2", "1+1"],
    (4, "merged"): ["I", "O", "T", "S", "L", "I3+1", "L3+1", "2+2", "2+1+1", "1+1+1+1"],
    (4, "distinct"): ["I", "O", "T", "S", "Z", "L", "J", "I3+1", "L3+1", "2+2", "2+1+1", "1+1+1+1"],
}
REFERENCE = {"reference_drag_coefficient": 0.45, "reference_force_std_N": 0.55e-3}
COMPLETE_SHARE = 0.93


def free_polyominoes(size: int) -> list[str]:
    """Return the codes of all free polyominoes of a size, by growing them cell by cell."""

    def code(cells: frozenset[tuple[int, int]]) -> str:
        low = [min(cell[axis] for cell in cells) for axis in (0, 1)]
        moved = {(x - low[0], y - low[1]) for x, y in cells}
        width, height = (1 + max(cell[axis] for cell in moved) for axis in (0, 1))
        rows = ("".join(".x"[(x, y) in moved] for x in range(width)) for y in range(height))
        return "/".join(rows)

    def images(cells: frozenset[tuple[int, int]]) -> list[str]:
        found = []
        for _ in range(4):
            cells = frozenset((-y, x) for x, y in cells)
            found += [code(cells), code(frozenset((-x, y) for x, y in cells))]
        return found

    grown = {frozenset([(0, 0)])}
    for _ in range(size - 1):
        grown = {
            cells | {(x + dx, y + dy)}
            for cells in grown
            for x, y in cells
            for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1))
            if (x + dx, y + dy) not in cells
        }
        grown = set({min(images(cells)): cells for cells in grown}.values())
    return sorted({min(images(cells)) for cells in grown})


NAMED = {1: ["1"], 2: ["2"], 3: ["I3", "L3"], 4: ["I", "O", "T", "S", "L"]}


def outcome_classes(blocks: int, chirality: str = "merged") -> list[str]:
    """Return names of all outcome classes: tabulated, or (merged) put together from shapes."""
    if (blocks, chirality) in CLASSES:
        return CLASSES[blocks, chirality]
    shapes = {size: NAMED.get(size) or free_polyominoes(size) for size in range(1, blocks + 1)}

    def split(rest: int, largest: tuple[int, int]) -> list[list[str]]:
        if rest == 0:
            return [[]]
        found = []
        for size in range(min(rest, largest[0]), 0, -1):
            first = largest[1] if size == largest[0] else 0
            for index in range(first, len(shapes[size])):
                tails = split(rest - size, (size, index))
                found += [[shapes[size][index], *tail] for tail in tails]
        return found

    return ["+".join(parts) for parts in split(blocks, (blocks, 0))]


def probabilities(blocks: int, chirality: str = "merged", *, tilt: float = 1.0) -> np.ndarray:
    """Return made-up probabilities: most runs end as one assembly, common shapes more often."""
    names = outcome_classes(blocks, chirality)
    complete = np.array(["+" not in name for name in names])
    weight = 1.0 / (2.0 + np.arange(len(names)) % 7) ** tilt
    for part, share in ((complete, COMPLETE_SHARE), (~complete, 1.0 - COMPLETE_SHARE)):
        weight[part] *= share / weight[part].sum()
    return weight


def distribution(
    blocks: int = 4,
    chirality: str = "merged",
    *,
    runs: int = 1000,
    seed: int = 1,
    tilt: float = 1.0,
) -> xr.Dataset:
    """Return an `outcome_distribution` with intervals of a fixed, roughly right width."""
    names = outcome_classes(blocks, chirality)
    p = probabilities(blocks, chirality, tilt=tilt)
    count = np.random.default_rng(seed).multinomial(runs, p)
    share = count / runs
    wide = 2.8 * np.sqrt((share * (1 - share) + 1 / runs) / runs)
    complete = float(share[["+" not in name for name in names]].sum())
    return xr.Dataset(
        {
            "count": ("class", count),
            "proportion": ("class", share),
            "interval_low": ("class", np.maximum(share - wide, 0.0)),
            "interval_high": ("class", np.minimum(share + wide, 1.0)),
        },
        coords={"class": np.array(names, dtype=object)},
        attrs={
            "kind": "outcome_distribution", "schema_version": 1, "runs": runs, "blocks": blocks,
            "confidence": 0.95, "chirality": chirality, "method": "Goodman",
            "complete": complete, "complete_low": complete - 0.015,
            "complete_high": complete + 0.013,
        },
    )  # fmt: skip


def realisations(count: int = 10, blocks: int = 4) -> xr.Dataset:
    """Return proportions of repeated experiments, ``proportion`` (realisation, class)."""
    rng = np.random.default_rng(7)
    return xr.Dataset(
        {
            "proportion": (
                ("realisation", "class"),
                rng.multinomial(1000, probabilities(blocks), size=count) / 1000,
            )
        },
        coords={"class": np.array(outcome_classes(blocks), dtype=object)},
    )


def class_times(blocks: int = 4, chirality: str = "merged", *, samples: int = 61) -> xr.Dataset:
    """Return a `class_times`: classes of fewer assemblies appear later."""
    names = outcome_classes(blocks, chirality)
    time = np.linspace(0.0, 300.0, samples)
    assemblies = np.array([name.count("+") + 1 for name in names])
    p = probabilities(blocks, chirality)
    grown = 1.0 - np.exp(-time / 60.0)
    # Number of joints made by then, each with the same chance: binomial.
    joints = blocks - 1
    share = np.zeros((samples, len(names)))
    for made in range(joints + 1):
        chance = np.array(
            [
                np.exp(_log_binomial(joints, made)) * q**made * (1 - q) ** (joints - made)
                for q in grown
            ]
        )
        these = assemblies == blocks - made
        share[:, these] += chance[:, None] * (p[these] / p[these].sum())
    survival = {"first_contact": np.exp(-time / 12.0), "completion": 1.0 - grown**joints}
    variables: dict[str, Any] = {"proportion": (("time", "class"), share)}
    for name, curve in survival.items():
        wide = 2.0 * np.sqrt(curve * (1 - curve) / 1000)
        variables[name] = ("time", curve)
        variables[f"{name}_low"] = ("time", curve - wide)
        variables[f"{name}_high"] = ("time", curve + wide)
    return xr.Dataset(
        variables,
        coords={"time": time, "class": np.array(names, dtype=object)},
        attrs={
            "kind": "class_times", "schema_version": 1, "runs": 1000, "blocks": blocks,
            "confidence": 0.95,
        },
    )  # fmt: skip


def _log_binomial(n: int, k: int) -> float:
    return float(np.log(np.arange(1, n + 1)).sum()) - float(
        np.log(np.arange(1, k + 1)).sum() + np.log(np.arange(1, n - k + 1)).sum()
    )


def sensitivity(
    blocks: int = 4, chirality: str = "merged", *, points: tuple[int, int] = (16, 15)
) -> xr.Dataset:
    """Return a `sensitivity` over (C_d, σ_F): few joints where either is small."""
    drag = np.linspace(0.05, 1.5, points[0])
    force = np.linspace(0.05, 1.5, points[1]) * 1e-3
    return _study({"drag_coefficient": drag, "force_std": force}, blocks, chirality)


def one_axis(name: str, values: Any, blocks: int = 4) -> xr.Dataset:
    """Return a `sensitivity` along one other axis."""
    return _study({name: np.asarray(values)}, blocks, "merged")


def _study(axes: dict[str, np.ndarray], blocks: int, chirality: str) -> xr.Dataset:
    names = outcome_classes(blocks, chirality)
    rng = np.random.default_rng(3)
    shape = tuple(len(values) for values in axes.values())
    place = np.meshgrid(
        *(np.linspace(0.03, 1.0, n) if n > 1 else np.array([0.5]) for n in shape), indexing="ij"
    )
    mobility = 1.0 - np.exp(-30.0 * np.prod(place, axis=0))
    loose = np.array(["+" in name for name in names])
    reference = probabilities(blocks, chirality)
    share = np.empty((*shape, len(names)))
    for index in np.ndindex(*shape):
        p = reference * (
            1.0 + 0.8 * np.sin((place[0][index] - 0.3) * (2.0 + np.arange(len(names)) % 5))
        )
        p[loose] *= 1.0 + 300.0 * (1.0 - mobility[index]) ** 4
        share[index] = rng.multinomial(1000, p / p.sum()) / 1000
    dims = tuple(axes)
    study = xr.Dataset(
        {
            "proportion": ((*dims, "class"), share),
            "runs": (dims, np.full(shape, 1000)),
            "complete": (dims, share[..., ~loose].sum(axis=-1)),
            "l1_distance": (dims, np.abs(share - reference).sum(axis=-1)),
            "reference": ("class", reference),
        },
        coords={
            **{
                name: values if values.dtype.kind in "if" else values.astype(object)
                for name, values in axes.items()
            },
            "class": np.array(names, dtype=object),
        },
        attrs={
            "kind": "sensitivity", "schema_version": 1, **REFERENCE, "reference_runs": 10000,
            "noise_floor_mean": 0.11, "noise_floor_95": 0.18, "force_interval_s": 0.016,
        },
    )  # fmt: skip
    return with_courses(study)


def with_courses(study: xr.Dataset, *, samples: int = 11) -> xr.Dataset:
    """Return a `sensitivity` with its classes over time, each setting at a pace of its own."""
    runs = study["runs"].values[..., None, None]
    pace = np.linspace(0.2, 3.0, study["runs"].size).reshape(runs.shape)
    time = np.linspace(0.0, 300.0, samples)
    joined = 1.0 - np.exp(-pace * time[:, None] / 60.0)
    count = np.round(runs * study["proportion"].values[..., None, :] * joined).astype(np.int32)
    count[..., -1] += (runs[..., 0] - count.sum(axis=-1)).astype(np.int32)
    share = study["reference"].values * joined[(0,) * (joined.ndim - 2)]
    share[:, -1] += 1.0 - share.sum(axis=1)
    dims = ("time", "class_over_time")
    return study.assign(
        count_over_time=((*study["runs"].dims, *dims), count),
        reference_over_time=(dims, share),
    ).assign_coords(time=time, class_over_time=study["class"].values)


def components(study: xr.Dataset) -> xr.Dataset:
    """Return the `components` of a study, by singular value decomposition."""
    share = study["proportion"].values
    flat = share.reshape(-1, share.shape[-1])
    mean = flat.mean(axis=0)
    u, s, vt = np.linalg.svd(flat - mean, full_matrices=False)
    dims = [dim for dim in study["proportion"].dims if dim != "class"]
    return xr.Dataset(
        {
            "score": ((*dims, "component"), (u * s).reshape(*share.shape[:-1], -1)),
            "loading": (("class", "component"), vt.T),
            "explained_variance_ratio": ("component", s**2 / (s**2).sum()),
            "mean": ("class", mean),
        },
        coords={"class": study["class"]},
        attrs={"kind": "components", "schema_version": 1},
    )


def assembly_path(*, runs: int = 2, samples: int = 301, blocks: int = 4) -> xr.Dataset:
    """Return an `assembly_path`: blocks circle in the tank and join one after the other."""
    side = 0.03
    time = np.linspace(0.0, 300.0, samples)
    shape = (runs, samples, blocks)
    x, y, theta = (np.zeros(shape) for _ in range(3))
    label = np.zeros(shape, dtype=np.int32)
    for run in range(runs):
        turn = 0.05 * time + run
        for block in range(blocks):
            joined = time >= 60.0 * block + 20.0 * run if block else np.ones(samples, dtype=bool)
            # The assembly: a row of blocks whose first one circles; a free block: another circle.
            row_x = 0.06 * np.cos(turn) - side * block * np.sin(turn)
            row_y = 0.06 * np.sin(turn) + side * block * np.cos(turn)
            free = turn + 1.5 * block
            x[run, :, block] = np.where(joined, row_x, 0.11 * np.cos(free))
            y[run, :, block] = np.where(joined, row_y, 0.11 * np.sin(free))
            theta[run, :, block] = np.where(joined, turn, 1.7 * free)
            label[run, :, block] = np.where(joined, 0, block)
    return xr.Dataset(
        {
            **{
                name: (("run", "time", "block"), values)
                for name, values in (("x", x), ("y", y), ("theta", theta))
            },
            "assembly": (("run", "time", "block"), label),
        },
        coords={"time": time},
        attrs={
            "kind": "assembly_path", "schema_version": 1, "blocks": blocks, "runs": runs,
            "block_side_m": side, "arena": ARENA, "duration_s": 300.0,
        },
    )  # fmt: skip


def assembly_end(path: xr.Dataset) -> xr.Dataset:
    """Return what an `assembly` dataset says of the end of these runs (poses and outcomes only)."""
    end = path.isel(time=-1, drop=True)
    names = outcome_classes(int(path.attrs["blocks"]))
    return (
        end.assign(outcome=("run", np.zeros(path.sizes["run"], dtype=np.int32)))
        .assign_coords({"class": np.array(names, dtype=object)})
        .assign_attrs(kind="assembly")
    )
