"""Every format of trackers and tables, damaged as files are: one line, exit code 2, in a second."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import pytest
from command_line import Done, here

LONGEST_S = 10.0
"""Processor time: other work on the machine does not count."""
TEXTS = (".csv", ".txt", ".json", ".xml")
NUMBER = re.compile(rb"(?<![\w.])-?\d+(?:[.,]\d+)?(?:e-?\d+)?(?![\w.])")
NAME = re.compile(rb"[A-Za-z_]\w*")


class Sample(NamedTuple):
    """A valid file of a format, and the words that read it."""

    kind: str
    path: Path
    content: bytes
    words: tuple[str, ...]

    @property
    def is_text(self) -> bool:
        return self.path.suffix in TEXTS and b"\x00" not in self.content


def nothing(sample: Sample) -> bytes | None:
    return b""


def blank(sample: Sample) -> bytes | None:
    return b"\n\n \n"


def cut_off(sample: Sample) -> bytes | None:
    """Return the first third; a text may be read as far as it goes."""
    return None if sample.is_text else sample.content[: len(sample.content) // 3]


def other_names(sample: Sample) -> bytes | None:
    """Rename the columns and whatever else has a name: tags of XML, keys of JSON."""
    changed = NAME.sub(b"zzz", sample.content)
    return changed if sample.is_text and changed != sample.content else None


def nothing_measured(sample: Sample) -> bytes | None:
    """Put NaN in the place of every number."""
    return NUMBER.sub(b"NaN", sample.content) if sample.is_text else None


DAMAGES: list[Callable[[Sample], bytes | None]] = [
    *(nothing, blank, cut_off, other_names, nothing_measured)
]


@pytest.fixture(scope="module")
def samples(tmp_path_factory: pytest.TempPathFactory) -> list[Sample]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(Path(__file__).parent))
        return list(made(tmp_path_factory.mktemp("formats")))


def made(place: Path) -> Iterator[Sample]:
    from text_seeds import text_files
    from tracker_seeds import tracker_files

    for kind, contents, options in text_files():
        folder = place / kind
        folder.mkdir()
        for name, content in contents.items():
            (folder / name).write_text(content)
        path = folder / next(iter(contents))
        words = (word.replace("@", str(folder)) for word in options)
        yield Sample(kind, path, path.read_bytes(), ("info", str(path), *words))
    for kind, name, options, write in tracker_files():
        path = place / kind / name
        path.parent.mkdir()
        write(path)
        yield Sample(kind, path, path.read_bytes(), ("info", str(path), *options))


def timed(sample: Sample) -> tuple[Done, float]:
    """Read a file by the command line; return what it said, and its processor time [s]."""
    begin = time.process_time()
    done = here(*sample.words)
    return done, time.process_time() - begin


@pytest.mark.slow
@pytest.mark.parametrize("damage", DAMAGES, ids=lambda damage: damage.__name__)
def test_damage_is_one_line(
    samples: list[Sample], damage: Callable[[Sample], bytes | None]
) -> None:
    wrong: dict[str, str] = {}
    for sample in samples:
        content = damage(sample)
        if content is None:
            continue
        sample.path.write_bytes(content)
        done, took = timed(sample)
        sample.path.write_bytes(sample.content)
        one_line = done.err.startswith("driftwalk: error: ") and done.err.count("\n") == 1
        if done.code != 2 or not one_line or sample.path.name not in done.err:
            wrong[sample.kind] = f"{done.code}: {done.err or done.out[:300]}"
        elif took > LONGEST_S:
            wrong[sample.kind] = f"{took:.2f} s"
    assert not wrong, "\n".join(f"{kind}: {what}" for kind, what in wrong.items())


@pytest.mark.slow
def test_the_samples_are_valid(samples: list[Sample]) -> None:
    ends = {sample.kind: here(*sample.words) for sample in samples}
    assert {kind: done.err for kind, done in ends.items() if done.code} == {}
