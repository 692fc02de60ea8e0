"""Blocks on known paths, and the marker that fits the renderer's colours."""

from __future__ import annotations

import cv2
import numpy as np
import xarray as xr

import driftwalk as dw
from driftwalk.schema import build_trajectory


def moving_blocks(frames: int, bodies: int = 4, rate: float = 10.0) -> xr.Dataset:
    """Return blocks that circle, sway and turn in a 30-cm tank without touching."""
    time = np.arange(frames) / rate
    angle = 2 * np.pi * np.arange(bodies) / bodies
    around = angle + 0.15 * time[:, None]
    x = 0.07 * np.cos(around) + 0.02 * np.sin(0.7 * time[:, None] + 3 * angle)
    y = 0.07 * np.sin(around) + 0.02 * np.cos(0.9 * time[:, None] + 2 * angle)
    return build_trajectory(time, x, y, 2.3 * angle + 0.6 * time[:, None])


def marker_of(settings: dw.datasets.VideoSettings) -> dw.track.TwoColourMarker:
    """Return the marker that the renderer draws."""
    colours = []
    for red, green, blue in (settings.disc_1, settings.disc_2):
        pixel = np.array([[[blue, green, red]]], dtype=np.uint8)
        _, a_star, b_star = cv2.cvtColor(pixel, cv2.COLOR_BGR2Lab)[0, 0].astype(float)
        colours.append({"a_star": a_star - 128, "b_star": b_star - 128})
    return dw.track.TwoColourMarker(
        spacing_m=settings.marker_spacing_m,
        size_m=settings.marker_diameter_m,
        angle_offset_rad=settings.marker_angle_rad,
        colour_1=colours[0],
        colour_2=colours[1],
    )


def camera_of(settings: dw.datasets.VideoSettings) -> dw.track.Camera:
    """Return the camera of a video without tilt and distortion."""
    return dw.track.Camera.from_scale(
        settings.width_px,
        settings.height_px,
        px_per_m=settings.px_per_m,
        centre_px=settings.centre_px,
    )
