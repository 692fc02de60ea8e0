"""A motion model in a Python file of the user's, "mine.py:tumbler"; loading such a file."""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
import sys
import traceback
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, Final

from driftwalk.core.errors import ConfigurationError, DriftwalkError, InputError, did_you_mean
from driftwalk.core.extras import show_dask
from driftwalk.motion.function import Settings, function_model
from driftwalk.motion.protocol import MotionModel, ScoresItself
from driftwalk.motion.ranges import Range
from driftwalk.schema import Parameter


@dataclass(frozen=True)
class UserFile:
    """A Python file that was loaded."""

    path: Path
    sha256: str
    """Of the bytes that were run."""
    module: ModuleType

    def error_text(self, error: BaseException) -> str:
        """Return an error in words, with the last line of the file that took part in it."""
        return _error_text(self.path, error)


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
        raise ConfigurationError(_error_text(path, error)) from error
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


def _error_text(path: Path, error: BaseException) -> str:
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


SUFFIX: Final = ".py:"
"""End of the file in the address of a model; the name in the file comes after it."""
MEMBERS_OF_A_MODEL: Final = ("name", "parameters", "needs_flow", "simulate", "describe", "facts")


class FileModel:
    """A model from a file: the model itself, with the hash of the file in its description."""

    def __init__(self, model: MotionModel, sha256: str, made_by: tuple[Any, ...]) -> None:
        self.model, self.sha256, self._made_by = model, sha256, made_by
        self.name, self.parameters, self.needs_flow = model.name, model.parameters, model.needs_flow
        self.simulate = model.simulate
        if isinstance(model, ScoresItself):
            self.score = model.score

    def __reduce__(self) -> tuple[Any, ...]:
        """Load the file again in the other process: its module has no name to import it by."""
        return _reloaded, (self.sha256, *self._made_by)

    def describe(self) -> dict[str, Any]:
        """Return what the model says of itself, with the hash of the file as that of its source."""
        return {**self.model.describe(), "source_sha256": self.sha256}

    def facts(self, estimate: Mapping[str, float]) -> dict[str, Any]:
        """Return the model's own facts, with the hash of the file as that of its source."""
        return {**self.model.facts(estimate), "model_source_sha256": self.sha256}


def model_of_file(
    address: str,
    parameters: tuple[Parameter, ...],
    ranges: Mapping[str, Range],
    settings: Settings,
) -> FileModel:
    """Return a motion model from a file; see `driftwalk.motion.motion_model`.

    Raises
    ------
    ConfigurationError
        When the file cannot be loaded, or what it holds under the name is no model.
    """
    before, _, name = address.rpartition(SUFFIX)
    path = Path(f"{before}.py")
    file = load_user_file(path)
    where = f"{path}:{name}"
    found = _named(file, name)
    is_class = inspect.isclass(found)
    if is_class:
        found = _instance(found, file, name)
    if isinstance(found, MotionModel):
        if parameters or ranges or settings != "one":
            raise ConfigurationError(
                f"{where} is a model that declares its ranges and settings: change them in the file"
            )
        _require_parameters(found, where)
        model = found
    elif callable(found) and not is_class:
        try:
            model = function_model(found, parameters, ranges, settings=settings)
        except ConfigurationError as error:
            raise ConfigurationError(f"{where}: {error}") from error
    else:
        lacks = [member for member in MEMBERS_OF_A_MODEL if not hasattr(found, member)]
        what = f"an object without {', '.join(lacks)}" if is_class else type(found).__name__
        raise ConfigurationError(
            f"{where} is {what}; expected a motion model, a class that makes one without "
            "arguments, or a function of a scene and parameters"
        )
    made_by = (f"{path.resolve()}:{name}", parameters, dict(ranges), settings)
    return FileModel(model, file.sha256, made_by)


def _reloaded(sha256: str, address: str, *made_by: Any) -> FileModel:
    found = model_of_file(address, *made_by)
    if found.sha256 != sha256:
        raise InputError(f"{address} has changed since the model was made: make it again")
    return found


def _named(file: UserFile, name: str) -> Any:
    there = _defined_in(file)
    known = f"it has {', '.join(there)}" if there else "it defines no function and no class"
    if not name:
        raise ConfigurationError(
            f"say what in {file.path} is the model ({file.path}:NAME): {known}"
        )
    try:
        return getattr(file.module, name)
    except AttributeError:
        raise ConfigurationError(
            f"{file.path} has no {name!r}, {known}{did_you_mean(name, there)}"
        ) from None


def _defined_in(file: UserFile) -> list[str]:
    """Return the names of the functions, classes and models that a file makes itself."""
    return [
        name
        for name, value in vars(file.module).items()
        if not name.startswith("_")
        and (
            getattr(value, "__module__", None) == file.module.__name__
            or (isinstance(value, MotionModel) and not inspect.isclass(value))
        )
    ]


def _instance(found: type, file: UserFile, name: str) -> Any:
    try:
        return found()
    except Exception as error:
        raise ConfigurationError(f"{name}() failed: {file.error_text(error)}") from error


def _require_parameters(model: MotionModel, where: str) -> None:
    found: Any = model.parameters
    if isinstance(found, tuple) and found and all(isinstance(one, Parameter) for one in found):
        return
    raise ConfigurationError(
        f"{where}: its parameters are {found!r}, expected a tuple of driftwalk.motion.Parameter"
    )
