"""Several bodies that would be read as one: refused, with the columns that could name them."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from driftwalk.core.errors import InputError
from driftwalk.record import load, text
from driftwalk.record.cleaning.clean import clean_body
from driftwalk.record.column_names import column_meaning
from driftwalk.record.raw import RawBody
from driftwalk.schema import body_names, body_track


def write(folder: Path, header: str, rows: Sequence[Sequence[object]]) -> Path:
    path = folder / "synthetic.csv"
    path.write_text("\n".join([header, *(",".join(map(str, row)) for row in rows), ""]))
    return path


def circles(count: int, names: Sequence[object]) -> list[tuple[float, float, float, object]]:
    """Return (t, x, y, name) of bodies that circle side by side, moment by moment."""
    return [
        (t / 10, round(place + 0.1 * np.cos(t / 9), 5), round(0.1 * np.sin(t / 9), 5), name)
        for t in range(count)
        for place, name in enumerate(names)
    ]


@pytest.mark.parametrize("names", [[0, 1, 2], ["3.0", "4.0", "5.0"], ["left", "mid", "right"]])
@pytest.mark.parametrize("column", ["label", "Besitzer", "object"])
def test_the_error_names_the_column_that_tells_bodies_apart(
    column: str, names: list[object], tmp_path: Path
) -> None:
    random = np.random.default_rng(1)
    rows = [
        (*row[:3], round(random.uniform(), 3), index % 2, 7, row[3])
        for index, row in enumerate(circles(200, names))
    ]
    path = write(tmp_path, f"t,x,y,quality,lamp,camera,{column}", rows)
    with pytest.raises(InputError, match=r"body '0' is in several places at 200 of 200") as caught:
        load(path)
    assert str(caught.value).endswith(
        f'the column \'{column}\' could name the body: add `columns={{"body": "{column}"}}`'
    )
    named = load(path, columns={"body": column})
    assert body_names(named) == [str(name) for name in names]
    assert json.loads(named.attrs["counts"])["duplicates_dropped"] == 0


@pytest.mark.parametrize(
    "name",
    [
        *("particle", "Particle", "agent_id", "agent", "fish", "mouse", "subject", "object_id"),
        *("objectID", "cell id", "marker_id", "tag_id", "uid", "particle id", "tracklet"),
    ],
)
def test_known_names_of_the_body(name: str, tmp_path: Path) -> None:
    path = write(tmp_path, f"t,x,y,{name}", circles(9, "ab"))
    assert body_names(load(path)) == ["a", "b"]


@pytest.mark.parametrize("name", ["object", "cell", "marker", "tag", "label", "class", "target"])
def test_a_name_that_may_be_a_state_does_not_split_a_body(name: str, tmp_path: Path) -> None:
    rows = [
        (*row[:3], "moving" if index % 3 else "resting")
        for index, row in enumerate(circles(30, "a"))
    ]
    dataset = load(write(tmp_path, f"t,x,y,{name}", rows))
    assert body_names(dataset) == ["0"]
    assert dataset.sizes["time"] == 30


@pytest.mark.parametrize(
    ("name", "quantity", "body"),
    [
        ("x_fish", "x", "fish"),
        ("fish_x", "x", "fish"),
        ("y_robot", "y", "robot"),
        ("particle1 x", "x", "particle1"),
        ("theta_agent", "theta", "agent"),
    ],
)
def test_a_body_beside_a_coordinate(name: str, quantity: str, body: str) -> None:
    meaning = column_meaning(name)
    assert meaning is not None
    assert (meaning.quantity, meaning.body) == (quantity, body)


@pytest.mark.parametrize("name", ["x_velocity", "y_err", "x_min", "speed_x", "x score", "acc_y"])
def test_what_is_no_position_is_no_body(name: str) -> None:
    assert column_meaning(name) is None


def test_frames_that_begin_anew_for_each_body(tmp_path: Path) -> None:
    """Sorting would take all for one body."""
    rows = sorted(circles(50, "ab"), key=lambda row: str(row[3]))
    path = write(tmp_path, "t,x,y,who", rows)
    with pytest.raises(
        InputError, match=r"row 51 .*'who' could name the body: .*\"who\"}`, or `sort"
    ):
        load(path)
    with pytest.raises(InputError, match=r"at 50 of 50 times.*'who' could name the body"):
        load(path, sort="sort")
    assert body_names(load(path, columns={"body": "who"})) == ["a", "b"]


def test_without_such_a_column_the_error_says_what_to_do(tmp_path: Path) -> None:
    path = write(tmp_path, "t,x,y", [row[:3] for row in circles(50, "ab")])
    with pytest.raises(InputError, match=r"\"body\": \"NAME\".*\"frame\": \"NAME\".*`frame_rate`"):
        load(path)


def test_a_column_that_begins_to_tell_apart_beyond_the_first_block(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(text, "TEXT", text.TEXT._replace(block_bytes=512))
    rows = sorted(circles(100, "ab"), key=lambda row: str(row[3]))
    path = write(tmp_path, "t,x,y,who", rows)
    with pytest.raises(InputError, match="'who' could name the body"):
        load(path, sort="sort")


def test_no_more_than_a_few_columns_are_named(tmp_path: Path) -> None:
    rows = [(*row, row[3], row[3], row[3], row[3]) for row in circles(50, "ab")]
    with pytest.raises(InputError) as caught:
        load(write(tmp_path, "t,x,y,k,l,m,n,o", rows))
    assert "the column 'k' or 'l' or 'm' could" in str(caught.value)


@pytest.mark.parametrize(("slips", "refused"), [(1, False), (2, False), (3, True)])
def test_one_time_in_a_hundred_may_hold_two_places(
    slips: int, refused: bool, tmp_path: Path
) -> None:
    rows = [row[:3] for row in circles(200, "a")]
    for at in range(slips):
        rows.insert(50 * at + 1, (rows[50 * at][0], 9.0, 9.0))
        rows[50 * at], rows[50 * at + 1] = rows[50 * at + 1], rows[50 * at]
    path = write(tmp_path, "t,x,y", rows)
    if refused:
        with pytest.raises(InputError, match=f"at {slips} of 200 times"):
            load(path)
        return
    dataset = load(path)
    counts = json.loads(dataset.attrs["counts"])
    assert counts["times_in_two_places"] == counts["duplicates_dropped"] == slips
    said = f"times with rows in different places, of which the last is kept: {slips}"
    assert said in counts["warnings"]
    assert float(abs(dataset["x"]).max()) < 1.0


def test_the_same_row_twice_and_rows_without_a_position_are_no_second_place(tmp_path: Path) -> None:
    rows = [row[:3] for row in circles(50, "a") for _ in range(2)]
    rows += [(9.0, "", ""), (9.0, 1.0, 1.0)]
    counts = json.loads(load(write(tmp_path, "t,x,y", rows)).attrs["counts"])
    assert counts["duplicates_dropped"] == 51
    assert counts["times_in_two_places"] == 0
    assert counts["warnings"] == []


def test_places_within_the_resolution_are_one() -> None:
    clock = np.repeat(np.arange(50.0), 2)
    x = np.tile([0.001, 0.002], 50)
    _, counts = clean_body(RawBody("0", clock, x, 0 * x), quantum=0.001)
    assert counts.times_in_two_places == 0
    with pytest.raises(InputError, match="at 50 of 50"):
        clean_body(RawBody("0", clock, 2 * x, 0 * x), quantum=0.001)


def test_the_window_leaves_out_what_lies_outside(tmp_path: Path) -> None:
    rows = [row[:3] for row in (*circles(40, "a"), *circles(80, "ab")[80:])]
    path = write(tmp_path, "t,x,y", rows)
    with pytest.raises(InputError, match="several places"):
        load(path)
    assert load(path, stop=3.9).sizes["time"] == 40


def test_a_number_of_the_row_is_no_body(tmp_path: Path) -> None:
    rows = [(index, *row[:3]) for index, row in enumerate(circles(30, "a"))]
    dataset = load(write(tmp_path, "id,t,x,y", rows))
    assert body_names(dataset) == ["0"]
    warnings = json.loads(dataset.attrs["counts"])["warnings"]
    assert "column 'id' numbers the rows: one body" in warnings
    several = [(index, *row) for index, row in enumerate(circles(30, "ab"))]
    with pytest.raises(InputError, match="'who' could name the body"):
        load(write(tmp_path, "id,t,x,y,who", several))


def test_one_moment_of_many_bodies_keeps_them(tmp_path: Path) -> None:
    dataset = load(write(tmp_path, "id,t,x,y", [(n, 0.0, n / 10, 0.0) for n in range(5)]))
    assert body_names(dataset) == ["0", "1", "2", "3", "4"]


def test_rows_that_count_as_frames_are_said(tmp_path: Path) -> None:
    dataset = load(write(tmp_path, "x_mm,y_mm", [(n, 2 * n) for n in range(30)]), frame_rate=10.0)
    assert "every row counts as a frame" in json.loads(dataset.attrs["counts"])["warnings"][0]


def trackpy_like(folder: Path, column: str = "particle") -> Path:
    """Write a table with the columns of trackpy: some measurements repeat, as in a still scene."""
    random = np.random.default_rng(3)
    rows = []
    for frame in range(5):
        for particle in range(17):
            mass, size = 100 + 3 * particle, 2.5 + 0.01 * particle
            x, y = random.normal(40.0 * particle, 1.0), random.normal(30.0 * particle, 1.0)
            rows.append((y, x, mass, size, 0.1, 7.0, 10 * mass, 0.2, frame, particle))
    return write(folder, f"y,x,mass,size,ecc,signal,raw_mass,ep,frame,{column}", rows)


PIXELS = {"frame_rate": 10.0, "metres_per_pixel": 1e-3}


def test_a_table_like_that_of_trackpy(tmp_path: Path) -> None:
    dataset = load(trackpy_like(tmp_path), **PIXELS)
    assert dataset.sizes == {"time": 5, "body": 17}
    assert not np.isnan(dataset["x"].values).any()
    path = trackpy_like(tmp_path, "Teilchen")
    with pytest.raises(InputError, match=r"'Teilchen'"):
        load(path, **PIXELS)


def test_the_table_of_trackpy_itself(shared_data: Callable[[str], Path], tmp_path: Path) -> None:
    path = shared_data("formats-2") / "trackpy_tracks.csv"
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    dataset = load(path, **PIXELS)
    assert len(body_names(dataset)) == len({row["particle"] for row in rows}) == 17
    assert int(np.isfinite(dataset["x"].values).sum()) == len(rows) == 56
    first = [row for row in rows if row["particle"] == "8"]
    np.testing.assert_allclose(
        body_track(dataset, "8").x, [float(row["x"]) / 1000 for row in first], rtol=1e-12
    )
    renamed = tmp_path / "renamed.csv"
    renamed.write_text(path.read_text().replace("particle", "Teilchen"))
    with pytest.raises(InputError, match=r"at 5 of 5 times.*'Teilchen'.*\"body\": \"Teilchen\""):
        load(renamed, **PIXELS)
