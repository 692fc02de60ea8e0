"""Damaged texts of HDF5: refused before the library walks through them for ever or clears 4 GB."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from command_line import here, refusal
from tracker_files import session

from driftwalk.core.errors import FormatError
from driftwalk.schema.stores.hdf5_texts import refuse_endless_texts
from driftwalk.schema.stores.netcdf import kind_of_file

COLLECTION = b"GCOL\x01\x00\x00\x00"


def labelled(path: Path, *, userblock: int = 0) -> bytes:
    values = session()
    with h5py.File(path, "w", userblock_size=userblock) as file:
        for name in ("trajectories", "id_probabilities"):
            file[name] = values[name]
        for name in ("frames_per_second", "length_unit", "identities_labels"):
            file.attrs[name] = values[name]
        file.attrs["kind"] = "a kind of its own"
    return path.read_bytes()


def no_free_space(content: bytes, base: int) -> bytes:
    """Give the free space at the end of the collection no size."""
    at = content.index(COLLECTION) + 16
    while (number := struct.unpack_from("<H", content, at)[0]) != 0:
        at += 16 + -(-struct.unpack_from("<Q", content, at + 8)[0] // 8) * 8
    assert number == 0
    return content[: at + 8] + bytes(8) + content[at + 16 :]


def nothing_in_it(content: bytes, base: int) -> bytes:
    at = content.index(COLLECTION) + 16
    return content[:at] + bytes(4080) + content[at + 4080 :]


def long_text(content: bytes, base: int) -> bytes:
    """Let the first reference to the collection say that its text has 4 GB."""
    reference = struct.pack("<Q", content.index(COLLECTION) - base)
    at = content.index(reference) - 4
    return content[:at] + b"\xf0\xff\xff\xff" + content[at + 4 :]


DAMAGES = {
    no_free_space: "a collection of its texts has no end",
    nothing_in_it: "a collection of its texts has no end",
    long_text: "it declares a text of 4.29 GB",
}


@pytest.mark.parametrize("damage", DAMAGES, ids=lambda damage: damage.__name__)
@pytest.mark.parametrize("userblock", [0, 512])
def test_damaged_texts_are_refused_unread(
    tmp_path: Path, damage: Callable[[bytes, int], bytes], userblock: int
) -> None:
    path = tmp_path / "trajectories.h5"
    content = labelled(path, userblock=userblock)
    refuse_endless_texts(path)
    path.write_bytes(damage(content, userblock))
    with pytest.raises(FormatError, match=DAMAGES[damage]):
        refuse_endless_texts(path)
    begin = time.process_time()
    if not userblock:
        assert kind_of_file(path) is None
        said = refusal(here("info", path, "--scale", "0.001"))
        assert DAMAGES[damage] in said
    assert time.process_time() - begin < 10.0


def test_whole_texts_are_read(tmp_path: Path) -> None:
    path = tmp_path / "trajectories.h5"
    labelled(path)
    assert kind_of_file(path) == "a kind of its own"
    assert here("info", path, "--scale", "0.001").code == 0


def test_a_remnant_that_nothing_refers_to_is_no_damage(tmp_path: Path) -> None:
    path = tmp_path / "remnant.h5"
    with h5py.File(path, "w") as file:
        # As a collection of no content, in the bytes of an array.
        file["bytes"] = np.frombuffer(COLLECTION + bytes(56), np.uint8)
    refuse_endless_texts(path)


@pytest.mark.parametrize("length", [0, 7, 12, 40])
def test_what_ends_early_is_left_to_the_library(tmp_path: Path, length: int) -> None:
    path = tmp_path / "short.h5"
    path.write_bytes((b"\x89HDF\r\n\x1a\n\x02\x08\x08" + COLLECTION * 4)[:length])
    refuse_endless_texts(path)
