"""All that the errors of prediction of a fit say about it, from one pass with derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from driftwalk.flow.arena import outline_of
from driftwalk.likelihood.check.errors import Errors, Leverage, collect
from driftwalk.likelihood.check.place import (
    Layout,
    Local,
    Spread,
    Trend,
    contrasts_of,
    groups_of,
    lay_out,
    local_scores,
    spread_of,
    trend_of,
)
from driftwalk.likelihood.check.white import LAGS, White, white_of
from driftwalk.likelihood.estimate import Estimate


@dataclass(frozen=True, eq=False)
class Residuals:
    """The statistics of the errors of prediction."""

    layout: Layout
    leverage: Leverage
    white: White
    place: Local
    """By cell."""
    part: Local
    """By part of the recording and cell, in that order."""
    strength: Trend
    """Of the flow, by part of the recording."""
    drag: Trend
    """Of C_d, by the speed of the water past the block."""
    noise_by_part: Spread
    noise_by_place: Spread


def residuals_of(estimate: Estimate, errors: Sequence[Errors]) -> Residuals:
    """Return the statistics of the errors of prediction."""
    study = estimate.study
    bounds = outline_of(study.tank.to_arena()).bounds
    layout = lay_out(errors, bounds, side=study.block.side_m)
    groups = groups_of(layout, errors)
    components = errors[0].components
    sums = contrasts_of(layout, groups, components)
    leverage = collect(estimate, errors, sums, lags=LAGS)
    covariance = leverage.covariance
    shape = (layout.parts, layout.cells, components)
    score, power = sums.place.score.reshape(shape), sums.place.power.reshape(shape)[:, :, 0]
    slope = sums.place.slope.reshape(*shape, -1)
    by_part = (layout.parts * layout.cells, components)
    return Residuals(
        layout=layout,
        leverage=leverage,
        white=white_of(errors, leverage),
        place=local_scores(score.sum(axis=0), power.sum(axis=0), slope.sum(axis=0), covariance),
        part=local_scores(
            score.reshape(by_part), power.ravel(), slope.reshape(*by_part, -1), covariance
        ),
        strength=trend_of(sums.strength, covariance),
        drag=trend_of(sums.drag, covariance),
        noise_by_part=spread_of(errors, [one.part for one in groups], layout.parts),
        noise_by_place=spread_of(errors, [one.cell for one in groups], layout.cells),
    )
