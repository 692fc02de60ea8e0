"""Estimate of the wall: a grid search, and the parabola through its log likelihood."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import product
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.conditions import estimated_study
from driftwalk.core.progress import ignore_progress
from driftwalk.likelihood.contacts.particles import (
    Part,
    WallLikelihood,
    passages_of,
    thinned,
)
from driftwalk.likelihood.flow_intervals import fitted_flow, fitted_intervals
from driftwalk.likelihood.newton import Tell
from driftwalk.likelihood.preparation import estimate_of
from driftwalk.likelihood.refuse import BREAKDOWN
from driftwalk.schema.answers.parts import undetermined
from driftwalk.schema.check import described
from driftwalk.schema.kinds.fit import WALL_NUMBERS

if TYPE_CHECKING:
    import xarray as xr


class LatticePolicy(NamedTuple):
    """The lattices of walls, in restitution and hold: mu / (1 + mu) for the friction mu."""

    restitutions: tuple[float, ...] = (0.0, 0.5, 1.0)
    """Restitutions of the coarse lattice. Chosen by hand, as what follows."""
    holds: tuple[float, ...] = (0.0, 0.1, 0.25, 0.45, 0.65)
    """Holds of the coarse lattice. From a friction of about 1 on every contact sticks, and more of
    it changes nothing; chosen by hand."""
    most_hold: float = 0.8
    """Largest hold that is tried; chosen by hand."""
    finer: tuple[tuple[float, float], ...] = ((0.25, 0.12), (0.15, 0.05))
    """Half the widths of the finer lattices, in restitution and hold; chosen by hand."""
    fine: int = 5
    """Places of a finer lattice along each axis; chosen by hand."""


LATTICE: Final = LatticePolicy()


class Wall(NamedTuple):
    """A wall that was tried."""

    restitution: float
    hold: float
    log_likelihood: float


def search_walls(log_likelihood: Callable[[float, float], float], tell: Tell) -> list[Wall]:
    """Try the walls of a coarse lattice, then of finer ones around the best of them."""
    count = len(LATTICE.restitutions) * len(LATTICE.holds) + LATTICE.fine**2 * len(LATTICE.finer)
    walls: dict[tuple[float, float], Wall] = {}
    done, places = 0, product(LATTICE.restitutions, LATTICE.holds)
    for reach in (*LATTICE.finer, None):
        for restitution, hold in places:
            tell(done, count, "wall")
            # The same place of two lattices may differ in its last digits.
            place = (round(restitution, 9), round(hold, 9))
            if place not in walls:
                found = log_likelihood(restitution, hold / (1.0 - hold))
                walls[place] = Wall(restitution, hold, found)
            done += 1
        if reach is not None:
            best = max(walls.values(), key=lambda wall: wall.log_likelihood)
            places = product(
                _around(best.restitution, reach[0], most=1.0),
                _around(best.hold, reach[1], most=LATTICE.most_hold),
            )
    tell(count, count, "wall")
    return list(walls.values())


def _around(best: float, reach: float, *, most: float) -> list[float]:
    """Return the places of a finer lattice along one axis."""
    ends = max(best - reach, 0.0), min(best + reach, most)
    return [float(one) for one in np.linspace(*ends, LATTICE.fine)]


class ParabolaPolicy(NamedTuple):
    """Which of the walls form the parabola."""

    near: float = 80.0
    """Walls whose log likelihood is this near the largest ones form the parabola. Chosen by
    hand."""
    fewest_walls: int = 14
    """Least number of walls that form the parabola: it has six numbers. Chosen by hand."""
    half_weight: float = 15.0
    """A wall with a log likelihood this far below the largest one counts half. Chosen by hand: far
    from its top the likelihood is no parabola."""
    least_curvature: float = 0.5
    """A direction along which the likelihood falls less is not determined. Chosen by hand."""


PARABOLA: Final = ParabolaPolicy()


def answer(walls: Sequence[Wall], confidence: float) -> dict[str, Any]:
    """Return the estimates with their intervals, from a parabola through the likely walls.

    The likelihoods scatter, since the particles are few. Their distances from the parabola say by
    how much, and the intervals hold the uncertainty of its top that follows.
    """
    from scipy.special import ndtri

    table = np.array(walls)
    order = np.argsort(-table[:, 2])
    top = table[order[:3], 2].mean()
    near = table[table[:, 2] > top - PARABOLA.near]
    if len(near) < PARABOLA.fewest_walls:
        near = table[order[: PARABOLA.fewest_walls]]
    e, hold, height = near.T
    terms = np.column_stack([np.ones_like(e), e, hold, e**2, e * hold, hold**2])
    weight = 1.0 / (1.0 + np.maximum(top - height, 0.0) / PARABOLA.half_weight)
    root = np.sqrt(weight)
    fitted, *_ = np.linalg.lstsq(terms * root[:, None], (height - top) * root, rcond=None)
    scatter = (height - top) - terms @ fitted
    variance = float((weight * scatter**2).sum() / (weight.sum() - 0.5 * terms.shape[1]))
    curvature = -np.array([[2 * fitted[3], fitted[4]], [fitted[4], 2 * fitted[5]]])
    values, vectors = np.linalg.eigh(curvature)
    # A direction along which the likelihood does not fall is not determined.
    inverse = vectors @ np.diag(1.0 / np.maximum(values, PARABOLA.least_curvature)) @ vectors.T
    best = inverse @ fitted[1:3]
    slopes = np.column_stack(
        [np.zeros(2), inverse, *(-inverse @ part @ best for part in _CURVATURES)]
    )
    own = variance * np.linalg.pinv(terms.T @ (weight[:, None] * terms))
    covariance = inverse + slopes @ own @ slopes.T
    reach = float(ndtri(0.5 + 0.5 * confidence)) * np.sqrt(np.diag(covariance))
    restitution, hold = np.clip([best, best - reach, best + reach], 0.0, 1.0).T
    # From the largest hold on every contact sticks.
    with np.errstate(divide="ignore"):
        friction = np.where(hold < LATTICE.most_hold, hold / (1.0 - hold), np.inf)
    return {
        "wall_restitution": ((), restitution[0]),
        "wall_restitution_interval": ("bound", restitution[1:]),
        "wall_friction": ((), friction[0]),
        "wall_friction_interval": ("bound", friction[1:]),
    }


def is_undetermined(found: Mapping[str, Any]) -> bool:
    """Return whether the intervals of an answer hold every wall."""
    ends = [found[f"wall_{name}_interval"][1].tolist() for name in ("restitution", "friction")]
    return bool(ends == [[0.0, 1.0], [0.0, math.inf]])


_CURVATURES: Final = (
    np.array([[-2.0, 0.0], [0.0, 0.0]]),
    np.array([[0.0, -1.0], [-1.0, 0.0]]),
    np.array([[0.0, 0.0], [0.0, -2.0]]),
)
"""Derivatives of the curvature by the parabola's last three numbers."""


