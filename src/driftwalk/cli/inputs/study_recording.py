"""How a recording is read when a study file says so and options go over it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from driftwalk.cli.options.recording import RecordingOptions
from driftwalk.cli.terminal.output import print_note

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


def load_with_study(path: Path, study: Study, how: RecordingOptions) -> xr.Dataset:
    """Load a recording as the study's [recording] and [tank] say, options first.

    Parameters
    ----------
    path : Path
        The recording.
    study : Study
        Its [recording] stands in for each option that is not given, its [tank] for the arena.
    how : RecordingOptions
        The options of the command line.

    Returns
    -------
    xarray.Dataset
        A `trajectory`, with the tank as its arena when the study's tank is a polygon.

    Examples
    --------
    >>> from importlib.resources import files
    >>> from driftwalk.model import Study
    >>> recording = files("driftwalk.datasets") / "tank30_ode_a" / "recording.csv"
    >>> load_with_study(Path(str(recording)), Study(), RecordingOptions()).sizes["time"]
    18001
    """
    trajectory = completed(how, study).load(path, side=study.block.side_m)
    if study.tank.shape == "polygon" and study.recording.arena == "tank" and how.arena is None:
        trajectory = trajectory.assign_attrs(arena=study.tank.to_arena_json())
    return trajectory


class RunRecording(NamedTuple):
    """A recording for a run, and whether anything but the default study says its tank."""

    trajectory: xr.Dataset
    has_tank: bool


def load_for_run(
    path: Path, study: Study, how: RecordingOptions, *, tank: Literal["stated", "unsaid"]
) -> RunRecording:
    """Load a recording; where nobody said the tank, an arena that the file itself holds is used.

    Parameters
    ----------
    path, study, how
        As in `load_with_study`.
    tank : {"stated", "unsaid"}
        Whether a study file or an option says the tank.
    """
    from driftwalk.model import apply_overrides

    if tank == "unsaid" and path.suffix.lower() == ".nc":
        own = load_with_study(path, apply_overrides(study, {"recording.arena": "file"}), how)
        if "arena" in own.attrs:
            return RunRecording(own, has_tank=True)
    return RunRecording(load_with_study(path, study, how), has_tank=tank == "stated")


def default_tank_note(study: Study) -> Callable[[], None]:
    """Return what says, when a run begins, that nobody stated its tank."""
    text = f"the tank is the default study's, a {study.tank.describe()}"
    return lambda: print_note(text)


def completed(how: RecordingOptions, study: Study) -> RecordingOptions:
    """Return the options, with the study's values where none was given."""
    stated: dict[str, Any] = study.load_options()
    stated.pop("block", None)
    if "tank" in stated:
        stated["arena"] = stated.pop("tank")
    stated["sort"] = stated["sort"] == "sort"
    if "columns" in stated:
        stated["columns"] = [f"{name}={column}" for name, column in stated["columns"].items()]
    for name in ("x", "y", "theta"):
        if name in stated:
            stated[name] = Path(stated[name])
    missing = {name: value for name, value in stated.items() if not getattr(how, name)}
    return replace(how, **missing)
