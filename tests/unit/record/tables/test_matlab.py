"""MATLAB files: what is a table in them, which one is read, and what only MATLAB reads."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import matlab_files as mat
import numpy as np
import pytest
from scipy.io import savemat

from driftwalk.cli.main import main
from driftwalk.core.errors import InputError
from driftwalk.flow import flow_format, load_flow
from driftwalk.record import load
from driftwalk.schema import body_names, body_track

T = np.arange(6.0) / 8
X, Y, THETA = T * 3, 1 - T, T / 2
POSE = {"t": T, "x": X, "y": Y, "theta": THETA}


def saved(folder: Path, **variables: Any) -> Path:
    savemat(folder / "synthetic.mat", variables)
    return folder / "synthetic.mat"


def check(path: Path, **options: Any) -> None:
    track = body_track(load(path, **options))
    for found, expected in zip(track, (T, X, Y, THETA), strict=True):
        np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("compressed", [False, True])
def test_vectors_and_a_struct(tmp_path: Path, compressed: bool) -> None:
    path = tmp_path / "a.mat"
    savemat(path, {**POSE, "fps": 8.0, "who": "me"}, do_compression=compressed)
    check(path)
    savemat(path, {"S": POSE}, do_compression=compressed, oned_as="column")
    check(path)
    assert load(path).attrs["format"] == "matlab"


def test_version_7_3(tmp_path: Path) -> None:
    check(mat.hdf5_file(tmp_path / "a.mat", lambda file: mat.struct_of(file, "S", POSE)))

    def vectors(file: Any) -> None:
        for name, values in POSE.items():
            mat.numbers(file, name, values)

    check(mat.hdf5_file(tmp_path / "b.mat", vectors))


def test_a_struct_for_each_body(tmp_path: Path) -> None:
    kind = [("name", object), ("t", object), ("x", object), ("y", object)]
    tracks = np.array([("left", T, X, Y), ("right", T[:2], X[:2] + 1, Y[:2])], dtype=kind)
    dataset = load(saved(tmp_path, tracks=tracks))
    assert body_names(dataset) == ["left", "right"]
    np.testing.assert_array_equal(body_track(dataset, "right").x, X[:2] + 1)
    elements = [{"t": T, "x": X, "y": Y}, {"t": T[:2], "x": X[:2] + 1, "y": Y[:2]}]
    path = mat.hdf5_file(tmp_path / "b.mat", lambda file: mat.elements_of(file, "tracks", elements))
    dataset = load(path)
    assert body_names(dataset) == ["1", "2"]
    np.testing.assert_array_equal(body_track(dataset, "2").x, X[:2] + 1)


def test_a_struct_for_each_row_as_table2struct_makes_it(tmp_path: Path) -> None:
    rows = np.array(list(zip(T, X, Y, THETA, strict=True)), dtype=[(n, object) for n in POSE])
    check(saved(tmp_path, S=rows))
    rows = [{name: values[k] for name, values in POSE.items()} for k in range(6)]
    check(mat.hdf5_file(tmp_path / "b.mat", lambda file: mat.elements_of(file, "S", rows)))


def test_a_matrix_of_each_coordinate(tmp_path: Path) -> None:
    path = saved(tmp_path, t=T, x=np.stack([X, X + 1], 1), y=np.stack([Y, Y]), note=np.eye(3))
    dataset = load(path)
    assert body_names(dataset) == ["1", "2"]
    np.testing.assert_array_equal(body_track(dataset, "2").x, X + 1)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_matrix_whose_columns_are_named(tmp_path: Path, axis: int) -> None:
    path = saved(tmp_path, M=np.stack([T, X, Y, THETA], axis))
    with pytest.raises(InputError, match=r"4 columns and no header: name them with `columns`"):
        load(path)
    check(path, columns={"t": 1, "x": "2:m", "y": "3:m", "theta": 4})


def test_units_and_names_are_those_of_columns(tmp_path: Path) -> None:
    path = saved(
        tmp_path, S={"time_ms": T * 1e3, "x_mm": X * 1e3, "y_mm": Y, "robot": list("aaabbb")}
    )
    dataset = load(path)
    assert body_names(dataset) == ["a", "b"]
    np.testing.assert_allclose(body_track(dataset, "b").x, X[3:], rtol=1e-15)
    again = load(saved(tmp_path, when=T, east=X, north=Y), columns={"t": "when:s", "x": "east:m",
                 "y": "north:m"})  # fmt: skip
    np.testing.assert_array_equal(body_track(again).x, X)


def test_the_variable_that_fits_or_is_named(tmp_path: Path) -> None:
    check(saved(tmp_path, settings={"gain": np.arange(9.0)}, S=POSE))
    path = saved(tmp_path, A={**POSE, "x": X + 1}, B=POSE)
    with pytest.raises(InputError, match=r'more than one variable, A, B: .* `sheet="A"`'):
        load(path)
    check(path, sheet="B")
    with pytest.raises(InputError, match=r'`sheet="C"`: no such variable; it has A, B'):
        load(path, sheet="C")


@pytest.mark.parametrize(
    ("kind", "advice"),
    [
        ("table", r"save it by writetable\(T, 'file.csv'\), or as S = table2struct\(T, 'ToScalar'"),
        ("timetable", r"writetable\(timetable2table\(T\), 'file.csv'\)"),
        ("datetime", r"save posixtime\(t\) in its place"),
    ],
)
def test_what_only_matlab_reads(tmp_path: Path, kind: str, advice: str) -> None:
    old = mat.object_file(tmp_path / "old.mat", "T", kind)
    new = mat.hdf5_file(tmp_path / "new.mat", lambda file: mat.object_of_hdf5(file, "T", kind))
    for path in (old, new):
        with pytest.raises(InputError, match=f"'T' is a MATLAB {kind}, which .*{advice}"):
            load(path)


def test_an_object_beside_what_can_be_read(tmp_path: Path) -> None:
    def file(name: str) -> Any:
        def fill(file: Any) -> None:
            mat.struct_of(file, "S", {key: values for key, values in POSE.items() if key != name})
            mat.object_of_hdf5(file, "when", "datetime")

        return mat.hdf5_file(tmp_path / f"{name}.mat", fill)

    check(file("nothing"))
    with pytest.raises(InputError, match="'when' is a MATLAB datetime"):
        load(file("x"))


def test_other_files_of_matlab_are_not_taken_for_a_flow(tmp_path: Path) -> None:
    assert flow_format(saved(tmp_path, **POSE)) is None
    with pytest.raises(InputError, match="no velocities of PIVlab"):
        load_flow(saved(tmp_path, **POSE))


def damaged(folder: Path) -> dict[str, bytes]:
    old = saved(folder, S=POSE).read_bytes()
    new = mat.hdf5_file(folder / "b.mat", lambda file: mat.struct_of(file, "S", POSE)).read_bytes()
    return {
        "cut off": old[: len(old) // 2],
        "cut off 7.3": new[: len(new) // 2],
        "only its header": old[:128],
        "zeros": old[:128] + bytes(400),
        "no x": saved(folder, t=T, y=Y).read_bytes(),
        "texts": saved(folder, t="a", x="b").read_bytes(),
        "a word": saved(folder, S={"t": T, "x": list("abcdef"), "y": Y}).read_bytes(),
        "complex": saved(folder, t=T, x=X + 1j, y=Y).read_bytes(),
        "nothing": saved(folder).read_bytes(),
    }


def test_damaged_files_are_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "damaged.mat"
    for case, content in damaged(tmp_path).items():
        path.write_bytes(content)
        begin = time.process_time()
        assert main(["info", str(path)]) == 2, case
        assert time.process_time() - begin < 10.0, case
        error = capsys.readouterr().err
        assert error.count("\n") == 1, case
        assert str(path) in error, case


def test_a_file_that_declares_more_than_it_holds(tmp_path: Path) -> None:
    def fill(file: Any) -> None:
        mat.struct_of(file, "S", POSE)
        file["S"].create_dataset("z", shape=(10**6, 10**6), chunks=(100, 100), dtype="f8")
        file["S/z"].attrs["MATLAB_class"] = np.bytes_("double")

    with pytest.raises(InputError, match="its header declares"):
        load(mat.hdf5_file(tmp_path / "a.mat", fill))
