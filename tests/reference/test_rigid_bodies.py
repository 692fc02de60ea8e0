"""Discs, rectangles and glued blocks against closed forms and against plain NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import plain_bodies as plain
import pytest
from dense_innovations import GRID, WAVY, linear_coefficients, slope
from scipy.interpolate import BSpline
from single_block import NODES

import driftwalk as dw
from driftwalk import _core
from driftwalk.model.rigid_bodies import Measures, rigid_body
from driftwalk.schema import build_flow_field
from driftwalk.simulation.backend import Camera, native_model

MASS, DRAG, DENSITY = 0.024, 0.5, 1000.0
EXACT = {"position_noise_m": 0.0, "orientation_noise_rad": 0.0, "position_quantum_m": 0.0}
# A saddle, a rotation and a shear of 0.31 /s: the table of the simulator holds each exactly.
GRADIENTS = {
    "rotation": [[0.0, -0.31], [0.31, 0.0]],
    "saddle": [[0.31, 0.0], [0.0, -0.31]],
    "shear": [[0.0, 0.31], [0.0, 0.0]],
}
BODIES = {
    "rectangle:4x2cm": lambda hidden: plain.rectangle(0.04, 0.02),
    "xx:3cm": lambda hidden: plain.glued("xx", 0.03, hidden),
    "x./xx:3cm": lambda hidden: plain.glued("x./xx", 0.03, hidden),
}
CASES = [
    (shape, hidden)
    for shape in BODIES
    for hidden in ((0.0, 0.5, 1.0) if shape.startswith("x") else (0.0,))
]


def study(shape: str, hidden: float = 0.0, **sections: Any) -> dw.Study:
    forces = {"drag_coefficient": DRAG, "force_std_N": 0.0} | sections.pop("forces", {})
    return dw.Study(
        block={"shape": shape, "mass_kg": MASS}, forces=forces, observation=EXACT,
        assembly={"hidden_face_drag": hidden}, **sections,
    )  # fmt: skip


def scale_of(study_: dw.Study) -> float:
    return 0.5 * DENSITY * study_.forces.drag_coefficient * study_.wetted_depth_m


def field(water: plain.Water, axis: plain.Floats = NODES) -> Any:
    x, y = np.meshgrid(axis, axis)
    found = water(x + 1j * y) + 0j * x
    flag = np.ones(x.shape, dtype=np.int8)
    return build_flow_field(axis, axis, u=found.real, v=found.imag, flag=flag)


def linear(gradient: Any) -> plain.Water:
    (a, b), (c, d) = gradient

    def water(z: plain.Complexes) -> plain.Complexes:
        return a * z.real + b * z.imag + 1j * (c * z.real + d * z.imag)

    return water


def drags_of(study_: dw.Study, water: plain.Water, states: Any) -> list[plain.Floats]:
    """Return force and torque in the simulation, of each state."""
    model = native_model(study_, field(water), np.zeros(1), Camera())
    drag = study_.forces.drag_coefficient
    names = ("x", "y", "theta", "vx", "vy", "omega")
    return [
        np.array(_core.drag(model, drag_coefficient=drag, **dict(zip(names, one, strict=True))))
        for one in np.asarray(states).tolist()
    ]


def test_a_disc_has_the_drag_of_its_diameter_in_any_direction() -> None:
    """F = 1/2 rho C_d D d |w| w; its spin brakes by F R², without a force across."""
    body, diameter = study("disc:4cm"), 0.04
    force = 0.5 * DENSITY * DRAG * diameter * body.wetted_depth_m * 0.05
    cases = [(a, spin) for a in np.linspace(0.0, 2 * np.pi, 37) for spin in (0.0, 3.0)]
    moving = [0.05 * np.exp(1j * a) for a, _ in cases]
    states = [
        (0.01, 0.02, 0.4, -w.real, -w.imag, spin)
        for w, (_, spin) in zip(moving, cases, strict=True)
    ]
    found = drags_of(body, lambda z: 0j * z, states)
    for w, (_, spin), (x, y, torque) in zip(moving, cases, found, strict=True):
        assert abs(complex(x, y) - force * w) < 1e-3 * force * 0.05
        # Its panels are not in pairs: a slip turns it by up to three thousandths of F R.
        want = -force * spin * (diameter / 2) ** 2
        assert torque == pytest.approx(want, rel=5e-3, abs=3e-3 * force * 0.05 * diameter / 2)


@pytest.mark.parametrize("spin", [0.0, 0.31, -2.0])
def test_the_water_turns_a_disc_with_it(spin: float) -> None:
    """In water that turns with W, the rim's slip along it is R (W - omega): torque F R² / w."""
    body, turning, radius = study("disc:4cm"), 0.31, 0.02
    place = np.array([0.05 - 0.02j, -0.03 + 0.06j, 0.02 + 0.01j])
    for z in place:
        slip = 0.04 * np.exp(0.7j)
        velocity = 1j * turning * z - slip
        state = (z.real, z.imag, 0.0, velocity.real, velocity.imag, spin)
        (found,) = drags_of(body, linear(GRADIENTS["rotation"]), [state])
        # The panels see the water turn: closing speeds are those of the slip alone.
        want = 2 * scale_of(body) * radius * abs(slip) * (turning - spin) * radius**2
        assert found[2] == pytest.approx(
            want, rel=1e-3, abs=2e-3 * scale_of(body) * 2 * radius * abs(slip) ** 2 * radius
        )


