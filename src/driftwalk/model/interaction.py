"""Forces between blocks at a distance: magnets, capillarity, a measured table."""

from __future__ import annotations

import re
from typing import Annotated, ClassVar, Final, Literal, NamedTuple, Self

from pydantic import AfterValidator, model_validator

from driftwalk.core.errors import ConfigurationError
from driftwalk.core.units import parse_quantity
from driftwalk.model.section import Placeholder, Quantity, Section, not_set

Poles = Literal["turning", "fixed"]
_MAGNET: Final = re.compile(
    r"\s*([\d.]+)\s*x\s*([\d.]+)\s*x\s*([\d.]+)\s*([a-zµμ]*)\s*,\s*([\d.]+)\s*(m?T)\s*"
)


class Magnet(NamedTuple):
    """A cuboid magnet at the centre of a face, magnetised along the face's normal."""

    width_m: float
    """Along the waterline [m]."""
    height_m: float
    """Upright [m]."""
    thickness_m: float
    """Along the normal [m]."""
    remanence_T: float
    """Remanent flux density [T]."""


def parse_magnet(text: str) -> Magnet | None:
    """Read ``"5x5x2mm,1.3T"``: width, height, thickness, remanence; None for ``"none"``.

    Raises
    ------
    ConfigurationError
        When the text is not of this form, or a number is 0.

    Examples
    --------
    >>> parse_magnet("5x5x2mm,1.3T")
    Magnet(width_m=0.005, height_m=0.005, thickness_m=0.002, remanence_T=1.3)
    """
    if text == "none":
        return None
    match = _MAGNET.fullmatch(text)
    if match is None:
        raise ConfigurationError(
            f"expected width x height x thickness and remanence such as 5x5x2mm,1.3T, got '{text}'"
        )
    *sizes, unit, remanence, tesla = match.groups()
    width, height, thickness = (parse_quantity(f"{size}{unit}", "m") for size in sizes)
    field = parse_quantity(remanence, "1") * (1e-3 if tesla == "mT" else 1.0)
    if min(width, height, thickness, field) <= 0.0:
        raise ConfigurationError(f"a magnet has sizes and a remanence above 0, got '{text}'")
    if max(width, height, thickness) > 1.0 or field > 3.0:
        raise ConfigurationError(
            f"a magnet is at most 1 m and 3 T, got '{text}'; a bare size is in m: write 5x5x2mm"
        )
    return Magnet(width, height, thickness, field)


def _magnet_text(text: str) -> str:
    parse_magnet(text)
    return text


MagnetText = Annotated[str, Placeholder("SIZE,REMANENCE"), AfterValidator(_magnet_text)]


class Interaction(Section):
    """Forces between blocks before they touch: none, unless a key says so.

    Examples
    --------
    >>> Interaction(magnets="5x5x2mm,1.3T").magnet.remanence_T
    1.3
    """

    section_name: ClassVar[str] = "interaction"

    magnets: MagnetText = "none"
    """Magnet at the centre of each face, or "none".

    A cuboid magnet at the centre of each face: width, height, thickness (along the face's normal)
    and remanence, such as "5x5x2mm,1.3T"; or "none".
    """
    magnet_inset_m: Annotated[float, Quantity("m", ge=0, le=1)] = 0.001
    """Wall of the block between a magnet and the water."""
    poles: Poles = "turning"
    """Whether magnets turn in their seats.

    "turning": a magnet turns in its seat, so any face attracts any face, along the line between
    the two magnets; "fixed": its axis is the face's normal.
    """
    attraction: Annotated[str | None, Placeholder("FILE")] = not_set("attraction.csv")
    """Table of the force between two faces.

    CSV table of the force between two faces, instead of magnets: columns gap_m, force_N, and
    offset_m, angle_rad where it depends on them, torque_N_m to check it; or in mm, mN, deg, N mm.
    """
    capillary: Literal["on", "off"] = "off"
    """Whether the menisci of the blocks attract each other, "on" or "off"."""
    meniscus_height_m: Annotated[float, Quantity("m", gt=0, le=0.01)] = 0.001
    """Height of the meniscus at a block alone."""
    surface_tension_N_m: Annotated[float, Quantity("N/m", gt=0, le=1)] = 0.072
    """Surface tension of the water."""
    approach_resistance_N_s: Annotated[float, Quantity("N s", ge=0, le=1)] = 0.0
    """Resistance k of the water between two blocks.

    Resistance k of the water between two blocks, 0 for none: a force k times their closing speed
    over the gap between them.
    """
    cutoff_m: Annotated[float | Literal["auto"], Quantity("m", gt=0, le=10)] = "auto"
    """Gap beyond which faces and menisci feel nothing.

    Gap between two faces beyond which magnets, a table and menisci have no effect; "auto": where
    magnets attract with 0.01 mN, at the end of the table, and at 12 capillary lengths of menisci.
    """

    @model_validator(mode="after")
    def _one_attraction(self) -> Self:
        if self.magnets != "none" and self.attraction is not None:
            raise ConfigurationError(
                "the faces have magnets or a table of their attraction, not both: "
                f"magnets = '{self.magnets}', attraction = '{self.attraction}'"
            )
        return self

    @property
    def magnet(self) -> Magnet | None:
        """The magnet of a face."""
        return parse_magnet(self.magnets)

    @property
    def is_on(self) -> bool:
        """Whether blocks feel each other at a distance."""
        return (
            self.magnets != "none"
            or self.attraction is not None
            or self.capillary == "on"
            or self.approach_resistance_N_s > 0.0
        )
