"""`import driftwalk` and `driftwalk --help` load nothing heavy."""

from __future__ import annotations

import os
import resource
import subprocess
import sys

import pytest

HEAVY = {"xarray", "scipy", "pandas", "cv2", "matplotlib", "dask", "h5netcdf", "optuna", "fastapi"}
HELP = "from driftwalk.cli.main import main; assert main(['--help']) == 0"
HELP_OF_FIT = HELP.replace("['--help']", "['fit', '--help']")
IMPORT = "import driftwalk; driftwalk.__version__"


def loaded_by(code: str) -> set[str]:
    script = f"{code}\nimport sys\nprint('\\n'.join(sys.modules), file=sys.stderr)"
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


def test_the_list_of_modules_would_show_a_heavy_one() -> None:
    assert "xarray" in loaded_by(f"{IMPORT}; import xarray")


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