@pytest.mark.parametrize("name", GRADIENTS)
@pytest.mark.parametrize(("shape", "hidden"), CASES)
def test_drag_is_the_sum_of_brute_force_strips(shape: str, hidden: float, name: str) -> None:
    body, own = study(shape, hidden), BODIES[shape](hidden)
    assert body.block.inertia_kg_m2 == pytest.approx(MASS * own.square_radius, rel=1e-9)
    rng = np.random.default_rng(4)
    water = linear(GRADIENTS[name])
    states = rng.uniform(-1, 1, (6, 6)) * [0.1, 0.1, np.pi, 0.1, 0.1, 5.0]
    for state, found in zip(states, drags_of(body, water, states), strict=True):
        x, y, angle, vx, vy, spin = state
        force, torque = plain.drag(
            own, water, scale_of(body), complex(x, y), angle, complex(vx, vy), spin
        )
        np.testing.assert_allclose(found, [force.real, force.imag, torque], rtol=1e-8, atol=1e-13)


def test_strips_are_fine_enough() -> None:
    """Eight strips a side against 400, as the share of the largest force and torque."""
    for shape, coarse in BODIES.items():
        fine = {
            "rectangle:4x2cm": plain.rectangle(0.04, 0.02, 400),
            "xx:3cm": plain.glued("xx", 0.03, 0.5, 400),
            "x./xx:3cm": plain.glued("x./xx", 0.03, 0.5, 400),
        }[shape]
        rng, off, size = np.random.default_rng(2), np.zeros((40, 3)), np.zeros((40, 3))
        for k in range(40):
            x, y, angle, vx, vy, spin = rng.uniform(-1, 1, 6) * [0.1, 0.1, np.pi, 0.05, 0.05, 1.0]
            given = (complex(x, y), angle, complex(vx, vy), spin)
            for body, row in ((coarse(0.5), off), (fine, size)):
                force, torque = plain.drag(body, linear(GRADIENTS["shear"]), 1.0, *given)
                row[k] = force.real, force.imag, torque
        assert np.abs(off - size).max(axis=0) == pytest.approx(
            0.0, abs=0.01 * np.abs(size).max()
        ), shape


AXIS = np.linspace(-0.2, 0.2, 81)


def bilinear(values: plain.Complexes) -> plain.Water:
    """Return the water between the nodes of AXIS."""
    step = AXIS[1] - AXIS[0]

    def water(z: plain.Complexes) -> plain.Complexes:
        column, row = (z.real - AXIS[0]) / step, (z.imag - AXIS[0]) / step
        i, j = column.astype(int), row.astype(int)
        fx, fy = column - i, row - j
        low = (1 - fx) * values[j, i] + fx * values[j, i + 1]
        return (1 - fy) * low + fy * ((1 - fx) * values[j + 1, i] + fx * values[j + 1, i + 1])

    return water


