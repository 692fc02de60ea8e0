"""`driftwalk info`: asks for all that is missing, and ends with the command that follows."""

from __future__ import annotations

import shlex
from pathlib import Path

import numpy as np
import pytest
from command_line import RECORDING, Done, here, leave_out_figures, refusal

TURN = np.linspace(0.0, 40.0, 3000)


@pytest.fixture
def pixels(tmp_path: Path) -> Path:
    """Return a body that goes round in a circle of 400 pixels across, counted in frames."""
    path = tmp_path / "my tracks.csv"
    radius = 200.0 * np.sqrt(np.abs(np.sin(0.37 * TURN)))
    table = [np.arange(TURN.size), 300 + radius * np.cos(TURN), 300 + radius * np.sin(TURN)]
    np.savetxt(path, np.stack(table, 1), delimiter=",", header="frame,x_px,y_px", comments="")
    return path


def following(done: Done) -> list[str]:
    assert done.code == 0, done.err
    *_, last = done.err.splitlines()
    assert last.startswith("next: driftwalk ")
    return shlex.split(last)[2:]


def test_everything_that_is_missing_is_asked_for_at_once(pixels: Path) -> None:
    said = refusal(here("info", pixels))
    assert "--scale" in said
    assert "--fps" in said
    assert "--tank 30cm" in said
    pixels.write_text("x_px,y_px\n1,2\n3,4\n", encoding="utf-8")
    said = refusal(here("info", pixels))
    assert "--scale" in said
    assert "--fps" in said


def test_a_known_tank_and_the_circle_of_positions_imply_the_scale(pixels: Path) -> None:
    said = refusal(here("info", pixels, "--tank", "30cm"))
    assert "in a tank of 0.3 m: a unit is 0.00075" in said
    said = refusal(here("info", pixels, "--tank", "circle:60cm"))
    assert "in a tank of 0.6 m: a unit is 0.0015 m at most" in said
    said = refusal(here("info", pixels, "--tank", "rect:40cmx60cm"))
    assert "in a tank of 0.4 m by 0.6 m: a unit is 0.001" in said
    assert "state the tank" not in said


def test_it_ends_with_the_command_that_follows(pixels: Path) -> None:
    how = ("--scale", "0.5mm", "--fps", "30", "--columns", "x=x_px")
    words = following(here("info", pixels, *how))
    assert words[:2] == ["fit", str(pixels)]
    assert words[words.index("--scale") + 1] == "0.0005"
    assert words[words.index("--fps") + 1] == "30"
    assert words[words.index("--columns") + 1] == "x=x_px"
    assert words[words.index("--tank") + 1] == "fit"
    assert words[-2:] == ["-o", "my tracks-fit"]
    stated = following(here("info", pixels, *how, "--tank", "40cm", "--side", "3cm"))
    assert stated.count("--tank") == 1
    assert stated[stated.index("--tank") + 1] == "40cm"
    assert stated[stated.index("--side") + 1] == "0.03"


@pytest.mark.parametrize("command", ["info", "read"])
def test_a_tank_that_nobody_knows_is_asked_for(command: str, tmp_path: Path) -> None:
    """An animal in the open: the command without a tank would end in an error."""
    path, out = tmp_path / "walk.csv", ["-o", tmp_path / "walk.nc"] if command == "read" else []
    for offset, asked in ((1.0, True), (0.0, False)):
        rows = "".join(f"{0.1 * k},{offset + 1e-3 * k},0\n" for k in range(100))
        path.write_text("t,x,y\n" + rows, encoding="utf-8")
        again = ["--overwrite"] if command == "read" else []
        words = following(here(command, path, *out, *again))
        assert (words[2:4] == ["--tank", "DIAMETER"]) == asked
        assert ("--tank" in words) == asked


@pytest.mark.slow
def test_the_command_that_follows_works_as_it_is_printed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    leave_out_figures(monkeypatch)
    monkeypatch.chdir(tmp_path)
    words = following(here("info", RECORDING, "--to", "60s", "--tank", "30cm"))
    done = here(*words, "--spline-spacing", "5cm", "--no-check")
    assert done.code == 0, done.err
    assert (tmp_path / "recording-fit" / "fit.nc").is_file()
