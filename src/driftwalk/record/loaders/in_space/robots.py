"""Poses as robots log them: ROS bags, EuRoC's ground truth, TUM's text of trajectories.

Bags: poses of one topic or several, at the times of their headers. EuRoC: CSV with ``p_RS_R_x [m]``
and ``q_RS_w []``, a clock of nanoseconds. TUM: ``timestamp tx ty tz qx qy qz qw``, blanks between,
seconds and metres.
"""

from __future__ import annotations

import math
import re
from collections import Counter, defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import accumulate, takewhile
from pathlib import Path
from typing import Any, Final

import numpy as np

from driftwalk.core.errors import FormatError, InputError, damaged_as
from driftwalk.core.text_files import MIB, MOST_LEVELS, read_bounded
from driftwalk.record.column_names import unit_of_name
from driftwalk.record.loaders.plain import described
from driftwalk.record.raw import CLOCK_UNITS, RawRecording, ReadOptions, TableLayout
from driftwalk.record.space import PARTS, SpaceTrack, lay_flat, plane_of
from driftwalk.record.tables.text_source import first_line, first_lines, first_row, is_numeric_row
from driftwalk.record.text import header_rows

Pose = tuple[str, Any, str, tuple[float, ...]]
"""One body in one message: its name, the stamp of its header, None where the message has none, the
frame that the pose is in, ``""`` where the message does not say; position x, y, z [m] and
quaternion x, y, z, w."""
READ: Final = (
    *("geometry_msgs/msg/Pose", "geometry_msgs/msg/Pose2D", "geometry_msgs/msg/PoseStamped"),
    *("geometry_msgs/msg/PoseWithCovarianceStamped", "geometry_msgs/msg/PoseArray"),
    *("geometry_msgs/msg/TransformStamped", "nav_msgs/msg/Odometry"),
    *("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"),
)
"""Types of messages whose poses are read."""


def _poses(message: Any, topic: str) -> Iterator[Pose]:
    """Yield the poses in a message of one of these types, given the name of its topic."""
    if hasattr(message, "transforms"):
        for one in message.transforms:
            yield from _poses(one, topic)
        return
    header = getattr(message, "header", None)
    stamp, parent = (None, "") if header is None else (header.stamp, header.frame_id)
    inner = message
    while hasattr(inner, "pose"):  # with a covariance, a pose is inside another
        inner = inner.pose
    found = {getattr(message, "child_frame_id", "") or topic: getattr(inner, "transform", inner)}
    if hasattr(message, "poses"):
        found = {str(number): one for number, one in enumerate(message.poses)}
    for name, one in found.items():
        if hasattr(one, "theta"):
            half = 0.5 * one.theta
            values = (one.x, one.y, 0.0, 0.0, 0.0, math.sin(half), math.cos(half))
        else:
            moves = hasattr(one, "translation")
            at, turn = (one.translation, one.rotation) if moves else (one.position, one.orientation)
            values = (at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w)
        yield name, stamp, parent, values


METADATA: Final = "metadata.yaml"
_MCAP: Final = b"\x89MCAP0\r\n"
_SQLITE: Final = b"SQLite format 3\0"
_ROS_1: Final = b"#ROSBAG V2.0\n"


_Tracks = dict[tuple[str, str], list[tuple[int, tuple[float, ...]]]]
"""From topic and body to stamps [ns] and poses."""


