"""A short round of the fuzzer, and what longer rounds found: each mistake once."""

from __future__ import annotations

import gzip
import resource
import tomllib
from pathlib import Path

import h5netcdf
import numpy as np
import pytest
import xarray as xr
from command_line import FLOW, here, refusal

import driftwalk as dw
from driftwalk.core.errors import FormatError
from driftwalk.core.files.run_layout import RECORD_FILE
from driftwalk.core.text_files import parse_json, parse_toml
from driftwalk.schema.stores.netcdf import ALLOWANCE_BYTES, open_netcdf

FRAMES = ("--fps", "10", "--scale", "0.001")
DEEP, DIGITS = "[" * 5000, "9" * 5000


@pytest.mark.slow
def test_a_short_round_finds_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    from fuzz_run import fuzz

    found, ends = fuzz(tmp_path, seed=1, cases=range(60), runs=False)
    assert not found, "\n".join(found)
    # Both happen: damage that is read all the same, and damage that is refused.
    assert ends["0"] > 2
    assert ends["2"] > 2


@pytest.mark.parametrize("text", [f"a = {DEEP}", f"a = {DIGITS}", "a = " + "[" * 99 + "]" * 99])
def test_toml_that_its_reader_does_not_survive_is_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(FormatError, match=r"nested|64 bits"):
        parse_toml(text)
    file = tmp_path / "study.toml"
    file.write_text(text)
    assert "study.toml" in refusal(here("study", "check", file))


def test_toml_is_otherwise_what_the_library_reads() -> None:
    text = '[a]\nb = [1, 2.5, "x"]\nc = -9223372036854775808\n'
    assert parse_toml("\ufeff".encode() + text.encode()) == tomllib.loads(text)


@pytest.mark.parametrize("text", [DEEP, "[" * 99 + "]" * 99, "{", b"\xff"])
def test_json_that_its_reader_does_not_survive_is_refused(text: str | bytes) -> None:
    with pytest.raises(FormatError):
        parse_json(text)


def test_json_integers_beyond_64_bits_are_floats() -> None:
    assert parse_json(f"[{2**63 - 1}, {-(2**63) + 1}]") == [2**63 - 1, -(2**63) + 1]
    assert parse_json(f"[{2**64}, {DIGITS}]") == [float(2**64), float("inf")]


def test_a_record_of_deep_brackets_is_refused(tmp_path: Path) -> None:
    run = tmp_path / "run"
    run.mkdir()
    (run / RECORD_FILE).write_text(DEEP)
    assert "nested too deeply" in refusal(here("report", run, "--out", tmp_path / "a.html"))


def declare(path: Path, samples: int) -> None:
    """Write a trajectory that stores nothing of its positions, which are fill values then."""
    with h5netcdf.File(path, "w") as file:
        file.dimensions = {"time": samples, "body": 1}
        for name in ("x", "y", "theta"):
            file.create_variable(name, ("time", "body"), "f8", chunks=(1000, 1), fillvalue=0.5)
        file.create_variable("time", ("time",), "f8", chunks=(1000,))
        file.attrs["kind"] = "trajectory"


@pytest.mark.parametrize("command", ["info", "flow", "simulate"])
def test_a_header_that_declares_terabytes_is_refused_unread(tmp_path: Path, command: str) -> None:
    file = tmp_path / "huge.nc"
    declare(file, 10**12)
    words = {
        "info": ["info", file, "--format", "driftwalk"],
        "flow": ["flow", file, "--format", "driftwalk", "--out", tmp_path / "o.nc"],
        "simulate": ["simulate", "--flow", file, "--out", tmp_path / "o.nc", "--duration", "1"],
    }
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert "declares 3.2e+04 GB" in refusal(here(*words[command]))
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000


@pytest.mark.slow
def test_a_recording_that_packs_as_well_as_any_is_read(tmp_path: Path) -> None:
    # A body that stands still, at a clock that counts: 4 columns of doubles in a small file.
    count = 2 * ALLOWANCE_BYTES // (4 * 8)
    file = tmp_path / "still.nc"
    one = {"zlib": True, "complevel": 4}
    still = np.full((count, 1), 0.5)
    xr.Dataset(
        dict.fromkeys(("x", "y", "theta"), (("time", "body"), still)),
        coords={"time": np.arange(float(count))},
    ).to_netcdf(file, engine="h5netcdf", encoding=dict.fromkeys(("x", "y", "theta", "time"), one))
    assert open_netcdf(file).sizes["time"] == count


