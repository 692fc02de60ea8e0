"""The options that have a run computed by workers elsewhere, and the workers for its time."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated, Any, NamedTuple

import typer

from driftwalk.cli.terminal.output import print_note
from driftwalk.cli.terminal.progress import reported
from driftwalk.core.errors import ConfigurationError

ClusterAt = Annotated[
    str | None,
    typer.Option(
        "--cluster",
        metavar="local:N|tcp://HOST:PORT|slurm:N",
        help="Workers: N processes on this machine, a Dask scheduler, or N jobs of slurm (pbs, "
        "sge, lsf, oar, moab, htcondor). Needs driftwalk[cluster].",
        show_default=False,
    ),
]
ClusterOptions = Annotated[
    list[str] | None,
    typer.Option(
        "--cluster-option",
        metavar="NAME=VALUE",
        help="Option passed to dask-jobqueue, such as queue=short or walltime=02:00:00; repeat for "
        "others.",
        show_default=False,
    ),
]


class Workers(NamedTuple):
    """The workers that the command line asks for."""

    at: str | None
    options: list[str] | None

    @contextmanager
    def reported(self, title: str) -> Iterator[dict[str, Any]]:
        """Give a run its progress bar, the command line for its manifest, and its executor.

        Parameters
        ----------
        title : str
            What is being done.

        Raises
        ------
        ConfigurationError
            When the workers' address is none, or options are given without one.
        """
        if self.at is None:
            if self.options:
                raise ConfigurationError("--cluster-option belongs to --cluster")
            with reported(title) as told:
                yield told
            return
        from driftwalk.cluster import connect, parse_address

        with connect(parse_address(self.at, self.options or ()), say=print_note) as cluster:
            try:
                with reported(title) as told:
                    told["progress"].remark = lambda: cluster.words
                    yield {**told, "executor": cluster.executor}
            finally:
                befell = cluster.report()
                if befell:
                    print_note(befell)
