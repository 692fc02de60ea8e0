"""`driftwalk study`: write and check study files, and try a design before the experiment."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from driftwalk.cli.main import paragraphs
from driftwalk.cli.options.shared import Json, Replace
from driftwalk.cli.study_recover import recover
from driftwalk.cli.terminal.help import HelpCommand, HelpGroup
from driftwalk.cli.terminal.output import print_json, print_next, print_note, require_place

ALL_PARAMETERS = "\n# All parameters, with their units and meanings: driftwalk study new --full\n"

study_app = typer.Typer(name="study", add_completion=False, cls=HelpGroup)


@study_app.callback(invoke_without_command=True)
def study(ctx: typer.Context) -> None:
    """Write and check study files: every parameter of a piece of work in one TOML file."""
    if ctx.invoked_subcommand is None:
        typer.echo(ctx.get_help())


@study_app.command(cls=HelpCommand)
def new(
    path: Annotated[
        Path | None, typer.Argument(metavar="[FILE]", help="File to write (default: -, stdout).")
    ] = None,
    full: Annotated[
        bool, typer.Option("--full", help="List every parameter with its unit and meaning.")
    ] = False,
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
def check(
    path: Annotated[Path, typer.Argument(metavar="FILE", help="Study file.")], json: Json = False
) -> None:
    """Read a study file and print all parameters that follow from it."""
    from driftwalk.model import load_study

    study = load_study(path)
    if json:
        resolved = {"time_step_s": study.time_step_s, "wetted_depth_m": study.wetted_depth_m}
        print_json({**study.to_dict(), "resolved": resolved})
    else:
        typer.echo(study.to_toml(), nl=False)
        print_next("fit", "RECORDING", "--study", path, "-o", "fit")


study_app.command("recover", cls=HelpCommand, help=paragraphs(recover.__doc__ or ""))(recover)
