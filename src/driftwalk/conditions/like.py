"""Simulate under the conditions of a recording."""

from __future__ import annotations

from typing import TYPE_CHECKING

from driftwalk.conditions.camera import study_as_seen
from driftwalk.conditions.recorded import recorded_start, sample_times
from driftwalk.simulation import simulate

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


def simulate_like(
    study: Study,
    flow: xr.Dataset,
    recording: xr.Dataset,
    *,
    body: str | None = None,
    replicates: int | None = None,
    seed: int | None = None,
    threads: int | None = None,
) -> xr.Dataset:
    """Simulate with the start, time stamps, gaps and camera of a recording.

    Parameters
    ----------
    study, flow
        As in `simulate`; noise and resolution that the study leaves open are the recording's.
    recording : xarray.Dataset
        A `trajectory`; its present samples give the time stamps, its first samples the start.
    body : str, optional
        The body to follow, where there are several.
    replicates, seed, threads
        As in `simulate`.

    Returns
    -------
    xarray.Dataset
        As of `simulate`; time 0 is the recording's first sample.

    Raises
    ------
    InputError
        When the body is not named and there are several.

    Examples
    --------
    >>> import driftwalk as dw
    >>> recording, flow = dw.tank30_recording(), dw.tank30_flow()
    >>> run = dw.simulate_like(dw.Study(), flow, recording.isel(time=slice(0, 100)))
    >>> run.sizes["time"]
    100
    """
    from driftwalk.schema import body_track

    track = body_track(recording, body)
    study = study_as_seen(study, recording, track)
    begin = recorded_start(track)
    return simulate(
        study,
        flow,
        sample_time=sample_times(track, study),
        start=begin,
        flow_start=0.0,
        replicates=replicates,
        seed=seed,
        threads=threads,
    )
