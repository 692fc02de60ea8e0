"""`driftwalk play`: the simulator behind sliders, in the browser."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import TYPE_CHECKING

from driftwalk.cli.inputs.model_source import ModelSource, flow_of_block, open_source
from driftwalk.cli.inputs.other_files import explained
from driftwalk.cli.options.model import KnownModel, ModelName, playable_model
from driftwalk.cli.options.shared_types import FlowFile, Replace, Run, optional
from driftwalk.cli.options.study import StudyOptions, with_study_options
from driftwalk.cli.terminal.output import print_note, print_warnings
from driftwalk.cli.view import Host, Open, Port, show
from driftwalk.core.errors import InputError
from driftwalk.core.study_keys import ASSEMBLY_KEYS

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.runs import FoundRun
    from driftwalk.viewer import Source

FLOW_SEED = 1
"""Seed of the random flow where none is given: the playground is the same each time."""
BLOCKS = 4
"""Blocks where the study states no number: as many as in a study file that says nothing."""


@with_study_options(
    ASSEMBLY_KEYS,
    *("body_shape", "side", "mass", "depth", "tank_diameter", "blocks", "faces", "seed"),
    "flow_repeat",
)
def play(
    given: StudyOptions,
    run: Run = None,
    flow: FlowFile = None,
    model: ModelName = None,
    parameters: list[str] | None = optional(
        "--parameter NAME=VALUE|LOW,HIGH",
        "Value to begin with, or range of the slider, of a parameter of --model; repeat for "
        "others.",
    ),
    recording: Path | None = optional("--recording FILE", "Recording to compare the steps with."),
    body: str | None = optional("--body", "Body of the recording."),
    live: int | None = optional(
        "--live PORT", "Port that publishes the tank as a tracker's stream; 0 for a free port."
    ),
    save: Path | None = optional(
        "--save FILE", "Write the playground as one HTML file that runs without a server, and end."
    ),
    overwrite: Replace = False,
    port: Port = 8765,
    host: Host = "127.0.0.1",
    open: Open = None,
) -> None:
    """Change the parameters of a simulated tank while it runs.

    With a RUN, uses the run's model, values, study, flow field and recording. Without one, study,
    flow and recording come from the bundled example. A tank without a flow field gets a random
    flow. With --model, shows bodies of that model, with a slider for each parameter. Ctrl-C ends
    the server. With --save, there is none: the file holds the tank, the native core as
    WebAssembly, the flow and the recording's steps, and loads nothing.
    """
    from driftwalk.viewer import PlaySource, hello_line, require_server, save_playground

    # Before anything is read: without its extra there is no server to show it.
    if save is None:
        require_server()
    elif live is not None:
        raise InputError("--live needs the server that --save does without: leave one out")
    source = open_source(run, given, model)
    if not source.is_block:
        if live is not None:
            raise InputError("--live publishes a tank of blocks: leave it out with another model")
        if save is not None:
            raise InputError("--save writes a tank of blocks: leave it out with another model")
        known = playable_model(model, parameters, run)
        shown = _of_model(known, source, flow, recording, body)
        show(shown, host=host, port=port, open=open)
        return
    if parameters:
        raise InputError("--parameter belongs to a --model")
    found, name, said = source.found, "", list[str]()
    bundled = not given.states_tank and flow is None and found is None
    if found is not None:
        chosen = source.study()
        field = flow_of_block(found, chosen, flow)
        beside, body = _of_run(found, recording, chosen, body)
        name, said = Path(found.name).name, found.warnings
        print_warnings(said)
    else:
        chosen = given.over(_bundled(), base="the bundled example") if bundled else given.study()
        field = _flow(flow, chosen, bundled=bundled)
        beside = _recording(recording, chosen, body, bundled=bundled)
    seed = chosen.assembly.seed
    tank = PlaySource(
        chosen, field, recording=beside, body=body, seed=seed, run=name, warnings=said
    )
    if save is not None:
        path = save_playground(tank, save, existing="replace" if overwrite else "error")
        print_note(f"the playground: {path}, {path.stat().st_size / 1e6:.1f} MB")
        return
    # The stream ends with the page, also where that ends by Ctrl-C.
    with contextlib.ExitStack() as open_things:
        if live is not None:
            from driftwalk.track import LiveServer

            server = open_things.enter_context(LiveServer(live, hello=hello_line(tank.tank)))
            tank.stream_to(server)
            print_note(f"the tank as a tracker's stream on {server.host}, port {server.port}")
        show(tank, host=host, port=port, open=open)


def _of_model(
    known: KnownModel,
    source: ModelSource,
    flow: Path | None,
    recording: Path | None,
    body: str | None,
) -> Source:
    """Return the playground of a motion model: in the recording's tank, where one is given."""
    from driftwalk.conditions import study_for
    from driftwalk.viewer import ModelPlaySource

    source.given.refuse(["assembly.blocks"], "the page of a --model has a slider for its bodies")
    chosen, found, beside = source.study(), source.found, None
    if found is not None:
        beside, body = _of_run(found, recording, chosen, body)
    elif recording is not None:
        beside = _recording(recording, chosen, body, bundled=not source.given.states_tank)
        chosen = study_for([] if beside is None else [beside], chosen, body=body)
    if found is None and (flow is not None or known.model.needs_flow):
        field: xr.Dataset | None = _flow(flow, chosen, bundled=False)
    else:
        field = source.flow_for(known.model, chosen, flow)
    print_warnings(known.warnings)
    seed = chosen.assembly.seed
    return ModelPlaySource(
        known.model, known.values, chosen, flow=field, recording=beside, body=body, seed=seed
    )


