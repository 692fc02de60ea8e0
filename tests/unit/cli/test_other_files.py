"""What a reader is told of a file that is no recording."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import pytest
import xarray as xr

from driftwalk.cli.inputs.other_files import what_else
from driftwalk.cli.main import main

RECORDING = Path(str(files("driftwalk.datasets") / "tank30_ode_a" / "recording.csv"))


@pytest.mark.parametrize(
    ("kind", "command"),
    [
        ("assembly_path", "driftwalk classify"),
        ("flow_field", "--flow"),
        ("fit", "driftwalk report"),
    ],
)
def test_a_result_names_the_command_that_takes_it(
    tmp_path: Path, kind: str, command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "result.nc"
    xr.Dataset(attrs={"kind": kind}).to_netcdf(path, engine="h5netcdf")
    assert main(["info", str(path)]) == 2
    line = capsys.readouterr().err.strip()
    assert str(path) in line
    assert command in line
    assert len(line.splitlines()) == 1


def test_a_video_is_to_be_tracked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "film.MP4"
    path.write_bytes(b"\x00\x00\x00\x18ftypmp42")
    assert main(["report", str(path), "-o", str(tmp_path / "report.html")]) == 2
    assert "driftwalk track" in capsys.readouterr().err


def test_nothing_is_said_of_other_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    damaged = tmp_path / "damaged.nc"
    damaged.write_bytes(b"\x89HDF\r\n\x1a\n")
    for path in (RECORDING, damaged, tmp_path, tmp_path / "absent.mp4"):
        assert what_else(path) is None
    assert main(["info", str(tmp_path / "absent.mp4")]) == 2
    assert "no such file" in capsys.readouterr().err


def test_a_run_directory_points_to_the_recording_in_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / ".run.json").write_text("{}")
    (tmp_path / "recording.nc").write_bytes(b"")
    assert main(["read", str(tmp_path), "-o", str(tmp_path / "read.nc")]) == 2
    line = capsys.readouterr().err
    assert "run directory: driftwalk report" in line
    assert str(tmp_path / "recording.nc") in line
