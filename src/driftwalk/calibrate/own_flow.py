"""The flow field of a calibration that is given none: extracted from the recording itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

from driftwalk.flow.extract import extract_flow
from driftwalk.schema import Track, build_trajectory

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


def flow_from_track(track: Track, study: Study) -> xr.Dataset:
    """Return the flow field that the paper's estimator finds in one track.

    Parameters
    ----------
    track : Track
        The body that is calibrated.
    study : Study
        Tank, block, water and the section [flow].

    Returns
    -------
    xarray.Dataset
        A `flow_field`.
    """
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
