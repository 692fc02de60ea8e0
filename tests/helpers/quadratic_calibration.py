"""Calibrations with a known joint region, for tests of what is drawn from them. Synthetic."""

from __future__ import annotations

import numpy as np
import xarray as xr

CENTER = np.array([0.4, 0.6e-3])
WIDTH = np.array([0.05, 0.08e-3])
LOW, LEVEL = 0.03, 0.05


def quadratic(*, confidence: float = 0.9, nodes: int = 61) -> xr.Dataset:
    """Return a calibration whose surface is a paraboloid; its region is an ellipse of `WIDTH`.

    The axes of the ellipse are those of the parameters.
    """
    drag, force = (CENTER[k] + WIDTH[k] * np.linspace(-1.5, 1.5, nodes) for k in (0, 1))
    rise = ((drag - CENTER[0]) / WIDTH[0])[:, None] ** 2 + ((force - CENTER[1]) / WIDTH[1]) ** 2
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    border = CENTER + WIDTH * np.column_stack([np.cos(turn), np.sin(turn)])
    return region_calibration(
        drag, force, LOW + (LEVEL - LOW) * rise, border, confidence=confidence
    )


def region_calibration(
    drag: np.ndarray,
    force: np.ndarray,
    surface: np.ndarray,
    border: np.ndarray,
    *,
    confidence: float = 0.9,
) -> xr.Dataset:
    """Return what a calibration keeps of its surface and its region."""
    return xr.Dataset(
        {
            "refined_surface": (("refined_drag_coefficient", "refined_force_std"), surface),
            "region_drag_coefficient": ("region_vertex", border[:, 0]),
            "region_force_std": ("region_vertex", border[:, 1]),
            "region_level": ((), LEVEL),
            "confidence": ((), confidence),
        },
        coords={"refined_drag_coefficient": drag, "refined_force_std": force},
        attrs={"kind": "calibration"},
    )
