"""A calibration that is killed, interrupted, raced or out of disk, and started again.

Whatever happened, the second start ends with the arrays of a run that nothing happened to.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import xarray as xr
from command_line import (
    FLOW,
    GRID,
    NO_FIGURES,
    RECORDING,
    apart,
    assert_same_bits,
    calibration,
    contents,
    end,
    here,
    leave_out_figures,
    refusal,
    refusal_under_way,
    start,
)
from signals_at_units import after_units, go_on, halted

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")

# The figures come after everything that resumes.
PLAIN = NO_FIGURES


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a study with more units than `GRID`: 3 of the map, and 4 of the bootstrap."""
    path = tmp_path_factory.mktemp("study") / "study.toml"
    text = GRID.replace('force_std_step_N = "0.2mN"', 'force_std_step_N = "0.05mN"')
    text = text.replace("drag_coefficient_step = 0.1\n", "drag_coefficient_step = 0.05\n", 1)
    path.write_text(text.replace("bootstrap = 10", "bootstrap = 40"), encoding="utf-8")
    return path


def words(study: Path, folder: Path) -> list[object]:
    return [
        *("calibrate", RECORDING, "--to", "20s", "--flow", FLOW, "--study", study),
        *("--out", folder, "--threads", "1"),
    ]


@pytest.fixture(scope="module")
def uninterrupted(study: Path, tmp_path_factory: pytest.TempPathFactory) -> xr.Dataset:
    folder = tmp_path_factory.mktemp("uninterrupted") / "run"
    with pytest.MonkeyPatch.context() as patch:
        leave_out_figures(patch)
        done = here(*words(study, folder))
    assert done.code == 0, done.err
    return calibration(folder)


def shards(folder: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in folder.glob(".shards/*/[0-9]*.npz")}


def assert_whole(folder: Path, expected: xr.Dataset) -> None:
    assert_same_bits(calibration(folder), expected)
    assert json.loads((folder / "manifest.json").read_text(encoding="utf-8"))["files"]
    assert not (folder / ".shards").exists()
    assert not list(folder.rglob("*partial*"))


