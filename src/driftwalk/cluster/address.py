"""Where workers are: ``local:4``, ``tcp://host:8786``, or jobs of Slurm and its like."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from driftwalk.core.errors import ClusterError, ConfigurationError, InputError, did_you_mean

JOB_SYSTEMS: Final = {
    "slurm": "SLURMCluster", "pbs": "PBSCluster", "sge": "SGECluster", "lsf": "LSFCluster",
    "oar": "OARCluster", "moab": "MoabCluster", "htcondor": "HTCondorCluster",
}  # fmt: skip
"""Job systems by the name of their class in dask-jobqueue."""
SCHEDULER: Final = ("tcp", "tls", "ucx", "ws", "wss")
"""Protocols of a scheduler's address."""
FORMS: Final = "local:4, tcp://host:8786, or slurm:8 (pbs, sge, lsf, oar, moab, htcondor likewise)"


@dataclass(frozen=True)
class ClusterAddress:
    """Where workers are, or how they are begun.

    Attributes
    ----------
    kind : str
        ``"local"``, ``"scheduler"``, or the name of a job system.
    workers : int
        Worker processes, or jobs; 0 for a scheduler, which has its own.
    url : str
        Of a scheduler.
    options : mapping
        Keywords for dask-jobqueue.
    """

    kind: str
    workers: int
    url: str
    options: Mapping[str, Any]

    @property
    def words(self) -> str:
        """Its name in a message."""
        return self.url or f"{self.kind}:{self.workers}"


def parse_address(text: str, options: Sequence[str] = ()) -> ClusterAddress:
    """Return what a text such as ``slurm:8`` means.

    Parameters
    ----------
    text : str
        ``local:N``, the address of a Dask scheduler, or a job system with the number of jobs.
    options : sequence of str
        ``NAME=VALUE`` each, for dask-jobqueue. A value that is JSON (a number, true, a list) is
        taken as that, others as text.

    Raises
    ------
    ConfigurationError
        When it is none of these, or an option has no value or no use.

    Examples
    --------
    >>> parse_address("slurm:8", ["queue=short", "cores=1"]).options
    {'queue': 'short', 'cores': 1}
    """
    given = dict(_option(one) for one in options)
    protocol, separator, rest = text.partition("://")
    if separator and protocol in SCHEDULER and rest:
        _refuse_options(given, "a scheduler that is there")
        return ClusterAddress("scheduler", 0, text, {})
    kind, _, count = text.partition(":")
    if kind == "local":
        _refuse_options(given, "worker processes of this machine")
        return ClusterAddress(kind, _whole(text, count or "0"), "", {})
    if kind in JOB_SYSTEMS:
        return ClusterAddress(kind, _whole(text, count or "4"), "", given)
    hint = did_you_mean(kind, ["local", *JOB_SYSTEMS])
    raise ConfigurationError(f"workers are {FORMS}; got '{text}'{hint}")


def _option(text: str) -> tuple[str, Any]:
    name, separator, value = text.partition("=")
    name = name.strip().replace("-", "_")
    if not separator or not name.isidentifier():
        raise ConfigurationError(
            f"an option of jobs is NAME=VALUE, such as queue=short; got '{text}'"
        )
    try:
        return name, json.loads(value)
    except ValueError:
        return name, value


def _whole(text: str, count: str) -> int:
    if not count.isdecimal() or int(count) < 1:
        raise ConfigurationError(f"workers are {FORMS}; got '{text}' without a number above 0")
    return int(count)


def _refuse_options(options: Mapping[str, Any], where: str) -> None:
    if options:
        raise ConfigurationError(
            f"the option {next(iter(options))} is for jobs of slurm, pbs and the like, not "
            f"for {where}"
        )


LIFETIME: Final = "-" * 2 + "lifetime"
"""The worker's own option for the time after which it ends by itself. Its dashes stand apart, as
messages must name no option of the command line, and this is none of driftwalk's."""
OAR_MEMORY: Final = "memory_per_core_property_name"
"""Under which name a site of OAR counts memory."""


