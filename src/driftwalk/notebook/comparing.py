"""Compare two motions, or a recording with all replicates of a simulation."""

from __future__ import annotations

from typing import TYPE_CHECKING

from driftwalk.core.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.comparison.ks import Ties


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
    trajectory_a : xarray.Dataset
        A `trajectory`.
    trajectory_b : xarray.Dataset
        Another one; or a simulation, of which every replicate is compared with the first motion.
    body_a, body_b : str, optional
        Names of the bodies, where there are several.
    step_interval : float, optional
        Time between the positions of a step [s], the same for both; default: the longer of the two
        median sampling intervals.
    ties : {"strict", "limits"}
        As in `ks_distance`.
    block_length, permutations, seed
        Of two single motions: as in `driftwalk.comparison.block_permutation_test`.

    Returns
    -------
    xarray.Dataset
        Of two single motions a `comparison`, see `driftwalk.comparison.compare`; with several
        replicates a `replicate_comparison`, see `driftwalk.comparison.compare_replicates`. Both
        have ``ks_distance``, ``noise_floor`` and ``p_value``.

    Raises
    ------
    InputError
        When a body is not there or no steps can be formed.

    Examples
    --------
    >>> import driftwalk as dw
    >>> recording = dw.tank30_recording().isel(time=slice(0, 600))
    >>> run = dw.simulate(dw.Study(), dw.tank30_flow(), like=recording, replicates=3)
    >>> 0.25 <= float(dw.compare(recording, run)["p_value"]) <= 1.0
    True
    """
    from driftwalk.comparison import compare as compare_two, compare_replicates

    if trajectory_a.sizes.get("replicate", 1) > 1:
        raise InputError("the simulation comes second: compare(recording, simulation)")
    first = trajectory_a.isel(replicate=0) if "replicate" in trajectory_a.dims else trajectory_a
    if trajectory_b.sizes.get("replicate", 1) > 1:
        if body_b is not None or block_length is not None:
            raise InputError("`body_b` and `block_length` are for two single motions")
        return compare_replicates(
            first, trajectory_b, body=body_a, step_interval=step_interval, ties=ties
        )
    second = trajectory_b.isel(replicate=0) if "replicate" in trajectory_b.dims else trajectory_b
    return compare_two(
        first,
        second,
        body_a=body_a,
        body_b=body_b,
        step_interval=step_interval,
        ties=ties,
        block_length=block_length,
        permutations=permutations,
        seed=seed,
    )
