"""Results that tests share: each is made once in a session, by the worker that needs it first."""

from __future__ import annotations

import os
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from filelock import FileLock

# The folder that the workers of a session share. `conftest.py` sets it; without it nothing is kept.
SHARED = "DRIFTWALK_TEST_RESULTS"
T = TypeVar("T")


def made_once(name: str, make: Callable[[], T]) -> T:
    """Return what `make` returns, from a file if another worker has made it already."""
    shared = os.environ.get(SHARED)
    if shared is None:
        return make()
    stored = Path(shared) / f"{name}.pickle"
    with FileLock(f"{stored}.lock"):
        if stored.exists():
            made: T = pickle.loads(stored.read_bytes())
        else:
            made = make()
            # A worker that is killed meanwhile leaves no half of a file.
            partial = stored.with_suffix(".partial")
            partial.write_bytes(pickle.dumps(made))
            partial.replace(stored)
    return made


def shared_folder(name: str, otherwise: Path) -> Path:
    """Return a folder that the workers of a session share; `otherwise` outside of a session."""
    shared = os.environ.get(SHARED)
    return otherwise if shared is None else Path(shared) / name


def made_once_in(folders: list[Path], name: str, make: Callable[[], T]) -> T:
    """Return what `make` returns, and copy into these new folders what it wrote into them."""

    def made_with_files() -> tuple[T, list[dict[str, bytes]]]:
        result = make()
        return result, [_files(folder) for folder in folders]

    result, files = made_once(name, made_with_files)
    for folder, contents in zip(folders, files, strict=True):
        for path, content in contents.items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_bytes(content)
    return result


def _files(folder: Path) -> dict[str, bytes]:
    paths = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths}
