"""Damaged files of motion capture, robots and PIV: one line, exit code 2, within a second."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import pytest
import space_files
from command_line import here, refusal

LONGEST_S = 10.0
"""Processor time: other work on the machine does not count."""
TEXTS = {**space_files.recordings(), **space_files.fields()}


def numbers_lost(text: str, word: str) -> str:
    """Return the text with a word in the place of every number of its rows, times left."""
    lines = text.split("\n")
    rows = [at for at, line in enumerate(lines) if line.count("0.") + line.count("16") > 1]
    for at in rows:
        for mark in (", ", ",", "\t", " "):
            if mark in lines[at]:
                first, *rest = lines[at].split(mark)
                lines[at] = mark.join([first, *[word] * len(rest)])
                break
    return "\n".join(lines)


def header_of(text: str) -> str:
    """Return a text without its rows: 40 of a recording, 72 of a field."""
    lines = text.split("\n")
    rows = 72 if len(lines) > 60 else 40
    return "\n".join([*lines[: len(lines) - 1 - rows], ""])


DAMAGES: dict[str, Callable[[str], str]] = {
    "empty": lambda text: "",
    "blank": lambda text: "\n\n \n",
    "no rows": header_of,
    "words": lambda text: numbers_lost(text, "word"),
}


@pytest.mark.fast_cases(17)
@pytest.mark.parametrize("kind", list(TEXTS))
@pytest.mark.parametrize("damage", list(DAMAGES))
def test_damaged_text(tmp_path: Path, kind: str, damage: str) -> None:
    name, text, options = TEXTS[kind]
    path = tmp_path / name
    path.write_text(DAMAGES[damage](text))
    begin = time.process_time()
    refusal(here("info", path, *options))
    assert time.process_time() - begin < LONGEST_S


@pytest.mark.parametrize("kind", list(TEXTS))
def test_a_file_that_ends_within_a_row(tmp_path: Path, kind: str) -> None:
    name, text, options = TEXTS[kind]
    path = tmp_path / name
    whole = text.rstrip("\n").rpartition("\n")
    fields = whole[2]
    # A comma may be that of a decimal, which nobody can miss; a tab is none.
    cut = fields.rfind("\t") if "\t" in fields else max(fields.rfind(mark) for mark in ", ")
    path.write_text(whole[0] + "\n" + fields[:cut])
    begin = time.process_time()
    refusal(here("info", path, *options))
    assert time.process_time() - begin < LONGEST_S


@pytest.mark.parametrize("kind", list(space_files.recordings()))
def test_nothing_but_nan(tmp_path: Path, kind: str) -> None:
    name, text, options = TEXTS[kind]
    path = tmp_path / name
    path.write_text(numbers_lost(text, "NaN"))
    begin = time.process_time()
    refusal(here("info", path, *options))
    assert time.process_time() - begin < LONGEST_S
