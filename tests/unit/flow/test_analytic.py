"""Analytic flow fields: exact values, and the values between the nodes."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr
from scipy.interpolate import RegularGridInterpolator

from driftwalk.core.errors import InputError
from driftwalk.flow import (
    bilinear,
    flow_from_function,
    jets_flow,
    jets_velocity,
    shear_flow,
    shear_velocity,
    uniform_flow,
    uniform_velocity,
    vortex_flow,
    vortex_velocity,
)
from driftwalk.schema import FLAGS, build_flow_field

Array = npt.NDArray[np.float64]
Velocity = Callable[..., tuple[Array, Array]]


def derivatives(velocity: Velocity, x: Array, y: Array, **options: Any) -> tuple[Array, Array]:
    """Return divergence and vorticity by central differences."""
    h = 1e-6
    east, west = velocity(x + h, y, **options), velocity(x - h, y, **options)
    north, south = velocity(x, y + h, **options), velocity(x, y - h, **options)
    u_x, v_x = ((a - b) / (2 * h) for a, b in zip(east, west, strict=True))
    u_y, v_y = ((a - b) / (2 * h) for a, b in zip(north, south, strict=True))
    return u_x + v_y, v_x - u_y


def places(seed: int = 0) -> tuple[Array, Array]:
    r, angle = np.random.default_rng(seed).uniform([[0.001], [0.0]], [[0.14], [6.28]], (2, 300))
    return r * np.cos(angle), r * np.sin(angle)


def test_uniform() -> None:
    u, v = uniform_velocity(np.zeros((3, 4)), 1.0, u=0.1, v=-0.2)
    assert u.shape == v.shape == (3, 4)
    assert (u == 0.1).all()
    assert (v == -0.2).all()


def test_solid_rotation() -> None:
    x, y = places()
    u, v = vortex_velocity(x, y, angular_velocity=0.7)
    np.testing.assert_allclose(u * x + v * y, 0.0, atol=1e-15)
    np.testing.assert_allclose(np.hypot(u, v), 0.7 * np.hypot(x, y))
    divergence, vorticity = derivatives(vortex_velocity, x, y, angular_velocity=0.7)
    np.testing.assert_allclose(divergence, 0.0, atol=1e-8)
    np.testing.assert_allclose(vorticity, 1.4, atol=1e-8)


def test_rankine_vortex() -> None:
    x, y = places()
    r = np.hypot(x, y)
    options = {"angular_velocity": 2.0, "core_radius": 0.05}
    speed = np.hypot(*vortex_velocity(x, y, **options))
    np.testing.assert_allclose(speed[r < 0.05], 2.0 * r[r < 0.05])
    np.testing.assert_allclose(speed[r > 0.05], 2.0 * 0.05**2 / r[r > 0.05])
    divergence, vorticity = derivatives(vortex_velocity, x, y, **options)
    np.testing.assert_allclose(divergence, 0.0, atol=1e-6)
    np.testing.assert_allclose(vorticity[r > 0.0501], 0.0, atol=1e-6)


def test_shear() -> None:
    u, v = shear_velocity(0.3, np.array([-0.1, 0.02, 0.1]), rate=0.5, at_rest=0.02)
    np.testing.assert_allclose(u, [-0.06, 0.0, 0.04], atol=1e-16)
    np.testing.assert_array_equal(v, 0.0)


def test_swirl_and_sink_without_jets() -> None:
    x, y = places()
    r = np.hypot(x, y)
    u, v = jets_velocity(x, y, inlet_angles=[], swirl_speed=0.04, sink_speed=0.01)
    shape = 4.0 * (r / 0.15) * (1.0 - r / 0.15)
    np.testing.assert_allclose((v * x - u * y) / r, 0.04 * shape, atol=1e-15)
    np.testing.assert_allclose((u * x + v * y) / r, -0.01 * shape, atol=1e-15)


def test_a_jet_decays_spreads_and_keeps_its_momentum() -> None:
    only = {"inlet_angles": [0.0], "swirl_speed": 0.0, "sink_speed": 0.0}
    beside = np.linspace(-0.1, 0.1, 4001)
    momenta = []
    for along in (0.0, 0.05, 0.15):
        u, v = jets_velocity(np.full_like(beside, 0.15 - along), beside, jet_width=0.01, **only)
        width = 0.01 + 0.1 * along
        np.testing.assert_allclose(
            u, -0.1 * np.sqrt(0.01 / width) * np.exp(-((beside / width) ** 2))
        )
        np.testing.assert_allclose(v, 0.0, atol=1e-15)
        momenta.append(np.sum(u**2))
    np.testing.assert_allclose(momenta, momenta[0], rtol=1e-9)


def test_an_inclined_jet_turns_to_the_left_of_the_inward_normal() -> None:
    u, v = jets_velocity(
        0.15, 0.0, inlet_angles=[0.0], inclination=0.25 * math.pi, swirl_speed=0.0, sink_speed=0.0
    )
    np.testing.assert_allclose([u, v], [-0.1 / math.sqrt(2), -0.1 / math.sqrt(2)])
    behind = jets_velocity(0.16, 0.0, inlet_angles=[0.0], swirl_speed=0.0, sink_speed=0.0)
    np.testing.assert_array_equal(behind, [0.0, 0.0])


def test_four_jets_have_a_fourfold_symmetry() -> None:
    x, y = places()
    u, v = jets_velocity(x, y, inclination=0.3)
    turned_u, turned_v = jets_velocity(-y, x, inclination=0.3)
    np.testing.assert_allclose(turned_u, -v, atol=1e-12)
    np.testing.assert_allclose(turned_v, u, atol=1e-12)


@pytest.mark.parametrize(
    ("field", "velocity", "options"),
    [
        (uniform_flow(0.1, -0.2), uniform_velocity, {"u": 0.1, "v": -0.2}),
        (vortex_flow(0.7), vortex_velocity, {"angular_velocity": 0.7}),
        (shear_flow(0.5), shear_velocity, {"rate": 0.5}),
        (jets_flow(inclination=0.3), jets_velocity, {"radius": 0.15, "inclination": 0.3}),
    ],
)
def test_fields_hold_the_exact_values(
    field: xr.Dataset, velocity: Velocity, options: dict[str, Any]
) -> None:
    x, y = np.meshgrid(field.x, field.y)
    u, v = velocity(x, y, **options)
    np.testing.assert_array_equal(field.u, u)
    np.testing.assert_array_equal(field.v, v)
    inside = np.hypot(x, y) <= 0.15
    np.testing.assert_array_equal(field.flag == FLAGS["measured"], inside)
    np.testing.assert_array_equal(field.flag == FLAGS["outside"], ~inside)


def test_bilinear_is_exact_for_linear_fields_and_clamped_outside() -> None:
    x, y = np.random.default_rng(1).uniform(-0.147, 0.147, (2, 300))
    for field, velocity, options in (
        (vortex_flow(0.7), vortex_velocity, {"angular_velocity": 0.7}),
        (shear_flow(0.5, at_rest=0.01), shear_velocity, {"rate": 0.5, "at_rest": 0.01}),
    ):
        np.testing.assert_allclose(bilinear(field, x, y), velocity(x, y, **options), atol=1e-15)
        far = bilinear(field, [1.0, -1.0], [0.05, -1.0])
        edge = velocity(np.array([0.147, -0.147]), np.array([0.05, -0.147]), **options)
        np.testing.assert_allclose(far, edge, atol=1e-15)


def test_bilinear_against_scipy_on_a_random_field() -> None:
    rng = np.random.default_rng(2)
    x, y = np.linspace(-1.0, 3.0, 7), np.linspace(0.0, 1.0, 5)
    u, v = rng.normal(size=(2, 5, 7))
    field = build_flow_field(x, y, u=u, v=v, flag=np.ones((5, 7)))
    at_x, at_y = rng.uniform(-2.0, 4.0, (20, 1)), rng.uniform(-0.5, 1.5, 30)
    got = bilinear(field, at_x, at_y)
    clamped = np.stack(
        np.broadcast_arrays(np.clip(at_y, 0.0, 1.0), np.clip(at_x, -1.0, 3.0)), axis=-1
    )
    for one, nodes in zip(got, (u, v), strict=True):
        oracle = RegularGridInterpolator((y, x), nodes)(clamped)
        np.testing.assert_allclose(one, oracle, atol=1e-13)


def test_frames_are_interpolated_in_time() -> None:
    ones = np.ones((2, 2))
    field = build_flow_field(
        [0.0, 1.0],
        [0.0, 1.0],
        u=[ones, 3 * ones, 5 * ones],
        v=[0 * ones, ones, 0 * ones],
        flag=[ones, ones, ones],
        time=[0.0, 1.0, 3.0],
    )
    times = {-1.0: (1, 0), 0.0: (1, 0), 0.5: (2, 0.5), 1.0: (3, 1), 2.0: (4, 0.5), 9.0: (5, 0)}
    for time, expected in times.items():
        np.testing.assert_allclose(bilinear(field, 0.5, 0.5, time=time), expected)
    with pytest.raises(InputError, match="give a time"):
        bilinear(field, 0.5, 0.5)
    single = field.isel(time=[1])
    np.testing.assert_allclose(bilinear(single, 0.0, 0.0, time=7.0), (3, 1))


def test_refusals() -> None:
    with pytest.raises(InputError, match="core_radius"):
        vortex_velocity(0.0, 0.0, angular_velocity=1.0, core_radius=0.0)
    with pytest.raises(InputError, match="jet_width"):
        jets_velocity(0.0, 0.0, jet_width=0.0)
    with pytest.raises(InputError, match="not finite"):
        bilinear(uniform_flow(0.1, 0.0), math.nan, 0.0)


def test_other_tanks() -> None:
    arena = {"shape": "rectangle", "width_m": 0.4, "height_m": 0.2}
    field = flow_from_function(lambda x, y: (0 * x, x * y), arena=arena, cell_size=0.05)
    assert (field.sizes["y"], field.sizes["x"]) == (4, 8)
    np.testing.assert_allclose(field.v, np.outer(field.y, field.x))
