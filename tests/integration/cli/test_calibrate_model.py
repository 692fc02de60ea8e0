"""`driftwalk calibrate --model`: another model than the block, on a minute of its own motion."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command_line import GRID, here, leave_out_figures, refusal
from self_propelled import SPEED, moving

import driftwalk as dw
from driftwalk.record import save_trajectory


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a recording of an active body (synthetic), a study and a model file."""
    folder = tmp_path_factory.mktemp("model")
    model = dw.motion_model("active", turn_rate=0.0, clearance=0.015)
    moved = moving(model, {"speed": SPEED, "rotational_diffusion": 0.5}, 120.0, seed=1)
    save_trajectory(moved, folder / "recording.nc")
    (folder / "grid.toml").write_text(GRID)
    (folder / "mine.py").write_text(
        "import numpy as np\n\n\n"
        "def diffuse(scene, *, diffusivity=(1e-6, 1e-2, 'm2/s')):\n"
        "    spread = np.sqrt(2 * diffusivity * np.diff(scene.times, prepend=0.0))\n"
        "    x, y = (np.cumsum(spread * scene.random.normal(spread.size), axis=1) for _ in 'xy')\n"
        "    return scene.start.x[:, None] + x, scene.start.y[:, None] + y\n\n\n"
        "def nowhere(scene, *, speed=(0.01, 0.1, 'm/s')):\n"
        "    return (np.full((scene.worlds, scene.times.size), np.nan),) * 2\n\n\n"
        "def fails(scene, *, speed=(0.01, 0.1, 'm/s')):\n"
        "    raise ValueError('no such speed')\n"
    )
    return folder


def words(place: Path, out: Path) -> tuple[object, ...]:
    return ("calibrate", place / "recording.nc", "--study", place / "grid.toml", "-o", out)


@pytest.mark.slow
def test_the_speed_of_an_active_body_is_found(
    place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A constant speed: its error is that of the camera over some steps, and the grid's step."""
    leave_out_figures(monkeypatch)
    chosen = ("--model", "active", "--parameter", "turn_rate=0", "--parameter", "clearance=0.015")
    ranges = ("--parameter", "speed=0.03,0.08", "--parameter", "rotational_diffusion=0.1,2")
    done = here(*words(place, tmp_path / "run"), *chosen, *ranges, "--json")
    assert done.code == 0, done.err
    said = json.loads(done.out)
    assert said["model"] == "active"
    assert said["speed_m_s"] == pytest.approx(SPEED, rel=0.05)
    low, high = said["rotational_diffusion_rad2_s_interval"]
    assert low <= said["rotational_diffusion_rad2_s"] <= high
    assert "drag_coefficient" not in said
    assert "force_interval_s" not in said


@pytest.mark.slow
def test_a_model_in_a_file_of_the_users(
    place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    leave_out_figures(monkeypatch)
    done = here(*words(place, tmp_path / "run"), "--model", f"{place / 'mine.py'}:diffuse")
    assert done.code == 0, done.err
    assert done.out.startswith("diffusivity")
    assert "m2/s" in done.out.splitlines()[0]
    manifest = json.loads((tmp_path / "run" / "manifest.json").read_text())
    assert manifest["specification"]["model"]["source_sha256"]


FIXED = (
    *("--parameter", "speed=0.1", "--parameter", "rotational_diffusion=1"),
    *("--parameter", "turn_rate=0"),
)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (
            ("--model", "active", *FIXED),
            "active has 0 parameters to search; a grid takes one or two",
        ),
        (("--model", "activ"), "activ"),
        (("--model", "nowhere.py:diffuse"), "nowhere.py"),
        (("--parameter", "speed=0.1"), "belongs to a --model"),
        (("--model", "active", "--parameter", "speed"), "expected NAME=VALUE"),
        (("--model", "active", "--parameter", "speed=a,b"), "expected NAME=VALUE"),
        (("--model", "active", "--parameter", "speed=1,2,3"), "expected NAME=VALUE"),
        (("--model", "active", "--parameter", "sped=1"), "sped"),
        (("--model", "active", "--parameter", "speed=1", "--parameter", "speed=2"), "twice"),
    ],
)
def test_mistakes_are_one_line(
    place: Path, tmp_path: Path, options: tuple[str, ...], said: str
) -> None:
    assert said in refusal(here(*words(place, tmp_path / "run"), *options))
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("nowhere", "no finite numbers in every world that was tried, such as at speed="),
        ("fails", "failed: ValueError: no such speed; what was finished is kept"),
    ],
)
def test_a_model_that_fails_is_one_line_with_its_setting(
    place: Path, tmp_path: Path, name: str, said: str
) -> None:
    address = f"{place / 'mine.py'}:{name}"
    done = here(*words(place, tmp_path / "run"), "--model", address)
    # The run had begun: it said in which tank.
    opening, *rest = done.err.splitlines(keepends=True)
    assert opening.startswith("driftwalk: tank: ")
    assert said in refusal(done._replace(err="".join(rest)))
    others = (
        "compare-models",
        place / "recording.nc",
        "--models",
        f"{address},inertial",
        "--bootstrap",
        "0",
    )
    done = here(*others, "-o", tmp_path / "compared")
    line = done.err.splitlines()[-1]
    assert done.code == 2
    assert "Traceback" not in done.err
    assert said.removesuffix("; what was finished is kept") in line
    assert "speed=" in line
