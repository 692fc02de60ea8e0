"""Outlines of rigid bodies, one file per shape: what simulation and fit know of them is here."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from driftwalk.core.errors import ConfigurationError
from driftwalk.model.bodies import disc, polyomino, rectangle
from driftwalk.model.bodies.rigid_body import Measures, RigidBody

BODIES: Final[dict[str, Callable[[Measures], RigidBody]]] = {
    "square": rectangle.square,
    "disc": disc.disc,
    "rectangle": rectangle.rectangle,
}
"""Shapes by name; any other name is that of a polyomino, or its rows."""


def rigid_body(shape: str, measures: Measures) -> RigidBody:
    """Return the body of a shape.

    Parameters
    ----------
    shape : str
        ``"square"``, ``"disc"``, ``"rectangle"``, or a polyomino by its name (``"L3"``) or its rows
        (``"xx"``, ``"x./xx"``).
    measures : Measures
        Its size.

    Raises
    ------
    ConfigurationError
        When there is no such shape, or its measures do not fit it.

    Examples
    --------
    >>> rigid_body("disc", Measures(side_m=0.04)).symmetry
    0
    >>> rigid_body("xx", Measures(side_m=0.03)).corners.shape
    (4, 2)
    """
    make = BODIES.get(shape, polyomino.polyomino(shape))
    if make is None:
        raise ConfigurationError(
            f"no body shape {shape!r}: {', '.join(BODIES)}, or the rows of a polyomino such as "
            "'xx' or 'x./xx'"
        )
    if measures.width_m is not None and shape != "rectangle":
        raise ConfigurationError(f"width_m belongs to a rectangle, the shape is {shape!r}")
    return make(measures)


__all__ = ["BODIES", "Measures", "RigidBody", "rigid_body"]
