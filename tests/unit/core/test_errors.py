"""Errors name the file that they are about."""

from __future__ import annotations

import gzip
from pathlib import Path

import pytest

from driftwalk.core.errors import FormatError, naming_its_file


@naming_its_file
def read(path: Path, *, line: int) -> bytes:
    if line:
        raise FormatError("is wrong", line=line)
    with gzip.open(path) as file:
        return file.read()


def test_the_file_is_named_once(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"^a.csv, line 7: is wrong$"):
        read(Path("a.csv"), line=7)

    @naming_its_file
    def outer(path: Path) -> bytes:
        return read(path / "inner.csv", line=7)

    with pytest.raises(FormatError, match=r"^folder/inner.csv, line 7: is wrong$"):
        outer(Path("folder"))


def test_what_cannot_be_read_is_named(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"none.gz: cannot be read: No such file"):
        read(tmp_path / "none.gz", line=0)
    (tmp_path / "cut.gz").write_bytes(gzip.compress(b"x" * 1000)[:-9])
    with pytest.raises(FormatError, match=r"cut.gz: is damaged: "):
        read(tmp_path / "cut.gz", line=0)
    (tmp_path / "whole.gz").write_bytes(gzip.compress(b"x"))
    assert read(tmp_path / "whole.gz", line=0) == b"x"
