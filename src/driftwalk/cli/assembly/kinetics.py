"""`driftwalk kinetics`: how fast blocks assemble, and by which steps."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from driftwalk.cli.options.flatten_options import with_options
from driftwalk.cli.options.run import RunOptions
from driftwalk.cli.options.shared_types import PANEL, argument, optional
from driftwalk.core.errors import InputError

if TYPE_CHECKING:
    import xarray as xr


@with_options(RunOptions, "out", "cluster", "cluster_options", "overwrite", "json")
def kinetics(
    sources: Annotated[
        list[Path],
        argument(
            "SOURCE [OTHER]",
            "Run of driftwalk assemble, file of driftwalk classify, or a folder of such files; a "
            "second one is compared.",
        ),
    ],
    target: str | None = optional("--target CLASS", "Outcome class to be reached, such as T."),
    blocks: int | None = optional(
        "--blocks N", "Extrapolate the rate of the first join to another number.", min=2
    ),
    seed: int = optional(
        "--seed N", "Seed of the bootstrap and of the permutations.", panel=PANEL, min=0, default=1
    ),
    *,
    options: RunOptions,
) -> None:
    """Estimate the rates between the outcome classes of runs or recordings.

    Fits a Markov chain, a semi-Markov chain and chains with hidden states, and chooses one on runs
    that were held out. Says whether the tank is well mixed, predicts the shares of the classes over
    time and, with --target, how surely and how soon a class is reached.
    """
    from driftwalk.runs import KineticsWork

    if len(sources) > 2:
        raise InputError(f"two sources can be compared, got {len(sources)}: name files in a folder")
    files = [files_of(source) for source in sources]
    work = KineticsWork(
        [[opened_histories(path) for path in paths] for paths in files],
        target=target,
        blocks=blocks,
        seed=seed,
        inputs={
            f"source {at} file {number}": path
            for at, paths in enumerate(files, start=1)
            for number, path in enumerate(paths, start=1)
        },
    )
    options.answer(work, "kinetics")


def files_of(source: Path) -> list[Path]:
    """Return the files of a source: the assembly of a run, or all classifications of a folder."""
    from driftwalk.core.files.run_layout import state_of
    from driftwalk.schema.runs import run_kind

    if source.is_file():
        return [source]
    if not source.is_dir():
        raise InputError(f"{source} does not exist")
    state = state_of(source)
    if state == "unfinished":
        raise InputError(f"{source} holds a run that is not finished: run its command again")
    path = source / run_kind("assembly").file
    if path.is_file():
        return [path]
    found = sorted(source.glob("*.nc")) if state == "new" else []
    if not found:
        raise InputError(
            f"{source} holds no assembly: give a run of driftwalk assemble, or files of "
            "driftwalk classify (-o events.nc)"
        )
    return found


def opened_histories(path: Path) -> xr.Dataset:
    """Return the dataset of a file that holds outcome classes over time."""
    from driftwalk.schema.check import check_contents, require_kind
    from driftwalk.schema.stores.netcdf import open_netcdf

    found = require_kind(
        open_netcdf(path),
        "assembly classification",
        otherwise=f"{path} holds no outcome classes over time: give a run of driftwalk assemble, "
        f"or classify the recording first (driftwalk classify {path} -o events.nc)",
    )
    return check_contents(found, path)
