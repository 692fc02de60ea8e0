"""Motion models as a user would write them, in NumPy."""

from __future__ import annotations

import numpy as np


def tumble(scene, *, speed, tumble_rate):
    """Straight runs that end at random instants in a turn to any direction; no walls."""
    interval = np.diff(scene.times)
    tumbles = scene.random.uniform(interval.size) < -np.expm1(-tumble_rate * interval)
    angle = 2.0 * np.pi * scene.random.uniform(interval.size)
    # The heading is that of the latest tumble.
    latest = np.maximum.accumulate(np.where(tumbles, np.arange(interval.size), -1), axis=1)
    chosen = np.take_along_axis(angle, np.maximum(latest, 0), axis=1)
    heading = np.where(latest < 0, scene.start.theta[:, None], chosen)
    step = speed * interval
    x = scene.start.x[:, None] + np.cumsum(step * np.cos(heading), axis=1)
    y = scene.start.y[:, None] + np.cumsum(step * np.sin(heading), axis=1)
    return (
        np.column_stack([scene.start.x, x]),
        np.column_stack([scene.start.y, y]),
        np.column_stack([scene.start.theta, heading]),
    )


def diffuse(scene, *, diffusivity):
    """Brownian motion."""
    spread = np.sqrt(2.0 * diffusivity * np.diff(scene.times, prepend=0.0))
    x, y = (np.cumsum(spread * scene.random.normal(scene.times.size), axis=1) for _ in "xy")
    return scene.start.x[:, None] + x, scene.start.y[:, None] + y
