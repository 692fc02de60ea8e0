"""The saved playground's core outside of its page: the same calls in Node and in a browser."""

from __future__ import annotations

import json
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import driftwalk as dw
from driftwalk.page.html import WORKER, bundle_file
from driftwalk.viewer import PlaySource
from driftwalk.viewer.play.saved import local_tank

PRELUDE = """async (given) => {
  const { modelOf, checkLocal, LocalTank } = driftwalkPlayground;
  const { MotionWindow, outcomeOf, className, graphClass } = driftwalkPlayground;
  const model = given.local === undefined ? null : await modelOf(checkLocal(given.local, ""));
  const hex = (numbers) => Array.from(
    new BigUint64Array(Float64Array.from(numbers).buffer), (bits) => bits.toString(16));
"""
TRACE = (
    PRELUDE
    + """
  const tank = new LocalTank(model, given.values);
  return given.moves.map(({ seconds, set, part }) => {
    if (set !== null) tank.set(set, part);
    tank.advance(seconds);
    const { pose, velocity, assembly } = tank.read();
    return {
      pose: hex(pose), velocity: hex(velocity), assembly: Array.from(assembly),
      outcome: tank.outcome(tank.read()), waiting: tank.waiting,
    };
  });
}"""
)
"""A tank that is advanced and changed, move by move."""


def in_node(function: str, given: dict[str, Any]) -> Any:
    """Return what a function of the bundle gives in Node; without Node the test is skipped."""
    if shutil.which("node") is None:
        pytest.skip("Node is not installed")
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "program.cjs"
        program.write_text(
            f"{bundle_file(WORKER)}\n({function})({json.dumps(given)})"
            ".then((result) => process.stdout.write(JSON.stringify(result)));",
            encoding="utf-8",
        )
        done = subprocess.run(["node", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@dataclass(frozen=True)
class Move:
    """Some time of a tank, after a change of its settings."""

    seconds: float
    set: dict[str, Any] | None = None
    part: bool = False


def moved_in_browser(source: PlaySource, moves: Sequence[Move]) -> dict[str, Any]:
    """Return what `TRACE` takes."""
    return {
        "local": local_tank(source),
        "values": knob_values(source),
        "moves": [asdict(move) for move in moves],
    }


def require_same_bits(tank: dw.LiveTank, moves: Sequence[Move], found: Any) -> None:
    """Make the moves in the native core, and compare every bit of what came out of another."""
    assert len(found) == len(moves)
    for move, there in zip(moves, found, strict=True):
        if move.set is not None:
            tank.set(**move.set, part=move.part)
        tank.advance(move.seconds)
        pose = np.stack([tank.x, tank.y, tank.theta], axis=1)
        velocity = np.stack([tank.vx, tank.vy, tank.omega], axis=1)
        np.testing.assert_array_equal(numbers_of(there["pose"]), pose.ravel())
        np.testing.assert_array_equal(numbers_of(there["velocity"]), velocity.ravel())
        assert there["assembly"] == tank.assembly.tolist()
        assert (there["outcome"], there["waiting"]) == (tank.outcome, tank.waiting)


def knob_values(source: PlaySource) -> dict[str, Any]:
    """Return what the knobs of a tank stand at."""
    items = source.greeting()[0]["page"]["sections"][1]["items"]
    return {item["name"]: item["value"] for item in items}


def numbers_of(bits: list[str]) -> npt.NDArray[np.float64]:
    """Return doubles from their bits."""
    return np.array([int(word, 16) for word in bits], dtype=np.uint64).view(np.float64)
