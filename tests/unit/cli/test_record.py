"""`driftwalk info` and `driftwalk read`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from driftwalk.cli.main import main
from driftwalk.cli.options.recording import parse_columns
from driftwalk.core.errors import InputError
from driftwalk.record import load


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    path = tmp_path / "synthetic.csv"
    time = np.arange(100) * 0.1
    rows = [f"{t:.1f},{100 * np.cos(t):.3f},{100 * np.sin(t):.3f},{t:.3f}" for t in time]
    path.write_text("t,x_px,y_px,theta\n" + "\n".join(rows) + "\n")
    return path


def test_info_as_json(recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--scale", "1mm", "--from", "1s", "--to", "8s", "--tank", "30cm"]
    assert main(["info", str(recording), *options, "--json"]) == 0
    described = json.loads(capsys.readouterr().out)
    assert described["arena"]["diameter_m"] == 0.3
    assert described["y_axis"] == "down in the file: y and theta negated"
    assert described["metres_per_pixel"] == 0.001
    assert described["bodies"]["0"]["start_s"] == 1.0
    assert described["bodies"]["0"]["speed_mean_m_s"] == pytest.approx(0.1, rel=0.01)


def test_info_as_a_table(recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", str(recording), "--scale", "1mm", "--tank", "fit"]) == 0
    captured = capsys.readouterr()
    lines = {line[:32].strip(): line for line in captured.out.splitlines()}
    assert lines["samples left"].split()[-1] == "100"
    assert lines["rate (Hz)"].split()[-1] == "10"
    assert "down in the file" in captured.out
    assert "never reaches the rim" in captured.err


def test_info_of_many_bodies(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = [f"{t},{b},{t},robot{b}" for t in range(3) for b in range(8)]
    (tmp_path / "a.csv").write_text("t,x,y,robot\n" + "\n".join(rows))
    assert main(["info", str(tmp_path / "a.csv")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert sum(line.startswith("robot") and "body" not in line for line in lines) == 8


def test_convert_to_both_formats(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out.nc"
    convert = ["read", str(recording), "-o", str(out), "--scale", "0.001"]
    assert main([*convert, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["samples"] == 100
    assert main(convert) == 2
    assert "exists already" in capsys.readouterr().err
    assert main([*convert, "--overwrite"]) == 0
    assert main(["read", str(out), "-o", str(tmp_path / "out.csv")]) == 0
    first, second = load(out), load(tmp_path / "out.csv")
    for name in ("time", "x", "y", "theta"):
        np.testing.assert_array_equal(first[name].values, second[name].values)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ([], "--scale"),
        (["--scale", "1mm", "--fps", "25"], "--fps"),
        (["--scale", "1mm", "--columns", "x"], "--columns takes"),
        (["--scale", "1mm", "--format", "nothing"], "unknown --format"),
        (["--scale", "1mm", "--y-axis", "left"], "--y-axis"),
    ],
)
def test_a_mistake_is_one_line_and_code_2(
    recording: Path, options: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["info", str(recording), *options]) == 2
    error = capsys.readouterr().err.strip()
    assert message in error
    assert len(error.splitlines()) == 1


def test_columns_delimiter_and_sort_on_the_command_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.txt").write_text("2 10 20\n1 30 40\n")
    options = ["--columns", "t=1,x=2:cm", "--columns", "y=3:cm", "--delimiter", "space", "--sort"]
    assert main(["info", str(tmp_path / "a.txt"), *options, "--json"]) == 0
    described = json.loads(capsys.readouterr().out)
    assert described["counts"]["unsorted"] == 1
    assert described["bodies"]["0"]["x_max_m"] == pytest.approx(0.3)


def test_matrices_on_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("x", "y", "theta"):
        (tmp_path / f"{name}.csv").write_text("0.1,0.2\n0.3,0.4\n")
    options = ["--x", "x.csv", "--y", "y.csv", "--theta", "theta.csv", "--fps", "120"]
    assert main(["info", str(tmp_path), *options, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["format"] == "matrices"


def test_parse_columns() -> None:
    assert parse_columns(["t=Time (s),x=2", "y=y:mm"]) == {"t": "Time (s)", "x": "2", "y": "y:mm"}
    with pytest.raises(InputError, match="QUANTITY=NAME"):
        parse_columns(["t"])
