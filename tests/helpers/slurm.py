"""A real Slurm on this machine: one node, no systemd, all files in a folder of its own."""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

PROGRAMS = ("slurmctld", "slurmd", "munged", "sbatch", "scancel", "sinfo")
CONFIGURATION = """\
ClusterName=test
SlurmctldHost=localhost
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/ctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/ctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerType=sched/backfill
ReturnToService=2
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
KillWait=2
NodeName=localhost CPUs={cpus} RealMemory=8000 State=UNKNOWN
PartitionName=debug Nodes=localhost Default=YES MaxTime=INFINITE State=UP OverSubscribe=FORCE:4
"""


def why_not() -> str:
    """Return why there can be no Slurm here; nothing where there can."""
    if os.geteuid() != 0:
        return "a Slurm of one's own needs root"
    missing = [name for name in PROGRAMS if shutil.which(name) is None]
    return f"not installed: {', '.join(missing)} (slurmctld slurmd munge)" if missing else ""


@contextmanager
def slurm(folder: Path) -> Iterator[dict[str, str]]:
    """Begin a Slurm, and give the environment in which its commands find it."""
    for name in ("state", "spool"):
        (folder / name).mkdir(parents=True)
    cpus = os.cpu_count() or 1
    (folder / "slurm.conf").write_text(CONFIGURATION.format(folder=folder, cpus=cpus))
    environment = {**os.environ, "SLURM_CONF": str(folder / "slurm.conf")}
    munge = Path("/run/munge")
    munge.mkdir(exist_ok=True)
    shutil.chown(munge, "munge", "munge")
    subprocess.run(["runuser", "-u", "munge", "--", "munged", "--force"], check=False)
    try:
        subprocess.run(["slurmctld"], env=environment, check=True)
        subprocess.run(["slurmd", "-N", "localhost"], env=environment, check=True)
        _await_idle(environment, folder)
        yield environment
    finally:
        for pid in (folder / "slurmd.pid", folder / "ctld.pid", munge / "munged.pid"):
            if pid.is_file():
                os.kill(int(pid.read_text()), 15)


def _await_idle(environment: dict[str, str], folder: Path) -> None:
    end = time.monotonic() + 30.0
    while time.monotonic() < end:
        shown = subprocess.run(
            ["sinfo", "-h", "-o", "%t"], env=environment, capture_output=True, text=True
        )
        if shown.stdout.strip() in ("idle", "mix"):
            return
        time.sleep(0.3)
    logs = "\n".join(path.read_text()[-2000:] for path in folder.glob("*.log"))
    raise AssertionError(f"Slurm has no idle node after 30 s: {shown.stdout}{shown.stderr}\n{logs}")
