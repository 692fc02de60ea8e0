"""Mistakes of a user: each is one line that says where, exit code 2, and nothing lost.

The recordings here are synthetic.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from command_line import FLOW, RECORDING, apart, contents, here, refusal

TIME = 0.1 * np.arange(200)
ROWS = [f"{t:.1f},{0.05 * np.cos(t):.5f},{0.05 * np.sin(t):.5f},{t:.3f}" for t in TIME]
HEADER = "t_s,x_m,y_m,theta_rad"


def text(rows: list[str], header: str = HEADER) -> bytes:
    return "\n".join([header, *rows, ""]).encode()


BAD = {
    "empty.csv": b"",
    "blank.csv": b"\n\n",
    "header_only.csv": text([]),
    "junk.csv": np.random.default_rng(1).bytes(4000),
    "junk.nc": b"\x89HDF\r\n\x1a\n" + np.random.default_rng(1).bytes(4000),
    "wrong_column.csv": text(ROWS, "t_s,x_m,z_m,theta_rad"),
    "all_nan.csv": text([f"{t:.1f},nan,nan,nan" for t in TIME]),
    "backwards.csv": text([*ROWS[:50], *ROWS[40:45], *ROWS[50:]]),
    "not_a_number.csv": text([*ROWS[:10], "1.0,abc,0.2,0.3", *ROWS[11:]]),
    "short_row.csv": text([*ROWS[:10], "1.0,0.2", *ROWS[11:]]),
}
SAYS = {
    "empty.csv": "the file is empty",
    "blank.csv": "the file is empty",
    "header_only.csv": "no rows",
    "junk.csv": "--format",
    "junk.nc": "--format",
    "wrong_column.csv": "line 1: no columns of x and y among 't_s', 'x_m', 'z_m'",
    "all_nan.csv": "no row holds a position",
    "backwards.csv": "row 51 of body '0': 4.9 s is followed by 4 s",
    "not_a_number.csv": "line 12, column 2: 'abc' in column 'x_m' is not a number",
    "short_row.csv": "line 12: expected 4 fields",
}
# Too little for a motion: refused where one is needed, described and converted where none is.
STILL = {
    "one_row.csv": (text(ROWS[:1]), "holds 1 position in the time that is kept, at least 3"),
    "two_rows.csv": (text(ROWS[:2]), "holds 2 positions"),
    "constant.csv": (text([f"{t:.1f},0.01,0.02,0.3" for t in TIME]), "the body never moves"),
}

COMMANDS: dict[str, Callable[[Path, Path], list[object]]] = {
    "info": lambda bad, folder: ["info", bad],
    "read": lambda bad, folder: ["read", bad, "-o", folder / "out.nc", "--overwrite"],
    "flow": lambda bad, folder: [
        *("flow", bad, "--out", folder / "out.nc", "--tank", "30cm", "--overwrite")
    ],
    "calibrate": lambda bad, folder: ["calibrate", bad, "--out", folder / "run", "--overwrite"],
    "calibrate with a flow": lambda bad, folder: [
        *("calibrate", bad, "--flow", FLOW, "--out", folder / "run", "--overwrite")
    ],
    "simulate": lambda bad, folder: [
        *("simulate", "--flow", FLOW, "--out", folder / "out.nc", "--like", bad, "--overwrite")
    ],
    "compare a": lambda bad, folder: [
        *("compare", bad, RECORDING, "--out", folder / "out.nc", "--overwrite")
    ],
    "compare b": lambda bad, folder: ["compare", folder / "good.csv", bad],
}
NEED_MOTION = ("flow", "calibrate", "calibrate with a flow", "compare a", "compare b")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder with a good recording and a file of the user's that must stay."""
    (tmp_path / "good.csv").write_bytes(text(ROWS))
    (tmp_path / "out.nc").write_bytes(b"precious")
    return tmp_path


