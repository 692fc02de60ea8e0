"""`driftwalk export`: a model for another simulator, or motion for another program."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from driftwalk.cli.options.shared_types import Json, argument, flag, option, optional
from driftwalk.cli.terminal.argument_names import to_options
from driftwalk.cli.terminal.output import print_json, print_note, print_row
from driftwalk.cli.terminal.progress import ProgressReporter
from driftwalk.core.errors import InputError
from driftwalk.export import TARGETS, Source, export_run, target_named


def export(
    run: Annotated[
        Path,
        argument(
            "RUN",
            "Run directory, or a study file with --flow; for tables, bags and films also a "
            "recording or a simulation.",
        ),
    ],
    to: Annotated[
        str,
        option(
            f"--to {'|'.join(TARGETS)}",
            "; ".join(f"{target.name}: {target.gives}" for target in TARGETS.values()) + ".",
        ),
    ],
    out: Annotated[Path, option("--out -o DIR", "New or empty folder to write.")],
    flow: Path | None = optional(
        "--flow FILE", "Flow field for a study file, or in place of a run's own."
    ),
    seed: int | None = optional(
        "--seed N", "Seed of the stochastic force (default: the study's).", min=0
    ),
    replicate: int | None = optional(
        "--replicate N",
        "Replicate of a simulation to take, counted from 0 (default: all; of a film the first).",
        min=0,
    ),
    speed: float | None = optional(
        "--speed", "How much faster than real time a film is (default: 1)."
    ),
    verify: bool = flag("--verify", "Run what was written, and compare it with driftwalk."),
    json: Json = False,
) -> int:
    """Export a model for a simulator, motion for another program, or figures for print.

    For a simulator, the folder holds its files, the study, the flow field and the seed. With the
    same seed the simulator repeats driftwalk's run; --verify compares both on paths clear of the
    wall. csv, movement, trackpy, ros, mp4 and gif hold recorded or simulated motion; pdf, svg and
    png hold the figures of a finished run, with the numbers that they draw. A README says how to
    use them and what they do not hold. Nothing is overwritten.
    """
    target = target_named(to)
    # Before the files are written: what cannot be verified is refused, and nothing is left behind.
    if verify:
        if target.verify is None:
            raise InputError(f"--verify: an export to {to} is no simulation to compare with")
        if target.require is not None:
            target.require()
    said: list[str] = []
    with ProgressReporter("frames") as progress:
        source = Source(run, flow, seed, replicate, speed, said.append, progress)
        files = export_run(source, target, out)
    notes = [to_options(sentence) for sentence in said]
    outcome = target.verify(out) if verify and target.verify is not None else None
    if json:
        print_json(
            {
                "folder": str(out),
                "to": to,
                "files": [path.relative_to(out).as_posix() for path in files],
                "notes": notes,
                "verification": outcome and {"passed": outcome.passed, **outcome.numbers},
            }
        )
    else:
        for note in notes:
            print_note(f"note: {note}")
        print_row("folder", f"{out}: {target.gives}")
        print_row("begin with", out / "README.md")
        if outcome is not None:
            for line in outcome.lines:
                print_row("verified" if outcome.passed else "NOT VERIFIED", line)
        print(f"next: read {out / 'README.md'}", file=sys.stderr)
    return 0 if outcome is None or outcome.passed else 1
