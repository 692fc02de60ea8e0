"""The frame of the command line: commands, errors on one line, options over a study, output."""

from __future__ import annotations

import errno
import io
import json
import os
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import typer

from driftwalk import __version__
from driftwalk.cli import main as cli_main
from driftwalk.cli.main import COMMANDS, Command, main
from driftwalk.cli.options.shared_types import Json
from driftwalk.cli.options.study import StudyOptions, option_name, with_study_options
from driftwalk.cli.terminal.argument_names import option_of
from driftwalk.cli.terminal.output import print_json, print_table, to_json
from driftwalk.cli.terminal.progress import ProgressReporter
from driftwalk.core.errors import ConfigurationError, FormatError, InputError
from driftwalk.core.study_keys import CALIBRATION_KEYS, STUDY_KEYS, study_overrides
from driftwalk.core.text_files import json_value
from driftwalk.model import Study, load_study
from driftwalk.schema.answers.parts import duration_text

AddCommand = Callable[[Callable[..., None]], None]


@pytest.fixture
def add_command(monkeypatch: pytest.MonkeyPatch) -> AddCommand:
    """Return a function that puts a command named "probe" on the command line."""

    def add(function: Callable[..., None]) -> None:
        module = ModuleType("driftwalk.cli.probe")
        module.probe = function  # type: ignore[attr-defined]
        monkeypatch.setitem(sys.modules, "driftwalk.cli.probe", module)
        monkeypatch.setitem(cli_main.COMMANDS, "probe", Command("Fit", "Probe.", "probe"))

    return add


def one_error_line(capsys: pytest.CaptureFixture[str]) -> str:
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1, captured.err
    assert captured.err.startswith("driftwalk: "), captured.err
    assert "Traceback" not in captured.err
    return captured.err


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"driftwalk {__version__}\n"


@pytest.mark.parametrize("arguments", [[], ["--help"], ["-h"]])
def test_help_lists_every_command(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments) == 0
    text = capsys.readouterr().out
    for name, command in COMMANDS.items():
        assert name in text
        assert command.help.split(",")[0] in " ".join(text.split())


