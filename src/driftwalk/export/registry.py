"""The targets of an export, by name: simulators, data, figures.

A new one is a function that writes, and its entry here.
"""

from __future__ import annotations

import os
import secrets
import shutil
from collections.abc import Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from driftwalk.core.errors import InputError, did_you_mean
from driftwalk.core.files.atomic import PARTIAL, rename, storage_error, write_atomic
from driftwalk.core.files.run_layout import faults_of, run_file, state_of
from driftwalk.core.text_files import text_of_name
from driftwalk.export.data.targets import DATA_TARGETS
from driftwalk.export.target import Source, Target
from driftwalk.schema.check import check_contents
from driftwalk.schema.runs import StoredRun, open_run_folder
from driftwalk.schema.stores.netcdf import open_netcdf

if TYPE_CHECKING:
    import xarray as xr

FIGURES_README: Final = """\
# Figures of {source}

driftwalk {version} drew these figures from what the run stores.

Each is 90 mm or 180 mm wide, one or two columns of a journal, with letters of 7 to 8 points.{fonts}
Next to each lies a table of the same name (`.csv`) with every number that is drawn: a row per
point, with the panel, the labels of its axes, which hold the units, and the artist. The figure
names the table and its SHA-256 in its metadata.

`driftwalk cite {source}` says what to cite.
"""
FONTS: Final = {
    "pdf": "\nFonts are embedded as TrueType.",
    "svg": "\nText is stored as outlines, so that it looks the same everywhere.",
    "png": "\nThere are 300 dots per inch.",
}


def _write_figures(format: str, source: Source, folder: Path) -> list[Path]:
    from driftwalk import __version__

    files = draw_run(source.path, folder, ["csv", format])
    page = folder / "README.md"
    text = FIGURES_README.format(
        source=text_of_name(source.path), version=__version__, fonts=FONTS[format]
    )
    write_atomic(page, text.encode())
    return [*files, page]


FIGURE_TARGETS: Final = tuple(
    Target(
        name,
        f"the figures as {name.upper()}, and the numbers that they draw",
        partial(_write_figures, name),
        options=(),
    )
    for name in FONTS
)


def draw_run(run: Path, folder: Path, formats: Sequence[str]) -> list[Path]:
    """Write all figures of a run.

    Parameters
    ----------
    run : Path
        The directory of a finished run.
    folder : Path
        Where to write.
    formats : sequence of {"png", "svg", "pdf", "csv"}
        File formats; ``csv`` holds the numbers that are drawn.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    InputError
        When it is no finished run, or one without figures.

    Examples
    --------
    >>> draw_run(Path("fit"), Path("paper"), ["pdf", "csv"])  # doctest: +SKIP
    """
    from driftwalk.figures import write_figures

    if state_of(run) != "finished":
        raise InputError(f"{run} is not the directory of a finished run, so it has no figures")
    stored = _CheckedRun(**vars(open_run_folder(run)))
    if stored.kind is None or stored.kind.figures is None:
        raise InputError(f"{run} is a run without figures")
    table = stored.make(stored.kind, stored.kind.figures, lacking="its figures cannot be drawn")
    return write_figures(table, folder, formats)


class _CheckedRun(StoredRun):
    """A run of which a damaged dataset ends the work instead of being left out."""

    def dataset(self, name: str) -> xr.Dataset | None:
        path = run_file(self.folder, name)
        return None if path is None else check_contents(open_netcdf(path), path)


def _simulator(name: str, gives: str) -> Target:
    """Return the target whose module is `driftwalk.export.simulators` NAME."""

    # Help answers at once: a simulator's module is imported when it is used.
    def call(function: str, *arguments: Any) -> Any:
        return getattr(import_module(f"driftwalk.export.simulators.{name}"), function)(*arguments)

    write, verify, require = (partial(call, one) for one in ("write", "verify", "require"))
    return Target(name, gives, write, verify, require)


TARGETS: Final = {
    target.name: target
    for target in (
        _simulator("mujoco", "the tank as MJCF, the water as a Python module, and verify.py"),
        _simulator("webots", "a world, a PROTO and a physics plugin in C"),
        _simulator("gazebo", "a world and a system plugin in C++"),
        *DATA_TARGETS,
        *FIGURE_TARGETS,
    )
}
"""Every target by its name, in the order of the help."""


def target_named(name: str) -> Target:
    """Return a target.

    Raises
    ------
    InputError
        When there is none of this name; the message lists them.

    Examples
    --------
    >>> target_named("gazebo").gives
    'a world and a system plugin in C++'
    """
    if name in TARGETS:
        return TARGETS[name]
    raise InputError(
        f"there is no export to '{name}'{did_you_mean(name, TARGETS)}; "
        f"what can be made: {', '.join(TARGETS)}"
    )


def export_run(source: Source, target: Target, folder: Path) -> list[Path]:
    """Write an export into a folder, whole or not at all, and return its files.

    Parameters
    ----------
    source : Source
        What is exported.
    target : Target
        To what.
    folder : Path
        A folder that is empty or not there yet.

    Raises
    ------
    InputError
        When the folder holds something, or the source is not what the target takes; nothing is
        written then.
    RunDirectoryError
        When the folder cannot be written.

    Examples
    --------
    >>> import driftwalk as dw
    >>> from driftwalk.export import target_named
    >>> source, target = Source(Path("run")), target_named("mujoco")
    >>> files = export_run(source, target, Path("tank"))  # doctest: +SKIP
    """
    require_empty(folder)
    require_used(source, target)
    for fault in faults_of(source.path, unread=True):
        source.tell(fault)
    made = folder.parent / f".{folder.name}{PARTIAL}{os.getpid()}-{secrets.token_hex(4)}"
    try:
        made.mkdir()
        files = [path.relative_to(made) for path in target.write(source, made)]
        # A folder that is renamed onto another takes its place where that is empty, on POSIX only.
        if folder.exists():
            folder.rmdir()
        rename(made, folder)
    except BaseException as error:
        shutil.rmtree(made, ignore_errors=True)
        refusal = storage_error(error, folder)
        if refusal is None:
            raise
        raise refusal from error
    return [folder / path for path in files]


def require_used(source: Source, target: Target) -> None:
    """Refuse what is said for another target than this one.

    Raises
    ------
    InputError
        Names it.
    """
    for name in ("flow", "seed", "replicate", "speed"):
        if getattr(source, name) is not None and name not in target.options:
            raise InputError(f"an export to {target.name} has no use for `{name}`: leave it out")


def require_empty(folder: Path) -> None:
    """Refuse a folder with anything in it, and one whose own folder is not there.

    Raises
    ------
    InputError
        Says which.
    """
    if folder.is_dir():
        inside = next(folder.iterdir(), None)
        if inside is not None:
            raise InputError(
                f"{folder} is not empty ({inside.name}, ...): name a new or an empty folder"
            )
    elif folder.exists() or folder.is_symlink():
        raise InputError(f"{folder} is a file: name a new or an empty folder")
    elif not folder.parent.is_dir():
        raise InputError(f"{folder}: the folder {folder.parent} does not exist")
