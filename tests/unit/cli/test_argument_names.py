"""What the library calls an argument, the command line prints as an option."""

from __future__ import annotations

import inspect
import json
import shlex
from types import ModuleType

import pytest
from hypothesis import given, strategies as st

import driftwalk as dw
from driftwalk.cli.main import COMMANDS, load_command
from driftwalk.cli.options.recording import parse_columns
from driftwalk.cli.terminal.argument_names import OPTIONS, WHOLE, in_options, to_options
from driftwalk.cli.terminal.errors import one_line
from driftwalk.cli.terminal.output import print_json, print_note
from driftwalk.core.errors import InputError, argument_text
from driftwalk.model import Study


@pytest.mark.parametrize(
    ("message", "printed"),
    [
        ("name one with `body`", "name one with --body"),
        ("no sample lies between `start` and `stop`", "no sample lies between --from and --to"),
        (
            "the time that is kept (`start`, `stop` of `load`)",
            "the time that is kept (--from, --to)",
        ),
        ('add `sort="sort"` to sort them', "add --sort to sort them"),
        ('name another file, or `existing="replace"`', "name another file, or --overwrite"),
        ("give `overwrite=True`", "give --overwrite"),
        ('add `columns={"body": "particle"}`', "add --columns body=particle"),
        ('add `columns={"theta": "Winkel [°]"}`', "add --columns 'theta=Winkel [°]'"),
        ('such as `columns={"t": "1", "x": "2"}`', "such as --columns t=1,x=2"),
        ('`tank="fit"` found a tank', "--tank fit found a tank"),
        ("use fewer blocks (`assembly.blocks`)", "use fewer blocks (--blocks)"),
        ("calibrate with `calibration.bootstrap=200`", "calibrate with --bootstrap 200"),
        ("give `side` or `area`", "give --side or area"),
        ("no column `speed`, nor `x.csv` or `a b`", "no column `speed`, nor `x.csv` or `a b`"),
        ("an odd ` before `body` hides nothing", "an odd ` before --body hides nothing"),
        ("what is no value stays: `tank=circle`", "what is no value stays: `tank=circle`"),
    ],
)
def test_an_argument_becomes_an_option(message: str, printed: str) -> None:
    assert to_options(message) == printed


@pytest.mark.slow
@given(st.text(min_size=1))
def test_any_name_of_a_column_arrives_in_the_command_that_is_advised(name: str) -> None:
    """A shell that reads the advice hands the option the column's name, whatever it holds."""
    printed = to_options(f"add {argument_text('columns', {'x': name})} if so")
    words = shlex.split(printed.removesuffix(" if so"))
    assert words == ["add", "--columns", f"x={name}"]
    if "," not in name and name == name.strip():
        assert parse_columns(words[2:]) == {"x": name}


@given(st.text())
def test_a_caller_in_python_can_type_what_the_message_names(text: str) -> None:
    shown = argument_text("tank", text)
    assert shown.count("`") == 2
    assert eval(f"dict({shown.strip('`')})") == {"tank": text}


def test_errors_notes_and_json_are_translated(capsys: pytest.CaptureFixture[str]) -> None:
    assert one_line(InputError("give `frame_rate`")) == "give --fps"
    print_note("warning: give `frame_rate`")
    assert capsys.readouterr().err == "driftwalk: warning: give --fps\n"
    print_json({"bodies": ["`body`"], "inner": [{"warnings": ["give `frame_rate`"]}]})
    assert json.loads(capsys.readouterr().out) == {
        "bodies": ["`body`"],
        "inner": [{"warnings": ["give --fps"]}],
    }


def test_a_message_that_is_not_there_stays_none() -> None:
    assert in_options({"interrupted": None, "warning": "`body`"}) == {
        "interrupted": None,
        "warning": "--body",
    }


def test_every_option_of_the_table_is_one_of_a_command() -> None:
    known = {option for name in COMMANDS for option in _options_of(load_command(name))}
    named = {option for option in OPTIONS.values() if option is not None} | {*WHOLE.values()}
    assert named <= known


def test_every_argument_of_the_table_is_one_of_a_public_function() -> None:
    rooms = [one for name in dw.__all__ if isinstance(one := getattr(dw, name), ModuleType)]
    known = {name for room in rooms for name in _arguments_of(room)}
    keys = {
        f"{section}.{key}"
        for section, field in Study.model_fields.items()
        for key in getattr(field.annotation, "model_fields", ())
    }
    named = {*OPTIONS, *(whole.partition("=")[0] for whole in WHOLE)}
    assert named <= known | keys


def _options_of(command: object) -> set[str]:
    options = {word for one in getattr(command, "params", ()) for word in one.opts}
    return options.union(*map(_options_of, getattr(command, "commands", {}).values()))


def _arguments_of(room: ModuleType) -> set[str]:
    public = [getattr(room, name) for name in room.__all__]
    functions = filter(inspect.isfunction, public)
    return {name for one in functions for name in inspect.signature(one).parameters}
