"""Load a Python file of the user's: its names, its hash, and errors with the line in it."""

from __future__ import annotations

import hashlib
import importlib.util
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from driftwalk.core.errors import ConfigurationError, DriftwalkError
from driftwalk.core.extras import show_dask
from driftwalk.core.text.did_you_mean import did_you_mean


@dataclass(frozen=True)
class UserFile:
    """A Python file that was loaded."""

    path: Path
    sha256: str
    """Of the bytes that were run."""
    module: ModuleType

    def blame(self, error: BaseException) -> str:
        """Return an error in words, with the last line of the file that took part in it."""
        return _blame(self.path, error)


def load_user_file(path: Path) -> UserFile:
    """Run a Python file as a module.

    Raises
    ------
    ConfigurationError
        When there is no such file, it is no Python, or it fails.
    """
    source = _read(path)
    show_dask()
    sha256 = hashlib.sha256(source).hexdigest()
    full = path.resolve()
    # A changed file is another module, and so is a file of the same name elsewhere.
    place = hashlib.sha256(str(full).encode(errors="surrogateescape")).hexdigest()
    name = f"_driftwalk_{path.stem}_{place[:8]}_{sha256[:8]}"
    spec = importlib.util.spec_from_file_location(name, full)
    assert spec is not None, "a name that ends in .py has a loader"
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        with _on_the_path(str(full.parent)):
            # The bytes that were hashed. The loader would take a compiled file for the same if the
            # source was changed within the second and kept its size.
            exec(compile(source, str(full), "exec", dont_inherit=True), module.__dict__)
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        raise ConfigurationError(_blame(path, error)) from error
    return UserFile(path, sha256, module)


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        others = [one.name for one in sorted(path.parent.glob("*.py"))]
        raise ConfigurationError(
            f"there is no file {path}{did_you_mean(path.name, others)}"
        ) from None
    except OSError as error:
        raise ConfigurationError(f"cannot read {path}: {error.strerror or error}") from error


@contextmanager
def _on_the_path(folder: str) -> Iterator[None]:
    """Let a file import the ones next to it."""
    sys.path.insert(0, folder)
    try:
        yield
    finally:
        if folder in sys.path:
            sys.path.remove(folder)


def _blame(path: Path, error: BaseException) -> str:
    if isinstance(error, SyntaxError) and _same(error.filename, path):
        line = f", line {error.lineno}" if error.lineno else ""
        return f"{path}{line}: {error.msg}"
    frames = traceback.extract_tb(error.__traceback__)
    lines = [frame.lineno for frame in frames if _same(frame.filename, path)]
    where = f"{path}, line {lines[-1]}" if lines else str(path)
    kind = "" if isinstance(error, DriftwalkError) else f"{type(error).__name__}: "
    return " ".join(f"{where}: {kind}{error}".split())


def _same(filename: str | None, path: Path) -> bool:
    return filename == str(path.resolve())
