"""The recordings of a run: read as the study file says, with the options of the command over it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from driftwalk.cli.inputs.assembly_source import load_flow_for
from driftwalk.cli.inputs.other_files import explained
from driftwalk.cli.options.recording import RecordingOptions
from driftwalk.cli.options.study import StudyOptions
from driftwalk.cli.terminal.output import print_note

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.conditions import ReadRecordings
    from driftwalk.conditions.reading import Bodies
    from driftwalk.model import Study


def read_for_run(
    paths: Sequence[Path],
    given: StudyOptions,
    how: RecordingOptions,
    *,
    bodies: Bodies = "named",
) -> ReadRecordings:
    """Read the recordings of a fit or a calibration, and make its study.

    Parameters
    ----------
    paths : sequence of Path
        The recordings.
    given : StudyOptions
        The study.
    how : RecordingOptions
        How to read them.
    bodies : {"named", "all"}
        Which bodies they keep where one is named.

    Raises
    ------
    InputError
        As `driftwalk.conditions.read_recordings`.
    """
    from driftwalk.conditions import read_recordings

    said = given.states_tank or how.arena is not None
    with explained():
        return read_recordings(
            paths,
            given.study(),
            how.arguments(),
            tank="stated" if said else "unsaid",
            body=how.body,
            bodies=bodies,
        )


class ReadForModel(NamedTuple):
    """A recording and a flow, for a run that simulates motion models."""

    read: ReadRecordings
    flow: xr.Dataset | None
    """The given flow field."""
    inputs: dict[str, Path]
    """The files that were read, by their role."""


def read_with_flow(
    recording: Path,
    flow: Path | None,
    given: StudyOptions,
    how: RecordingOptions,
    *,
    bodies: Bodies = "named",
) -> ReadForModel:
    """Read one recording, and the flow field where one is given.

    Parameters
    ----------
    recording : Path
        The recording.
    flow : Path or None
        The flow field.
    given : StudyOptions
        The study.
    how : RecordingOptions
        How to read the recording.
    bodies : {"named", "all"}
        As in `read_for_run`.

    Raises
    ------
    InputError
        As `read_for_run`, and when the flow field cannot be read.
    """
    from driftwalk.conditions import jump_warnings

    read = read_for_run([recording], given, how, bodies=bodies)
    for warning in jump_warnings(read.trajectories[0], read.body):
        print_note(f"warning: {warning}")  # before the work, which may take hours
    inputs = {"recording": recording, "flow": flow, "study": given.file}
    field = None if flow is None else load_flow_for(flow, read.study)
    return ReadForModel(
        read, field, {role: path for role, path in inputs.items() if path is not None}
    )


def tank_note(read: ReadRecordings) -> Callable[[], None] | None:
    """Return what says, when a run begins, that nobody stated its tank; None where one did."""
    if read.has_tank:
        return None
    study: Study = read.study
    return lambda: print_note(f"the tank is the default study's, a {study.tank.describe()}")