def test_help_imports_no_command() -> None:
    code = (
        "import sys; from driftwalk.cli.main import COMMANDS, main; main(['--help']);"
        "print([n for n, c in COMMANDS.items() if f'driftwalk.cli.{c.module}' in sys.modules],"
        "file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "[]"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["calibrat"], "Did you mean 'calibrate'"),
        (["zzz"], "No such command 'zzz'"),
        (["--zzz"], "No such option"),
        (["study", "nwe"], "Did you mean 'new'"),
        (["study", "check"], "Missing argument"),
        (["study", "check", "/nowhere/study.toml"], "/nowhere/study.toml: no such file"),
    ],
)
def test_mistakes_are_one_line(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    assert words in one_error_line(capsys)


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (InputError("a\n  b"), 2, "error: a b\n"),
        (FormatError("bad row", path="f.csv", line=3, column=2), 2, "f.csv, line 3, column 2: bad"),
        (ConfigurationError("x"), 2, "error: x\n"),
        (OSError(errno.ENOSPC, "No space", "out.nc"), 2, "out.nc: no space left on the disk"),
        (PermissionError(errno.EACCES, "Permission denied", "o.nc"), 2, "o.nc: Permission denied"),
        (FileNotFoundError(errno.ENOENT, "No such", "f.csv"), 2, "f.csv: no such file"),
        (OSError("NetCDF: broken"), 2, "error: NetCDF: broken"),
        (KeyboardInterrupt(), 130, "driftwalk: interrupted\n"),
        (typer.BadParameter("no good"), 2, "no good"),
        (typer.Abort(), 130, "interrupted"),
    ],
)
def test_error_of_a_command_is_one_line_and_a_code(
    error: BaseException,
    code: int,
    words: str,
    add_command: AddCommand,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def probe() -> None:
        raise error

    add_command(probe)
    assert main(["probe"]) == code
    assert words in one_error_line(capsys)


def test_broken_pipe_is_silent(add_command: AddCommand, capsys: pytest.CaptureFixture[str]) -> None:
    def probe() -> None:
        raise BrokenPipeError(errno.EPIPE, "Broken pipe")

    add_command(probe)
    assert main(["probe"]) == 141
    assert capsys.readouterr().err == ""


@pytest.mark.slow
def test_reader_that_goes_away_is_silent() -> None:
    code = "from driftwalk.cli.main import run; run()"
    read_end, write_end = os.pipe()
    os.close(read_end)
    done = subprocess.run(
        [sys.executable, "-c", code, "study", "new", "-"], stdout=write_end, stderr=subprocess.PIPE
    )
    os.close(write_end)
    assert done.stderr == b""
    assert done.returncode == 141


@pytest.mark.slow
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
def test_full_disk_is_one_line() -> None:
    code = "from driftwalk.cli.main import run; run()"
    with Path("/dev/full").open("w", encoding="utf-8") as full:
        done = subprocess.run(
            [sys.executable, "-c", code, "study", "new", "-"], stdout=full, stderr=subprocess.PIPE
        )
    assert done.returncode == 2
    assert done.stderr == b"driftwalk: error: no space left on the disk\n"


def test_debug_shows_the_error(add_command: AddCommand, monkeypatch: pytest.MonkeyPatch) -> None:
    def probe() -> None:
        raise InputError("x")

    add_command(probe)
    monkeypatch.setenv("DRIFTWALK_DEBUG", "1")
    with pytest.raises(InputError):
        main(["probe"])


def test_fault_of_the_program_keeps_its_traceback(add_command: AddCommand) -> None:
    def probe() -> None:
        raise RuntimeError("a fault")

    add_command(probe)
    with pytest.raises(RuntimeError, match="a fault"):
        main(["probe"])


def test_options_reach_the_study(
    add_command: AddCommand, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "study.toml"
    path.write_text("[tank]\ndiameter_m = 0.4\n[simulation]\nseed = 5\n", encoding="utf-8")
    seen: list[Study] = []

    @with_study_options(
        STUDY_KEYS,
        *("tank_diameter", "drag_coefficient", "force_std", "depth", "time_step", "seed"),
    )
    def probe(given: StudyOptions, json: Json = False) -> None:
        seen.append(given.study())

    add_command(probe)
    assert main(["probe", "--study", str(path), "--force-std", "0.55mN", "--depth", "2cm"]) == 0
    assert seen[-1].tank.diameter_m == 0.4
    assert seen[-1].simulation.seed == 5
    assert seen[-1].forces.force_std_N == 0.00055
    assert seen[-1].wetted_depth_m == 0.02
    assert main(["probe", "--tank", "50cm", "--depth", "archimedes", "--seed", "9"]) == 0
    assert seen[-1].tank.diameter_m == 0.5
    assert seen[-1].block.depth == "archimedes"
    assert seen[-1].simulation.seed == 9
    assert main(["probe", "--time-step", "auto", "--drag-coefficient", "0.3"]) == 0
    assert seen[-1].forces.drag_coefficient == 0.3
    assert main(["probe"]) == 0
    assert seen[-1] == Study()
    capsys.readouterr()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--force-std", "12px"], "--force-std"),
        (["--force-std", "5s"], "'s' measures something else"),
        (["--force-std", "-1mN"], "--force-std over the default study: [forces] force_std_N: must"),
        (["--tank", "1cm"], "--tank over the default study: the block does not"),
        (["--seed", "x"], "--seed"),
    ],
)
def test_wrong_option_is_named(
    arguments: list[str], words: str, add_command: AddCommand, capsys: pytest.CaptureFixture[str]
) -> None:
    @with_study_options(STUDY_KEYS, "tank_diameter", "force_std", "seed")
    def probe(given: StudyOptions) -> None:
        given.study()

    add_command(probe)
    assert main(["probe", *arguments]) == 2
    assert words in one_error_line(capsys)


def test_every_option_sets_a_parameter_that_exists() -> None:
    for name, key in (*STUDY_KEYS.items(), *CALIBRATION_KEYS.items()):
        section, _, field = key.partition(".")
        assert field in type(getattr(Study(), section)).model_fields, key
        assert option_name(key) == option_of(name)
    assert option_name("block.depth_m") == "--depth"
    assert study_overrides(keys=CALIBRATION_KEYS, seed=3) == {"calibration.seed": 3}


