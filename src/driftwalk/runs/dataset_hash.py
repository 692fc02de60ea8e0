"""Hashes that tell two datasets of a run directory apart."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr


def dataset_hash(dataset: xr.Dataset, names: tuple[str, ...]) -> str:
    """Return a hash of the coordinates and the named variables of a dataset."""
    digest = hashlib.sha256()
    for name in (*sorted(str(name) for name in dataset.indexes), *names):
        values = dataset[name].values
        digest.update(
            repr(values.tolist()).encode() if values.dtype == object else values.tobytes()
        )
    return digest.hexdigest()
