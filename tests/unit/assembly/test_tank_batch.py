"""The batch of tanks: the bits of single tanks, grouping, copies, joined starts, and refusals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from single_block import BEYOND_PAPER
from twin_assembly import study as tank_study, swirl

import driftwalk as dw
from driftwalk.core.errors import InputError

STILL = dw.uniform_flow(0.0, 0.0)
FORCES: dict[str, Any] = {"force_std_N": 2e-3, "force_interval_s": 0.02}
AS_THEY_LIE = ("discs", "rectangles")
STUDIES: dict[str, dict[str, Any]] = {
    "paper": {},
    "law": {"forces": BEYOND_PAPER["all"]},
    "stirring": {"forces": {"stirring_length_m": 0.05}},
    "hidden": {"assembly": {"hidden_face_drag": 0.5}},
    "bonds": {"assembly": {"bond_rate_per_s": 1.0}},
    "faces": {"assembly": {"faces": "N,S,N,S"}},
    "magnets": {"interaction": {"magnets": "5x5x2mm,1.3T"}},
    "discs": {"block": {"shape": "disc", "side_m": 0.03, "mass_kg": 0.0116}},
    "rectangles": {
        "block": {"shape": "rectangle", "side_m": 0.04, "width_m": 0.02, "mass_kg": 0.0116}
    },
    "rectangle": {
        "tank": {"shape": "rectangle", "diameter_m": None, "width_m": 0.2, "height_m": 0.15}
    },
    "many": {"assembly": {"blocks": 30}},
}


def study_of(name: str) -> dw.Study:
    sections = {key: dict(value) for key, value in STUDIES[name].items()}
    sections["forces"] = FORCES | sections.get("forces", {})
    return tank_study(0.45 if name == "many" else 0.25, **sections)


def series(study: dw.Study) -> Any:
    """A vortex that turns round every two seconds."""
    still = swirl(study)
    frames = still.expand_dims(time=[0.0, 1.0, 2.0]).copy(deep=True)
    for name in ("u", "v"):
        frames[name] = frames[name] * np.array([1.0, -1.0, 1.0])[:, None, None]
    return frames.assign_attrs(repeat="loop")


def state_of(tank: dw.LiveTank) -> dict[str, npt.NDArray[Any]]:
    return {
        "pose": np.stack([tank.x, tank.y, tank.theta], axis=1),
        "velocity": np.stack([tank.vx, tank.vy, tank.omega], axis=1),
        "assembly": tank.assembly,
    }


def changes(k: int, latchings: tuple[str, ...]) -> dict[str, Any]:
    """The k-th change of one setting, or of all."""
    each: list[dict[str, Any]] = [
        {"force_std": 3e-3},
        {"flow_scale": 0.3},
        {"drag_coefficient": 1.1},
        {"latching": latchings[k // 5 % len(latchings)]},
        {"flow_scale": 1.5, "force_std": 1e-3, "drag_coefficient": 0.3},
    ]
    return each[k % len(each)]


@pytest.mark.slow
@pytest.mark.parametrize("name", [*STUDIES, "series"])
def test_the_reference_has_the_bits_of_a_live_tank(name: str) -> None:
    study = study_of("paper" if name == "series" else name)
    flow = series(study) if name == "series" else swirl(study)
    collide = name in (*AS_THEY_LIE, "faces", "magnets")
    latchings = ("none", "collision") if collide else ("connector", "none", "collision")
    joined = 0
    for seed in range(2):
        tank = dw.LiveTank(study, flow, seed=seed)
        batch = dw.TankBatch(study, flow, worlds=9, seed=seed, backend="reference")
        time_of_class = 0.0
        for k in range(20):
            change = changes(k, latchings)
            duration = 0.113 + 0.2 * (k % 3)  # mostly within a force interval
            for one in (tank, batch):
                one.set(**change)
                one.advance(duration)
            found = batch.state()
            for part, values in state_of(tank).items():
                assert np.array_equal(found[part][0], values), (k, part)
            events = tank.events()
            joined += len(events)
            time_of_class = events[-1].time if events else time_of_class
            assert batch.outcome[0] == tank.outcome
            assert (batch.time, batch.class_since[0]) == (tank.time, time_of_class)
    assert joined > 0


@pytest.mark.parametrize("name", ["paper", "bonds", "many"])
def test_worlds_are_those_of_assembly_path(name: str) -> None:
    study = study_of(name)
    settings: dict[str, Any] = {"seed": 4}
    path = dw.assembly_path(
        study, swirl(study), duration=3.0, sample_interval=1.0, runs=range(8, 20), **settings
    )
    batch = dw.TankBatch(study, swirl(study), worlds=12, first=8, **settings)
    for k in range(3):
        batch.advance(1.0)
        found = batch.state()
        for axis, part in enumerate(("x", "y", "theta")):
            expected = path[part].values[:, k + 1]
            assert np.array_equal(found["pose"][..., axis].astype(np.float32), expected)
        assert np.array_equal(found["assembly"], path["assembly"].values[:, k + 1])


@pytest.mark.parametrize("backend", ["cpu", "reference"])
@pytest.mark.parametrize("name", ["paper", "law", "discs", "rectangles", "magnets"])
def test_no_world_depends_on_the_others_or_on_the_threads(name: str, backend: Any) -> None:
    """40 worlds in two flows and all ways of latching, and each of them alone."""
    study = study_of(name)
    flows = [swirl(study), swirl(study, angular_velocity=1.0)]
    generator = np.random.default_rng(1)

    def run(worlds: int, first: int, workers: int) -> dict[str, npt.NDArray[Any]]:
        batch = dw.TankBatch(
            study, flows, worlds=worlds, first=first, workers=workers, backend=backend
        )
        own = slice(first, first + worlds)
        for k in range(4):
            batch.set(**{key: values[own] for key, values in settings[k].items()})
            batch.advance(0.53)
        return batch.state() | {"since": batch.class_since, "outcome": batch.outcome}

    latchings = ["none", "collision"] + (["connector"] if name not in AS_THEY_LIE else [])
    settings = [
        {
            "flow": generator.integers(0, 2, 40),
            "flow_scale": generator.choice([0.5, 1.0], 40),
            "force_std": generator.uniform(0, 4e-3, 40),
            "latching": generator.choice(latchings, 40),
            "drag_coefficient": generator.uniform(0.2, 1, 40),
        }
        for _ in range(4)
    ]
    whole = run(40, 0, 1)
    assert len(set(whole["outcome"])) > 1
    two = run(40, 0, 2)
    assert all(np.array_equal(values, two[part]) for part, values in whole.items())
    for world in range(0, 40, 7):
        alone = run(1, world, 1)
        assert all(np.array_equal(alone[part][0], values[world]) for part, values in whole.items())


@pytest.mark.parametrize("backend", ["cpu", "reference"])
def test_copies_go_on_as_the_worlds_do_with_the_same_forces(backend: Any) -> None:
    study = study_of("paper")
    batch = dw.TankBatch(study, swirl(study), worlds=6, seed=3, backend=backend)
    batch.advance(2.01)  # in the middle of a force interval
    batch.set(force_std=np.linspace(0, 5e-3, 6))
    same = batch.take(np.arange(6), seed=3)
    other = batch.take([5, 5, 1], seed=8)
    before = batch.state()
    masked = batch.take(np.arange(6) % 4 == 1, seed=8)
    assert np.array_equal(masked.state()["pose"], before["pose"][[1, 5]])
    assert np.array_equal(other.state()["pose"], before["pose"][[5, 5, 1]])
    assert (other.time, other.outcome.tolist()) == (batch.time, batch.outcome[[5, 5, 1]].tolist())
    for one in (same, batch, other):
        one.advance(2.0)
    assert all(np.array_equal(same.state()[part], v) for part, v in batch.state().items())
    assert not np.array_equal(other.state()["pose"][0], other.state()["pose"][1])
    again = batch.take(range(6), seed=3)
    assert all(np.array_equal(again.state()[part], v) for part, v in batch.state().items())


@pytest.mark.parametrize("name", ["paper", "faces", *AS_THEY_LIE])
def test_a_joined_start_goes_on_as_it_moves(name: str) -> None:
    """In still water and without forces two batches differ by the drag before the start alone."""
    study = study_of(name)
    batch = dw.TankBatch(study, STILL, worlds=30, seed=1, backend="reference")
    batch.advance(20.0)
    batch.set(force_std=0.0, latching="none")
    batch.advance(0.1)
    assert len(set(batch.outcome)) > 2
    start = batch.state()
    again = dw.TankBatch(study, STILL, worlds=30, seed=2, start=start, backend="reference")
    assert again.outcome.tolist() == batch.outcome.tolist()
    assert np.array_equal(again.class_since, np.zeros(30))
    for part, values in again.state().items():
        np.testing.assert_allclose(values, start[part], rtol=0, atol=1e-12, err_msg=part)
    again.set(force_std=0.0, latching="none")
    for one in (batch, again):
        one.advance(0.5)
    moved = batch.state()["pose"] - start["pose"]
    assert np.abs(moved[..., :2]).max() > 1e-3
    np.testing.assert_allclose(
        again.state()["pose"][..., :2], batch.state()["pose"][..., :2], rtol=0, atol=2e-5
    )


def test_a_domino_without_drag_flies_and_spins_on_from_its_start() -> None:
    """Free flight: the centre of mass goes straight, the angle grows with the spin."""
    study = tank_study(2.0, forces={"force_std_N": 0.0, "drag_coefficient": 0.0})
    still = dw.uniform_flow(0.0, 0.0, arena=study.tank.to_arena())
    spin, speed = 0.7, np.array([0.02, -0.01])
    turn = np.array([math.cos(0.3), math.sin(0.3)])
    # Block 1, turned by a quarter, stands in the cell +x of block 0.
    place = np.array([0.1, 0.2]) + np.outer([0.0, 0.03], turn)
    arm = place - place.mean(axis=0)
    start = {
        "pose": np.column_stack([place, [0.3, 0.3 + math.pi / 2]])[None],
        "velocity": np.column_stack([speed + spin * arm[:, ::-1] * [-1, 1], [spin, spin]])[None],
        "assembly": [[0, 0]],
        "cell": [[[0, 0], [1, 0]]],
        "quarter": [[0, 1]],
    }
    batch = dw.TankBatch(study, still, worlds=1, blocks=2, start=start, backend="reference")
    assert batch.outcome.tolist() == ["2"]
    batch.advance(2.0)
    pose = batch.state()["pose"][0]
    middle = place.mean(axis=0) + 2.0 * speed
    np.testing.assert_allclose(pose[:, :2].mean(axis=0), middle, rtol=0, atol=1e-12)
    turned = pose[:, 2] - (np.array([0.3, 0.3 + math.pi / 2]) + 2.0 * spin)
    np.testing.assert_allclose(np.remainder(turned + 1.0, 2 * math.pi), 1.0, rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.hypot(*(pose[1] - pose[0])[:2]), 0.03, rtol=1e-12)


def test_complete_worlds_rest_and_the_others_do_not_notice() -> None:
    study = study_of("paper")
    moving, resting = (
        dw.TankBatch(study, swirl(study), worlds=40, blocks=3, complete=complete)
        for complete in ("moves", "rests")
    )
    for one in (moving, resting):
        one.advance(20.0)
    done = np.isin(moving.outcome, ["I3", "L3"])
    assert 5 < np.count_nonzero(done) < 40
    before = resting.state()["pose"]
    assert np.array_equal(moving.state()["pose"], before)
    for one in (moving, resting):
        one.advance(5.0)
    after = resting.state()["pose"]
    assert np.array_equal(after[done], before[done])
    assert np.array_equal(after[~done], moving.state()["pose"][~done])
    assert resting.outcome.tolist() == moving.outcome.tolist()
    assert np.array_equal(resting.class_since, moving.class_since)
    assert resting.time == 25.0


def test_glued_blocks_start_joined() -> None:
    study = tank_study(assembly={"glued": "xx"})
    batch = dw.TankBatch(study, swirl(study), worlds=3, blocks=6)
    assert set(batch.outcome) == {"2+2+2"}


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"drag_coefficient": -1.0}, "from 0 on"),
        ({"force_std": [1e-3, math.nan]}, "from 0 on"),
        ({"flow_scale": math.inf}, "from 0 on"),
        ({"flow_scale": [1.0, 1.0, 1.0]}, "one for each of 2 worlds"),
        ({"flow": 1}, "indices of 1 flows"),
        ({"flow": 0.5}, "flow: expected whole numbers, got 0.5"),
        ({"force_std": "0.2mN"}, "force_std: expected numbers, got '0.2mN'"),
        ({"force_std": [None, 1e-3]}, "force_std: expected numbers"),
        ({"drag_coefficient": [[1.0], [1.0, 2.0]]}, "drag_coefficient: expected one value"),
        ({"latching": 1}, "latching: expected names, got 1"),
        ({"latching": "magnet"}, "latching"),
        ({"latching": ["none", "glue"]}, "latching"),
    ],
)
def test_refuses_values_out_of_range_and_keeps_the_others(
    values: dict[str, Any], words: str
) -> None:
    batch = dw.TankBatch(tank_study(), STILL, worlds=2, blocks=2)
    untouched = dw.TankBatch(tank_study(), STILL, worlds=2, blocks=2)
    with pytest.raises(InputError, match=words):
        batch.set(**{"force_std": 5e-3} | values)
    for one in (batch, untouched):
        one.advance(0.1)
    assert np.array_equal(batch.state()["pose"], untouched.state()["pose"])


def test_refuses_starts_that_are_none() -> None:
    study = tank_study()
    batch = dw.TankBatch(study, STILL, worlds=2, blocks=2)
    good = batch.state()
    domino = {"assembly": np.zeros((2, 2)), "cell": np.array([[[0, 0], [1, 0]]] * 2)}
    for changed, words in (
        ({"pose": good["pose"][:1]}, "shape"),
        ({"cell": None}, "cell"),
        ({"velocity": np.full((2, 2, 3), math.inf)}, "velocity"),
        ({"assembly": np.array([[0, 0], [1, 1]])}, "lowest"),
        (domino, "lattice"),
        ({**domino, "pose": np.array([[[0, 0, 0], [0.03, 0, 0.1]]] * 2)}, "lattice"),
        ({**domino, "pose": np.array([[[1, 0, 0], [1.03, 0, 0]]] * 2)}, "beyond the tank"),
        ({**domino, "cell": np.array([[[0, 0], [2, 0]]] * 2)}, "lattice"),
    ):
        start = {key: values for key, values in (good | changed).items() if values is not None}
        with pytest.raises(InputError, match=words):
            dw.TankBatch(study, STILL, worlds=2, blocks=2, start=start)
    with pytest.raises(InputError, match="overlap"):
        dw.TankBatch(study, STILL, worlds=2, blocks=2, start=[(0, 0, 0), (0.01, 0, 0)])
    with pytest.raises(InputError, match="does not cover"):
        dw.TankBatch(tank_study(2.0), [dw.tank30_flow()], worlds=2)
    for worlds in ([2], [0.0], [], [[0, 1]], [True], [False, False], ["0"], [-1]):
        with pytest.raises(InputError, match="worlds: expected"):
            batch.take(worlds, seed=0)
    with pytest.raises(InputError, match="worlds"):
        dw.TankBatch(study, STILL, worlds=0)
    with pytest.raises(InputError, match="duration"):
        batch.advance(-1.0)
    with pytest.raises(InputError, match="time steps"):
        batch.advance(1e12)


def test_a_world_whose_numbers_are_lost_has_no_class_and_the_others_go_on() -> None:
    study = tank_study(forces={"force_interval_s": 0.01})
    batch = dw.TankBatch(study, dw.uniform_flow(1.0, 0.0), worlds=3, blocks=2)
    batch.set(force_std=[1e-3, 1e30, 1e-3])
    batch.advance(1.0)
    assert batch.sound.tolist() == [True, False, True]
    assert batch.outcome[1] == ""
    assert "" not in batch.outcome[[0, 2]]
