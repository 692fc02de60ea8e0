"""A motion model in a Python file of the user's, "mine.py:tumbler"; loading such a file."""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
import sys
import traceback
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any, Final

from driftwalk.core.errors import ConfigurationError, DriftwalkError, InputError, did_you_mean
from driftwalk.core.extras import show_dask
from driftwalk.motion.function import Settings, function_model
from driftwalk.motion.protocol import MotionModel, ScoresItself
from driftwalk.motion.ranges import Range
from driftwalk.schema import Parameter


def load_user_file(path: Path) -> tuple[ModuleType, str]:
    """Run a Python file as a module; return it, with the SHA-256 of the bytes that were run.

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
    # The file may import the ones next to it.
    folder = str(full.parent)
    sys.path.insert(0, folder)
    try:
        # The bytes that were hashed. The loader would take a compiled file for the same if the
        # source was changed within the second and kept its size.
        exec(compile(source, str(full), "exec", dont_inherit=True), module.__dict__)
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        raise ConfigurationError(_error_text(path, error)) from error
    finally:
        if folder in sys.path:
            sys.path.remove(folder)
    return module, sha256


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


def _error_text(path: Path, error: BaseException) -> str:
    """Return an error in words, with the last line of the file that took part in it."""
    full = str(path.resolve())
    if isinstance(error, SyntaxError) and error.filename == full:
        line = f", line {error.lineno}" if error.lineno else ""
        return f"{path}{line}: {error.msg}"
    frames = traceback.extract_tb(error.__traceback__)
    lines = [frame.lineno for frame in frames if frame.filename == full]
    where = f"{path}, line {lines[-1]}" if lines else str(path)
    kind = "" if isinstance(error, DriftwalkError) else f"{type(error).__name__}: "
    return " ".join(f"{where}: {kind}{error}".split())


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
    module, sha256 = load_user_file(path)
    where = f"{path}:{name}"
    found = _named(module, path, name)
    is_class = inspect.isclass(found)
    if is_class:
        try:
            found = found()
        except Exception as error:
            raise ConfigurationError(f"{name}() failed: {_error_text(path, error)}") from error
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
    return FileModel(model, sha256, made_by)


def _reloaded(sha256: str, address: str, *made_by: Any) -> FileModel:
    found = model_of_file(address, *made_by)
    if found.sha256 != sha256:
        raise InputError(f"{address} has changed since the model was made: make it again")
    return found


def _named(module: ModuleType, path: Path, name: str) -> Any:
    there = _defined_in(module)
    known = f"it has {', '.join(there)}" if there else "it defines no function and no class"
    if not name:
        raise ConfigurationError(f"say what in {path} is the model ({path}:NAME): {known}")
    if not hasattr(module, name):
        raise ConfigurationError(f"{path} has no {name!r}, {known}{did_you_mean(name, there)}")
    return getattr(module, name)


def _defined_in(module: ModuleType) -> list[str]:
    """Return the names of the functions, classes and models that a file makes itself."""
    return [
        name
        for name, value in vars(module).items()
        if not name.startswith("_")
        and (
            getattr(value, "__module__", None) == module.__name__
            or (isinstance(value, MotionModel) and not inspect.isclass(value))
        )
    ]


def _require_parameters(model: MotionModel, where: str) -> None:
    found: Any = model.parameters
    if isinstance(found, tuple) and found and all(isinstance(one, Parameter) for one in found):
        return
    raise ConfigurationError(
        f"{where}: its parameters are {found!r}, expected a tuple of driftwalk.motion.Parameter"
    )
