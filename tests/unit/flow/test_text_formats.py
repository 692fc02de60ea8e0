"""Text of PIV programs, written here in the layout of each: right to the last digit, or refused."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import here

from driftwalk.core.errors import InputError
from driftwalk.flow import flow_format, load_flow
from driftwalk.flow.readers.columns import column_of
from driftwalk.schema import FLAGS

NX, NY = 5, 4
X, Y = 16.0 * np.arange(1, NX + 1), 16.0 * np.arange(1, NY + 1)
U = 1.0 + 0.25 * np.arange(NX * NY).reshape(NY, NX)
V = -0.5 + 0.125 * np.arange(NX * NY).reshape(NY, NX)
"""A field over rising x and y."""
LOST = (1, 2)
PIXELS: dict[str, Any] = {"metres_per_pixel": 2e-4, "frame_interval": 0.01}
Row = tuple[float, float, float, float, bool]


def nodes(*, top_first: bool = True) -> list[Row]:
    """Return x, y, u, v and whether it is lost, from the row of the largest y on, or the least."""
    order = range(NY)[::-1] if top_first else range(NY)
    return [(X[i], Y[j], U[j, i], V[j, i], (j, i) == LOST) for j in order for i in range(NX)]


def check(field: Any, *, scale: float, speed: float, down: bool = False, lost: bool = True) -> None:
    """Compare with the arrays above: positions times scale, velocities times speed."""
    sign = -1 if down else 1
    y, u, v = (sign * Y)[::sign], U[::sign], sign * V[::sign]
    np.testing.assert_allclose(field.x, scale * X, rtol=1e-12)
    np.testing.assert_allclose(field.y, scale * y, rtol=1e-12)
    known = np.ones((NY, NX), dtype=bool)
    if lost:
        known[NY - 1 - LOST[0] if down else LOST[0], LOST[1]] = False
    np.testing.assert_array_equal(field.flag == FLAGS["measured"], known)
    np.testing.assert_allclose(field.u.values[known], speed * u[known], rtol=1e-12)
    np.testing.assert_allclose(field.v.values[known], speed * v[known], rtol=1e-12)
    assert ("y counts down" in field.attrs["reading"]) == down


def written(path: Path, head: str, rows: list[list[Any]], delimiter: str = ",") -> Path:
    lines = [delimiter.join(map(str, row)) for row in rows]
    path.write_text(head + "\n".join(lines) + "\n", encoding="utf-8")
    return path


def pivlab(
    path: Path, *, delimiter: str = ",", info: bool = True, names: bool = True, units: str = "px",
    empty: str = "NaN", more: int = 0,
) -> Path:  # fmt: skip
    speed, factor = ("px/frame", 1) if units == "px" else ("m/s", 0.0002)
    head = ""
    if info:
        head += "PIVlab, ASCII chart output - 01-May-2026\nFRAME: 1, filenames: A.bmp & B.bmp, "
        head += f"conversion factor xy (px -> m): {factor}, conversion factor uv (px/frame -> m/s)"
        head += ": 1\n"
    called = [f"x [{units}]", f"y [{units}]", f"u [{speed}]", f"v [{speed}]", "Vector type [-]"]
    called += ["vorticity [1/frame]", "magnitude [px/frame]"][:more]
    head += delimiter.join(called) + "\n" if names else ""
    rows = [
        [x, y, *((empty, empty) if lost else (u, v)), int(not lost), *[0.5] * more]
        for x, y, u, v, lost in nodes(top_first=False)
    ]
    return written(path, head, rows, delimiter)


@pytest.mark.parametrize("delimiter", [",", "\t", " "])
@pytest.mark.parametrize("info", [True, False])
@pytest.mark.parametrize("more", [0, 2])
def test_pivlab_text_in_pixels(tmp_path: Path, delimiter: str, info: bool, more: int) -> None:
    path = pivlab(tmp_path / "piv.txt", delimiter=delimiter, info=info, more=more)
    assert flow_format(path) == "pivlab"
    field = load_flow(path, **PIXELS)
    check(field, scale=2e-4, speed=0.02, down=True)
    header = 3 if info else 1
    assert f"PIVlab text, header in line {header}: x from 'x [px]'" in field.attrs["reading"]
    assert field.attrs["warning"].startswith("y counts downwards in the file")
    check(load_flow(path, **PIXELS, y_axis="up"), scale=2e-4, speed=0.02)


def test_pivlab_text_in_other_dresses(tmp_path: Path) -> None:
    path = tmp_path / "piv.txt"
    check(load_flow(pivlab(path, units="m")), scale=1.0, speed=1.0, down=True)
    check(load_flow(pivlab(path, empty=""), **PIXELS), scale=2e-4, speed=0.02, down=True)
    check(load_flow(pivlab(path, names=False), **PIXELS), scale=2e-4, speed=0.02, down=True)
    check(load_flow(pivlab(path, names=False, units="m")), scale=1.0, speed=1.0, down=True)
    assert flow_format(path) == "pivlab"
    # Replaced vectors are none that were measured.
    text = pivlab(path).read_text().replace("NaN,NaN,0", "7,7,2")
    path.write_text(text.replace("\n", "\r\n"), encoding="utf-8-sig")
    check(load_flow(path, **PIXELS), scale=2e-4, speed=0.02, down=True)
    path.write_text(text, encoding="utf-16")
    check(load_flow(path, **PIXELS), scale=2e-4, speed=0.02, down=True)


def test_one_rule_for_y_in_pixels(tmp_path: Path) -> None:
    """The first row is the top of the image; a program that turned y gave it the largest."""
    heads = {
        "x [px],y [px],u [px/frame],v [px/frame]\n": ",",
        "# x y u v\n": " ",
        "": "\t",
        'VARIABLES = "x [px]", "y [px]", "Vx [px/frame]", "Vy [px/frame]"\nZONE I=5, J=4\n': " ",
        "lines above\nx (px);y (px);Ux (px/frame);Uy (px/frame)\n": ";",
    }
    for head, delimiter in heads.items():
        for top_first in (True, False):
            rows = [[x, y, u, v] for x, y, u, v, _ in nodes(top_first=top_first)]
            path = written(tmp_path / "field.txt", head, rows, delimiter)
            assert flow_format(path) is not None, head
            field = load_flow(path, **PIXELS)
            check(field, scale=2e-4, speed=0.02, down=not top_first, lost=False)
            check(load_flow(path, **PIXELS, y_axis="up"), scale=2e-4, speed=0.02, lost=False)
    # In metres y is that of a map.
    path = written(tmp_path / "field.csv", "x,y,u,v\n", [list(one[:4]) for one in nodes()[::-1]])
    check(load_flow(path), scale=1.0, speed=1.0, lost=False)


@pytest.mark.parametrize("comma", [True, False])
@pytest.mark.parametrize("mark", ["isValid", "zero", "empty"])
def test_davis_10_table(tmp_path: Path, comma: bool, mark: str) -> None:
    head = "x [mm];y [mm];Velocity u [m/s];Velocity v [m/s]"
    gone: tuple[Any, Any] = ("", "") if mark == "empty" else (0, 0)
    rows = [
        [x, y, *(gone if lost else (u, v)), *([int(not lost)] if mark == "isValid" else [])]
        for x, y, u, v, lost in nodes()
    ]
    head += ";isValid\n" if mark == "isValid" else "\n"
    path = written(tmp_path / "B00001.csv", head, rows, ";")
    if comma:
        path.write_text(path.read_text().replace(".", ","))
    assert flow_format(path) == "davis"
    check(load_flow(path), scale=1e-3, speed=1.0)


@pytest.mark.parametrize(
    "names",
    [
        '"x [mm]", "y [mm]", "Velocity u [m/s]", "Velocity v [m/s]", "isValid"',
        '"X mm" "Y mm" "U m/s" "V m/s" "valid"',
        '"x (mm)",\n"y (mm)",\n"Vx (m/s)",\n"Vy (m/s)",\n"mask2", "CHC"',
    ],
)
def test_tecplot(tmp_path: Path, names: str) -> None:
    more = [1] if "mask2" in names else []
    rows = [[x, y, u, v, *more, int(not lost)] for x, y, u, v, lost in nodes()]
    head = f'TITLE = "B0001"\nVARIABLES = {names}\nZONE T="Frame 0", I={NX}, J={NY}, F=POINT\n'
    head += "STRANDID=1, SOLUTIONTIME=0.4\n"
    path = written(tmp_path / "B0001.dat", head, rows, " ")
    assert flow_format(path) in ("tecplot", "insight")
    check(load_flow(path), scale=1e-3, speed=1.0)


def test_tecplot_without_quotes_and_with_more_zones(tmp_path: Path) -> None:
    rows = [[x, y, 0.0, u, v, 0.0] for x, y, u, v, _ in nodes()]
    head = "VARIABLES = X, Y, Z, U, V, W\nZONE I=5, J=4, K=1, F=POINT\n"
    path = written(tmp_path / "a.plt", head, rows, "\t")
    check(load_flow(path, length_unit="mm"), scale=1e-3, speed=1e-3, lost=False)
    with pytest.raises(InputError, match="does not name its units"):
        load_flow(path)
    path.write_text(
        path.read_text() + "ZONE I=5, J=4\n" + "\n".join(path.read_text().split("\n")[2:])
    )
    with pytest.raises(InputError, match="holds 2 zones: write one zone into a file"):
        load_flow(path, length_unit="mm")
    written(path, head.replace("POINT", "BLOCK"), rows, "\t")
    with pytest.raises(InputError, match="BLOCK order: write it in POINT order"):
        load_flow(path, length_unit="mm")


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_dantec(tmp_path: Path, delimiter: str) -> None:
    head = (
        ">>*HEADER*<<\nFileID:DSExport.CSV\nVersion:2\nGridSize:{Width=5, Height=4}\n"
        "TimeStamp: #1, 0.0\n>>*DATA*<<\n"
    )
    names = ["x", "y", "x (pix)[pix]", "y (pix)[pix]", "x (mm)[mm]", "y (mm)[mm]", "U pix[pix]"]
    names += ["V pix[pix]", "U[m/s]", "V[m/s]", "Length[m/s]", "Status"]
    rows = [
        [int(x / 16), int(y / 16), 3 * x, 3 * y, x, y, 9, 9, u, v, 1, 17 if lost else 0]
        for x, y, u, v, lost in nodes(top_first=False)
    ]
    path = written(tmp_path / "run.csv", head + delimiter.join(names) + "\n", rows, delimiter)
    assert flow_format(path) == "dantec"
    check(load_flow(path), scale=1e-3, speed=1.0)


@pytest.mark.parametrize("flag", [-1, 999])
def test_the_piv_plugin_of_imagej(tmp_path: Path, flag: int) -> None:
    rows = [
        [x, y, u, v, math.hypot(u, v), 0, 0.9, 9, 9, 9, 9, 9, 0, 0, 0, flag if lost else 0]
        for x, y, u, v, lost in nodes(top_first=False)
    ]
    rows[3][-1] = 21  # the second peak of the correlation was taken
    path = written(tmp_path / "PIV_disp.txt", "", rows, " ")
    assert flow_format(path) == "fiji"
    check(load_flow(path, **PIXELS), scale=2e-4, speed=0.02, down=True)
    with pytest.raises(InputError, match="give `metres_per_pixel`"):
        load_flow(path)


@pytest.mark.parametrize(
    ("names", "units"),
    [
        ("X,Y,Vx,Vy", "mm,mm,cm/s,cm/s"),
        ("pos_x,pos_y,velocity_x,velocity_y", "[mm],[mm],[cm/s],[cm/s]"),
        ("x position,y position,u velocity,v velocity", "(mm),(mm),(cm/s),(cm/s)"),
        ("x_mm,y_mm,u_cm_s,v_cm_s", ""),
        ("Position X [mm],Position Y [mm],Vel. X [cm/s],Vel. Y [cm/s]", ""),
        ("X-Koordinate,Y-Koordinate,Geschwindigkeit u,Geschwindigkeit v", "mm,mm,cm/s,cm/s"),
        ("position x [mm],position y [mm],vitesse x [cm/s],vitesse y [cm/s]", ""),
    ],
)
def test_other_names_with_units_in_the_name_or_under_it(
    tmp_path: Path, names: str, units: str
) -> None:
    head = f"measured by hand\n\n{names}\n" + (f"{units}\n" if units else "")
    rows = [[x, y, *(("-", "n/a") if lost else (u, v))] for x, y, u, v, lost in nodes()]
    path = written(tmp_path / "field.csv", head, rows)
    assert flow_format(path) == "csv"
    check(load_flow(path), scale=1e-3, speed=1e-2)


def test_shifts_in_millimetres(tmp_path: Path) -> None:
    head = "sep=,\nx [mm],y [mm],dx [mm/frame],dy [mm/frame]\n"
    path = written(tmp_path / "field.csv", head, [list(one[:4]) for one in nodes()])
    check(load_flow(path, frame_interval=0.01), scale=1e-3, speed=0.1, lost=False)
    with pytest.raises(InputError, match="give `frame_interval`"):
        load_flow(path)


@pytest.mark.parametrize(
    "name",
    [
        "velocity magnitude",
        "std u",
        "dudx",
        "vorticity",
        "w [m/s]",
        "x y",
        "mean x",
        "V_z",
        "x_std",
    ],
)
def test_what_is_no_component_of_the_velocity(name: str) -> None:
    assert column_of(name).quantity not in ("u", "v")


def test_columns_that_nobody_knows_are_named(tmp_path: Path) -> None:
    rows = [["a", x, y, u, v, int(not lost)] for x, y, u, v, lost in nodes()]
    path = written(tmp_path / "field.csv", "# campaign 3\nArt,Ost,Nord,Vo,Vn,valid\n", rows)
    named = {"x": "Ost:mm", "y": "nord:mm", "u": "Vo:cm/s", "v": "Vn:cm/s"}
    numbered = {"x": "2:mm", "y": "3:mm", "u": "4:cm/s", "v": "5:cm/s"}
    for columns in (named, numbered):
        check(load_flow(path, columns=columns), scale=1e-3, speed=1e-2)
        check(load_flow(path, columns=columns, header_line=2), scale=1e-3, speed=1e-2)
    bare = {name: text.partition(":")[0] for name, text in named.items()}
    with pytest.raises(InputError, match="does not name its units"):
        load_flow(path, columns=bare)
    with pytest.raises(InputError, match=r"needs one column 'x' .* got Art, Ost, Nord, Vo, Vn"):
        load_flow(path)
    with pytest.raises(InputError, match="`columns` names 'East', and the table has Art, Ost"):
        load_flow(path, columns={**named, "x": "East"}, header_line=2)
    with pytest.raises(InputError, match="of x, y, u, v; got 'speed'"):
        load_flow(path, columns={**named, "speed": "Vo"})
    assert flow_format(path) is None


def test_rows_without_names_by_number(tmp_path: Path) -> None:
    rows = [[u, v, x, y] for x, y, u, v, _ in nodes()]
    path = written(tmp_path / "field.csv", "", rows, ";")
    columns = {"x": "3:mm", "y": "4:mm", "u": "1:mm/s", "v": "2:mm/s"}
    check(load_flow(path, columns=columns), scale=1e-3, speed=1e-3, lost=False)
    with pytest.raises(InputError, match="got 4 columns without names"):
        load_flow(path)


@pytest.mark.parametrize(
    ("head", "rows"),
    [
        ("t,x,y,vx,vy\n", [[0.1 * k, 0.01 * k, 0.02, 0.1, 0.0] for k in range(20)]),
        ("x,y,vx,vy\n", [[0.01 * k, 0.002 * k * k, 0.1, 0.0] for k in range(20)]),
        ("frame;x;y;u;v\n", [[k, 3.0 * k, 5.0, 1.0, 0.0] for k in range(20)]),
        ("x y theta speed\n", [[0.01 * k, 0.02, 0.1, 0.0] for k in range(20)]),
        ("", [[0.01 * k, 0.03 * k, 0.1, 0.0, 1] for k in range(20)]),
    ],
)
def test_a_recording_with_velocities_is_no_field(
    tmp_path: Path, head: str, rows: list[list[float]]
) -> None:
    delimiter = next((one for one in ",;" if one in head), " ")
    assert flow_format(written(tmp_path / "a.csv", head, rows, delimiter)) is None


def test_the_command_line(tmp_path: Path) -> None:
    path = pivlab(tmp_path / "piv.txt")
    given = ("--scale", "0.2mm", "--frame-interval", "10ms", "-o", tmp_path / "flow.nc")
    for more in ((), ("--header-line", "3"), ("--columns", "u=u [px/frame],v=v [px/frame]")):
        done = here("flow", path, *given, "--overwrite", *more)
        assert done.code == 0, done.err
        assert "read as PIVlab text, header in line 3: x from 'x [px]'" in done.err
        assert "y counts down: y and v negated" in done.err
        check(load_flow(tmp_path / "flow.nc"), scale=2e-4, speed=0.02, down=True)
    said = here("info", path, *given[:4])
    assert "read as" in said.out
    recorded = written(tmp_path / "a.csv", "t,x,y\n", [[0.1 * k, 0.1, 0.2] for k in range(9)])
    refused = here("flow", recorded, "--frame-interval", "10ms", "-o", tmp_path / "b.nc")
    assert "--columns x=NAME,y=NAME,u=NAME,v=NAME makes it a flow field" in refused.err


def test_the_public_case(shared_data: Callable[[str], Path]) -> None:
    path = shared_data("public-cases") / "pivlab-text" / "pivlab.txt"
    field = load_flow(path, metres_per_pixel=1e-4, frame_interval=0.01)
    assert (field.sizes["x"], field.sizes["y"]) == (8, 6)
    assert int((field.flag == FLAGS["measured"]).sum()) == 47
    assert float(field.y.max()) < 0.0
    # The vortex turns clockwise seen from above once y counts up.
    assert float(field.v[0, -1] - field.v[0, 0]) < 0.0


@pytest.mark.parametrize("back", [1, 2, 8, 30])
def test_a_file_that_ends_within_a_row(tmp_path: Path, back: int) -> None:
    path = pivlab(tmp_path / "piv.txt")
    path.write_text(path.read_text().rstrip("\n")[:-back])
    with pytest.raises(InputError) as caught:
        load_flow(path, **PIXELS)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("mark", ["-9999", "999", "1e20"])
def test_a_number_far_beyond_all_others_is_no_velocity(tmp_path: Path, mark: str) -> None:
    path = tmp_path / "field.csv"
    rows = [f"{x},{y},0.1,-0.2" for y in range(3) for x in range(4)]
    rows[5] = f"1,1,{mark},{mark}"
    path.write_text("\n".join(["x,y,u,v", *rows, ""]), encoding="utf-8")
    field = load_flow(path)
    assert int((field.flag == 1).sum()) == 11
    assert "at 1 node: taken as missing" in field.attrs["warning"]
    np.testing.assert_allclose(field.u, 0.1)


@pytest.mark.parametrize(
    ("head", "length", "speed"),
    [
        ("x_mm,y_mm,vx_mm_s,vy_mm_s", 1e-3, 1e-3),
        ("x_m,y_m,u_m_per_s,v_m_per_s", 1.0, 1.0),
        ("x [in],y [in],u [ft/s],v [ft/s]", 0.0254, 0.3048),
    ],
)
def test_further_names_and_units(tmp_path: Path, head: str, length: float, speed: float) -> None:
    path = tmp_path / "field.csv"
    rows = [f"{x},{y},0.1,-0.2" for y in range(3) for x in range(4)]
    path.write_text("\n".join([head, *rows, ""]), encoding="utf-8")
    field = load_flow(path)
    np.testing.assert_allclose(field.x, length * np.arange(4))
    np.testing.assert_allclose(field.v, -0.2 * speed)