def test_study_new_writes_the_template_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "mine.toml"
    assert main(["study", "new", str(path)]) == 0
    assert load_study(path) == Study()
    path.write_text("[tank]\ndiameter_m = 0.4\n", encoding="utf-8")
    capsys.readouterr()
    assert main(["study", "new", str(path)]) == 2
    assert "--overwrite" in one_error_line(capsys)
    assert load_study(path).tank.diameter_m == 0.4
    assert main(["study", "new", str(path), "--overwrite"]) == 0
    assert load_study(path) == Study()


def test_study_check_prints_what_follows(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "mine.toml"
    path.write_text('[forces]\nforce_interval_s = "16ms"\n', encoding="utf-8")
    assert main(["study", "check", str(path), "--json"]) == 0
    values = json.loads(capsys.readouterr().out)
    assert values["forces"]["force_interval_s"] == 0.016
    assert values["resolved"] == {"time_step_s": 0.008, "wetted_depth_m": 0.03}
    assert main(["study", "check", str(path)]) == 0
    path.write_text(capsys.readouterr().out, encoding="utf-8")
    assert load_study(path).time_step_s == 0.008


def test_json_has_plain_finite_values_in_order(capsys: pytest.CaptureFixture[str]) -> None:
    values = {
        "b": np.float64(0.5),
        "a": np.array([1.0, np.nan, np.inf]),
        "n": np.int64(3),
        "f": np.bool_(True),
        "nested": {"x": (1, None), "path": Path("a/b")},
        "text": "µ",
    }
    print_json(values)
    text = capsys.readouterr().out
    assert text.isascii()
    read = json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))
    assert list(read) == list(values)
    assert read["a"] == [1.0, None, None]
    assert read["nested"] == {"x": [1, None], "path": "a/b"}
    assert (read["b"], read["n"], read["f"]) == (0.5, 3, True)


def test_json_refuses_what_it_cannot_write() -> None:
    with pytest.raises(TypeError, match="object"):
        to_json({"a": object()})
    assert json_value(float("-inf")) is None


def test_table_is_aligned(capsys: pytest.CaptureFixture[str]) -> None:
    print_table([["a", 1], ["long", 0.123456789], ["none", None]], columns=["key", "value"])
    assert capsys.readouterr().out == "key   value\na     1\nlong  0.123457\nnone\n"


def test_progress_without_a_terminal_is_plain_lines() -> None:
    stream = io.StringIO()
    with ProgressReporter("work", stream=stream, seconds_between_lines=0.0) as progress:
        progress(1, 4)
        progress(4, 4, "last")
    assert stream.getvalue() == "work: 1 of 4 (25 %)\nwork: 4 of 4 (100 %): last\n"


def test_progress_without_a_terminal_is_not_chatty() -> None:
    stream = io.StringIO()
    with ProgressReporter("work", stream=stream) as progress:
        for done in range(1000):
            progress(done, 1000)
    assert stream.getvalue() == ""


def test_progress_on_a_terminal_is_a_bar() -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    stream = Terminal()
    with ProgressReporter("work", stream=stream) as progress:
        progress(1, 4)
        progress(2, 4, "now")
    assert "work" in stream.getvalue()
    assert "4" in stream.getvalue()


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.4, "0 s"), (59.6, "1 min 0 s"), (61, "1 min 1 s"), (3725, "1 h 2 min")]
)
def test_duration_text(seconds: float, text: str) -> None:
    assert duration_text(seconds) == text


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="closes streams as a POSIX shell does")
def test_closed_streams_are_no_error() -> None:
    code = "from driftwalk.cli.main import run; run()"
    words = f"{shlex.quote(sys.executable)} -c {shlex.quote(code)}"
    done = subprocess.run(f"{words} study new - >&-", shell=True, capture_output=True)
    assert (done.returncode, done.stderr) == (0, b"")
    done = subprocess.run(f"{words} info /nowhere.csv 2>&-", shell=True, capture_output=True)
    assert (done.returncode, done.stdout) == (2, b"")


@pytest.mark.slow
def test_a_backend_that_does_not_exist_is_no_concern_of_figures() -> None:
    code = (
        "import sys; from driftwalk.cli import main; main.main = lambda: __import__('matplotlib')\n"
        "sys.exit = lambda _: None\nmain.run()\nimport matplotlib; print(matplotlib.get_backend())"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "MPLBACKEND": "nonsense", "HOME": "/nowhere", "MPLCONFIGDIR": ""},
        capture_output=True,
        text=True,
    )
    assert (done.stdout.strip().lower(), done.stderr) == ("agg", "")
