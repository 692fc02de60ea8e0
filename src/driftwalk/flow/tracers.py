"""The flow field that many passive tracers show: particle tracks made a flow.

Steps lead from one sample of a track to the next, never across a gap. False links of particle
tracks are found by the normalised median test, and by the continuity of the track.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Bools, Floats, Indices
from driftwalk.core.errors import InputError
from driftwalk.flow.arena import Outline, outline_of
from driftwalk.flow.cell_means import CellMeans, Samples, average_cells, field_of_cells
from driftwalk.flow.grid import Grid, make_grid
from driftwalk.schema import check_trajectory
from driftwalk.schema.trajectory import read_arena

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Steps:
    """Steps of many bodies, in order of body and time; n of them."""

    body: Indices
    """Number of the body, shape (n,)."""
    first: Indices
    """Number of the sample at which the step begins, shape (n,): in a row, one more each."""
    time: Floats
    """Middle of the step in time [s], shape (n,)."""
    interval: Floats
    """Duration [s], shape (n,)."""
    position: Floats
    """Middle of the step [m], shape (n, 2)."""
    velocity: Floats
    """Velocity [m/s], shape (n, 2)."""

    def select(self, chosen: Bools) -> Steps:
        """Return some of the steps."""
        return Steps(*(column[chosen] for column in vars(self).values()))

    @property
    def goes_on(self) -> Bools:
        """Whether each step but the last ends where the next one begins, shape (n - 1,)."""
        same = self.body[1:] == self.body[:-1]
        return np.asarray(same & (np.diff(self.first) == 1))


@dataclass(frozen=True)
class FoundSteps:
    """The steps of a recording, and how many pairs of samples are none."""

    steps: Steps
    across_gaps: int
    """Pairs of samples with a gap between."""
    ambiguous: int
    """Pairs between which the tracker could have exchanged identities."""


def track_steps(trajectory: xr.Dataset) -> FoundSteps:
    """Return the steps of all bodies of a recording.

    An interval longer than 1.5 times the median one of all tracks is a gap, as for
    `local_quadratic`. Where the tracker says that identities could have been exchanged
    (``ambiguous``), there is no step.

    Parameters
    ----------
    trajectory : xarray.Dataset
        A `trajectory`.

    Raises
    ------
    InputError
        When there is no step.

    Examples
    --------
    >>> from driftwalk.schema import build_trajectory
    >>> two = build_trajectory([0.0, 1.0, 2.0], [[0, 5], [1, 5], [2, np.nan]], np.zeros((3, 2)))
    >>> track_steps(two).steps.velocity[:, 0].tolist()
    [1.0, 1.0, 0.0]
    """
    x, y = (trajectory[name].values.T for name in ("x", "y"))
    body, row = np.nonzero(np.isfinite(x) & np.isfinite(y))
    time, position = trajectory["time"].values[row], np.column_stack([x[body, row], y[body, row]])
    first = np.flatnonzero(body[1:] == body[:-1])
    if first.size == 0:
        raise InputError(
            "no body has two positions, and a velocity needs two: is each row a separate body? "
            "Name the column of the identities with `columns`"
        )
    interval = np.diff(time)[first]
    near = interval <= _TRACERS.across * float(np.median(interval))
    sure = np.ones(first.size, dtype=bool)
    if "ambiguous" in trajectory:
        unsure = (trajectory["ambiguous"].values.T > 0.0)[body, row]
        sure = ~(unsure[first] | unsure[first + 1])
    begin, end = position[first], position[first + 1]
    moment, middle = 0.5 * (time[first] + time[first + 1]), 0.5 * (begin + end)
    velocity = (end - begin) / interval[:, None]
    steps = Steps(body[first], first, moment, interval, middle, velocity)
    return FoundSteps(
        steps.select(near & sure),
        across_gaps=int(np.count_nonzero(~near)),
        ambiguous=int(np.count_nonzero(near & ~sure)),
    )


def step_noise(steps: Steps) -> float:
    """Estimate the position noise of many tracks, too short for an estimate each.

    The fourth divided difference of five positions in a row, at their own times, holds next to
    nothing of a smooth path. Scaled to weights whose squares add up to one, it has the variance r²
    of white noise r per axis. The median size says r, and false links hardly change it.

    Parameters
    ----------
    steps : Steps
        Steps as `track_steps` returns them.

    Returns
    -------
    float
        Standard deviation per axis [m]; NaN where there are too few samples in a row.

    Examples
    --------
    >>> from driftwalk.schema import build_trajectory
    >>> noise = np.random.default_rng(1).normal(0.0, 3e-4, (2, 5, 1000))
    >>> x = 0.01 * np.arange(5)[:, None] + noise[0]
    >>> r = step_noise(track_steps(build_trajectory(np.arange(5) * 0.1, x, noise[1])).steps)
    >>> round(r, 4)
    0.0003
    """
    if steps.time.size < 4:
        return math.nan
    in_a_row = np.lib.stride_tricks.sliding_window_view(steps.goes_on, 3).all(axis=1)
    if np.count_nonzero(in_a_row) < _TRACERS.fewest_in_a_row:
        return math.nan
    window = np.flatnonzero(in_a_row)[:, None] + np.arange(4)
    interval = steps.interval[window]
    time = _from_zero(interval)
    position = _from_zero(steps.velocity[window] * interval[..., None])
    # A sample's distance to itself is no factor.
    apart = time[:, :, None] - time[:, None, :] + np.eye(time.shape[1])
    weight = 1.0 / apart.prod(axis=2)
    weight /= np.sqrt(np.sum(weight**2, axis=1, keepdims=True))
    return 1.4826 * float(np.median(np.abs(np.einsum("nk,nki->ni", weight, position))))


def _from_zero(changes: Floats) -> Floats:
    """Return the sums of changes along axis 1, with a zero in front."""
    return np.concatenate([np.zeros_like(changes[:, :1]), np.cumsum(changes, axis=1)], axis=1)


class LinkPolicy(NamedTuple):
    """Which steps are false links."""

    threshold: float = 4.0
    """Normalised deviation of a false link. Chance: with 16 neighbours, 0.2 % of steps that scatter
    as a Gaussian around the same velocity reach it."""
    neighbours: int = 16
    """Steps of other tracks with which a step is compared; chosen by hand."""
    fewest: int = 8
    """Neighbours without which a step is not judged: by convention as many as a vector on a grid of
    PIV has."""
    searched: tuple[int, ...] = (32, 128)
    """Nearest steps among which those of other tracks are looked for: few, then more; chosen by
    hand."""


LINKS: Final = LinkPolicy()
_CHUNK: Final = 1 << 14
"""Steps whose neighbours are looked up at once: some 40 MB; chosen by hand."""


def judge_steps(steps: Steps, *, noise: float) -> Floats:
    """Return how far every step deviates from its neighbours, and from the steps around it.

    A step with too few neighbours is not judged: NaN. One above a threshold is a false link.

    The normalised median test (Westerweel and Scarano, Exp. Fluids 39 (2005) 1096), on the
    nearest steps of other tracks, at any time: with the median m of their velocities, by component,
    and the median r of their distances |v_i - m| from it, a step deviates by
    ``|v - m| / (r + e)``, where ``e = sqrt(2) noise / interval`` is the noise of a velocity.

    Where the velocity changes within the distance of the neighbours, a step may differ from them
    and be right: then it is like the step before or after it in its own track, which a false link
    is not. So the smallest of the distances from m and from these two counts.

    Parameters
    ----------
    steps : Steps
        Steps in order of body and time.
    noise : float
        Position noise per axis [m].

    Examples
    --------
    >>> from driftwalk.flow.tracers import track_steps
    >>> from driftwalk.schema import build_trajectory
    >>> x = np.arange(5.0)[:, None] + np.linspace(0.0, 1.0, 20)
    >>> x[3:, 7] += 9.0
    >>> steps = track_steps(build_trajectory(np.arange(5.0), x, 0.0 * x)).steps
    >>> np.flatnonzero(judge_steps(steps, noise=0.01) > LINKS.threshold).tolist()
    [30]
    """
    middle, spread = _neighbourhood(steps)
    apart = np.minimum(_length(steps.velocity - middle), _from_own(steps))
    own_noise = np.sqrt(2.0) * noise / steps.interval
    with np.errstate(divide="ignore", invalid="ignore"):
        deviation = apart / (spread + own_noise)
    # Neighbours that all agree, and a step that agrees with them.
    deviation[(apart == 0.0) & np.isfinite(spread)] = 0.0
    return np.asarray(deviation)


def _from_own(steps: Steps) -> Floats:
    """Return how far a velocity is from the nearer one of its neighbours in time, inf without."""
    apart = np.full(steps.time.size, np.inf)
    at = np.flatnonzero(steps.goes_on)
    change = _length(steps.velocity[at + 1] - steps.velocity[at])
    apart[at] = change
    apart[at + 1] = np.minimum(apart[at + 1], change)
    return apart


def _neighbourhood(steps: Steps) -> tuple[Floats, Floats]:
    """Return the median velocity of the neighbours and the median distance from it."""
    from scipy.spatial import cKDTree

    count = steps.time.size
    middle, spread = np.full((count, 2), np.nan), np.full(count, np.nan)
    tree = cKDTree(steps.position)
    left = np.arange(count)
    for searched in LINKS.searched:
        lacking = []
        for start in range(0, left.size, _CHUNK):
            at = left[start : start + _CHUNK]
            _, near = tree.query(steps.position[at], min(searched, count))
            near = near.reshape(at.size, -1)
            other = steps.body[near] != steps.body[at][:, None]
            enough = np.count_nonzero(other, axis=1) >= LINKS.neighbours
            last = searched == LINKS.searched[-1]
            judged = enough | (last & (np.count_nonzero(other, axis=1) >= LINKS.fewest))
            lacking.append(at[~enough])
            chosen = near[judged], other[judged]
            middle[at[judged]], spread[at[judged]] = _medians(steps.velocity, *chosen)
        left = np.concatenate(lacking) if lacking else left[:0]
    return middle, spread


def _medians(velocity: Floats, near: npt.NDArray[np.intp], other: Bools) -> tuple[Floats, Floats]:
    """Return both medians over the nearest steps of other tracks."""
    first = np.argsort(~other, axis=1, kind="stable")[:, : LINKS.neighbours]
    there = np.take_along_axis(other, first, axis=1)
    around = velocity[np.take_along_axis(near, first, axis=1)]
    around[~there] = np.nan
    median: Callable[..., Any] = np.median if there.all() else np.nanmedian
    middle = median(around, axis=1)
    return middle, median(_length(around - middle[:, None]), axis=1)


def _length(vectors: Floats) -> Floats:
    return np.hypot(vectors[..., 0], vectors[..., 1])


class TracerPolicy(NamedTuple):
    """When tracks of tracers are in doubt."""

    usual_noise_px: float = 0.1
    """Position noise of a tracker of particles, where the tracks are too short to tell
    [pixels]; chosen by hand."""
    many_rejected: float = 0.1
    """Share of false links above which the linking as a whole is in doubt; chosen by hand."""
    long_step: float = 1.0
    """Median step, in cells, above which the steps blur the field; chosen by hand."""
    across: float = 1.5
    """Usual intervals beyond which a step is one across a gap; chosen by hand."""
    fewest_in_a_row: int = 50
    """Fourth differences without which the noise of positions is not known; chosen by hand."""


_TRACERS: Final = TracerPolicy()


def flow_from_tracers(
    trajectory: xr.Dataset,
    *,
    arena: Mapping[str, Any] | str | None = None,
    cells: int = 50,
    cell_size: float | None = None,
    position_noise: float | None = None,
    outlier_threshold: float = LINKS.threshold,
    min_count: int = 1,
) -> xr.Dataset:
    """Estimate the velocity of the water from the tracks of passive tracers (PTV).

    A tracer moves as the water does. Each step from one sample of a track to the next, not across
    a gap, is one velocity in the middle of the step. Steps that join two different particles are
    left out (`judge_steps`), the others are averaged in square cells. Cells without data are filled
    from their neighbours (`fill_velocity`).

    Parameters
    ----------
    trajectory : xarray.Dataset
        A `trajectory` in metres, each body of which is a tracer. Tracks may be as short as two
        samples.
    arena : mapping or str, optional
        Outline of the tank, as `outline_of` reads it; default: the trajectory's own. Where there
        is none, the field covers the box that the tracers were in, without a wall.
    cells : int, optional
        Cells across the longer side of the tank.
    cell_size : float, optional
        Side of a cell [m], in place of `cells`.
    position_noise : float, optional
        Noise of the positions, per axis [m], for the test of the links; default: estimated from
        the tracks (`step_noise`), or a tenth of a pixel where they are too short for that, and not
        below that of the file's resolution.
    outlier_threshold : float, optional
        Normalised deviation above which a step is a false link; infinite to keep all.
    min_count : int, optional
        Smallest number of steps in a measured cell.

    Returns
    -------
    xarray.Dataset
        A `flow_field`. ``flag`` is *measured* for cells with at least `min_count` steps, *filled*
        for the other cells of the tank, *outside* for nodes beyond the wall. ``count`` is the
        number of steps, ``tracks`` that of tracks. The steps of a track in a cell count as one
        observation: the standard errors come from leaving out one track at a time
        (`average_cells`), and are NaN with fewer than two tracks. ``attrs`` holds every setting,
        what was left out and why, the shares of measured and filled cells and, where there is
        something to know, ``warning``.

    Raises
    ------
    InputError
        When no body has two positions, an option is out of range, or no cell has enough steps.

    Examples
    --------
    >>> import numpy as np
    >>> from driftwalk.schema import build_trajectory
    >>> t, start = np.arange(10) * 0.1, np.linspace(-0.1, 0.1, 40)
    >>> x = start + 0.02 * t[:, None]
    >>> flow = flow_from_tracers(build_trajectory(t, x, x[:, ::-1]), cells=10)
    >>> float(flow.u.mean().round(6)), int(flow.tracks.max())
    (0.02, 5)
    """
    check_trajectory(trajectory)
    _check_options(min_count, outlier_threshold, position_noise)
    found = track_steps(trajectory)
    steps = found.steps
    described = trajectory.attrs.get("arena") if arena is None else arena
    tank = read_arena(described) if described else None
    outline = None if tank is None else outline_of(tank)
    grid = make_grid(_box(steps) if outline is None else outline, cells=cells, cell_size=cell_size)
    inside = steps if outline is None else steps.select(outline.depth(*steps.position.T) >= 0.0)
    if inside.time.size == 0:
        low, high = steps.position.min(axis=0), steps.position.max(axis=0)
        raise InputError(
            f"no tracer is in the tank: the tracks cover x from {low[0]:.4g} to {high[0]:.4g} m, "
            f"y from {low[1]:.4g} to {high[1]:.4g} m; check the scale, the origin and the arena"
        )
    noise = _noise(trajectory, steps) if position_noise is None else position_noise
    # Beyond the wall there is no flow to agree with: such steps would count as neighbours of true
    # ones.
    deviation = judge_steps(inside, noise=noise)
    false = deviation > outlier_threshold
    kept = inside.select(~false)
    means = _average(kept, grid)
    measured = means.count.reshape(grid.shape) >= min_count
    if not measured.any():
        raise InputError(
            f"no cell has {min_count} steps of tracers: lower `min_count` or give larger cells "
            "(`cells`)"
        )
    settings: dict[str, Any] = {
        "method": "cell means of tracers' velocities",
        "cell_size_m": grid.cell_size,
        "min_count": min_count,
        "position_noise_m": noise,
        "outlier_threshold": outlier_threshold,
        "tracks_used": int(np.unique(kept.body).size),
        "samples_used": int(kept.time.size),
        "samples_rejected": int(np.count_nonzero(false)),
        "samples_unjudged": int(np.count_nonzero(np.isnan(deviation))),
        "samples_across_gaps": found.across_gaps,
        "samples_ambiguous": found.ambiguous,
        "samples_outside_tank": int(steps.time.size - inside.time.size),
        "source": str(trajectory.attrs.get("source", "")),
        **({} if tank is None else {"arena": json.dumps(tank)}),
    }
    return field_of_cells(
        grid,
        outline,
        means,
        measured,
        settings,
        doubts=_doubts(kept, grid, means, settings),
        count=means.count.reshape(grid.shape),
        tracks=means.visits.reshape(grid.shape),
    )


def _check_options(min_count: int, outlier_threshold: float, noise: float | None) -> None:
    if min_count < 1:
        raise InputError(f"`min_count` must be at least 1, got {min_count}")
    if not outlier_threshold > 0.0:
        raise InputError(f"`outlier_threshold` must be above 0, got {outlier_threshold}")
    if noise is not None and not (math.isfinite(noise) and noise >= 0.0):
        raise InputError(f"`position_noise` must be a length in m, 0 or more, got {noise}")


def _box(steps: Steps) -> Outline:
    """Return the box of the steps: a region to lay cells over, not a wall."""
    low, high = steps.position.min(axis=0), steps.position.max(axis=0)
    if not (high > low).any():
        raise InputError(
            f"all tracers are at one point, ({low[0] + 0.0:g}, {low[1] + 0.0:g}) m: there is no "
            "field to measure; are these the right columns?"
        )
    # A box without height has no area; its cells have the size that the other side gives them.
    width, height = np.maximum(high - low, 1e-6 * (high - low).max()).tolist()
    box = {"shape": "rectangle", "width_m": width, "height_m": height}
    return outline_of({**box, "center_m": ((low + high) / 2.0).tolist()})


def _noise(trajectory: xr.Dataset, steps: Steps) -> float:
    """Return the position noise [m], at least that of rounding to the file's resolution."""
    rounding = float(trajectory.attrs.get("position_quantum_m") or 0.0) / math.sqrt(12.0)
    estimate = step_noise(steps)
    if math.isnan(estimate):
        estimate = _TRACERS.usual_noise_px * float(trajectory.attrs.get("metres_per_pixel") or 0.0)
    return max(estimate, rounding)


