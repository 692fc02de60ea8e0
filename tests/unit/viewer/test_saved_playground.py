"""The saved playground: its WebAssembly, in Node, against the native core and against Python."""

from __future__ import annotations

import math
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser_tank import (
    PRELUDE,
    TRACE,
    Move,
    in_node,
    knob_values,
    moved_in_browser,
    numbers_of,
    require_same_bits,
)

import driftwalk as dw
from driftwalk.assembly import assemble
from driftwalk.assembly.lattice.polyomino import polyominoes
from driftwalk.assembly.outcomes.outcome_classes import BODY_CONTACT, disc_class, world_class
from driftwalk.comparison import apply_steps, ks_distance, ks_reference, plan_steps
from driftwalk.datasets import tank30_flow, tank30_recording
from driftwalk.schema.shapes import cells_of_shape
from driftwalk.viewer import PlaySource, save_playground
from driftwalk.viewer.play.saved import local_tank

CHANGES = (
    Move(3.0),
    Move(1.0, {"drag_coefficient": 0.55, "force_std": 1.1e-3, "flow_scale": 0.5}),
    Move(2.0, {"blocks": 9}),
    Move(1.0, {"latching": "none"}, part=True),
    Move(0.013, {"stirring_length": 0.06, "latching": "collision"}),
    Move(2.0, {"faces": "N,S,N,S", "hidden_face_drag": "full"}),
    Move(2.0, {"magnets": "3x3x1mm,1.2T"}),
    Move(2.0, {"bond_rate": 0.3, "magnets": "none"}),
    Move(1.0, {"blocks": 3, "bond_rate": 0.0}),
)
RECTANGLES = (
    Move(10.0),
    Move(4.0, {"blocks": 8, "drag_coefficient": 0.55, "stirring_length": 0.06}),
    Move(3.0, {"bond_rate": 0.3}),
    Move(2.0, {"blocks": 5, "bond_rate": 0.0}),
    Move(1.0, {"latching": "none"}, part=True),
)


def study(**assembly: Any) -> dw.Study:
    """Return a tank of 30 cm with some blocks, stirred so that they meet soon."""
    return dw.Study(
        forces={"drag_coefficient": 0.4, "force_std_N": 8e-4}, assembly={"blocks": 4, **assembly}
    )


@pytest.mark.slow
def test_half_a_minute_of_four_blocks_has_the_bits_of_the_native_core() -> None:
    source = PlaySource(study(), tank30_flow())
    moves = [Move(5.0)] * 6
    found = in_node(TRACE, moved_in_browser(source, moves))
    require_same_bits(dw.LiveTank(study(), tank30_flow()), moves, found)
    assert found[-1]["outcome"] != "1+1+1+1"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("chosen", "moves"),
    [
        (study(), CHANGES),
        (study(latching="connector", chirality="distinct"), [Move(20.0)]),
        (study(blocks=24), [Move(6.0)]),
        (
            dw.apply_overrides(
                study(),
                {"tank.shape": "rectangle", "tank.width_m": 0.2, "tank.height_m": 0.2},
            ),
            [Move(4.0)],
        ),
        (dw.apply_overrides(study(), {"block.shape": "disc"}), [Move(10.0)]),
        (dw.apply_overrides(study(), {"block.shape": "rectangle:4x2cm"}), RECTANGLES),
    ],
    ids=["changes", "connectors", "many", "tank with sides", "discs", "rectangles"],
)
def test_every_knob_has_the_bits_of_the_native_core(chosen: dw.Study, moves: list[Move]) -> None:
    flow = tank30_flow()
    found = in_node(TRACE, moved_in_browser(PlaySource(chosen, flow), moves))
    require_same_bits(dw.LiveTank(chosen, flow), moves, found)


@pytest.mark.slow
def test_runs_end_in_the_classes_of_the_reference_kernel() -> None:
    short = study(duration_s=20.0, runs=12)
    source = PlaySource(short, tank30_flow())
    counted = (
        PRELUDE
        + """ return Array.from({ length: 12 }, (_, k) =>
          outcomeOf(model, given.values, model.local.seed, k)); }"""
    )
    found = in_node(counted, {"local": local_tank(source), "values": knob_values(source)})
    runs = assemble(short, tank30_flow(), backend="reference")
    classes = runs["class"].values[runs["outcome"].values].tolist()
    assert [one["name"] for one in found] == classes
    # The page looks once a second.
    whole = [math.inf if one["complete"] is None else one["complete"] for one in found]
    exact = runs["completion_time"].fillna(math.inf).values
    np.testing.assert_array_equal(np.isinf(whole), np.isinf(exact))
    ended = np.isfinite(exact)
    assert ended.any()
    late = np.array(whole)[ended] - exact[ended]
    assert ((late >= 0.0) & (late < 1.01)).all()


