"""The recordings of a run: read as the study file says, with the options of the command over it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from driftwalk.cli.inputs.other_files import explained
from driftwalk.cli.options.recording import RecordingOptions
from driftwalk.cli.options.study import StudyOptions
from driftwalk.cli.terminal.output import print_note

if TYPE_CHECKING:
    from driftwalk.conditions import ReadRecordings
    from driftwalk.model import Study


def read_for_run(
    paths: Sequence[Path], given: StudyOptions, how: RecordingOptions
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
        )


def tank_note(read: ReadRecordings) -> Callable[[], None] | None:
    """Return what says, when a run begins, that nobody stated its tank; None where one did."""
    if read.has_tank:
        return None
    study: Study = read.study
    return lambda: print_note(f"the tank is the default study's, a {study.tank.describe()}")
