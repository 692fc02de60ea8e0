"""Arrays, MATLAB tracks, JSON lines, Parquet, Qualisys: files written here, read to the digit."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray as xr
from scipy.io import savemat
from scipy.spatial.transform import Rotation

from driftwalk.core.errors import InputError
from driftwalk.record import load
from driftwalk.record.registry import loaders

N = 40
T = 0.04 * np.arange(N)
X, Y, THETA = 0.1 + 0.05 * np.cos(3.0 * T), 0.2 + 0.05 * np.sin(3.0 * T), 3.0 * T
PLACES: dict[str, Any] = {"t": "1:s", "x": "2:m", "y": "3:m"}


def check(
    found: xr.Dataset, *, format: str, theta: bool = False, down: bool = False, bodies: int = 1
) -> None:
    """Compare every body with the arrays above; the second is 10 cm to the right."""
    assert found.attrs["format"] == format
    assert found.sizes == {"time": N, "body": bodies}
    sign = -1.0 if down else 1.0
    np.testing.assert_allclose(found["time"], T, atol=1e-12)
    for at in range(bodies):
        np.testing.assert_allclose(found["x"].values[:, at], X + 0.1 * at, rtol=1e-12)
        np.testing.assert_allclose(found["y"].values[:, at], sign * Y, rtol=1e-12)
        if theta:
            turned = np.exp(1j * found["theta"].values[:, at])
            np.testing.assert_allclose(turned, np.exp(1j * sign * THETA), atol=1e-9)
        else:
            assert np.isnan(found["theta"].values).all()


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("columns", [3, 4])
def test_npy_by_number(tmp_path: Path, columns: int, turned: bool) -> None:
    array = np.column_stack([T, X, Y, THETA])[:, :columns]
    np.save(tmp_path / "a.npy", array.T if turned else array)
    named = {**PLACES, **({"theta": "4:rad"} if columns == 4 else {})}
    check(load(tmp_path / "a.npy", columns=named), format="arrays", theta=columns == 4)
    with pytest.raises(InputError, match=f"has {columns} columns and no header: name them with"):
        load(tmp_path / "a.npy")


def test_structured_npy(tmp_path: Path) -> None:
    array = np.zeros(N, dtype=[("t_s", float), ("x_mm", float), ("y_mm", float)])
    array["t_s"], array["x_mm"], array["y_mm"] = T, 1e3 * X, 1e3 * Y
    np.save(tmp_path / "a.npy", array)
    check(load(tmp_path / "a.npy"), format="arrays")


@pytest.mark.parametrize("pickled", [np.zeros((4, 4, 4)), np.array([{}, {}], dtype=object)])
def test_an_array_that_is_no_table_is_refused(tmp_path: Path, pickled: Any) -> None:
    np.save(tmp_path / "a.npy", pickled)
    with pytest.raises(InputError) as caught:
        load(tmp_path / "a.npy", columns=PLACES)
    assert "\n" not in str(caught.value)


def of_h5(path: Path, arrays: dict[str, Any], *, group: str = "") -> Path:
    with h5py.File(path, "w") as file:
        for name, values in arrays.items():
            file[f"{group}/{name}" if group else name] = values
    return path


def of_npz(path: Path, arrays: dict[str, Any]) -> Path:
    np.savez(path, **arrays)
    return path


def test_arrays_of_other_things_are_no_recording(tmp_path: Path) -> None:
    """The axes of a grid, and the references of a MATLAB session, are named x and y as well."""
    grid = tmp_path / "grid.h5"
    with h5py.File(grid, "w") as file:
        for name in ("x", "y"):
            file[name] = np.arange(5.0)
            file[name].make_scale(name)
        file["u"] = np.zeros((5, 5))
    session = tmp_path / "session.h5"
    with h5py.File(session, "w") as file:
        file.create_group("#refs#").update({"x1": X, "y1": Y})
    for path in (grid, session):
        with pytest.raises(InputError, match="format is not recognised"):
            load(path, frame_rate=25.0, metres_per_pixel=1e-3)


@pytest.mark.parametrize("ending", ["npz", "h5"])
def test_arrays_by_name(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"a.{ending}"
    write = of_npz if ending == "npz" else of_h5
    check(load(write(path, {"t": T, "x": X, "y": Y, "note": np.arange(3)})), format="arrays")
    units = {"time_ms": 1e3 * T, "x_mm": 1e3 * X, "y_mm": 1e3 * Y, "theta_rad": THETA}
    check(load(write(path, units)), format="arrays", theta=True)
    frames = {"frame": np.arange(N), "x_px": 1e3 * X, "y_px": 1e3 * Y, "fps": 25.0}
    check(load(write(path, frames), metres_per_pixel=1e-3), format="arrays", down=True)
    wide = {"t": T, "x": np.column_stack([X, X + 0.1]), "y": np.column_stack([Y, Y])}
    check(load(write(path, wide)), format="arrays", bodies=2)
    table = {"table": np.column_stack([T, X, Y])}
    named = {} if ending == "npz" else {"format": "arrays"}
    check(load(write(path, table), columns=PLACES, **named), format="arrays")


def test_a_group_of_hdf5(tmp_path: Path) -> None:
    arrays = {"t": T, "x": X, "y": Y}
    check(load(of_h5(tmp_path / "a.h5", arrays, group="run")), format="arrays")
    with h5py.File(tmp_path / "a.h5", "a") as file:
        for name, values in arrays.items():
            file[f"again/{name}"] = values
    with pytest.raises(InputError, match="positions in more than one array, again, run: name it"):
        load(tmp_path / "a.h5")
    check(load(tmp_path / "a.h5", sheet="run"), format="arrays")


def test_damaged_arrays_are_one_line(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.column_stack([T, X, Y]))
    content = (tmp_path / "a.npy").read_bytes()
    for share in (0.05, 0.3, 0.9):
        (tmp_path / "b.npy").write_bytes(content[: int(share * len(content))])
        with pytest.raises(InputError) as caught:
            load(tmp_path / "b.npy", columns=PLACES)
        assert "\n" not in str(caught.value)


def ctrax(*, scaled: bool, stamped: bool, seen: Sequence[tuple[int, int]] = ((0, N),) * 2) -> Any:
    """Return the struct array of Ctrax: each fly from its first frame to its last."""
    names = ["x", "y", "theta", "a", "b", "id", "firstframe", "endframe", "off", "fps", "moviename"]
    names += ["timestamps"] if stamped else []
    names += ["x_mm", "y_mm", "theta_mm", "pxpermm"] if scaled else []
    flies = np.zeros((1, len(seen)), dtype=[(name, object) for name in names])
    for at, (first, last) in enumerate(seen):
        part, fly = slice(first, last), flies[0, at]
        for name, values in (("x", X + 0.1 * at), ("y", Y)):
            fly[name] = 1e4 * values[None, part]
            if scaled:
                fly[f"{name}_mm"] = 1e3 * values[None, part]
        fly["theta"] = fly["a"] = fly["b"] = THETA[None, part]
        fly["id"], fly["firstframe"], fly["endframe"] = float(at + 1), first + 1.0, float(last)
        fly["off"], fly["fps"], fly["moviename"] = -float(first), 25.0, "movie.avi"
        if stamped:
            fly["timestamps"] = T[None, part]
        if scaled:
            fly["theta_mm"], fly["pxpermm"] = THETA[None, part], 10.0
    return flies


@pytest.mark.parametrize("stamped", [True, False])
@pytest.mark.parametrize("scaled", [True, False])
def test_ctrax(tmp_path: Path, scaled: bool, stamped: bool) -> None:
    path = tmp_path / "trx.mat"
    savemat(path, {"trx": ctrax(scaled=scaled, stamped=stamped), "timestamps": T})
    how = {} if scaled else {"metres_per_pixel": 1e-4}
    found = load(path, **how)
    check(found, format="matlab-tracks", theta=True, down=True, bodies=2)
    if not scaled:
        with pytest.raises(InputError, match="metres_per_pixel"):
            load(path)


def test_flies_of_ctrax_that_come_late(tmp_path: Path) -> None:
    path = tmp_path / "trx.mat"
    savemat(path, {"trx": ctrax(scaled=True, stamped=False, seen=((0, 40), (10, 30)))})
    found = load(path)
    seen = np.isfinite(found["x"].values[:, 1])
    np.testing.assert_array_equal(np.flatnonzero(seen), np.arange(10, 30))
    np.testing.assert_allclose(found["x"].values[10:30, 1], X[10:30] + 0.1, rtol=1e-12)


@pytest.mark.parametrize("flies", [1, 2])
def test_flytracker(tmp_path: Path, flies: int) -> None:
    names = ["pos x", "pos y", "ori", "major axis len"]
    data = np.stack(
        [np.column_stack([1e3 * (X + 0.1 * k), 1e3 * Y, -THETA, X]) for k in range(flies)]
    )
    cell = np.array(names, dtype=object)[None]
    savemat(tmp_path / "v-track.mat", {"trk": {"names": cell, "data": data, "flags": np.zeros(0)}})
    found = load(tmp_path / "v-track.mat", frame_rate=25.0, metres_per_pixel=1e-3)
    # Its angles are those of an image turned upright already.
    check(found, format="matlab-tracks", theta=True, down=True, bodies=flies)


@pytest.mark.parametrize("stamps", [0, 1])
def test_robotarium(tmp_path: Path, stamps: int) -> None:
    rows = [[X + 0.1 * k, Y, THETA, 0 * X, 0 * X] for k in range(2)]
    data = np.vstack([*rows[0], *rows[1], *[1e6 * T] * stamps])
    savemat(tmp_path / "r.mat", {"robotarium_data": data})
    with pytest.raises(InputError, match="frame_rate"):
        load(tmp_path / "r.mat")
    found = load(tmp_path / "r.mat", frame_rate=25.0)
    check(found, format="matlab-tracks", theta=True, bodies=2)
    savemat(tmp_path / "r.mat", {"robotarium_data": data[:-2]})
    with pytest.raises(InputError):
        load(tmp_path / "r.mat", frame_rate=25.0)


def lines(path: Path, rows: list[Any]) -> Path:
    path.write_text("".join(json.dumps(row) + "\n" for row in rows), encoding="utf-8")
    return path


def test_json_lines(tmp_path: Path) -> None:
    path = tmp_path / "a.jsonl"
    rows = list(zip(T.tolist(), X.tolist(), Y.tolist(), THETA.tolist(), strict=True))
    plain = [{"t": t, "x": x, "y": y, "theta": angle} for t, x, y, angle in rows]
    check(load(lines(path, plain)), format="jsonl", theta=True)
    path.write_text("\n" + path.read_text().replace("\n", "\n\n"))
    check(load(path, format="jsonl"), format="jsonl", theta=True)
    inside = [{"t": t, "pose": {"x": x, "y": y}, "ok": True} for t, x, y, _ in rows]
    named = {"t": "t:s", "x": "pose.x:m", "y": "pose.y:m"}
    check(load(lines(path, inside), columns=named), format="jsonl")
    both = [
        {"t": t, "robots": [{"id": 1, "x": x, "y": y}, {"id": 2, "x": x + 0.1, "y": y}]}
        for t, x, y, _ in rows
    ]
    check(load(lines(path, both)), format="jsonl", bodies=2)
    stacked = [{"t": t, "id": k, "x": x + 0.1 * k, "y": y} for t, x, y, _ in rows for k in (0, 1)]
    check(load(lines(path, stacked)), format="jsonl", bodies=2)
    gap = [dict(one) for one in plain]
    gap[7]["x"] = gap[7]["y"] = None
    del gap[9]["x"], gap[9]["y"]
    assert np.isnan(load(lines(path, gap))["x"].values[[7, 9], 0]).all()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"t": 0, "x": 1, "y": 2}\n[1, 2]\n', "line 2: expected an object in each line"),
        ('{"t": 0, "x": 1, "y": 2}\n{"t": 1, "x"\n', "line 2"),
        ('{"a": 0}\n{"a": 1}\n', "no columns of x and y"),
        ('{"a": [{"x": 1}], "b": [{"x": 2}]}\n', "several lists of objects: a, b"),
    ],
)
def test_json_lines_that_are_refused(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "a.jsonl").write_text(text)
    with pytest.raises(InputError, match=message):
        load(tmp_path / "a.jsonl", format="jsonl")


@pytest.mark.parametrize("kind", ["parquet", "feather"])
def test_parquet_and_feather(tmp_path: Path, kind: str) -> None:
    pytest.importorskip("pyarrow")
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({"t": T, "x_mm": 1e3 * X, "y_mm": 1e3 * Y, "theta_rad": THETA})
    path = tmp_path / f"a.{kind}"
    getattr(frame, f"to_{kind}")(path)
    check(load(path), format="arrow", theta=True)
    stacked = pandas.concat([frame.assign(id=1), frame.assign(id=2, x_mm=frame["x_mm"] + 100.0)])
    getattr(stacked.reset_index(drop=True), f"to_{kind}")(path)
    check(load(path), format="arrow", theta=True, bodies=2)
    path.write_bytes(path.read_bytes()[:-60])
    with pytest.raises(InputError, match="cannot be read by pyarrow"):
        load(path)


def test_parquet_without_its_library_says_so(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    (tmp_path / "a.parquet").write_bytes(b"PAR1" + bytes(100))
    with pytest.raises(InputError, match=r"need pyarrow: pip install 'driftwalk\[arrow\]'"):
        load(tmp_path / "a.parquet")


def qualisys(
    path: Path,
    *,
    kind: str,
    clocks: bool = True,
    header: bool = True,
    tail: str = "",
    bodies: int = 2,
) -> Path:
    names = [f"Block {at}" for at in range(1, bodies + 1)]
    head = [f"NO_OF_FRAMES\t{N}", "NO_OF_CAMERAS\t8", "FREQUENCY\t25", "NO_OF_ANALOG\t0"]
    head += ["ANALOG_FREQUENCY\t0", "DESCRIPTION\t--", "TIME_STAMP\t2026-05-01, 12:00:00"]
    head += [f"DATA_INCLUDED\t{kind}"]
    head += ["\t".join(["MARKER_NAMES" if kind == "3D" else "BODY_NAMES", *names])]
    if header:
        above = ["Frame", "Time"] if clocks else []
        part = ["X", "Y", "Z", "Roll", "Pitch", "Yaw", "Residual", *(f"Rot[{k}]" for k in range(9))]
        above += [f"{name} {one}" for name in names for one in (part[:3] if kind == "3D" else part)]
        head.append("\t".join(above))
    matrix = Rotation.from_euler("z", THETA[:, None]).as_matrix().transpose(0, 2, 1).reshape(N, 9)
    rows = []
    for k in range(N):
        fields: list[float] = [k + 1, T[k]] if clocks else []
        for at in range(bodies):
            fields += [1e3 * (X[k] + 0.1 * at), 1e3 * Y[k], 12.0]
            fields += [0, 0, np.degrees(THETA[k]), 0.1, *matrix[k]] if kind == "6D" else []
        rows.append("\t".join(f"{one:.15g}" for one in fields) + tail)
    path.write_text("\r\n".join([*head, *rows]) + "\r\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("kind", ["3D", "6D"])
@pytest.mark.parametrize("clocks", [True, False])
@pytest.mark.parametrize("header", [True, False])
@pytest.mark.parametrize("tail", ["", "\t"])
def test_qualisys(tmp_path: Path, kind: str, clocks: bool, header: bool, tail: str) -> None:
    path = qualisys(tmp_path / "q.tsv", kind=kind, clocks=clocks, header=header, tail=tail)
    found = load(path)
    check(found, format="qualisys", theta=kind == "6D", bodies=2)
    assert list(found["body"].values) == ["Block 1", "Block 2"]


def test_qualisys_gaps_and_what_is_refused(tmp_path: Path) -> None:
    path = qualisys(tmp_path / "q.tsv", kind="3D", bodies=1)
    text = path.read_text().splitlines()
    text[15] = "\t".join([*text[15].split("\t")[:2], "0.000", "0.000", "0.000"])
    path.write_text("\n".join(text) + "\n")
    assert np.isnan(load(path)["x"].values).sum() == 1
    path.write_text("\n".join(text).replace("FREQUENCY\t25", "FREQUENCY\t-"))
    with pytest.raises(InputError, match="FREQUENCY is '-', and no rate of frames"):
        load(path)
    path.write_text("\n".join(text).replace("\t3D", "\tAnalog"))
    with pytest.raises(InputError, match="expected DATA_INCLUDED 3D with MARKER_NAMES"):
        load(path)
    path.write_text("\n".join(text).replace("Block 1", "Block 1\tBlock 2"))
    with pytest.raises(InputError, match="expected 3 columns for each of 2 names"):
        load(path)


def test_every_new_format_is_listed() -> None:
    assert {"arrays", "arrow", "jsonl", "matlab-tracks", "qualisys"} <= set(loaders())
