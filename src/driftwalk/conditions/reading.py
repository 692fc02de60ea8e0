"""Read recordings by the [recording] section of a study, overridden by arguments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

from driftwalk.conditions.refuse import prefix_of, require_motion, require_positions
from driftwalk.conditions.study import is_stated, study_for, study_in_arena
from driftwalk.core.errors import InputError
from driftwalk.core.text_files import parse_json
from driftwalk.model import Study, apply_overrides
from driftwalk.record import load

if TYPE_CHECKING:
    import xarray as xr


Tank = Literal["stated", "unsaid"]
Bodies = Literal["named", "all"]


class ReadRecordings(NamedTuple):
    """The recordings of a piece of work, and the study that they are worked on with."""

    trajectories: list[xr.Dataset]
    study: Study
    body: str | None
    """The body, where the arguments or the study name one."""


def read_recordings(
    paths: Sequence[Path],
    study: Study,
    given: Mapping[str, Any] | None = None,
    *,
    tank: Tank = "stated",
    body: str | None = None,
    bodies: Bodies = "named",
) -> ReadRecordings:
    """Read the recordings of a fit or a calibration, and settle tank and block of the study.

    Parameters
    ----------
    paths : sequence of Path
        Recordings of one block in one tank.
    study : Study
        Its [recording] and [tank] say how to read them.
    given : mapping, optional
        Arguments of `driftwalk.load` over it; a tank among them takes the place of the study's.
    tank : {"stated", "unsaid"}
        Whether anybody says the tank; otherwise an arena that a file itself holds is used, and the
        default study's where it holds none.
    body : str, optional
        The body, where there are several.
    bodies : {"named", "all"}
        Which bodies the recordings keep where one is named.

    Returns
    -------
    ReadRecordings
        One `trajectory` per path, and the study with their tank and block.

    Raises
    ------
    InputError
        When a file cannot be read, holds no motion, lies outside the tank, or two recordings say
        two tanks.

    Examples
    --------
    >>> from importlib.resources import files
    >>> import driftwalk as dw
    >>> path = Path(str(files("driftwalk.datasets") / "tank30_ode_a" / "recording.csv"))
    >>> read = dw.conditions.read_recordings([path], dw.Study(), {"tank": "circle:32cm"})
    >>> read.study.tank.diameter_m
    0.32
    """
    values = dict(given or {})
    trajectories, of_files = [], []
    for path in paths:
        trajectory, of_file = load_for_run(path, study, values, tank=tank)
        for one in one_body_each([trajectory], study) if len(paths) == 1 else [trajectory]:
            require_motion(one, body=body, where=path)
            if bodies == "all":
                one = _with_others(one, path, study, values)
            trajectories.append(one)
        of_files.append(of_file)
    stated = is_stated(study, "tank.diameter_m") or any(of_files)
    if "tank" in values or study.recording.arena != "tank":
        study, stated = study_in_arena(study, trajectories[0]), True
    named = body or study.recording.body
    study = study_for(trajectories, study, body=named)
    # The recordings were placed in the default tank, which does not make it a stated one.
    study = study if stated else apply_overrides(study, {"tank.diameter_m": None})
    return ReadRecordings(trajectories, study, named)


MOST_BODIES: Final = 8
"""Most bodies whose forces are compared: the work grows with the third power of their number;
chosen by hand."""


def one_body_each(recordings: Sequence[xr.Dataset], study: Study) -> list[xr.Dataset]:
    """Return one recording for each body, where the study fits all bodies together.

    Parameters
    ----------
    recordings : sequence of xarray.Dataset
        One `trajectory` of two bodies or more; or several of one body each, on one clock.
    study : Study
        With ``fit.interaction`` on; otherwise the recordings are returned as they are.

    Raises
    ------
    InputError
        When there are fewer than two bodies or more than eight, or bodies are glued.

    Examples
    --------
    >>> import driftwalk as dw
    >>> len(dw.conditions.one_body_each([dw.tank30_recording()], dw.Study()))
    1
    """
    if not study.fit.interaction:
        return list(recordings)
    parts = [
        one if one.sizes["body"] == 1 else _body_of(one, number)
        for one in recordings
        for number in range(one.sizes["body"])
    ]
    if not 2 <= len(parts) <= MOST_BODIES:
        raise InputError(
            f"{prefix_of(recordings[0])}the forces of 2 to {MOST_BODIES} bodies can be compared, "
            f"and the recording has {len(parts)}: leave out `fit.interaction`, and name one with "
            "`body`"
        )
    if len(study.block.body().cells) > 1:
        raise InputError(
            f"`fit.interaction` is for free single bodies, and {study.block.shape} is glued"
        )
    return parts


def _body_of(recording: xr.Dataset, number: int) -> xr.Dataset:
    name = f"{recording.attrs.get('source', '')} ({recording['body'].values[number]})"
    return recording.isel(body=[number]).assign_attrs(source=name.strip())


def _with_others(
    trajectory: xr.Dataset, path: Path, study: Study, given: Mapping[str, Any]
) -> xr.Dataset:
    """Return a recording with the bodies that were not named, placed in the arena of the named one.

    They may be in other tanks, so they have no part in where the arena is.
    """
    arguments = {**study.load_options(), **given}
    if arguments.get("body") in (None, "all"):
        return trajectory
    every = load(path, **{**arguments, "body": None, "tank": None, "block": None})
    placed, unplaced = (
        parse_json(one.attrs.get("origin_shift_m", "[0.0, 0.0]")) for one in (trajectory, every)
    )
    moved = {
        axis: every[axis] - (here - there)
        for axis, here, there in zip("xy", placed, unplaced, strict=True)
    }
    return every.assign(moved).assign_attrs(trajectory.attrs)


def load_for_run(
    path: Path, study: Study, given: Mapping[str, Any], *, tank: Tank
) -> tuple[xr.Dataset, bool]:
    """Load a recording; without a stated tank, the arena of the file is used.

    Parameters
    ----------
    path, study, given
        As in `load_with_study`.
    tank : {"stated", "unsaid"}
        Whether anybody says the tank.

    Returns
    -------
    xarray.Dataset
        A `trajectory`.
    bool
        Whether its tank is the arena that the file holds.

    Examples
    --------
    >>> from importlib.resources import files
    >>> import driftwalk as dw
    >>> path = Path(str(files("driftwalk.datasets") / "tank30_ode_a" / "recording.csv"))
    >>> dw.conditions.load_for_run(path, dw.Study(), {}, tank="unsaid")[1]
    False
    """
    if tank == "unsaid" and path.suffix.lower() == ".nc":
        own = load_with_study(path, apply_overrides(study, {"recording.arena": "file"}), given)
        if "arena" in own.attrs:
            return own, True
    return load_with_study(path, study, given), False


def load_with_study(path: Path, study: Study, given: Mapping[str, Any] | None = None) -> xr.Dataset:
    """Load a recording as the study's [recording] and [tank] say, arguments first.

    Parameters
    ----------
    path : Path
        The recording.
    study : Study
        Its [recording] stands in for each argument that is not given, its [tank] for the tank.
    given : mapping, optional
        Arguments of `driftwalk.load`.

    Returns
    -------
    xarray.Dataset
        A `trajectory`, with the tank as its arena when the study's tank is a polygon.

    Raises
    ------
    InputError
        As `driftwalk.load`; when no row holds a position.

    Examples
    --------
    >>> from importlib.resources import files
    >>> import driftwalk as dw
    >>> path = Path(str(files("driftwalk.datasets") / "tank30_ode_a" / "recording.csv"))
    >>> dw.conditions.load_with_study(path, dw.Study()).sizes["time"]
    18001
    """
    values = {**study.load_options(), **(given or {})}
    values["block"] = study.block.side_m if values.get("tank") == "fit" else None
    trajectory = load(path, **values)
    require_positions(trajectory, where=path)
    if values["block"] is not None and not is_stated(study, "block.side_m"):
        # The circle was widened by the default side, which the recording does not say.
        trajectory.attrs.pop("block_side_m", None)
    if study.tank.shape == "polygon" and "tank" not in values and study.recording.arena == "tank":
        return trajectory.assign_attrs(arena=study.tank.to_arena_json())
    return trajectory