@pytest.mark.fast_cases(15)
@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("name", [*BAD, "nowhere.csv"])
def test_bad_recording(name: str, command: str, folder: Path) -> None:
    bad = folder / name
    if name in BAD:
        bad.write_bytes(BAD[name])
    before = contents(folder)
    line = refusal(here(*COMMANDS[command](bad, folder)))
    assert str(bad) in line
    says = SAYS.get(name, "no such file")
    # Where the arena is looked for, that comes first.
    assert says in line or (name == "all_nan.csv" and "20 positions, got 0" in line)
    assert contents(folder) == before


@pytest.mark.parametrize("command", NEED_MOTION)
@pytest.mark.parametrize("name", STILL)
def test_recording_without_motion(name: str, command: str, folder: Path) -> None:
    bad = folder / name
    bad.write_bytes(STILL[name][0])
    before = contents(folder)
    line = refusal(here(*COMMANDS[command](bad, folder)))
    assert f"{bad}: {STILL[name][1]}" in line
    assert contents(folder) == before


def test_info_describes_a_body_that_never_moves(folder: Path) -> None:
    bad = folder / "constant.csv"
    bad.write_bytes(STILL["constant.csv"][0])
    done = here("info", bad)
    assert done.code == 0
    assert done.err == "driftwalk: warning: the body never moves\n"


@pytest.mark.parametrize("name", ["empty.csv", "junk.csv", "junk.nc", "not_a_number.csv"])
@pytest.mark.parametrize("command", ["simulate", "calibrate"])
def test_bad_flow_file(name: str, command: str, folder: Path) -> None:
    bad = folder / name
    bad.write_bytes(BAD[name])
    before = contents(folder)
    out = ["--out", folder / ("run" if command == "calibrate" else "new.nc")]
    recording = [RECORDING, "--to", "20s"] if command == "calibrate" else []
    assert str(bad) in refusal(here(command, *recording, "--flow", bad, *out))
    assert contents(folder) == before


STUDIES = {
    "[forces]\nforce_sdt_N = 1e-3\n": "unknown key 'force_sdt_N'; did you mean 'force_std_N'?",
    "[force]\nforce_std_N = 1e-3\n": "'force'; did you mean 'forces'?",
    "[tank]\ndiameter = 0.3\n": "'diameter'; did you mean 'diameter_m'?",
    "[block]\nmass_kg = -0.01\n": "[block] mass_kg: must be more than 0 kg, got -0.01",
    '[block]\nmass_kg = "11.6mm"\n': "'mm' measures something else",
    "[block]\nside_m = 3\n": "the block does not fit into the tank",
    "[block]\nmass_kg = nan\n": "mass_kg",
    "[block]\nmass_kg = true\n": "mass_kg",
    "[calibration]\nforce_std_min_N = 2e-3\nforce_std_max_N = 1e-3\n": "the grid has no setting",
    "[calibration]\nforce_std_step_N = 0\n": "force_std_step_N: must be more than 0 N",
    "[calibration]\nforce_std_step_N = 1e-12\n": "more than 1000000",
    "[calibration]\nreplicates = 0\n": "replicates: must be at least 1",
    "[block\n": "line 1, column 7",
    "\udcff\udcfe": "UTF-8",
}
WITH_STUDY: dict[str, list[object]] = {
    "study check": ["study", "check"],
    "flow": ["flow", RECORDING, "--out", "OUT", "--overwrite", "--study"],
    "simulate": ["simulate", "--flow", FLOW, "--out", "OUT", "--overwrite", "--study"],
    "calibrate": ["calibrate", RECORDING, "--out", "RUN", "--study"],
}


@pytest.mark.fast_cases(14)
@pytest.mark.parametrize("command", WITH_STUDY)
@pytest.mark.parametrize("study", STUDIES)
def test_bad_study(study: str, command: str, folder: Path) -> None:
    bad = folder / "mine.toml"
    bad.write_bytes(study.encode(errors="surrogateescape"))
    before = contents(folder)
    places = {"OUT": folder / "out.nc", "RUN": folder / "run"}
    words = [places.get(str(word), word) for word in WITH_STUDY[command]]
    line = refusal(here(*words, bad))
    assert str(bad) in line
    assert STUDIES[study] in line
    assert contents(folder) == before


