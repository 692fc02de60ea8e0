"""`driftwalk study`: write and check study files, and try a design before the experiment."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

import typer

from driftwalk.cli.inputs.model_source import (
    SEARCHED,
    ModelSource,
    given_files,
    load_flow_for,
    open_source,
)
from driftwalk.cli.options.flatten_options import with_options
from driftwalk.cli.options.model import (
    KnownModel,
    ModelName,
    ParameterValues,
    partly_known_model,
)
from driftwalk.cli.options.recording import RecordingOptions
from driftwalk.cli.options.run import RunOptions
from driftwalk.cli.options.shared_types import (
    PANEL,
    BodyOfLike,
    Json,
    Replace,
    Run,
    argument,
    flag,
    optional,
)
from driftwalk.cli.options.study import StudyOptions, with_study_options
from driftwalk.cli.terminal.help import HelpCommand, HelpGroup
from driftwalk.cli.terminal.output import (
    print_json,
    print_next,
    print_note,
    print_warnings,
    require_place,
)
from driftwalk.core.errors import ConfigurationError
from driftwalk.core.study_keys import RECOVER_KEYS

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.calibration import ModelRecovery
    from driftwalk.likelihood import FitRecovery
    from driftwalk.model import Study
    from driftwalk.runs import FoundRun


ALL_PARAMETERS = "\n# All parameters, with their units and meanings: driftwalk study new --full\n"

study_app = typer.Typer(name="study", add_completion=False, cls=HelpGroup)


@study_app.callback(invoke_without_command=True)
def study(ctx: typer.Context) -> None:
    """Write and check study files: every parameter of a piece of work in one TOML file."""
    if ctx.invoked_subcommand is None:
        typer.echo(ctx.get_help())


@study_app.command(cls=HelpCommand)
def new(
    path: Annotated[Path | None, argument("[FILE]", "File to write (default: -, stdout).")] = None,
    full: bool = flag("--full", "List every parameter with its unit and meaning."),
    overwrite: Replace = False,
) -> None:
    """Print a study file with what differs from tank to tank, or with --full every parameter."""
    from driftwalk.core.files.atomic import write_atomic
    from driftwalk.model import short_study_template, study_template

    text = study_template() if full else f"{short_study_template()}{ALL_PARAMETERS}"
    if path is None or str(path) == "-":
        typer.echo(text, nl=False)
        return
    require_place(path, existing="replace" if overwrite else "error")
    write_atomic(path, text.encode())
    print_note(f"wrote {path}")
    print_next("fit", "RECORDING", "--study", path, "-o", "fit")


@study_app.command(cls=HelpCommand)
def check(path: Annotated[Path, argument("FILE", "Study file.")], json: Json = False) -> None:
    """Read a study file and print all parameters that follow from it."""
    from driftwalk.model import load_study

    study = load_study(path)
    if json:
        resolved = {"time_step_s": study.time_step_s, "wetted_depth_m": study.wetted_depth_m}
        print_json({**study.to_dict(), "resolved": resolved})
    else:
        typer.echo(study.to_toml(), nl=False)
        print_next("fit", "RECORDING", "--study", path, "-o", "fit")


OF_THE_BLOCK: Final = ("recover.drag_coefficient_precision",)
OF_A_MODEL: Final = (
    "tank.diameter_m",
    "observation.position_noise_m",
    "steps.step_interval_s",
    "calibration.bootstrap",
)
"""Keys whose options are for one of the two only."""
RANDOM: Final = "random"
"""The flow of a study that is drawn for each recording."""
NOISE: Final = "position_noise"
"""Known by this name, the noise of the camera is not estimated."""
Noise = Literal["estimated", "known"]


# What --threads counts depends on the model here: it has a text of its own.
@study_app.command(cls=HelpCommand)
@with_options(RunOptions, "out", "cluster", "cluster_options", "overwrite", "json")
@with_study_options(
    RECOVER_KEYS,
    *("flow", "recordings", "duration", "precision", "seed"),
    *("tank_diameter", "position_noise", "step_interval", "bootstrap"),
)
def recover(
    given: StudyOptions,
    run: Run = None,
    model: ModelName = None,
    parameters: ParameterValues = None,
    known: list[str] | None = optional(
        "--known NAME",
        "Parameter of --model, or position_noise, that the calibrations know; repeat for others.",
    ),
    like: Path | None = optional(
        "--like RECORDING",
        "Recording that gives start, time stamps, gaps and camera, with --model.",
    ),
    body: BodyOfLike = None,
    sample_rate: Any = optional(
        "--sample-rate", "Samples per second, with --model (default: 10).", unit="Hz", panel=PANEL
    ),
    threads: int | None = optional(
        "--threads N",
        "Recordings to fit at the same time; threads of a calibration with --model "
        "(default: one per core).",
        min=1,
    ),
    *,
    options: RunOptions,
) -> None:
    """Simulate recordings of known truth, fit them, and report how well the fit recovers the truth.

    Use it to design an experiment: how precise are the estimates with this length, this camera and
    this flow? The truth is the answer of a RUN, or a study file (--study) with the true values and
    its section [recover]. For another motion model (--model, or a RUN about one), simulates
    recordings of that model and calibrates each, with all parameters unknown except those that you
    state (--known). The directory holds the result, figures and manifest.json. If you stop the run,
    the same command continues it.
    """
    from driftwalk.runs import RecoveryWork

    source = open_source(run, given, model)
    method: FitRecovery | ModelRecovery
    if not source.is_block:
        given.refuse(OF_THE_BLOCK, "about the block, which --model replaces; leave it out")
        # The noise is no parameter of a model, but the recovery may be told it all the same.
        of_model = [name for name in known or () if name != NOISE]
        chosen = partly_known_model(model, parameters, run, of_model)
        noise: Noise = "known" if NOISE in (known or ()) else "estimated"
        method, inputs = _of_model(chosen, source, sample_rate, like, body, noise)
        print_warnings(chosen.warnings)
    else:
        given.refuse(OF_A_MODEL, "belongs to a --model; for the block it stands in --study FILE")
        beside = {
            "--parameter": parameters, "--known": known,
            "--like": like, "--body": body, "--sample-rate": sample_rate,
        }  # fmt: skip
        for name, value in beside.items():
            if value:
                raise ConfigurationError(f"{name} belongs to a --model; the block has --study FILE")
        method, inputs = _of_block(source)
    options.answer(RecoveryWork(method, inputs, threads), "recover")


def _of_model(
    chosen: KnownModel,
    source: ModelSource,
    sample_rate: float | None,
    like: Path | None,
    body: str | None,
    noise: Noise,
) -> tuple[ModelRecovery, dict[str, Path]]:
    """Return a motion model of known truth, and the files that were read."""
    from driftwalk.calibration import ModelRecovery
    from driftwalk.conditions import study_for

    given, recording = source.given, None
    if like is not None:
        recording = RecordingOptions(body=body).load(like)
        given.refuse(["recover.durations_s"], "given by the recording of --like")
        if sample_rate is not None:
            raise ConfigurationError("--sample-rate: given by the recording of --like")
    elif body is not None:
        raise ConfigurationError("--body belongs to --like")
    if sample_rate is not None:
        if not sample_rate > 0.0:
            raise ConfigurationError(f"--sample-rate {sample_rate:g}: give a rate above 0")
        clock = {"recover.sample_interval_s": 1.0 / sample_rate}
        keys = {"sample_rate": "recover.sample_interval_s"}
        source = replace(source, given=given.and_also(clock, keys=keys))
    study = source.study()
    if recording is not None:
        study = study_for([recording], study, body=body)
    flow_file: Path | None = None
    found = source.found
    if found is not None and given.file is None and RECOVER_KEYS["flow"] not in given.overrides:
        # A run may be someone else's: it brings its own flow, and names no file of this machine.
        field = source.flow_for(chosen.model, study, None)
    elif study.recover.flow == RANDOM:
        raise ConfigurationError(
            'the flow "random" is for the block: name the file of a flow field (--flow), or leave '
            "it out"
        )
    else:
        field, flow_file = _named_flow(study, given)
    parameters = None if found is None else found.file
    inputs = given_files(truth=given.file, parameters=parameters, like=like, flow=flow_file)
    method = ModelRecovery(study, chosen.model, chosen.values, field, recording, body, noise)
    return method, inputs


def _of_block(source: ModelSource) -> tuple[FitRecovery, dict[str, Path]]:
    """Return a block of known truth, and the files that were read."""
    from driftwalk.conditions import is_stated
    from driftwalk.likelihood import FitRecovery

    given = source.given
    if source.found is not None:
        return _of_run(source.found, source)
    if given.file is None:
        raise ConfigurationError(
            "the truth is missing: give a finished run, a study file of the block (--study FILE), "
            "or a motion model with its values (--model NAME --parameter NAME=VALUE)"
        )
    study = given.study()
    for name in SEARCHED:
        # A default is no true value.
        if not is_stated(study, name):
            section, _, key = name.partition(".")
            raise ConfigurationError(
                f"{given.file}: the truth lacks [{section}] {key}: give the true value, a "
                "fitted one or a guess"
            )
    field, flow_file = _named_flow(study, given)
    return FitRecovery(study, field), given_files(truth=given.file, flow=flow_file)


def _of_run(found: FoundRun, source: ModelSource) -> tuple[FitRecovery, dict[str, Path]]:
    """Return the truth that a run has found, its study with its camera and options; its files."""
    from driftwalk.conditions import study_as_seen
    from driftwalk.likelihood import FitRecovery
    from driftwalk.schema import body_track

    given, own = source.given, found.block_study()
    recording = found.recording()
    if recording is not None:
        own = study_as_seen(own, recording, body_track(recording, found.body))
    study = given.over(own, base=f"the study of {source.folder}")
    if RECOVER_KEYS["flow"] not in given.overrides:
        mean, lacks = found.mean_flow(own)
        print_warnings([lacks])
        return FitRecovery(study, mean), found.inputs
    field, flow_file = _named_flow(study, given)
    return FitRecovery(study, field), found.inputs | given_files(flow=flow_file)


def _named_flow(study: Study, given: StudyOptions) -> tuple[xr.Dataset | None, Path | None]:
    """Return the flow field that the study names, and its file; None for random flows."""
    named = study.recover.flow
    if named is None or named == RANDOM:
        return None, None
    path = Path(named)
    if given.file is not None and RECOVER_KEYS["flow"] not in given.overrides:
        path = given.file.parent / named
    return load_flow_for(path, study), path
