"""Discs that assemble, against plain NumPy, closed forms, and the simulation of one disc."""

from __future__ import annotations

from typing import Any

import numpy as np
import plain_bodies as plain
import plain_discs
import pytest
from scipy.stats import ks_2samp

import driftwalk as dw
from driftwalk.assembly import LiveTank, assemble, assembly_path
from driftwalk.schema import build_flow_field
from driftwalk.simulation import Start, simulate

DIAMETER, MASS, DRAG, DENSITY = 0.04, 0.024, 0.5, 1000.0
NODES = np.linspace(-0.5, 0.5, 81)
STEP = 1e-3


def study(
    *, force_std: float = 0.0, tank: float = 0.9, step: float = STEP, **more: Any
) -> dw.Study:
    forces = {"drag_coefficient": DRAG, "force_std_N": force_std, "force_interval_s": "10ms"}
    return dw.Study(
        block={"shape": "disc", "side_m": DIAMETER, "mass_kg": MASS}, forces=forces,
        tank={"diameter_m": tank}, simulation={"time_step_s": step}, assembly=more,
    )  # fmt: skip


def field(water: plain.Water) -> Any:
    x, y = np.meshgrid(NODES, NODES)
    found = water(x + 1j * y) + 0j * x
    flag = np.ones(x.shape, dtype=np.int8)
    return build_flow_field(NODES, NODES, u=found.real, v=found.imag, flag=flag)


def closing(z: plain.Complexes) -> plain.Complexes:
    """A saddle with some shear: the table of the simulator holds it exactly."""
    return -0.3 * z.real + 0.05 * z.imag + 1j * (0.1 * z.imag + 0.02 * z.real)


STARTS = {
    "two that meet off their axis": [-0.10 + 0.012j, 0.09 - 0.006j],
    "three, one after the other": [-0.10 + 0.012j, 0.09 - 0.006j, -0.21 + 0.015j],
}


@pytest.mark.slow
@pytest.mark.parametrize("start", STARTS.values(), ids=STARTS)
def test_discs_move_and_latch_as_in_plain_numpy(start: list[complex]) -> None:
    """Without a stochastic force: before and after they latch, within 0.05 mm over 12 s.

    The panels of a disc are 31, those of the oracle 241: their drags differ by 0.1 %.
    """
    case, z = study(), np.array(start)
    poses = np.stack([z.real, z.imag, 0 * z.real], axis=1)
    found = assembly_path(
        case, field(closing), start=poses, blocks=z.size, duration=12.0, sample_interval=0.5,
        backend="reference",
    )  # fmt: skip
    scale = 0.5 * DENSITY * DRAG * case.wetted_depth_m
    want, contacts = plain_discs.assembled(
        z, plain.disc(DIAMETER, 241), closing, scale, MASS, found["time"].values
    )
    assert len(contacts) == z.size - 1
    places = found["x"].values[0] + 1j * found["y"].values[0]
    assert np.abs(places - want).max() < 5e-5
    runs = assemble(
        case, field(closing), start=poses, blocks=z.size, duration=12.0, runs=1,
        backend="reference",
    )  # fmt: skip
    assert np.abs(runs["event_time"].values[0] - contacts).max() < 5e-3
    apart = np.abs(places[-1][:, None] - places[-1])[np.triu_indices(z.size, 1)]
    assert np.sort(apart)[: z.size - 1] == pytest.approx([DIAMETER] * (z.size - 1), rel=1e-6)


def test_momentum_and_angular_momentum_are_kept_where_discs_latch() -> None:
    """Without drag nothing but the latch acts: both stay as they are, exactly."""
    case = study(step=0.01)
    tank = LiveTank(case, field(closing), start=[(-0.1, 0.012, 0), (0.09, -0.006, 0)], blocks=2)
    tank.advance(4.0)
    tank.set(drag_coefficient=0.0)
    tank.advance(0.02)

    def momenta() -> list[float]:
        z, v = tank.x + 1j * tank.y, tank.vx + 1j * tank.vy
        spin = tank.omega * DIAMETER**2 / 8
        whole = v.sum()
        return [whole.real, whole.imag, float(((z.conj() * v).imag + spin).sum())]

    before = momenta()
    assert len(set(tank.assembly)) == 2
    tank.advance(3.0)
    (event,) = tank.events()
    assert event.outcome == "2"
    assert abs(tank.omega[0]) > 0.1
    assert momenta() == pytest.approx(before, rel=1e-9)
    assert np.hypot(*np.diff([tank.x, tank.y], axis=1)) == pytest.approx(DIAMETER, rel=1e-9)