@pytest.mark.fast_cases(3)
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.drop_vars("theta"), "lacks the variable 'theta'"),
        (lambda d: d.drop_vars("time"), "lacks the variable 'time'"),
        (lambda d: d.assign(x=("time", d["x"].values[:, 0])), r"'x' lies on \(time\)"),
        (lambda d: d.assign(x=(d["x"].dims, d["x"].values.astype(str))), "'x' holds no numbers"),
        (lambda d: d.assign_coords(body=[7.0]), "'body' holds no text"),
        (lambda d: d.assign_attrs(arena=3.0), "attribute 'arena' is not text"),
        (lambda d: d.assign_attrs(arena=DEEP), "attribute 'arena' is not JSON"),
        (lambda d: d.assign_attrs(counts="[1]"), "attribute 'counts' holds no JSON object"),
        (lambda d: d.assign_attrs(position_quantum_m="x"), "'position_quantum_m' is not a number"),
    ],
)
def test_an_odd_trajectory_is_refused(tmp_path: Path, change, message: str) -> None:
    file = tmp_path / "odd.nc"
    change(dw.tank30_recording().isel(time=slice(0, 50))).to_netcdf(file, engine="h5netcdf")
    with pytest.raises(FormatError, match=message):
        dw.load(str(file))


def rows(columns: str, count: int, head: str = "") -> str:
    return head + "".join(columns.format(k=k) for k in range(count))


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("tox.txt", rows("{k}\t0\t{k}\t1\t2\t1\n", 20_000)),
        ("log.txt", rows("$FRAMENUMBER,{k}\n$PARTICLE,{k},1,2,0,1,2\n", 20_000)),
        # Not one after the other: such a column would be taken for a number of the row.
        ("a.csv", rows("{k},0.1,0.2,{k}7\n", 20_000, "t_s,x_m,y_m,id\n")),
    ],
)
def test_a_column_of_bodies_that_counts_rows_is_refused(
    tmp_path: Path, name: str, text: str
) -> None:
    file = tmp_path / name
    file.write_text(text)
    options = () if name == "a.csv" else FRAMES
    assert "20000 bodies" in refusal(here("info", file, *options))


@pytest.mark.slow
def test_bodies_without_a_time_in_common_are_refused_before_the_table(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    lines = [f"{k},0.1,0.2,{k // 10}\n" for k in range(40_000)]
    file.write_text("t_s,x_m,y_m,id\n" + "".join(lines))
    said = refusal(here("info", file))
    assert "4000 bodies at 40000 different times" in said
    assert "3.84 GB" in said
    assert here("info", file, "--body", "7").code == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    "start", [b"t_s,x_m,y_m\n0,1,2\n", b"$FRAMENUMBER,1\n$PARTICLE,4,1,2,0,1,2\n"]
)
def test_a_gzip_bomb_is_refused(tmp_path: Path, start: bytes) -> None:
    file = tmp_path / "bomb.gz"
    member = gzip.compress(b"\n" * (10 << 20), 1)
    file.write_bytes(gzip.compress(start) + 4 * member)
    assert "times its size" in refusal(here("info", file, *FRAMES))


def test_an_image_that_is_none_is_one_line(tmp_path: Path, capfd: pytest.CaptureFixture) -> None:
    (tmp_path / "images").mkdir()
    (tmp_path / "images" / "0.png").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(50))
    words = ("--markers", "blob", "--scale", "500px/m", "--fps", "10")
    done = here("track", tmp_path / "images", *words, "--out", tmp_path / "o.nc")
    assert "is not an image" in refusal(done)
    assert capfd.readouterr().err == ""


def test_memory_that_runs_out_is_one_line(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from driftwalk.cli.terminal.errors import one_line

    assert one_line(MemoryError("Unable to allocate 74 GiB")) == (
        "there is not enough memory for this: Unable to allocate 74 GiB"
    )


def test_a_message_that_quotes_a_file_is_short_and_printable(tmp_path: Path) -> None:
    file = tmp_path / "study.toml"
    file.write_text('[tank]\ndiameter_m = "' + "x" * 50_000 + '\\u001b[31m"\n')
    said = refusal(here("simulate", "--flow", FLOW, "--study", file, "--out", tmp_path / "o.nc"))
    assert len(said) < 2000
    assert said.strip().isprintable()


def test_a_foreign_flow_of_text_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "flow.nc"
    metres, speed = {"units": "m"}, {"units": "m/s"}
    plane = (("y", "x"), np.zeros((2, 2)), speed)
    xr.Dataset(
        {"u": plane, "v": plane},
        coords={"x": ("x", ["a", "b"], metres), "y": ("y", [0.0, 1.0], metres)},
    ).to_netcdf(file, engine="h5netcdf")
    with pytest.raises(FormatError, match="'x' holds no numbers"):
        dw.load_flow(file)


def test_a_value_beyond_single_precision_is_none_on_a_page() -> None:
    from driftwalk.page.arrays import decode_array, encode_array

    np.testing.assert_array_equal(decode_array(encode_array([1.0, 1e300])), [1.0, np.nan])


def test_a_movement_file_whose_clock_is_text_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "poses.nc"
    xr.Dataset(
        {"position": (("time", "space", "individual"), np.zeros((2, 2, 1)))},
        coords={"time": ["", "b"], "space": ["x", "y"], "individual": ["a"]},
        attrs={"ds_type": "poses"},
    ).to_netcdf(file, engine="h5netcdf")
    assert "'time' holds no numbers" in refusal(here("info", file, *FRAMES))
