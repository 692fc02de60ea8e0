"""Every kind of dataset: one file per stage or family."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from driftwalk.schema.description import Kind
from driftwalk.schema.kinds import (
    assembly,
    calibration,
    control,
    fit,
    flow,
    model_check,
    motion,
    outcomes,
    recovery,
    sensitivity,
)
from driftwalk.schema.parameters import is_block, stored_parameters

if TYPE_CHECKING:
    import xarray as xr

_FILES: Final = (
    motion, flow, calibration, fit, recovery, model_check, assembly, outcomes, sensitivity,
    control,
)  # fmt: skip

KINDS: Final[dict[str, Kind]] = {
    kind.name: kind for file in _FILES for kind in vars(file).values() if isinstance(kind, Kind)
}
"""By the attribute ``kind``."""


def find_kind(dataset: xr.Dataset) -> Kind | None:
    """Return the description of the kind that a dataset says it is; None where it names none.

    A calibration of another model than the block has a description of its own.
    """
    name = dataset.attrs.get("kind")
    kind = KINDS.get(name) if isinstance(name, str) else None
    if kind is calibration.CALIBRATION and not is_block(dataset):
        return calibration.calibration_of(stored_parameters(dataset))
    return kind
