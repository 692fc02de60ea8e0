"""`driftwalk flow` from a recording to a file."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from driftwalk.cli.main import main
from driftwalk.flow import load_flow
from driftwalk.schema import FLAGS


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """Three minutes on a spiral in and out, synthetic."""
    time = 0.1 * np.arange(1800)
    radius = 0.06 + 0.05 * np.sin(0.07 * time)
    x, y = radius * np.cos(0.5 * time), radius * np.sin(0.5 * time)
    path = tmp_path / "synthetic.csv"
    np.savetxt(
        path, np.column_stack([time, x, y]), delimiter=",", header="t_s,x_m,y_m", comments=""
    )
    return path


def run(*words: object) -> int:
    return main(["flow", *map(str, words)])


def test_writes_a_field_and_says_so(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "flow.nc"
    assert run(recording, "-o", out, "--tank", "30cm") == 0
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "50 x 50 cells of 6 mm" in captured.err
    assert "0.0116 kg" in captured.err
    field = load_flow(out)
    assert (field.flag == FLAGS["measured"]).sum() > 100


@pytest.mark.slow
def test_options_reach_the_field(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "flow.nc"
    words = ("--tank", "0.32", "--mass", "20g", "--side", "4cm", "--depth", "archimedes")
    more = ("--cell-size", "1cm", "--window", "900ms", "--min-count", 2)
    assert (
        run(recording, "--out", out, *words, *more, "--flow-drag-coefficient", 1.2, "--json") == 0
    )
    told = json.loads(capsys.readouterr().out)
    attrs = load_flow(out).attrs
    for name, value in {
        "cell_size_m": 0.01,
        "mass_kg": 0.02,
        "area_m2": 0.04 * 0.02 / (1000 * 0.04**2),
        "window_s": 0.9,
        "flow_drag_coefficient": 1.2,
        "min_count": 2,
    }.items():
        assert attrs[name] == pytest.approx(value)
        assert told[name] == pytest.approx(value)
    assert (told["rows"], told["columns"]) == (32, 32)


@pytest.mark.slow
def test_a_study_gives_the_tank_and_the_block(recording: Path, tmp_path: Path) -> None:
    study = tmp_path / "study.toml"
    study.write_text('[block]\nmass_kg = "15g"\n[tank]\ndiameter_m = 0.4\n[flow]\ncells = 20\n')
    out = tmp_path / "flow.nc"
    assert run(recording, "-o", out, "--study", study, "--inertia", "none") == 0
    attrs = load_flow(out).attrs
    assert attrs["cell_size_m"] == pytest.approx(0.02)
    assert attrs["inertia"] == "none"
    assert run(recording, "-o", out, "--study", study, "--overwrite") == 0
    assert load_flow(out).attrs["mass_kg"] == 0.015


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "--tank"),
        (("--tank", "30cm", "--cells", "1"), "cells"),
        (("--tank", "30cm", "--inertia", "full"), "inertia"),
        (("--tank", "30kg"), "30kg"),
    ],
)
def test_mistakes_are_one_line_and_leave_no_file(
    words: tuple[str, ...],
    message: str,
    recording: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "flow.nc"
    assert run(recording, "-o", out, *words) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert message in error
    assert not out.exists()


def test_an_existing_file_is_left_as_it_is(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "flow.nc"
    out.write_text("mine")
    assert run(recording, "-o", out, "--tank", "30cm") == 2
    assert "--overwrite" in capsys.readouterr().err
    assert out.read_text() == "mine"


def test_a_sparse_field_warns(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ("-o", tmp_path / "flow.nc", "--tank", "30cm", "--to", "20s")
    assert run(recording, *words) == 0
    assert "warning: Only" in capsys.readouterr().err
