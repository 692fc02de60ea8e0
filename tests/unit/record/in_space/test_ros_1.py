"""Bags of ROS 1: the same messages, with the header that ROS 1 gives them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from driftwalk.core.errors import InputError
from driftwalk.record import load

rosbag1 = pytest.importorskip("rosbags.rosbag1")
typesys = pytest.importorskip("rosbags.typesys")

N = 40
START = 1_700_000_000_123_456_789
TIMES = START + 40_000_000 * np.arange(N)
ANGLE = 0.12 * np.arange(N)
X, Y = 0.1 + 0.05 * np.cos(ANGLE), 0.2 + 0.05 * np.sin(ANGLE)
STORE = typesys.get_typestore(typesys.Stores.ROS1_NOETIC)
TYPES = STORE.types


def header(stamp: int) -> Any:
    time = TYPES["builtin_interfaces/msg/Time"](int(stamp // 10**9), int(stamp % 10**9))
    return TYPES["std_msgs/msg/Header"](0, time, "tank")


def pose(k: int, aside: float = 0.0) -> Any:
    return TYPES["geometry_msgs/msg/Pose"](
        TYPES["geometry_msgs/msg/Point"](X[k] + aside, Y[k], 0.0),
        TYPES["geometry_msgs/msg/Quaternion"](0, 0, np.sin(ANGLE[k] / 2), np.cos(ANGLE[k] / 2)),
    )


def odometry(k: int) -> Any:
    still = TYPES["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0)
    twist = TYPES["geometry_msgs/msg/Twist"](still, still)
    covariance = np.zeros(36)
    return TYPES["nav_msgs/msg/Odometry"](
        header(TIMES[k]),
        "base",
        TYPES["geometry_msgs/msg/PoseWithCovariance"](pose(k), covariance),
        TYPES["geometry_msgs/msg/TwistWithCovariance"](twist, covariance),
    )


MESSAGES: dict[str, Any] = {
    "geometry_msgs/msg/PoseStamped": lambda k: TYPES["geometry_msgs/msg/PoseStamped"](
        header(TIMES[k]), pose(k)
    ),
    "nav_msgs/msg/Odometry": odometry,
    "geometry_msgs/msg/PoseArray": lambda k: TYPES["geometry_msgs/msg/PoseArray"](
        header(TIMES[k]), [pose(k), pose(k, 0.1)]
    ),
    "geometry_msgs/msg/TransformStamped": lambda k: TYPES["geometry_msgs/msg/TransformStamped"](
        header(TIMES[k]),
        "block",
        TYPES["geometry_msgs/msg/Transform"](
            TYPES["geometry_msgs/msg/Vector3"](X[k], Y[k], 0.0), pose(k).orientation
        ),
    ),
    "geometry_msgs/msg/Pose2D": lambda k: TYPES["geometry_msgs/msg/Pose2D"](X[k], Y[k], ANGLE[k]),
}


def bag(path: Path, kind: str, *, topics: tuple[str, ...] = ("/block",)) -> Path:
    with rosbag1.Writer(path) as writer:
        for topic in topics:
            connection = writer.add_connection(topic, kind, typestore=STORE)
            for k in range(N):
                message = STORE.serialize_ros1(MESSAGES[kind](k), kind)
                writer.write(connection, int(TIMES[k]), message)
    return path


@pytest.mark.parametrize("kind", list(MESSAGES))
def test_messages_of_ros_1(tmp_path: Path, kind: str) -> None:
    found = load(bag(tmp_path / "run.bag", kind))
    assert found.attrs["format"] == "ros"
    assert found.sizes == {"time": N, "body": 2 if kind.endswith("Array") else 1}
    np.testing.assert_allclose(found["time"], (TIMES - START) / 1e9, atol=1e-12)
    np.testing.assert_allclose(found["x"].values[:, 0], X, rtol=1e-12)
    np.testing.assert_allclose(found["y"].values[:, 0], Y, rtol=1e-12)
    turned = np.exp(1j * found["theta"].values[:, 0])
    np.testing.assert_allclose(turned, np.exp(1j * ANGLE), atol=1e-12)


def test_topics_and_damage(tmp_path: Path) -> None:
    path = bag(tmp_path / "run.bag", "geometry_msgs/msg/PoseStamped", topics=("/a", "/b"))
    with pytest.raises(InputError, match=r"several topics of poses: name it with `topic`: /a"):
        load(path)
    assert load(path, topic="/a").sizes["body"] == 1
    assert load(path, topic="/a,/b").sizes["body"] == 2
    content = path.read_bytes()
    for share in (0.001, 0.3, 0.95):
        path.write_bytes(content[: int(share * len(content))])
        with pytest.raises(InputError) as caught:
            load(path, topic="/a")
        assert "\n" not in str(caught.value)