class RosLoader:
    """Bodies by their frames, or by their topics where a message names no frame of the body."""

    name = "ros"
    description = "ROS bag, of ROS 1, sqlite3 or MCAP (poses, odometry, transforms; z up)"

    def sniff(self, head: bytes, path: Path) -> float:
        """Recognise the folder of a bag, or one of its files."""
        if path.is_dir():
            return 0.95 if (path / METADATA).is_file() else 0.0
        return 0.95 if head.startswith((_MCAP, _SQLITE, _ROS_1)) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the poses of the chosen topics."""
        plane = plane_of(options.up or "z")
        with _opened(path) as reader:
            chosen = _choose(reader.connections, options.topic)
            tracks, parents, recorded = _collect(reader, chosen)
        if not tracks:
            raise FormatError("the chosen topic has no poses")
        origin = min(stamp for samples in tracks.values() for stamp, _ in samples)
        times = Counter(body for _, body in tracks)
        bodies = []
        for (topic, body), samples in tracks.items():
            clock = np.array([stamp - origin for stamp, _ in samples], dtype=np.float64)
            values = np.array([pose for _, pose in samples], dtype=np.float64)
            name = body if times[body] == 1 else f"{topic.strip('/')}/{body}"
            bodies.append(SpaceTrack(name, clock, values[:, :3], values[:, 3:]))
        flat = lay_flat(bodies, plane)
        if recorded:
            flat.notes.append(
                f"{recorded} poses have no time stamp: they stand at the time when they were "
                "recorded, which is later"
            )
        if len(parents) > 1:
            what = f"the poses are in different frames, {', '.join(sorted(parents))}"
            flat.notes.append(f"{what}: compare bodies of one frame only")
        return replace(flat, clock_unit="ns", clock_origin=origin, length_unit="m")


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """Open a bag; what goes wrong inside becomes a `FormatError`."""
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise InputError("a ROS bag needs rosbags: pip install 'driftwalk[ros]'") from error
    _refuse_nested(path)
    advice = "if it was cut off, mend it first (ros2 bag reindex, mcap recover)"
    with (
        damaged_as("as a ROS bag", path, advice=advice),
        # A bag that does not describe its messages is taken to hold those of a common ROS 2.
        AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader,
    ):
        yield reader


def _refuse_nested(path: Path) -> None:
    """Refuse a description of the bag that its reader would take many seconds for."""
    description = path / METADATA if path.is_dir() else path.with_name(METADATA)
    if not description.is_file():
        return
    # A larger description would name more than a thousand files; its reader takes a second for
    # that.
    marks = re.findall(rb"[\[\]{}]", read_bounded(description, most=MIB // 4))
    if max(accumulate((1 if mark in b"[{" else -1 for mark in marks), initial=0)) > MOST_LEVELS:
        raise FormatError(
            f"holds values nested more than {MOST_LEVELS} levels deep, as no bag does: it is "
            "damaged (ros2 bag reindex writes it again)",
            path=description,
        )


def _choose(connections: list[Any], topic: str | None) -> list[Any]:
    """Return the connections of the chosen topics, or of the only one that holds poses."""
    usable = [one for one in connections if one.msgtype in READ]
    topics = list(dict.fromkeys(one.topic for one in usable))
    if not topics:
        found = ", ".join(sorted({one.msgtype for one in connections})[:8]) or "no topics"
        known = ", ".join(name.rpartition("/")[2] for name in READ)
        raise FormatError(f"has no topic of poses, only {found}; read are {known}")
    wanted = [name.strip() for name in topic.split(",")] if topic is not None else topics
    if (len(wanted) > 1 and topic is None) or not set(wanted) <= set(topics):
        shown = ", ".join(
            f"{one.topic} ({one.msgtype.rpartition('/')[2]}, {one.msgcount} messages)"
            for one in usable
        )
        got = "several topics of poses" if topic is None else f"no topic of poses '{topic}'"
        raise InputError(f"the bag has {got}: name it with `topic`: {shown}")
    return [one for one in usable if one.topic in wanted]


def _collect(reader: Any, chosen: list[Any]) -> tuple[_Tracks, set[str], int]:
    """Return the tracks, the frames they are in, and how many poses have no time of their own."""
    tracks: _Tracks = defaultdict(list)
    parents: set[str] = set()
    recorded = 0
    for connection, received, data in reader.messages(connections=chosen):
        message = reader.deserialize(data, connection.msgtype)
        for body, stated, parent, values in _poses(message, connection.topic.strip("/")):
            stamp = 0 if stated is None else stated.sec * 1_000_000_000 + stated.nanosec
            recorded += stamp == 0
            tracks[connection.topic, body].append((stamp or received, values))
            parents.add(parent)
    return tracks, parents, recorded


_START: Final = re.compile(r"#\s*timestamp\b[^,]*(,\s*p_\w*[xyz]\b[^,]*){3}")
_PART: Final = re.compile(r"([pq])_(?:[A-Za-z]+_)*([wxyz])\s*(?:\[.*\])?")


class EurocLoader:
    """One body; velocities and biases that follow are not read."""

    name = "euroc"
    description = "EuRoC ground truth CSV (#timestamp [ns], p_RS_R_x [m], …, q_RS_w, …; z up)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the header."""
        return 0.9 if _START.match(first_line(head)) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the one body; its whole nanoseconds stay exact."""
        names = [name.lstrip("# ") for name in first_row(path)]
        matches = filter(None, map(_PART.fullmatch, names))
        columns = {"".join(one.groups()).removeprefix("p"): one[0] for one in matches}
        if lacking := [axis for axis in "xyz" if axis not in columns]:
            raise FormatError(f"the header names no column of p_…_{lacking[0]}", line=1)
        wanted = ("x", "y", "z", *(PARTS if set(PARTS) <= set(columns) else ()))
        used = {part: columns[part] for part in wanted}
        stated = unit_of_name(names[0])
        unit = stated if stated in CLOCK_UNITS else "ns"
        return _in_space(path, options, used, TableLayout(",", names, 1), unit)


def _in_space(
    path: Path, options: ReadOptions, columns: dict[str, str], layout: TableLayout, unit: str
) -> RawRecording:
    """Return the one body, whose clock is in the first column and has that unit."""
    named = {"t": f"{layout.names[0]}:{unit}", **columns}
    stated = replace(options, up=options.up or "z")
    return described(path, stated, named, layout, length_unit="m", y_axis="up")


_TUM: Final = ["timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw"]


class TumLoader:
    """One body, with its time stamps as they are."""

    name = "tum"
    description = "TUM trajectory (timestamp tx ty tz qx qy qz qw; s, m; z up)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise eight numbers of which the last four make a unit quaternion."""
        lines = first_lines(head, 20)
        rows = [line.split() for line in lines if not line.startswith("#")][:2]
        named = any(line.lstrip("# ").split() == _TUM for line in lines if line[:1] == "#")
        if not rows or not all(len(row) == len(_TUM) and is_numeric_row(row) for row in rows):
            return 0.0
        try:
            lengths = [math.hypot(*map(float, row[4:])) for row in rows]
        except ValueError:
            lengths = [0.0]
        return 0.9 if named or all(abs(one - 1.0) < 0.02 for one in lengths) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the one body."""
        comments = takewhile(lambda line: line.startswith("#"), header_rows(path, 20))
        layout = TableLayout(" ", _TUM, len([*comments]))
        columns = dict(zip(("x", "y", "z", *PARTS), _TUM[1:], strict=True))
        return _in_space(path, options, columns, layout, "s")


LOADERS = (RosLoader(), EurocLoader(), TumLoader())
