"""Compare two motions, or a recording with the replicates of a simulation, by their steps."""

from __future__ import annotations

import itertools
import json
from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.comparison.ks import KsComparison, Points, Ties, ks_compare, ks_distance
from driftwalk.comparison.plan import steps, usual_interval
from driftwalk.comparison.significance import PermutationTest, block_permutation_test
from driftwalk.comparison.statistic import joint_density, step_length_edges, turning_angle_edges
from driftwalk.core.errors import InputError
from driftwalk.core.text_files import parse_json
from driftwalk.schema import body_track
from driftwalk.schema.check import build_dataset

if TYPE_CHECKING:
    import xarray as xr


def compare(
    trajectory_a: xr.Dataset,
    trajectory_b: xr.Dataset,
    *,
    body_a: str | None = None,
    body_b: str | None = None,
    step_interval: float | None = None,
    ties: Ties = "strict",
    block_length: int | None = None,
    permutations: int = 999,
    seed: int = 1,
) -> xr.Dataset:
    """Compare the step lengths and turning angles of two motions.

    Parameters
    ----------
    trajectory_a, trajectory_b : xarray.Dataset
        Two `trajectory` datasets.
    body_a, body_b : str, optional
        Names of the bodies; may be left out where there is only one.
    step_interval : float, optional
        Time between the positions of a step [s], the same for both; default: the longer of the two
        median sampling intervals.
    ties : {"strict", "limits"}
        As in `ks_distance`.
    block_length, permutations, seed
        As in `block_permutation_test`; ``permutations=0`` leaves the test out.

    Returns
    -------
    xarray.Dataset
        Kind "comparison". Numbers: ``ks_distance`` (D), ``ks_distance_a``, ``ks_distance_b`` (D1,
        D2), ``score`` (1 - D); where D sits: ``ks_step_length`` [m], ``ks_turning_angle`` [rad],
        ``ks_quadrant`` (0 to 3, NaN and -1 when D is 0); ``tied_fraction``; of the test
        ``p_value``, ``noise_floor``, ``block_length``, ``autocorrelation_time`` [steps] (NaN, or 0,
        when it was not made). By ``motion`` ("a", "b"): ``pairs``, ``zero_length``, ``gaps``,
        ``mean_step_length`` [m], ``median_step_length`` [m], ``std_turning_angle`` [rad], ``mode``,
        ``step_density`` (density_step_length, density_turning_angle), fractions per bin with edges
        ``step_length_edge`` [m], ``turning_angle_edge`` [rad]. ``attrs``: ``step_interval_s``,
        ``permutations``, ``seed``, ``ties``, ``warnings`` (JSON list of sentences).

    Raises
    ------
    InputError
        When a body is not there or no steps can be formed.

    Warns
    -----
    ComparisonWarning
        For steps of zero length and tied points, see `steps` and `ks_distance`.

    Examples
    --------
    >>> import driftwalk
    >>> a, b = driftwalk.load("a.csv"), driftwalk.load("b.csv")  # doctest: +SKIP
    >>> float(driftwalk.compare(a, b)["ks_distance"])  # doctest: +SKIP
    0.021
    """
    trajectories = ((trajectory_a, body_a), (trajectory_b, body_b))
    interval = step_interval
    if interval is None:
        # Steps of both have to last as long, and those of the slower recording cannot be shorter.
        interval = max(sampling_interval(dataset, body) for dataset, body in trajectories)
    walks = [steps(dataset, body=body, step_interval=interval) for dataset, body in trajectories]
    points = [_points(walk) for walk in walks]
    result = ks_compare(*points, ties=ties)
    sentences = [
        f"motion {name}: {sentence}"
        for name, walk in zip("ab", walks, strict=True)
        for sentence in parse_json(walk.attrs["warnings"])
    ]
    test = None
    if permutations > 0:
        try:
            test = block_permutation_test(
                *points, block_length=block_length, permutations=permutations, seed=seed, ties=ties
            )
        except InputError as error:
            sentences.append(f"no significance test: {error}")
    return _dataset(
        walks,
        result,
        test,
        attrs={
            "step_interval_s": interval,
            "permutations": permutations if test is not None else 0,
            "seed": seed,
            "ties": ties,
            "warnings": json.dumps(sentences),
        },
    )


def sampling_interval(trajectory: xr.Dataset, body: str | None) -> float:
    """Return the median time between the samples of a body [s]."""
    time = body_track(trajectory, body).time
    if time.size < 3:
        raise InputError(f"steps need at least three samples, got {time.size}")
    return usual_interval(time)


def step_points(trajectory: xr.Dataset, body: str | None, interval: float) -> Points:
    """Return step lengths [m] and turning angles [rad] of a body, shape (n, 2)."""
    return _points(steps(trajectory, body=body, step_interval=interval))


def _points(walk: xr.Dataset) -> Points:
    return np.column_stack([walk["step_length"].values, walk["turning_angle"].values])


