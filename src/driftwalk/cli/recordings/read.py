"""`driftwalk read`: a tracker's file as a recording that states scale, axes, tank and block."""

from __future__ import annotations

import json as json_module
from pathlib import Path
from typing import Annotated

from driftwalk.cli.options.recording import RecordingFile, RecordingOptions, with_recording_options
from driftwalk.cli.options.shared_types import Json, Replace, option
from driftwalk.cli.options.study import StudyOptions, with_study_options
from driftwalk.cli.terminal.output import (
    print_json,
    print_next,
    print_note,
    print_warnings,
    sibling,
)
from driftwalk.core.study_keys import STUDY_KEYS


@with_recording_options
@with_study_options(STUDY_KEYS, "body_shape", "side", "mass", "depth", file="none")
def read(
    recording: RecordingFile,
    out: Annotated[Path, option("--out -o FILE", "File to write; ends in .nc or .csv.")],
    how: RecordingOptions,
    given: StudyOptions,
    overwrite: Replace = False,
    json: Json = False,
) -> None:
    """Read a tracker's file into a recording (.nc), once for all other commands.

    The recording has positions in metres with y up, times in seconds and angles in radians. It
    keeps the tank and the block that you state here, so the other commands need no options for
    them. If the name ends in .csv, the file is a plain table with the columns t_s, x_m, y_m,
    theta_rad and body, without tank and block.
    """
    from driftwalk.cli.inputs.recordings import words_to_fit
    from driftwalk.conditions import block_attributes
    from driftwalk.record import save_trajectory

    stated = block_attributes(given.study())
    trajectory = how.load(recording, side=stated.get("block_side_m"))
    if stated.keys() & {"block_depth", "block_depth_m"}:
        # A depth is a word or a length: the one that is stated replaces the other.
        for name in ("block_depth", "block_depth_m"):
            trajectory.attrs.pop(name, None)
    trajectory.attrs.update(stated)
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
    print_warnings(warnings)
    bodies = trajectory.sizes["body"]
    print_note(
        f"wrote {out}: {counts['samples']} samples of {bodies} bod{'y' if bodies == 1 else 'ies'}; "
        f"format {trajectory.attrs['format']}; y {trajectory.attrs['y_axis']}"
    )
    words = words_to_fit(trajectory)
    if out.suffix.lower() == ".csv":
        words = [*words, *given.words("body_shape", "side", "mass", "depth")]
    print_next("fit", out, *words, "-o", sibling(out.with_suffix(""), "fit"))
