"""How many blocks assemble, how often, for how long, and by which rule they latch."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Final, Literal, Self

from pydantic import field_validator, model_validator

from driftwalk.core.errors import ConfigurationError
from driftwalk.model.binding import Binding, Kind, face_types, faces_text
from driftwalk.model.section import Placeholder, Quantity, Section, Seed, not_set

MOST_BLOCKS: Final = 2000
"""The most that the native core takes."""

BlockCount = Annotated[int, Quantity("1", ge=1, le=MOST_BLOCKS, whole=True)]
BondRate = Annotated[float, Quantity("1/s", ge=0, le=1e6)]
Latching = Literal["collision", "connector", "none"]
HiddenFaceDrag = Annotated[float | Literal["none", "full"], Quantity("1", ge=0, le=1)]
"""A share of a free face's drag."""
Chirality = Literal["merged", "distinct"]


class Assembly(Section):
    """Self-assembly of many blocks: how many, how often, for how long, and the latching rule.

    Examples
    --------
    >>> Assembly(duration_s="5min").duration_s
    300.0
    """

    section_name: ClassVar[str] = "assembly"

    blocks: BlockCount = 4
    """Blocks in the tank."""
    runs: Annotated[int, Quantity("1", ge=1, le=10_000_000, whole=True)] = 1000
    """Simulated runs, each with its own start and random numbers."""
    duration_s: Annotated[float, Quantity("s", gt=0, le=1e6)] = 300.0
    """Length of a run; a run ends earlier if all blocks are in one assembly."""
    seed: Seed = 1
    """Seed of the starts, the forces and the drawn parameters."""
    latching: Latching = "collision"
    """Rule by which two blocks latch.

    Latching rule: "collision", whenever two blocks touch (the paper); "connector", when two faces
    are within the tolerances of a connector; "none", never: hard bodies.
    """
    connector_distance_m: Annotated[float, Quantity("m", ge=0, le=10)] = 0.010
    """Largest distance between the centres of two faces at which connectors latch."""
    connector_axis_rad: Annotated[float, Quantity("rad", ge=0, le=3.15)] = 0.2
    """Largest angle between the axes of two connectors that latch."""
    connector_rotation_rad: Annotated[float, Quantity("rad", ge=0, le=3.15)] = 0.2
    """Largest rotation of two connectors against each other about their axis. Blocks float upright,
    so this rotation is always 0 and the condition is always met; the key only completes the
    description of a connector."""
    faces: Annotated[str, Placeholder("N,S,N,S")] = "any"
    """Types of the faces +x, +y, -x, -y of every block: N, S or none; or "any".

    Types of the faces +x, +y, -x, -y of every block: N and S are fixed magnets, of which unlike
    ones latch, "none" (or -) latches with none. "any": every face latches with every other.
    """
    binding: Binding | None = not_set(
        '{ kinds = [{ name = "A", count = 4, faces = ["N", "S", "N", "S"] }] }'
    )
    """Kinds of blocks, types of their faces, which of them latch, and what blocks become then: the
    table of `driftwalk assemble --binding`, in place of `faces`."""
    glued: Annotated[str, Placeholder("SHAPE")] = "x"
    """Blocks that start glued together, such as "xx" or "x./xx"; "x": single blocks.

    Rows of the blocks that start glued together, permanently: "xx" are dimers, "x" single blocks.
    """
    hidden_face_drag: HiddenFaceDrag = "none"
    """Drag on faces that are joined.

    Drag on faces that are joined to another block: "none", "full" as on a free face, or a share
    of that, 0 to 1.
    """
    chirality: Chirality = "merged"
    """Mirror images as one class or two.

    Treatment of mirror images: "merged" into one class (the paper), or "distinct".
    """
    block_restitution: Annotated[float, Quantity("1", ge=0, le=1)] = 0.5
    """Restitution between blocks, 0 to 1.

    Restitution of an impact between two blocks that do not latch.
    """
    block_friction: Annotated[float, Quantity("1", ge=0, le=100)] = 0.0
    """Coulomb friction between two blocks; 0 for wet faces."""
    bond_rate_per_s: BondRate = 0.0
    """Rate at which each bond breaks, 0: never; as an option also 0.01/s,2mN, with the tension that
    multiplies it by e.

    Rate at which the bond of two joined faces breaks when it carries no load; 0: never.
    """
    bond_force_N: Annotated[float, Quantity("N", ge=0, le=1e6)] = 0.0
    """Tension that multiplies the rate by e (Bell).

    Tension of a bond that multiplies its rate by e (Bell); 0: the rate is constant.
    """
    bond_strength_N: Annotated[float, Quantity("N", ge=0, le=1e6)] = 0.0
    """Tension that breaks a bond at once; 0: none does.

    Tension that breaks a bond at once; 0: none does. It takes a force that has memory and length
    (`forces.force_memory_s`, `forces.stirring_length_m`).
    """
    relatch_clearance: Annotated[float, Quantity("1", ge=1, le=2)] = 1.25
    """Distance of the centres of blocks that parted, in sides, from which they may latch again."""
    confidence: Annotated[float, Quantity("1", gt=0, lt=1)] = 0.9
    """Simultaneous confidence of the intervals of the shares."""

    @classmethod
    def replaced_by(cls, keys: set[str]) -> set[str]:
        """Return the one of `faces` and `binding` that loses its meaning by the other."""
        return {"faces", "binding"} if keys & {"faces", "binding"} else set()

    @field_validator("faces", mode="before")
    @classmethod
    def _four_types(cls, value: Any) -> str:
        return faces_text(",".join(map(str, value)) if isinstance(value, list) else str(value))

    @field_validator("glued")
    @classmethod
    def _glued_shape(cls, value: str) -> str:
        if value != "x":
            from driftwalk.model.rigid_bodies import Measures, rigid_body

            if not set(value) <= set("x./"):
                raise ConfigurationError(
                    f"expected rows of blocks such as xx or x./xx, got '{value}'"
                )
            rigid_body(value, Measures(1.0, None, 1, 0.0))
        return value

    @model_validator(mode="after")
    def _one_rule(self) -> Self:
        if self.binding is not None and self.faces != "any":
            raise ConfigurationError("faces and binding both say which faces latch: give one")
        return self

    @property
    def typed_faces(self) -> Binding | None:
        """Rules of typed faces, None where every face latches with every other."""
        types = face_types(self.faces)
        if types is None:
            return self.binding
        return Binding(kinds=(Kind(name="block", count=self.blocks, faces=types),))

    @property
    def bonds_break(self) -> bool:
        """Whether bonds break, so that assemblies part."""
        return self.bond_rate_per_s > 0 or self.bond_strength_N > 0

    @property
    def hidden_share(self) -> float:
        """Share of the drag of a free face that a joined face feels, 0 to 1."""
        words = {"none": 0.0, "full": 1.0}
        share = self.hidden_face_drag
        return words[share] if isinstance(share, str) else share
