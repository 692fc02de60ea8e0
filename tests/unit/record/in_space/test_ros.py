"""ROS 2 bags: poses of topics, bodies by frames, header stamps, and what is refused."""

from __future__ import annotations

import json
import shutil
import sqlite3
import struct
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from spatial import assert_spin, in_space, spin, wrapped

from driftwalk.core.errors import FormatError, InputError
from driftwalk.record import load
from driftwalk.schema import body_names, body_track

rosbag2 = pytest.importorskip("rosbags.rosbag2")
typesys = pytest.importorskip("rosbags.typesys")

START = 1_700_000_000_123_456_789
LATER = 40_000_000
"""Nanoseconds from a header's stamp to the time of recording."""
STORE = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
TYPES = STORE.types


def header(stamp: int, frame: str) -> Any:
    time = TYPES["builtin_interfaces/msg/Time"](stamp // 10**9, stamp % 10**9)
    return TYPES["std_msgs/msg/Header"](time, frame)


def pose(values: Any) -> Any:
    point = TYPES["geometry_msgs/msg/Point"](*values[:3])
    return TYPES["geometry_msgs/msg/Pose"](
        point, TYPES["geometry_msgs/msg/Quaternion"](*values[3:])
    )


def covered(values: Any) -> Any:
    return TYPES["geometry_msgs/msg/PoseWithCovariance"](pose(values), np.zeros(36))


def transform(stamp: int, child: str, values: Any, parent: str = "tank") -> Any:
    moved = TYPES["geometry_msgs/msg/Transform"](
        TYPES["geometry_msgs/msg/Vector3"](*values[:3]),
        TYPES["geometry_msgs/msg/Quaternion"](*values[3:]),
    )
    return TYPES["geometry_msgs/msg/TransformStamped"](header(stamp, parent), child, moved)


def odometry(stamp: int, values: Any) -> Any:
    twist = TYPES["geometry_msgs/msg/Twist"](
        *[TYPES["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0) for _ in range(2)]
    )
    twist = TYPES["geometry_msgs/msg/TwistWithCovariance"](twist, np.zeros(36))
    return TYPES["nav_msgs/msg/Odometry"](header(stamp, "odom"), "boat", covered(values), twist)


MESSAGES: dict[str, tuple[Callable[[int, Any], Any], list[str]]] = {
    "geometry_msgs/msg/PoseStamped": (
        lambda stamp, v: TYPES["geometry_msgs/msg/PoseStamped"](header(stamp, "tank"), pose(v)),
        ["block/pose"],
    ),
    "geometry_msgs/msg/PoseWithCovarianceStamped": (
        lambda stamp, v: TYPES["geometry_msgs/msg/PoseWithCovarianceStamped"](
            header(stamp, "tank"), covered(v)
        ),
        ["block/pose"],
    ),
    "geometry_msgs/msg/Pose": (lambda stamp, v: pose(v), ["block/pose"]),
    "geometry_msgs/msg/PoseArray": (
        lambda stamp, v: TYPES["geometry_msgs/msg/PoseArray"](
            header(stamp, "tank"), [pose(v), pose([v[0] + 1.0, *v[1:]])]
        ),
        ["0", "1"],
    ),
    "geometry_msgs/msg/TransformStamped": (
        lambda stamp, v: transform(stamp, "boat", v),
        ["boat"],
    ),
    "nav_msgs/msg/Odometry": (odometry, ["boat"]),
    "tf2_msgs/msg/TFMessage": (
        lambda stamp, v: TYPES["tf2_msgs/msg/TFMessage"](
            [transform(stamp, "a", v), transform(stamp, "b", [v[0] + 1.0, *v[1:]])]
        ),
        ["a", "b"],
    ),
}


def poses() -> Any:
    _, x, y, angle = spin()
    position, rotation = in_space("z", x, y, angle)
    return np.column_stack([position, rotation.as_quat()])


def write(path: Path, *topics: tuple[str, str, Iterator[Any] | list[Any]], mcap: bool) -> Path:
    plugins = rosbag2.StoragePlugin
    plugin = plugins.MCAP if mcap else plugins.SQLITE3
    with rosbag2.Writer(path, version=9, storage_plugin=plugin) as writer:
        for topic, kind, messages in topics:
            connection = writer.add_connection(topic, kind, typestore=STORE)
            for number, message in enumerate(messages):
                data = STORE.serialize_cdr(message, kind)
                writer.write(connection, START + LATER + 10**8 * number, data)
    return path


def bag(folder: Path, kind: str, *, mcap: bool = False, topic: str = "/block/pose") -> Path:
    make, _ = MESSAGES[kind]
    messages = [make(START + 10**8 * k, row.tolist()) for k, row in enumerate(poses())]
    return write(folder / "bag", (topic, kind, messages), mcap=mcap)


@pytest.mark.fast_cases(6)
@pytest.mark.parametrize("mcap", [False, True])
@pytest.mark.parametrize("kind", list(MESSAGES))
def test_every_kind_of_message(tmp_path: Path, kind: str, mcap: bool) -> None:
    dataset = load(bag(tmp_path, kind, mcap=mcap))
    assert dataset.attrs["format"] == "ros"
    assert body_names(dataset) == MESSAGES[kind][1]
    stamped = kind != "geometry_msgs/msg/Pose"
    begin = START if stamped else START + LATER
    assert dataset.attrs["time_origin_unix_s"] == pytest.approx(begin / 1e9, abs=1e-6)
    for shift, name in enumerate(body_names(dataset)):
        track = body_track(dataset, name)
        np.testing.assert_allclose(track.time, spin()[0], atol=1e-12)
        assert_spin(track, shift=shift, digits=1e-15, turn=1e-12)
    notes = json.loads(dataset.attrs["counts"])["warnings"]
    assert [note for note in notes if "no time stamp" in note] == (
        []
        if stamped
        else [
            "40 poses have no time stamp: they stand at the time when they were recorded, "
            "which is later"
        ]
    )


@pytest.mark.parametrize("name", ["ros2_pose_sqlite3", "ros2_pose_mcap"])
def test_the_real_bags(shared_data: Callable[[str], Path], name: str) -> None:
    folder = shared_data("formats-2")
    expected = by_hand(folder / "ros2_pose_sqlite3" / "ros2_pose_sqlite3.db3")
    for path in (folder / name, next((folder / name).glob(f"{name}.*"))):
        track = body_track(load(path))
        stamps = expected[:, 0]
        np.testing.assert_allclose(track.time, stamps - stamps[0], atol=1e-12)
        np.testing.assert_array_equal(track.x, expected[:, 1])
        np.testing.assert_array_equal(track.y, expected[:, 2])
        np.testing.assert_allclose(
            wrapped(track.theta - 2 * np.arctan2(expected[:, 6], expected[:, 7])), 0.0, atol=1e-12
        )


def by_hand(path: Path) -> Any:
    """Return stamp [s after 1 700 000 000] and pose of each message, by the rules of CDR."""
    with sqlite3.connect(f"file:{path}?mode=ro&immutable=1", uri=True) as database:
        blobs = [row[0] for row in database.execute("SELECT data FROM messages ORDER BY id")]
    rows = []
    for blob in blobs:
        body = blob[4:]
        seconds, nanoseconds, length = struct.unpack_from("<iII", body)
        at = (12 + length + 7) // 8 * 8
        rows.append([seconds - 1.7e9 + nanoseconds / 1e9, *struct.unpack_from("<7d", body, at)])
    return np.array(rows)


def two_topics(folder: Path) -> Path:
    kind = "geometry_msgs/msg/PoseStamped"
    make, _ = MESSAGES[kind]
    rows = [(START + 10**8 * k, row.tolist()) for k, row in enumerate(poses())]
    moved = [(stamp, [v[0] + 1.0, *v[1:]]) for stamp, v in rows]
    return write(
        folder / "bag",
        ("/a/pose", kind, [make(*row) for row in rows]),
        ("/b/pose", kind, [make(*row) for row in moved]),
        mcap=False,
    )


def test_several_topics_have_to_be_named(tmp_path: Path) -> None:
    path = two_topics(tmp_path)
    shown = r"/a/pose \(PoseStamped, 40 messages\), /b/pose \(PoseStamped, 40 messages\)"
    with pytest.raises(InputError, match=f"several topics of poses: name it with `topic`: {shown}"):
        load(path)
    with pytest.raises(InputError, match=f"no topic of poses '/c'.*{shown}"):
        load(path, topic="/c")
    assert body_names(load(path, topic="/b/pose")) == ["b/pose"]
    both = load(path, topic="/a/pose,/b/pose")
    assert body_names(both) == ["a/pose", "b/pose"]
    np.testing.assert_allclose(both.x.values[:, 1] - both.x.values[:, 0], 1.0, atol=1e-12)


def test_a_stamp_that_was_never_set_is_the_time_of_recording(tmp_path: Path) -> None:
    make, _ = MESSAGES["geometry_msgs/msg/PoseStamped"]
    path = write(
        tmp_path / "bag",
        ("/p", "geometry_msgs/msg/PoseStamped", [make(0, row.tolist()) for row in poses()]),
        mcap=True,
    )
    dataset = load(path)
    np.testing.assert_allclose(dataset.time.values, spin()[0], atol=1e-12)
    assert "40 poses have no time stamp" in dataset.attrs["counts"]


def test_different_parents_are_said(tmp_path: Path) -> None:
    row = poses()[0].tolist()
    messages = [
        TYPES["tf2_msgs/msg/TFMessage"](
            [
                transform(START + k * 10**8, "a", row),
                transform(START + k * 10**8, "b", row, parent="a"),
            ]
        )
        for k in range(3)
    ]
    path = write(tmp_path / "bag", ("/tf", "tf2_msgs/msg/TFMessage", messages), mcap=False)
    assert "different frames, a, tank" in load(path).attrs["counts"]


def test_a_bag_without_poses(tmp_path: Path) -> None:
    text = TYPES["std_msgs/msg/String"]
    path = write(tmp_path / "bag", ("/chat", "std_msgs/msg/String", [text("hi")]), mcap=False)
    with pytest.raises(FormatError, match="no topic of poses, only std_msgs/msg/String; read are"):
        load(path)


@pytest.mark.parametrize("mcap", [False, True])
@pytest.mark.parametrize("share", [0.0, 0.03, 0.5, 0.95])
def test_a_truncated_bag(tmp_path: Path, mcap: bool, share: float) -> None:
    path = bag(tmp_path, "geometry_msgs/msg/PoseStamped", mcap=mcap)
    (file,) = (one for one in path.iterdir() if one.suffix in (".db3", ".mcap"))
    content = file.read_bytes()
    file.write_bytes(content[: int(share * len(content))])
    for one in (path, file):
        with pytest.raises(InputError) as caught:
            load(one)
        assert "\n" not in str(caught.value)


def test_a_folder_with_other_metadata(tmp_path: Path) -> None:
    shutil.copy(bag(tmp_path, "nav_msgs/msg/Odometry") / "metadata.yaml", tmp_path)
    (tmp_path / "metadata.yaml").write_text("title: [1\n")
    with pytest.raises(FormatError, match="cannot be read as a ROS bag"):
        load(tmp_path)


def test_without_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = bag(tmp_path, "geometry_msgs/msg/Pose")
    for module in [name for name in sys.modules if name.partition(".")[0] == "rosbags"]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, "rosbags", None)
    with pytest.raises(InputError, match=r"needs rosbags: pip install 'driftwalk\[ros\]'"):
        load(path)
