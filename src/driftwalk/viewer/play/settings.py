"""The knobs of the playground: what they are called, how far they go, and what they stand at."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final, Literal, Self

from driftwalk.assembly import LiveTank
from driftwalk.assembly.runs.start import tank_area
from driftwalk.core.errors import InputError
from driftwalk.model.assembly import MOST_BLOCKS

FILLED: Final = 0.4
"""Share of the tank that blocks may cover; squares placed at random jam at about half; chosen by
hand."""

Kind = Literal["range", "choice"]


@dataclass(frozen=True)
class Knob:
    """One setting that can be changed while the tank moves.

    Attributes
    ----------
    name, label, unit : str
        Its names for programs and for people, and its SI unit.
    least, most, step : float
        Ends and steps of a range.
    whole : bool
        Whether a range has whole numbers only.
    log : bool
        Whether a range is drawn with a logarithmic scale.
    choices : tuple of str
        The options of a choice; empty for a range.
    """

    name: str
    label: str
    unit: str = "1"
    least: float = 0.0
    most: float = 0.0
    step: float = 0.0
    whole: bool = False
    log: bool = False
    choices: tuple[str, ...] = ()

    def read(self, value: Any) -> Any:
        """Return a value of a browser in the setting's own type.

        Raises
        ------
        InputError
            When it is none that the setting can have.
        """
        if self.choices:
            if value not in self.choices:
                raise InputError(f"{self.label}: expected one of {', '.join(self.choices)}")
            return value
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise InputError(f"{self.label}: expected a number")
        # A comparison, not isfinite: a whole number may be too large for any float.
        if not self.least <= value <= self.most:
            raise InputError(
                f"{self.label}: expected a number from {self.least:g} to {self.most:g}"
            )
        if self.whole and value != int(value):
            raise InputError(f"{self.label}: expected a whole number")
        return int(value) if self.whole else float(value)

    def item(self, value: Any) -> dict[str, Any]:
        """Return the setting as a page has it."""
        ranged = not self.choices
        return {
            "name": self.name,
            "label": self.label,
            "unit": self.unit,
            "kind": "range" if ranged else "choice",
            "min": self.least if ranged else None,
            "max": self.most if ranged else None,
            "step": self.step if ranged else None,
            "value": value,
            "log": self.log,
            "choices": list(self.choices),
        }

    def reaching(self, value: Any) -> Self:
        """Return the setting with a range that holds a value, which a study may have beyond it."""
        if self.choices:
            return self if value in self.choices else replace(self, choices=(*self.choices, value))
        if self.least <= value <= self.most:
            return self
        if value > self.most:
            return replace(self, most=float(value))
        # No logarithmic scale reaches 0.
        return replace(self, least=float(value), log=self.log and value > 0.0)


SPEED: Final = Knob("speed", "speed", "×", 0.25, 60.0, 0.01, log=True)
"""The tank's time over the reader's: from slow motion to a minute in a second."""
KNOBS: Final = (
    Knob("drag_coefficient", "drag coefficient C_d", "1", 0.0, 1.5, 0.01),
    Knob("force_std", "stochastic force σ_F", "N", 0.0, 1.5e-3, 1e-5),
    Knob("blocks", "blocks", "1", 1, MOST_BLOCKS, 1, whole=True),
    Knob("flow_scale", "strength of the flow", "×", 0.0, 3.0, 0.05),
    Knob("latching", "latching", choices=("collision", "connector", "none")),
    Knob("faces", "poles of the faces", choices=("any", "N,S,N,S", "N,N,S,S", "N,N,N,N")),
    Knob("hidden_face_drag", "drag on joined faces", choices=("none", "full")),
    Knob("stirring_length", "length of the stirring", "m", 0.0, 0.3, 0.005),
    Knob("bond_rate", "rate at which bonds break", "1/s", 0.0, 1.0, 0.01),
    Knob("magnets", "magnets", choices=("none", "3x3x1mm,1.2T", "5x5x2mm,1.2T")),
    SPEED,
)
"""Ranges hold the values of the paper with room to either side; chosen by hand."""


def knobs_for(tank: LiveTank) -> dict[str, Knob]:
    """Return the settings of a tank by name.

    Parameters
    ----------
    tank : LiveTank
        Whose values every range has to hold.
    """
    values = values_of(tank, speed=1.0)
    knobs = {knob.name: knob.reaching(values[knob.name]) for knob in KNOBS}
    if not tank.has_lattice:
        # Discs have no faces, and rectangles latch as they lie.
        del knobs["hidden_face_drag"], knobs["faces"], knobs["magnets"]
        knobs["latching"] = replace(knobs["latching"], choices=("collision", "none"))
    # As many blocks as still have room to move.
    room = FILLED * tank_area(tank.study.tank) / tank.study.block.area_m2
    most = max(min(int(room), MOST_BLOCKS), tank.study.assembly.blocks)
    return knobs | {"blocks": replace(knobs["blocks"], most=most)}


def values_of(tank: LiveTank, *, speed: float) -> dict[str, Any]:
    """Return what every setting stands at."""
    forces, rules = tank.study.forces, tank.study.assembly
    return {
        "drag_coefficient": forces.drag_coefficient,
        "force_std": forces.force_std_N,
        "blocks": rules.blocks,
        "flow_scale": tank.flow_scale,
        "latching": rules.latching,
        "faces": rules.faces,
        "hidden_face_drag": str(rules.hidden_face_drag),
        "stirring_length": forces.stirring_length_m,
        "bond_rate": rules.bond_rate_per_s,
        "magnets": tank.study.interaction.magnets,
        "speed": speed,
    }
