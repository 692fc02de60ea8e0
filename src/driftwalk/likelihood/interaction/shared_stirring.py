"""Free bodies in one recording: over which length they share the stirring, or that none is seen.

The forces on two bodies at a distance r have the correlation rho(r) = exp(-r²/2L²), which one body
does not show. Each body's filter, linear about the track it followed, has the error of its state d'
= F (d - K e) + w, and innovations e = H d + v. With the forces shared, the w of two bodies have the
covariance rho(r) G_1 G_2', with G the part of a Cholesky factor of a body's own Q = G G' that the
force on its centre drives. One Kalman filter of the errors of all bodies together then gives the
exact likelihood of all innovations for every L. The other numbers stay as fitted. The length has a
uniform prior from zero to the width of the tank, and an interval of highest density.

See docs/how-to/dimer.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Bools, Floats
from driftwalk.core.progress import StagedProgress
from driftwalk.core.units import in_percent
from driftwalk.likelihood.filter.difference_pairs import unpacked
from driftwalk.likelihood.filter.filter_pass import Passes
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.filter.series import FILTER, Series
from driftwalk.likelihood.interaction.glued import (
    SharedStirring,
    length_quantiles,
    most_likely,
    stirring_facts,
)
from driftwalk.likelihood.newton import thinned
from driftwalk.likelihood.preparation import PreparedRecordings

Correlations = Callable[[int], Floats]
"""From a sample's number to the correlations of the forces before it, (trials, bodies, bodies)."""


class SharedPolicy(NamedTuple):
    """How the length is searched, and compared with the forces at each distance."""

    trials: int = 31
    """Lengths at which the likelihood is computed, from zero on, with a spline between them.
    Measured: five times as many moved no end of an interval by more than 0.04 %."""
    shortest_sides: float = 0.3
    """Shortest length above zero [sides]: the correlation at one side is 0.004; chosen by hand."""
    nodes: int = 4001
    """Of the posterior of the length, from zero to the width of the tank; chosen by hand."""
    least_evidence: float = 3.0
    """Log likelihood ratio to independent forces below which no length is stated: chance exceeds it
    in one recording of 140."""
    distances: int = 8
    """Ranges of distance with the same number of samples. Chosen by hand."""
    change: float = 0.05
    """Change of a correlation for the derivatives by it. Chosen by hand."""
    most_departure: float = 3.0
    """Standard deviations of a correlation from the kernel above which the law is doubted: chance
    exceeds it at one of the eight distances in one recording of fifty."""


SHARED: Final = SharedPolicy()


@dataclass(frozen=True, eq=False)
class JointErrors:
    """The filters of several bodies at common times, linear about their tracks.

    Shapes begin with (n, bodies); S is the size of a state, D that of a sample.
    """

    transition: Floats
    """F of the interval that ends here, (n, bodies, S, S); 0 where the state begins."""
    noise: Floats
    """Q of that interval, (n, bodies, S, S)."""
    drive: Floats
    """G, the columns of a factor of Q that the force on the centre drives, (n, bodies, S, c)."""
    gain: Floats
    """K, (n, bodies, S, D); 0 where there is no sample."""
    innovation: Floats
    """e, (n, bodies, D)."""
    sample_noise: Floats
    """Covariance of v, (n, bodies, D, D)."""
    seen: Bools
    """Where the filter took a sample, (n, bodies)."""
    apart: Floats
    """Distances of the bodies during the interval [m], (n, bodies, bodies)."""

    @property
    def telling(self) -> Bools:
        """Where the forces on two bodies can be compared, (n, bodies, bodies)."""
        driven = np.asarray(self.drive.any(axis=(2, 3)))
        return np.asarray(np.triu(driven[:, :, None] & driven[:, None, :], 1))


def joint_errors(passes: Passes, point: Point, series: Sequence[Series]) -> JointErrors:
    """Return the filters of several bodies at a point, at the times that all of them have.

    Parameters
    ----------
    passes : Passes
        Body and water.
    point : Point
        Where the filters are linearised.
    series : sequence of Series
        One for each body, over the same time.
    """
    # Microseconds: a clock's own rounding is no other time.
    clocks = [np.round(one.time + one.first, 6) for one in series]
    common = reduce(np.intersect1d, clocks)
    few = [
        one.at(np.searchsorted(clock, common)) for one, clock in zip(series, clocks, strict=True)
    ]
    few = list(thinned(replace(passes, series=few)).series)
    one_by_one = [_errors_of(passes, one, point.in_flow(one.flow)) for one in few]
    stacked = {name: np.stack([one[name] for one in one_by_one], axis=1) for name in one_by_one[0]}
    place = np.stack([one.x + 1j * one.y for one in few], axis=1)
    apart = np.abs(place[:, :, None] - place[:, None, :])
    apart[1:] = 0.5 * (apart[1:] + apart[:-1])
    return JointErrors(apart=apart, **stacked)


