"""What is handed to Slurm, PBS and their like: the script of a job, which needs no scheduler.

dask-jobqueue writes the script when it is asked for, so that its words can be read where no such
scheduler is. Only that of Slurm is submitted to a real one (tests/integration/cli).
"""

from __future__ import annotations

import asyncio
import importlib
import re
from collections.abc import Iterator
from typing import Any

import pytest

from driftwalk.cluster import parse_address
from driftwalk.cluster.address import JOB_SYSTEMS, job_class, job_options

pytest.importorskip("dask_jobqueue", reason="jobs need driftwalk[cluster]")

GIVEN = ["queue=short", "walltime=02:00:00", "memory=3GB", "cores=2"]
WORDS = {
    "slurm": ["#SBATCH -p short", "#SBATCH -t 02:00:00", "#SBATCH --cpus-per-task=2"],
    "pbs": ["#PBS -q short", "walltime=02:00:00", "ncpus=2"],
    "sge": ["#$ -q short", "h_rt=02:00:00"],
    "lsf": ["#BSUB -q short", "#BSUB -W 02:00", "#BSUB -n 2"],
    "oar": ["#OAR -q short", "walltime=02:00:00", "core=2"],
    "moab": ["#PBS -q short", "walltime=02:00:00"],
}
"""Queue and time as the manual of each scheduler has them."""


@pytest.fixture
def loop() -> Iterator[None]:
    """Give the event loop that dask-jobqueue looks for when a job is described."""
    made = asyncio.new_event_loop()
    asyncio.set_event_loop(made)
    yield
    asyncio.set_event_loop(None)
    made.close()


def script(system: str, given: list[str]) -> str:
    """Return the script of one job of a cluster that is described, not begun."""
    options: dict[str, Any] = job_options(parse_address(f"{system}:3", given))
    job = job_class(system).job_cls("tcp://10.0.0.1:8786", name="0", **options)
    return str(job.job_script())


@pytest.mark.parametrize("system", sorted(WORDS))
@pytest.mark.usefixtures("loop")
def test_the_script_of_a_job_has_queue_time_and_one_thread_a_worker(system: str) -> None:
    text = script(system, GIVEN)
    for words in WORDS[system]:
        assert words in text
    assert "driftwalk" in text
    command = next(line for line in text.splitlines() if "dask" in line and "tcp://" in line)
    assert re.search(r"--nthreads 1\b", command)
    assert re.search(r"--nworkers 2\b", command)
    assert re.search(r"--lifetime 6840s\b", command)
    # A worker whose scheduler is gone ends by itself, so that no job is left behind.
    assert re.search(r"--death-timeout \d+", command)


@pytest.mark.usefixtures("loop")
def test_the_script_of_htcondor_asks_for_its_processors() -> None:
    text = script("htcondor", ["cores=2", "memory=3GB", "disk=1GB"])
    assert "RequestCpus = MY.DaskWorkerCores" in text
    assert re.search(r"^MY.DaskWorkerCores = 2$", text, re.MULTILINE)
    assert "--nthreads 1" in text


@pytest.mark.parametrize("system", sorted(JOB_SYSTEMS))
def test_every_system_has_its_class(system: str) -> None:
    module = importlib.import_module("dask_jobqueue")
    assert job_class(system) is getattr(module, JOB_SYSTEMS[system])
    assert job_class(system).__name__.lower() == f"{system}cluster"