def _of_run(
    found: FoundRun, path: Path | None, study: Study, body: str | None
) -> tuple[xr.Dataset | None, str | None]:
    """Return the recording to compare with, a given one or that of the run, and its body."""
    if path is not None:
        return _recording(path, study, body, bundled=False), body
    return found.recording(), body or found.body


def _bundled() -> Study:
    """Return the study of the bundled recording: its parameters, and a few blocks."""
    from driftwalk.datasets import tank30_truth
    from driftwalk.model import Study, apply_overrides

    truth = tank30_truth()
    known = {
        "forces.drag_coefficient": truth["drag_coefficient"],
        "forces.force_std_N": truth["force_std_N"],
        "forces.force_interval_s": truth["force_interval_s"],
        "tank.wall_friction": truth["wall_friction"],
        "tank.wall_restitution": truth["wall_restitution"],
        "assembly.blocks": BLOCKS,
    }
    return apply_overrides(Study(), known)


def _flow(path: Path | None, study: Study, *, bundled: bool) -> xr.Dataset:
    """Return the flow of a file, of the bundled example, or a random one for the tank."""
    from driftwalk.datasets import tank30_flow
    from driftwalk.flow import load_flow, random_tank_flow

    arena = study.tank.to_arena()
    if path is not None:
        field = load_flow(path, arena=arena, own_flags="keep")
        for text in _series_words(field, study):
            print_note(text)
        return field
    if bundled:
        return tank30_flow()
    print_note("no flow field was given (--flow): the water moves in a random flow")
    return random_tank_flow(FLOW_SEED, arena=arena)


def _series_words(field: xr.Dataset, study: Study) -> list[str]:
    """Return how a flow that changes in time goes on after its last frame."""
    from driftwalk.schema.kinds.flow import flow_series_words

    stated = study.flow.repeat
    repeat = stated if stated != "none" else field.attrs.get("repeat", "none")
    if field.sizes.get("time", 1) < 2 or repeat == "none":
        return []
    span = float(field["time"][-1] - field["time"][0])
    return flow_series_words(
        {"flow_span_s": span, "flow_repeat": repeat, "flow_begins": "together"}
    )


def _recording(
    path: Path | None, study: Study, body: str | None, *, bundled: bool
) -> xr.Dataset | None:
    """Return the recording to compare with; none where none was given."""
    from driftwalk.conditions import load_for_run
    from driftwalk.datasets import tank30_recording

    if path is not None:
        given = {} if body is None else {"body": body}
        with explained():
            return load_for_run(path, study, given, tank="unsaid" if bundled else "stated")[0]
    return tank30_recording() if bundled else None
