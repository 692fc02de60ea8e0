"""`driftwalk simulate`: trajectories of a block in a stirred tank, or of a motion model."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import numpy as np

from driftwalk.cli.inputs.model_source import ModelSource, flow_of_block, open_source
from driftwalk.cli.inputs.recordings import opening_note
from driftwalk.cli.options.model import KnownModel, ModelName, ParameterValues, known_model
from driftwalk.cli.options.recording import RecordingOptions
from driftwalk.cli.options.shared_types import (
    BodyOfLike,
    Json,
    Replace,
    Run,
    flow_of_run,
    option,
    optional,
)
from driftwalk.cli.options.study import StudyOptions, with_study_options
from driftwalk.cli.terminal.output import (
    print_json,
    print_next,
    print_note,
    print_report_next,
    print_warnings,
    require_place,
)
from driftwalk.core.errors import InputError
from driftwalk.core.study_keys import STUDY_KEYS
from driftwalk.core.text_files import parse_json
from driftwalk.schema.kinds.flow import flow_series_words
from driftwalk.schema.parameters import is_block

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.conditions import About
    from driftwalk.model import Study

OF_THE_BLOCK: Final = (
    *("drag_coefficient", "force_std_N", "force_interval_s", "force_noise_intensity_N2_s"),
    "time_step_s",
)
"""Attributes that a simulation of the block has."""


@with_study_options(
    STUDY_KEYS,
    *("tank_diameter", "body_shape", "side", "mass", "depth"),
    *("drag_coefficient", "force_std", "force_interval"),
    *("wall_friction", "wall_restitution", "time_step", "duration", "sample_rate"),
    *("position_noise", "orientation_noise", "replicates", "seed", "flow_repeat", "flow_start"),
)
def simulate(
    out: Annotated[Path, option("--out -o FILE.nc", "File to write.")],
    given: StudyOptions,
    run: Run = None,
    flow: Path | None = optional(
        "--flow FILE",
        "Flow field: NetCDF, or CSV with x, y, u, v; or the run directory that holds it. "
        "For the block, and for a --model that uses it.",
        callback=flow_of_run,
    ),
    model: ModelName = None,
    parameters: ParameterValues = None,
    like: Path | None = optional(
        "--like RECORDING",
        "Recording that gives start, time stamps and gaps (driftwalk's NetCDF or plain CSV).",
    ),
    body: BodyOfLike = None,
    backend: str = optional(
        "--backend cpu|reference",
        "Backend: cpu for single, reference for double precision.",
        default="cpu",
    ),
    overwrite: Replace = False,
    json: Json = False,
) -> None:
    """Simulate the motion of the block, or of another motion model.

    With a RUN, simulates the run's model with its values, study and flow field. Without a RUN,
    simulates the block, or a body that moves by itself, or a model of your own (--model); such a
    model needs a value for every parameter (--parameter). The motion starts where a recording
    starts (--like), otherwise at rest anywhere in the tank.
    """
    from driftwalk.core.files.atomic import write_atomic
    from driftwalk.motion import feels_others
    from driftwalk.schema.stores.netcdf import netcdf_bytes

    if backend not in ("cpu", "reference"):
        raise InputError(f"--backend takes cpu or reference, got '{backend}'")
    if like is not None and backend == "reference":
        raise InputError("--like runs on the cpu backend only: leave out --backend")
    # Before the simulation: minutes of work must not end at a file that stands in the way.
    require_place(out, existing="replace" if overwrite else "error")
    others = feels_others(model)
    kept = None if others else body
    recording = None if like is None else RecordingOptions(body=kept).load(like)
    source = open_source(run, given, model)
    if not source.is_block:
        if backend != "cpu":
            raise InputError("--backend is for the block: leave it out with another model")
        known = known_model(model, parameters, run)
        result = _of_model(known, source, flow, recording, body)
    elif parameters:
        raise InputError("--parameter belongs to a --model")
    else:
        result = _of_block(source, flow, recording, body, backend=backend)
    write_atomic(out, netcdf_bytes(result))
    facts = summary(result)
    if json:
        print_json({"file": str(out), **facts})
        return
    print_note(
        f"wrote {out}: {facts['replicates']} x {facts['samples']} samples over "
        f"{facts['duration_s']:g} s; {_in_words(facts)}"
    )
    for name, count in facts["status"].items():
        if count:
            print_note(f"warning: {count} of {facts['replicates']} replicates: {name}")
    print_warnings(facts["warnings"])
    if like is None:
        print_report_next(out)
    else:
        print_next("compare", like, out)


def _of_block(
    source: ModelSource,
    flow: Path | None,
    recording: xr.Dataset | None,
    body: str | None,
    *,
    backend: str,
) -> xr.Dataset:
    from driftwalk.conditions import simulate_like, study_for
    from driftwalk.flow import load_flow
    from driftwalk.simulation import simulate as run

    chosen, found = source.study(), source.found
    if found is not None:
        field = flow_of_block(found, chosen, flow)
    elif flow is None:
        raise InputError(
            "the flow of the water is missing: give a flow field (--flow), or the run directory of "
            "a fit or a calibration"
        )
    else:
        field = load_flow(flow)
    if recording is None:
        result = run(chosen, field, backend="reference" if backend == "reference" else "cpu")
    else:
        chosen = study_for([recording], chosen, body=body)
        result = simulate_like(chosen, field, recording)
    # What was refused needs no such words.
    print_warnings([] if found is None else found.warnings)
    _say_what(chosen, source, about="simulation")
    return result


def _say_what(study: Study, source: ModelSource, *, about: About) -> None:
    """Say which body and tank are simulated, and warn of those that were not stated."""
    from driftwalk.conditions import unstated_warning

    otherwise = "recording" if source.folder is None else str(source.folder)
    opening_note(study, source.given, about=about, otherwise=otherwise)()
    print_warnings([unstated_warning(study, about=about)])


def _of_model(
    known: KnownModel,
    source: ModelSource,
    flow: Path | None,
    recording: xr.Dataset | None,
    body: str | None,
) -> xr.Dataset:
    from driftwalk.conditions import study_for
    from driftwalk.motion import simulate_motion

    of_block = ("block.", "forces.", "simulation.time_step_s")
    about_it = [key for key in source.given.overrides if key.startswith(of_block)]
    source.given.refuse(about_it, "about the block, which --model replaces; leave it out")
    chosen = source.study()
    if recording is not None:
        chosen = study_for([recording], chosen, body=body)
    field = source.flow_for(known.model, chosen, flow)
    result = simulate_motion(
        known.model, known.values, chosen, flow=field, like=recording, body=body
    )
    _say_what(chosen, source, about="tank")
    print_warnings(known.warnings)
    return result


def _in_words(facts: dict[str, Any]) -> str:
    if "model" in facts:
        values = ", ".join(f"{name} {value:g}" for name, value in facts["parameters"].items())
        return f"{facts['model']} with {values}"
    return (
        f"σ_F = {1e3 * facts['force_std_N']:g} mN redrawn every "
        f"{1e3 * facts['force_interval_s']:g} ms"
    )


def summary(result: xr.Dataset) -> dict[str, Any]:
    """Return what a simulation is in a few numbers, units in the keys."""
    status = result["status"]
    masks = status.attrs["flag_masks"]
    names = status.attrs["flag_meanings"].split()
    path = np.hypot(*(np.diff(result[name].values, axis=1) for name in ("x", "y")))
    elapsed = float(result["time"].values[-1] - result["time"].values[0])
    of_model: dict[str, Any]
    if is_block(result):
        of_model = {name: result.attrs[name] for name in OF_THE_BLOCK}
    else:
        values = parse_json(result.attrs["model_parameters"])
        of_model = {"model": result.attrs["model"], "parameters": values}
    return {
        "replicates": int(result.sizes["replicate"]),
        "samples": int(result.sizes["time"]),
        "duration_s": elapsed,
        **of_model,
        "seed": result.attrs["seed"],
        "mean_speed_m_s": float(np.nansum(path) / (elapsed * path.shape[0])) if elapsed else 0.0,
        "status": {
            name: int(((status.values & mask) != 0).sum())
            for name, mask in zip(names, masks, strict=True)
        },
        "warnings": flow_series_words(result.attrs, holds="what the paths have in common holds"),
    }
