"""Kills, concurrent runs, full disks and Ctrl-C against a real run in processes of its own.

The sweep is cheap and synthetic: random numbers with an address, like those of a simulation.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from signals_at_units import after_units, go_on, halted

import driftwalk
from driftwalk.core.files.run_layout import state_of
from driftwalk.core.provenance import read_manifest

SOURCE = str(Path(driftwalk.__file__ or "").parents[1])
UNITS = 24

# A run with two sweeps, the second depending on the first, as a calibration's refinement does.
PROGRAM = f"""
import os, signal, sys, time
sys.path.insert(0, {SOURCE!r})
import numpy as np
from concurrent.futures import ThreadPoolExecutor
from driftwalk.core.errors import DriftwalkError
from driftwalk.core.files.rundir import RunDirectory
from driftwalk.sweep import grid, run_sweep

INTERRUPTED_AT = None


def function(unit):
    time.sleep(PAUSE_S)
    if unit.start == INTERRUPTED_AT:
        os.kill(os.getpid(), signal.SIGINT)
    rows = [np.random.default_rng([SEED, i]).normal(size=64) for i in range(unit.start, unit.stop)]
    return {{"x": np.array(rows) * unit.settings["scale"][:, None]}}


def compute(path, seed, mode="resume", pause_s=0.0, threads=0, units={UNITS}):
    global PAUSE_S, SEED
    PAUSE_S, SEED = pause_s, seed
    pool = ThreadPoolExecutor(threads) if threads else None
    again = mode == "overwrite"
    with RunDirectory(path, specification={{"seed": seed}}, overwrite=again) as run:
        design = grid(scale=np.linspace(1.0, 2.0, 2 * units))
        coarse = run_sweep(function, design.units(2), store=run.store("coarse"), executor=pool)
        fine = grid(scale=[float(coarse["x"].min()), float(coarse["x"].max())])
        store = run.store("refined", fingerprint=fine.describe())
        refined = run_sweep(function, fine.units(1), store=store, executor=pool)
        # A result that sorts behind manifest.json: its place in a move matters.
        run.write("trajectory.bin", coarse["x"].tobytes())
        run.write("figures/refined.bin", refined["x"].tobytes())
        run.finish({{"seeds": {{"calibration": seed}}}})
"""

# SIGINT is set because a program started in the background inherits that it is ignored.
MAIN = """
signal.signal(signal.SIGINT, signal.default_int_handler)
path, seed, mode, pause_s, threads = sys.argv[1:]
try:
    compute(path, int(seed), mode, float(pause_s), int(threads))
except KeyboardInterrupt:
    sys.exit(130)
except DriftwalkError as error:
    print(error, file=sys.stderr)
    sys.exit(2)
