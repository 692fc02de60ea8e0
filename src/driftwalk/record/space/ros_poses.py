"""Poses in the messages of ROS: which body, at what time, where, how turned."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, Final, NamedTuple


class Pose(NamedTuple):
    """One body in one message."""

    body: str
    stamp: Any
    """The stamp of its header, None where the message has none."""
    parent: str
    """Frame that the pose is in, ``""`` where the message does not say."""
    values: tuple[float, ...]
    """Position x, y, z [m] and quaternion x, y, z, w."""


def _values(position: Any, orientation: Any) -> tuple[float, ...]:
    return (
        *(position.x, position.y, position.z),
        *(orientation.x, orientation.y, orientation.z, orientation.w),
    )


def _pose(message: Any, topic: str) -> Iterator[Pose]:
    yield Pose(topic, None, "", _values(message.position, message.orientation))


def _pose_2d(message: Any, topic: str) -> Iterator[Pose]:
    turned = (0.0, 0.0, math.sin(0.5 * message.theta), math.cos(0.5 * message.theta))
    yield Pose(topic, None, "", (message.x, message.y, 0.0, *turned))


def _pose_stamped(message: Any, topic: str) -> Iterator[Pose]:
    pose, header = message.pose, message.header
    yield Pose(topic, header.stamp, header.frame_id, _values(pose.position, pose.orientation))


def _with_covariance(message: Any, topic: str) -> Iterator[Pose]:
    pose, header = message.pose.pose, message.header
    name = getattr(message, "child_frame_id", "") or topic
    yield Pose(name, header.stamp, header.frame_id, _values(pose.position, pose.orientation))


def _pose_array(message: Any, _topic: str) -> Iterator[Pose]:
    header = message.header
    for number, pose in enumerate(message.poses):
        values = _values(pose.position, pose.orientation)
        yield Pose(str(number), header.stamp, header.frame_id, values)


def _transform(message: Any, _topic: str) -> Iterator[Pose]:
    transform, header = message.transform, message.header
    values = _values(transform.translation, transform.rotation)
    yield Pose(message.child_frame_id, header.stamp, header.frame_id, values)


def _transforms(message: Any, topic: str) -> Iterator[Pose]:
    for transform in message.transforms:
        yield from _transform(transform, topic)


READERS: Final[dict[str, Callable[[Any, str], Iterator[Pose]]]] = {
    "geometry_msgs/msg/Pose": _pose,
    "geometry_msgs/msg/Pose2D": _pose_2d,
    "geometry_msgs/msg/PoseStamped": _pose_stamped,
    "geometry_msgs/msg/PoseWithCovarianceStamped": _with_covariance,
    "geometry_msgs/msg/PoseArray": _pose_array,
    "geometry_msgs/msg/TransformStamped": _transform,
    "nav_msgs/msg/Odometry": _with_covariance,
    "tf2_msgs/msg/TFMessage": _transforms,
    "tf/msg/tfMessage": _transforms,
}
"""From a type of message to what takes the poses out of one, given the name of its topic."""
