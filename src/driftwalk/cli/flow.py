"""`driftwalk flow`: how the water moved, from the tracks of what floats in it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

from driftwalk.cli.inputs.other_files import explained
from driftwalk.cli.options.recording import RecordingFile, RecordingOptions, with_recording_options
from driftwalk.cli.options.shared_types import (
    FlowVariables,
    FrameInterval,
    Json,
    Replace,
    flag,
    option,
)
from driftwalk.cli.options.study import StudyOptions, with_study_options
from driftwalk.cli.terminal.output import (
    print_json,
    print_next,
    print_note,
    print_warnings,
    sibling,
)
from driftwalk.core.errors import InputError
from driftwalk.core.study_keys import FLOW_KEYS

if TYPE_CHECKING:
    import xarray as xr

BODY: Final = ("body_shape", "side", "mass", "depth")
OF_A_BODY: Final = (*BODY, "window", "inertia", "flow_drag_coefficient")
"""Options that say something of a floating body, which no tracer is."""
NOISE: Final = FLOW_KEYS["position_noise"]


@with_recording_options
@with_study_options(
    FLOW_KEYS,
    *BODY,
    *("cells", "cell_size", "window", "inertia", "flow_drag_coefficient", "min_count"),
    "position_noise",
)
def flow(
    recording: RecordingFile,
    out: Annotated[Path, option("--out -o FILE", "File to write; ends in .nc or .csv.")],
    given: StudyOptions,
    how: RecordingOptions,
    frame_interval: FrameInterval = None,
    flow_variables: FlowVariables = None,
    tracers: bool = flag(
        "--tracers", "The bodies are passive tracers: their tracks make one flow (PTV)."
    ),
    overwrite: Replace = False,
    json: Json = False,
) -> None:
    """Extract the flow field from a recording, or read it from a PIV file.

    Averages the velocity of the body in each cell and corrects it for the body's inertia. Cells
    that the body never visited are filled in and flagged. Mass and side come from the study; the
    default is the 11.6-g, 3-cm block of the paper. With --tracers, averages the steps of many
    tracks and leaves out steps that join two particles. Converts a measured field to metres and
    fills its masked nodes; --tank D@X,Y gives the position of the tank.
    """
    from driftwalk.cli.inputs.flow_file import read_flow_file
    from driftwalk.conditions import (
        flow_by_study,
        is_stated,
        load_with_study,
        require_motion,
        study_for,
        study_of_block,
        unstated_warning,
    )
    from driftwalk.flow import flow_from_tracers, save_flow

    existing = "replace" if overwrite else "error"
    measured = read_flow_file(
        recording, how, frame_interval=frame_interval, variables=flow_variables
    )
    if measured is not None:
        if tracers:
            raise InputError(f"{recording} is a flow field already: --tracers is for tracks")
        save_flow(measured, out, existing=existing)
        _report_file(measured, out, json=json)
        return
    _check_given(given, tracers=tracers)
    resolved = given.study()
    if given.file is None:
        # Without a study the size of the tank is not stated: the default one is no answer.
        trajectory = how.load(recording, side=resolved.block.side_m)
        if how.tank == "fit" and not is_stated(resolved, "block.side_m"):
            # The circle was widened by the default side, which the recording does not say.
            del trajectory.attrs["block_side_m"]
    else:
        with explained():
            trajectory = load_with_study(recording, resolved, how.arguments())
    resolved = study_of_block(resolved, trajectory)
    if tracers:
        noise = given.overrides.get(NOISE)
        field = flow_from_tracers(
            trajectory,
            cells=resolved.flow.cells,
            cell_size=resolved.flow.cell_size_m,
            position_noise=None if isinstance(noise, str) else noise,
            min_count=resolved.flow.min_count,
        )
    else:
        _require_one_body(trajectory, recording, body=how.body)
        require_motion(trajectory, body=how.body, where=recording)
        field = flow_by_study(trajectory, resolved, body="all" if how.body == "all" else None)
    save_flow(field, out, existing=existing)
    _report(field, out, json=json)
    if json:
        return
    if tracers:
        print_next("simulate", "--flow", out, "-o", "motion.nc")
        return
    warning = unstated_warning(study_for([trajectory], resolved), about="block")
    print_warnings([warning])
    run = sibling(out.with_suffix(""), "run")
    words = [*how.words(), *given.words(*BODY)]
    print_next("calibrate", recording, *words, "--flow", out, "-o", run)


def _check_given(given: StudyOptions, *, tracers: bool) -> None:
    """Refuse the options that have no meaning for what is measured."""
    if not tracers:
        if NOISE in given.overrides:
            raise InputError("--position-noise is for --tracers: a body's track is smoothed")
        return
    unused = [
        f"--{name.replace('_', '-')}" for name in OF_A_BODY if FLOW_KEYS[name] in given.overrides
    ]
    if unused:
        raise InputError(
            f"tracers move as the water does: {', '.join(unused)} is for a floating body; leave "
            "it out"
        )


def _require_one_body(trajectory: xr.Dataset, path: Path, *, body: str | None) -> None:
    count = trajectory.sizes["body"]
    if body is None and count > 1:
        raise InputError(
            f"{path} has {count} bodies: --tracers makes one flow of them if they are passive "
            "tracers, --body NAME takes one, --body all pools them as floating bodies"
        )


def _report_file(field: xr.Dataset, out: Path, *, json: bool) -> None:
    """Say what was written of a file, and what to know about it."""
    from driftwalk.cli.inputs.flow_file import describe_field

    facts = describe_field(field)
    if json:
        print_json({"out": out, **facts})
        return
    if facts["reading"]:
        print_note(f"read as {facts['reading']}")
    print_warnings(facts["warnings"])
    print_note(
        f"wrote {out}: {facts['columns']} x {facts['rows']} nodes from a file, "
        f"{100 * facts['measured_share']:.0f} % of them measured, the rest filled or outside"
    )
    print_next("simulate", "--flow", out, "-o", "motion.nc")


def _report(field: xr.Dataset, out: Path, *, json: bool) -> None:
    """Say what was written and what to know about it."""
    facts = field.attrs
    if json:
        shown = {key: value for key, value in facts.items() if key not in ("kind", "arena")}
        print_json({"out": out, "rows": field.sizes["y"], "columns": field.sizes["x"], **shown})
        return
    if "warning" in facts:
        print_note(f"warning: {facts['warning']}")
    if facts.get("inertia") == "corrected":
        print_note(
            f"corrected for a body of {facts['mass_kg']:g} kg and {facts['area_m2']:g} m2 "
            f"with C_x = {facts['flow_drag_coefficient']:g}"
        )
    measured_from = f"{facts['samples_used']} samples"
    if "tracks_used" in facts:
        measured_from = f"{facts['samples_used']} steps of {facts['tracks_used']} tracks"
        _report_left_out(facts)
    place = "tank" if "arena" in facts else "box of the tracks"
    print_note(
        f"wrote {out}: {field.sizes['x']} x {field.sizes['y']} cells of "
        f"{1e3 * facts['cell_size_m']:g} mm from {measured_from}; "
        f"{100 * facts['measured_share']:.0f} % of the {place} measured, the rest filled"
    )


def _report_left_out(facts: Mapping[str, Any]) -> None:
    """Say which steps of tracers are not in the field."""
    reasons = {
        "samples_rejected": "join two particles",
        "samples_across_gaps": "cross a gap",
        "samples_ambiguous": "have an unsure identity",
        "samples_outside_tank": "lie beyond the wall",
    }
    parts = [f"{facts[key]} that {why}" for key, why in reasons.items() if facts[key]]
    if parts:
        print_note(f"left out steps: {', '.join(parts)}")
