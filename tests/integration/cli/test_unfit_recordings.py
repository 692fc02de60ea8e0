"""What makes a recording unfit for one estimator makes it unfit for all, by one question."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command_line import here, refusal

import driftwalk as dw
from driftwalk.conditions import require_travel
from driftwalk.core.errors import InputError
from driftwalk.schema import Track

COMMANDS = {
    "fit": ("fit",),
    "calibrate": ("calibrate",),
    "calibrate-model": ("calibrate", "--model", "run_rest"),
    "compare-models": ("compare-models",),
}
SAMPLES = 600


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(("place_m", "width_m"), [("still", 2e-4), ("noise", 5e-3)])
def test_a_body_that_only_the_tracker_moves(
    command: str, place_m: str, width_m: float, tmp_path: Path
) -> None:
    """A still body with 0.2 mm of noise, and 5 mm of noise alone."""
    noise = np.random.default_rng(3).normal(0.0, width_m, (SAMPLES, 2))
    rows = np.column_stack([0.1 * np.arange(SAMPLES), noise + np.array([0.01, 0.02])])
    path = tmp_path / f"{place_m}.csv"
    np.savetxt(path, rows, delimiter=",", header="t,x,y", comments="")
    options = ("--tank", "30cm", "-o", tmp_path / "run")
    done = here(COMMANDS[command][0], path, *COMMANDS[command][1:], *options)
    line = refusal(done)
    assert line.count(path.name) == 1
    assert "the body never moves: it stays within" in line
    assert not (tmp_path / "run").exists()


def test_one_sample_is_described(tmp_path: Path) -> None:
    path = tmp_path / "one.csv"
    path.write_text("t,x,y\n0,0.1,0.2\n", encoding="utf-8")
    done = here("info", path)
    assert done.code == 0
    assert "the body never moves" in done.err


def test_the_side_counts_for_the_block_alone() -> None:
    """A beetle of 2 mm that walks over 2 mm moves; a block of 3 cm does not."""
    time = 0.1 * np.arange(SAMPLES)
    angle = 0.2 * time
    x, y = 1e-3 * np.cos(angle), 1e-3 * np.sin(angle)
    track = Track(time, x, y, np.full(SAMPLES, np.nan))
    require_travel(track, dw.Study(), of_block=False)
    with pytest.raises(InputError, match="less than a tenth of its side of 30 mm"):
        require_travel(track, dw.Study())