def _errors_of(passes: Passes, series: Series, point: Point) -> dict[str, npt.NDArray[Any]]:
    """Return the linear filter of one body, by the names of `JointErrors`."""
    kernel, count = passes.kernel(series, point), series.time.size
    found = kernel.run(count, states=False, errors=True)
    width, (transition, before, after) = kernel.coordinates, found["errors"].swapaxes(0, 1)
    innovation, covariance = found["innovation"], unpacked(found["covariance"]).transpose(2, 0, 1)
    begins = ~transition.any(axis=(1, 2))
    seen = (before != after).any(axis=(1, 2)) & ~begins
    # A state that begins has its covariance after the sample which it begins with.
    before = np.where(begins[:, None, None], after, before)
    noise = before.copy()
    noise[1:] -= transition[1:] @ after[:-1] @ transition[1:].swapaxes(1, 2)
    gain, sample_noise = np.zeros((*before.shape[:2], width)), np.zeros_like(covariance)
    gain[seen] = np.linalg.solve(covariance[seen], before[seen, :width]).swapaxes(1, 2)
    sample_noise[seen] = covariance[seen] - before[seen, :width, :width]
    # What the force drives first stands first in the factor: itself, velocities, then places.
    driven = [*range(2 * width, before.shape[1]), width, width + 1, 0, 1]
    order = [*driven, *(k for k in range(2 * width) if k not in driven)]
    drive = np.zeros((*before.shape[:2], len(driven)))
    shared = ~begins & (series.excluded == 0)
    shared[1:] &= np.diff(series.time) <= FILTER.longest_gap_s
    root = np.linalg.cholesky(noise[shared][:, order][:, :, order])
    drive[np.ix_(shared, order)] = root[:, :, : len(driven)]
    return {
        "transition": transition,
        "noise": noise,
        "drive": drive,
        "gain": gain,
        "innovation": np.where(seen[:, None], innovation, 0.0),
        "sample_noise": sample_noise,
        "seen": seen,
    }


def joint_log_likelihoods(errors: JointErrors, correlations: Correlations, trials: int) -> Floats:
    """Return the log likelihood of all innovations for several trials of the correlation.

    Shape (trials,), without its constant.

    Parameters
    ----------
    errors : JointErrors
        The filters of the bodies.
    correlations : callable
        The correlations of the forces, by the number of a sample.
    trials : int
        How many there are.
    """
    count, bodies, size, width = errors.gain.shape
    whole = bodies * size
    mean, covariance = np.zeros((trials, whole)), np.zeros((trials, whole, whole))
    likelihood, moved = np.zeros(trials), np.zeros(whole)
    places = size * np.arange(bodies)[:, None] + np.arange(width)
    for k in range(count):
        onward, own = _block_diagonal(errors.transition[k]), _block_diagonal(errors.noise[k])
        drive = errors.drive[k].reshape(whole, -1)
        # The covariance of the noises of two bodies for a correlation of 1; of one, its own.
        across = (drive @ drive.T).reshape(bodies, size, bodies, size)
        across[range(bodies), :, range(bodies)] = 0.0
        shared = correlations(k)[:, :, None, :, None] * across
        mean = (mean - moved) @ onward.T
        covariance = onward @ covariance @ onward.T + own + shared.reshape(covariance.shape)
        seen = errors.seen[k]
        at = places[seen].ravel()
        moved = (errors.gain[k] @ errors.innovation[k, :, :, None]).ravel()
        if not at.size:
            continue
        error = errors.innovation[k, seen].ravel() - mean[:, at]
        read = covariance[:, at]
        spread = read[:, :, at] + _block_diagonal(errors.sample_noise[k, seen])
        solved = np.linalg.solve(spread, np.concatenate([read, error[:, :, None]], axis=2))
        by_error = solved[:, :, -1]
        likelihood -= 0.5 * (np.linalg.slogdet(spread)[1] + (error * by_error).sum(axis=1))
        mean = mean + (by_error[:, None] @ read)[:, 0]
        covariance = covariance - read.swapaxes(1, 2) @ solved[:, :, :-1]
        covariance = 0.5 * (covariance + covariance.swapaxes(1, 2))
    return likelihood


def _block_diagonal(blocks: Floats) -> Floats:
    count, size = blocks.shape[:2]
    whole = np.zeros((count, size, count, size))
    whole[range(count), :, range(count)] = blocks
    return whole.reshape(count * size, count * size)