def test_classes_have_the_names_that_python_gives() -> None:
    draw = random.Random(1)
    worlds = []
    for merged in (True, False):
        chirality = "merged" if merged else "distinct"
        shapes = [name for size in range(1, 7) for name in polyominoes(size, chirality=chirality)]
        for shape in shapes:
            cell, label = [], []
            for number, name in enumerate([shape, *draw.choices(shapes, k=2)]):
                turned = np.array(cells_of_shape(name)) @ [[0, 1], [-1, 0]]
                cell += (turned + draw.randrange(9)).tolist()
                label += [number] * len(turned)
            worlds.append((cell, label, merged, world_class(cell, label, chirality=chirality)))
    named = (
        PRELUDE
        + """ return given.worlds.map(([cell, assembly, merged]) =>
          className({ cell: cell.flat(), assembly }, merged, 64)); }"""
    )
    found = in_node(named, {"worlds": [world[:3] for world in worlds]})
    assert found == [world[3] for world in worlds]


@pytest.mark.parametrize(("noun", "width"), [("discs", None), ("rectangles", 0.02)])
def test_contact_graphs_have_the_names_that_python_gives(noun: str, width: float | None) -> None:
    """Clusters on a hexagonal lattice, of rectangles in staggered rows, some turned by 180°."""
    draw, side = random.Random(2), 0.04
    worlds = []
    for world in range(150):
        pose, label = [], []
        for number in range(draw.randrange(1, 4)):
            taken = [(0, 0)]
            while len(taken) < world % 10 + 1:
                (column, row), step = draw.choice(taken), draw.choice(range(6))
                dx, dy = ((1, 0), (0, 1), (-1, 1), (-1, 0), (0, -1), (1, -1))[step]
                taken += [(column + dx, row + dy)] * ((column + dx, row + dy) not in taken)
            turn = draw.uniform(-3, 3)
            height = side * math.sqrt(0.75) if width is None else width
            for column, row in draw.sample(taken, len(taken)):
                x, y = side * (column + row / 2), height * row
                z = complex(x, y) * complex(math.cos(turn), math.sin(turn))
                pose.append([z.real, z.imag, turn + math.pi * draw.randrange(2)])
                label.append(number)
        worlds.append((pose, label, disc_class(np.array(pose), label, diameter=side, width=width)))
    named = (
        PRELUDE
        + """ return given.worlds.map(([pose, assembly]) => graphClass(
          { pose: pose.flat(), assembly }, { ...given.bodies, gap: given.gap }, 64)); }"""
    )
    given = {"noun": noun, "side": side, "width": width}
    found = in_node(
        named,
        {"worlds": [one[:2] for one in worlds], "bodies": given, "gap": BODY_CONTACT.gap},
    )
    assert found == [one[2] for one in worlds]
    assert len(set(found)) > 100


def test_steps_and_their_distance_are_those_of_the_native_core() -> None:
    source = PlaySource(study(), tank30_flow(), recording=tank30_recording())
    local = local_tank(source)
    local["motion"]["recording"] |= {"noise": 0.0, "quantum": 0.0}
    rng = np.random.default_rng(3)
    path = np.cumsum(rng.normal(0.0, 2e-3, (900, 2, 2)), axis=0)
    window = (
        PRELUDE
        + """
      const motion = new MotionWindow(model.core, model.local.motion, 1);
      await motion.prepare();
      for (const [x, y] of given.path) motion.add(x, y, [0, 1]);
      const { length, angle } = motion.steps();
      const first = motion.message();
      for (let k = 0; k < 30; k += 1) motion.work();
      return { length: hex(length), angle: hex(angle), first, last: motion.message() };
    }"""
    )
    found = in_node(window, {"local": local, "path": path.transpose(0, 2, 1).tolist()})
    plan = plan_steps(source.motion.interval * np.arange(900), step_interval=source.motion.interval)
    steps = [apply_steps(plan, *path[:, block].T) for block in range(2)]
    length = np.concatenate([one.step_length for one in steps])
    angle = np.concatenate([one.turning_angle for one in steps])
    np.testing.assert_array_equal(numbers_of(found["length"]), length)
    np.testing.assert_array_equal(numbers_of(found["angle"]), angle)
    points = np.column_stack([length, angle])
    assert source.recording is not None
    recorded = source.recording.steps
    assert found["first"]["ks_distance"] == ks_reference(recorded.points).distance(points)
    assert found["first"]["ks_distance"] == ks_distance(points, recorded.points)
    assert found["first"]["recording"] == pytest.approx(recorded.density(), abs=1e-12)
    assert np.sum(found["first"]["simulated"]) == pytest.approx(1.0)
    # Of 19 shuffles of blocks: between what single points would give, and the distance itself.
    assert found["first"]["noise_floor"] is None
    assert 0.0 < found["last"]["noise_floor"] < found["last"]["ks_distance"]


def test_a_file_holds_everything_and_is_small(tmp_path: Path) -> None:
    source = PlaySource(study(), tank30_flow(), recording=tank30_recording())
    text = save_playground(source, tmp_path / "tank.html").read_text(encoding="utf-8")
    assert save_playground(source, tmp_path / "again.html").read_text(encoding="utf-8") == text
    assert "wasm-unsafe-eval" in text
    assert "worker-src blob:" in text
    assert "http://" not in text.replace("http://www.w3.org", "")
    assert not math.isnan(source.time)