@pytest.mark.slow
def test_interrupted_and_continued(study: Path, uninterrupted: xr.Dataset, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    done = apart(*words(study, folder), before=PLAIN + after_units(signal.SIGINT, 2))
    assert (done.code, done.out) == (130, "")
    # The opening line of the run, and the one that ends it.
    assert [line[:16] for line in done.err.splitlines()] == ["driftwalk: tank:", "driftwalk: inter"]
    kept = shards(folder)
    assert len(kept) == 2
    halting = PLAIN + after_units(signal.SIGSTOP, 1)
    with halted(start(*words(study, folder), before=halting)) as process:
        assert len(shards(folder)) == 3
        # What had been finished is not computed again.
        assert {path: shards(folder)[path] for path in kept} == kept
        go_on(process)
        assert end(process).code == 0
    assert_whole(folder, uninterrupted)


# Kills itself before the n-th change of the file system, in the run directory or a part of it.
KILL = """
import os, signal, sys
left = {count}
folder = {folder!r}
def hook(event, arguments):
    global left
    writes = event == "open" and (arguments[2] or 0) & (os.O_WRONLY | os.O_RDWR)
    changes = event in {{"os.rename", "os.remove", "os.mkdir", "os.rmdir"}}
    if (writes or changes) and str(arguments[0]).startswith(folder):
        left -= 1
        if left < 0:
            os.kill(os.getpid(), signal.SIGKILL)
sys.addaudithook(hook)
"""


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_killed_between_any_two_changes(
    study: Path, uninterrupted: xr.Dataset, tmp_path: Path
) -> None:
    """At every 43rd change: a calibration makes a hundred or more, and the moments are a sample."""
    kills = 0
    for count in range(0, 2000, 43):
        folder = tmp_path / f"run-{count}"
        before = PLAIN + KILL.format(count=count, folder=str(folder))
        code = apart(*words(study, folder), before=before).code
        if code == 0:
            break
        assert code == -signal.SIGKILL
        kills += 1
        if not (folder / "manifest.json").exists():
            done = here(*words(study, folder))
            assert done.code == 0, done.err
        assert_same_bits(calibration(folder), uninterrupted)
    assert kills > 2


@pytest.mark.slow
def test_killed_while_the_figures_are_drawn(
    study: Path, uninterrupted: xr.Dataset, tmp_path: Path
) -> None:
    """Killed before the folder of figures is changed for the fifth time, amid a figure."""
    folder = tmp_path / "run"
    killed = KILL.format(count=4, folder=str(folder / "figures"))
    assert apart(*words(study, folder), before=killed).code == -signal.SIGKILL
    assert 0 < len(list(folder.glob("figures/*"))) < 14
    assert here(*words(study, folder)).code == 0
    assert len(list(folder.glob("figures/*"))) == 14
    assert_whole(folder, uninterrupted)


@pytest.mark.slow
def test_two_processes_at_once(study: Path, uninterrupted: xr.Dataset, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    halting = PLAIN + after_units(signal.SIGSTOP, 1)
    # Halted, it holds the folder for as long as the others need, however busy the machine.
    with halted(start(*words(study, folder), before=halting)) as first:
        for more in ([], ["--overwrite"]):
            line = refusal(here(*words(study, folder), *more))
            assert f"{folder} is in use by another process" in line
        go_on(first)
        assert end(first).code == 0
    assert_whole(folder, uninterrupted)


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_other_parameters_do_not_continue_a_run(
    study: Path, uninterrupted: xr.Dataset, tmp_path: Path
) -> None:
    folder = tmp_path / "run"
    killed = PLAIN + after_units(signal.SIGKILL, 2)
    assert apart(*words(study, folder), before=killed).code == -signal.SIGKILL
    before = contents(folder)
    line = refusal(here(*words(study, folder), "--seed", "2"))
    assert "seed" in line
    assert {n: d for n, d in contents(folder).items() if n != ".lock"} == {
        n: d for n, d in before.items() if n != ".lock" and "partial" not in n
    }
    assert here(*words(study, folder)).code == 0
    assert_whole(folder, uninterrupted)


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_files_that_may_not_grow(study: Path, uninterrupted: xr.Dataset, tmp_path: Path) -> None:
    """A limit on the size of files fails a write as a full disk does, of the first shard."""
    folder = tmp_path / "run"
    limit = (
        "import resource, signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (6000, resource.RLIM_INFINITY))\n"
    )
    line = refusal_under_way(apart(*words(study, folder), before=PLAIN + limit))
    assert str(folder) in line
    assert "run the same command again to continue" in line
    assert not list(folder.rglob("*partial*"))
    assert here(*words(study, folder)).code == 0
    assert_whole(folder, uninterrupted)


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """Return the place of a disk of 8 MB, where this user may mount one."""
    place = tmp_path / "disk"
    place.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=8m", "none", str(place)]
    if shutil.which("mount") is None or subprocess.run(command, capture_output=True).returncode:
        pytest.skip("no disk can be mounted here")
    yield place
    subprocess.run(["umount", str(place)], check=True)


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_a_disk_that_is_full(study: Path, uninterrupted: xr.Dataset, small_disk: Path) -> None:
    """Among the figures, with the calibration done."""
    ballast = small_disk / "ballast"
    ballast.write_bytes(bytes(os.statvfs(small_disk).f_bavail * 4096 - 1_300_000))
    folder = small_disk / "run"
    line = refusal_under_way(apart(*words(study, folder)))
    assert "the disk is full" in line
    assert str(folder) in line
    ballast.unlink()
    assert not list(folder.rglob("*partial*"))
    done = here(*words(study, folder))
    assert done.code == 0, done.err
    assert_same_bits(calibration(folder), uninterrupted)


@pytest.mark.slow
@pytest.mark.parametrize("command", ["read", "flow", "simulate", "compare", "study"])
def test_a_full_disk_keeps_the_file_that_was_there(command: str, small_disk: Path) -> None:
    out = small_disk / "out.nc"
    out.write_bytes(b"precious")
    (small_disk / "ballast").write_bytes(bytes(os.statvfs(small_disk).f_bavail * 4096))
    said = refusal_under_way if command == "simulate" else refusal
    line = said(
        here(
            *{
                "read": ["read", RECORDING, "-o", out],
                "flow": ["flow", RECORDING, "--tank", "30cm", "--out", out],
                "simulate": ["simulate", "--flow", FLOW, "--duration", "60s", "--out", out],
                "compare": ["compare", RECORDING, RECORDING, "--permutations", 0, "--out", out],
                "study": ["study", "new", out],
            }[command],
            "--overwrite",
        )
    )
    assert "the disk is full" in line
    assert str(out) in line
    assert out.read_bytes() == b"precious"
    assert sorted(path.name for path in small_disk.iterdir()) == ["ballast", "out.nc"]