class WallContactPolicy(NamedTuple):
    """How many contacts an estimate of the wall takes."""

    fewest: int = 8
    """Fewer passages along the wall say nothing of it. Chosen by hand."""
    most: int = 50
    """More are thinned to this many, evenly. Chosen by hand, for the time that they take."""


WALL_CONTACT: Final = WallContactPolicy()


def estimate_wall(
    fit: xr.Dataset,
    recordings: Sequence[xr.Dataset],
    *,
    body: str | None = None,
    seed: int = 0,
    tell: Tell | None = None,
) -> xr.Dataset:
    """Estimate restitution and friction of the wall from the contacts of the recordings of a fit.

    Parameters
    ----------
    fit : xarray.Dataset
        A `fit`; the estimate needs the orientation in its state.
    recordings : sequence of xarray.Dataset
        Those that it was made of.
    body : str, optional
        The body, where a recording has several.
    seed : int
        Of the particles.
    tell : callable, optional
        Called with the number of walls that are done, their number, and the task.

    Returns
    -------
    xarray.Dataset
        The fit, with ``wall_contacts``, the number of passages along the wall, and with enough of
        them ``wall_restitution`` and ``wall_friction`` with their intervals. A wall that cannot be
        estimated is no error: the attribute ``wall_left_out`` says why.

    Raises
    ------
    InputError
        When the recordings do not belong to the fit.

    Examples
    --------
    >>> import driftwalk as dw
    >>> recording = dw.tank30_recording()
    >>> fit = dw.fit_motion(recording)  # doctest: +SKIP
    >>> found = estimate_wall(fit, [recording])  # doctest: +SKIP
    >>> int(found["wall_contacts"])  # doctest: +SKIP
    0
    """
    unknown = undetermined(fit)
    # Recordings of another fit are the user's mistake, and no breakdown.
    estimate = None if unknown else estimate_of(fit, recordings, body=body)
    # An earlier estimate may have left some.
    earlier = [f"{one.name}{end}" for one in WALL_NUMBERS for end in ("", "_interval")]
    fit = fit.drop_vars(["wall_contacts", *earlier], errors="ignore")
    fit.attrs.pop("wall_left_out", None)

    def left_out(why: str) -> xr.Dataset:
        return fit.assign_attrs(wall_left_out=why)

    if estimate is not None and estimate.point.layers > 1:
        return left_out(
            "the contacts are simulated in a steady flow, and this one has modes in time"
        )
    if estimate is None:
        return left_out(
            f"the estimate of the wall needs {' and '.join(unknown)}, which this recording does "
            "not determine"
        )
    if fit.attrs["angle"] == "given":
        return left_out(
            "the estimate of the wall needs the orientation in the state of the fit, and here it "
            'was an input: fit with `angle="state"`'
        )
    if fit.attrs["angle"] != "state":
        return left_out(
            "the estimate of the wall needs the orientation of the block, and this fit used none: "
            'record it, or read the column that holds it (`columns`), and fit with `angle="state"`'
        )
    intervals = fitted_intervals(fit)
    try:
        found = [passages_of(estimate, one) for one in estimate.passes.series]
        count = sum(len(one.x) for one in found)
        fit = described(fit.assign(wall_contacts=((), np.int64(count))))
        if count < WALL_CONTACT.fewest:
            return left_out(
                f"the estimate of the wall needs {WALL_CONTACT.fewest} contacts with it, and "
                f"{count} can be followed: record for longer, at an even rate, or where the flow "
                "drives the block to the wall"
            )
        parts = [
            Part(
                thinned(passages, min(1.0, WALL_CONTACT.most / count)),
                fitted_flow(fit, interval=intervals.of_flow(series.flow)[0]),
                float(np.median(np.diff(series.time))),
            )
            for series, passages in zip(estimate.passes.series, found, strict=True)
            if len(passages.x)
        ]
        likelihood = WallLikelihood(estimated_study(fit), estimate.point, parts, seed)
        walls = search_walls(likelihood.log_likelihood, tell or ignore_progress)
        data = answer(walls, float(fit["confidence"]))
    except BREAKDOWN as error:
        return left_out(f"the estimate of the wall failed: {error}")
    if is_undetermined(data):
        return left_out(
            f"the block passed along the wall {count} times, which does not determine the wall: "
            "the block hardly touched it, or no wall explains how it moved; check the size of the "
            "tank (`tank`) and the side of the block (`side`)"
        )
    return described(fit.assign(data))
