"""The estimate of a stored fit, ready to run its filter."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from driftwalk.conditions.study import fitted_law
from driftwalk.core.errors import InputError
from driftwalk.likelihood.filter.filter_pass import Passes
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.flow_of_fit import require_fit
from driftwalk.likelihood.law.facts import effective_logs, stored_numbers
from driftwalk.likelihood.preparation import body_of, prepare
from driftwalk.likelihood.prior import Weights
from driftwalk.likelihood.spline import Spline
from driftwalk.schema import Track
from driftwalk.schema.answers.facts import fitted_value

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


@dataclass(frozen=True, eq=False)
class Estimate:
    """A fit, ready to run its filter at what it found."""

    study: Study
    passes: Passes
    point: Point
    weights: Weights
    tracks: Sequence[Track]
    """Sources of the series of the passes: the recordings, cut at the switching times."""


def estimate_of(fit: xr.Dataset, recordings: Sequence[xr.Dataset], *, body: str | None) -> Estimate:
    """Return what a fit found, with the recordings it was fitted to."""
    from driftwalk.model import apply_overrides, parse_study

    fit = require_fit(fit)
    study = parse_study(fit.attrs["study"])
    study = apply_overrides(study, fitted_law(fit))
    ready = prepare(recordings, study, fit.attrs["angle"], body)
    if ready.samples != int(fit["samples"]):
        raise InputError(
            f"the recordings have {ready.samples} positions, the fit was made of "
            f"{int(fit['samples'])}: check it with the recordings that it was fitted to"
        )
    coefficients = np.asarray(fit["coefficient"].values, dtype=np.float64)
    x, y = fit["spline_origin"].values
    spline = Spline(float(x), float(y), float(fit["spline_spacing"]), *coefficients.shape[:-3:-1])
    numbers = stored_numbers(fit)
    point = Point(
        coefficients,
        *effective_logs(fit, study),
        math.log(fitted_value(fit, "tracking_noise")),
        opened=numbers.opened,
        fixed=numbers.fixed,
    )
    if ready.angle == "state":
        point = replace(
            point,
            log_lever=math.log(fitted_value(fit, "force_lever")),
            log_angle_noise=math.log(fitted_value(fit, "orientation_noise")),
        )
    weights = Weights(float(fit["roughness_weight"]), float(fit["size_weight"]))
    passes = Passes(ready.series, body_of(study, ready.angle), spline, len(ready.intervals.labels))
    return Estimate(study, passes, point, weights, ready.parts)
