"""The targets of an export, by name. A new one is a function that writes, and its entry here."""

from __future__ import annotations

import os
import secrets
import shutil
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, Final

from driftwalk.core.errors import InputError, did_you_mean
from driftwalk.core.files.atomic import PARTIAL, rename, storage_error
from driftwalk.core.files.run_layout import faults_of
from driftwalk.export.data.targets import DATA_TARGETS
from driftwalk.export.figures import FIGURE_TARGETS
from driftwalk.export.target import Source, Target


def _simulator(name: str, gives: str) -> Target:
    """Return the target whose module is `driftwalk.export.simulators` NAME."""

    # Help answers at once: a simulator's module is imported when it is used.
    def call(function: str, *arguments: Any) -> Any:
        return getattr(import_module(f"driftwalk.export.simulators.{name}"), function)(*arguments)

    write, verify, require = (partial(call, one) for one in ("write", "verify", "require"))
    return Target(name, gives, write, verify, require)


_ALL: Final = (
    _simulator("mujoco", "the tank as MJCF, the water as a Python module, and verify.py"),
    _simulator("webots", "a world, a PROTO and a physics plugin in C"),
    _simulator("gazebo", "a world and a system plugin in C++"),
    *DATA_TARGETS,
    *FIGURE_TARGETS,
)
TARGETS: Final[dict[str, Target]] = {target.name: target for target in _ALL}
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
