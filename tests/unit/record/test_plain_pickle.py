"""Pickles of plain data are read, and nothing in any pickle is executed."""

from __future__ import annotations

import pickle
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from driftwalk.core.errors import FormatError
from driftwalk.record import load
from driftwalk.record.containers import PickledArray, unpickle

SCALARS = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text()
PLAIN = st.recursive(
    SCALARS | st.binary(),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.tuples(inner, inner)
        | st.dictionaries(st.text(max_size=5), inner, max_size=4)
    ),
    max_leaves=20,
)


def read(content: bytes) -> Any:
    return unpickle(content, where="it")


@pytest.mark.slow
@settings(max_examples=60)
@given(PLAIN, st.integers(3, 5))
def test_plain_data_is_read_as_by_pickle(data: Any, protocol: int) -> None:
    assert read(pickle.dumps(data, protocol=protocol)) == data


@pytest.mark.parametrize("protocol", range(6))
@pytest.mark.parametrize("kind", ["<f8", ">f4", "i2", "u1", "?", "U3", "S2"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_arrays_and_numbers_of_numpy(kind: str, order: Any, protocol: int) -> None:
    array = np.array(np.arange(6).reshape(2, 3).astype(kind), order=order)
    found = read(pickle.dumps(array, protocol=protocol))
    assert isinstance(found, PickledArray)
    np.testing.assert_array_equal(found.values(), array)
    assert found.values().dtype == array.dtype
    assert read(pickle.dumps(np.float64(2.5), protocol=protocol)) == 2.5


class Ran:
    """Makes a file when it is unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> Any:
        return Path.touch, (self.path,)


@pytest.mark.parametrize("protocol", range(6))
def test_what_would_run_a_program_is_refused_by_name(tmp_path: Path, protocol: int) -> None:
    marker = tmp_path / "ran"
    data = {"trajectories": np.zeros((3, 1, 2)), "extra": Ran(marker)}
    content = pickle.dumps(data, protocol=protocol)
    with pytest.raises(
        FormatError, match=r"asks for (pathlib|posixpath|__builtin__|builtins|copy)"
    ):
        read(content)
    path = tmp_path / "trajectories.npy"
    np.save(path, data)  # type: ignore[arg-type]
    with pytest.raises(FormatError, match="no plain data and could run a program"):
        load(path, metres_per_pixel=0.01)
    assert not marker.exists()
    pickle.loads(content)  # the same by pickle itself runs it
    assert marker.exists()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"cos\nsystem\n(S'true'\ntR.", r"asks for os\.system"),
        (b"\x80\x04\x8c\x02os\x8c\x06system\x93.", r"asks for os\.system"),
        (b"\x80\x02cnumpy\nload\n.", r"asks for numpy\.load"),
        (b"\x80\x02cnumpy.core.multiarray\n_reconstruct.__globals__\n.", "asks for numpy"),
        (b"(S'a'\nS'b'\niposix\nsystem\n.", r"asks for posix\.system"),
        (b"(cos\nsystem\nS'true'\no.", r"asks for os\.system"),
        (b"\x80\x02\x82\x01.", "damaged pickle"),
        (b"Pabc\n.", "damaged pickle"),
        (b"\x80\x05\x97.", "damaged pickle"),
        (b"\x80\x02N" + b"r" + struct.pack("<I", 2**32 - 1) + b".", "far beyond its contents"),
        (b"\x80\x04\x8d" + struct.pack("<Q", 2**60) + b"a.", "damaged pickle"),
        (b"\x80\x02c_codecs\nencode\n}X\x01\x00\x00\x00aX\x01\x00\x00\x00bsb.", "is given a state"),
        (b"\x80\x02c_codecs\nencode\nX\x02\x00\x00\x00aaX\x03\x00\x00\x00zip\x86R.", "encoding"),
        (b"", "damaged pickle"),
        (b"\x80\x04", "damaged pickle"),
    ],
)
def test_instructions_that_plain_data_does_not_need(content: bytes, message: str) -> None:
    with pytest.raises(FormatError, match=message):
        read(content)


@pytest.mark.slow
@settings(max_examples=200)
@given(st.data())
def test_a_damaged_pickle_is_read_or_refused(data: st.DataObject) -> None:
    whole = bytearray(pickle.dumps({"trajectories": np.zeros((2, 1, 2)), "a": [1, "b"]}))
    for _ in range(data.draw(st.integers(1, 4))):
        whole[data.draw(st.integers(0, len(whole) - 1))] = data.draw(st.integers(0, 255))
    try:
        found = read(bytes(whole))
    except FormatError:
        return
    array = found.get("trajectories") if isinstance(found, dict) else None
    if isinstance(array, PickledArray):
        try:
            array.values()
        except (ValueError, TypeError, MemoryError):
            return


@pytest.mark.parametrize(
    "state",
    [
        (1, (10**12,), "f8", False, b""),
        (1, (2,), "O8", False, b"0" * 16),
        (1, (-1,), "f8", False, b"0" * 8),
        (1, ("a",), "f8", False, b"0" * 8),
        (1, (2,), "V8", False, b"0" * 16),
    ],
)
def test_an_array_that_its_values_do_not_fill(state: Any) -> None:
    """NumPy itself would take a shape of a petabyte, or objects at addresses of the file's."""
    version, shape, kind, by_columns, content = state
    array = read(pickle.dumps(np.zeros(1)))
    described = read(pickle.dumps(np.dtype("f8")))
    described.code = kind
    array.__setstate__((version, shape, described, by_columns, content))
    if shape == (-1,):  # as many as there are
        assert array.values().size == 1
        return
    with pytest.raises((ValueError, TypeError)):
        array.values()
