"""Simulation under the conditions of a recording."""

from __future__ import annotations

from typing import TYPE_CHECKING

from driftwalk.conditions.camera import recorded_camera
from driftwalk.conditions.recorded import sample_times
from driftwalk.conditions.start import recorded_start
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
    from driftwalk.model import apply_overrides
    from driftwalk.schema import body_track

    track = body_track(recording, body)
    quantum = float(recording.attrs.get("position_quantum_m", 0.0))
    camera = recorded_camera(track, study, position_quantum=quantum)
    study = apply_overrides(
        study,
        {
            "observation.position_noise_m": camera.position_noise,
            "observation.orientation_noise_rad": camera.orientation_noise,
            "observation.position_quantum_m": camera.position_quantum,
        },
    )
    begin = recorded_start(track)
    return simulate(
        study,
        flow,
        sample_time=sample_times(track, study),
        start=begin,
        replicates=replicates,
        seed=seed,
        threads=threads,
    )
