"""The floating body, and the forces of the water on it: drag, the stochastic force, the flow.

The body is a square block, a disc, a rectangle, or blocks glued together.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self, TypedDict

from pydantic import ModelWrapValidatorHandler, model_validator

from driftwalk.core.errors import ConfigurationError
from driftwalk.model.section import OrNumber, Placeholder, Quantity, Section, not_set

if TYPE_CHECKING:
    from driftwalk.model.rigid_bodies import RigidBody


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
    width_m: Annotated[float | None, Quantity("m", gt=0, le=10)] = not_set(0.02)
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
    depth_m: Annotated[float | None, Quantity("m", gt=0, le=10)] = not_set(0.0129)
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
        from driftwalk.model.rigid_bodies import Measures, rigid_body

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


DragCoefficient = Annotated[float, Quantity("1", ge=0, le=100)]
"""Bounds are a hundred times what bodies have: they catch a wrong unit."""
StirringLength = Annotated[float, Quantity("m", ge=0, le=1e3)]
ForceStd = Annotated[float, Quantity("N", ge=0, le=10)]
"""Bounds are ten thousand times what the paper found: they catch a wrong unit."""


class Forces(Section):
    """Drag coefficient C_d and stochastic force F ~ N(0, σ_F² I₂), redrawn every interval.

    That is the paper's law. The keys after the force interval add to it what a floating body feels;
    with their defaults they add nothing.

    Examples
    --------
    >>> round(Forces().force_noise_intensity_N2_s, 12)
    3.025e-09
    """

    section_name: ClassVar[str] = "forces"

    drag_coefficient: DragCoefficient = 0.45
    """Drag coefficient C_d of a side face."""
    force_std_N: ForceStd = 0.55e-3
    """Standard deviation of the stochastic force.

    Standard deviation sigma_F of each horizontal component of the stochastic force on the centre of
    mass.
    """
    force_interval_s: Annotated[float, Quantity("s", gt=0, le=10)] = 0.010
    """Interval at which the stochastic force is redrawn. It is part of the model: a recording
    determines only sigma_F^2 * force_interval, so always state the two together."""

    force_memory_s: Annotated[float, Quantity("s", ge=0, le=1e3)] = 0.0
    """Correlation time of the stochastic force.

    Correlation time T of the stochastic force, 0 for none. With T > 0 a force keeps the share k =
    exp(-force_interval / T) of the one before it, and 1 - k is new, with standard deviation
    sigma_F: the noise intensity is still sigma_F^2 * force_interval.
    """
    stirring_length_m: StirringLength = 0.0
    """Distance over which blocks share the stochastic force.

    Length L of the stochastic force in space: two blocks at a distance r feel forces with the
    correlation exp(-r^2 / 2 L^2). 0: each block has its own force. One block alone feels the
    same with every L.
    """
    stirring: Literal["free", "incompressible"] = "free"
    """Force field of the stirring: "free", or "incompressible" (without divergence)."""
    force_lever_m: Annotated[float | None, Quantity("m", ge=0, le=10)] = not_set(0.01)
    """Lever with which the stochastic force turns the body.

    Lever of the stochastic force, rms: every interval the body feels a torque too, with the
    standard deviation sigma_F times the lever. Not stated, it is 0 for one block, and for glued
    blocks what forces on each of them make.
    """
    linear_drag_kg_s: Annotated[float, Quantity("kg/s", ge=0, le=1e4)] = 0.0
    """Drag of the block linear in the slip.

    Drag k linear in the slip, in addition to the quadratic one: each of the 4 N strips, windward or
    not, feels k / (4 N) times the velocity of the water relative to it.
    """
    drag_power: Annotated[float, Quantity("1", ge=0.5, le=3.5)] = 2.0
    """Power p of the speed in the drag law.

    Power p of the speed in the drag of windward strips: the force is (|w| / drag_speed)^(p - 2)
    times the force of the quadratic law, with |w| the speed of the water relative to the strip.
    """
    drag_speed_m_s: Annotated[float, Quantity("m/s", gt=0, le=1e3)] = 0.03
    """Speed at which C_d holds, where the power of the drag is not 2.

    Speed of the water past a strip at which C_d is the drag coefficient, with any power of the
    drag; with the power 2 it has no effect.
    """
    added_mass_share: Annotated[float, Quantity("1", ge=0, le=5)] = 0.0
    """Added mass as a share of the block's mass.

    Added mass m_a of the water that moves along, as a share of the block's mass; the moment of
    inertia grows by the same share.
    """
    pressure_gradient: bool = False
    """Whether water that accelerates pushes the block.

    Whether the pressure that accelerates the water, Du/Dt, pushes the block too, by (m + m_a)
    Du/Dt: a floating block displaces its own mass of water.
    """

    @property
    def force_noise_intensity_N2_s(self) -> float:
        """Noise intensity σ_F² · force interval [N² s], all that a recording can determine."""
        return self.force_std_N**2 * self.force_interval_s


class Flow(Section):
    """Extraction of the flow field from a recording (Eq. 4 of the paper), and its course."""

    section_name: ClassVar[str] = "flow"

    cells: Annotated[int, Quantity("1", ge=2, le=2000, whole=True)] = 50
    """Cells across the longer side of the tank."""
    cell_size_m: Annotated[float | None, Quantity("m", gt=0, le=10)] = not_set(0.006)
    """Side of a cell, instead of `cells`."""
    smoothing_window_s: Annotated[float, Quantity("s", gt=0, le=1e3)] = 0.7
    """Window of the local quadratic fit that gives velocity and acceleration."""
    flow_drag_coefficient: Annotated[float, Quantity("1", gt=0, le=100)] = 1.05
    """Drag coefficient C_x of the inertia correction (Eq. 4)."""
    min_count: Annotated[int, Quantity("1", ge=1, le=1_000_000, whole=True)] = 1
    """Smallest number of samples in a measured cell."""
    inertia: Literal["corrected", "none"] = "corrected"
    """Correction for the body's inertia.

    "corrected" adds the inertia term of Eq. 4; "none" leaves it out.
    """
    repeat: Literal["none", "loop", "mirror", "hold"] = "none"
    """How a flow series goes on after its last frame.

    How a flow that changes in time goes on after its last frame: "loop" begins again, "mirror" runs
    backwards and forwards in turns, "hold" stands still; with "none" longer simulations are
    refused.
    """
    start: Literal["random", "first"] = "random"
    """Where in a flow series a run begins.

    Moment of a flow that changes in time at which a run begins: "random", one for each run, or
    "first", the first frame for all. With a recording its clock is kept.
    """
