"""`driftwalk control`: choose the agitation while blocks assemble, so that a target is reached."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from driftwalk.cli.inputs.model_source import Source, assembly_source
from driftwalk.cli.inputs.varied import listed, read_varied
from driftwalk.cli.options.flatten_options import with_options
from driftwalk.cli.options.run import RunOptions
from driftwalk.cli.options.shared_types import PANEL, FlowFile, argument, option, optional
from driftwalk.cli.options.study import StudyOptions, with_study_options
from driftwalk.cli.terminal.help import HelpCommand, HelpGroup
from driftwalk.cli.terminal.output import print_result
from driftwalk.core.errors import InputError
from driftwalk.core.study_keys import ASSEMBLY_KEYS

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.assembly import ModeSource

UNITS = {"flow-scale": "1", "force-std": "N"}
"""Numbers of a mode that can be varied, with their units."""
NAMES = (
    *("blocks", "tank_diameter", "side", "mass", "depth"),
    *("drag_coefficient", "force_std", "force_interval"),
    *("latching", "faces", "hidden_face_drag", "chirality", "bond_rate", "seed"),
)

control_app = typer.Typer(name="control", add_completion=False, cls=HelpGroup)

Policy = Annotated[Path, argument("POLICY", "Run of driftwalk control plan, or its policy.nc.")]


@control_app.callback(invoke_without_command=True)
def control(ctx: typer.Context) -> None:
    """Choose the agitation while blocks assemble: plan a policy, test it, run it."""
    if ctx.invoked_subcommand is None:
        typer.echo(ctx.get_help())


@control_app.command(cls=HelpCommand)
@with_options(RunOptions, "out", "cluster", "cluster_options", "overwrite", "json")
@with_study_options(ASSEMBLY_KEYS, *NAMES)
def plan(
    given: StudyOptions,
    target: Annotated[str, option("--target CLASS", "Outcome class to be reached, such as T.")],
    by: Annotated[float, option("--by", "Deadline, such as 5min.", unit="s")],
    runs: Annotated[
        list[Path] | None,
        argument(
            "[RUN...]",
            "Fits or calibrations, one for each setting of the pumps, or a fit with switches.",
        ),
    ] = None,
    flow: FlowFile = None,
    every: float = optional("--every", "Time between two decisions.", unit="s", default=5.0),
    vary: list[str] | None = optional(
        "--vary NAME=VALUES",
        "Modes: flow-scale=0,0.5,1 or force-std=0.2mN,1.2mN, over every flow. Repeatable.",
    ),
    latency: float = optional(
        "--latency", "Time from an observation until the pumps have changed.", unit="s", default=0.0
    ),
    missed: float = optional(
        "--missed SHARE", "Share of the observations that give no class.", default=0.0
    ),
    dwell: float = optional(
        "--dwell", "Shortest time for which a mode is held.", unit="s", default=0.0
    ),
    rounds: int = optional("--rounds N", "Rounds of planning.", panel=PANEL, min=1, default=12),
    worlds: int = optional(
        "--worlds N", "Simulated worlds of a round.", panel=PANEL, min=20, default=1000
    ),
    *,
    options: RunOptions,
) -> None:
    """Plan which mode of agitation to choose when.

    A mode is a flow, a factor on it and a stochastic force: name a fit for each setting of the
    pumps, or one fit (or --flow) with --vary. If you stop the run, the same command continues it.
    """
    from driftwalk.assembly import Wanted, make_modes
    from driftwalk.runs import ControlPlanWork

    sources: list[Source] = [
        assembly_source(run, flow, given) for run in (runs if runs else [None])
    ]
    strengths = vary_strengths(vary or [])
    seed = sources[0].study.assembly.seed
    # One fit gives its modes no name of its own: the strengths tell them apart.
    names = [run.name if len(sources) > 1 else "" for run in runs or [Path()]]
    taken = [settings_of(one, name, flow) for one, name in zip(sources, names, strict=True)]
    modes = make_modes(
        [each for settings, _ in taken for each in settings],
        flow_scales=strengths.get("flow-scale", [1.0]),
        force_stds=strengths.get("force-std", []),
        seed=seed,
    )
    inputs = {
        f"mode {at} {role}": path
        for at, one in enumerate(sources, start=1)
        for role, path in one.inputs.items()
    }
    wanted = Wanted(target, by, every, latency, missed, dwell)
    work = ControlPlanWork(modes, wanted, rounds, worlds, seed, inputs)
    said = dict.fromkeys(text for _, warnings in taken for text in warnings)
    options.answer(work, "control plan", warnings=[*said])


@control_app.command("test", cls=HelpCommand)
@with_options(RunOptions, "out", "cluster", "cluster_options", "overwrite", "json")
def try_policy(
    policy: Policy,
    worlds: int = optional("--worlds N", "Fresh worlds of each arm.", min=20, default=2000),
    latency: float | None = optional(
        "--latency", "Latency of the worlds (default: the plan's).", unit="s"
    ),
    missed: float | None = optional(
        "--missed SHARE", "Looks without a class (default: the plan's)."
    ),
    force_factor: float = optional(
        "--force-factor NUMBER", "Factor on the worlds' sigma_F: a wrong model.", default=1.0
    ),
    *,
    options: RunOptions,
) -> None:
    """Test a policy in fresh simulated worlds.

    States its yield, and the gain over the best constant mode and over random switching in worlds
    with the same starts and forces.
    """
    from driftwalk.runs import ControlTestWork
    from driftwalk.schema.answers.control import gain_word
    from driftwalk.schema.answers.facts import source_warnings

    stored, path = _opened(policy)
    work = ControlTestWork(stored, worlds, latency, missed, force_factor, {"policy": path})
    found: xr.Dataset = options.run(work, "control test", warnings=source_warnings(stored))
    # What is not better than one mode all the time is not worth a run on the tank.
    live: list[str | Path] = ["control run", policy, "--live", "127.0.0.1:5000"]
    print_result(
        found, options.out, json=options.json,
        following=live if gain_word(found) == "better" else [],
    )  # fmt: skip


@control_app.command(cls=HelpCommand)
def run(
    policy: Policy,
    live: Annotated[
        str, option("--live HOST:PORT", "Where driftwalk track or play publishes (--live PORT).")
    ],
    patience: float = optional(
        "--patience", "Time without a frame before the safe mode.", unit="s", default=2.0
    ),
) -> None:
    """Follow a policy over a tracker's stream: one line of JSON for each decision, on stdout.

    Ends with the target, with another complete assembly, or at the deadline.
    """
    from driftwalk.viewer import pilot

    host, colon, port = live.rpartition(":")
    if not colon or not port.isdigit() or not 0 < int(port) < 65536:
        raise InputError(f"--live {live}: expected HOST:PORT, such as 127.0.0.1:5000")
    if not patience > 0.0:
        raise InputError(f"--patience has to be above 0 s, got {patience:g} s")
    for line in pilot(_opened(policy)[0], host, int(port), patience_s=patience):
        print(json.dumps(line), flush=True)


def settings_of(source: Source, name: str, flow: Path | None) -> tuple[list[ModeSource], list[str]]:
    """Return the setting of a run, or one for each flow of a fit with switches, and its warnings.

    A given `flow` is taken in place of those of the fit.
    """
    from driftwalk.assembly import ModeSource
    from driftwalk.flow import stretch_flow
    from driftwalk.likelihood import flow_settings
    from driftwalk.model import apply_overrides

    study, fit = source.study, source.uncertainty
    steady = "time" not in source.flow.dims
    if fit is None or flow is not None or "flow" not in fit.dims or steady:
        return [ModeSource(study, source.flow, fit, name)], source.warnings
    key = "forces.force_std_N"
    larger = study.tank.diameter_m if "stretched_by" in source.flow.attrs else None
    settings = [
        ModeSource(
            apply_overrides(study, {key: own.study.forces.force_std_N}),
            own.flow if larger is None else stretch_flow(own.flow, diameter=larger),
            own.uncertainty,
            f"{name} {label}".strip(),
        )
        for label, own in flow_settings(fit).items()
    ]
    return settings, [text for text in source.warnings if text != source.first_force]


def vary_strengths(given: list[str]) -> dict[str, list[float]]:
    """Return the values of what is varied.

    Examples
    --------
    >>> vary_strengths(["flow-scale=0:1:0.5", "force-std=0.2,1.2mN"])
    {'flow-scale': [0.0, 0.5, 1.0], 'force-std': [0.0002, 0.0012]}
    """
    return read_varied(
        given, {name: name for name in UNITS}, lambda name, words: listed(words, UNITS[name])
    )


def _opened(policy: Path) -> tuple[Any, Path]:
    """Return the policy of a run or a file, and its file."""
    from driftwalk.schema.check import check_contents, require_kind
    from driftwalk.schema.runs import run_kind
    from driftwalk.schema.stores.netcdf import open_netcdf

    kind = run_kind("control_policy")
    lacks = "holds no policy: plan one first (driftwalk control plan)"
    path = policy / kind.file if policy.is_dir() else policy
    if not path.is_file():
        raise InputError(f"{policy} {lacks}")
    found = require_kind(open_netcdf(path), kind.name, otherwise=f"{path} {lacks}")
    return check_contents(found, path), path
