"""Every command ends with the command that most users run next, ready to paste.

The recording is the first minute of the bundled one, which another engine simulated.
"""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest
from command_line import FLOW, RECORDING, Done, here
from typer.main import get_command

from driftwalk.cli.main import app

FIT = ("--tank", "30cm", "--spline-spacing", "4cm", "--no-check", "--angle", "none")
FEW = ("--runs", "4", "--duration", "5s", "--film", "none", "--threads", "1")

pytestmark = pytest.mark.usefixtures("undrawn")


@pytest.fixture
def tracks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a recording in the present folder, which has a space in its name."""
    monkeypatch.chdir(tmp_path)
    path = Path("my tracks.nc")
    assert here("read", RECORDING, "--to", "60s", *FIT[:2], "-o", path).code == 0
    return path


def next_of(done: Done) -> list[str]:
    """Return the words of the last line, after checking that they are a command that there is."""
    assert done.code == 0, done.err
    program, *words = shlex.split(done.err.splitlines()[-1].removeprefix("next: "))
    assert done.err.splitlines()[-1].startswith("next: ")
    assert program == "driftwalk"
    assert words[0] in get_command(app).commands  # type: ignore[attr-defined]
    return words


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("info", "my tracks.nc"), ["fit", "my tracks.nc"]),
        (("read", "my tracks.nc", "-o", "b.nc"), ["fit", "b.nc", "-o", "b-fit"]),
        (
            ("flow", "my tracks.nc", "-o", "f.nc"),
            ["calibrate", "my tracks.nc", "--flow", "f.nc", "-o", "f-run"],
        ),
        (("flow", FLOW, "--tank", "30cm", "-o", "f.nc"), ["simulate", "--flow", "f.nc"]),
        (
            ("simulate", "--flow", FLOW, "--duration", "2s", "-o", "s.nc"),
            ["report", "s.nc", "-o", "report.html"],
        ),
        (
            ("simulate", "--flow", FLOW, "--like", "my tracks.nc", "-o", "s.nc"),
            ["compare", "my tracks.nc", "s.nc"],
        ),
        (("compare", "my tracks.nc", "my tracks.nc", "--permutations", "0"), ["report"]),
        (("study", "new", "study.toml"), ["fit", "RECORDING", "--study", "study.toml"]),
        (("models",), ["compare-models", "RECORDING", "--models", "all"]),
    ],
)
def test_the_last_line_is_the_next_command(
    tracks: Path, words: tuple[str, ...], expected: list[str]
) -> None:
    assert next_of(here(*words))[: len(expected)] == expected


def test_what_was_said_of_tank_and_body_is_said_again(tmp_path: Path) -> None:
    study, out = tmp_path / "my.toml", tmp_path / "f.nc"
    study.write_text('[block]\ndepth = "archimedes"\n', encoding="utf-8")
    said = ("--study", study, "--tank", "31cm", "--side", "2.9cm", "--mass", "12g")
    words = next_of(here("flow", RECORDING, "--to", "60", *said, "--cells", "30", "-o", out))
    said_again = ["--tank", "31cm", "--study", str(study), "--side", "0.029"]
    assert words[:-2] == [
        *("calibrate", str(RECORDING), "--to", "60", *said_again, "--mass", "0.012"),
        *("--flow", str(out)),
    ]


@pytest.mark.slow
def test_a_name_that_is_taken_is_not_proposed(tracks: Path) -> None:
    simulate = ("simulate", "--flow", FLOW, "--duration", "2s", "--overwrite", "-o", "s.nc")
    proposed = []
    for _ in range(3):
        proposed.append(next_of(here(*simulate))[-1])
        Path(proposed[-1]).touch()
    assert proposed == ["report.html", "report-2.html", "report-3.html"]
    for finished, name in ((False, "my tracks-fit"), (True, "my tracks-fit-2")):
        Path("my tracks-fit").mkdir(exist_ok=True)
        if finished:
            Path("my tracks-fit", "manifest.json").touch()
        assert next_of(here("info", tracks))[-1] == name


def test_the_side_that_a_fitted_tank_took_is_asked_for(tmp_path: Path) -> None:
    done = here("flow", RECORDING, "--to", "300", "--tank", "fit", "-o", tmp_path / "f.nc")
    assert "the mass and side were not stated" in done.err


@pytest.mark.slow
def test_the_lines_lead_from_a_recording_to_a_page(tracks: Path) -> None:
    words = next_of(here("info", tracks))
    words = next_of(here(*words, *FIT))
    assert words == ["assemble", "my tracks-fit", "-o", "my tracks-fit-assembly"]
    words = next_of(here(*words, *FEW))
    done = here(*words)
    assert done.code == 0, done.err
    assert done.err.splitlines()[-1] == "next: open report.html in a browser"
    assert Path("report.html").is_file()
