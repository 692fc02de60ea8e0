"""Gives the frames of a Matroska file other times, as a camera with a varying rate would."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from pathlib import Path

# Elements that hold others on the way to the frames: Segment, Cluster, Info.
_MASTERS = {0x18538067, 0x1F43B675, 0x1549A966}
_TIMESTAMP, _SIMPLE_BLOCK, _DURATION = 0xE7, 0xA3, 0x4489


def give_times(path: Path, times: Sequence[float]) -> Path:
    """Overwrite the presentation times [s], in whole milliseconds; no frame is encoded again."""
    data = bytearray(path.read_bytes())
    waiting, cluster_ms = list(times), 0
    for kind, start, size in _elements(data, 0, len(data)):
        if kind == _TIMESTAMP:
            cluster_ms = int.from_bytes(data[start : start + size], "big")
        elif kind == _SIMPLE_BLOCK:
            # One byte for the track, then the time after the cluster's [ms].
            struct.pack_into(">h", data, start + 1, round(1000 * waiting.pop(0)) - cluster_ms)
        elif kind == _DURATION:
            last = times[-1] + (times[-1] - times[0]) / (len(times) - 1)
            struct.pack_into(">d" if size == 8 else ">f", data, start, 1000 * last)
    assert not waiting, "there are more times than frames"
    path.write_bytes(data)
    return path


def _elements(data: bytearray, at: int, end: int) -> Iterator[tuple[int, int, int]]:
    """Give identity, place and size of each element, those within others as well."""
    while at < end:
        kind, at = _number(data, at, marker=True)
        size, at = _number(data, at, marker=False)
        if kind in _MASTERS:
            yield from _elements(data, at, min(at + size, end))
        else:
            yield kind, at, size
        at += size


def _number(data: bytearray, at: int, *, marker: bool) -> tuple[int, int]:
    """Read a number whose leading zero bits say how long it is."""
    length = 9 - data[at].bit_length()
    value = int.from_bytes(data[at : at + length], "big")
    return (value if marker else value & ~(1 << 7 * length)), at + length