def begin_jobs(address: ClusterAddress) -> Any:
    """Submit jobs and return dask-jobqueue's cluster; a job that is lost is submitted again.

    Options that are not given come from the site's own configuration of dask-jobqueue, otherwise a
    job has one core and 2 GB.

    Raises
    ------
    InputError
        When dask-jobqueue is not installed.
    ConfigurationError
        When it does not know an option.
    ClusterError
        When a job cannot be submitted.
    """
    kind = job_class(address.kind)
    command = str(kind.job_cls.submit_command).split()[0]
    if shutil.which(command) is None:
        raise ClusterError(
            f"{address.words}: there is no command {command} here; run driftwalk where "
            f"jobs of {address.kind} are submitted"
        )
    try:
        begun = kind(**job_options(address))
    except (TypeError, ValueError) as error:
        raise ConfigurationError(
            f"{address.words}: {_line(error)}; the options are those of "
            f"dask_jobqueue.{JOB_SYSTEMS[address.kind]}"
        ) from error
    try:
        begun.adapt(minimum_jobs=address.workers, maximum_jobs=address.workers)
    except (OSError, RuntimeError) as error:
        begun.close()
        raise ClusterError(
            f"no job could be submitted to {address.kind}: {_line(error)}"
        ) from error
    return begun


def job_class(system: str) -> Any:
    """Return dask-jobqueue's class of clusters of a job system.

    Raises
    ------
    InputError
        When dask-jobqueue is not installed.

    Examples
    --------
    >>> job_class("slurm").__name__
    'SLURMCluster'
    """
    try:
        import dask_jobqueue
    except ImportError as error:
        raise InputError(
            "jobs need dask-jobqueue, which is not installed: pip install 'driftwalk[cluster]'"
        ) from error
    return getattr(dask_jobqueue, JOB_SYSTEMS[system])


def job_options(address: ClusterAddress) -> dict[str, Any]:
    """Return the keywords of dask-jobqueue: one thread for each worker, an end before the walltime.

    Examples
    --------
    >>> hour = ClusterAddress("slurm", 2, "", {"walltime": "01:00:00"})
    >>> job_options(hour)["worker_extra_args"][1]
    '3420s'
    """
    import dask

    options = dict(address.options)

    def site(name: str) -> Any:
        return dask.config.get(f"jobqueue.{address.kind}.{name}", None)

    cores = int(options.setdefault("cores", site("cores") or 1))
    options.setdefault("processes", cores)
    options.setdefault("memory", site("memory") or "2GB")
    options.setdefault("job_name", "driftwalk")
    if address.kind == "oar" and site(OAR_MEMORY) is None:
        # Sites name it as they like; where nothing says how, memory is not asked for.
        options.setdefault(OAR_MEMORY, "not_applicable")
    walltime = options.get("walltime") or site("walltime")
    seconds = _seconds(str(walltime)) if walltime else None
    if seconds is not None and "worker_extra_args" not in options:
        # A worker ends by itself before its walltime is over: the scheduler then knows, and the
        # unit is not lost.
        lifetime = seconds - max(int(0.05 * seconds), 60)
        if lifetime > 0:
            options["worker_extra_args"] = [LIFETIME, f"{lifetime}s"]
    return options


def _seconds(walltime: str) -> int | None:
    """Return a walltime such as 02:00:00 or 1-00:00:00 in seconds; None where it is no such."""
    found = re.fullmatch(r"(?:(\d+)-)?(\d+):(\d\d)(?::(\d\d))?", walltime)
    if found is None:
        return None
    days, hours, minutes, seconds = (int(part or 0) for part in found.groups())
    return ((24 * days + hours) * 60 + minutes) * 60 + seconds


def _line(error: BaseException) -> str:
    return " ".join(str(error).split())[:300]
