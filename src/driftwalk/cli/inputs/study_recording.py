"""The recordings of a run: read as the study file says, with the options of the command over it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from driftwalk.cli.inputs.assembly_source import load_flow_for
from driftwalk.cli.inputs.other_files import explained
from driftwalk.cli.options.recording import RecordingOptions
from driftwalk.cli.options.study import StudyOptions, option_name
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
    read = read_for_run([recording], given, how, bodies=bodies)
    inputs = {"recording": recording, "flow": flow, "study": given.file}
    field = None if flow is None else load_flow_for(flow, read.study)
    return ReadForModel(
        read, field, {role: path for role, path in inputs.items() if path is not None}
    )


def opening_note(
    study: Study, given: StudyOptions, *, block: bool, otherwise: str = "recording"
) -> Callable[[], None]:
    """Return what says, when a run begins, which body and tank it takes, and who stated them.

    Parameters
    ----------
    study : Study
        As the run is made with it.
    given : StudyOptions
        The options and the study file.
    block : bool
        Whether the run is about the block.
    otherwise : str
        Who stated what neither an option nor the study file does.
    """
    from driftwalk.conditions.tank import OUTLINE
    from driftwalk.model import load_study

    file = None if given.file is None else load_study(given.file)

    def stated(text: str, section: str, *keys: str) -> str:
        options = [key for key in keys if f"{section}.{key}" in given.overrides]
        in_file = file is not None and not getattr(file, section).model_fields_set.isdisjoint(keys)
        if options:
            source = option_name(f"{section}.{options[0]}", keys=given.keys)
        elif in_file:
            source = str(given.file)
        else:
            is_set = not getattr(study, section).model_fields_set.isdisjoint(keys)
            source = otherwise if is_set else "default"
        return f"{text} ({source})"

    body, depth_m = study.block, study.block.wetted_depth_m(study.water.density_kg_m3)
    lines = []
    if block:
        lines += [
            stated(f"block of side {100 * body.side_m:.4g} cm", "block", "side_m"),
            stated(f"mass {1e3 * body.mass_kg:.4g} g", "block", "mass_kg"),
            stated(f"wetted depth {100 * depth_m:.4g} cm", "block", "depth", "depth_m"),
        ]
        interval = f"force redrawn every {1e3 * study.forces.force_interval_s:g} ms"
        lines.append(stated(interval, "forces", "force_interval_s"))
    lines.append(stated(f"tank: {study.tank.describe()}", "tank", *OUTLINE))
    return lambda: print_note("; ".join(lines))
