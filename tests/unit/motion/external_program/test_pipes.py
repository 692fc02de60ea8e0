"""Programs asked and heard through their pipes."""

from __future__ import annotations

import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

import pytest

from driftwalk.motion.external_program.process import (
    PIPES,
    Program,
    ProgramEnded,
    ProgramFault,
    Request,
)

MANY = 3_000_000  # bytes: more than any pipe holds


def program(source: str, folder: Path) -> Program:
    head = "import sys\nread, write = sys.stdin.readline, sys.stdout.write\n"
    (folder / "program.py").write_text(head + source, encoding="utf-8")
    return Program([sys.executable, "-I", "-S", "-u", "program.py"], str(folder))


def ask(one: Program, line: bytes, *, timeout: float = 20.0, most: int = 2 * MANY) -> bytes:
    return one.ask(Request(line, "now", most), timeout=timeout, stop=threading.Event())


def test_answers_in_turn(tmp_path: Path) -> None:
    one = program("while line := read(): write(line.upper())", tmp_path)
    assert [ask(one, b"first\n"), ask(one, b"second\n")] == [b"FIRST", b"SECOND"]
    one.close(patience=1.0)


def test_long_lines_and_messages_at_once(tmp_path: Path) -> None:
    """It answers and complains before it has read: whoever only writes, or reads, waits forever."""
    source = f"""
write("a" * {MANY})
sys.stderr.write("b" * {MANY})
line = read()
write(f"{{len(line)}}\\n")
"""
    one = program(source, tmp_path)
    line = b"c" * MANY + b"\n"
    assert ask(one, line) == b"a" * MANY + b"%d" % len(line)
    assert 0 < len(one.last_errors()) <= PIPES.kept_errors + 100
    one.close()


@pytest.mark.slow
def test_one_that_answers_before_it_has_read_and_ends_its_output(tmp_path: Path) -> None:
    """Its answer may count; asked again, it has ended, and another copy can be started."""
    source = """
import os, time
sys.stdin.read(10)
write('done\\n')
sys.stdout.flush()
os.close(1)
time.sleep(60)
"""
    one = program(source, tmp_path)
    began = time.monotonic()
    for _ in range(2):
        with suppress(ProgramEnded):
            assert ask(one, b"c" * 300_000 + b"\n") == b"done"
    with pytest.raises(ProgramEnded):
        ask(one, b"c" * 300_000 + b"\n")
    assert time.monotonic() - began < 15.0
    one.close()


def test_its_last_words_are_told(tmp_path: Path) -> None:
    one = program("read(); sys.stderr.write('no such tank\\n'); sys.exit(3)", tmp_path)
    with pytest.raises(ProgramEnded) as error:
        ask(one, b"?\n")
    assert error.value.reason == "it ended with exit code 3; its last messages: no such tank"
    one.close()


@pytest.mark.slow
def test_one_that_reads_nothing(tmp_path: Path) -> None:
    one = program("import time\ntime.sleep(60)", tmp_path)
    began = time.monotonic()
    with pytest.raises(ProgramFault, match=r"no answer within 0\.3 s"):
        ask(one, b"c" * MANY + b"\n", timeout=0.3)
    one.close()
    assert time.monotonic() - began < 20.0


def test_one_that_writes_without_end(tmp_path: Path) -> None:
    one = program("while True: write('a' * 65536)", tmp_path)
    with pytest.raises(ProgramFault, match="longer than"):
        ask(one, b"?\n", most=1 << 20)
    one.close()


def test_no_thread_is_left(tmp_path: Path) -> None:
    before = threading.active_count()
    one = program("while line := read(): write(line)", tmp_path)
    assert ask(one, b"?\n") == b"?"
    one.close()
    assert threading.active_count() == before