@pytest.mark.fast_cases(7)
@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--mass=-1g"], "--mass"),
        (["--mass", "1e400"], "--mass"),
        (["--mass", "3cm"], "--mass"),
        (["--side", "40cm"], "--side over the default study: the block does not fit"),
        (["--side", "4"], "the block does not fit into the tank"),
        (["--tank", "2cm"], "does not fit into the tank"),
        (["--depth", "deep"], "(or immersed, archimedes)"),
        (["--time-step", "7ms"], "--time-step"),
        (["--force-interval", "0"], "--force-interval"),
        (["--step-interval", "2h"], "(--step-interval)"),
        (["--step-interval", "1us"], "(--step-interval)"),
        (["--from", "100s", "--to", "50s"], "--from and --to"),
        (["--to", "1s"], "at least 30 are needed"),
        (["--body", "z"], "--body 'z'"),
        (["--columns", "x=nope"], "--columns x=nope"),
        (["--tank", "oval:3"], "--tank"),
        (["--tank", "circle:5cm"], "positions lie outside the tank"),
        (["--bootstrap=-1"], "--bootstrap"),
        (["--threads", "0"], "--threads"),
        (["--replicates", "0"], "--replicates"),
        (["--frobnicate"], "No such option: --frobnicate"),
    ],
)
def test_bad_option_of_calibrate(options: list[str], says: str, folder: Path) -> None:
    words = ["calibrate", RECORDING, "--flow", FLOW, "--out", folder / "run"]
    assert says in refusal(here(*words, *options))
    assert not (folder / "run").exists()


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["flow", "--inertia", "maybe"], "--inertia"),
        (["flow", "--cell-size", "0"], "--cell-size"),
        (["flow", "--min-count=-1"], "--min-count"),
        (["compare", RECORDING, "--step-interval", "2h"], "(--step-interval)"),
        (["read", "--scale", "0"], "--scale"),
        (["info", "--length-unit", "furlong"], "--length-unit"),
    ],
)
def test_bad_option_of_other_commands(words: list[object], says: str, folder: Path) -> None:
    command, *rest = words
    place: list[object] = {
        "flow": ["--tank", "30cm", "--out", folder / "new.nc"],
        "read": ["-o", folder / "new.nc"],
    }.get(str(command), [])
    before = contents(folder)
    assert says in refusal(here(command, RECORDING, *place, *rest))
    assert contents(folder) == before


def test_a_refused_recording_leaves_its_run_directory_free(folder: Path) -> None:
    """A mistake must not make the next, right command one with other inputs."""
    bad, run = folder / "constant.csv", folder / "run"
    bad.write_bytes(STILL["constant.csv"][0])
    refusal(here("calibrate", bad, "--flow", FLOW, "--out", run))
    assert not run.exists()


def writers(place: Path) -> dict[str, list[object]]:
    good = place.parent / "good.csv"
    return {
        "read": ["read", RECORDING, "-o", place],
        "flow": ["flow", RECORDING, "--to", "60s", "--tank", "30cm", "--out", place],
        "simulate": ["simulate", "--flow", FLOW, "--duration", "1s", "--out", place],
        "compare": ["compare", good, good, "--permutations", "0", "--out", place],
        "study": ["study", "new", place],
    }


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize("command", writers(Path("x")))
def test_a_file_that_exists_is_kept_and_replaced_when_asked(command: str, folder: Path) -> None:
    words = writers(folder / "out.nc")[command]
    before = contents(folder)
    line = refusal(here(*words))
    assert f"{folder / 'out.nc'} exists already" in line
    assert "--overwrite" in line
    assert contents(folder) == before
    assert here(*words, "--overwrite").code == 0
    assert (folder / "out.nc").read_bytes() != b"precious"
    assert sorted(p.name for p in folder.iterdir()) == ["good.csv", "out.nc"]


