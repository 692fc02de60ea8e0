"""Axes of a sensitivity analysis: the map over C_d and σ_F, or others."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Final, Self

from pydantic import field_validator, model_validator

from driftwalk.core.errors import ConfigurationError
from driftwalk.core.grid import MOST_SETTINGS
from driftwalk.model.assembly import BlockCount, BondRate, HiddenFaceDrag, Latching
from driftwalk.model.binding import FacesText
from driftwalk.model.block import DragCoefficient, ForceStd, StirringLength
from driftwalk.model.calibration import ForceGrid
from driftwalk.model.interaction import MagnetText
from driftwalk.model.section import Quantity, Seed, distinct, is_list, not_set, without_unit


class Sensitivity(ForceGrid):
    """The settings whose outcomes are compared with those of a reference.

    Without lists the map over the ranges of C_d and σ_F. As soon as a list is given, the lists are
    the axes, and what has none is as in the reference.

    Examples
    --------
    >>> len(Sensitivity().drag_coefficients), len(Sensitivity().force_stds_N)
    (31, 31)
    >>> Sensitivity(blocks=[3, 4], latching=["collision"]).axes
    {'blocks': (3, 4), 'latching': ('collision',)}
    """

    section_name: ClassVar[str] = "sensitivity"

    drag_coefficient_max: DragCoefficient = 1.5
    """Largest drag coefficient of the grid, included."""
    force_std_max_N: ForceStd = 1.5e-3
    """Largest force_std of the grid, included."""
    runs: Annotated[int, Quantity("1", ge=1, le=10_000_000, whole=True)] = 1000
    """Simulated runs per setting, and per realisation of the reference."""
    reference_realisations: Annotated[int, Quantity("1", ge=2, le=100_000, whole=True)] = 10
    """Number of realisations of the reference, which is their mean."""
    seed: Seed = 1
    """Seed of the random numbers."""
    tank_diameter_m: tuple[Annotated[float, Quantity("m", gt=0, le=1e3)], ...] | None = not_set(
        "[0.25, 0.3]"
    )
    """Diameters of circular tanks to compare, an axis of the map."""
    blocks: tuple[BlockCount, ...] | None = not_set("[3, 4, 5]")
    """Numbers of blocks to compare, an axis of the map."""
    flow: tuple[str, ...] | None = not_set('["flow_a.nc", "flow_b.nc"]')
    """Files of flow fields to compare, an axis of the map."""
    flow_scale: tuple[Annotated[float, Quantity("1", ge=0, le=100)], ...] | None = not_set(
        "[0.5, 1.0, 1.5]"
    )
    """Factors on the flow velocity to compare, an axis of the map."""
    glued: tuple[str, ...] | None = not_set('["x", "xx"]')
    """Bodies that blocks start glued to, to compare, an axis of the map."""
    latching: tuple[Latching, ...] | None = not_set('["collision", "connector"]')
    """Latching rules to compare, an axis of the map."""
    faces: tuple[FacesText, ...] | None = not_set('["any", "NSNS"]')
    """Types of the blocks' faces to compare, an axis of the map."""
    hidden_face_drag: tuple[HiddenFaceDrag, ...] | None = not_set('["none", "full"]')
    """Rules for the drag on joined faces to compare, an axis of the map."""
    stirring_length_m: tuple[StirringLength, ...] | None = not_set("[0.0, 0.03, 0.1]")
    """Lengths over which blocks share the stochastic force to compare, an axis of the map."""
    bond_rate_per_s: tuple[BondRate, ...] | None = not_set("[0.0, 0.001, 0.01]")
    """Rates at which bonds break to compare, an axis of the map."""
    magnets: tuple[MagnetText, ...] | None = not_set('["none", "3x3x1mm,1.2T"]')
    """Magnets to compare, an axis of the map."""
    drag_coefficient: tuple[DragCoefficient, ...] | None = not_set("[0.2, 0.45, 1.0]")
    """Drag coefficients to compare, an axis of the map, instead of the range."""
    force_std_N: tuple[ForceStd, ...] | None = not_set('["0.2mN", "0.55mN"]')
    """Values of force_std to compare, an axis of the map, instead of the range."""

    @field_validator("*")
    @classmethod
    def _distinct(cls, value: Any) -> Any:
        return distinct(value) if isinstance(value, tuple) else value

    @model_validator(mode="after")
    def _grid_has_settings(self) -> Self:
        lengths = [len(values) for values in self.axes.values()]
        settings = math.prod(lengths)
        if settings > MOST_SETTINGS:
            raise ConfigurationError(
                f"the map has {' x '.join(map(str, lengths))} = {settings} settings, more than "
                f"{MOST_SETTINGS}: enlarge a step or name fewer values"
            )
        return self

    @property
    def lists(self) -> dict[str, tuple[Any, ...]]:
        """Values of each axis that has a list, SI, in the order of the dimensions."""
        lists = {name: getattr(self, key) for name, key in AXES.items()}
        given = {name: values for name, values in lists.items() if values is not None}
        if hidden := given.get("hidden_face_drag"):
            # Words and shares are one axis: as text, which a study reads like a typed value.
            given["hidden_face_drag"] = tuple(
                one if isinstance(one, str) else f"{one:g}" for one in hidden
            )
        return given

    @property
    def axes(self) -> dict[str, tuple[Any, ...]]:
        """Values of each axis of the map: the lists, else the ranges of C_d and σ_F."""
        ranges = {"drag_coefficient": self.drag_coefficients, "force_std": self.force_stds_N}
        return self.lists or ranges


AXES: Final[dict[str, str]] = {
    without_unit(key): key for key in Sensitivity.model_fields if is_list(Sensitivity, key)
}
"""From the name of an axis to the key of its list; the order is that of the dimensions."""
