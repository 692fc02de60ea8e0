"""Runs on workers in other processes and in jobs of Slurm: the same bytes, come what may."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
import slurm
from command_line import (
    FLOW,
    GRID,
    NO_FIGURES,
    Done,
    apart,
    end,
    here,
    leave_out_figures,
    refusal,
    start,
)

import driftwalk as dw
from driftwalk.sweep import ShardStore, WorkUnit, grid, run_sweep
from driftwalk.sweep.workers import HANDOUT
from driftwalk.viewer.watch.run_page import RunSource

pytestmark = pytest.mark.slow
if find_spec("distributed") is None:  # found, not loaded: that takes a second of every run
    pytest.skip("workers need driftwalk[cluster]", allow_module_level=True)

ROOT = Path(__file__).resolve().parents[3]
# Some seconds of computing in ten or so units, without figures and film.
RUNS = 800
ASSEMBLE = ("assemble", "--flow", FLOW, "--runs", RUNS, "--film", "none")


def driftwalk(*arguments: object, **options: object) -> Done:
    """Run the command line in a process of its own, as a user does."""
    return apart(*arguments, before=NO_FIGURES, **options)


def done(finished: Done) -> str:
    assert finished.code == 0, finished.err
    assert "Traceback" not in finished.err
    return finished.err


@pytest.fixture(scope="module")
def at_home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("home") / "run"
    with pytest.MonkeyPatch.context() as patch:
        leave_out_figures(patch)
        done(here(*ASSEMBLE, "-o", folder))
    return folder


def shards_of(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.rglob("*.npz"))}


def same_results(one: Path, other: Path) -> None:
    names = sorted(path.name for path in one.glob("*.nc"))
    assert names
    for name in names:
        assert (one / name).read_bytes() == (other / name).read_bytes(), name
    assert shards_of(one) == shards_of(other)


# Sweeps of plain Python, in a process of its own: workers are told apart by their numbers.
SWEEP = """
import os, signal, sys, threading, time
from pathlib import Path
import numpy as np
from driftwalk.cluster import connect, parse_address
from driftwalk.core.errors import ClusterError
from driftwalk.sweep import ShardStore, SweepError, grid, run_sweep

SECONDS = float(os.environ.get("UNIT_SECONDS", "0.3"))

class Squares:
    def __init__(self, fatal):
        self.fatal, self.seconds = fatal, SECONDS
    def __call__(self, unit):
        time.sleep(self.seconds)
        if unit.start == self.fatal:
            os.kill(os.getpid(), signal.SIGKILL)
        return {"square": unit.settings["a"] ** 2}

def kill_one(pids):
    time.sleep(1.0)
    os.kill(pids[0], signal.SIGKILL)

def main(mode, folder, address="local:2", *options):
    store = ShardStore(Path(folder), fingerprint={"sweep": "squares"})
    units = grid(a=np.arange(16.0)).units(1)
    with connect(parse_address(address, options)) as cluster:
        client = cluster.executor.client
        if mode == "killed":
            pids = list(client.run(os.getpid).values())
            threading.Thread(target=kill_one, args=(pids,)).start()
        fatal = 3 if mode == "fatal" else -1
        if mode == "gone":
            threading.Timer(1.5, client.cluster.close).start()
        try:
            found = run_sweep(Squares(fatal), units, store=store, executor=cluster.executor)
            print("SUM", found["square"].sum(), cluster.report())
        except (SweepError, ClusterError) as error:
            print("ERROR", error)

if __name__ == "__main__":
    main(*sys.argv[1:])
