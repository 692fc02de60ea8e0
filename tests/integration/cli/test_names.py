"""Names and letters that an encoding lacks: they end in text, never in a traceback."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
from command_line import FLOW, NO_FIGURES, apart, here

from driftwalk.page import report_page
from driftwalk.record import load

TRACK = b"t_s,x_m,y_m\n" + b"".join(b"%.1f,%.3f,0\n" % (k / 10, k / 1000) for k in range(30))
ASCII = {**os.environ, "PYTHONIOENCODING": "ascii"}


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """Return a recording whose name and folder are Latin-1, which UTF-8 cannot read."""
    folder = tmp_path / os.fsdecode(b"J\xf6rg")
    try:
        folder.mkdir()
    except OSError:
        pytest.skip("this file system takes names of UTF-8 only")
    path = folder / os.fsdecode(b"K\xe4fer.csv")
    path.write_bytes(TRACK)
    return path


def test_a_name_that_is_not_utf8_is_spelled_in_a_recording(recording: Path) -> None:
    out = recording.with_name("out.nc")
    assert here("read", recording, "-o", out).code == 0
    assert load(out).attrs["source"] == "out.nc"
    assert load(recording).attrs["source"] == "K\\xe4fer.csv"


@pytest.mark.slow
def test_a_name_that_is_not_utf8_is_spelled_in_a_manifest_and_on_the_page(recording: Path) -> None:
    run = recording.parent / os.fsdecode(b"run\xfc")
    study = recording.with_name("study.toml")
    study.write_text("[assembly]\nruns = 2\nblocks = 2\nduration_s = 1.0\n")
    flow = recording.with_name(os.fsdecode(b"Str\xf6mung.csv"))
    flow.write_bytes(FLOW.read_bytes())
    done = apart("assemble", "--study", study, "--flow", flow, "--out", run, before=NO_FIGURES)
    assert done.code == 0, done.err
    manifest = json.loads((run / "manifest.json").read_bytes())
    assert manifest["inputs"]["flow"]["path"].endswith("J\\xf6rg/Str\\xf6mung.csv")
    assert report_page(run)["subtitle"] == "run\\xfc"


@pytest.mark.slow
def test_stdout_spells_what_its_encoding_lacks(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes(TRACK)
    done = apart("report", tmp_path / "a.csv", "--out", tmp_path / "Käfer.html", env=ASCII)
    assert done.code == 0, done.err
    assert "K\\xe4fer.html" in done.out
    assert (tmp_path / "Käfer.html").exists()