def swirl(z: plain.Complexes) -> plain.Complexes:
    """A swirl of 5 cm/s with jets, that draws inwards."""
    jets = 0.015 * np.sin(25 * z.imag) + 0.015j * np.cos(30 * z.real)
    return (0.45j - 0.2) * z * np.exp(-((np.abs(z) / 0.14) ** 4)) + jets


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "own"),
    [
        ("disc:4cm", plain.disc(0.04)),
        ("rectangle:4x2cm", plain.rectangle(0.04, 0.02)),
        ("xx:3cm", plain.glued("xx", 0.03, 0.5)),
    ],
    ids=["disc", "rectangle", "dimer"],
)
def test_a_path_of_20_s_is_that_of_another_integrator(shape: str, own: plain.Plain) -> None:
    x, y = np.meshgrid(AXIS, AXIS)
    values = swirl(x + 1j * y)
    times = np.linspace(0.0, 20.0, 41)
    body = study(shape, 0.5, simulation={"time_step_s": 2e-3}, tank={"diameter_m": 0.4})
    place, angle = plain.moved(
        own, bilinear(values), scale_of(body), MASS, times, place=0.05 + 0.02j, angle=0.3,
        step=0.02,
    )  # fmt: skip
    for backend in ("cpu", "reference"):
        found = dw.simulate(
            body, field(swirl, AXIS), sample_time=times, replicates=1, backend=backend,
            start=dw.simulation.Start(0.05, 0.02, 0.3),
        )  # fmt: skip
        path = found["x"].values[0, :, 0] + 1j * found["y"].values[0, :, 0]
        assert np.abs(path - place).max() < 1.5e-4
        turned = np.exp(1j * found["theta"].values[0, :, 0])
        assert np.abs(np.angle(turned * np.exp(-1j * angle))).max() < 0.02
    assert np.abs(place).max() < 0.2 - np.abs(own.middle).max() - 1e-3
    assert np.abs(np.diff(place)).sum() > 0.3


FILTERED = {"disc": 4, "rectangle": 6, "xx": 6, "x./xx": 6}


def expected(
    shape: str, mean: plain.Floats, covariance: plain.Floats, coefficients: plain.Floats,
    orientation: str, **given: Any,
) -> dict[str, plain.Floats]:  # fmt: skip
    body = rigid_body(shape, Measures(0.04, 0.02 if shape == "rectangle" else None, 8))
    return _core.expected_drag(
        side=0.04, mass=MASS, depth=0.04, strips=8, water_density=DENSITY, **GRID,
        coefficients=np.ascontiguousarray(coefficients), drag_coefficient=DRAG,
        orientation=orientation, mean=np.ascontiguousarray(mean), theta=0.0, omega=0.0,
        covariance=covariance, panels=body.panels, moment_points=body.moment_points,
        mass_by_inertia=1.0 / body.moment_m2, symmetry=max(body.symmetry, 1),
        round=shape == "disc", **given,
    )  # fmt: skip


STATE = np.array([0.021, -0.034, 0.4, 0.045, 0.062, 1.3])


