"""Which truths a recovery study of the likelihood fit refuses."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.flow.arena import outline_of
from driftwalk.likelihood.refuse import LIMIT
from driftwalk.model.recover import RANDOM
from driftwalk.schema import FLAGS, check_flow_field

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


def require_truth(study: Study, angles: tuple[str, ...]) -> None:
    """Refuse a truth that lacks a number."""
    seen, forces = study.observation, study.forces
    positive: dict[str, Any] = {
        "[forces] drag_coefficient": forces.drag_coefficient,
        "[forces] force_std_N": forces.force_std_N,
        "[observation] position_noise_m": seen.position_noise_m,
    }
    for key, value in positive.items():
        if isinstance(value, str) or not value > 0.0:
            raise InputError(
                f"the truth lacks {key}: a number above 0 is needed for the "
                f"simulation and the comparison with the fit, got {value!r}"
            )
    if isinstance(seen.orientation_noise_rad, str) and set(angles) != {"none"}:
        raise InputError(
            "the truth lacks [observation] orientation_noise_rad: a number is needed where the "
            f"fit uses the orientation, got {seen.orientation_noise_rad!r}"
        )


def require_length(study: Study) -> None:
    """Refuse recordings that are shorter than the fit needs."""
    settings = study.recover
    shortest = min(settings.durations_s)
    samples = math.floor(shortest / settings.sample_interval_s + 1e-6) + 1
    # Five standard deviations: chance shall not stop a study half-way.
    retained = 1.0 - settings.missing_share
    expected = samples * retained - 5.0 * math.sqrt(samples * retained * settings.missing_share)
    if expected < LIMIT.fewest_samples:
        raise InputError(
            f"[recover] durations_s: {shortest:g} s at a sample every "
            f"{settings.sample_interval_s:g} s, {settings.missing_share:.0%} of them missing, are "
            f"about {samples * retained:.0f} positions; the fit needs {LIMIT.fewest_samples} at "
            "least, and some minutes to be of use"
        )


def require_flow(study: Study, flow: xr.Dataset | None) -> None:
    """Refuse a flow that is missing, or does not cover the tank."""
    if flow is not None:
        _require_cover(study, flow)
    elif study.recover.flow != RANDOM:
        named = study.recover.flow
        raise InputError(
            "the flow of the water is missing: name the file of a flow field "
            '([recover] flow), or flow = "random"'
            if named is None
            else f"the flow {named} ([recover] flow) has to be loaded and passed as an argument"
        )


def _require_cover(study: Study, flow: xr.Dataset) -> None:
    check_flow_field(flow)
    if "time" in flow.dims:
        raise InputError("the true flow has frames: a recovery study needs a steady one")
    outline = outline_of(study.tank.to_arena())
    low_x, low_y, high_x, high_y = outline.bounds
    x, y = flow["x"].values, flow["y"].values
    cell = float(x[1] - x[0]), float(y[1] - y[0])
    ends = ((x, cell[0], low_x, high_x), (y, cell[1], low_y, high_y))
    tank = study.tank.describe()
    for nodes, size, low, high in ends:
        if nodes[0] - size > low + 1e-9 or nodes[-1] + size < high - 1e-9:
            raise InputError(
                f"the flow field does not cover the tank, a {tank}: it spans x from {x[0]:.4g} to "
                f"{x[-1]:.4g} m, y from {y[0]:.4g} to {y[-1]:.4g} m; give the field of this tank, "
                "or the tank of this field ([tank])"
            )
    depth = outline.depth(*(part.ravel() for part in np.meshgrid(x, y)))
    inner = (depth > math.hypot(*cell)).reshape(y.size, x.size)
    lacking = int(np.count_nonzero(inner & (flow["flag"].values == FLAGS["outside"])))
    if lacking:
        raise InputError(
            f"the flow field does not cover the tank, a {tank}: {lacking} of its nodes in there "
            "are flagged as outside of the tank that it was made for; give the field of this tank"
        )
