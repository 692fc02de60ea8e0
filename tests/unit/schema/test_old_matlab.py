"""Files of MATLAB's old format that declare far more than they hold."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

import driftwalk as dw
from driftwalk.flow import load_flow
from driftwalk.schema.stores.matlab import read_old


def test_variables_come_by_their_names(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    savemat(path, {"u": np.arange(3.0), "who": "me"})
    found = read_old(path)
    assert sorted(found) == ["u", "who"]
    np.testing.assert_array_equal(found["u"].ravel(), [0.0, 1.0, 2.0])


@pytest.mark.parametrize("kind", ["struct", "cell"])
def test_more_structs_or_cells_than_a_file_could_hold_are_refused_before_they_are_made(
    kind: str, tmp_path: Path
) -> None:
    path = tmp_path / "many.mat"
    value = {"struct": {"x": 1.0}, "cell": np.array([[1.0]], dtype=object)}[kind]
    savemat(path, {"S": value})
    one, many = struct.pack("<IIii", 5, 8, 1, 1), struct.pack("<IIii", 5, 8, 1 << 23, 1)
    content = path.read_bytes()
    assert one in content
    path.write_bytes(content.replace(one, many, 1))
    with pytest.raises(dw.FormatError, match="8388608 structs or cells, and 200000 are read"):
        read_old(path)


@pytest.mark.slow
@pytest.mark.parametrize("read", [read_old, dw.load, load_flow])
def test_zeros_that_are_a_thousand_times_larger_are_refused(
    read: Callable[[Path], object], tmp_path: Path
) -> None:
    """300 MB of zeros in 300 kB, by every way that a file of MATLAB's is read."""
    path = tmp_path / "large.mat"
    names = dict.fromkeys(("v_original", "x", "y"), np.zeros(3))
    savemat(path, {"u_original": np.zeros(300_000_000, np.int8), **names}, do_compression=True)
    assert path.stat().st_size < 1_000_000
    with pytest.raises(dw.FormatError, match=re.escape(path.name)) as refused:
        read(path)
    assert "declares" in str(refused.value)
