"""Result of a reader: the numbers of a file in the file's own units, and what they mean."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from driftwalk.flow.rows import FieldRows


@dataclass(frozen=True)
class RawField:
    """A velocity field as a file has it, a row per node."""

    rows: FieldRows
    """Numbers of the file; a velocity is NaN where it is masked or was not measured."""
    length_unit: str = ""
    """Unit of positions, as the file writes it; ``""`` when it does not say."""
    velocity_unit: str = ""
    """Unit of velocities, likewise."""
    down: bool = False
    """Whether y and v count downwards, as in an image."""
    frame_interval: float | None = None
    """Time between the two images of a pair [s], when the file holds it."""
    notes: list[str] = field(default_factory=list)
    """Sentences for the person who loads the file."""


@dataclass(frozen=True)
class FieldOptions:
    """Facts that the person who loads a field knows and the file may not state."""

    metres_per_pixel: float | None = None
    """Scale of a field in pixels [m]."""
    frame_interval: float | None = None
    """Time between the two images of a pair [s], for velocities that are shifts in pixels."""
    length_unit: str | None = None
    """Unit of positions, and per second of velocities, in a file that does not say."""
    y_axis: str | None = None
    """Direction of y in the file, ``"up"`` or ``"down"``; None: as the format has it."""
    origin: tuple[float, float] | None = None
    """Point of the field that becomes its origin [m], with y up."""
    variables: Mapping[str, str] = field(default_factory=dict)
    """From u, v, x, y, time, mask to the variable of a NetCDF file."""