def _average(steps: Steps, grid: Grid) -> CellMeans:
    """Return the mean velocity of each cell; a track is one visit, however often it returns."""
    cell = grid.cell_of(*steps.position.T)
    samples = Samples(cell, steps.body, steps.time, steps.velocity, np.zeros_like(steps.velocity))
    return average_cells(samples, cells=grid.size, pause=math.inf, correction=np.zeros_like)


def _doubts(steps: Steps, grid: Grid, means: CellMeans, settings: Mapping[str, Any]) -> list[str]:
    """Return what speaks against the links and the cells, in sentences."""
    sentences = []
    rejected, judged = settings["samples_rejected"], settings["samples_used"]
    judged += rejected - settings["samples_unjudged"]
    if rejected > _TRACERS.many_rejected * judged:
        sentences.append(
            f"{rejected} of {judged} steps fit neither their neighbours nor their own track and "
            "were left out: are the tracks linked rightly, or are these no passive tracers?"
        )
    length = float(np.median(np.hypot(*steps.velocity.T) * steps.interval))
    if length > _TRACERS.long_step * grid.cell_size:
        sentences.append(
            f"The usual step is {1e3 * length:.3g} mm long and a cell {1e3 * grid.cell_size:.3g} "
            "mm: the steps blur the field; use larger cells."
        )
    if not (means.visits > 1).any():
        sentences.append("No cell has two tracks: there are no standard errors; use larger cells.")
    return sentences
