"""Poses in space laid into the plane of the water: axes, angles and what speaks against them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from spatial import PLANES, in_space, spin, wrapped

from driftwalk.core.errors import InputError
from driftwalk.record.space import QUATERNION, VECTOR, SpaceTrack, lay_flat, plane_of


def in_form(rotation: Rotation, form: str) -> tuple[np.ndarray, str, bool]:
    if form == QUATERNION:
        return rotation.as_quat(), form, False
    if form == VECTOR:
        return rotation.as_rotvec(degrees=True), form, True
    return rotation.as_euler(form, degrees=True), form, True


def turned(turns: np.ndarray, form: str) -> SpaceTrack:
    return SpaceTrack("a", np.arange(len(turns)), np.zeros((len(turns), 3)), turns, form)


@pytest.mark.parametrize("up", list(PLANES))
def test_planes_are_right_handed_and_seen_from_above(up: str) -> None:
    x, y, upward = plane_of(up).vectors
    np.testing.assert_array_equal(np.cross(x, y), upward)
    np.testing.assert_array_equal(x, PLANES[up][0])
    np.testing.assert_array_equal(y, PLANES[up][1])


@pytest.mark.parametrize("up", list(PLANES))
@pytest.mark.parametrize("form", [QUATERNION, VECTOR, "XYZ", "ZYX", "YZX"])
def test_a_body_that_turns_about_the_upward_axis(up: str, form: str) -> None:
    time, x, y, angle = spin()
    position, rotation = in_space(up, x, y, angle)
    flat = lay_flat([SpaceTrack("a", time, position, *in_form(rotation, form))], plane_of(up))
    (body,) = flat.bodies
    assert flat.notes == []
    np.testing.assert_allclose(body.x, x, rtol=0, atol=1e-15)
    np.testing.assert_allclose(body.y, y, rtol=0, atol=1e-15)
    # Rounding of a dozen products and an arc tangent of numbers of size 1.
    assert body.theta is not None
    np.testing.assert_allclose(wrapped(body.theta - angle), 0.0, atol=1e-12)


def test_the_angle_of_a_body_that_pitches_and_rolls_is_its_yaw() -> None:
    random = np.random.default_rng(3)
    yaw, pitch, roll = random.uniform([[-3.0], [-0.6], [-0.6]], [[3.0], [0.6], [0.6]], (3, 200))
    rotation = Rotation.from_euler("ZYX", np.column_stack([yaw, pitch, roll]))
    angle, tilt = turned(rotation.as_quat(), QUATERNION).in_plane(plane_of("z"))
    np.testing.assert_allclose(angle, rotation.as_euler("ZYX")[:, 0], atol=1e-12)
    # The upward axis of the body has the height cos(pitch) cos(roll).
    np.testing.assert_allclose(tilt, np.arccos(np.cos(pitch) * np.cos(roll)), atol=1e-7)


def test_a_vector_longer_than_a_turn_is_the_same_orientation() -> None:
    vector = np.array([[0.0, 0.0, 0.3], [0.0, 0.0, 0.3 - 2 * np.pi]])
    angle, _ = turned(vector, VECTOR).in_plane(plane_of("z"))
    np.testing.assert_allclose(angle, 0.3, atol=1e-12)


def test_unknown_orientations_and_positions_stay_unknown() -> None:
    values = np.array([[0, 0, 0, 1.0], [np.nan] * 4, [0, 0, 0, 0], [0, 0, 1.0, 0]])
    position = np.array([[1, 2, 3.0], [np.nan] * 3, [1, 2, np.inf], [4, 5, 6]])
    track = SpaceTrack("a", np.arange(4.0), position, values, QUATERNION)
    (body,) = lay_flat([track], plane_of("z")).bodies
    np.testing.assert_array_equal(body.theta, [0.0, np.nan, np.nan, np.pi])
    np.testing.assert_array_equal(np.isfinite(body.x), [True, False, False, True])


def test_quaternions_that_are_none_are_refused() -> None:
    with pytest.raises(InputError, match=r"a length of 3\.162 instead of 1"):
        turned(np.array([[1.0, 0.0, 3.0, 0.0]]), QUATERNION).in_plane(plane_of("z"))


def test_no_such_axis() -> None:
    with pytest.raises(InputError, match=r"`up` is one of x, y, z, -x, -y, -z; got 'w'"):
        plane_of("w")


@pytest.mark.parametrize(("up", "said"), [("z", 0), ("y", 2)])
def test_a_wrong_axis_is_noticed(up: str, said: int) -> None:
    time, x, y, angle = spin()
    position, rotation = in_space("z", 0.3 * x, y, angle)
    track = SpaceTrack("a", time, position, *in_form(rotation, QUATERNION))
    notes = lay_flat([track], plane_of(up)).notes
    assert len(notes) == said
    assert all("is `up` right?" in note for note in notes)
