"""Where numbers come from: hashes of files, fingerprints of specifications, the manifest."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path, PurePath
from typing import Any, Final

import numpy as np

from driftwalk.core.errors import FormatError, InputError
from driftwalk.core.files.atomic import write_atomic
from driftwalk.core.text_files import read_json, text_of_name

MANIFEST_VERSION: Final = 1
"""Raised when a reader of the last version would misread a manifest."""
MANIFEST_KIND: Final = "driftwalk manifest"
# Packages that the numbers or the files may depend on.
_PACKAGES: Final = ("numpy", "scipy", "xarray", "h5netcdf", "h5py", "pandas", "matplotlib")


def file_sha256(path: str | Path) -> str:
    """Return the SHA-256 of a file's content, 64 hexadecimal digits.

    Parameters
    ----------
    path : path-like
        A readable file.

    Raises
    ------
    InputError
        When the file cannot be read.

    Examples
    --------
    >>> file_sha256("recording.csv")  # doctest: +SKIP
    '9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08'
    """
    try:
        with Path(path).open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error


def manifest(
    *,
    command: str | Sequence[str],
    study: Mapping[str, Any],
    seeds: Mapping[str, int],
    inputs: Mapping[str, str | Path],
    instruction_set: str | None = None,
) -> dict[str, Any]:
    """Describe how results are made, in types that JSON has.

    Call it before the work: the hashes then belong to the files that were read.

    Parameters
    ----------
    command : str or sequence of str
        The command line, or the function that was called.
    study : mapping
        The resolved study, units in the keys, as ``Study.to_dict()`` gives it.
    seeds : mapping of str to int
        Every seed that was used.
    inputs : mapping of str to path-like
        The files that were read, by their role (``{"recording": "run3.csv"}``).
    instruction_set : str, optional
        The instruction set of the native core ("avx2", ...); it does not change the numbers.

    Returns
    -------
    dict
        ``kind``, ``manifest_version``, ``created_utc``, ``command``, ``study``, ``seeds``,
        ``inputs`` (path, sha256, size_bytes of each), ``software`` (versions), ``machine``. No
        name of the user or of the machine is in it, other than in the paths that were given.

    Raises
    ------
    InputError
        When an input cannot be read or a value has no form in JSON.

    Examples
    --------
    >>> made = manifest(command="demo", study={}, seeds={"calibration": 1}, inputs={})
    >>> made["seeds"]
    {'calibration': 1}
    """
    import shlex

    return {
        "kind": MANIFEST_KIND,
        "manifest_version": MANIFEST_VERSION,
        "created_utc": utc_now(),
        "command": text_of_name(command if isinstance(command, str) else shlex.join(command)),
        "study": plain(study),
        "seeds": plain(seeds),
        "inputs": {role: describe_file(path) for role, path in inputs.items()},
        "software": _software(),
        "machine": _machine(instruction_set),
    }


def describe_file(path: str | Path) -> dict[str, Any]:
    """Return path, SHA-256 and size [byte] of a file."""
    sha256 = file_sha256(path)
    return {"path": text_of_name(path), "sha256": sha256, "size_bytes": Path(path).stat().st_size}


def write_manifest(path: str | Path, values: Mapping[str, Any]) -> None:
    """Write a manifest as JSON, whole or not at all.

    Raises
    ------
    InputError
        When a value has no form in JSON.
    RunDirectoryError
        When the file cannot be written.
    """
    text = json.dumps(plain(values), indent=2, ensure_ascii=False, allow_nan=False)
    # Half a surrogate, which UTF-8 lacks, becomes JSON's own spelling of it.
    write_atomic(path, f"{text}\n".encode(errors="backslashreplace"))


def read_manifest(path: str | Path) -> dict[str, Any]:
    """Read a manifest, or any JSON file that holds one object.

    Raises
    ------
    InputError
        When the file cannot be read.
    FormatError
        When it is not JSON, is too large, or holds something else than an object; names line and
        column.
    """
    try:
        values = read_json(path)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    if not isinstance(values, dict):
        raise FormatError(f"expected an object, got {type(values).__name__}", path=path)
    return values


def refuse_other_version(folder: str | Path, values: Mapping[str, Any]) -> None:
    """Refuse a run whose manifest is of another version than this one reads.

    Parameters
    ----------
    folder : path-like
        The run directory, for the message.
    values : mapping
        Its manifest.

    Raises
    ------
    InputError
        Names both versions.

    Examples
    --------
    >>> refuse_other_version("run", {"manifest_version": MANIFEST_VERSION})
    """
    version = values.get("manifest_version")
    if version != MANIFEST_VERSION:
        software = values.get("software")
        made = software.get("driftwalk") if isinstance(software, Mapping) else None
        raise InputError(
            f"{folder}: this run was made by driftwalk {made or 'of another version'} (manifest "
            f"version {version}, this one reads {MANIFEST_VERSION}); open it with that version"
        )


def fingerprint_of(specification: Mapping[str, Any]) -> str:
    """Return the SHA-256 of a specification: everything that determines a set of numbers.

    The order of keys does not matter, nor does 1 against 1.0; an array counts by its type, shape
    and content.

    Examples
    --------
    >>> fingerprint_of({"a": 1, "b": 2.0}) == fingerprint_of({"b": 2, "a": 1.0})
    True
    """
    return hashlib.sha256(_canonical(plain(specification)).encode()).hexdigest()


def differing_keys(left: Mapping[str, Any], right: Mapping[str, Any]) -> list[str]:
    """Return the keys, sections joined by dots, in which two specifications differ, sorted.

    Examples
    --------
    >>> differing_keys({"tank": {"diameter_m": 0.3}}, {"tank": {"diameter_m": 0.5}, "seed": 1})
    ['seed', 'tank.diameter_m']
    """
    one, other = _leaves(plain(left)), _leaves(plain(right))
    return sorted(key for key in one.keys() | other.keys() if one.get(key) != other.get(key))


def plain(value: Any) -> Any:
    """Return a value in JSON's own types.

    Numpy numbers become Python's, a path becomes text, a number that is not finite the text "nan",
    "inf" or "-inf", an array its type, shape and SHA-256.

    Raises
    ------
    InputError
        When a value has no such form.
    """
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, (str, bool, int)):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if isinstance(value, PurePath):
        return str(value)
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, np.ndarray) and not value.dtype.hasobject:
        digest = hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()
        return {"dtype": value.dtype.str, "shape": list(value.shape), "sha256": digest}
    raise InputError(f"cannot describe a {type(value).__name__} as JSON: {value!r:.80}")


def utc_now() -> str:
    """Return the time as ISO 8601 in UTC, to the second: ``2011-09-25T12:00:00Z``."""
    return datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def _canonical(value: Any) -> str:
    return json.dumps(_whole_floats_as_int(value), sort_keys=True, separators=(",", ":"))


def _whole_floats_as_int(value: Any) -> Any:
    if isinstance(value, float) and value.is_integer():
        return int(value)
    if isinstance(value, dict):
        return {key: _whole_floats_as_int(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_whole_floats_as_int(item) for item in value]
    return value


def _leaves(value: dict[str, Any], prefix: str = "") -> dict[str, str]:
    leaves: dict[str, str] = {}
    for key, item in value.items():
        if isinstance(item, dict) and item:
            leaves.update(_leaves(item, f"{prefix}{key}."))
        else:
            leaves[f"{prefix}{key}"] = _canonical(item)
    return leaves


def package_versions(names: Iterable[str]) -> dict[str, str]:
    """Return the versions of packages that are installed; others are left out.

    Parameters
    ----------
    names : iterable of str
        Their names.

    Examples
    --------
    >>> list(package_versions(["numpy", "no-such-package"]))
    ['numpy']
    """
    from importlib.metadata import PackageNotFoundError, version

    from driftwalk import __version__

    versions = {}
    for name in names:
        with suppress(PackageNotFoundError):
            versions[name] = __version__ if name == "driftwalk" else version(name)
    return versions


def _software() -> dict[str, str]:
    import platform

    first = {**package_versions(["driftwalk"]), "python": platform.python_version()}
    return first | package_versions(_PACKAGES)


def _machine(instruction_set: str | None) -> dict[str, Any]:
    import os
    import platform

    return {
        "platform": platform.platform(),
        "architecture": platform.machine(),
        "processor": _processor_name() or platform.processor() or "unknown",
        "cpu_count": os.cpu_count(),
        **({} if instruction_set is None else {"instruction_set": instruction_set}),
    }


def _processor_name() -> str | None:
    """Return the processor's name where Linux tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return None
    return next((line.partition(":")[2].strip() for line in lines if "model name" in line), None)
