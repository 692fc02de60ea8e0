"""Text as spreadsheets write it: decimal commas, UTF-16, the encoding of Windows."""

from __future__ import annotations

import codecs
import gzip
import json
from pathlib import Path

import numpy as np
import pytest

from driftwalk.core.errors import FormatError, InputError
from driftwalk.record import load
from driftwalk.schema import body_names, body_track

ROWS = [("t", "x", "y"), ("0,0", "1,5", "2"), ("0,5", "-1", "2,5e-1")]


def write(folder: Path, content: str | bytes, name: str = "synthetic.csv") -> Path:
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def check(path: Path) -> None:
    track = body_track(load(path))
    np.testing.assert_array_equal(track.time, [0.0, 0.5])
    np.testing.assert_array_equal(track.x, [1.5, -1.0])
    np.testing.assert_array_equal(track.y, [2.0, 0.25])


@pytest.mark.parametrize("delimiter", [";", "\t", " "])
def test_decimal_commas(tmp_path: Path, delimiter: str) -> None:
    check(write(tmp_path, "\n".join(delimiter.join(row) for row in ROWS) + "\n"))


def test_decimal_commas_in_quotes_between_commas(tmp_path: Path) -> None:
    quoted = [",".join(f'"{field}"' for field in row) for row in ROWS]
    check(write(tmp_path, "\n".join(quoted)))


def test_the_first_line_may_state_the_delimiter(tmp_path: Path) -> None:
    check(write(tmp_path, "sep=;\n" + "\n".join(";".join(row) for row in ROWS)))


@pytest.mark.parametrize(
    ("encoding", "mark"),
    [
        ("utf-16-le", codecs.BOM_UTF16_LE),
        ("utf-16-be", codecs.BOM_UTF16_BE),
        ("utf-8", codecs.BOM_UTF8),
    ],
)
@pytest.mark.parametrize("packed", [False, True])
def test_encodings_with_a_mark(tmp_path: Path, encoding: str, mark: bytes, packed: bool) -> None:
    text = "\r\n".join("\t".join(row) for row in ROWS) + "\r\n"
    content = mark + text.encode(encoding)
    check(write(tmp_path, gzip.compress(content) if packed else content))


def test_the_encoding_of_windows_is_read_and_said(tmp_path: Path) -> None:
    path = write(tmp_path, "t;x [µm];y [µm];robot\n0;1,5;2;Bärbel\n1;2;3;Bärbel\n".encode("cp1252"))
    dataset = load(path)
    assert body_names(dataset) == ["Bärbel"]
    np.testing.assert_allclose(body_track(dataset).x, [1.5e-6, 2e-6], rtol=1e-12)
    warnings = json.loads(dataset.attrs["counts"])["warnings"]
    assert any("read as Windows-1252" in one for one in warnings)


def test_without_a_header_the_first_row_is_data(tmp_path: Path) -> None:
    columns = {"t": 1, "x": "2:m", "y": "3:m"}
    for text in ("0,0;1,5;2\n0,5;-1;3\n", "0,0 1,5 2,0\n0,5 -1,0 3,0\n"):
        track = body_track(load(write(tmp_path, text), columns=columns))
        np.testing.assert_array_equal(track.x, [1.5, -1.0])


@pytest.mark.slow
def test_the_sign_may_first_appear_far_into_a_large_file(tmp_path: Path) -> None:
    note = "x" * 60
    rows = [f"{index};{index % 7};{index % 5};{note}" for index in range(65_000)]
    rows[-1] = "64999;1,5;2;"
    path = write(tmp_path, "t;x;y;note\n" + "\n".join(rows) + "\n")
    assert path.stat().st_size > 4 << 20  # beyond the first block
    assert body_track(load(path)).x[-1] == 1.5
    rows[5] = "5;1.5;0;"
    path = write(tmp_path, "t;x;y;note\n" + "\n".join(rows) + "\n")
    with pytest.raises(FormatError, match=r"line 65001, column 2: '1,5'.*a comma as decimal sign"):
        load(path)


BAD = {
    "both signs": ("t;x;y\n0;1.5;2\n1;1;2,5\n", "line 3, column 3: '2,5'.*a comma.*a point"),
    "a point among commas": ("t;x;y\n0;1,5;2\n1;1,5;2\n2;1.5;2\n", "line 4, column 2: '1.5'"),
    "a word among commas": ("t;x;y\n0;1,5;2\n1;oops;2,5\n", "line 3, column 2: 'oops' in column"),
    "thousands": ("t;x;y\n0;1.234,5;2\n", "line 2, column 2: '1.234,5' in column 'x' is not a num"),
    "two commas": ("t;x;y\n0;1,234,5;2\n", "line 2, column 2: '1,234,5'"),
    "half a letter": ("t,x,y\n0,1,2\n".encode("utf-16")[:-1], "UTF-16 text but does not go on"),
    "a lone surrogate": (b"\xff\xfe" + "t,x,y\n".encode("utf-16-le") + b"\x00\xd8a\x00", "UTF-16"),
    "four bytes a letter": ("t,x,y\n0,1,2\n".encode("utf-32"), "not recognised"),
    "UTF-16 without a mark": ("t,x,y\n0,1,2\n".encode("utf-16-le"), "not recognised"),
    "only a mark": (b"\xff\xfe", "empty"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_text_is_an_error_that_says_where(tmp_path: Path, case: str) -> None:
    content, message = BAD[case]
    path = write(tmp_path, content)
    with pytest.raises(InputError, match=message) as caught:
        load(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
