"""Fields of PIV programs: each against numbers read by hand, masks kept, units never guessed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from driftwalk.core.errors import InputError
from driftwalk.flow import flow_format, load_flow
from driftwalk.schema import FLAGS

NX, NY = 5, 4
X, Y = 16.0 * np.arange(1, NX + 1), 16.0 * np.arange(1, NY + 1)
U = 1.0 + 0.25 * np.arange(NX * NY).reshape(NY, NX)
V = -0.5 + 0.125 * np.arange(NX * NY).reshape(NY, NX)
"""A field in rising x and y; the writers put it into their order."""
PIXELS: dict[str, Any] = {"metres_per_pixel": 2e-4, "frame_interval": 0.01}
MASKED = (1, 2)


def rows(*, top_first: bool = True) -> list[tuple[float, float, float, float]]:
    """Return x, y, u, v from the row of the largest y, or of the smallest, on."""
    order = range(NY)[::-1] if top_first else range(NY)
    return [(X[i], Y[j], U[j, i], V[j, i]) for j in order for i in range(NX)]


def is_masked(x: float, y: float) -> bool:
    return (y, x) == (Y[MASKED[0]], X[MASKED[1]])


def check(
    field: Any, *, scale: float, speed: float, down: bool = False, masked: bool = True
) -> None:
    """Compare with the arrays above: positions times scale, velocities times speed."""
    sign = -1.0 if down else 1.0
    y, u, v = sign * Y, U, sign * V
    if down:
        y, u, v = y[::-1], U[::-1], v[::-1]
    np.testing.assert_allclose(field.x, scale * X, rtol=1e-12)
    np.testing.assert_allclose(field.y, scale * y, rtol=1e-12)
    expected = np.full((NY, NX), FLAGS["measured"])
    if masked:
        expected[MASKED[0] if not down else NY - 1 - MASKED[0], MASKED[1]] = FLAGS["filled"]
    np.testing.assert_array_equal(field.flag, expected)
    known = expected == FLAGS["measured"]
    np.testing.assert_allclose(field.u.values[known], speed * u[known], rtol=1e-12)
    np.testing.assert_allclose(field.v.values[known], speed * v[known], rtol=1e-12)
    assert np.isfinite(field.u.values).all()


def openpiv(
    folder: Path, *, top_first: bool = True, header: bool = True, lost: str = "mask"
) -> Path:
    lines = ["# x\ty\tu\tv\tflags\tmask"] if header else []
    for x, y, u, v in rows(top_first=top_first):
        bad = is_masked(x, y)
        marks = [bad and lost == "flags", bad and lost == "mask"] if header else []
        shown = (np.nan, np.nan) if bad and lost == "nan" else (u, v)
        lines.append("\t".join(f"{value:.6e}" for value in (x, y, *shown, *marks)))
    path = folder / "field.txt"
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize("lost", ["flags", "mask", "nan"])
@pytest.mark.parametrize("top_first", [True, False])
def test_openpiv(tmp_path: Path, lost: str, top_first: bool) -> None:
    path = openpiv(tmp_path, lost=lost, top_first=top_first)
    assert flow_format(path) == "openpiv"
    check(load_flow(path, **PIXELS), scale=2e-4, speed=0.02, down=not top_first)
    check(load_flow(path, length_unit="mm"), scale=1e-3, speed=1e-3, down=not top_first)
    check(load_flow(path, **PIXELS, y_axis="up"), scale=2e-4, speed=0.02)
    check(load_flow(path, **PIXELS, y_axis="down"), scale=2e-4, speed=0.02, down=True)


def test_openpiv_without_a_header(tmp_path: Path) -> None:
    path = openpiv(tmp_path, header=False, lost="nan")
    assert flow_format(path) == "openpiv"
    check(load_flow(path, **PIXELS), scale=2e-4, speed=0.02)
    # Without one row it fills no grid, and may as well be a track.
    path.write_text("\n".join(path.read_text().splitlines()[1:]) + "\n")
    assert flow_format(path) is None


def test_named_columns_with_units(tmp_path: Path) -> None:
    path = tmp_path / "field.csv"
    text = "".join(f"{x},{y},{u},{v},1\n" for x, y, u, v in rows())
    path.write_text("X [mm],Y [mm],U [cm/s],V [cm/s],type\n" + text)
    assert flow_format(path) == "csv"
    check(load_flow(path), scale=1e-3, speed=1e-2, masked=False)
    path.write_text("x [px],y [px],u [px/frame],v [px/frame],type\n" + text)
    check(load_flow(path, **PIXELS), scale=2e-4, speed=0.02, masked=False)
    path.write_text("x [px],y [px],u [px/s],v [px/s],type\n" + text)
    check(load_flow(path, metres_per_pixel=2e-4), scale=2e-4, speed=2e-4, masked=False)
    path.write_text("x [mm],y [m],u [m/s],v [m/s],type\n" + text)
    with pytest.raises(InputError, match="line 1: x, y, u, v have the units mm, m, m/s, m/s"):
        load_flow(path)


def insight(folder: Path, units: tuple[str, str] = ("mm", "m/s"), interval: str = "2000.0") -> Path:
    length, speed = units
    header = (
        f'TITLE="field.vec" VARIABLES="X {length}", "Y {length}", "U {speed}", "V {speed}", "CHC", '
        f'DATASETAUXDATA MicrosecondsPerDeltaT="{interval}" ZONE I={NX}, J={NY}, F=POINT'
    )
    lines = [
        f"{x:.6f}, {y:.6f}, {u:.6f}, {v:.6f}, {-1 if is_masked(x, y) else 1}"
        for x, y, u, v in rows()
    ]
    path = folder / "field.vec"
    path.write_text("\n".join([header, *lines]) + "\n")
    return path


def test_insight(tmp_path: Path) -> None:
    path = insight(tmp_path)
    assert flow_format(path) == "insight"
    check(load_flow(path), scale=1e-3, speed=1.0)


def test_insight_in_pixels_holds_the_time_between_images(tmp_path: Path) -> None:
    path = insight(tmp_path, ("pixel", "pixel"))
    check(load_flow(path, metres_per_pixel=1e-3), scale=1e-3, speed=1e-3 / 2e-3)
    with pytest.raises(InputError, match="the file itself says what `frame_interval` would"):
        load_flow(path, metres_per_pixel=1e-3, frame_interval=0.01)
    with pytest.raises(InputError, match="positions are in pixels: give `metres_per_pixel`"):
        load_flow(path)
    with pytest.raises(InputError, match="shifts between two images: give `frame_interval`"):
        load_flow(insight(tmp_path, ("pixel", "pixel"), interval="?"), metres_per_pixel=1e-3)


def davis(folder: Path, *, comma: bool = True) -> Path:
    header = f'#DaVis 8.1.6 2D-vector 8 {NY} {NX} "position" "mm" "position" "mm" "velocity" "m/s"'
    lines = [
        "\t".join(f"{value:.6g}" for value in (x, y, *((0, -0.0) if is_masked(x, y) else (u, v))))
        for x, y, u, v in rows()
    ]
    path = folder / "B00001.txt"
    text = "\n".join(lines)
    path.write_text(header + "\n" + (text.replace(".", ",") if comma else text) + "\n")
    return path


@pytest.mark.parametrize("comma", [True, False])
def test_davis(tmp_path: Path, comma: bool) -> None:
    path = davis(tmp_path, comma=comma)
    assert flow_format(path) == "davis"
    check(load_flow(path), scale=1e-3, speed=1.0)


def test_davis_own_file_is_to_be_exported(tmp_path: Path) -> None:
    path = tmp_path / "B00001.vc7"
    path.write_bytes(b"\x00\x01")
    for function in (load_flow, flow_format):
        with pytest.raises(InputError, match=r"DaVis' own \(.vc7\): export it from DaVis as txt"):
            function(path)


def pivlab_arrays(*, frames: int = 2) -> dict[str, list[Any]]:
    """Return arrays as MATLAB has them, rows down the image; the frames average to U and V."""
    x, y = np.meshgrid(X, Y)
    kind = np.ones((NY, NX))
    kind[MASKED] = 0
    shifts = np.linspace(-1.0, 1.0, frames) if frames > 1 else np.zeros(1)
    return {
        "x": [x] * frames,
        "y": [y] * frames,
        "u": [U + shift for shift in shifts],
        "v": [V - shift for shift in shifts],
        "typevector": [kind] * frames,
    }


def cells(arrays: list[Any]) -> Any:
    made = np.empty((len(arrays), 1), dtype=object)
    for number, array in enumerate(arrays):
        made[number, 0] = array
    return made


def pivlab(folder: Path, how: str, *, frames: int = 2, **more: Any) -> Path:
    arrays, path = pivlab_arrays(frames=frames), folder / "field.mat"
    if how == "session":
        with h5py.File(path, "w", userblock_size=512) as file:
            for name, values in arrays.items():
                for number, array in enumerate(values):
                    file[f"{name}_{number}"] = array.T
            for name, value in more.items():
                file[name] = value
        content = b"MATLAB 7.3 MAT-file".ljust(512) + path.read_bytes()[512:]
        path.write_bytes(content)
    elif how == "cells":
        with h5py.File(path, "w") as file:
            for name, values in arrays.items():
                full = name if name in "xy" else f"{name}_original"
                references = [
                    file.create_dataset(f"#refs#/{name}{number}", data=array.T).ref
                    for number, array in enumerate(values)
                ]
                file.create_dataset(full, data=np.array([references], dtype=h5py.ref_dtype))
            file["units"] = np.array([[ord(c)] for c in more.get("units", "[px]")], dtype=np.uint16)
    else:
        named = {
            name if name in "xy" else f"{name}_original": cells(values)
            for name, values in arrays.items()
        }
        savemat(path, {**named, "units": more.get("units", "[px] respectively [px/frame]")})
    return path


@pytest.mark.parametrize("how", ["session", "cells", "old"])
@pytest.mark.parametrize("frames", [1, 3])
def test_pivlab(tmp_path: Path, how: str, frames: int) -> None:
    path = pivlab(tmp_path, how, frames=frames)
    assert flow_format(path) == "pivlab"
    field = load_flow(path, **PIXELS)
    check(field, scale=2e-4, speed=0.02, down=True)
    mean = "the flow is the mean of 3 frames: the file holds no times; "
    turned = "y counts downwards in the file: y and v are negated (`y_axis`)"
    assert field.attrs["warning"] == (mean if frames == 3 else "") + turned


@pytest.mark.parametrize("how", ["cells", "old"])
def test_a_calibrated_export_of_pivlab(tmp_path: Path, how: str) -> None:
    path = pivlab(tmp_path, how, units="[m] respectively [m/s]")
    check(load_flow(path), scale=1.0, speed=1.0, down=True)
    with pytest.raises(InputError, match="says what `metres_per_pixel` would"):
        load_flow(path, metres_per_pixel=1e-3)


def test_a_calibrated_session_of_pivlab(tmp_path: Path) -> None:
    path = pivlab(tmp_path, "session", calxy=np.array([[2e-4]]), caluv=np.array([[0.05]]))
    check(load_flow(path), scale=2e-4, speed=0.05, down=True)


def test_a_node_that_one_frame_lacks_is_the_mean_of_the_others(tmp_path: Path) -> None:
    path = pivlab(tmp_path, "session", frames=3)
    with h5py.File(path, "a") as file:
        kind = file["typevector_0"][...]
        kind[0, 0] = 2
        file["typevector_0"][...] = kind
    field = load_flow(path, **PIXELS, y_axis="up")
    assert float(field.u[0, 0]) == pytest.approx(0.02 * (U[0, 0] + 0.5), rel=1e-12)


def by_hand(path: Path, delimiter: str | None, skip: int) -> Any:
    text = path.read_text(encoding="utf-8")
    if delimiter == "\t" and text.startswith("#DaVis"):
        text = text.replace(",", ".")
    return np.loadtxt(text.splitlines()[skip:], delimiter=delimiter)


REAL = [
    ("piv-pivpy", "OpenPIVtxtFilePair0.txt", None, 1, PIXELS, (2e-4, 0.02), (4, 5)),
    ("piv-pivpy", "OpenPIVtxtFilePair1.txt", None, 1, PIXELS, (2e-4, 0.02), (4, 5)),
    ("piv-pivpy", "PIVchallengeCaseBvelField.txt", None, 1, PIXELS, (2e-4, 0.02), (4, 5)),
    ("piv-pivpy", "exp1_001_b.txt", None, 0, PIXELS, (2e-4, 0.02), ()),
    ("piv-pivpy", "Run000001.T000.D000.P000.H001.L.vec", ",", 1, {}, (1e-3, 1.0), "chc"),
    ("piv-pivpy", "Run000002.T000.D000.P000.H001.L.vec", ",", 1, {}, (1e-3, 1.0), "chc"),
    ("formats-2", "davis_B00001.txt", "\t", 1, {}, (1e-3, 1.0), "zero"),
    (
        *("formats-2", "insight_pixels.vec", ",", 1, {"metres_per_pixel": 2e-4}),
        *((2e-4, 2e-4 / 0.055), "chc"),
    ),
]


@pytest.mark.parametrize(
    ("folder", "name", "delimiter", "skip", "options", "factors", "marks"), REAL
)
def test_real_fields(
    shared_data: Callable[[str], Path],
    *,
    folder: str,
    name: str,
    delimiter: str | None,
    skip: int,
    options: dict[str, Any],
    factors: tuple[float, float],
    marks: Any,
) -> None:
    path = shared_data(folder) / name
    table = by_hand(path, delimiter, skip)
    field = load_flow(path, **options)
    down = delimiter is None and table[0, 1] < table[-1, 1]
    sign = -1.0 if down else 1.0
    if marks == "chc":
        lost = table[:, 4] <= 0
    elif marks == "zero":
        lost = (table[:, 2:4] == 0).all(axis=1)
    else:
        lost = (table[:, list(marks)] != 0).any(axis=1)
    assert 0 <= lost.mean() < 0.7
    column = np.abs(field.x.values[:, None] - factors[0] * table[:, 0]).argmin(axis=0)
    row = np.abs(field.y.values[:, None] - sign * factors[0] * table[:, 1]).argmin(axis=0)
    # Positions are printed with five digits or more, and the nodes are evenly spaced anew.
    spacing = float(field.x[1] - field.x[0])
    np.testing.assert_allclose(
        field.x.values[column], factors[0] * table[:, 0], atol=0.02 * spacing
    )
    assert field.u.size == len(table)
    np.testing.assert_array_equal(
        field.flag.values[row, column], np.where(lost, FLAGS["filled"], FLAGS["measured"])
    )
    for values, measured, turned in ((field.u, table[:, 2], 1.0), (field.v, table[:, 3], sign)):
        np.testing.assert_allclose(
            values.values[row, column][~lost], turned * factors[1] * measured[~lost], rtol=1e-12
        )


def test_the_real_session_of_pivlab(shared_data: Callable[[str], Path]) -> None:
    path = shared_data("piv-pivpy") / "test_pivlab.mat"
    with h5py.File(path) as file:
        u = [file[f"u_{k}"][...] for k in range(2)]
        v = [file[f"v_{k}"][...] for k in range(2)]
        kind = [file[f"typevector_{k}"][...] for k in range(2)]
    field = load_flow(path, **PIXELS)
    known = np.array(kind) == 1
    for values, frames, sign in ((field.u, u, 1.0), (field.v, v, -1.0)):
        sums = np.where(known, frames, 0.0).sum(axis=0)
        mean = sums / np.maximum(known.sum(axis=0), 1)
        # MATLAB's columns are HDF5's rows: the first index is that of x.
        expected = sign * 0.02 * mean.T[::-1]
        measured = known.any(axis=0).T[::-1]
        np.testing.assert_allclose(values.values[measured], expected[measured], rtol=1e-12)
        np.testing.assert_array_equal(field.flag == FLAGS["measured"], measured)


MAKERS: dict[str, Callable[[Path], Path]] = {
    "openpiv": openpiv,
    "insight": insight,
    "davis": davis,
    "pivlab": lambda folder: pivlab(folder, "session"),
    "old": lambda folder: pivlab(folder, "old"),
}


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        ("openpiv", "1.600000e+01\t1.600000e+01\t", "1.600000e+01\t", "expected 6 fields, got 5"),
        (
            "openpiv",
            "\t1.000000e+00\t",
            "\tone\t",
            "line 9, column 4: expected a finite number, got 'one'",
        ),
        (
            "openpiv",
            "1.600000e+01\t6.400000e+01",
            "nan\t6.400000e+01",
            "line 2: a node has no position",
        ),
        ("openpiv", "\t0.000000e+00\n", "\t1.000000e+00\n", "every node is masked or missing"),
        (
            "insight",
            '"U m/s"',
            '"W m/s"',
            "line 1: the header needs one column 'u' .* got X mm, Y mm, W m/s",
        ),
        ("insight", '"Y mm"', '"Y m"', "x, y, u, v have the units mm, m, m/s, m/s"),
        ("insight", " mm", " furlong", "unknown unit 'furlong'"),
        ("insight", ", 1\n", "\n", "expected 5 fields, got 4"),
        ("davis", "2D-vector", "3D-vector", 'line 1: expected "2D-vector"'),
        ("davis", '"mm"', '"furlong"', "unknown unit 'furlong'"),
        ("davis", "16\t64\t", "16\t", "expected 4 fields, got 3"),
    ],
)
def test_what_is_refused(tmp_path: Path, name: str, old: str, new: str, message: str) -> None:
    path = MAKERS[name](tmp_path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(InputError, match=message) as caught:
        load_flow(path, **(PIXELS if name == "openpiv" else {}))
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("name", list(MAKERS))
@pytest.mark.parametrize("share", [0.0, 0.02, 0.3, 0.7, 0.97])
def test_truncated_files(tmp_path: Path, name: str, share: float) -> None:
    path = MAKERS[name](tmp_path)
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(InputError) as caught:
        load_flow(path, **(PIXELS if name in ("openpiv", "pivlab", "old") else {}))
    assert "\n" not in str(caught.value)


def test_a_declared_size_that_no_file_holds(tmp_path: Path) -> None:
    path = pivlab(tmp_path, "session")
    with h5py.File(path, "a") as file:
        del file["u_1"]
        file.create_dataset("u_1", shape=(10**6, 10**6), chunks=(100, 100), dtype="f8")
    with pytest.raises(InputError, match="is damaged: its header declares 8e"):
        load_flow(path, **PIXELS)


def test_renamed_and_missing_variables_of_pivlab(tmp_path: Path) -> None:
    path = pivlab(tmp_path, "session")
    with h5py.File(path, "a") as file:
        file.move("v_1", "w_1")
    with pytest.raises(InputError, match="has no variable 'v_1'"):
        load_flow(path, **PIXELS)
    savemat(path, {"positions": np.zeros(3)})
    with pytest.raises(InputError, match=r"no velocities of PIVlab .*, only positions"):
        load_flow(path, **PIXELS)
    savemat(path, {"x": X, "y": Y, "u": U, "v": V})
    with pytest.raises(InputError, match="frame 1 are no matrices of one size"):
        load_flow(path, **PIXELS)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "does not name its units"),
        ({"metres_per_pixel": 1e-3}, "give `frame_interval`"),
        ({"metres_per_pixel": -1.0, "frame_interval": 1.0}, "`metres_per_pixel` must be a number"),
        ({"length_unit": "ft"}, "`length_unit` is one of m, cm, mm, um, px"),
        ({"length_unit": "mm", "metres_per_pixel": 1e-3}, "says what `metres_per_pixel` would"),
        ({**PIXELS, "y_axis": "left"}, "`y_axis` is 'up' or 'down'"),
        ({**PIXELS, "variables": {"u": "a"}}, "variables of a NetCDF file"),
    ],
)
def test_facts_that_are_missing_or_too_many(
    tmp_path: Path, options: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        load_flow(openpiv(tmp_path), **options)


def test_the_centre_of_the_tank_becomes_the_origin(tmp_path: Path) -> None:
    field = load_flow(
        insight(tmp_path),
        origin=(0.048, 0.040),
        arena={"shape": "circle", "diameter_m": 0.05},
    )
    np.testing.assert_allclose(field.x, 1e-3 * X - 0.048, atol=1e-12)
    np.testing.assert_allclose(field.y, 1e-3 * Y - 0.040, atol=1e-12)
    x, y = np.meshgrid(field.x, field.y)
    np.testing.assert_array_equal(field.flag == FLAGS["outside"], np.hypot(x, y) > 0.025)
    with pytest.raises(InputError, match=r"x from 0\.016 to 0\.08 m, .*say with `origin` where"):
        load_flow(insight(tmp_path), arena={"shape": "circle", "diameter_m": 0.02})
