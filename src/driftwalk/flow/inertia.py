"""From the velocity of a floating body to the velocity of the water (Eq. 4)."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError

Array = npt.NDArray[np.float64]


def inertia_correction(
    acceleration: npt.ArrayLike,
    *,
    mass: float,
    area: float,
    water_density: float = 1000.0,
    flow_drag_coefficient: float = 1.05,
) -> Array:
    """Return the velocity of the water relative to the body that it carries.

    A body of mass m that accelerates by a feels the force m a. If that force is the quadratic drag
    ``½ rho A C_x |w| w`` of water that passes it at w, then (Eq. 4 of the paper)

        w = m a / sqrt(½ rho A C_x m |a|),    and w = 0 where a = 0.

    Parameters
    ----------
    acceleration : array_like, shape (..., 2)
        Acceleration of the body [m/s²].
    mass : float
        Mass m [kg].
    area : float
        Cross-section A that the body turns to the flow [m²].
    water_density : float, optional
        rho [kg/m³].
    flow_drag_coefficient : float, optional
        C_x of the whole body, 1.05 for a cube. It is not the coefficient of the strips that the
        simulation uses and the calibration finds.

    Returns
    -------
    ndarray, shape (..., 2)
        Velocity of the water minus velocity of the body [m/s].

    Raises
    ------
    InputError
        When a parameter is not a positive number.

    Examples
    --------
    >>> inertia_correction([0.5, 0.0], mass=0.0116, area=9e-4).round(4).tolist()
    [0.1108, 0.0]
    """
    for name, value in (
        ("mass", mass),
        ("area", area),
        ("water_density", water_density),
        ("flow_drag_coefficient", flow_drag_coefficient),
    ):
        if not (math.isfinite(value) and value > 0.0):
            raise InputError(f"{name} must be a positive number, got {value}")
    a = np.asarray(acceleration, dtype=np.float64)
    size = np.hypot(a[..., 0], a[..., 1])[..., None]
    factor = math.sqrt(mass / (0.5 * water_density * area * flow_drag_coefficient))
    # a / sqrt|a| tends to 0 with a, though the quotient is 0/0 there.
    root = np.sqrt(np.where(size > 0.0, size, 1.0))
    return np.asarray(np.where(size > 0.0, factor * a / root, 0.0 * size))


def cross_section(area: float | None, side: float | None, depth: float | None) -> float:
    """Return the cross-section to the flow [m²], given as such or as side and wetted depth [m].

    Raises
    ------
    InputError
        When both or neither are given.

    Examples
    --------
    >>> cross_section(None, 0.03, 0.01)
    0.0003
    """
    if area is not None:
        if side is not None or depth is not None:
            raise InputError(f"area={area} and side={side}, depth={depth} given: keep one of them")
        return area
    if side is None:
        raise InputError(
            "the inertia correction needs the body's cross-section: give `side` or `area`, "
            'or choose inertia "none"'
        )
    return side * (side if depth is None else depth)
