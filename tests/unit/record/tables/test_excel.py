"""Workbooks: sheets, dates, times and texts as spreadsheets keep them, and files that are none."""

from __future__ import annotations

import subprocess
import sys
import time
import zipfile
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pytest

from driftwalk.cli.main import main
from driftwalk.core.errors import InputError
from driftwalk.record import load
from driftwalk.schema import body_names, body_track

ROWS: list[list[Any]] = [["t", "x", "y"], [0, 1, 2], [0.5, 1.5, 2.25]]
START = datetime(2024, 12, 31, 23, 59, 59, 500_000)


def book(folder: Path, **sheets: list[list[Any]]) -> Path:
    workbook = openpyxl.Workbook()
    workbook.remove(workbook.active)
    for name, rows in sheets.items():
        sheet = workbook.create_sheet(name)
        for row in rows:
            sheet.append(row)
    workbook.save(folder / "synthetic.xlsx")
    return folder / "synthetic.xlsx"


def check(path: Path, **options: Any) -> None:
    track = body_track(load(path, **options))
    np.testing.assert_array_equal(track.time, [0.0, 0.5])
    np.testing.assert_array_equal(track.x, [1.0, 1.5])
    np.testing.assert_array_equal(track.y, [2.0, 2.25])


@pytest.mark.slow
def test_the_sheet_that_fits_or_is_named(tmp_path: Path) -> None:
    check(book(tmp_path, data=ROWS))
    check(book(tmp_path, notes=[["who", "when"], ["me", 2024]], empty=[], data=ROWS))
    path = book(tmp_path, A=ROWS, B=[ROWS[0], [0, 5, 6]])
    with pytest.raises(InputError, match=r'more than one sheet, A, B: name it, .*`sheet="A"`'):
        load(path)
    check(path, sheet="A")
    check(path, sheet=1)
    with pytest.raises(InputError, match=r'`sheet="C"`: no such sheet; it has A, B'):
        load(path, sheet="C")
    with pytest.raises(InputError, match="has no sheet with positions among A, B; sheet 'A': no c"):
        load(book(tmp_path, A=[["a"], [1]], B=[["b"], [2]]))


def test_lines_above_the_header_blank_rows_and_no_header(tmp_path: Path) -> None:
    check(book(tmp_path, A=[["a title"], [], *ROWS]), header_line=3)
    check(book(tmp_path, A=[[], *ROWS[:2], [], [None, None], ROWS[2]]))
    columns = {"t": 1, "x": "2:m", "y": "3:m"}
    check(book(tmp_path, A=ROWS[1:]), columns=columns)


def test_numbers_kept_as_text_and_missing_cells(tmp_path: Path) -> None:
    check(book(tmp_path, A=[ROWS[0], ["0", "1", "2"], ["0,5", "1,5", "2,25"]]))
    rows = [[*ROWS[0], "robot"], [0, 1, 2, 7], [0.5, None, "#N/A", 7], [1, 3, 4, 7]]
    dataset = load(book(tmp_path, A=rows))
    assert body_names(dataset) == ["7"]
    np.testing.assert_array_equal(dataset["x"].to_numpy()[:, 0], [1.0, np.nan, 3.0])


@pytest.mark.parametrize("apart", [False, True])
def test_dates_and_times(tmp_path: Path, apart: bool) -> None:
    moments = [START + timedelta(milliseconds=250 * k) for k in range(4)]
    cells = [[one.date(), one.time()] if apart else [one] for one in moments]
    rows = [[*one, k, 1] for k, one in enumerate(cells)]
    names = ["date", "time"] if apart else ["timestamp"]
    dataset = load(book(tmp_path, A=[[*names, "x", "y"], *rows]))
    np.testing.assert_array_equal(dataset["time"], [0.0, 0.25, 0.5, 0.75])
    assert dataset.attrs["time_origin"] == "2024-12-31T23:59:59.5"


def test_durations_and_several_bodies(tmp_path: Path) -> None:
    rows = [[timedelta(hours=30, seconds=k // 2), k, 1, "ab"[k % 2]] for k in range(4)]
    dataset = load(book(tmp_path, A=[["time", "x", "y", "id"], *rows]))
    np.testing.assert_array_equal(dataset["time"], [108_000.0, 108_001.0])
    np.testing.assert_array_equal(body_track(dataset, "b").x, [1.0, 3.0])


def test_bodies_read_as_one_name_the_column(tmp_path: Path) -> None:
    """Found by trying: the workbook was closed when the columns were read again."""
    rows = [[k // 2, 5 * (k % 2), k / 8, "ab"[k % 2]] for k in range(8)]
    with pytest.raises(InputError, match="the column 'Teilchen' could name the body"):
        load(book(tmp_path, A=[["t", "x", "y", "Teilchen"], *rows]))


def damaged(folder: Path) -> dict[str, bytes]:
    good = book(folder, A=ROWS).read_bytes()
    with zipfile.ZipFile(folder / "a.ods", "w") as file:
        file.writestr("content.xml", "<a/>")
    with zipfile.ZipFile(folder / "a.xlsb", "w") as file:
        file.writestr("xl/workbook.bin", b"\0")
    with zipfile.ZipFile(folder / "no_xml.xlsx", "w") as file:
        file.writestr("xl/workbook.xml", "<workbook>")
    with zipfile.ZipFile(folder / "bomb.xlsx", "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("xl/workbook.xml", bytes(300 << 20))
    return {
        "cut off": good[: len(good) // 2],
        "only its start": good[:40],
        "old": b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600),
        "open document": (folder / "a.ods").read_bytes(),
        "binary": (folder / "a.xlsb").read_bytes(),
        "no XML": (folder / "no_xml.xlsx").read_bytes(),
        "a bomb": (folder / "bomb.xlsx").read_bytes(),
        "no sheet": book(folder, A=[]).read_bytes(),
        "no rows": book(folder, A=ROWS[:1]).read_bytes(),
        "a word": book(folder, A=[*ROWS, [1, "oops", 3]]).read_bytes(),
        "truth": book(folder, A=[*ROWS, [1, True, 3]]).read_bytes(),
        "a date among numbers": book(folder, A=[*ROWS, [START, 2, 3]]).read_bytes(),
        "other names": book(folder, A=[["t", "a", "b"], *ROWS[1:]]).read_bytes(),
    }


@pytest.mark.slow
def test_damaged_files_are_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "damaged.xlsx"
    for case, content in damaged(tmp_path).items():
        path.write_bytes(content)
        begin = time.process_time()
        assert main(["info", str(path)]) == 2, case
        assert time.process_time() - begin < 10.0, case
        error = capsys.readouterr().err
        assert error.count("\n") == 1, case
        assert str(path) in error, case


def test_a_word_is_said_with_its_row_and_sheet(tmp_path: Path) -> None:
    path = book(tmp_path, A=[*ROWS, [], [1, "oops", 3]])
    with pytest.raises(InputError, match=r"line 5: 'oops' in column 'x' is not a number \(sheet"):
        load(path)


@pytest.mark.slow
def test_without_the_extra_one_line_says_what_to_install(tmp_path: Path) -> None:
    path = book(tmp_path, A=ROWS)
    program = "import sys; sys.modules['openpyxl'] = None\nfrom driftwalk.cli.main import main\n"
    done = subprocess.run(
        [sys.executable, "-c", f"{program}sys.exit(main(['info', {str(path)!r}]))"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "a workbook needs openpyxl: pip install 'driftwalk[excel]'" in done.stderr
