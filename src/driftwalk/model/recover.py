"""Recordings of known truth that a recovery study simulates and fits."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Final, Literal

from pydantic import field_validator

from driftwalk.core.errors import ConfigurationError, did_you_mean
from driftwalk.model.fit import Fit
from driftwalk.model.section import (
    Placeholder,
    Quantity,
    Section,
    Seed,
    distinct,
    not_set,
    quoted,
    words_of,
)

LARGEST_STEP_S: Final = 0.0025
"""Largest time step of a simulation that is taken for the truth: its error is then far below what a
recording can tell; chosen by hand."""
RANDOM: Final = "random"


class Recover(Section):
    """The recordings of a recovery study: their flow, number, lengths, camera's clock and gaps.

    The true C_d and sigma_F are those of [forces], the camera's noise that of [observation].

    Examples
    --------
    >>> Recover(durations_s=["10min", "1h"]).durations_s
    (600.0, 3600.0)
    """

    section_name: ClassVar[str] = "recover"

    flow: Annotated[str | None, Placeholder("FILE")] = not_set("fit/flow.nc")
    """File of the true flow field (default: the study file's).

    File of the true flow field, relative to the study file; "random" draws a different flow for
    every recording.
    """
    flow_family: Literal["swirl", "eddies"] = "swirl"
    """Family of random flows: "swirl" with jets and a sink, in which a block goes round on regular
    orbits, or "eddies"."""
    flow_speed_m_s: Annotated[float | None, Quantity("m/s", gt=0, le=100)] = not_set(0.05)
    """Root mean square speed of random flows; if not set, the speed as drawn."""
    recordings: Annotated[int, Quantity("1", ge=2, le=100_000, whole=True)] = 20
    """Number of recordings to simulate and fit, for each length."""
    durations_s: tuple[Annotated[float, Quantity("s", gt=0, le=1e6)], ...] = (1800.0,)
    """Lengths of the recordings to compare."""
    sample_interval_s: Annotated[float, Quantity("s", gt=0, le=1)] = 0.1
    """Time between two samples of the camera."""
    recordings_per_fit: Annotated[int, Quantity("1", ge=1, le=1000, whole=True)] = 1
    """Number of recordings of one flow, from different starts, to fit together."""
    missing_share: Annotated[float, Quantity("1", ge=0, le=0.9)] = 0.0
    """Share of the samples that the camera misses, at random."""
    settling_s: Annotated[float, Quantity("s", ge=0, le=1e6)] = 20.0
    """Time from the start, at rest, to the first sample of the recording."""
    angle: tuple[str, ...] | None = not_set('["given", "none"]')
    """Uses of the orientation to compare, as in [fit] angle; if not set, the one in [fit]."""
    drag_coefficient_precision: Annotated[float | None, Quantity("1", gt=0, lt=1)] = not_set(0.05)
    """Wanted relative error of C_d (rms).

    Wanted relative error of C_d, root mean square: the study says how long to record for it.
    """
    seed: Seed = 1
    """Seed of the flows, starts, forces, camera and gaps."""

    @field_validator("durations_s")
    @classmethod
    def _durations(cls, values: tuple[float, ...]) -> tuple[float, ...]:
        return tuple(sorted(distinct(values)))

    @field_validator("angle")
    @classmethod
    def _angles(cls, values: tuple[str, ...] | None) -> tuple[str, ...] | None:
        if values is None:
            return None
        known = words_of(Fit, "angle")
        for word in distinct(values):
            if word not in known:
                raise ConfigurationError(
                    f"must be a list of {quoted(known)}, got {word!r}{did_you_mean(word, known)}"
                )
        return values


def true_time_step_s(time_step_s: float | Literal["auto"], *, force_interval_s: float) -> float:
    """Return the time step of a simulation that is taken for the truth [s].

    Parameters
    ----------
    time_step_s : float or "auto"
        The value of [simulation]; used if it is not above 2.5 ms.
    force_interval_s : float
        How long one draw of the stochastic force lasts [s].

    Returns
    -------
    float
        Else the largest whole divisor of the interval that is not above 2.5 ms.

    Examples
    --------
    >>> true_time_step_s("auto", force_interval_s=0.016)
    0.002285714285714286
    """
    if time_step_s != "auto" and time_step_s <= LARGEST_STEP_S:
        return time_step_s
    parts = max(1, math.ceil(force_interval_s / LARGEST_STEP_S - 1e-9))
    return force_interval_s / parts
