"""Forces between blocks against magpylib, closed forms and the mechanics of two bodies."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import magpylib
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.ndimage import map_coordinates
from scipy.special import k0, k1

import driftwalk as dw
from driftwalk.assembly import assemble
from driftwalk.assembly.pull.force_tables import block_pull
from driftwalk.assembly.pull.magnets import coaxial_force, magnet_energy
from driftwalk.assembly.runs.plan import make_plan, simulate_rows, start_poses
from driftwalk.model.interaction import Magnet

SIDE, MASS = 0.03, 0.0116
MAGNETS = {
    "3x3x1mm,1.2T": Magnet(3e-3, 3e-3, 1e-3, 1.2),
    "5x5x2mm,1.3T": Magnet(5e-3, 5e-3, 2e-3, 1.3),
}


def magpylib_pull(magnet: Magnet, x: float, y: float, angle: float) -> tuple[float, float, float]:
    """Return force x, y [N] and torque [N m] on the second of two magnets, by magpylib."""
    size = (magnet.thickness_m, magnet.width_m, magnet.height_m)
    first = magpylib.magnet.Cuboid(dimension=size, polarization=(magnet.remanence_T, 0, 0))
    second = first.copy().rotate_from_angax(angle, "z", degrees=False)
    second.position = (x, y, 0.0)
    force, torque = (np.squeeze(one) for one in magpylib.getFT(first, second, meshing=3000))
    return float(force[0]), float(force[1]), float(torque[2])


def still_pair(start: Any, **sections: Any) -> dict[str, Any]:
    """Return arguments of worlds without water, force and wall."""
    forces = {"drag_coefficient": 0.0, "force_std_N": 0.0}
    study = dw.Study(tank={"diameter_m": 2.0}, forces=forces, **sections)
    start = np.asarray(start, dtype=np.float64)
    return {
        "study": study,
        "flow": dw.uniform_flow(0.0, 0.0, arena=study.tank.to_arena()),
        "start": start,
        "blocks": len(start),
    }


@pytest.mark.parametrize("text", MAGNETS)
def test_magnets_on_one_axis_attract_as_magpylib_says(text: str) -> None:
    magnet, distances = MAGNETS[text], [4e-3, 6e-3, 12e-3, 22e-3]
    expected = [-magpylib_pull(magnet, one, 0.0, 0.0)[0] for one in distances]
    np.testing.assert_allclose(coaxial_force(magnet, distances), expected, rtol=0.01)


@pytest.mark.parametrize("place", [(7e-3, 3e-3, 0.4), (-8e-3, 9e-3, 2.0), (2e-3, 12e-3, -1.0)])
def test_force_and_torque_are_the_slopes_of_the_energy(place: tuple[float, float, float]) -> None:
    magnet, step = MAGNETS["5x5x2mm,1.3T"], np.array([1e-6, 1e-6, 1e-4])
    slopes = [
        (magnet_energy(magnet, *(place + one)) - magnet_energy(magnet, *(place - one)))
        for one in np.diag(step)
    ]
    np.testing.assert_allclose(
        -np.ravel(slopes) / (2 * step), magpylib_pull(magnet, *place), rtol=0.01
    )


@pytest.mark.parametrize("poles", ["turning", pytest.param("fixed", marks=pytest.mark.slow)])
def test_the_kernel_accelerates_two_blocks_by_these_forces(poles: str) -> None:
    # One cycle of steps from rest; of fixed poles the energy of all 16 pairs of faces, by
    # differences.
    text, magnet = "5x5x2mm,1.3T", MAGNETS["5x5x2mm,1.3T"]
    pair = still_pair(
        [[0.0, 0.0, 0.2], [0.044, 0.008, -0.3]],
        interaction={"magnets": text, "poles": poles, "cutoff_m": 0.3},
        simulation={"time_step_s": 2e-4},
    )
    tank = dw.LiveTank(**pair)
    tank.advance(1e-3)
    found = np.stack([MASS * tank.vx, MASS * tank.vy, MASS * SIDE**2 / 6 * tank.omega]) / 1e-3
    np.testing.assert_allclose(found[:2].sum(axis=1), 0.0, atol=1e-15)
    centres = np.stack([tank.x, tank.y])
    turning = centres[0] * found[1] - centres[1] * found[0] + found[2]
    np.testing.assert_allclose(turning.sum(), 0.0, atol=1e-9)
    lever = SIDE / 2 - 2e-3

    def energy(poses: Any) -> float:
        total = 0.0
        turn = poses[:, 2, None] + np.arange(4) * np.pi / 2
        points = poses[:, None, :2] + lever * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        for i in range(4):
            way = points[1] - points[0, i]
            if poles == "turning":
                total += float(magnet_energy(magnet, np.hypot(*way.T), 0.0, 0.0).sum())
            else:
                away, up = np.cos(turn[0, i]), np.sin(turn[0, i])
                x, y = way @ [away, up], way @ [-up, away]
                total += float(magnet_energy(magnet, x, y, turn[1] + np.pi - turn[0, i]).sum())
        return total

    start = pair["start"]
    expected = np.zeros((3, 2))
    for block, part in np.ndindex(2, 3):
        step = np.zeros_like(start)
        step[block, part] = 1e-5
        expected[part, block] = -(energy(start + step) - energy(start - step)) / 2e-5
    np.testing.assert_allclose(found[:2], expected[:2], atol=0.01 * np.abs(expected[:2]).max())
    np.testing.assert_allclose(found[2], expected[2], atol=0.01 * np.abs(expected[2]).max())


@pytest.mark.slow
def test_two_magnets_meet_when_the_quadrature_says() -> None:
    text, magnet, gap = "3x3x1mm,1.2T", MAGNETS["3x3x1mm,1.2T"], 0.015
    lever, square = SIDE / 2 - 1.5e-3, np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
    distances = np.linspace(SIDE, SIDE + gap, 4000)
    ways = distances[:, None, None, None] * np.array([1.0, 0.0]) + lever * (
        square[None, :, :] - square[:, None, :]
    )
    length = np.hypot(ways[..., 0], ways[..., 1])
    force = (coaxial_force(magnet, length) * ways[..., 0] / length).sum(axis=(1, 2))
    work = np.append(np.cumsum(((force[1:] + force[:-1]) / 2 * np.diff(distances))[::-1])[::-1], 0)
    speed = np.sqrt(
        4.0 * work / MASS
    )  # of closing: the energy is half the mass, speed squared, over 2
    # Near rest the distance falls as a t² / 2 of the relative motion.
    last = 40
    time = np.sqrt(2 * (distances[-1] - distances[-last]) / (2 * force[-1] / MASS))
    expected = time + np.trapezoid(1 / speed[: -last + 1], distances[: -last + 1])
    for step in (1e-3, 1e-2):
        pair = still_pair(
            [[0.0, 0.0, 0.0], [SIDE + gap, 0.0, 0.0]],
            interaction={"magnets": text, "cutoff_m": 0.4}, simulation={"time_step_s": step},
        )  # fmt: skip
        found = assemble(**pair, runs=1, duration=20.0)
        # The usual step caps the force: convergence in the time step.
        assert float(found["first_contact_time"][0]) == pytest.approx(
            expected, rel=0.01, abs=2 * step
        )


@pytest.mark.slow
def test_a_conservative_pair_keeps_energy_and_momentum(tmp_path: Path) -> None:
    # A spring between all faces, which pushes near and pulls far: the blocks never touch.
    gaps = np.linspace(0.0, 0.2, 81)
    rows = [f"{1e3 * gap:.4f},{40.0 * (gap - 0.06):.9f}" for gap in gaps]
    table = tmp_path / "spring.csv"
    table.write_text("\n".join(["gap_mm,force_mN", *rows]))
    pair = still_pair(
        [[0.0, 0.0, 0.1], [0.062, 0.018, 0.4]],
        interaction={"attraction": str(table)}, assembly={"latching": "none"},
        simulation={"time_step_s": 5e-3},
    )  # fmt: skip
    tank, pull = dw.LiveTank(**pair), block_pull(pair["study"])
    assert pull is not None
    assert pull.faces is not None

    def potential() -> float:
        turn = tank.theta[:, None] + np.arange(4) * np.pi / 2
        x, y = tank.x[:, None] + SIDE / 2 * np.cos(turn), tank.y[:, None] + SIDE / 2 * np.sin(turn)
        r = np.hypot(x[1] - x[0, :, None], y[1] - y[0, :, None])
        grid = np.linspace(0.0, 0.2, 20001)
        force = pull.faces(grid)
        work = np.append(0.0, np.cumsum((force[1:] + force[:-1]) / 2 * np.diff(grid)))
        return float(np.interp(r, grid, work).sum())

    totals, kinetics = [], []
    for _ in range(200):
        kinetic = MASS / 2 * (tank.vx**2 + tank.vy**2) + MASS * SIDE**2 / 12 * tank.omega**2
        kinetics.append(float(kinetic.sum()))
        totals.append(kinetics[-1] + potential())
        momentum = MASS * np.array([tank.vx.sum(), tank.vy.sum()])
        spin = (tank.x * tank.vy - tank.y * tank.vx + SIDE**2 / 6 * tank.omega).sum() * MASS
        np.testing.assert_allclose([*momentum, spin], 0.0, atol=1e-13)
        tank.advance(0.25)
    assert max(kinetics) > 1e-7
    assert np.ptp(totals) < 1e-3 * max(kinetics)


@pytest.mark.slow
def test_fixed_poles_keep_energy_through_their_table_and_beyond() -> None:
    # 5000 steps of two blocks that repel each other, from inside the table to beyond the cut-off.
    pair = still_pair(
        [[0.0, 0.0, 0.1], [0.038, 0.012, 0.4]],
        interaction={"magnets": "5x5x2mm,1.3T", "poles": "fixed"},
        assembly={"faces": "N,N,N,N"}, simulation={"time_step_s": 1e-3},
    )  # fmt: skip
    tank, pull = dw.LiveTank(**pair), block_pull(pair["study"])
    assert pull is not None
    far, near = pull.tables.multipoles, pull.tables.oriented
    assert far is not None
    assert near is not None

    def potential() -> float:
        turn = tank.theta[:, None] + np.arange(4) * np.pi / 2
        x, y = (
            tank.x[:, None] + pull.lever * np.cos(turn),
            tank.y[:, None] + pull.lever * np.sin(turn),
        )
        dx, dy = x[1] - x[0, :, None], y[1] - y[0, :, None]
        own = turn[0, :, None]
        along, up = dx * np.cos(own) + dy * np.sin(own), dy * np.cos(own) - dx * np.sin(own)
        angle = turn[1] + np.pi - own
        total = far.energy(along, up, angle)
        r, per_angle = np.hypot(along, up), near["coefficient"].shape[1] / (2 * np.pi)
        places = (
            (np.log(r) - near["first"]) * near["per_step"],
            np.arctan2(up, along) * per_angle,
            angle * per_angle,
        )
        inside = np.pad(near["coefficient"], ((0, 0), (90, 90), (90, 90)), mode="wrap")
        places = (places[0], places[1] + 90, places[2] + 90)
        table = map_coordinates(inside, places, order=2, prefilter=False, mode="nearest")
        return -float((total + np.where(r < near["high"], table, 0.0)).sum())

    totals, kinetics = [], []
    for _ in range(100):
        kinetic = MASS / 2 * (tank.vx**2 + tank.vy**2) + MASS * SIDE**2 / 12 * tank.omega**2
        kinetics.append(float(kinetic.sum()))
        totals.append(kinetics[-1] + potential())
        tank.advance(0.1 if len(totals) > 50 else 0.01)
    assert max(kinetics) > 1e-5
    assert np.ptp(totals) < 1e-3 * max(kinetics)


@pytest.mark.slow
def test_distant_magnets_that_wait_keep_energy_and_momentum() -> None:
    # Three blocks of like poles fly apart: from near each other, where all acts in each step, to
    # beyond the cut-off.
    places = [[0.0, 0.0, 0.1], [0.046, 0.012, 0.4], [0.01, -0.05, -0.3]]
    pair = still_pair(
        places, interaction={"magnets": "5x5x2mm,1.3T"}, assembly={"faces": "N,N,N,N"},
        simulation={"time_step_s": 1e-3},
    )  # fmt: skip
    tank, pull = dw.LiveTank(**pair), block_pull(pair["study"])
    assert pull is not None
    assert pull.faces is not None
    assert pull.tables.stepping.every > 1
    r = np.linspace(1e-3, 0.3, 60_001)
    force = pull.faces(r)
    work = np.append(np.cumsum(((force[1:] + force[:-1]) / 2 * np.diff(r))[::-1])[::-1], 0.0)

    def potential() -> float:
        turn = tank.theta[:, None] + np.arange(4) * np.pi / 2
        x, y = (
            tank.x[:, None] + pull.lever * np.cos(turn),
            tank.y[:, None] + pull.lever * np.sin(turn),
        )
        pairs = [(0, 1), (0, 2), (1, 2)]
        return sum(
            float(np.interp(np.hypot(x[b] - x[a][:, None], y[b] - y[a][:, None]), r, work).sum())
            for a, b in pairs
        )

    totals, kinetics = [], []
    for _ in range(120):
        kinetic = MASS / 2 * (tank.vx**2 + tank.vy**2) + MASS * SIDE**2 / 12 * tank.omega**2
        kinetics.append(float(kinetic.sum()))
        totals.append(kinetics[-1] + potential())
        momentum = MASS * np.array([tank.vx.sum(), tank.vy.sum()])
        spin = (tank.x * tank.vy - tank.y * tank.vx + SIDE**2 / 6 * tank.omega).sum() * MASS
        np.testing.assert_allclose([*momentum, spin], 0.0, atol=1e-13)
        tank.advance(0.005 if len(totals) < 100 else 0.1)
    assert max(kinetics) > 1e-4
    assert np.ptp(totals) < 1e-3 * max(kinetics)


def test_pairs_that_fly_at_each_other_come_back_with_their_energy() -> None:
    # Like poles, from beyond the cut-off to where the near share of the force acts, and back.
    worlds, rng = 24, np.random.default_rng(2)
    pose, velocity = np.zeros((2, worlds, 2, 3))
    pose[:, :, 0], pose[:, 1, 1] = [-0.09, 0.09], rng.uniform(-0.02, 0.02, worlds)
    pose[..., 2] = rng.uniform(-3, 3, (worlds, 2))
    velocity[:, :, 0], velocity[..., 2] = [0.12, -0.12], rng.normal(0, 1, (worlds, 2))
    study = dw.Study(
        tank={"diameter_m": 0.6}, forces={"drag_coefficient": 0.0, "force_std_N": 0.0},
        interaction={"magnets": "5x5x2mm,1.3T"}, simulation={"time_step_s": 5e-3},
        assembly={"faces": "N,N,N,N", "latching": "none", "blocks": 2},
    )  # fmt: skip
    start = {
        "pose": pose, "velocity": velocity, "assembly": np.tile([0, 1], (worlds, 1)),
        "cell": np.zeros((worlds, 2, 2)), "quarter": np.zeros((worlds, 2)),
    }  # fmt: skip
    still, pull = dw.uniform_flow(0.0, 0.0, arena=study.tank.to_arena()), block_pull(study)
    batch = dw.TankBatch(study, still, worlds=worlds, start=start, backend="reference")
    assert pull is not None

    def sums() -> tuple[Any, Any]:
        (x, y, _), (u, v, omega) = batch.state()["pose"].T, batch.state()["velocity"].T
        spin = x * v - y * u + SIDE**2 / 6 * omega
        kept = np.array([u.sum(axis=0), v.sum(axis=0), spin.sum(axis=0)])
        return (u**2 + v**2 + SIDE**2 / 6 * omega**2).sum(axis=0), kept

    def apart() -> Any:
        x, y, theta = batch.state()["pose"].T[..., None]
        face = x + 1j * y + pull.lever * np.exp(1j * (theta + np.pi / 2 * np.arange(4)))
        return np.abs(face[0][:, None] - face[1][..., None]).min(axis=(1, 2))

    energy, kept = sums()
    nearest = apart()
    for _ in range(40):
        batch.advance(0.06)
        nearest = np.minimum(nearest, apart())
    assert (nearest**2 < pull.tables.stepping.near_end).mean() > 0.7
    assert apart().min() + 2 * pull.lever > pull.tables.reach
    after, kept_after = sums()
    np.testing.assert_allclose(after, energy, rtol=3e-3)
    np.testing.assert_allclose(kept_after, kept, rtol=0, atol=1e-14)


def test_a_cycle_of_distant_magnets_goes_on_after_a_pause() -> None:
    pair = still_pair(
        [[0.0, 0.0, 0.2], [0.07, 0.01, -0.3]], interaction={"magnets": "5x5x2mm,1.3T"}
    )
    paused, whole = dw.LiveTank(**pair), dw.LiveTank(**pair)
    for steps in (1, 3, 7):
        paused.advance(0.01 * steps)
    whole.advance(0.11)
    for name in ("x", "y", "theta", "vx"):
        np.testing.assert_array_equal(getattr(paused, name), getattr(whole, name))


def test_a_bond_feels_the_force_of_a_distant_magnet_and_not_the_impulse_of_a_cycle() -> None:
    # A pair at rest and a third block on its axis: the tension is half the difference of its pulls.
    study = dw.Study(
        interaction={"magnets": "5x5x2mm,1.3T"},
        forces={
            "drag_coefficient": 0.0, "force_std_N": 0.0,
            "force_memory_s": 0.1, "stirring_length_m": 0.05,
        },
    )  # fmt: skip
    pull, places = block_pull(study), np.array([0.0, SIDE, 0.1])
    assert pull is not None
    assert pull.faces is not None
    points = pull.lever * np.exp(0.5j * np.pi * np.arange(4))

    def pull_on(block: int, joined: int) -> float:
        way = places[2] + points - (places[block] + np.delete(points, joined))[:, None]
        return float((pull.faces(np.abs(way)) * way / np.abs(way)).sum().real)

    tension = (pull_on(1, 2) - pull_on(0, 0)) / 2.0
    for share, parts in ((0.9, True), (1.2, False)):
        strength = {"assembly.bond_strength_N": share * tension}
        tank = dw.LiveTank(
            dw.apply_overrides(study, strength), dw.uniform_flow(0.0, 0.0), blocks=3,
            start=np.stack([places, 0 * places, 0 * places], axis=1),
        )  # fmt: skip
        tank.advance(0.1)
        assert [event.is_parting for event in tank.events()] == [False, True][: 1 + parts]


def test_menisci_attract_by_the_closed_form() -> None:
    pull = block_pull(dw.Study(interaction={"capillary": "on", "meniscus_height_m": 1.5e-3}))
    assert pull is not None
    assert pull.centres is not None
    # Kralchevsky and Nagayama (2000): 2 pi gamma q Q² K1(q L), with the slope's charge
    # Q = H / K0(q R).
    q, radius = np.sqrt(998.0 * 9.81 / 0.072), SIDE / 2
    density = dw.Study().water.density_kg_m3
    q = np.sqrt(density * 9.81 / 0.072)
    distance = np.array([0.031, 0.035, 0.04])
    expected = 2 * np.pi * 0.072 * q * (1.5e-3 / k0(q * radius)) ** 2 * k1(q * distance)
    np.testing.assert_allclose(pull.centres(distance), expected, rtol=1e-6)


def test_the_resistance_is_the_factor_over_the_gap() -> None:
    pull = block_pull(dw.Study(interaction={"approach_resistance_N_s": 1e-5}))
    assert pull is not None
    assert pull.resistance is not None
    np.testing.assert_allclose(pull.resistance(0.035) * 0.035, 1e-5 / 0.005)


def test_the_stated_numbers_are_those_of_a_balance() -> None:
    found = dw.attraction(dw.Study(interaction={"magnets": "3x3x1mm,1.2T"}))
    assert found is not None
    magnet = MAGNETS["3x3x1mm,1.2T"]
    assert found.attrs["force_at_contact_N"] == pytest.approx(coaxial_force(magnet, 3e-3))
    assert found.attrs["force_at_10mm_N"] == pytest.approx(coaxial_force(magnet, 13e-3), rel=1e-3)
    work = quad(lambda r: float(coaxial_force(magnet, r)), 3e-3, 0.5, points=[0.01, 0.03])[0]
    assert found.attrs["binding_energy_J"] == pytest.approx(work, rel=0.01)
    assert dw.attraction(dw.Study()) is None


@pytest.mark.slow
def test_many_blocks_are_the_same_by_lists_as_by_all_pairs() -> None:
    # 30 blocks are listed; 20 of them alone are not, the other ten are far away.
    near = np.array([[0.036 * i, 0.036 * j, 0.1 * i] for i in range(5) for j in range(4)])
    far = np.array([[0.05 * i - 0.4, -0.6, 0.0] for i in range(10)])
    options: dict[str, Any] = {
        "interaction": {"magnets": "3x3x1mm,1.2T"}, "assembly": {"latching": "none"},
    }  # fmt: skip
    paths = [
        dw.assembly_path(**still_pair(start, **options), duration=0.1, backend="reference")
        for start in (near, np.concatenate([near, far]))
    ]
    for name in ("x", "y", "theta"):
        np.testing.assert_allclose(paths[0][name], paths[1][name].isel(block=slice(20)), atol=1e-7)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("gap_mm,pull_mN\n1,2", "line 1, column 2: no column is called 'pull_mN'"),
        ("gap_mm,offset_mm\n1,2", "there is no column force_N"),
        ("gap_mm,force_mN\n1,2\n2,x", "line 3, column 2: force is no number: 'x'"),
        ("gap_mm,force_mN\n1,2\n1,3", "line 3: a second row"),
        ("gap_mm,force_mN\n1,2", "at least two gaps"),
        ("gap_mm,angle_deg,force_mN\n1,0,2\n2,0,1\n1,9,2", "one for each combination"),
        (
            "gap_mm,angle_deg,force_mN,torque_uN_m\n"
            + "\n".join(f"{g},{a},{g},100" for g in (1, 2) for a in (-9, 0, 9)),
            "the torque differs",
        ),
    ],
)
def test_a_wrong_table_is_refused_with_its_place(text: str, words: str, tmp_path: Path) -> None:
    table = tmp_path / "attraction.csv"
    table.write_text(text)
    with pytest.raises(dw.FormatError, match=words):
        block_pull(dw.Study(interaction={"attraction": str(table)}))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"magnets": "40x5x2mm,1.3T"}, "have no room in a block of 30 mm"),
        ({"magnets": "5x5x2mm,1.3T", "magnet_inset_m": 0.014}, "have no room"),
        pytest.param(
            {"magnets": "1x1x1mm,0.001T"}, "with less than 0.01 mN", marks=pytest.mark.slow
        ),
    ],
)
def test_magnets_without_room_are_refused(given: dict[str, Any], words: str) -> None:
    with pytest.raises(dw.InputError, match=words):
        block_pull(dw.Study(interaction=given))


def table_of(path: Path, rows: list[str], columns: str = "gap_mm,force_mN") -> str:
    path.write_text("\n".join([columns, *rows]), encoding="utf-8")
    return str(path)


def test_a_table_that_ends_with_a_force_is_capped_where_it_is_steep(tmp_path: Path) -> None:
    rows = [f"{gap},{500 / (1 + gap) ** 2}" for gap in np.linspace(0.0, 5.0, 11)]
    text = table_of(tmp_path / "table.csv", rows)
    found = dw.attraction(dw.Study(interaction={"attraction": text}))
    assert found is not None
    # Slopes of the rows: 17.7 N/m from 2.5 to 3 mm and 12.5 N/m from 3 mm on; the step takes 14.5.
    assert found.attrs["capped_below_m"] == pytest.approx(3e-3, rel=0.01)
    assert found.attrs["most_simulated_N"] == pytest.approx(0.03125, rel=0.01)
    assert found.attrs["force_at_10mm_N"] == 0.0
    pull = block_pull(dw.Study(interaction={"attraction": text, "cutoff_m": 4.5e-3}))
    assert pull is not None
    assert pull.faces is not None
    assert pull.faces.cutoff == pytest.approx(4.5e-3)
    assert float(pull.faces(3.5e-3)) == pytest.approx(500e-3 / 4.5**2)


@pytest.mark.slow
def test_a_table_with_offsets_acts_up_to_its_corner(tmp_path: Path) -> None:
    # mN: (10 - gap) cos²(offset / 12 mm · π / 2), whose energy is (10 - gap)² / 2 times the cos².
    def share(offset: Any) -> Any:
        return np.cos(np.asarray(offset) / 12.0 * np.pi / 2) ** 2

    rows = [
        f"{gap},{offset},{(10 - gap) * share(offset)}"
        for gap in np.linspace(0.0, 10.0, 11)
        for offset in np.linspace(0.0, 12.0, 25)
    ]
    text = table_of(tmp_path / "table.csv", rows, "gap_mm,offset_mm,force_mN")

    def force(gap: float, offset: float) -> tuple[float, float]:
        pair = still_pair(
            [[0.0, 0.0, 0.0], [SIDE + 1e-3 * gap, 1e-3 * offset, 0.0]],
            interaction={"attraction": text},
            simulation={"time_step_s": 1e-3},
        )
        tank = dw.LiveTank(**pair)
        tank.advance(1e-3)
        return float(1e6 * MASS * tank.vx[0]), float(1e6 * MASS * tank.vy[0])

    for gap, offset in ((2.0, 0.0), (5.0, 4.0), (8.0, 0.0), (7.0, 8.0)):
        along, across = force(gap, offset)
        assert along == pytest.approx((10 - gap) * share(offset), abs=0.25), (gap, offset)
        slope = np.sin(offset / 12.0 * np.pi) * np.pi / 24.0 * (10 - gap) ** 2 / 2
        assert across == pytest.approx(slope, abs=0.5), (gap, offset)


def test_a_run_keeps_the_table_of_its_start(tmp_path: Path) -> None:
    table = tmp_path / "table.csv"
    pair = still_pair(
        [[0.0, 0.0, 0.0], [SIDE + 0.01, 0.0, 0.0]],
        interaction={"attraction": table_of(table, ["0,20", "20,0"])},
    )
    study = dw.apply_overrides(pair["study"], {"assembly.blocks": 2})
    plan = make_plan(study, pair["flow"], settings={"runs": 1, "duration_s": 5.0})
    start = start_poses(plan, pair["start"])
    table.unlink()
    assert simulate_rows(plan, start)["event_count"].tolist() == [1]


def test_a_cutoff_counts_from_face_to_face() -> None:
    given = {"magnets": "5x5x2mm,1.3T", "capillary": "on", "cutoff_m": 0.02}
    pull = block_pull(dw.Study(interaction=given))
    assert pull is not None
    assert pull.faces is not None
    assert pull.centres is not None
    assert pull.faces.cutoff == pytest.approx(0.024)
    assert pull.centres.cutoff == pytest.approx(SIDE + 0.02)
    assert float(pull.centres(SIDE)) == pytest.approx(float(pull.centres.force(np.array(SIDE))))


@pytest.mark.slow
def test_the_cap_is_that_of_the_time_step_and_not_the_taper() -> None:
    weak = {"magnets": "1x1x1mm,0.2T", "capillary": "on", "meniscus_height_m": 1e-4}
    found = dw.attraction(dw.Study(interaction=weak, simulation={"time_step_s": 1e-3}))
    assert found is not None
    assert found.attrs["capped_below_m"] == 0.0


def test_typed_faces_have_poles_or_magnets_are_refused() -> None:
    kinds = [{"name": "A", "count": 4, "faces": ["p", "p", "q", "q"]}]
    given = {"interaction": {"magnets": "3x3x1mm,1.2T", "cutoff_m": 0.02}}
    study = dw.Study(assembly={"binding": {"kinds": kinds, "latches": [["p", "q"]]}}, **given)
    with pytest.raises(dw.InputError, match="no face of these blocks has one"):
        block_pull(study)
    found = dw.attraction(dw.Study(assembly={"faces": "N,S,N,S"}, **given))
    assert found is not None
    assert "poles given by the faces, 1 mm below" in found.attrs["between"]


def test_discs_have_no_faces() -> None:
    study = dw.Study(block={"shape": "disc"}, interaction={"magnets": "5x5x2mm,1.3T"})
    with pytest.raises(dw.InputError, match="discs have no faces"):
        block_pull(study)
