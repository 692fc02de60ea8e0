"""The names of the columns are found below titles and above units, in workbooks and in text."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pytest

from driftwalk.core.errors import InputError
from driftwalk.record import load
from driftwalk.schema import body_names, body_track

Rows = list[list[Any]]
DATA: Rows = [[0, 100, 200], [40, 150, 225], [80, 160, 230]]
# As Tracker and Kinovea write them: what is tracked, the quantities, their units.
HEADS: dict[str, Rows] = {
    "title, names, units": [["mass A"], ["t", "x", "y"], ["[ms]", "[cm]", "[cm]"]],
    "names, units": [["t", "x", "y"], ["(ms)", "(cm)", "(cm)"]],
    "names, units, names with units": [
        ["t", "x", "y"], ["[ms]", "[cm]", "[cm]"], ["t [ms]", "x [cm]", "y [cm]"],
    ],
    "titles of columns, names with units": [
        ["Time", "Position", "Position"], ["t (ms)", "x (cm)", "y (cm)"],
    ],
    "two titles, a blank line, names with units": [
        ["Kinovea"], ["export of 2024"], [], ["time_ms", "x_cm", "y_cm"],
    ],
}  # fmt: skip


def workbook(path: Path, rows: Rows) -> Path:
    book = openpyxl.Workbook()
    for row in rows:
        book.active.append(row)
    book.save(path)
    return path


def text(path: Path, rows: Rows, delimiter: str = ",") -> Path:
    lines = [delimiter.join(map(str, row)) + "\n" for row in rows]
    path.write_text("".join(lines), encoding="utf-8")
    return path


def check(path: Path, **how: Any) -> None:
    track = body_track(load(path, **how))
    np.testing.assert_allclose(track.time, [0.0, 0.04, 0.08])
    np.testing.assert_allclose(track.x, [1.0, 1.5, 1.6])
    np.testing.assert_allclose(track.y, [2.0, 2.25, 2.3])


@pytest.mark.parametrize("head", HEADS)
def test_the_header_of_a_workbook_is_found(tmp_path: Path, head: str) -> None:
    check(workbook(tmp_path / "tracker.xlsx", [*HEADS[head], *DATA]))


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
@pytest.mark.parametrize("head", HEADS)
def test_the_header_of_a_text_is_found(tmp_path: Path, head: str, delimiter: str) -> None:
    check(text(tmp_path / "tracker.csv", [*HEADS[head], *DATA], delimiter))


def test_columns_that_are_named_by_hand_are_found_in_any_row(tmp_path: Path) -> None:
    rows: Rows = [["Messung 7"], ["Zeit", "rechts", "hoch"], ["[ms]", "[cm]", "[cm]"], *DATA]
    columns = {"t": "Zeit [ms]", "x": "rechts [cm]", "y": "hoch [cm]"}
    check(workbook(tmp_path / "a.xlsx", rows), columns=columns)
    check(text(tmp_path / "a.csv", rows), columns=columns)
    numbers = {"t": 1, "x": 2, "y": 3}
    check(workbook(tmp_path / "a.xlsx", rows), columns=numbers)


def test_a_header_that_cannot_be_found_is_asked_for_by_its_line(tmp_path: Path) -> None:
    rows: Rows = [["trial"], ["[who]", "[where]", "[why]"], ["Zeit", "rechts", "hoch"], *DATA]
    for path in (workbook(tmp_path / "b.xlsx", rows), text(tmp_path / "b.csv", rows)):
        with pytest.raises(InputError, match=r"line 4 is the first of numbers.*`header_line=3`"):
            load(path)
        columns = {"t": "Zeit:ms", "x": "rechts:cm", "y": "hoch:cm"}
        check(path, header_line=3, columns=columns)


def test_a_row_of_units_that_is_not_one_is_asked_for_by_its_line(tmp_path: Path) -> None:
    rows: Rows = [["t", "x", "y"], ["[ms]", "[cm]", "[furlong]"], ["t_ms", "x_cm", "y"], *DATA]
    for path in (workbook(tmp_path / "c.xlsx", rows), text(tmp_path / "c.csv", rows)):
        with pytest.raises(InputError, match="`header_line=3`"):
            load(path)


def test_a_table_of_named_bodies_has_its_header_in_its_first_row(tmp_path: Path) -> None:
    rows: Rows = [["id", "t", "x", "y"], ["a", 0, 1, 2], ["b", 0, "", ""], ["a", 1, 3, 4]]
    for path in (workbook(tmp_path / "d.xlsx", rows), text(tmp_path / "d.csv", rows)):
        recording = load(path)
        assert body_names(recording) == ["a", "b"]
        np.testing.assert_array_equal(body_track(recording, "a").x, [1.0, 3.0])


def test_the_first_rows_may_be_without_a_position(tmp_path: Path) -> None:
    rows: Rows = [["t", "x", "y"], [0, "", ""], [1, 2, 3], [2, 4, 5]]
    for path in (workbook(tmp_path / "e.xlsx", rows), text(tmp_path / "e.csv", rows)):
        recording = load(path)
        assert recording.sizes["time"] == 3
        np.testing.assert_array_equal(body_track(recording).x, [2.0, 4.0])