"""
COMMAND = PROGRAM + MAIN


def start(
    path: Path,
    *,
    seed: int = 1,
    mode: str = "resume",
    pause_s: float = 0.0,
    threads: int = 0,
    program: str = COMMAND,
) -> subprocess.Popen[str]:
    words = [str(path), str(seed), mode, str(pause_s), str(threads)]
    return subprocess.Popen(
        [sys.executable, "-c", program, *words], stderr=subprocess.PIPE, text=True
    )


def end(process: subprocess.Popen[str]) -> tuple[int, str]:
    _, errors = process.communicate(timeout=120)
    return process.returncode, errors


def shards(path: Path) -> list[Path]:
    return sorted((path / ".shards" / "coarse").glob("0*.npz"))


def results(path: Path) -> dict[str, bytes]:
    return {name: (path / name).read_bytes() for name in ("trajectory.bin", "figures/refined.bin")}


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    path = tmp_path_factory.mktemp("uninterrupted") / "run"
    assert end(start(path)) == (0, "")
    return results(path)


@pytest.mark.slow
@pytest.mark.parametrize("threads", [0, 3])
def test_killed_twice_and_resumed(
    tmp_path: Path, uninterrupted: dict[str, bytes], threads: int
) -> None:
    path = tmp_path / "run"
    for more in (5, 6):
        killed = PROGRAM + after_units(signal.SIGKILL, more) + MAIN
        process = start(path, pause_s=0.01, threads=threads, program=killed)
        assert end(process)[0] == -signal.SIGKILL
        assert state_of(path) == "unfinished"
    kept = {shard: shard.stat().st_mtime_ns for shard in shards(path)}
    assert len(kept) == 11
    # At its last unit all shards can be seen; after it they are joined and go.
    halting = PROGRAM + after_units(signal.SIGSTOP, UNITS - len(kept)) + MAIN
    with halted(start(path, pause_s=0.01, threads=threads, program=halting)) as process:
        assert len(shards(path)) == UNITS
        assert {s: s.stat().st_mtime_ns for s in shards(path) if s in kept} == kept
        go_on(process)
        assert end(process) == (0, "")
    assert results(path) == uninterrupted
    assert sorted(p.name for p in path.iterdir()) == [
        ".lock",
        "figures",
        "manifest.json",
        "trajectory.bin",
    ]


@pytest.mark.slow
@pytest.mark.parametrize("threads", [0, 2])
def test_interrupt_loses_nothing(
    tmp_path: Path, uninterrupted: dict[str, bytes], threads: int
) -> None:
    """Ctrl-C in the sixth unit; with two threads the one before it may be under way too."""
    path = tmp_path / "run"
    interrupted = f"{PROGRAM}\nINTERRUPTED_AT = 10\n{MAIN}"
    process = start(path, pause_s=0.02, threads=threads, program=interrupted)
    assert end(process) == (130, "")
    kept = len(shards(path))
    assert kept >= 4 if threads else kept == 5
    assert end(start(path, threads=threads)) == (0, "")
    assert results(path) == uninterrupted


@pytest.mark.slow
def test_second_process_is_refused_and_the_first_unharmed(
    tmp_path: Path, uninterrupted: dict[str, bytes]
) -> None:
    path = tmp_path / "run"
    # Halted, it cannot be done before the others have started, however slow the machine.
    with halted(start(path, program=PROGRAM + after_units(signal.SIGSTOP, 1) + MAIN)) as first:
        for mode in ("resume", "overwrite"):
            code, errors = end(start(path, mode=mode))
            assert code == 2
            assert errors.splitlines() == [
                f"{path} is in use by another process; wait until it is done or choose another "
                "directory"
            ]
        go_on(first)
        assert end(first) == (0, "")
    assert results(path) == uninterrupted


@pytest.mark.slow
def test_processes_that_start_at_once(tmp_path: Path, uninterrupted: dict[str, bytes]) -> None:
    path = tmp_path / "run"
    ends = [end(process) for process in [start(path, pause_s=0.005) for _ in range(3)]]
    assert sum(code == 0 for code, _ in ends) == 1
    assert all("is in use" in text or "finished run" in text for code, text in ends if code)
    assert results(path) == uninterrupted


@pytest.mark.slow
def test_disk_that_fills_in_the_middle(tmp_path: Path, uninterrupted: dict[str, bytes]) -> None:
    """A limit on file sizes cuts the write of the joined result, larger than any shard."""
    path = tmp_path / "run"
    limit = (
        "import resource, signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (8192, resource.RLIM_INFINITY))\n"
    )
    process = start(path, program=limit + COMMAND)
    code, errors = end(process)
    assert code == 2
    assert errors.splitlines() == [
        f"cannot write {path / 'trajectory.bin'}: files of this size are not allowed here; what "
        "was finished before is kept: raise the limit on file sizes, then run the same command "
        "again to continue"
    ]
    kept = {shard: shard.stat().st_mtime_ns for shard in shards(path)}
    assert len(kept) == UNITS
    assert not list(path.rglob("*partial*"))
    # Nothing has to be computed again: a pause per unit would take far longer than this.
    began = time.monotonic()
    assert end(start(path, pause_s=2.0)) == (0, "")
    assert time.monotonic() - began < 2.0 * UNITS
    assert results(path) == uninterrupted


@pytest.mark.slow
def test_damaged_shards_are_computed_again(tmp_path: Path, uninterrupted: dict[str, bytes]) -> None:
    path = tmp_path / "run"
    assert end(start(path, program=PROGRAM + after_units(signal.SIGKILL, 6) + MAIN))[0] < 0
    cut, changed, emptied = shards(path)[:3]
    cut.write_bytes(cut.read_bytes()[:-100])
    content = bytearray(changed.read_bytes())
    content[len(content) // 2] ^= 1
    changed.write_bytes(content)
    emptied.write_bytes(b"")
    assert end(start(path)) == (0, "")
    assert results(path) == uninterrupted


# Kills itself before the n-th change of the file system, for every n: files opened to be written,
# renamed or removed, folders made or removed. Forks, because a start of Python takes longer.
AT_ANY_MOMENT = (
    PROGRAM
    + """
