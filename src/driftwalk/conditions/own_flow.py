"""The flow field of a calibration that is given none: extracted from the recording itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

from driftwalk.flow import extract_flow
from driftwalk.schema import Track, body_track, build_trajectory

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


def recording_flow(recording: xr.Dataset, study: Study, *, body: str | None = None) -> xr.Dataset:
    """Return the flow field that a calibration takes from the recording if none is given.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    study : Study
        Tank, block, water and the section [flow].
    body : str, optional
        The body, where there are several.

    Returns
    -------
    xarray.Dataset
        A `flow_field`, by the paper's estimator (Eq. 4).

    Raises
    ------
    InputError
        When no cell can be measured.

    Examples
    --------
    >>> import driftwalk as dw
    >>> int(dw.conditions.recording_flow(dw.tank30_recording(), dw.Study()).sizes["x"])
    50
    """
    return flow_from_track(body_track(recording, body), study)


def flow_from_track(track: Track, study: Study) -> xr.Dataset:
    """Return the flow field of one track; see `recording_flow`."""
    settings = study.flow
    return extract_flow(
        build_trajectory(track.time, track.x, track.y, track.theta),
        arena=study.tank.to_arena(),
        cells=settings.cells,
        cell_size=settings.cell_size_m,
        window=settings.smoothing_window_s,
        inertia=settings.inertia,
        mass=study.block.mass_kg,
        side=study.block.side_m,
        depth=study.wetted_depth_m,
        water_density=study.water.density_kg_m3,
        flow_drag_coefficient=settings.flow_drag_coefficient,
        min_count=settings.min_count,
    )