@pytest.mark.parametrize("name", GRADIENTS)
@pytest.mark.parametrize(("shape", "size"), FILTERED.items())
def test_the_filter_feels_the_drag_of_the_simulation(shape: str, size: int, name: str) -> None:
    mean = STATE if size == 6 else STATE[[0, 1, 3, 4]]
    words = {"disc": "disc:4cm", "rectangle": "rectangle:4x2cm"}.get(shape, f"{shape}:4cm")
    body = study(words)
    state = STATE if size == 6 else np.array([*STATE[:2], 0.0, *STATE[3:5], 0.0])
    (want,) = drags_of(body, linear(GRADIENTS[name]), [state])
    want = want / [MASS, MASS, body.block.inertia_kg_m2]
    found = expected(
        shape, mean, np.eye(size) * 1e-18, linear_coefficients(GRADIENTS[name]),
        "state" if size == 6 else "none",
    )["acceleration"]  # fmt: skip
    np.testing.assert_allclose(found, want[: size // 2], rtol=1e-6)


@pytest.mark.parametrize("power", [2.0, 1.6])
@pytest.mark.parametrize(("shape", "size"), [*FILTERED.items(), ("rectangle", 4), ("xx", 4)])
def test_slopes_of_the_mean_drag_are_its_differences(shape: str, size: int, power: float) -> None:
    """With a state known to a nanometre, and the push of the water in it."""
    mean = STATE if size == 6 else STATE[[0, 1, 3, 4]]
    d, covariance = size // 2, np.eye(size) * 1e-18
    given = {
        "orientation": "state" if size == 6 else "none", "water_acceleration": 1.3,
        "water_spin": 1.0, "drag_power": power,
    }  # fmt: skip
    found = expected(shape, mean, covariance, WAVY, **given)
    steep = slope(
        lambda at: expected(shape, at, covariance, WAVY, **given)["acceleration"], mean, 1e-6
    )
    for name, part in (("by_position", steep[:, :d]), ("by_velocity", steep[:, d:])):
        np.testing.assert_allclose(found[name], part, rtol=1e-4, atol=1e-5 * np.abs(part).max())
    rng = np.random.default_rng(3)
    change = rng.normal(size=WAVY.shape)
    ahead, back = (
        expected(shape, mean, covariance, WAVY + h * change, **given)["acceleration"]
        for h in (1e-6, -1e-6)
    )
    moved = np.tensordot(found["by_coefficients"], change, axes=change.ndim)
    np.testing.assert_allclose(moved, (ahead - back) / 2e-6, rtol=1e-5)


@pytest.mark.slow
@pytest.mark.false_alarm(2e-4)
@pytest.mark.parametrize("shape", ["disc", "xx"])
def test_the_mean_drag_is_the_mean_of_draws(shape: str, fresh_seed: Any) -> None:
    """Velocities uncertain by 2 cm/s: 4 standard errors of two or three numbers."""
    size = FILTERED[shape]
    mean = STATE if size == 6 else STATE[[0, 1, 3, 4]]
    spread = np.array([0.0, 0.0, 0.0, 0.02, 0.02, 1.0] if size == 6 else [0.0, 0.0, 0.02, 0.02])
    orientation = "state" if size == 6 else "none"
    draws = mean + spread * np.random.default_rng(fresh_seed(5)).normal(size=(1500, size))
    exact = np.eye(size) * 1e-18
    coefficients = linear_coefficients(GRADIENTS["shear"])
    values = np.array(
        [expected(shape, one, exact, coefficients, orientation)["acceleration"] for one in draws]
    )
    covariance = np.diag(spread**2 + 1e-18)
    found = expected(shape, mean, covariance, coefficients, orientation)["acceleration"]
    error = values.std(axis=0) / np.sqrt(len(values))
    assert np.all(np.abs(found - values.mean(axis=0)) < 4 * error + 1e-4 * np.abs(found))
    sure = expected(shape, mean, exact, coefficients, orientation)["acceleration"]
    assert np.abs(sure - found).max() > 6 * error.min()


@pytest.mark.parametrize("shape", ["rectangle", "xx", "x./xx"])
def test_the_push_of_the_water_is_its_mean_over_the_area(shape: str) -> None:
    """By 24 x 24 Gauss points of each cell; Du/Dt from the splines of SciPy.

    Four points for the whole body would be up to 40 % off.
    """
    body = rigid_body(shape, Measures(0.04, 0.02 if shape == "rectangle" else None, 8))
    place, weight = np.polynomial.legendre.leggauss(24)
    half = np.array([0.02, 0.01 if shape == "rectangle" else 0.02])
    inner = np.stack(np.meshgrid(half[0] * place, half[1] * place), axis=-1).reshape(-1, 2)
    arms = (body.cells[:, None] + inner).reshape(-1, 2)
    share = np.tile(np.outer(weight, weight).ravel(), len(body.cells)) / (4.0 * len(body.cells))
    turn = np.array([[np.cos(STATE[2]), -np.sin(STATE[2])], [np.sin(STATE[2]), np.cos(STATE[2])]])
    arms = arms @ turn.T
    push = acceleration(*(STATE[:2] + arms).T)
    moment = (arms[:, 0] * push[1] - arms[:, 1] * push[0]) @ share / body.moment_m2
    without, found = (
        expected(shape, STATE, np.eye(6) * 1e-18, WAVY, "state", water_acceleration=on,
                 water_spin=on)["acceleration"]
        for on in (0.0, 1.0)
    )  # fmt: skip
    mean = push @ share
    assert np.hypot(*((found - without)[:2] - mean)) < 0.02 * np.hypot(*mean)
    assert (found - without)[2] == pytest.approx(moment, rel=0.03)


def acceleration(x: plain.Floats, y: plain.Floats) -> plain.Floats:
    """Return (u . grad) u of the wavy flow at places, shape (2, n)."""
    axes = []
    for at, origin, count in ((x, "origin_x", "columns"), (y, "origin_y", "rows")):
        knots = GRID[origin] + GRID["spacing"] * np.arange(-3, GRID[count] + 1)
        # The first spline of the grid ends one distance after its origin.
        found = BSpline(knots, np.eye(GRID[count]), 3)
        axes.append((found(at), found.derivative()(at)))
    (across, across_slope), (along, along_slope) = axes
    value, by_x, by_y = (
        np.einsum("crk,nk,nr->cn", WAVY, *bases)
        for bases in ((across, along), (across_slope, along), (across, along_slope))
    )
    return np.asarray(value[0] * by_x + value[1] * by_y)
