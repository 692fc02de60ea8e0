"""`driftwalk convert`: any readable recording to driftwalk's NetCDF or plain CSV."""

from __future__ import annotations

import json as json_module
from pathlib import Path
from typing import Annotated

import typer

from driftwalk.cli.options.recording import RecordingFile, RecordingOptions, with_recording_options
from driftwalk.cli.options.shared import Json
from driftwalk.cli.options.study import Side, TankDiameter
from driftwalk.cli.terminal.output import print_json, print_next, print_note, sibling


@with_recording_options
def convert(
    recording: RecordingFile,
    out: Annotated[Path, typer.Argument(metavar="OUT", help="File to write; ends in .nc or .csv.")],
    how: RecordingOptions,
    tank_diameter: TankDiameter = None,
    side: Side = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace a file that exists.")
    ] = False,
    json: Json = False,
) -> None:
    """Turn a recording into driftwalk's NetCDF (.nc) or plain CSV (.csv).

    Positions are in metres with y up, times in seconds, angles in radians. NetCDF also keeps the
    arena and all other information; CSV has the columns t_s, x_m, y_m, theta_rad and body.
    """
    from driftwalk.cli.inputs.study_recording import words_to_fit
    from driftwalk.record import save_trajectory

    trajectory = how.load(recording, tank_diameter=tank_diameter, side=side)
    save_trajectory(trajectory, out, existing="replace" if overwrite else "error")
    counts = json_module.loads(trajectory.attrs["counts"])
    warnings = counts.pop("warnings")
    if json:
        print_json(
            {
                "out": out,
                "format": trajectory.attrs["format"],
                "y_axis": trajectory.attrs["y_axis"],
                "bodies": trajectory["body"].values,
                "samples": counts["samples"],
                "counts": counts,
                "warnings": warnings,
            }
        )
        return
    for warning in warnings:
        print_note(f"warning: {warning}")
    bodies = trajectory.sizes["body"]
    print_note(
        f"wrote {out}: {counts['samples']} samples of {bodies} bod{'y' if bodies == 1 else 'ies'}; "
        f"format {trajectory.attrs['format']}; y {trajectory.attrs['y_axis']}"
    )
    words = words_to_fit(trajectory)
    print_next("fit", out, *words, "-o", sibling(out.with_suffix(""), "fit"))
