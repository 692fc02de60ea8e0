"""The options of a command that makes a run: its folder, and who computes it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from driftwalk.cli.options.flatten_options import option_field, with_options
from driftwalk.cli.options.shared_types import Json, Overwrite, Threads, option
from driftwalk.cli.terminal.output import print_note, print_result
from driftwalk.cli.terminal.progress import reported
from driftwalk.core.errors import ConfigurationError


@dataclass(frozen=True)
class RunOptions:
    """Where a run is kept and who computes it; the fields are the options."""

    out: Annotated[Path, option("--out -o DIR", "Run directory to make or continue.")]
    threads: Threads = None
    cluster: str | None = option_field(
        "--cluster local:N|tcp://HOST:PORT|slurm:N",
        "Workers: N processes on this machine, a Dask scheduler, or N jobs of slurm (pbs, "
        "sge, lsf, oar, moab, htcondor). Needs driftwalk[cluster].",
    )
    cluster_options: list[str] | None = option_field(
        "--cluster-option NAME=VALUE",
        "Option passed to dask-jobqueue, such as queue=short or walltime=02:00:00; repeat "
        "for others.",
    )
    overwrite: Overwrite = False
    json: Json = False

    def run(self, work: Any, title: str, **how: Any) -> Any:
        """Run a piece of work of `driftwalk.runs` in the directory, and return what it found."""
        from driftwalk.runs import run_work

        with self.reported(title) as told:
            return run_work(work, self.out, overwrite=self.overwrite, **how, **told)

    def answer(self, work: Any, title: str, **how: Any) -> None:
        """Run a piece of work whose result is one dataset, and print its answer."""
        print_result(self.run(work, title, **how), self.out, json=self.json)

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
        if self.cluster is None:
            if self.cluster_options:
                raise ConfigurationError("--cluster-option belongs to --cluster")
            with reported(title) as told:
                yield told
            return
        from driftwalk.cluster import connect, parse_address

        address = parse_address(self.cluster, self.cluster_options or ())
        with connect(address, say=print_note) as cluster:
            try:
                with reported(title) as told:
                    told["progress"].remark = lambda: cluster.words
                    yield {**told, "executor": cluster.executor}
            finally:
                report = cluster.report()
                if report:
                    print_note(report)


with_run_options = with_options(RunOptions)
"""Spreads a command's parameter of type `RunOptions` into one option per field."""