def shared_stirring(
    ready: PreparedRecordings, point: Point, staged: StagedProgress
) -> SharedStirring:
    """Return the length over which the bodies of a recording share the stirring.

    Nothing where the study does not ask for it.

    Parameters
    ----------
    ready : PreparedRecordings
        One recording for each body.
    point : Point
        The fit of all of them.
    staged : StagedProgress
        The progress of the fit.
    """
    if not ready.study.fit.interaction:
        return SharedStirring()
    staged.begin("shared stirring")
    from scipy.interpolate import CubicSpline
    from scipy.stats import norm

    alike = {(tuple(one.time), tuple(one.missing)) for one in ready.dropped}
    parts = len(ready.series) // len(ready.recordings)
    filters = [joint_errors(ready.passes, point, ready.series[k::parts]) for k in range(parts)]
    apart = np.concatenate([one.apart[one.telling] for one in filters])
    if len(alike) > 1 or apart.size < SHARED.distances:
        why = "their clocks differ" if len(alike) > 1 else "no samples of two bodies at one time"
        return SharedStirring(
            warnings=[f"cannot tell whether the bodies share the stirring: {why}"]
        )
    side, confidence = ready.passes.body.side, ready.study.fit.confidence
    widest = max(ready.study.tank.extent_m)
    logs = np.linspace(math.log(SHARED.shortest_sides * side), math.log(widest), SHARED.trials - 1)
    lengths = np.append(1e-3 * side, np.exp(logs))
    like = _summed(filters, lambda one: _kernel(one, lengths), SHARED.trials)
    nodes = np.linspace(0.0, widest, SHARED.nodes)
    # Below the shortest length the bodies do not know it from zero.
    at = np.log(np.maximum(nodes, lengths[1]))
    density = np.where(nodes > 0.0, CubicSpline(logs, like[1:])(at), like[0])
    warnings: list[str] = []
    best, low, high = most_likely(nodes, density, confidence)
    normal = norm.ppf(0.5 + 0.5 * confidence)
    if like[-1] > like.max() - 0.5 * normal**2:
        high = math.inf
    if low == 0.0 or like.max() - like[0] < SHARED.least_evidence:
        best = low = 0.0
    if not low > 0.0:
        known = math.isfinite(high)
        most = f": at most {1e3 * high:.3g} mm ({in_percent(confidence)})" if known else ""
        warnings.append(f"cannot tell a length of the stirring from none{most}")
    rho = [float(_rho(side, max(one, 1e-3 * side))) for one in (best, low, high)]
    facts = stirring_facts(rho, (best, low, high))
    length = max(best, 1e-3 * side)
    edges = np.quantile(apart, np.linspace(0, 1, SHARED.distances + 1))
    distance, value, std = _by_distance(filters, edges, length)
    away = (value - _rho(distance, length)) / std
    facts["stirring_misfit_std"] = float(np.abs(away).max())
    if facts["stirring_misfit_std"] > SHARED.most_departure:
        warnings.append(
            f"the forces on the bodies do not have the correlation exp(-r²/2L²): it is "
            f"{facts['stirring_misfit_std']:.1f} standard deviations off at "
            f"{100 * distance[np.abs(away).argmax()]:.3g} cm"
        )
    ends = np.stack([value - normal * std, value + normal * std], 1)
    variables = {
        **(length_quantiles(nodes, density) if low > 0.0 else {}),
        "force_correlation": ("body_distance", value),
        "force_correlation_interval": (("body_distance", "bound"), ends),
        "body_distance": ("body_distance", distance),
    }
    return SharedStirring(facts, variables, warnings)


def _rho(distance: npt.ArrayLike, length: npt.ArrayLike) -> Floats:
    return np.asarray(np.exp(-0.5 * (np.asarray(distance) / length) ** 2))


def _kernel(errors: JointErrors, lengths: Floats) -> Correlations:
    return lambda k: _rho(errors.apart[k], lengths[:, None, None])


def _summed(
    filters: Sequence[JointErrors], of: Callable[[JointErrors], Correlations], trials: int
) -> Floats:
    """Return the log likelihoods, of all intervals between switching times together."""
    return np.asarray(sum(joint_log_likelihoods(one, of(one), trials) for one in filters))


def _by_distance(
    filters: Sequence[JointErrors], edges: Floats, length: float
) -> tuple[Floats, Floats, Floats]:
    """Return mean distances, the correlations there, and their standard deviations.

    Each is one Newton step from the kernel, with the kernel at all other distances.
    """
    count = edges.size - 1
    apart = np.concatenate([one.apart[one.telling] for one in filters])
    number = np.clip(np.searchsorted(edges, apart, side="right") - 1, 0, count - 1)
    distance = np.array([apart[number == k].mean() for k in range(count)])
    kernel = _rho(distance, length)
    step = np.minimum(SHARED.change, 0.5 * (1.0 - kernel))
    # Trials: the kernel, one step up at each distance, one step down.
    moves = np.concatenate([np.zeros((1, count)), np.diag(step), np.diag(-step)])

    def of(errors: JointErrors) -> Correlations:
        where = np.clip(np.searchsorted(edges, errors.apart, side="right") - 1, 0, count - 1)
        return lambda k: _rho(errors.apart[k], length) + moves[:, where[k]]

    like = _summed(filters, of, len(moves))
    up, down = like[1 : count + 1], like[count + 1 :]
    information = np.maximum(-(up + down - 2.0 * like[0]) / step**2, 1e-300)
    return distance, kernel + (up - down) / (2.0 * step) / information, information**-0.5
