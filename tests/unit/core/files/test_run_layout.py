"""A run directory from someone else: nothing in it leads a write, a move or a removal out of it."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from driftwalk.core.errors import RunDirectoryError
from driftwalk.core.files.run_layout import complete_move, move_aside
from driftwalk.core.files.rundir import RunDirectory
from driftwalk.core.text_files import path_inside
from driftwalk.sweep import grid, run_sweep

SPECIFICATION = {"study": {"tank": {"diameter_m": 0.3}}, "seed": 1}
UNITS = grid(a=range(4)).units(2)
MOVED = "20110925T120000Z"


@pytest.fixture
def home(tmp_path: Path) -> Path:
    """Return a folder with files of the user's, none of which may change."""
    home = tmp_path / "home"
    (home / "folder").mkdir(parents=True)
    (home / "authorized_keys").write_text("mine")
    (home / "folder" / "authorized_keys").write_text("mine too")
    # What a run removes in its own folders.
    (home / "folder" / "specification.json").write_text("{}")
    (home / "folder" / "0.npz").write_text("mine")
    (home / "folder" / ".a.driftwalk-partial-1-ab.nc").write_text("mine")
    return home


def contents(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def unfinished(path: Path) -> Path:
    with RunDirectory(path, specification=SPECIFICATION) as run:
        run_sweep(lambda u: {"a": u.settings["a"]}, UNITS[:1], store=run.store("coarse"))
        run.write("calibration.nc", b"1")
        run.write("figures/map.svg", b"<svg/>")
    return path


def work_in(path: Path) -> None:
    with RunDirectory(path, specification=SPECIFICATION, overwrite=True) as run:
        run_sweep(lambda u: {"a": u.settings["a"]}, UNITS, store=run.store("coarse"))
        run.write("calibration.nc", b"2")
        run.write("figures/map.svg", b"<svg></svg>")
        run.finish({})


@pytest.mark.parametrize(
    "journal",
    [
        *("{home}", "../..", "../../home", ".", "", "..", "/", "..\\..\\home", f"{MOVED}/../../.."),
        *(f"{MOVED}\n/x", "previous", f"{MOVED}-", "x" * 10_000, "\x00", "\xe4"),
    ],
)
def test_a_journal_that_names_another_place_moves_nothing(
    home: Path, tmp_path: Path, journal: str
) -> None:
    received = tmp_path / "received"
    received.mkdir()
    (received / "authorized_keys").write_text("of an attacker")
    (received / ".moving").write_text(journal.format(home=home), encoding="latin-1")
    before = contents(tmp_path)
    with pytest.raises(RunDirectoryError, match=r"\.moving does not say where"):
        work_in(received)
    assert contents(tmp_path) == {**before, "received/.lock": b""}


def test_a_journal_of_a_killed_move_is_gone_on_with(tmp_path: Path) -> None:
    run = unfinished(tmp_path / "run")
    (run / ".moving").write_text(f"{MOVED}-2")
    complete_move(run)
    assert (run / "previous" / f"{MOVED}-2" / "calibration.nc").read_bytes() == b"1"
    assert sorted(path.name for path in run.iterdir()) == [".lock", "previous"]


def test_a_move_replaces_nothing(tmp_path: Path) -> None:
    run = unfinished(tmp_path / "run")
    earlier = run / "previous" / MOVED
    (earlier / "figures").mkdir(parents=True)
    (earlier / "calibration.nc").write_bytes(b"earlier")
    (run / ".moving").write_text(MOVED)
    with pytest.raises(RunDirectoryError, match="which exists; move one of them away"):
        complete_move(run)
    assert (earlier / "calibration.nc").read_bytes() == b"earlier"
    assert (run / "calibration.nc").read_bytes() == b"1"


def test_the_names_of_moves_are_those_that_a_journal_may_hold(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("driftwalk.core.files.run_layout.utc_now", lambda: "2011-09-25T12:00:00Z")
    for number in range(1, 12):
        target = move_aside(unfinished(tmp_path / "run"))
        assert target.name == (MOVED if number == 1 else f"{MOVED}-{number}")


ENTRIES = (
    *(".lock", ".run.json", ".moving", ".shards", ".shards/coarse", ".shards/coarse/{unit}"),
    *(".shards/coarse/specification.json", "calibration.nc", "manifest.json", "figures"),
    *("figures/map.svg", "previous", ".calibration.driftwalk-partial-1-ab.nc", "more", "more/a"),
)
PLACES: dict[str, Callable[[Path, Path], None]] = {
    "a file outside": lambda path, home: path.symlink_to(home / "authorized_keys"),
    "a folder outside": lambda path, home: path.symlink_to(home / "folder"),
    "a file outside, by ..": lambda path, home: path.symlink_to(
        os.path.relpath(home / "authorized_keys", path.parent)
    ),
    "nowhere": lambda path, home: path.symlink_to(home / "new"),
    "itself": lambda path, home: path.symlink_to(path.name),
    "a pipe": lambda path, home: os.mkfifo(path),
}


@pytest.mark.fast_cases(43)
@pytest.mark.skipif(os.name == "nt", reason="links need a privilege there, and pipes have no names")
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("entry", ENTRIES)
def test_an_entry_that_leads_out_is_refused_and_named(
    home: Path, tmp_path: Path, entry: str, place: str
) -> None:
    run = unfinished(tmp_path / "run")
    name = entry.format(unit=next((run / ".shards" / "coarse").glob("*.npz")).name)
    path = run / name
    if path.is_dir():
        path.rename(tmp_path / "away")
    path.unlink(missing_ok=True)
    path.parent.mkdir(exist_ok=True)
    PLACES[place](path, home)
    before = contents(tmp_path)
    with pytest.raises(RunDirectoryError) as caught:
        work_in(run)
    assert f"{path} is " in str(caught.value)
    assert contents(tmp_path) == before
    path.unlink()


@pytest.mark.skipif(os.name == "nt", reason="links need a privilege there")
def test_an_earlier_run_that_is_a_link_takes_nothing(home: Path, tmp_path: Path) -> None:
    run = unfinished(tmp_path / "run")
    (run / "previous").mkdir()
    (run / "previous" / MOVED).symlink_to(home)
    (run / ".moving").write_text(MOVED)
    before = contents(home)
    with pytest.raises(RunDirectoryError, match="is a link that leads out"):
        work_in(run)
    assert contents(home) == before


@pytest.mark.skipif(os.name == "nt", reason="links need a privilege there")
def test_a_run_directory_that_is_reached_through_a_link_is_worked_in(tmp_path: Path) -> None:
    """The user named it; a link inside that stays inside leads nowhere else either."""
    disk = tmp_path / "disk"
    unfinished(disk)
    (tmp_path / "run").symlink_to(disk)
    (disk / "calibration.nc").rename(disk / "kept.nc")
    (disk / "calibration.nc").symlink_to("kept.nc")
    work_in(tmp_path / "run")
    assert (disk / "calibration.nc").read_bytes() == b"2"
    assert (disk / "kept.nc").read_bytes() == b"1"


@pytest.mark.parametrize("name", ["../x", "/etc/passwd", "a/../../x", "no", "a\x00b", "x" * 5000])
def test_names_that_lead_out_or_nowhere(tmp_path: Path, name: str) -> None:
    (tmp_path / "x").write_text("")
    (tmp_path / "run").mkdir()
    assert path_inside(tmp_path / "run", name) is None


def test_a_name_inside(tmp_path: Path) -> None:
    (tmp_path / "a.nc").write_text("")
    assert path_inside(tmp_path, "a.nc") == (tmp_path / "a.nc").resolve()
