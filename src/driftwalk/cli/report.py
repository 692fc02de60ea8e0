"""`driftwalk report`: a run or a recording as one HTML file to open, click and show."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

from driftwalk.cli.inputs.recordings import load_simulation
from driftwalk.cli.options.recording import RecordingOptions, with_recording_options
from driftwalk.cli.options.shared_types import Replace, argument, optional
from driftwalk.cli.terminal.output import print_note, print_warnings, require_place


@with_recording_options
def report(
    runs: Annotated[
        list[Path],
        argument("RUN...", "Run directories, finished or not, recordings, or simulations."),
    ],
    how: RecordingOptions,
    out: Path = optional("--out -o FILE", "HTML file to write.", default=Path("report.html")),
    overwrite: Replace = False,
) -> None:
    """Write a report of runs or recordings: one HTML file that loads nothing from anywhere.

    Takes run directories of calibrate, compare-models, fit, assemble, sensitivity or study recover;
    several runs share one page, which shows a common recording or flow once. The report has the
    answer in words with its uncertainty, recording, flow, maps to click, outcomes to replay, the
    manifest and how to cite. It opens with a double click, without a network. For a simulation it
    shows one replicate. The options for reading apply to recordings only.
    """
    from driftwalk.page import joined_page, name_apart, write_report

    existing: Literal["error", "replace"] = "replace" if overwrite else "error"
    require_place(out, existing=existing)
    pages = [_page(run, how) for run in runs]
    page = pages[0]
    if len(pages) > 1:
        name_apart(pages)
        page = joined_page(pages, title="Report")
    write_report(page, out, existing=existing)
    if page["state"]["words"] is not None:
        print_note(page["state"]["words"])
    megabytes = out.stat().st_size / 1e6
    print(f"report  {out}, {megabytes:.2g} MB")
    print(f"next: open {out} in a browser", file=sys.stderr)


def _page(path: Path, how: RecordingOptions) -> dict[str, Any]:
    """Return the page data of a run directory, or of a recording."""
    from driftwalk.page import recording_page, report_page
    from driftwalk.record import describe

    if not path.is_file():
        if path.is_dir():
            how.refuse_given(f"{path} is a directory, read as a run")
        return report_page(path, tell=lambda text: print_warnings([text]))
    trajectory = load_simulation(path, replicate=how.replicate or 0)
    if trajectory is None:
        trajectory = how.load(path)
    else:
        others = replace(how, replicate=None)
        others.refuse_given(f"{path} is a simulation")
    return recording_page(trajectory, describe(trajectory))
