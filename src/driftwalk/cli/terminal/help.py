"""The help of a command: its main options by group, and all of them with ``--help-all``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from typer.core import TyperCommand, TyperGroup

ALL: Final = "--help-all"

MAIN_OPTIONS: Final[dict[str, str]] = {
    "assemble": "out flow blocks runs duration film",
    "calibrate": "out flow study body model parameter",
    "camera calibrate": "out squares square board no-lens",
    "classify": "out side min-duration hold chirality json",
    "compare": "body body-b step-interval permutations out json",
    "compare-models": "out flow study body models parameter",
    "control plan": "out target by every vary flow",
    "control test": "out worlds latency missed force-factor json",
    "export": "to out flow seed replicate verify",
    "fit": "out study body switching-times wall compare-laws",
    "flow": "out study body tracers window cells",
    "infer-outcomes": "out flow vary after blocks truths",
    "info": "fps scale columns tank body json",
    "kinetics": "out target blocks cluster json",
    "markers teach": "out camera tank scale fps side",
    "play": "flow model parameter recording blocks live",
    "read": "out fps scale tank side mass",
    "report": "out fps scale tank overwrite",
    "sensitivity": "out flow vary blocks runs sobol",
    "simulate": "out flow model parameter like duration",
    "study recover": "study out recordings duration model parameter",
    "track": "markers out camera tank scale bodies",
    "watch": "markers bodies camera tank scale out",
    "yield": "out target by vary flow runs",
}
"""The options that ``--help`` shows; every option of a command that is not named here."""
_RESULT: Final = "Result"
_COMPUTING: Final = "Computing"
_HELP: Final = "Help"
_GROUPS: Final = {
    **dict.fromkeys(("out", "overwrite", "json", "film", "overlay", "posterior"), _RESULT),
    **dict.fromkeys(("threads", "cluster", "cluster-option", "backend"), _COMPUTING),
    **dict.fromkeys(("help", "help-all", "version"), _HELP),
    **dict.fromkeys(("install-completion", "show-completion"), _HELP),
}
"""Where an option stands that is declared without a group."""
_LAST: Final = (_RESULT, _COMPUTING, _HELP)
_COLUMN: Final = 30
"""Widest column of the names of options; a longer name stands on a line of its own."""


class _WithHelp:
    """Adds ``--help-all`` to a command, and writes both helps as plain text."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        # Behind a name, the option belongs to the command of that name.
        own = args[:1] if hasattr(self, "commands") else args
        if ALL in own:
            ctx.meta[ALL] = True
            args = ["--help"]
        return super().parse_args(ctx, args)  # type: ignore[misc, no-any-return]

    def format_help(self, ctx: Any, formatter: Any) -> None:
        write_help(self, ctx, formatter)


class HelpCommand(_WithHelp, TyperCommand):
    """A command whose help shows its main options."""


class HelpGroup(_WithHelp, TyperGroup):
    """A group of commands, each with a line in its help."""


def write_help(command: Any, ctx: Any, formatter: Any) -> None:
    """Write usage, text, arguments, commands and options of a command."""
    arguments: list[Any] = []
    options: list[Any] = []
    for one in command.get_params(ctx):
        (options if one.param_type_name == "option" else arguments).append(one)
    rows = [((one.metavar or one.name.upper()).strip("[]"), one.help) for one in arguments]
    words = [
        row[0] if one.required else f"[{row[0]}]" for row, one in zip(rows, arguments, strict=True)
    ]
    if hasattr(command, "commands"):
        words.append("COMMAND")
    formatter.write_usage(ctx.command_path, " ".join([*words, "[OPTIONS]"]))
    command.format_help_text(ctx, formatter)
    _write(formatter, "Arguments", rows)
    _write_commands(command, formatter)
    _write_options(options, ctx, formatter)


def _write_options(options: list[Any], ctx: Any, formatter: Any) -> None:
    main = MAIN_OPTIONS.get(ctx.command_path.partition(" ")[2], "").split()
    own = [one for one in options if _group(one) != _HELP]
    shown = options
    if ALL not in ctx.meta:
        by_name = {_name(one): one for one in own}
        shown = [by_name[name] for name in main] or own
    groups: dict[str, list[tuple[str, str]]] = {}
    for one in shown:
        groups.setdefault(_group(one), []).append((_label(one), _text(one)))
    for group in sorted(groups, key=lambda group: group in _LAST and 1 + _LAST.index(group)):
        _write(formatter, group, groups[group])
    if len(shown) < len(own):
        formatter.write_paragraph()
        formatter.write_text(f"All {len(own)} options: {ctx.command_path} {ALL}")


def _write(formatter: Any, heading: str, rows: Sequence[tuple[str, str]]) -> None:
    if rows:
        with formatter.section(heading):
            formatter.write_dl(rows, col_max=_COLUMN)


def _write_commands(group: Any, formatter: Any) -> None:
    """Write the commands of a group, under the headings that they are declared with."""
    headings: dict[str, list[tuple[str, str]]] = {}
    for name, one in getattr(group, "commands", {}).items():
        headings.setdefault(one.rich_help_panel or "Commands", []).append(
            (name, one.short_help or one.help.partition("\n")[0])
        )
    for heading, rows in headings.items():
        _write(formatter, heading, rows)


def _name(option: Any) -> str:
    """Return the long name of an option; click's own ``-h, --help`` has no fixed order."""
    return max((str(one) for one in option.opts), key=len).lstrip("-")


def _group(option: Any) -> str:
    group: str | None = getattr(option, "rich_help_panel", None)
    return group or _GROUPS.get(_name(option), "Options")


def _label(option: Any) -> str:
    """Return the names of an option with the placeholder of its value."""
    names = ", ".join((*sorted(option.opts, key=len, reverse=True), *option.secondary_opts))
    if option.is_flag:
        return names
    return f"{names} {option.metavar or option.name.upper()}"


def _text(option: Any) -> str:
    """Return the meaning of an option, with its default where that says something."""
    notes = ["required"] if option.required else []
    if option.show_default and option.default not in (None, False, ""):
        notes.append(f"default: {option.default}")
    return f"{option.help} [{'; '.join(notes)}]" if notes else str(option.help)
