"""Results of work units, one immutable file each: what survives when a sweep is killed."""

from __future__ import annotations

import hashlib
import io
import json
import re
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final, Protocol, TypeVar

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import DriftwalkError, InputError, RunDirectoryError
from driftwalk.core.files.atomic import write_atomic
from driftwalk.core.provenance import differing_keys, fingerprint_of, plain, read_manifest

SPECIFICATION_FILE: Final = "specification.json"
SHARD_SUFFIX: Final = ".npz"
# Member of a shard that says which unit of which sweep it belongs to and what it must hold.
_LABEL: Final = "unit.json"
_DIGEST_SIZE: Final = 64
"""Bytes of the hash at the end of a shard, as hexadecimal digits of SHA-256."""
_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}", re.ASCII)
_KEYS_NAMED: Final = 6
"""Keys that a message names before it counts the others."""

Arrays = dict[str, npt.NDArray[Any]]


class Unit(Protocol):
    """A work unit, as far as a store knows it."""

    @property
    def id(self) -> str:
        """Name, unique in its sweep and the same in every run: letters, digits, ``._-``."""


UnitT = TypeVar("UnitT", bound=Unit)


class ShardStore:
    """The results of a sweep in a folder: one uncompressed ``.npz`` per work unit.

    A shard is written whole or not at all and never changed; a shard that is cut short, damaged or
    of another sweep counts as missing, and is replaced when its unit is computed again. Several
    processes may write to one folder.

    Parameters
    ----------
    folder : path-like
        Made when absent, with the folders above it.
    fingerprint : mapping
        The specification that determines the numbers: parameters, seeds, hashes of inputs. It is
        stored with the shards, and its hash in each of them.

    Raises
    ------
    RunDirectoryError
        When the folder holds shards of another specification, naming the keys that differ, or
        cannot be written.

    Examples
    --------
    >>> store = ShardStore("run/.shards/coarse", fingerprint={"seed": 1})  # doctest: +SKIP
    """

    def __init__(self, folder: str | Path, *, fingerprint: Mapping[str, Any]) -> None:
        self.folder = Path(folder)
        self.fingerprint = fingerprint_of(fingerprint)
        self._whole: set[str] = set()
        make_folder(self.folder)
        record = self.folder / SPECIFICATION_FILE
        if record.exists():
            refuse_other_specification(read_specification(record), fingerprint, place=self.folder)
        else:
            write_specification(record, fingerprint)

    def has(self, unit: Unit) -> bool:
        """Return whether the unit's shard is there and undamaged; reads it the first time."""
        if unit.id not in self._whole and self._load(unit) is not None:
            self._whole.add(unit.id)
        return unit.id in self._whole

    def missing(self, units: Iterable[UnitT]) -> list[UnitT]:
        """Return the units, in their order, whose shard is absent or damaged."""
        return [unit for unit in units if not self.has(unit)]

    def write(self, unit: Unit, arrays: Mapping[str, npt.NDArray[Any]]) -> None:
        """Store what a unit gave. A unit that is there already stays as it is.

        Raises
        ------
        InputError
            When an array holds Python objects, or a name is no plain word.
        RunDirectoryError
            When the shard cannot be written.
        """
        if self.has(unit):
            return
        write_atomic(self._path(unit), pack_shard(unit.id, self.fingerprint, arrays))
        self._whole.add(unit.id)

    def read(self, unit: Unit) -> Arrays:
        """Return what `write` stored for a unit, bit for bit.

        Raises
        ------
        RunDirectoryError
            When the shard is absent or damaged.
        """
        arrays = self._load(unit)
        if arrays is None:
            raise RunDirectoryError(
                f"{self._path(unit)} is absent or damaged; run the same command again "
                "to recompute it"
            )
        return arrays

    def _load(self, unit: Unit) -> Arrays | None:
        try:
            content = self._path(unit).read_bytes()
        except FileNotFoundError:
            return None
        except OSError as error:
            raise RunDirectoryError(f"cannot read {self._path(unit)}: {error.strerror}") from error
        return unpack_shard(content, unit.id, self.fingerprint)

    def _path(self, unit: Unit) -> Path:
        return self.folder / f"{checked_name(unit.id, kind='unit')}{SHARD_SUFFIX}"


