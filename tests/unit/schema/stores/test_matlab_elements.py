"""Damaged types in MATLAB's old format: refused, where scipy would end the whole program."""

from __future__ import annotations

import struct
import warnings
import zlib
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from command_line import here, refusal
from scipy.io import loadmat, savemat

from driftwalk.core.errors import FormatError
from driftwalk.schema.stores.matlab import refuse_unknown_elements

VALUES = 0.1 * np.arange(20)
TABLE = {"S": {"t": VALUES, "x": VALUES, "y": 2 * VALUES}, "names": np.array(["a", 3.0], object)}
DOUBLES = struct.pack("<II", 9, 160)
"""Tag of the 20 numbers of a column."""


def packed(content: bytes) -> bytes:
    """Return a file with its variables packed; those of `savemat` are to be damaged before."""
    at, parts = 128, [content[:128]]
    while at < len(content):
        size = 8 + struct.unpack_from("<I", content, at + 4)[0]
        small = zlib.compress(content[at : at + size])
        parts.append(struct.pack("<II", 15, len(small)) + small)
        at += size
    return b"".join(parts)


@pytest.mark.parametrize("kind", [0, 8, 10, 11, 19, 2057])
@pytest.mark.parametrize("pack", [False, True])
def test_a_type_that_there_is_not_is_refused(tmp_path: Path, kind: int, pack: bool) -> None:
    path = tmp_path / "a.mat"
    savemat(path, TABLE)
    whole = path.read_bytes()
    assert whole.count(DOUBLES) == 3
    damaged = whole.replace(DOUBLES, struct.pack("<II", kind, 160), 1)
    path.write_bytes(packed(damaged) if pack else damaged)
    with pytest.raises(FormatError, match=f"unknown MATLAB element type {kind}$"):
        refuse_unknown_elements(path)
    assert f"unknown MATLAB element type {kind}" in refusal(
        here("info", path, "--length-unit", "m")
    )
    path.write_bytes(packed(whole) if pack else whole)
    refuse_unknown_elements(path)


def test_a_packed_variable_that_is_damaged_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    savemat(path, {"a": VALUES}, do_compression=True)
    content = path.read_bytes()
    path.write_bytes(content[:150] + b"\xff\xff\xff" + content[153:])
    with pytest.raises(FormatError, match="cannot be unpacked"):
        refuse_unknown_elements(path)


def test_whatever_scipy_reads_passes() -> None:
    # The files by which scipy tests its own reader, of MATLAB 5 to 7.4 and of both byte orders.
    samples = [
        path
        for path in sorted(Path(scipy.io.__file__).parent.rglob("*.mat"))
        if path.read_bytes().startswith(b"MATLAB 5.0")
    ]
    if not samples:
        pytest.skip("this scipy comes without its tests")
    read = 0
    for path in samples:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                loadmat(path)
        except Exception:
            continue
        refuse_unknown_elements(path)
        read += 1
    assert read > 50


@pytest.mark.parametrize("length", [0, 64, 128, 131, 140, 180])
def test_what_ends_early_is_left_to_scipy(tmp_path: Path, length: int) -> None:
    path = tmp_path / "a.mat"
    savemat(path, {"a": VALUES})
    path.write_bytes(path.read_bytes()[:length])
    refuse_unknown_elements(path)