def test_one_disc_alone_moves_as_in_a_simulation_of_it() -> None:
    """The same law in the tank's swirl, with its walls and without a stochastic force."""
    case, flow = study(tank=0.3, step=0.01), dw.tank30_flow()
    found = assembly_path(
        case, flow, start=[(0.05, 0.02, 0.3)], blocks=1, duration=30.0, sample_interval=0.5,
        backend="reference",
    )  # fmt: skip
    alone = simulate(
        case, flow, start=Start(0.05, 0.02, 0.3), sample_time=found["time"].values, replicates=1,
        backend="reference",
    )  # fmt: skip
    for name in ("x", "y", "theta"):
        difference = found[name].values[0, :, 0] - alone[name].values[0, :, 0]
        assert np.abs(difference).max() < 1e-6
    wall = np.hypot(found["x"].values, found["y"].values).max()
    assert wall == pytest.approx(0.15 - DIAMETER / 2, abs=1e-5)


def first_contacts(rng: np.random.Generator, runs: int, *, force_std: float, gap: float,
                   duration: float) -> plain.Floats:  # fmt: skip
    """Euler-Maruyama in still water with the closed form of a disc's drag, 2.5 ms a step."""
    step, every = 2.5e-3, 4
    z = np.tile([0.0 + 0j, DIAMETER + gap], (runs, 1))
    v = np.zeros_like(z)
    when = np.full(runs, duration)
    strength = 0.5 * DENSITY * DRAG * DIAMETER * DIAMETER / MASS  # depth: a diameter
    for k in range(round(duration / step)):
        if k % every == 0:
            force = force_std * (rng.standard_normal(z.shape) + 1j * rng.standard_normal(z.shape))
        v = (v + force / MASS * step) / (1.0 + strength * np.abs(v) * step)
        z = z + v * step
        met = np.abs(z[:, 0] - z[:, 1]) <= DIAMETER
        when = np.where(met, np.minimum(when, (k + 1) * step), when)
    return when


@pytest.mark.slow
def test_first_contacts_come_as_in_plain_numpy() -> None:
    """False-alarm rate 0.001, two samples of 200 runs, censored at 10 s."""
    how = {"force_std": 5e-3, "gap": 0.01, "duration": 10.0}
    want = first_contacts(np.random.default_rng(3), 200, **how)
    case = study(force_std=how["force_std"], step=0.01)
    runs = assemble(
        case, field(lambda z: 0j * z), runs=200, blocks=2, duration=how["duration"], seed=5,
        start=[(0.0, 0.0, 0.0), (DIAMETER + how["gap"], 0.0, 0.0)],
    )  # fmt: skip
    found = np.nan_to_num(runs["first_contact_time"].values, nan=how["duration"])
    assert 0.3 < (want < how["duration"]).mean() < 0.95
    assert ks_2samp(found, want).pvalue > 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("blocks", [4, 12])
def test_a_run_of_discs_has_the_same_bits_alone(blocks: int) -> None:
    """Also where a disc lies at the wall, which only just touches it."""
    case = study(tank=0.3, step=0.01, force_std=5.5e-4, blocks=blocks)
    many, few = (assemble(case, dw.tank30_flow(), runs=n, duration=60.0) for n in (35, 3))
    for name in ("x", "y", "theta", "event_time"):
        assert np.array_equal(many[name].values[:3], few[name].values, equal_nan=True)
    many, few = (
        simulate(case, dw.tank30_flow(), sample_time=[60.0], replicates=n) for n in (35, 3)
    )
    assert np.array_equal(many["x"].values[:3], few["x"].values)