def _dataset(
    walks: list[xr.Dataset],
    result: KsComparison,
    test: PermutationTest | None,
    *,
    attrs: dict[str, Any],
) -> xr.Dataset:
    lengths = [walk["step_length"].values for walk in walks]
    angles = [walk["turning_angle"].values for walk in walks]
    # Edges of both together: their densities are compared bin by bin.
    length_edge, angle_edge = step_length_edges(*lengths), turning_angle_edges()
    density = [
        joint_density(length, angle, step_length_edge=length_edge, turning_angle_edge=angle_edge)
        for length, angle in zip(lengths, angles, strict=True)
    ]
    place = result.place
    data: dict[str, Any] = {
        "ks_distance": ((), result.distance),
        "ks_distance_a": ((), result.distance_a),
        "ks_distance_b": ((), result.distance_b),
        "score": ((), 1.0 - result.distance),
        "ks_step_length": ((), place.x),
        "ks_turning_angle": ((), place.y),
        "ks_quadrant": ((), np.int8(place.quadrant)),
        "tied_fraction": ((), result.tied_fraction),
        "p_value": ((), test.p_value if test else np.nan),
        "noise_floor": ((), test.noise_floor if test else np.nan),
        "block_length": ((), test.block_length if test else 0),
        "autocorrelation_time": ((), test.autocorrelation_time if test else np.nan),
    }
    for name in ("pairs", "zero_length", "gaps"):
        data[name] = ("motion", [walk.attrs[name] for walk in walks])
    data |= {
        "mode": ("motion", np.array([walk.attrs["mode"] for walk in walks], dtype=object)),
        "mean_step_length": ("motion", [length.mean() for length in lengths]),
        "median_step_length": ("motion", [np.median(length) for length in lengths]),
        "std_turning_angle": ("motion", [angle.std() for angle in angles]),
        "step_density": (("motion", "density_step_length", "density_turning_angle"), density),
    }
    coords = {
        "motion": ("motion", np.array(["a", "b"], dtype=object)),
        "step_length_edge": ("step_length_edge", length_edge),
        "turning_angle_edge": ("turning_angle_edge", angle_edge),
    }
    return build_dataset("comparison", data, coords, attrs)


def compare_replicates(
    recording: xr.Dataset,
    simulation: xr.Dataset,
    *,
    body: str | None = None,
    step_interval: float | None = None,
    ties: Ties = "strict",
) -> xr.Dataset:
    """Compare the steps of a recording with those of every replicate of a simulation.

    If the model is right, recording and replicates are exchangeable: each is as far from the others
    as any. The p-value is the share of these motions whose mean KS distance to the others is at
    least the recording's. A model that was fitted to the recording lies nearer to it than the truth
    does, so that the p-value is then on the safe side (too large).

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    simulation : xarray.Dataset
        As of `simulate`, with at least two replicates.
    body : str, optional
        The recorded body, where there are several.
    step_interval : float, optional
        Time between the positions of a step [s], the same for all; default: the longer of the two
        median sampling intervals.
    ties : {"strict", "limits"}
        As in `ks_distance`.

    Returns
    -------
    xarray.Dataset
        Kind "replicate_comparison". ``ks_distance`` (replicate): KS distance of each replicate to
        the recording; ``mean_ks_distance``: their mean; ``noise_floor``: mean KS distance of two
        replicates; ``p_value``, from 1 / (replicates + 1) to 1. ``attrs``: ``step_interval_s``,
        ``ties``.

    Raises
    ------
    InputError
        When there are fewer than two replicates, or no steps can be formed.

    Examples
    --------
    >>> import driftwalk as dw
    >>> recording = dw.tank30_recording().isel(time=slice(0, 600))
    >>> run = dw.simulate(dw.Study(), dw.tank30_flow(), like=recording, replicates=3)
    >>> dw.comparison.compare_replicates(recording, run)["ks_distance"].sizes["replicate"]
    3
    """
    from scipy.spatial.distance import squareform

    count = simulation.sizes.get("replicate", 0)
    if count < 2:
        raise InputError(f"at least two replicates are needed, got {count}: simulate more")
    replicates = [simulation.isel(replicate=index) for index in range(count)]
    interval = step_interval
    if interval is None:
        interval = max(sampling_interval(recording, body), sampling_interval(replicates[0], None))
    motions = [step_points(recording, body, interval)]
    motions += [step_points(one, None, interval) for one in replicates]
    pairs = itertools.combinations(motions, 2)
    distance = squareform([ks_distance(*pair, ties=ties) for pair in pairs])
    mean = distance.sum(axis=1) / count
    among = distance[1:, 1:][np.triu_indices(count, k=1)]
    return build_dataset(
        "replicate_comparison",
        {
            "ks_distance": ("replicate", distance[0, 1:]),
            "mean_ks_distance": ((), mean[0]),
            "noise_floor": ((), among.mean()),
            "p_value": ((), np.mean(mean >= mean[0])),
        },
        {"replicate": simulation["replicate"]},
        {"step_interval_s": interval, "ties": ties},
    )
