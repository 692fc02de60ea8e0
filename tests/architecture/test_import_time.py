"""`import driftwalk` and `driftwalk --help` load nothing heavy."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import FLOW, RECORDING, here

HEAVY = {"xarray", "scipy", "pandas", "cv2", "matplotlib", "dask", "h5netcdf", "optuna", "fastapi"}
HELP = "from driftwalk.cli.main import main; assert main(['--help']) == 0"
HELP_OF_FIT = HELP.replace("['--help']", "['fit', '--help']")
IMPORT = "import driftwalk; driftwalk.__version__"


def loaded_by(code: str) -> set[str]:
    # None stands for a module that is to seem missing.
    script = f"{code}\nimport sys\nfor name, module in sys.modules.items():\n"
    script += "    if module is not None:\n        print(name, file=sys.stderr)"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    return {name.partition(".")[0] for name in done.stderr.split()}


@pytest.mark.parametrize(
    ("code", "absent"),
    [
        (IMPORT, HEAVY | {"pydantic", "numpy", "typer"}),
        (HELP, HEAVY),
        (HELP_OF_FIT, HEAVY | {"numpy"}),
    ],
    ids=["import", "help", "help of fit"],
)
def test_nothing_heavy_is_loaded(code: str, absent: set[str]) -> None:
    loaded = loaded_by(code)
    assert "driftwalk" in loaded
    assert not loaded & absent


@pytest.mark.slow
@pytest.mark.parametrize("command", ["info", "report"])
def test_short_commands_load_what_they_need(command: str, tmp_path: Path) -> None:
    """Dask, for instance, is loaded by xarray where it is installed, and with it scipy."""
    if command == "info":
        words = ["info", str(RECORDING)]
    else:
        words = ["report", str(small_run(tmp_path)), "-o", str(tmp_path / "report.html")]
    code = (
        f"import sys\nsys.argv[1:] = {words!r}\nfrom driftwalk.cli.main import run\n"
        "try:\n    run()\nexcept SystemExit as end:\n    assert not end.code, end.code"
    )
    loaded = loaded_by(code)
    assert {"driftwalk", "xarray"} <= loaded
    assert not loaded & {"dask", "distributed", "matplotlib", "scipy", "cv2", "optuna", "fastapi"}


def small_run(folder: Path) -> Path:
    """Make the run of a short assembly."""
    out = folder / "run"
    run = ("--tank", "30cm", "--blocks", "1", "--runs", "2", "--duration", "1s")
    done = here("assemble", "--flow", FLOW, *run, "--film", "none", "-o", out)
    assert done.code == 0, done.err
    return out


@pytest.mark.slow
def test_the_list_of_modules_would_show_a_heavy_one() -> None:
    assert "xarray" in loaded_by(f"{IMPORT}; import xarray")


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(("code", "limit_s"), [(IMPORT, 0.3), (HELP, 0.5)], ids=["import", "help"])
def test_time_to_answer(code: str, limit_s: float) -> None:
    """Processor time above an empty interpreter, the best of five: other work only adds."""
    bare = min(seconds("pass") for _ in range(3))
    assert min(seconds(code) for _ in range(5)) - bare < limit_s


def seconds(code: str) -> float:
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, env=environment)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
