"""Running the command line as a user does: what the integration tests of it share."""

from __future__ import annotations

import contextlib
import io
import json
import re
import subprocess
import sys
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import xarray as xr

from driftwalk.cli.main import main

DATA = Path(str(files("driftwalk.datasets") / "tank30_ode_a"))
RECORDING = DATA / "recording.csv"
FLOW = DATA / "flow_true.csv"

# The search of the demo's quick look, cut down once more: a run takes about a second of computing.
GRID = """\
[calibration]
drag_coefficient_min = 0.2
drag_coefficient_max = 0.6
drag_coefficient_step = 0.1
force_std_min_N = "0.2mN"
force_std_max_N = "1mN"
force_std_step_N = "0.2mN"
replicates = 1
refined_drag_coefficient_step = 0.05
refined_force_std_step_N = "0.1mN"
refined_replicates = 2
bootstrap = 10
"""

# A fit of five minutes of the bundled recording, with coarse knots for speed.
FIT = ("fit", RECORDING, "--to", "300", "--spline-spacing", "3cm", "--force-interval", "16ms")

# What draws the figures and the film of a run, below the package.
FIGURE_WRITERS = ("figures.write_figures", "plot.write_animation")

# Lines for `start` and `apart`: no figures and no film, which take most of the time of a short run.
NO_FIGURES = "import driftwalk.figures, driftwalk.plot\n" + "".join(
    f"driftwalk.{name} = lambda *folders, **datasets: []\n" for name in FIGURE_WRITERS
)


def leave_out_figures(patch: pytest.MonkeyPatch) -> None:
    """Put functions that draw nothing in the place of those that a command calls."""
    for name in FIGURE_WRITERS:
        patch.setattr(f"driftwalk.{name}", lambda *folders, **datasets: [])


# SIGINT is set because a program started in the background inherits that it is ignored.
PROGRAM = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)
from driftwalk.cli.main import run
"""


class Done(NamedTuple):
    """What a command left: its exit code and what it printed."""

    code: int
    out: str
    err: str


def answer(done: Done) -> dict[str, Any]:
    """Return what a command printed with --json."""
    assert done.code == 0, done.err
    found: dict[str, Any] = json.loads(done.out)
    return found


def here(*words: object) -> Done:
    """Run a command in this process."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main([str(word) for word in words])
    return Done(code, out.getvalue(), err.getvalue())


def start(*words: object, before: str = "", **options: object) -> subprocess.Popen[str]:
    """Start a command in a process of its own, after some lines of Python."""
    code = f"{PROGRAM}{before}\nrun()"
    pipes: dict = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True} | options
    return subprocess.Popen([sys.executable, "-c", code, *map(str, words)], **pipes)


def end(process: subprocess.Popen[str]) -> Done:
    """Wait for a process."""
    out, err = process.communicate(timeout=600)
    return Done(process.returncode, out or "", err or "")


def apart(*words: object, before: str = "", **options: object) -> Done:
    """Run a command in a process of its own."""
    return end(start(*words, before=before, **options))


def refusal(done: Done) -> str:
    """Return the one line of a mistake, after checking that it is one."""
    assert done.code == 2, done
    assert done.err.count("\n") == 1, done.err
    assert done.err.startswith("driftwalk: error: "), done.err
    assert "Traceback" not in done.err
    assert done.out == ""
    return done.err


def refusal_under_way(done: Done) -> str:
    """Return the one line of a mistake, after the words with which the run had begun."""
    begun = "driftwalk: tank: "
    lines = done.err.splitlines(keepends=True)
    assert lines[0].startswith(begun)
    # On a busy machine a line of the progress comes too.
    words = rf"{begun}|.* not stated: |[\w-]+: \d+ %"
    kept = [line for line in lines if not re.match(words, line)]
    return refusal(done._replace(err="".join(kept)))


def contents(folder: Path) -> dict[str, bytes | None]:
    """Return everything in a folder: the bytes of the files, None for folders."""
    paths = folder.rglob("*")
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None
        for path in paths
    }


def calibration(folder: Path) -> xr.Dataset:
    """Return the calibration that a run directory holds."""
    with xr.open_dataset(folder / "calibration.nc", engine="h5netcdf") as dataset:
        return dataset.load()


def assert_same_bits(first: xr.Dataset, second: xr.Dataset) -> None:
    """Compare every array bit for bit, and the attributes."""
    assert set(first.variables) == set(second.variables)
    for name in first.variables:
        a, b = first[name].values, second[name].values
        assert a.dtype == b.dtype, name
        assert a.shape == b.shape, name
        assert a.tobytes() == b.tobytes(), name
    for name, value in first.attrs.items():
        np.testing.assert_array_equal(value, second.attrs[name], err_msg=name)
    assert set(first.attrs) == set(second.attrs)
