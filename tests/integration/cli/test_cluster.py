"""Runs on workers in other processes and in jobs of Slurm: the same bytes, come what may."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import slurm
from command_line import FLOW, GRID, RECORDING

pytestmark = pytest.mark.slow
pytest.importorskip("distributed", reason="workers need driftwalk[cluster]")

ASSEMBLE = ("assemble", "--flow", FLOW, "--runs", 400, "--duration", 120, "--film", "none")


def driftwalk(
    *arguments: object, environment: dict[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run the command line in a process of its own, as a user does."""
    line = [sys.executable, "-m", "driftwalk", *map(str, arguments)]
    return subprocess.run(line, capture_output=True, text=True, env=environment, timeout=300)


def done(finished: subprocess.CompletedProcess[str]) -> str:
    assert finished.returncode == 0, finished.stderr
    assert "Traceback" not in finished.stderr
    return finished.stderr


@pytest.fixture(scope="module")
def at_home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("home") / "run"
    done(driftwalk(*ASSEMBLE, "-o", folder))
    return folder


def shards_of(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.rglob("*.npz"))}


def same_results(one: Path, other: Path) -> None:
    names = sorted(path.name for path in one.glob("*.nc"))
    assert names
    for name in names:
        assert (one / name).read_bytes() == (other / name).read_bytes(), name
    assert shards_of(one) == shards_of(other)


@pytest.mark.parametrize("workers", [1, 3])
def test_assembly_has_the_same_bytes(at_home: Path, tmp_path: Path, workers: int) -> None:
    said = done(driftwalk(*ASSEMBLE, "--cluster", f"local:{workers}", "-o", tmp_path / "run"))
    assert f"{workers} worker" in said
    same_results(at_home, tmp_path / "run")


def test_a_calibration_has_the_same_bytes(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(GRID)
    line = ("calibrate", RECORDING, "--flow", FLOW, "--study", tmp_path / "study.toml")
    done(driftwalk(*line, "-o", tmp_path / "home"))
    done(driftwalk(*line, "--cluster", "local:2", "-o", tmp_path / "there"))
    same_results(tmp_path / "home", tmp_path / "there")


# Sweeps of plain Python, in a process of its own: workers are told apart by their numbers.
SWEEP = """
import os, signal, sys, threading, time
from pathlib import Path
import numpy as np
from driftwalk.cluster import connect, parse_address
from driftwalk.core.errors import ClusterError
from driftwalk.sweep import ShardStore, SweepError, grid, run_sweep

class Squares:
    def __init__(self, fatal):
        self.fatal = fatal
    def __call__(self, unit):
        time.sleep(0.3)
        if unit.start == self.fatal:
            os.kill(os.getpid(), signal.SIGKILL)
        return {"square": unit.settings["a"] ** 2}

def kill_one(pids):
    time.sleep(1.0)
    os.kill(pids[0], signal.SIGKILL)

def main(mode, folder):
    store = ShardStore(Path(folder), fingerprint={"sweep": "squares"})
    units = grid(a=np.arange(16.0)).units(1)
    with connect(parse_address("local:2")) as cluster:
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


def sweep(mode: str, folder: Path) -> str:
    script = folder.parent / f"{folder.name}.py"
    script.write_text(SWEEP)
    found = subprocess.run(
        [sys.executable, str(script), mode, str(folder)],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert found.returncode == 0, found.stderr
    return found.stdout


def test_a_worker_killed_in_mid_unit_changes_nothing(tmp_path: Path) -> None:
    said = sweep("killed", tmp_path / "killed")
    assert said.startswith("SUM 1240.0 1 worker was lost")
    assert sweep("quiet", tmp_path / "quiet").strip() == "SUM 1240.0"
    assert shards_of(tmp_path / "killed") == shards_of(tmp_path / "quiet")


def test_a_unit_that_kills_every_worker_is_named_and_the_rest_kept(tmp_path: Path) -> None:
    said = sweep("fatal", tmp_path / "fatal")
    assert said.startswith("ERROR unit 00000003-00000004")
    assert "ended all 4 workers" in said
    kept = len(shards_of(tmp_path / "fatal"))
    assert 3 <= kept < 16
    # At home, where nothing kills it, the sweep goes on from there.
    assert "SUM 1240.0" in sweep("quiet", tmp_path / "fatal")


def test_without_a_scheduler_the_run_ends_and_goes_on_later(tmp_path: Path) -> None:
    said = sweep("gone", tmp_path / "gone")
    assert said.startswith("ERROR the scheduler of the workers is gone")
    assert 0 < len(shards_of(tmp_path / "gone")) < 16
    assert "SUM 1240.0" in sweep("quiet", tmp_path / "gone")


def test_a_client_that_is_killed_goes_on_at_home(at_home: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    line = [sys.executable, "-m", "driftwalk", *map(str, ASSEMBLE), "-o", str(folder)]
    with subprocess.Popen(
        [*line, "--cluster", "local:2"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as client:
        end = time.monotonic() + 60.0
        while not shards_of(folder) and time.monotonic() < end and client.poll() is None:
            time.sleep(0.02)
        client.send_signal(signal.SIGKILL)
    done(driftwalk(*ASSEMBLE, "-o", folder))
    same_results(at_home, folder)


@pytest.mark.skipif(bool(slurm.why_not()), reason=slurm.why_not() or "Slurm is there")
def test_jobs_of_a_real_slurm_give_the_same_bytes(at_home: Path, tmp_path: Path) -> None:
    """Two jobs, one of them cancelled in the middle."""
    with slurm.slurm(tmp_path / "slurm") as environment:
        options = {"queue": "debug", "memory": "1GB", "interface": "lo", "walltime": "00:10:00"}
        given = [f"--cluster-option={name}={value}" for name, value in options.items()]
        logs = f"--cluster-option=log_directory={tmp_path / 'logs'}"
        line = [*ASSEMBLE, "--cluster", "slurm:2", *given, logs, "-o", tmp_path / "run"]
        with subprocess.Popen(
            [sys.executable, "-m", "driftwalk", *map(str, line)],
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        ) as client:
            end = time.monotonic() + 90.0
            while not shards_of(tmp_path / "run") and time.monotonic() < end:
                assert client.poll() is None, client.communicate()
                time.sleep(0.02)
            jobs = subprocess.run(
                ["squeue", "-h", "-o", "%i"], env=environment, capture_output=True, text=True
            ).stdout.split()
            subprocess.run(["scancel", jobs[0]], env=environment, check=True)
            _, said = client.communicate(timeout=180)
        assert client.returncode == 0, said
        assert "Traceback" not in said
    same_results(at_home, tmp_path / "run")