def pack_shard(unit: str, fingerprint: str, arrays: Mapping[str, npt.NDArray[Any]]) -> bytes:
    """Return the bytes of a shard: an uncompressed ``.npz``, which `numpy.load` reads.

    Its last 64 bytes, the comment of the zip archive, are the SHA-256 of all that precede them.
    The same arrays give the same bytes.
    """
    label = {"unit": unit, "fingerprint": fingerprint, "arrays": sorted(arrays)}
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        archive.writestr(zipfile.ZipInfo(_LABEL), json.dumps(label))
        for name in sorted(arrays):
            checked_name(name, kind="array")
            member = io.BytesIO()
            try:
                np.lib.format.write_array(member, np.asarray(arrays[name]), allow_pickle=False)
            except ValueError as error:
                raise InputError(
                    f"unit {unit}: array '{name}' cannot be stored: {error}"
                ) from error
            archive.writestr(zipfile.ZipInfo(f"{name}.npy"), member.getbuffer())
        archive.comment = bytes(_DIGEST_SIZE)
    content = buffer.getvalue()[:-_DIGEST_SIZE]
    return content + _digest(content)


def unpack_shard(content: bytes, unit: str, fingerprint: str) -> Arrays | None:
    """Return the arrays of a shard; None when it is damaged or not of this unit and sweep."""
    # The hash first: zipfile, json and numpy then see only what `pack_shard` wrote.
    if _digest(content[:-_DIGEST_SIZE]) != content[-_DIGEST_SIZE:]:
        return None
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        label = json.loads(archive.read(_LABEL))
        if label["unit"] != unit or label["fingerprint"] != fingerprint:
            return None
        return {name: _array(archive.read(f"{name}.npy")) for name in label["arrays"]}


def _digest(content: bytes) -> bytes:
    return hashlib.sha256(content).hexdigest().encode()


def _array(content: bytes) -> npt.NDArray[Any]:
    return np.lib.format.read_array(io.BytesIO(content), allow_pickle=False)


def remove_shards(folder: Path) -> None:
    """Remove the shards and the specification in a folder, and the folder if that empties it."""
    if not folder.is_dir():
        return
    try:
        # Without the specification the files are none of ours. It goes last: a kill in between
        # leaves a folder that still says what it is.
        if (folder / SPECIFICATION_FILE).exists():
            for shard in folder.glob(f"*{SHARD_SUFFIX}"):
                shard.unlink(missing_ok=True)
            (folder / SPECIFICATION_FILE).unlink()
        if not any(folder.iterdir()):
            folder.rmdir()
    except OSError as error:
        raise RunDirectoryError(f"cannot remove {folder}: {error.strerror}") from error


def checked_name(name: str, *, kind: str) -> str:
    """Return a name that is safe as the name of a file, or refuse it."""
    if _NAME.fullmatch(name) is None:
        raise InputError(
            f"{kind} name {name!r}: expected 1 to 100 letters, digits, '.', '_' or '-', "
            "beginning with a letter or digit"
        )
    return name


def make_folder(folder: Path) -> None:
    """Make a folder and those above it.

    Raises
    ------
    RunDirectoryError
        When that is not possible, or a file has the name.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise RunDirectoryError(
            f"{folder} is a file, expected a directory; choose another name"
        ) from None
    except OSError as error:
        raise RunDirectoryError(
            f"cannot make the directory {folder}: {error.strerror}; choose another directory"
        ) from error


def write_specification(path: Path, specification: Mapping[str, Any], **more: Any) -> None:
    """Write a specification and its fingerprint next to the data that it determines."""
    values = {
        "fingerprint": fingerprint_of(specification),
        "specification": plain(specification),
        **more,
    }
    write_atomic(path, f"{json.dumps(values, indent=2)}\n".encode())


def read_specification(path: Path) -> dict[str, Any]:
    """Return what `write_specification` wrote: fingerprint, specification and the rest."""
    try:
        values = read_manifest(path)
    except DriftwalkError as error:
        raise RunDirectoryError(f"{error}; move {path.parent} away and start again") from error
    if not isinstance(values.get("specification"), dict) or "fingerprint" not in values:
        raise RunDirectoryError(f"{path} is damaged; move {path.parent} away and start again")
    return values


def refuse_other_specification(
    stored: Mapping[str, Any], specification: Mapping[str, Any], *, place: Path, way_out: str = ""
) -> None:
    """Raise `RunDirectoryError` naming the keys in which a stored specification differs."""
    if stored["fingerprint"] == fingerprint_of(specification):
        return
    keys = differing_keys(stored["specification"], specification)
    named = ", ".join(keys[:_KEYS_NAMED])
    more = f" and {len(keys) - _KEYS_NAMED} more" if len(keys) > _KEYS_NAMED else ""
    raise RunDirectoryError(
        f"{place} holds results of another specification, which differs in {named}{more}; "
        f"{way_out or 'choose another directory'}"
    )
