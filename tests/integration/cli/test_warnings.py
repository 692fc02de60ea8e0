"""No warning of a library reaches a user, from any command, on good input or on bad.

Warnings are errors here, so one would end its command with a traceback; what C libraries write to
the process's own stderr is looked at as well. All recordings are synthetic or bundled.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr
from chain_runs import chain_runs
from command_line import FLOW, GRID, RECORDING, Done, here, refusal
from every_kind import every_kind
from finished_run import write_finished_run

from driftwalk.cli.main import COMMANDS, load_command
from driftwalk.plot.film import FRAMES_PER_S

cv2 = pytest.importorskip("cv2")

from filmed_blocks import film  # noqa: E402

Words = list[object]
SharedData = Callable[[str], Path]
TANK = ("--tank", "30cm")


def whole_commands() -> set[str]:
    """Return every command with its subcommands, as a user types them."""
    names = set()
    for name in COMMANDS:
        below = getattr(load_command(name), "commands", None)
        names |= {name} if below is None else {f"{name} {sub}" for sub in below}
    return names


def strict(capfd: pytest.CaptureFixture[str], *words: object) -> Done:
    """Run a command with warnings as errors; nothing but its own words may reach stderr."""
    capfd.readouterr()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        done = here(*words)
    # `here` catches what Python prints; what is left came from a C library.
    assert capfd.readouterr().err == ""
    return done


# Files of other programs that look like ours to whoever reads only their first bytes.


def _sleap(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["tracks"] = np.random.default_rng(1).normal(size=(2, 2, 3, 50))
        file["node_names"] = np.array([b"head", b"thorax", b"tail"])
        file["track_names"] = np.array([b"a", b"b"])
        file["provenance"] = "{}"
        file["track_occupancy"] = np.ones((50, 2), dtype=np.uint8)


def _deeplabcut(path: Path) -> None:
    """Write what pandas writes for DeepLabCut: a table of records, with pickles as attributes."""
    with h5py.File(path, "w") as file:
        file.attrs["TITLE"] = b""
        file.attrs["PYTABLES_FORMAT_VERSION"] = b"2.1"
        group = file.create_group("df_with_missing")
        group.attrs["levels"] = b"(lp1\nI0\na."
        records = np.zeros(50, dtype=[("index", "<i8"), ("values_block_0", "<f8", (6,))])
        group.create_dataset("table", data=records).attrs["NROWS"] = np.int64(50)
        group.create_group("_i_table")


def _kinds_of_hdf5(path: Path) -> None:
    """Write types that NetCDF does not know."""
    with h5py.File(path, "w") as file:
        file["scalar"] = 3.0
        file["empty"] = h5py.Empty("f8")
        file["texts"] = np.array(["a", "b"], dtype=h5py.string_dtype())
        file["lists"] = np.array([np.arange(2), np.arange(3)], dtype=h5py.vlen_dtype(np.int64))
        file["reference"] = np.array([file["scalar"].ref], dtype=h5py.ref_dtype)
        file["enum"] = np.zeros(3, dtype=h5py.enum_dtype({"A": 0, "B": 1}))
        file["complex"] = np.zeros(3, dtype=complex)
        file["half"] = np.zeros(3, dtype=np.float16)
        file["t"] = np.arange(3.0)
        file["x"] = h5py.SoftLink("/nowhere")
        file["far"] = h5py.ExternalLink("nowhere.h5", "/x")


def _two_fill_values(path: Path) -> None:
    """Write a NetCDF whose numbers are scaled and have two values for 'nothing'."""
    with h5py.File(path, "w") as file:
        for name in ("time", "x", "y", "u", "v"):
            values = file.create_dataset(name, data=np.arange(5, dtype=np.int16))
            values.attrs["_FillValue"] = np.int16(-1)
            values.attrs["missing_value"] = np.int16(-2)
            values.attrs["scale_factor"] = 0.1
        file["time"].attrs["units"] = "days since 2020-13-45"
        file["x"].attrs["coordinates"] = "nothing there"


def _movement_like(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file.attrs["ds_type"] = "poses"
        file["position"] = np.zeros((5, 2, 1, 1))
        file["position"].attrs["_FillValue"] = np.nan
        file["position"].attrs["missing_value"] = -1.0


def _unit_of_time(path: Path) -> None:
    """Write classic NetCDF with a calendar that is none."""
    time = xr.Variable("time", np.arange(5.0), {"units": "s since never", "calendar": "moon"})
    xr.Dataset({"x": ("time", np.zeros(5))}, {"time": time}).to_netcdf(path, engine="scipy")


def _cut(path: Path) -> None:
    _sleap(path)
    path.write_bytes(path.read_bytes()[:3000])


FOREIGN: dict[str, Callable[[Path], None]] = {
    "sleap.h5": _sleap,
    "sleap.nc": _sleap,
    "deeplabcut.h5": _deeplabcut,
    "kinds.nc": _kinds_of_hdf5,
    "fill.nc": _two_fill_values,
    "movement.nc": _movement_like,
    "classic.nc": _unit_of_time,
    "cut.nc": _cut,
    "text.csv": lambda path: path.write_text("t,x,y\n0,1,2\n1,oops,3\n") and None,
    "one_place.csv": lambda path: path.write_text("t,x,y\n,,\nnan,nan,inf\n") and None,
}

BAD: dict[str, Callable[[Path, Path], list[Words]]] = {
    "study new": lambda bad, out: [["study", "new", bad]],
    "study check": lambda bad, out: [["study", "check", bad]],
    "study recover": lambda bad, out: [["study", "recover", "--study", bad, "-o", out]],
    "camera calibrate": lambda bad, out: [
        ["camera", "calibrate", bad, "--squares", "8x6", "--square", "3cm", "-o", out]
    ],
    "markers teach": lambda bad, out: [
        ["markers", "teach", bad, *TANK, "--side", "3cm", "-o", out]
    ],
    "track": lambda bad, out: [
        ["track", bad, "--markers", "blob", *TANK, "--bodies", "1", "-o", out],
        ["track", bad, "--markers", bad, *TANK, "--bodies", "1", "-o", out],
    ],
    "watch": lambda bad, out: [
        ["watch", bad, "--markers", "blob", *TANK, "--bodies", "1", "--side", "3cm"]
    ],
    "info": lambda bad, out: [["info", bad]],
    "read": lambda bad, out: [["read", bad, "-o", out / "out.nc"]],
    "flow": lambda bad, out: [["flow", bad, *TANK, "-o", out / "out.nc"]],
    "models": lambda bad, out: [["models", bad]],
    "simulate": lambda bad, out: [
        ["simulate", "--flow", bad, "--duration", "1s", "-o", out / "out.nc"],
        ["simulate", "--flow", FLOW, "--like", bad, "-o", out / "out.nc"],
        ["simulate", bad, "--model", "active", "-o", out / "out.nc"],
    ],
    "compare": lambda bad, out: [
        ["compare", bad, out / "good.csv"],
        ["compare", out / "good.csv", bad],
    ],
    "compare-models": lambda bad, out: [
        ["compare-models", bad, "-o", out],
        ["compare-models", out / "good.csv", "--flow", bad, "-o", out / "run"],
        ["compare-models", out / "good.csv", "--models", bad, "-o", out / "run"],
    ],
    "calibrate": lambda bad, out: [
        ["calibrate", bad, "-o", out],
        ["calibrate", out / "good.csv", "--flow", bad, "-o", out / "run"],
    ],
    "fit": lambda bad, out: [["fit", bad, *TANK, "-o", out]],
    "assemble": lambda bad, out: [
        ["assemble", bad, "-o", out],
        ["assemble", "--flow", bad, "--runs", "15", "-o", out],
    ],
    "sensitivity": lambda bad, out: [
        ["sensitivity", bad, "-o", out],
        ["sensitivity", "--flow", bad, "-o", out],
    ],
    "kinetics": lambda bad, out: [["kinetics", bad, "-o", out]],
    "infer-outcomes": lambda bad, out: [
        ["infer-outcomes", bad, "--flow", FLOW, "-o", out],
        ["infer-outcomes", counted(out), "--flow", bad, "-o", out],
    ],
    "yield": lambda bad, out: [
        ["yield", bad, "--target", "T", "-o", out],
        ["yield", "--flow", bad, "--target", "T", "-o", out],
    ],
    "control plan": lambda bad, out: [
        ["control", "plan", bad, "--target", "T", "--by", "60s", "-o", out],
        ["control", "plan", "--flow", bad, "--target", "T", "--by", "60s", "-o", out],
    ],
    "control test": lambda bad, out: [["control", "test", bad, "-o", out]],
    "control run": lambda bad, out: [["control", "run", bad, "--live", "127.0.0.1:5000"]],
    "export": lambda bad, out: [["export", bad, "--to", "csv", "-o", out / "folder"]],
    "cite": lambda bad, out: [["cite", bad]],
    "classify": lambda bad, out: [["classify", bad, "--side", "3cm"]],
    "report": lambda bad, out: [["report", bad, "-o", out / "report.html"]],
    "view": lambda bad, out: [["view", bad, "--no-open"]],
    "play": lambda bad, out: [
        ["play", "--flow", bad, "--no-open"],
        ["play", "--recording", bad, "--no-open"],
    ],
    "demo": lambda bad, out: [["demo", "--quick", "-o", bad]],
}


def test_every_command_is_here() -> None:
    assert set(BAD) == whole_commands()
    assert set(QUICK) | set(LONG) | ELSEWHERE == whole_commands()


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("command", BAD)
def test_a_foreign_file(command: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    rows = [f"{k / 10},{np.cos(k / 9):.4f},{np.sin(k / 9):.4f},0.1" for k in range(200)]
    (tmp_path / "good.csv").write_text("\n".join(["t_s,x_cm,y_cm,theta_rad", *rows, ""]))
    for name, write in FOREIGN.items():
        bad = tmp_path / name
        write(bad)
        for words in BAD[command](bad, tmp_path):
            refusal(strict(capfd, *words))


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("command", ["info", "simulate", "classify"])
def test_real_files_of_other_programs(
    command: str, shared_data: SharedData, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    files = [*shared_data("formats-2").glob("*.h5"), *shared_data("formats-2").glob("piv*.nc")]
    files += shared_data("piv-pivpy").glob("*.mat")
    assert len(files) >= 5
    for path in files:
        for words in BAD[command](path, tmp_path):
            refusal(strict(capfd, *words))


# Good input.


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with what the commands below take."""
    folder = tmp_path_factory.mktemp("good")
    film(folder)
    (folder / "grid.toml").write_text(GRID, encoding="utf-8")
    (folder / "truth.toml").write_text(
        "[forces]\ndrag_coefficient = 0.4\nforce_std_N = 6e-4\n"
        '[observation]\nposition_noise_m = "0.3mm"\norientation_noise_rad = "0.5deg"\n'
        '[fit]\nspline_spacing_m = 0.03\nangle = "given"\n'
        '[recover]\nrecordings = 2\ndurations_s = [30.0]\nflow = "random"\n',
        encoding="utf-8",
    )
    row, column = np.indices((6, 8))
    squares = np.kron(np.where((row + column) % 2 == 0, 30, 225), np.ones((40, 40)))
    board = np.pad(squares.astype(np.uint8), 60, constant_values=225)
    assert cv2.imwrite(str(folder / "board.png"), board)
    rows = [f"{k / 10},{b / 10 + k / 1000},0,0.1,{b}" for k in range(60) for b in range(2)]
    (folder / "two.csv").write_text("\n".join(["t_s,x_m,y_m,theta_rad,body", *rows, ""]))
    return folder


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a finished calibration."""
    return write_finished_run(tmp_path_factory.mktemp("finished") / "run")


def assembled(out: Path) -> Path:
    """Return runs of self-assembly."""
    chain_runs(60, 1).to_netcdf(out)
    return out


def counted(out: Path) -> Path:
    """Return a table of outcomes."""
    out.mkdir(exist_ok=True)
    table = out / "counts.csv"
    table.write_text("class,count\n2,12\n1+1,8\n", encoding="utf-8")
    return table


def planned(out: Path) -> Path:
    """Return a policy."""
    every_kind("control_policy").to_netcdf(out)
    return out


SHORT = ("--to", "60s")
ONE = ("--threads", "1")
QUICK: dict[str, Callable[[Path, Path, Path], Words]] = {
    "study new": lambda place, run, out: ["study", "new", out / "new.toml"],
    "study check": lambda place, run, out: ["study", "check", place / "grid.toml"],
    "export": lambda place, run, out: ["export", run, "--to", "csv", "-o", out / "folder"],
    "cite": lambda place, run, out: ["cite", run],
    "camera calibrate": lambda place, run, out: [
        *("camera", "calibrate", place / "board.png", "--squares", "8x6", "--square", "3cm"),
        *("--no-lens", "-o", out / "camera.toml"),
    ],
    "markers teach": lambda place, run, out: [
        *("markers", "teach", place / "video.mkv", *TANK, "--side", "3cm"),
        *("-o", out / "markers.toml"),
    ],
    "track": lambda place, run, out: [
        *("track", place / "video.mkv", "--markers", place / "m.toml", *TANK, "--bodies", "2"),
        *("--overlay", out / "overlay.mp4", "-o", out / "out.nc"),
    ],
    "watch": lambda place, run, out: [
        *("watch", place / "video.mkv", "--markers", place / "m.toml", *TANK, "--bodies", "2"),
    ],
    "info": lambda place, run, out: ["info", place / "two.csv"],
    "read": lambda place, run, out: ["read", place / "two.csv", "-o", out / "out.nc"],
    "flow": lambda place, run, out: ["flow", RECORDING, *SHORT, *TANK, "-o", out / "flow.nc"],
    "models": lambda place, run, out: ["models", "run-rest+wall"],
    "simulate": lambda place, run, out: [
        *("simulate", "--flow", FLOW, "--duration", "10s", "-o", out / "out.nc")
    ],
    "compare": lambda place, run, out: [
        *("compare", RECORDING, RECORDING, "--permutations", "20", "--out", out / "out.nc")
    ],
    "classify": lambda place, run, out: ["classify", place / "two.csv", "--side", "3cm"],
    "report": lambda place, run, out: ["report", run, "-o", out / "report.html"],
}
LONG: dict[str, Callable[[Path, Path, Path], Words]] = {
    "study recover": lambda place, run, out: [
        *("study", "recover", "--study", place / "truth.toml", *ONE, "-o", out / "run")
    ],
    "compare-models": lambda place, run, out: [
        *("compare-models", RECORDING, *SHORT, *TANK, "--models", "inertial", *ONE),
        *("--bootstrap", "0", "-o", out / "run"),
    ],
    "calibrate": lambda place, run, out: [
        *("calibrate", RECORDING, *SHORT, *TANK, "--study", place / "grid.toml", *ONE),
        *("-o", out / "run"),
    ],
    "fit": lambda place, run, out: [
        *("fit", RECORDING, *SHORT, *TANK, "--angle", "given", "--spline-spacing", "3cm"),
        *("-o", out / "run"),
    ],
    "assemble": lambda place, run, out: [
        *("assemble", "--flow", FLOW, "--blocks", "3", "--runs", "20", "--duration", "20s", *ONE),
        *("-o", out / "run"),
    ],
    "sensitivity": lambda place, run, out: [
        *("sensitivity", "--flow", FLOW, "--vary", "drag-coefficient=0.2,0.6", "--blocks", "3"),
        *("--runs", "15", "--realisations", "3", "--duration", "20s", *ONE, "-o", out / "run"),
    ],
    "control plan": lambda place, run, out: [
        *("control", "plan", "--flow", FLOW, *TANK, "--blocks", "2", "--target", "2"),
        *("--by", "20s", "--vary", "flow-scale=0,1", "--rounds", "1", "--worlds", "20"),
        *("-o", out / "run"),
    ],
    "control test": lambda place, run, out: [
        *("control", "test", planned(out / "policy.nc"), "--worlds", "20", "-o", out / "run")
    ],
    "kinetics": lambda place, run, out: [
        *("kinetics", assembled(out / "runs.nc"), "-o", out / "run")
    ],
    "infer-outcomes": lambda place, run, out: [
        *("infer-outcomes", counted(out), "--flow", FLOW, "--blocks", "2", "--after", "4s"),
        *("--runs", "20", "--truths", "20", *ONE, "-o", out / "run"),
    ],
    "yield": lambda place, run, out: [
        *("yield", "--flow", FLOW, "--target", "L3", "--vary", "force-std=0.2mN,1mN"),
        *("--blocks", "3", "--runs", "100", "--fresh-runs", "20", "--duration", "20s", *ONE),
        *("-o", out / "run"),
    ],
}
ELSEWHERE = {"demo", "view", "play", "control run"}
"""`test_demo.py`, `page_server.py` and `test_control_live.py` run these."""


def own_words(err: str) -> None:
    """Check that all lines of stderr are driftwalk's notes, its progress, or the next command."""
    for line in err.replace("\r", "\n").splitlines():
        assert re.match(r"(driftwalk|next): |[a-z -]+: \d+ (of \d+ |%)|$", line), err


@pytest.mark.parametrize("command", QUICK)
def test_good_input(
    command: str, place: Path, finished: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    done = strict(capfd, *QUICK[command](place, finished, tmp_path))
    assert done.code == 0, done
    own_words(done.err)


@pytest.mark.slow
@pytest.mark.parametrize("command", LONG)
def test_good_input_of_long_commands(
    command: str,
    place: Path,
    finished: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(FRAMES_PER_S, ".gif", 1.0)
    done = strict(capfd, *LONG[command](place, finished, tmp_path))
    assert done.code == 0, done
    own_words(done.err)
