"""`driftwalk report`: a run or a recording as one HTML file to open, click and show."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import Annotated, Any

import typer

from driftwalk.cli.inputs.motion import load_simulation
from driftwalk.cli.options.recording import RecordingOptions, with_recording_options
from driftwalk.cli.options.study import TankDiameter
from driftwalk.cli.terminal.answer import print_warnings
from driftwalk.cli.terminal.output import print_note, require_place
from driftwalk.core.errors import InputError


@with_recording_options
def report(
    run: Annotated[
        Path,
        typer.Argument(
            metavar="RUN", help="Run directory, finished or not, a recording, or a simulation."
        ),
    ],
    how: RecordingOptions,
    out: Annotated[
        Path, typer.Option("--out", "-o", metavar="FILE", help="HTML file to write.")
    ] = Path("report.html"),
    tank_diameter: TankDiameter = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace a file that exists.")
    ] = False,
) -> None:
    """Write a report of a run or a recording: one HTML file that loads nothing from anywhere.

    Takes a run directory of calibrate, compare-models, fit, assemble, sensitivity or study recover.
    The report has the answer in words with its uncertainty, recording, flow, maps to click,
    outcomes to replay, the manifest and how to cite. It opens with a double click, without a
    network. For a simulation it shows one replicate. The options on reading are for a
    recording.
    """
    from driftwalk.page import write_report

    existing = "replace" if overwrite else "error"
    require_place(out, existing=existing)
    page = _page(run, how, tank_diameter)
    write_report(page, out, existing="replace" if overwrite else "error")
    if page["state"]["words"] is not None:
        print_note(page["state"]["words"])
    megabytes = out.stat().st_size / 1e6
    print(f"report  {out}, {megabytes:.2g} MB")


def _page(path: Path, how: RecordingOptions, tank_diameter: float | None) -> dict[str, Any]:
    """Return the page data of a run directory, or of a recording."""
    from driftwalk.page import recording_page, report_page
    from driftwalk.record import describe

    if not path.is_file():
        if path.is_dir():
            _refuse_reading_options(f"{path} is a directory, read as a run", how, tank_diameter)
        return report_page(path, tell=lambda text: print_warnings([text]))
    trajectory = load_simulation(path, replicate=how.replicate or 0)
    if trajectory is None:
        trajectory = how.load(path, tank_diameter=tank_diameter)
    else:
        others = replace(how, replicate=None)
        _refuse_reading_options(f"{path} is a simulation", others, tank_diameter)
    return recording_page(trajectory, describe(trajectory))


def _refuse_reading_options(what: str, how: RecordingOptions, tank_diameter: float | None) -> None:
    """Refuse options that have no meaning for a run directory or a simulation."""
    given = [field.name for field in fields(how) if getattr(how, field.name) not in (None, False)]
    given += [] if tank_diameter is None else ["tank_diameter"]
    words = {"start": "from", "stop": "to"}
    if given:
        names = ", ".join(f"--{words.get(name, name).replace('_', '-')}" for name in given)
        raise InputError(f"{names}: for a recording; {what}")