@pytest.mark.parametrize("command", writers(Path("x")))
@pytest.mark.parametrize("place", ["nowhere/out.nc", "good.csv/out.nc"])
def test_a_folder_that_is_not_there(command: str, place: str, folder: Path) -> None:
    before = contents(folder)
    words = writers(folder / "x")[command]
    words = [folder / place if word == folder / "x" else word for word in words]
    assert f"the folder {(folder / place).parent} does not exist" in refusal(here(*words))
    assert contents(folder) == before


@pytest.mark.parametrize("command", ["calibrate", "demo"])
@pytest.mark.parametrize(
    ("place", "says"),
    [("good.csv", "is a file"), ("good.csv/run", "cannot make"), (".", "holds files but no run")],
)
def test_a_run_directory_that_cannot_be(command: str, place: str, says: str, folder: Path) -> None:
    before = contents(folder)
    words = [RECORDING, "--flow", FLOW, "--to", "20s"] if command == "calibrate" else ["--quick"]
    line = refusal(here(command, *words, "--out", folder / place))
    assert says in line
    assert str(folder / place) in line
    assert contents(folder) == before


def test_a_body_must_be_named(folder: Path) -> None:
    two = folder / "two.csv"
    rows = [f"{row},{body}" for row in ROWS for body in "ab"]
    two.write_bytes(text(rows, f"{HEADER},body"))
    for command in ("calibrate", "simulate", "compare a"):
        assert "name one with --body" in refusal(here(*COMMANDS[command](two, folder)))
    out = folder / "sim.nc"
    words = ["simulate", "--flow", FLOW, "--like", two, "--out", out]
    assert here(*words, "--body", "b").code == 0


# What follows starts processes: that the exit code and the one line come from the program itself.


@pytest.mark.slow
@pytest.mark.parametrize("command", ["info", "calibrate"])
def test_the_process_itself(command: str, folder: Path) -> None:
    (folder / "junk.csv").write_bytes(BAD["junk.csv"])
    line = refusal(apart(*COMMANDS[command](folder / "junk.csv", folder)))
    assert str(folder / "junk.csv") in line


# The administrator may write anywhere, until the process gives up that capability.
LIKE_OTHERS = """
import ctypes, os
if os.geteuid() == 0:
    lines = open("/proc/self/status").read().splitlines()
    held = {line[:6]: int(line.split()[1], 16) for line in lines if line.startswith("Cap")}
    words = [held[name] & ~2 for name in ("CapEff", "CapPrm")]
    data = [half(word) for half in (lambda w: w & 0xFFFFFFFF, lambda w: w >> 32) for word in words]
    header = (ctypes.c_uint32 * 2)(0x20080522, 0)
    data = [data[0], data[1], 0, data[2], data[3], 0]
    assert ctypes.CDLL(None).capset(header, (ctypes.c_uint32 * 6)(*data)) == 0
"""


@pytest.fixture
def unwritable(tmp_path: Path) -> Iterator[Path]:
    """Return a folder that can be read but not written."""
    if os.name != "posix" or (os.geteuid() == 0 and not Path("/proc/self/status").exists()):
        pytest.skip("no folder can be closed to this user")
    path = tmp_path / "closed"
    path.mkdir()
    (path / "good.csv").write_bytes(text(ROWS))
    path.chmod(0o555)
    yield path
    path.chmod(0o755)


@pytest.mark.slow
@pytest.mark.parametrize("command", ["read", "calibrate", "study"])
def test_a_folder_that_cannot_be_written(command: str, unwritable: Path) -> None:
    good = unwritable / "good.csv"
    words = {
        "read": ["read", good, "-o", unwritable / "out.nc"],
        "calibrate": ["calibrate", good, "--flow", FLOW, "--out", unwritable / "run"],
        "study": ["study", "new", unwritable / "new.toml"],
    }[command]
    before = contents(unwritable)
    line = refusal(apart(*words, before=LIKE_OTHERS))
    assert "ermission denied" in line
    assert str(unwritable) in line
    assert contents(unwritable) == before
