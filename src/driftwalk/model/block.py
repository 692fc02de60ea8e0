"""The floating body: a square block, a disc, a rectangle, or blocks glued together."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self, TypedDict

from pydantic import Field, ModelWrapValidatorHandler, model_validator

from driftwalk.core.errors import ConfigurationError
from driftwalk.model.section import OrNumber, Placeholder, Quantity, Section

if TYPE_CHECKING:
    from driftwalk.model.bodies import RigidBody


class BodySize(TypedDict):
    """Size of a disc or a rectangle [m]."""

    diameter: float
    """Of a disc; length of a rectangle along its own x."""
    width: float | None
    """Of a rectangle, along its own y; None of a disc."""


class Block(Section):
    """A prism of mass m that floats upright; seen from above a square of side a, or another shape.

    Examples
    --------
    >>> round(Block().inertia_kg_m2, 12)
    1.74e-06
    >>> Block(shape="disc:4cm", mass_kg=0.024).side_m
    0.04
    """

    section_name: ClassVar[str] = "block"

    shape: Annotated[str, Placeholder("SHAPE")] = "square"
    """Shape of the body, seen from above.

    Shape: "square", "disc", "rectangle", or the rows of glued blocks such as "xx" or "x./xx". The
    size may follow: "disc:4cm", "rectangle:4x2cm", "xx:3cm".
    """
    side_m: Annotated[float, Quantity("m", gt=0, le=10)] = 0.03
    """Side of the block; diameter of a disc.

    Side a of the square, or of each of the glued blocks; diameter of a disc; length of a rectangle.
    """
    width_m: Annotated[float | None, Quantity("m", gt=0, le=10)] = Field(
        default=None, examples=[0.02]
    )
    """Width of a rectangle, its second side."""
    mass_kg: Annotated[float, Quantity("kg", gt=0, le=1e4)] = 0.0116
    """Mass of the block.

    Mass m of the whole body, with everything that it carries.
    """
    depth: Annotated[Literal["immersed", "archimedes"] | None, OrNumber("depth_m")] = None
    """Wetted depth of a side face.

    Wetted depth d of a side face: "immersed" is d = a (the default), "archimedes" is the depth at
    which the body floats, d = m / (density area). The drag depends only on the product of
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
        data = cls.expanded(data)
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
        replaced = {"depth", "depth_m"} - keys if keys & {"depth", "depth_m"} else set[str]()
        return replaced | ({"width_m"} - keys if "shape" in keys else set())

    @classmethod
    def expanded(cls, values: dict[str, Any]) -> dict[str, Any]:
        """Return values with the size that stands in the shape, ``"disc:4cm"``, as keys.

        Raises
        ------
        ConfigurationError
            When the size is stated twice.
        """
        shape, _, size = str(values.get("shape", "")).partition(":")
        if not size:
            return values
        given = {key for key in ("side_m", "width_m") if values.get(key) is not None}
        sizes = _sizes(size) if shape == "rectangle" else {"side_m": size}
        if given & set(sizes):
            raise ConfigurationError(
                f"the size stands in the shape '{shape}:{size}' and in {', '.join(sorted(given))}: "
                "keep one"
            )
        return {**values, "shape": shape, **sizes}

    @model_validator(mode="after")
    def _known_shape(self) -> Self:
        if self.shape != "square" or self.width_m is not None:
            self.body()
        return self

    def body(self, hidden_share: float = 0.0) -> RigidBody:
        """Return the outline of the body; of glued blocks with a share of hidden drag, 0 to 1."""
        from driftwalk.model.bodies import Measures, rigid_body

        return rigid_body(
            self.shape, Measures(self.side_m, self.width_m, self.strips_per_face, hidden_share)
        )

    @property
    def is_round(self) -> bool:
        """Whether the body is a disc: without heading, faces and lattice."""
        return self.shape == "disc"

    @property
    def has_lattice(self) -> bool:
        """Whether blocks latch face to face, as squares do; discs and rectangles as they lie."""
        return self.shape == "square"

    @property
    def contact_size(self) -> BodySize:
        """Size of a disc or a rectangle, by the names that tell what touches."""
        return {"diameter": self.side_m, "width": self.width_m}

    @property
    def described(self) -> str:
        """The body in words, such as "block of side 3 cm"."""
        side = f"{100 * self.side_m:.4g}"
        if self.is_round:
            return f"disc of diameter {side} cm"
        if self.width_m is not None:
            return f"rectangle of {side} x {100 * self.width_m:.4g} cm"
        glued = "" if self.shape == "square" else f"{self.shape} of glued blocks, each a "
        return f"{glued}block of side {side} cm"

    @property
    def area_m2(self) -> float:
        """Area of the body, seen from above [m²]."""
        return self.side_m**2 if self.shape == "square" else self.body().area_m2

    @property
    def inertia_kg_m2(self) -> float:
        """Moment of inertia about the vertical [kg m²]; of the square m a² / 6."""
        if self.shape == "square":
            return self.mass_kg * self.side_m**2 / 6.0
        return self.mass_kg * self.body().moment_m2

    def wetted_depth_m(self, density_kg_m3: float) -> float:
        """Return the wetted depth d of a side face [m] in water of the density given [kg/m³]."""
        if self.depth_m is not None:
            return self.depth_m
        if self.depth == "archimedes":
            return self.mass_kg / (density_kg_m3 * self.area_m2)
        return self.side_m


def _sizes(text: str) -> dict[str, str]:
    """Return length and width of ``"4x2cm"``: the unit stands once or twice."""
    first, cross, second = text.partition("x")
    if not cross:
        raise ConfigurationError(f"a rectangle has two sides, rectangle:4x2cm, got '{text}'")
    unit = second.lstrip("0123456789.eE+- ")
    return {"side_m": first if first.strip(" ")[-1:].isalpha() else first + unit, "width_m": second}
