"""Where workers are, as the command line says it: ``local:4``, ``tcp://host:8786``, ``slurm``."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from driftwalk.core.errors import ConfigurationError
from driftwalk.core.text.did_you_mean import did_you_mean

JOB_SYSTEMS: Final = {
    "slurm": "SLURMCluster", "pbs": "PBSCluster", "sge": "SGECluster", "lsf": "LSFCluster",
    "oar": "OARCluster", "moab": "MoabCluster", "htcondor": "HTCondorCluster",
}  # fmt: skip
"""Job systems by the name of their class in dask-jobqueue."""
SCHEDULER: Final = ("tcp", "tls", "ucx", "ws", "wss")
"""Protocols of a scheduler's address."""
DEFAULT_JOBS: Final = 4
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
        return ClusterAddress(kind, _whole(text, count or str(DEFAULT_JOBS)), "", given)
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
