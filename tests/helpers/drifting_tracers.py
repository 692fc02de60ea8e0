"""Synthetic tracers in a known flow: integrated by SciPy, seen with noise, linked with mistakes."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr
from scipy.integrate import solve_ivp

from driftwalk.flow import vortex_velocity
from driftwalk.schema import build_trajectory

Array = npt.NDArray[np.float64]
RADIUS = 0.15
TANK = '{"shape": "circle", "diameter_m": 0.3}'


def vortex(x: npt.ArrayLike, y: npt.ArrayLike) -> tuple[Array, Array]:
    """Return a flow along circles: it keeps the tracers spread evenly over the tank."""
    return vortex_velocity(x, y, angular_velocity=1.0, core_radius=0.05)


class Seeded(NamedTuple):
    """A recording of tracers, and which of its links are false."""

    recording: xr.Dataset
    false: npt.NDArray[np.bool_]
    """Whether the step from a sample to the next is a false link, shape (samples - 1, tracers)."""


def seeded_tank(
    seed: int,
    *,
    tracers: int,
    samples: int,
    interval: float = 0.05,
    noise: float = 1e-4,
    false_links: float = 0.0,
    flow: Callable[[Array, Array], tuple[Array, Array]] = vortex,
) -> Seeded:
    """Follow tracers from places all over the round tank.

    From a false link on, a track is that of another particle, 5 to 15 mm beside the first one.
    """
    random = np.random.default_rng(seed)
    r, angle = RADIUS * np.sqrt(random.uniform(size=tracers)), random.uniform(0, 2 * np.pi, tracers)
    time = interval * np.arange(samples)
    path = solve_ivp(
        lambda _, at: np.concatenate(flow(*at.reshape(2, -1))),
        (0.0, time[-1]),
        np.concatenate([r * np.cos(angle), r * np.sin(angle)]),
        t_eval=time,
        rtol=1e-7,
        atol=1e-9,
    ).y.reshape(2, tracers, samples)
    x, y = path.transpose(0, 2, 1) + random.normal(0.0, noise, (2, samples, tracers))
    false = np.zeros((samples - 1, tracers), dtype=bool)
    count = round(false_links * false.size)
    false.ravel()[random.choice(false.size, count, replace=False)] = True
    beside, towards = random.uniform(5e-3, 15e-3, count), random.uniform(0, 2 * np.pi, count)
    for at, values in ((np.cos(towards), x), (np.sin(towards), y)):
        jump = np.zeros(false.shape)
        jump[false] = beside * at
        values[1:] += np.cumsum(jump, axis=0)
    return Seeded(build_trajectory(time, x, y, attrs={"arena": TANK}), false)
