"""The tank of a run: that of the study, or the arena that the recording was read with."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.flow.arena import outline_of
from driftwalk.record import noise_reach
from driftwalk.schema import body_track

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

OUTLINE: Final = ("shape", "diameter_m", "width_m", "height_m", "vertices_m")
"""Keys of a tank that state its outline; the others are about its wall."""
MOST_OUTSIDE = 0.01
"""Share of positions outside the tank, farther than noise takes them, from which on the tank cannot
be right."""


def study_in_arena(study: Study, recording: xr.Dataset) -> Study:
    """Return the study with the recording's arena as its tank, the wall's properties kept.

    Parameters
    ----------
    study : Study
        Its [tank] stays where the recording has no arena.
    recording : xarray.Dataset
        A `trajectory`, read with an arena or without.

    Returns
    -------
    Study
        The same study where the recording has no arena.

    Examples
    --------
    >>> import driftwalk as dw
    >>> wide = dw.apply_overrides(dw.Study(), {"tank.diameter_m": 1.0})
    >>> study_in_arena(wide, dw.tank30_recording()).tank.diameter_m
    0.3
    """
    from driftwalk.model import Tank, apply_overrides

    arena = recording.attrs.get("arena")
    if arena is None:
        return study
    wall = study.tank
    tank = Tank.from_arena(
        arena,
        wall_restitution=wall.wall_restitution,
        wall_friction=wall.wall_friction,
        bounce_speed_m_s=wall.bounce_speed_m_s,
    )
    given = {f"tank.{key}": getattr(tank, key) for key in OUTLINE if getattr(tank, key) is not None}
    return apply_overrides(study, given)


def require_inside(study: Study, recording: xr.Dataset, body: str | None) -> None:
    """Refuse a tank that does not hold the recorded positions.

    The camera's noise shows a body at the wall beyond it: by four standard deviations at most, of
    the study's noise or of the one that is estimated (`driftwalk.record.noise_reach`). A simulated
    recording in its own tank is not looked at: the body kept to it.

    Parameters
    ----------
    study : Study
        Its tank.
    recording : xarray.Dataset
        A `trajectory`.
    body : str or None
        The body, where there are several.

    Raises
    ------
    InputError
        When more than 1 % of the positions lie farther outside than noise takes them.

    Examples
    --------
    >>> import driftwalk as dw
    >>> require_inside(dw.Study(), dw.tank30_recording(), None)
    """
    tank = study.tank
    own = study_in_arena(study, recording).tank
    if "arena" in recording.attrs and recording.attrs.get("simulated") == "yes" and own == tank:
        return
    track = body_track(recording, body)
    outline = outline_of(tank.to_arena())
    beyond = -outline.depth(track.x, track.y)
    if np.mean(beyond > 0.0) <= MOST_OUTSIDE:
        return
    x_min, y_min, x_max, y_max = outline.bounds
    stated = study.observation.position_noise_m
    reach = noise_reach(
        track,
        None if isinstance(stated, str) else stated,
        size=min(x_max - x_min, y_max - y_min),
    )
    share = np.mean(beyond > reach)
    if share > MOST_OUTSIDE:
        raise InputError(
            f"{share:.0%} of the positions lie outside the tank, a {tank.describe()} "
            f"about the origin, farther than noise takes them ({1e3 * reach:.2g} mm): the "
            f"recording spans x {track.x.min():.3g} to {track.x.max():.3g} m, y "
            f"{track.y.min():.3g} to {track.y.max():.3g} m; "
            "state the tank with `tank.diameter_m`, `tank` of `load` or [tank] in a study file"
        )