"""


def sweep(
    mode: str, folder: Path, *address: object, environment: Mapping[str, str] | None = None
) -> str:
    script = folder.parent / f"{folder.name}.py"
    script.write_text(SWEEP)
    found = subprocess.run(
        [sys.executable, str(script), mode, str(folder), *map(str, address)],
        env=None if environment is None else dict(environment),
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert found.returncode == 0, found.stderr
    return found.stdout


def sum_at_home(folder: Path) -> float:
    """Make the same sweep in this process, from where it was left; return its sum."""

    def squares(unit: WorkUnit) -> dict[str, np.ndarray]:
        return {"square": unit.settings["a"] ** 2}

    store = ShardStore(folder, fingerprint={"sweep": "squares"})
    return float(run_sweep(squares, grid(a=np.arange(16.0)).units(1), store=store)["square"].sum())


def test_a_worker_killed_in_mid_unit_changes_nothing(tmp_path: Path) -> None:
    said = sweep("killed", tmp_path / "killed")
    assert said.startswith("SUM 1240.0 1 worker was lost")
    assert sum_at_home(tmp_path / "home") == 1240.0
    assert shards_of(tmp_path / "killed") == shards_of(tmp_path / "home")


def test_a_unit_that_kills_every_worker_is_named_and_the_rest_kept(tmp_path: Path) -> None:
    # Dask gives up a worker that takes longer than this to come back; on a loaded machine some take
    # longer than the usual 15 s. Others take its place.
    environment = {
        **os.environ,
        "DASK_DISTRIBUTED__DEPLOY__LOST_WORKER_TIMEOUT": "1s",
        "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "1",
    }
    said = sweep("fatal", tmp_path / "fatal", environment=environment)
    assert said.startswith("ERROR unit 00000003-00000004")
    assert "ended all 2 workers" in said
    # Suspects too are all others that these workers held, on a loaded machine one of them alone.
    # They were still to be tried alone.
    held = 2 * HANDOUT.for_each_worker
    kept = shards_of(tmp_path / "fatal")
    assert 16 - held <= len(kept) < 16
    assert "00000003-00000004.npz" not in kept
    # At home, where nothing kills it, the sweep goes on from there.
    assert sum_at_home(tmp_path / "fatal") == 1240.0


def test_without_a_scheduler_the_run_ends_and_goes_on_later(tmp_path: Path) -> None:
    said = sweep("gone", tmp_path / "gone")
    assert said.startswith("ERROR the scheduler of the workers is gone")
    assert 0 < len(shards_of(tmp_path / "gone")) < 16
    assert sum_at_home(tmp_path / "gone") == 1240.0


@pytest.mark.usefixtures("no_figures")
def test_a_client_that_is_killed_goes_on_at_home(at_home: Path, tmp_path: Path) -> None:
    """The live page follows it until then; what two workers made of it has the same bytes."""
    folder, said = tmp_path / "run", tmp_path / "said"
    # To a file: workers hold a pipe open for as long as they live.
    with said.open("w") as stderr, start(
        *(*ASSEMBLE, "--cluster", "local:2", "-o", folder),
        before=NO_FIGURES, stdout=subprocess.DEVNULL, stderr=stderr,
    ) as client:  # fmt: skip
        wait_for_shards(folder, client)
        page = RunSource(folder).greeting()[0]["page"]
        while not page["state"]["progress"] and client.poll() is None:
            page = RunSource(folder).greeting()[0]["page"]
        client.send_signal(signal.SIGKILL)
    assert "2 workers at local:2, dashboard http://" in said.read_text(encoding="utf-8")
    kept = len(shards_of(folder))
    assert 0 < kept < 16
    assert page["title"] == "Self-assembly under way"
    assert 0.0 < page["state"]["progress"] < 0.95
    (bars,) = page["sections"]
    assert 0 < bars["runs"] < RUNS
    assert bars["series"][0]["items"]
    done(here(*ASSEMBLE, "-o", folder))
    same_results(at_home, folder)


def wait_for_shards(folder: Path, client: subprocess.Popen[str]) -> None:
    end = time.monotonic() + 120.0
    while not shards_of(folder):
        assert client.poll() is None, client.communicate()
        assert time.monotonic() < end
        time.sleep(0.02)


@contextmanager
def dask(part: str, *words: object, **environment: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run ``dask scheduler`` or ``dask worker``."""
    line = [sys.executable, "-m", f"distributed.cli.dask_{part}", *map(str, words)]
    with subprocess.Popen(
        line,
        env={**os.environ, **environment},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as process:
        try:
            yield process
        finally:
            process.terminate()


# Loaded by a worker before it begins: its simulations end a last bit away from those of others.
OTHER_BITS = """
from importlib import import_module
import driftwalk.simulation.run as run
# The package has a function of this name too.
probe = import_module("driftwalk.cluster.connect")

def off(*study, **options):
    found = run.simulate(*study, **options)
    found["x"].values[-1, -1] *= 1.0 + 2.0**-23
    return found

probe.simulate = off
"""


def test_workers_with_other_numbers_are_refused(at_home: Path, tmp_path: Path) -> None:
    """Of another version, with both named; with other bits; those of the same are taken."""
    older = tmp_path / "older" / "driftwalk-0.0.9.dist-info"
    older.mkdir(parents=True)
    (older / "METADATA").write_text("Metadata-Version: 2.1\nName: driftwalk\nVersion: 0.0.9\n")
    (tmp_path / "other_bits.py").write_text(OTHER_BITS)
    file = tmp_path / "scheduler.json"
    worker = ("--scheduler-file", file, "--nthreads", 1, "--no-dashboard", "--no-nanny")
    with dask("scheduler", "--scheduler-file", file, "--port", 0, "--no-dashboard"):
        end = time.monotonic() + 60.0
        while not file.exists():
            assert time.monotonic() < end
            time.sleep(0.1)
        address = json.loads(file.read_text())["address"]
        run = (*ASSEMBLE, "--cluster", address, "-o", tmp_path / "run")
        with dask("worker", *worker, PYTHONPATH=str(older.parent)):
            said = refusal(driftwalk(*run))
            assert re.search(r"the worker tcp://\S+ has driftwalk 0\.0\.9", said)
            assert f"this machine has {version('driftwalk')}" in said
        with dask("worker", *worker, "--preload", tmp_path / "other_bits.py"):
            said = refusal(driftwalk(*run))
            assert re.search(r"the worker tcp://\S+ computes other numbers", said)
        assert not (tmp_path / "run").exists()
        with dask("worker", *worker):
            done(driftwalk(*run))
    same_results(at_home, tmp_path / "run")


@pytest.fixture(scope="module")
def real_slurm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Mapping[str, str]]:
    """Return the environment of a Slurm of one node."""
    why = slurm.why_not()
    if why:
        pytest.skip(why)
    with slurm.slurm(tmp_path_factory.mktemp("slurm")) as environment:
        yield environment


