"""Self-propelled particles for the tests: tables of the family's members in, paths out."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import xarray as xr

from driftwalk import _core
from driftwalk.core.random_streams import world_keys
from driftwalk.flow import uniform_flow
from driftwalk.model import Tank
from driftwalk.motion.choose import family_model
from driftwalk.motion.family.columns import ParticleTable
from driftwalk.simulation.backend import Camera, native_scene

Floats = npt.NDArray[np.float64]
Points = npt.NDArray[np.complex128]

SIGMAS = 5.0
"""Standard errors by which the mean of independent numbers may be off."""
FALSE_ALARM = 1e-5
"""How often it is at most: 6e-7 if it were normal, and the rest is for skew."""
FAR = Tank(diameter_m=1000.0)
"""A tank whose wall is out of reach."""


def of(name: str, count: int, **values: npt.ArrayLike) -> ParticleTable:
    """Return the table of equal worlds of a member of the family."""
    return family_model(name, clearance=0.0).table(values, count)


def paths(
    table: ParticleTable,
    time: npt.ArrayLike,
    *,
    seed: int = 1,
    time_step: float = 0.01,
    tank: Tank = FAR,
    contact: str = "slide",
    flow: xr.Dataset | None = None,
    start: npt.ArrayLike = 0.0,
    heading: npt.ArrayLike = 0.0,
    velocity: npt.ArrayLike = 0.0,
    precision: str = "single",
    others: Floats | None = None,
) -> tuple[Points, Floats]:
    """Return positions as complex numbers, and headings, of shape (worlds, samples).

    `others` are the places of other bodies, shape (time steps, bodies, 2).
    """
    water = uniform_flow(0.0, 0.0, arena=tank.to_arena()) if flow is None else flow
    model = native_scene(tank, None, water, np.asarray(time, float), Camera(), time_step=time_step)
    count = len(table.columns)
    rows = np.zeros((count, 6))
    rows[:, 0], rows[:, 1] = np.real(start), np.imag(start)
    rows[:, 2] = heading
    rows[:, 3], rows[:, 4] = np.real(velocity), np.imag(velocity)
    x, y, theta, status = _core.simulate(
        model,
        np.ascontiguousarray(np.hstack([rows, table.columns])),
        world_keys(seed, trial=np.arange(count), replicate=0),
        threads=1,
        precision=precision,
        particle=_core.Particle(
            kind=table.kind,
            states=table.states,
            contact=contact,
            carried=flow is not None,
            neighbours=others,
        ),
    )
    assert not (status & ~np.uint32(4)).any(), "a world broke"
    return x.astype(float) + 1j * y.astype(float), theta.astype(float)


def errors_off(sample: Floats, mean: npt.ArrayLike, slack: npt.ArrayLike = 0.0) -> Floats:
    """Return how many standard errors the means over worlds are from those expected, less slack."""
    off = np.abs(sample.mean(axis=0) - mean) - np.asarray(slack)
    return np.asarray(off / (sample.std(axis=0, ddof=1) / np.sqrt(len(sample))))


def gaussian(count: int, std: float, seed: int) -> Points:
    """Return velocities as an inertial particle has them that has long been under way."""
    rng = np.random.default_rng(seed)
    return rng.normal(0.0, std, count) + 1j * rng.normal(0.0, std, count)
