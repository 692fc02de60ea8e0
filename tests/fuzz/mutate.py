"""Damage to the bytes and the text of a file, as disks, editors, transfers and people do it."""

from __future__ import annotations

import gzip
import random
import re
from collections.abc import Callable

TOKENS = [
    *(b"", b" ", b"-1", b"0", b"1e999", b"-1e999", b"nan", b"inf", b"1e-320", b"true", b"null"),
    *(b"9" * 19, b"-" + b"9" * 30, b"9" * 400, b"9" * 5000, b"1e308", b"0x10", b"1_000", b"1,5"),
    *(b'"', b'"""', b"'", b"\\", b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"\x1b[31m", b"\r", b"\n"),
    *("µ".encode(), "δ̂́".encode(), "\u202e".encode(), b"\xed\xa0\x80", b"\\ud800", b"[", b"{"),
    *(b"[" * 3000, b"{" * 3000, b"[" * 90 + b"]" * 90, b"[1,2]", b'{"a": 1}', b"a" * 100_000),
    *(
        b"=",
        b"[x]",
        b"[[x]]",
        b"#",
        b"%",
        b"$",
        b";",
        b"\t",
        b"1979-05-27T07:32:00Z",
        b"0001-01-01",
    ),
]
NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
WORD = re.compile(rb"[A-Za-z_]\w*")
LINE_LIMIT = 40_000
MOST_BYTES = 4 << 20
"""What damage makes of a file at most, but for bombs: finding it is not to take long."""
BOMB_MEMBER, BOMB_BYTES = 10 << 20, 2 << 20
"""Bytes of a part of a bomb, unpacked; of the whole, packed."""

Mutator = Callable[[bytes, random.Random], bytes]


def flip(content: bytes, rng: random.Random) -> bytes:
    changed = bytearray(content)
    for _ in range(rng.choice([1, 1, 2, 8, 64])):
        if changed:
            changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def set_bytes(content: bytes, rng: random.Random) -> bytes:
    changed = bytearray(content)
    width = rng.choice([1, 2, 4, 8])
    if len(changed) > width:
        at = rng.randrange(len(changed) - width)
        changed[at : at + width] = rng.choice([b"\x00", b"\xff", b"\x7f"]) * width
    return bytes(changed)


def truncate(content: bytes, rng: random.Random) -> bytes:
    return content[: rng.randrange(len(content) + 1)]


def duplicate(content: bytes, rng: random.Random) -> bytes:
    first, last = sorted(rng.randrange(len(content) + 1) for _ in range(2))
    return content[:last] + content[first:]


def splice(content: bytes, rng: random.Random) -> bytes:
    a, b, c = sorted(rng.randrange(len(content) + 1) for _ in range(3))
    return content[:a] + content[b:c] + content[a:b] + content[c:]


def insert_token(content: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(content) + 1)
    return content[:at] + rng.choice(TOKENS) + content[at:]


def replace_number(content: bytes, rng: random.Random) -> bytes:
    return _replace(content, NUMBER, rng)


def replace_word(content: bytes, rng: random.Random) -> bytes:
    return _replace(content, WORD, rng)


def _replace(content: bytes, what: re.Pattern[bytes], rng: random.Random) -> bytes:
    found = list(what.finditer(content))
    for place in sorted(rng.sample(found, min(len(found), rng.choice([1, 1, 3]))), key=_start)[
        ::-1
    ]:
        content = content[: place.start()] + rng.choice(TOKENS) + content[place.end() :]
    return content


def _start(place: re.Match[bytes]) -> int:
    return place.start()


def drop_line(content: bytes, rng: random.Random) -> bytes:
    lines = content.split(b"\n")
    del lines[rng.randrange(len(lines))]
    return b"\n".join(lines)


def shuffle_lines(content: bytes, rng: random.Random) -> bytes:
    lines = content.split(b"\n")
    rng.shuffle(lines)
    return b"\n".join(lines)


def replace_field(content: bytes, rng: random.Random) -> bytes:
    """Put the same token into a column of every line."""
    lines = content.split(b"\n")
    mark = rng.choice([b",", b"\t", b";", b" "])
    column, token = rng.randrange(8), rng.choice(TOKENS)
    for index, line in enumerate(lines):
        fields = line.split(mark)
        if len(fields) > column:
            fields[column] = token
            lines[index] = mark.join(fields)
    return b"\n".join(lines)


def count_up(content: bytes, rng: random.Random) -> bytes:
    """Repeat the last line many times, with one of its fields counting up."""
    *before, last = content.rstrip(b"\n").split(b"\n")
    places = list(NUMBER.finditer(last))
    if not places:
        return content
    place = rng.choice(places)
    rows = min(rng.choice([2000, LINE_LIMIT]), MOST_BYTES // len(last))
    rest = (last[: place.start()] + b"%d" % row + last[place.end() :] for row in range(rows))
    return b"\n".join([*before, *rest]) + b"\n"


def repeat(content: bytes, rng: random.Random) -> bytes:
    return content * min(rng.choice([2, 50, 5000]), max(1, MOST_BYTES // max(len(content), 1)))


def line_ends(content: bytes, rng: random.Random) -> bytes:
    end = rng.choice([b"\r\n", b"\r", b"", b"\n\n", b" \n", b"\x00\n"])
    return content.replace(b"\n", end)


def encode(content: bytes, rng: random.Random) -> bytes:
    text = content.decode("utf-8", "replace")
    return text.encode(rng.choice(["utf-8-sig", "utf-16", "utf-32", "utf-16-le", "utf-7"]))


def compress(content: bytes, rng: random.Random) -> bytes:
    packed = gzip.compress(content, mtime=0)
    return rng.choice([packed, packed[:-5], flip(packed, rng)])


def bomb(content: bytes, rng: random.Random) -> bytes:
    """Append to the content, in gzip, gigabytes that take a few megabytes."""
    last = content.rstrip(b"\n").rpartition(b"\n")[2] + b"\n"
    filling = rng.choice([b"\n", b"\x00", b"7", last, b"[1,2],"])
    member = gzip.compress(filling * (BOMB_MEMBER // len(filling)), compresslevel=1, mtime=0)
    return gzip.compress(content, mtime=0) + member * min(400, BOMB_BYTES // len(member))


BYTES: list[Mutator] = [flip, set_bytes, truncate, duplicate, splice]
TEXT: list[Mutator] = [
    *BYTES,
    *[insert_token, replace_number, replace_word] * 3,
    *(drop_line, shuffle_lines, replace_field, replace_field, count_up, repeat, line_ends, encode),
]
PACKED: list[Mutator] = [compress, bomb]


def mutated(content: bytes, mutators: list[Mutator], rng: random.Random) -> bytes:
    """Return the content with one kind of damage, sometimes with several."""
    for _ in range(rng.choice([1, 1, 1, 2, 3])):
        if len(content) < MOST_BYTES:
            content = rng.choice(mutators)(content, rng)
    return content
