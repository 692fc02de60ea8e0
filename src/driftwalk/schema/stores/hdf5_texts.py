"""Texts of variable length in an HDF5 file, looked at before the library reads them.

HDF5 keeps them in collections, and refers to each by length, address of the collection and number.
Where these are damaged, HDF5 2.0 steps over a free space of no size forever, inside the library
where no signal ends it. Or it clears as much memory as the length says, four gigabytes at most, and
only then finds that the text is shorter.
"""

from __future__ import annotations

import mmap
import struct
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Final

from driftwalk.core.errors import FormatError
from driftwalk.core.text_files import MIB

_SIGNATURE: Final = b"\x89HDF\r\n\x1a\n"
_COLLECTION: Final = b"GCOL\x01\x00\x00\x00"
_HEADER: Final = struct.Struct("<HHIQ")
"""Each text begins with its number, the count of references to it, nothing, and its size."""
_ADDRESS: Final = struct.Struct("<Q")
_NUMBER: Final = struct.Struct("<I")
_PLACES_OF_WIDTHS: Final = {0: 13, 1: 13, 2: 9, 3: 9}
"""By version of the file: where it says how wide addresses and sizes are."""
MOST_NUMBER: Final = 0xFFFF
"""Of a text in its collection."""
MOST_SEARCHED: Final = 512 * MIB
"""Bytes that are looked through, for some tenths of a second; what a larger file or one with many
collections holds beyond them is left to the library; chosen by hand."""


def refuse_endless_texts(path: Path) -> None:
    """Refuse an HDF5 file on whose texts the library would not come to an end within a second.

    Parameters
    ----------
    path : Path
        The file; of any other kind nothing is looked at.

    Raises
    ------
    FormatError
        When it is damaged so.

    Examples
    --------
    >>> from importlib.resources import files
    >>> data = files("driftwalk.datasets") / "tank30_ode_a"
    >>> refuse_endless_texts(Path(str(data / "recording.csv")))
    """
    state = path.stat()
    if damage := _damage(path, state.st_size, state.st_mtime_ns):
        raise FormatError(f"is damaged: {damage}", path=path)


@lru_cache(maxsize=8)
def _damage(path: Path, size: int, _changed_ns: int) -> str:
    """Return what is wrong with a file's texts, ``""`` where nothing is; remembered by its age."""
    if not 0 < size <= MOST_SEARCHED:
        return ""
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        base = content.find(_SIGNATURE, 0, MIB)
        if base < 0 or not _is_usual(content, base):
            return ""
        searched = 0
        for at in _places(content, _COLLECTION):
            searched += size
            if searched > MOST_SEARCHED:
                return ""
            numbers = _numbers_in(content, at)
            for number, length in _references(content, at - base):
                if numbers is None:
                    return "a collection of its texts has no end"
                if number not in numbers:
                    continue
                if length > size:
                    return f"it declares a text of {length / 1e9:.3g} GB"
    return ""


def _is_usual(content: mmap.mmap, base: int) -> bool:
    """Return whether addresses and sizes have 8 bytes, as in every file of today."""
    place = _PLACES_OF_WIDTHS.get(content[base + 8] if base + 8 < len(content) else -1)
    return place is not None and content[base + place : base + place + 2] == b"\x08\x08"


def _places(content: mmap.mmap, wanted: bytes) -> Iterator[int]:
    """Yield where some bytes stand."""
    at = content.find(wanted)
    while at >= 0:
        yield at
        at = content.find(wanted, at + 1)


def _numbers_in(content: mmap.mmap, at: int) -> set[int] | None:
    """Return the numbers of the texts in a collection, None where walking through it has no end."""
    found: set[int] = set()
    begin = at + len(_COLLECTION) + _ADDRESS.size
    if begin > len(content):
        return found
    (size,) = _ADDRESS.unpack_from(content, at + len(_COLLECTION))
    end = min(at + size, len(content))
    while begin + _HEADER.size <= end:
        number, _, _, length = _HEADER.unpack_from(content, begin)
        if number == 0:
            # The space that is free, whose size counts its header.
            if length == 0:
                return None
            begin += length
        else:
            found.add(number)
            begin += _HEADER.size + -(-length // 8) * 8
    return found


def _references(content: mmap.mmap, address: int) -> Iterator[tuple[int, int]]:
    """Yield number and length of each reference to a text of a collection.

    A collection without any is a remnant, which the library does not read.
    """
    for place in _places(content, _ADDRESS.pack(address)):
        after = place + _ADDRESS.size
        if place < _NUMBER.size or after + _NUMBER.size > len(content):
            continue
        (number,) = _NUMBER.unpack_from(content, after)
        (length,) = _NUMBER.unpack_from(content, place - _NUMBER.size)
        if 0 < number <= MOST_NUMBER:
            yield number, length
