"""The floating block: a square prism."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, ModelWrapValidatorHandler, model_validator

from driftwalk.core.errors import ConfigurationError
from driftwalk.model.section import OrNumber, Quantity, Section


class Block(Section):
    """A square prism of side a and mass m that floats upright.

    Examples
    --------
    >>> round(Block().inertia_kg_m2, 12)
    1.74e-06
    """

    section_name: ClassVar[str] = "block"

    side_m: Annotated[float, Quantity("m", gt=0, le=10)] = 0.03
    """Side of the block.

    Side a of the square, seen from above.
    """
    mass_kg: Annotated[float, Quantity("kg", gt=0, le=1e4)] = 0.0116
    """Mass of the block.

    Mass m, with everything that the block carries.
    """
    depth: Annotated[Literal["immersed", "archimedes"] | None, OrNumber("depth_m")] = None
    """Wetted depth of a side face.

    Wetted depth d of a side face: "immersed" is d = a (the default), "archimedes" is the depth at
    which the block floats, d = m / (density a^2). The drag depends only on the product of
    drag_coefficient and depth, so always state the two together.
    """
    depth_m: Annotated[float | None, Quantity("m", gt=0, le=10)] = Field(
        default=None, examples=[0.0129]
    )
    """Wetted depth d as a length, instead of `depth`."""
    strips_per_face: Annotated[int, Quantity("1", ge=1, le=64, whole=True)] = 8
    """Vertical strips into which each side face is cut for the drag."""

    @model_validator(mode="wrap")
    @classmethod
    def _one_depth(cls, data: Any, build: ModelWrapValidatorHandler[Self]) -> Self:
        if not isinstance(data, dict):
            return build(data)
        word, number = data.get("depth"), data.get("depth_m")
        if word is not None and number is not None:
            raise ConfigurationError(
                f"depth = {word!r} and depth_m = {number} both given: keep one"
            )
        if word is not None or number is not None:
            return build(data)
        block = build({**data, "depth": "immersed"})
        # A default is not stated: a run reports which numbers are defaults.
        block.model_fields_set.discard("depth")
        return block

    @classmethod
    def replaced_by(cls, keys: set[str]) -> set[str]:
        """Return the other way of giving the depth, when one is set."""
        return {"depth", "depth_m"} - keys if keys & {"depth", "depth_m"} else set()

    @property
    def inertia_kg_m2(self) -> float:
        """Moment of inertia about the vertical, I = m a² / 6 [kg m²]."""
        return self.mass_kg * self.side_m**2 / 6.0

    def wetted_depth_m(self, density_kg_m3: float) -> float:
        """Return the wetted depth d of a side face [m] in water of the density given [kg/m³]."""
        if self.depth_m is not None:
            return self.depth_m
        if self.depth == "archimedes":
            return self.mass_kg / (density_kg_m3 * self.side_m**2)
        return self.side_m
