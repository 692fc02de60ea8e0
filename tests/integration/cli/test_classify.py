"""`driftwalk classify` on synthetic recordings of blocks that join."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from command_line import Done, contents, here, refusal

SIDE = 0.03
HEADER = "t_s,x_m,y_m,theta_rad,body"


def table(poses: dict[str, np.ndarray], header: str = HEADER) -> str:
    """Return a plain table of bodies with poses (time, 3) at 10 Hz."""
    rows = [
        f"{k / 10:.1f},{x:.6f},{y:.6f},{theta:.6f},{body}"
        for body, track in poses.items()
        for k, (x, y, theta) in enumerate(track)
    ]
    return "\n".join([header, *rows, ""])


def still(x: float, count: int = 60) -> np.ndarray:
    return np.tile([x, 0.0, 0.0], (count, 1))


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """Return a synthetic recording: blocks a and b join at 2 s, c and b at 4 s until 5 s."""
    c = still(0.2)
    c[40:50, 0] = 2 * SIDE
    poses = {"a": still(0.0), "b": np.vstack([still(0.1, 20), still(SIDE, 40)]), "c": c}
    path = tmp_path / "synthetic.csv"
    path.write_text(table(poses))
    return path


def values_of(done: Done) -> dict[str, Any]:
    assert done.code == 0, done
    values: dict[str, Any] = json.loads(done.out)
    return values


def test_json(recording: Path) -> None:
    values = values_of(here("classify", recording, "--json"))
    assert values["classes"] == [
        {"time_s": 0.0, "outcome": "1+1+1"},
        {"time_s": 2.0, "outcome": "2+1"},
        {"time_s": 4.0, "outcome": "I3"},
        {"time_s": 5.0, "outcome": "2+1"},
    ]
    assert values["proportions"] == pytest.approx(
        {"I3": 1 / 5.9, "2+1": 2.9 / 5.9, "1+1+1": 2 / 5.9}
    )
    assert values["final"] == "2+1"
    assert values["complete"] is False
    assert values["bodies"] == ["a", "b", "c"]
    assert values["block_side_m"] == SIDE
    assert [
        (e["time_s"], e["kind"], e["bodies"], e["faces"], e["outcome"]) for e in values["events"]
    ] == [
        (2.0, "join", ["a", "b"], [0, 2], "2+1"),
        (4.0, "join", ["b", "c"], [0, 2], "I3"),
        (5.0, "split", ["b", "c"], [0, 2], "2+1"),
    ]
    assert values["warnings"] == []


def test_complete(recording: Path) -> None:
    values = values_of(here("classify", recording, "--to", "4.9s", "--json"))
    assert (values["final"], values["complete"]) == ("I3", True)


def test_table(recording: Path) -> None:
    done = here("classify", recording)
    assert done.code == 0
    assert done.err == (
        "driftwalk: the side of the blocks is the default, 3 cm (--side)\n"
        f"next: driftwalk report {recording} -o report.html\n"
    )
    lines = [line.split() for line in done.out.splitlines()]
    assert ["2+1", "49.1525", "2.9"] in lines
    assert ["5", "split", "b:0", "c:2", "2+1"] in lines
    assert ["at", "the", "end", "2+1"] in lines


def test_nothing_joined(recording: Path) -> None:
    done = here("classify", recording, "--to", "1s")
    assert "no blocks joined" in done.out


@pytest.mark.slow
def test_file(recording: Path, tmp_path: Path) -> None:
    out = tmp_path / "classes.nc"
    assert f"driftwalk: wrote {out}\n" in here("classify", recording, "-o", out).err
    with xr.open_dataset(out, engine="h5netcdf") as found:
        assert found.attrs["kind"] == "classification"
        assert int(found["event_count"]) == 2
    before = contents(tmp_path)
    assert "--overwrite" in refusal(here("classify", recording, "-o", out))
    assert "ends in .nc" in refusal(here("classify", recording, "-o", tmp_path / "c.csv"))
    assert contents(tmp_path) == before
    assert (
        here("classify", recording, "-o", out, "--chirality", "distinct", "--overwrite").code == 0
    )
    with xr.open_dataset(out, engine="h5netcdf") as found:
        assert found.attrs["chirality"] == "distinct"


def test_chirality(tmp_path: Path) -> None:
    cells = {"a": (0, 1), "b": (1, 1), "c": (1, 0), "d": (2, 0)}
    poses = {name: np.tile([SIDE * x, SIDE * y, 0.0], (10, 1)) for name, (x, y) in cells.items()}
    path = tmp_path / "z.csv"
    path.write_text(table(poses))
    assert values_of(here("classify", path, "--json"))["final"] == "S"
    words = ["classify", path, "--json", "--chirality", "distinct"]
    assert values_of(here(*words))["final"] == "Z"


def test_side_of_the_option_and_of_the_study(tmp_path: Path) -> None:
    path, study = tmp_path / "large.csv", tmp_path / "mine.toml"
    path.write_text(table({"a": still(0.0), "b": still(0.5)}))
    study.write_text("[block]\nside_m = 0.5\n[tank]\ndiameter_m = 5\n")
    assert values_of(here("classify", path, "--json"))["final"] == "1+1"
    for words in (["--side", "50cm"], ["--study", study]):
        values = values_of(here("classify", path, "--json", *words))
        assert (values["final"], values["block_side_m"]) == ("2", 0.5)
    words = ["--study", study, "--side", "3cm"]
    assert values_of(here("classify", path, "--json", *words))["final"] == "1+1"


def test_tolerances(recording: Path) -> None:
    options = {
        "--join-distance": ("2mm", "join_distance_m", 0.002),
        "--join-angle": ("5deg", "join_angle_rad", np.pi / 36),
        "--release-distance": ("8mm", "release_distance_m", 0.008),
        "--release-angle": ("30deg", "release_angle_rad", np.pi / 6),
        "--min-duration": ("2s", "min_duration_s", 2.0),
        "--hold": ("3s", "hold_s", 3.0),
        "--play": ("4mm", "play_m", 0.004),
    }
    words = [word for option, (text, _, _) in options.items() for word in (option, text)]
    values = values_of(here("classify", recording, "--json", *words))
    for _, key, number in options.values():
        assert values[key] == pytest.approx(number)
    # The join of one second is too short now.
    assert [event["time_s"] for event in values["events"]] == [2.0]


def test_warnings(tmp_path: Path) -> None:
    b = still(0.02)
    b[20:50] = np.nan
    path = tmp_path / "odd.csv"
    path.write_text(
        table(
            {
                "a": still(0.0),
                "b": b,
                "c": still(0.5),
                "d": still(0.5 + SIDE),
                "e": still(0.501 + SIDE),
            }
        )
    )
    done = here("classify", path)
    assert done.code == 0
    assert "(--side)" in done.err
    assert "not seen for more than 1 s (--hold)" in done.err
    assert "1 joins contradict others" in done.err


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("t_s,x_m,y_m,body\n0.0,0,0,a\n0.1,0,0,a\n0.2,0,0,a\n", "the recording has no orientation"),
        ("t_s,x_m,y_m,theta_rad,body\n0.0,0,0,0,a\n0.1,0,0,,b\n", "orientation of body b"),
        ("t_s,x_m,y_m,theta_rad,body\n0.0,0,0,0,a\n0.1,0,0,0,b\n", "no two bodies"),
        ("", "the file is empty"),
    ],
)
def test_recordings_that_cannot_be_classified(content: str, says: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.csv"
    path.write_text(content)
    line = refusal(here("classify", path, "--json"))
    assert says in line
    assert str(path) in line
    assert "no such file" in refusal(here("classify", tmp_path / "nowhere.csv"))


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--join-distance", "0"], "join_distance must be more than 0"),
        (["--join-angle", "50deg"], "below 45 deg"),
        (["--hold=-1"], "hold must be more than 0"),
        (["--side", "0"], "side must be more than 0"),
        (["--chirality", "left"], "--chirality"),
        (["--min-duration", "3cm"], "--min-duration"),
    ],
)
def test_options_out_of_range(options: list[str], says: str, recording: Path) -> None:
    assert says in refusal(here("classify", recording, *options))
