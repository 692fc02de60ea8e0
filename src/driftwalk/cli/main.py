"""The entry point `driftwalk` and the table of its commands.

A command's module is imported when the command is used, so that ``driftwalk --help`` and a typing
mistake answer at once.
"""

from __future__ import annotations

import importlib
import io
import logging
import os
import sys
from collections.abc import Sequence
from typing import Annotated, Any, Final, NamedTuple

import typer
from typer.main import get_command as to_click_command

from driftwalk.cli.terminal.errors import PastTyper, exit_code_of
from driftwalk.cli.terminal.help import HelpCommand, HelpGroup
from driftwalk.core.extras import hide_dask


class Command(NamedTuple):
    """One command: its heading and line in the list of commands, and its module.

    The module names the function as the command, or the application of several `NAME_app`.
    """

    heading: str
    help: str
    module: str


_GET, _FIT, _PREDICT = "Get a recording", "Fit", "Predict"
_COMPARE, _SHARE, _SET_UP = "Compare", "Share", "Set up"
COMMANDS: Final[dict[str, Command]] = {
    "demo": Command(_GET, "Try driftwalk on its bundled recording.", "demo"),
    "read": Command(_GET, "Read a tracker's file into a recording.", "recordings.read"),
    "info": Command(_GET, "Show what a file holds.", "recordings.info"),
    "track": Command(_GET, "Track blocks in a video.", "recordings.track"),
    "watch": Command(_GET, "Watch blocks assemble, live.", "recordings.watch"),
    "fit": Command(_FIT, "Fit flow, drag, force and noise by likelihood.", "fit"),
    "calibrate": Command(_FIT, "Fit any motion model by simulation.", "calibrate"),
    "flow": Command(_FIT, "Extract the flow field alone.", "flow"),
    "simulate": Command(_PREDICT, "Simulate the motion of one body.", "simulate"),
    "assemble": Command(
        _PREDICT, "Simulate the self-assembly of many blocks.", "assembly.assemble"
    ),
    "sensitivity": Command(
        _PREDICT, "Vary the model and see what assembles.", "assembly.sensitivity"
    ),
    "kinetics": Command(_PREDICT, "Estimate rates between outcome classes.", "assembly.kinetics"),
    "infer-outcomes": Command(
        _PREDICT, "Infer parameters from outcomes alone.", "assembly.infer_outcomes"
    ),
    "yield": Command(_PREDICT, "Find the setting with the largest yield.", "assembly.yields"),
    "control": Command(_PREDICT, "Choose the agitation while blocks assemble.", "assembly.control"),
    "play": Command(_PREDICT, "Change parameters while a simulation runs.", "play"),
    "compare": Command(_COMPARE, "Measure the distance between two motions.", "compare"),
    "compare-models": Command(_COMPARE, "Rank motion models on a recording.", "compare_models"),
    "models": Command(_COMPARE, "List the motion models.", "models"),
    "classify": Command(_COMPARE, "Count what the blocks assembled into.", "recordings.classify"),
    "view": Command(_SHARE, "Explore a run in the browser.", "view"),
    "report": Command(_SHARE, "Write a run as one HTML file.", "report"),
    "export": Command(_SHARE, "Write a run for another program.", "export"),
    "cite": Command(_SHARE, "Print what to cite for a run.", "cite"),
    "study": Command(_SET_UP, "Write study files and plan experiments.", "study"),
    "camera": Command(_SET_UP, "Calibrate the camera.", "recordings.camera"),
    "markers": Command(_SET_UP, "Describe the markers.", "recordings.markers"),
}


class LazyGroup(HelpGroup):
    """A group whose commands are stand-ins from `COMMANDS`, imported when they are run."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        for name, (heading, short, _) in COMMANDS.items():
            self.add_command(HelpCommand(name, short_help=short, rich_help_panel=heading))

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the command to run, imported."""
        name, _, rest = super().resolve_command(ctx, args)
        return name, (None if name is None else load_command(name)), rest

    def invoke(self, ctx: Any) -> Any:
        """Run the command; what typer would swallow goes past it to `main`."""
        try:
            return super().invoke(ctx)
        except (KeyboardInterrupt, BrokenPipeError) as error:
            raise PastTyper from error


def load_command(name: str) -> Any:
    """Import a command and return it in the form that the group runs."""
    module = importlib.import_module(f"driftwalk.cli.{COMMANDS[name].module}")
    target = vars(module).get(f"{name}_app") or getattr(module, name.replace("-", "_"))
    if not isinstance(target, typer.Typer):
        function, target = target, typer.Typer(add_completion=False)
        target.command(name, cls=HelpCommand)(function)
    return to_click_command(target)


app = typer.Typer(
    cls=LazyGroup, add_completion=True, context_settings={"help_option_names": ["-h", "--help"]}
)


def _print_version(value: bool) -> None:
    if value:
        from driftwalk import __version__

        typer.echo(f"driftwalk {__version__}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def driftwalk(
    ctx: typer.Context,
    version: Annotated[  # noqa: ARG001
        bool,
        typer.Option(
            "--version", help="Print the version.", is_eager=True, callback=_print_version
        ),
    ] = False,
) -> None:
    """Calibrated stochastic motion models of floating, drifting and stirred robots.

    Numbers are SI; 0.55mN, 16ms and 30cm are read too.
    """
    if ctx.invoked_subcommand is None:
        typer.echo(ctx.get_help())


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    Parameters
    ----------
    arguments : sequence of str, optional
        The words after ``driftwalk``; those of the process when left out.

    Returns
    -------
    int
        0 done, 2 a mistake of the user or of a file (one line on stderr), 130 interrupted.

    Examples
    --------
    >>> main(["--version"])
    driftwalk 0.1.0
    0
    """
    command = to_click_command(app)
    words = list(sys.argv[1:] if arguments is None else arguments)
    try:
        code = command.main(args=words, prog_name="driftwalk", standalone_mode=False)
        # Output that still sits in a buffer may fail only now: a full disk, a closed pipe.
        sys.stdout.flush()
    except (Exception, KeyboardInterrupt) as error:
        return exit_code_of(error)
    return code if isinstance(code, int) else 0


def run() -> None:
    """Run the command line and leave the process; the entry point of the installed script."""
    _open_closed_streams()
    _spell_what_cannot_be_encoded()
    _quieten_matplotlib()
    hide_dask()
    sys.exit(main())


def _open_closed_streams() -> None:
    """Let what a shell closed (``>&-``), which Python makes None, lead nowhere."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: PTH123, SIM115


def _quieten_matplotlib() -> None:
    """Draw into files whatever MPLBACKEND says, and without remarks on the cache of fonts."""
    os.environ["MPLBACKEND"] = "agg"
    logging.getLogger("matplotlib").setLevel(logging.ERROR)


def _spell_what_cannot_be_encoded() -> None:
    """Let stdout escape what its encoding lacks, such as σ in ASCII, as stderr does already."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
