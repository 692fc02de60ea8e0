"""`driftwalk flow`: how the water moved, from the track of the body that floats in it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from driftwalk.cli.inputs.other_files import explained
from driftwalk.cli.options.recording import RecordingFile, RecordingOptions, with_recording_options
from driftwalk.cli.options.shared import FlowVariables, FrameInterval, Json
from driftwalk.cli.options.study import StudyOptions, with_study_options
from driftwalk.cli.terminal.argument_names import to_options
from driftwalk.cli.terminal.output import print_json, print_note
from driftwalk.core.study_keys import FLOW_KEYS

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


@with_recording_options
@with_study_options(
    FLOW_KEYS,
    *("tank_diameter", "side", "mass", "depth"),
    *("cells", "cell_size", "window", "inertia", "flow_drag_coefficient", "min_count"),
)
def flow(
    recording: RecordingFile,
    out: Annotated[
        Path,
        typer.Option("--out", "-o", metavar="FILE", help="File to write; ends in .nc or .csv."),
    ],
    given: StudyOptions,
    how: RecordingOptions,
    frame_interval: FrameInterval = None,
    flow_variables: FlowVariables = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace a file that exists.")
    ] = False,
    json: Json = False,
) -> None:
    """Take the flow field from a recording, or from a file of PIV.

    Averages the velocity of the body in each cell and corrects it for the body's inertia. Cells
    that the body never visited are filled in and flagged. Mass and side come from the study; the
    default is the 11.6-g, 3-cm block of the paper. A field that was measured otherwise is brought
    to metres, with its masked nodes filled; --arena circle:D@X,Y says where its tank is.
    """
    from driftwalk.cli.inputs.flow_file import read_flow_file
    from driftwalk.conditions import load_with_study, require_motion
    from driftwalk.flow import save_flow

    existing = "replace" if overwrite else "error"
    diameter = given.overrides.get(FLOW_KEYS["tank_diameter"])
    measured = read_flow_file(
        recording,
        how,
        frame_interval=frame_interval,
        variables=flow_variables,
        tank_diameter=diameter,
    )
    if measured is not None:
        save_flow(measured, out, existing=existing)
        _report_file(measured, out, json=json)
        return
    resolved = given.study()
    if given.file is None:
        # Without a study nobody has said how large the tank is: the default one is no answer.
        trajectory = how.load(recording, tank_diameter=diameter, side=resolved.block.side_m)
    else:
        with explained():
            trajectory = load_with_study(recording, resolved, how.arguments())
    require_motion(trajectory, body=how.body, where=recording)
    field = _extract(trajectory, resolved, body=how.body)
    save_flow(field, out, existing=existing)
    _report(field, out, json=json)


def _extract(trajectory: xr.Dataset, study: Study, *, body: str | None) -> xr.Dataset:
    from driftwalk.flow import extract_flow

    return extract_flow(
        trajectory,
        body="all" if body == "all" else None,
        cells=study.flow.cells,
        cell_size=study.flow.cell_size_m,
        window=study.flow.smoothing_window_s,
        inertia=study.flow.inertia,
        mass=study.block.mass_kg,
        side=study.block.side_m,
        depth=study.wetted_depth_m,
        water_density=study.water.density_kg_m3,
        flow_drag_coefficient=study.flow.flow_drag_coefficient,
        min_count=study.flow.min_count,
    )


def _report_file(field: xr.Dataset, out: Path, *, json: bool) -> None:
    """Say what was written of a file, and what to know about it."""
    from driftwalk.cli.inputs.flow_file import describe_field

    facts = describe_field(field)
    if json:
        print_json({"out": out, **facts})
        return
    for warning in facts["warnings"]:
        print_note(f"warning: {to_options(warning)}")
    print_note(
        f"wrote {out}: {facts['columns']} x {facts['rows']} nodes from a file, "
        f"{100 * facts['measured_share']:.0f} % of them measured, the rest filled or outside"
    )


def _report(field: xr.Dataset, out: Path, *, json: bool) -> None:
    """Say what was written and what to know about it."""
    facts = field.attrs
    if json:
        shown = {key: value for key, value in facts.items() if key not in ("kind", "arena")}
        print_json({"out": out, "rows": field.sizes["y"], "columns": field.sizes["x"], **shown})
        return
    if "warning" in facts:
        print_note(f"warning: {facts['warning']}")
    if facts["inertia"] == "corrected":
        print_note(
            f"corrected for a body of {facts['mass_kg']:g} kg and {facts['area_m2']:g} m2 "
            f"with C_x = {facts['flow_drag_coefficient']:g}"
        )
    print_note(
        f"wrote {out}: {field.sizes['x']} x {field.sizes['y']} cells of "
        f"{1e3 * facts['cell_size_m']:g} mm from {facts['samples_used']} samples; "
        f"{100 * facts['measured_share']:.0f} % of the tank measured, the rest filled"
    )
