"""Keypoints and markers on the command line and in a study."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import here, refusal
from tracker_files import dlc_csv, sleap_hdf5

import driftwalk as dw
from driftwalk.core.errors import ConfigurationError
from driftwalk.model import parse_study

FRAMES = ("--fps", "10", "--scale", "1cm")


@pytest.mark.slow
def test_info_and_convert_of_a_pose_file(tmp_path: Path) -> None:
    path = sleap_hdf5(tmp_path / "swimmers.analysis.h5")
    assert "name the body's keypoint with --keypoint: nose, tail" in refusal(
        here("info", path, *FRAMES)
    )
    pose = ("--keypoint", "nose", "--heading", "tail,nose", "--min-confidence", "0.5")
    done = here("info", path, *FRAMES, *pose, "--json")
    assert done.code == 0, done.err
    answer = json.loads(done.out)
    assert answer["format"] == "sleap"
    assert any("below 0.5 are missing: 1 of 24" in text for text in answer["warnings"])
    assert here("read", path, "-o", tmp_path / "out.nc", *FRAMES, *pose).code == 0
    kept = dw.load(tmp_path / "out.nc")
    assert int(np.isnan(kept["theta"].sel(body="a")).sum()) == 1
    assert "--min-confidence changes it" in here("info", path, *FRAMES, *pose[:4]).err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--heading", "tail"), "--heading is two points, from and to; got tail"),
        (("--heading", "tail,ear"), "there is no keypoint 'ear'"),
        (("--keypoint", "ear"), "name the body's keypoint with --keypoint (got 'ear'): nose, tail"),
        (("--min-confidence", "-1"), "--min-confidence"),
    ],
)
def test_wrong_words(tmp_path: Path, words: tuple[str, ...], message: str) -> None:
    path = dlc_csv(tmp_path, ["one"])
    assert message in refusal(here("info", path, *FRAMES, "--keypoint", "nose", *words))


def test_a_study_says_how_a_pose_is_read(tmp_path: Path) -> None:
    path = dlc_csv(tmp_path, ["one"])
    study = parse_study(
        '[recording]\narena = "file"\nframe_rate_Hz = 10\nmetres_per_pixel = 0.01\n'
        'keypoint = "nose"\n'
        'heading = ["tail", "nose"]\nmin_confidence = 0.1\n'
    )
    read = dw.conditions.load_with_study(path, study)
    assert np.isfinite(read["theta"]).all()
    again = parse_study(study.to_toml())
    assert again.recording.heading == ("tail", "nose")
    with pytest.raises(ConfigurationError, match="heading"):
        parse_study('[recording]\nheading = ["tail"]\n')