def of_jobs(folder: Path, **more: str) -> list[str]:
    options = {
        "queue": "debug", "memory": "1GB", "interface": "lo", "walltime": "00:10:00",
        "log_directory": str(folder / "logs"), **more,
    }  # fmt: skip
    return [f"{name}={value}" for name, value in options.items()]


def test_jobs_of_a_real_slurm_give_the_same_bytes(
    real_slurm: Mapping[str, str], at_home: Path, tmp_path: Path
) -> None:
    """Two jobs, one of them cancelled in the middle."""
    given = [f"--cluster-option={one}" for one in of_jobs(tmp_path)]
    line = (*ASSEMBLE, "--cluster", "slurm:2", *given, "-o", tmp_path / "run")
    with start(*line, before=NO_FIGURES, env=real_slurm) as client:
        wait_for_shards(tmp_path / "run", client)
        jobs = subprocess.run(
            ["squeue", "-h", "-o", "%i"], env=real_slurm, capture_output=True, text=True
        ).stdout.split()
        subprocess.run(["scancel", jobs[0]], env=real_slurm, check=True)
        found = end(client)
    done(found)
    same_results(at_home, tmp_path / "run")


def test_the_array_of_jobs_on_the_page_calibrates_every_recording(
    real_slurm: Mapping[str, str], tmp_path: Path
) -> None:
    page = (ROOT / "docs/how-to/use-a-cluster.md").read_text(encoding="utf-8")
    [script] = [text for text in re.findall(r"```text\n(.*?)```", page, re.S) if "--array" in text]
    quick = "--study grid.toml --flow flow.csv"
    for old, new in {
        "--array=0-99": "--array=0-1",
        "--cpus-per-task=2": "--cpus-per-task=1",
        "~/driftwalk/bin/driftwalk calibrate": f"{sys.executable} -m driftwalk calibrate {quick}",
    }.items():
        assert old in script
        script = script.replace(old, new)
    (tmp_path / "many.sh").write_text(script, encoding="utf-8")
    shutil.copy(FLOW, tmp_path / "flow.csv")
    (tmp_path / "grid.toml").write_text(GRID, encoding="utf-8")
    (tmp_path / "recordings").mkdir()
    for name, part in {"first": slice(0, 1200), "with a space": slice(1200, 2400)}.items():
        recording = dw.tank30_recording().isel(time=part)
        recording.to_netcdf(tmp_path / "recordings" / f"{name}.nc")
    subprocess.run(["sbatch", "many.sh"], cwd=tmp_path, env=real_slurm, check=True)
    late = time.monotonic() + 120.0
    while subprocess.check_output(["squeue", "-h"], env=real_slurm):
        assert time.monotonic() < late, "the jobs have not ended"
        time.sleep(0.2)
    found = sorted(path.parent.name for path in tmp_path.glob("runs/*/calibration.nc"))
    assert found == ["first", "with a space"]


def test_jobs_whose_time_is_over_are_asked_for_again(
    real_slurm: Mapping[str, str], tmp_path: Path
) -> None:
    """Workers end after 10 s by themselves, as before a walltime; the sweep takes longer."""
    ends = of_jobs(tmp_path, worker_extra_args='["--lifetime", "10s"]')
    said = sweep(
        "quiet", tmp_path / "run", "slurm:2", *ends,
        environment={**real_slurm, "UNIT_SECONDS": "1.6"},
    )  # fmt: skip
    assert re.match(r"SUM 1240\.0 .*\d workers? (ended|was lost|were lost)", said), said
    assert len(shards_of(tmp_path / "run")) == 16