import os, signal, shutil
import filelock, importlib.metadata, platform

# A kill leaves the caches of the system alone, so flushing them only takes time here.
os.fsync = lambda descriptor: None
CHANGES = {"os.rename", "os.remove", "os.mkdir", "os.rmdir"}


def in_child(task):
    pid = os.fork()
    if pid == 0:
        code = 1
        try:
            task()
            code = 0
        except DriftwalkError as error:
            print(error, file=sys.stderr)
        finally:
            os._exit(code)
    return os.waitpid(pid, 0)[1]


def killed_at(count, path, task):
    left = count

    def hook(event, arguments):
        nonlocal left
        writes = event == "open" and (arguments[2] or 0) & (os.O_WRONLY | os.O_RDWR)
        if (writes or event in CHANGES) and str(arguments[0]).startswith(path):
            left -= 1
            if left < 0:
                os.kill(os.getpid(), signal.SIGKILL)

    def watched():
        sys.addaudithook(hook)
        task()

    return in_child(watched)


def bytes_of(path):
    names = ("trajectory.bin", "figures/refined.bin")
    return [open(os.path.join(path, name), "rb").read() for name in names]


folder, mode = sys.argv[1], sys.argv[2]
expected = []
for seed in (1, 2):
    compute(os.path.join(folder, f"expected-{seed}"), seed, units=2)
    expected.append(bytes_of(os.path.join(folder, f"expected-{seed}")))
kills = 0
while True:
    path = os.path.join(folder, f"run-{kills}")
    if mode == "overwrite":
        shutil.copytree(os.path.join(folder, "expected-1"), path)
    task = lambda: compute(path, 2, mode, units=2)
    status = killed_at(kills, path, task)
    if status == 0:
        break
    assert os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGKILL, (kills, status)
    kills += 1
    finished = os.path.exists(os.path.join(path, "manifest.json"))
    if mode == "overwrite" or not finished:
        assert in_child(task) == 0, f"kill {kills}: cannot be repeated"
    assert bytes_of(path) == expected[1], f"kill {kills}: other numbers"
    if mode == "overwrite":
        previous = os.path.join(path, "previous")
        found = [os.path.join(previous, name) for name in os.listdir(previous)]
        whole = [p for p in found if os.path.exists(os.path.join(p, "manifest.json"))]
        assert expected[0] in [bytes_of(p) for p in whole], f"kill {kills}: old results lost"
print(kills)
"""
)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["resume", "overwrite"])
@pytest.mark.skipif(sys.platform == "win32", reason="needs fork and SIGKILL")
def test_killed_at_every_change_of_the_file_system(tmp_path: Path, mode: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", AT_ANY_MOMENT, str(tmp_path), mode],
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    # Fewer would mean that the hook did not see the changes.
    assert int(done.stdout) > 30


def test_results_are_the_numbers(uninterrupted: dict[str, bytes]) -> None:
    """The oracle draws the same numbers without the engine."""
    scale = np.linspace(1.0, 2.0, 2 * UNITS)
    draws = np.array([np.random.default_rng([1, i]).normal(size=64) for i in range(2 * UNITS)])
    assert uninterrupted["trajectory.bin"] == (draws * scale[:, None]).tobytes()


@pytest.mark.slow
def test_manifest_of_a_resumed_run(tmp_path: Path) -> None:
    path = tmp_path / "run"
    assert end(start(path, program=PROGRAM + after_units(signal.SIGKILL, 2) + MAIN))[0] < 0
    assert end(start(path)) == (0, "")
    values = read_manifest(path / "manifest.json")
    assert values["seeds"] == {"calibration": 1}
    assert [f["path"] for f in values["files"]] == ["figures/refined.bin", "trajectory.bin"]
