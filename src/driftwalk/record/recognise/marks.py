"""Names that the files of a format hold."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Marks:
    """Names that a file of a format has: a loader may have several, for several forms of it."""

    container: str
    """``"HDF5"``, ``"npz"``, ``"npy"``, ``"XML"``, ``"table"`` or ``"folder"``."""
    names: tuple[str, ...]
    """Arrays, attributes, keys, elements, columns or files."""
