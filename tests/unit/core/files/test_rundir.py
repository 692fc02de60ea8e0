"""The run directory: new, unfinished, finished, in use, not usable; nothing is lost."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import driftwalk
from driftwalk.core.errors import InputError, RunDirectoryError
from driftwalk.core.files.run_layout import state_of
from driftwalk.core.files.rundir import RunDirectory
from driftwalk.core.provenance import file_sha256, manifest, read_manifest
from driftwalk.sweep import grid, run_sweep

SOURCE = str(Path(driftwalk.__file__ or "").parents[1])
SPECIFICATION = {"study": {"tank": {"diameter_m": 0.3}}, "seed": 1}
OTHER = {"study": {"tank": {"diameter_m": 0.5}}, "seed": 1}
UNITS = grid(a=range(4)).units(2)


def finish(
    path: Path, specification: dict[str, Any] = SPECIFICATION, content: bytes = b"1"
) -> None:
    with RunDirectory(path, specification=specification) as run:
        run.write("calibration.nc", content)
        run.write("figures/map.svg", b"<svg/>")
        run.finish(manifest(command="test", study={}, seeds={"calibration": 1}, inputs={}))


def leave_unfinished(path: Path, specification: dict[str, Any] = SPECIFICATION) -> None:
    with RunDirectory(path, specification=specification) as run:
        run_sweep(lambda u: {"a": u.settings["a"]}, UNITS[:1], store=run.store("coarse"))


def visible(path: Path) -> list[str]:
    files = (p.relative_to(path).as_posix() for p in path.rglob("*") if p.is_file())
    return sorted(name for name in files if name != ".lock")


def test_finished_run_holds_results_and_manifest_only(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "run"
    with RunDirectory(path, specification=SPECIFICATION) as run:
        assert run.state == "new"
        run_sweep(lambda u: {"a": u.settings["a"]}, UNITS, store=run.store("coarse"))
        with run.file("flow.nc") as temporary:
            temporary.write_bytes(b"flow")
        assert (run.folder("figures")).is_dir()
        assert state_of(path) == "unfinished"
        run.finish(manifest(command="test", study={"a_m": 1}, seeds={}, inputs={}))
    assert state_of(path) == "finished"
    assert visible(path) == ["flow.nc", "manifest.json"]
    assert not (path / ".shards").exists()
    values = read_manifest(path / "manifest.json")
    assert values["study"] == {"a_m": 1}
    assert values["specification"] == {"driftwalk_version": driftwalk.__version__, **SPECIFICATION}
    assert values["files"] == [
        {"path": "flow.nc", "sha256": file_sha256(path / "flow.nc"), "size_bytes": 4}
    ]
    assert values["started_utc"] <= values["finished_utc"]


def test_unfinished_run_continues(tmp_path: Path) -> None:
    leave_unfinished(tmp_path / "run")
    started = json.loads((tmp_path / "run" / ".run.json").read_text())["started_utc"]
    with RunDirectory(tmp_path / "run", specification=SPECIFICATION) as run:
        assert run.state == "unfinished"
        assert run.store("coarse").missing(UNITS) == UNITS[1:]
        run.finish({})
    assert read_manifest(tmp_path / "run" / "manifest.json")["started_utc"] == started


def test_unfinished_run_of_another_study_is_refused_by_key(tmp_path: Path) -> None:
    leave_unfinished(tmp_path / "run")
    before = visible(tmp_path / "run")
    with (
        pytest.raises(RunDirectoryError, match=r"study\.tank\.diameter_m; .*`overwrite=True`"),
        RunDirectory(tmp_path / "run", specification=OTHER),
    ):
        pass
    assert visible(tmp_path / "run") == before
    with RunDirectory(tmp_path / "run", specification=SPECIFICATION) as run:
        assert run.state == "unfinished"


def test_finished_run_is_refused(tmp_path: Path) -> None:
    finish(tmp_path / "run")
    before = visible(tmp_path / "run")
    with (
        pytest.raises(RunDirectoryError, match=r"holds a finished run; .*`overwrite=True`"),
        RunDirectory(tmp_path / "run", specification=SPECIFICATION),
    ):
        pass
    assert visible(tmp_path / "run") == before


def test_overwrite_moves_a_finished_run(tmp_path: Path) -> None:
    path = tmp_path / "run"
    finish(path, content=b"old")
    (path / "notes.txt").write_text("mine")
    for expected in (1, 2):
        with RunDirectory(path, specification=SPECIFICATION, overwrite=True) as run:
            assert run.state == "new"
            assert run.moved_to is not None
            run.write("calibration.nc", b"new")
            run.finish({})
        assert len(list((path / "previous").iterdir())) == expected
        assert (path / "calibration.nc").read_bytes() == b"new"
    first = sorted((path / "previous").iterdir(), key=lambda p: p.stat().st_mtime_ns)[0]
    assert visible(first) == ["calibration.nc", "figures/map.svg", "manifest.json", "notes.txt"]
    assert (first / "calibration.nc").read_bytes() == b"old"
    assert state_of(first) == "finished"
    names = [file["path"] for file in read_manifest(path / "manifest.json")["files"]]
    assert names == ["calibration.nc"]


def test_overwrite_moves_an_unfinished_run_of_another_study(tmp_path: Path) -> None:
    leave_unfinished(tmp_path / "run")
    with RunDirectory(tmp_path / "run", specification=OTHER, overwrite=True) as run:
        assert run.state == "new"
        moved = run.moved_to
    assert moved is not None
    with RunDirectory(moved, specification=SPECIFICATION) as old:
        assert old.state == "unfinished"
        assert old.store("coarse").missing(UNITS) == UNITS[1:]


def test_overwrite_repeated_after_a_kill_continues(tmp_path: Path) -> None:
    leave_unfinished(tmp_path / "run")
    with RunDirectory(tmp_path / "run", specification=SPECIFICATION, overwrite=True) as run:
        assert run.state == "unfinished"
        assert run.moved_to is None


@pytest.mark.parametrize("overwrite", [False, True])
def test_folder_with_foreign_files_is_left_alone(tmp_path: Path, overwrite: bool) -> None:
    (tmp_path / "manifest.json").write_text('{"name": "a web page"}')
    with (
        pytest.raises(RunDirectoryError, match=r"files but no run of driftwalk \(manifest\.json"),
        RunDirectory(tmp_path, specification=SPECIFICATION, overwrite=overwrite),
    ):
        pass
    assert [p.name for p in tmp_path.iterdir()] == ["manifest.json"]


def test_dot_files_are_in_nobodys_way(tmp_path: Path) -> None:
    (tmp_path / ".gitignore").write_text("*")
    finish(tmp_path)
    assert (tmp_path / ".gitignore").read_text() == "*"


def test_leftovers_of_a_killed_finish_are_removed(tmp_path: Path) -> None:
    leave_unfinished(tmp_path / "run")
    finish(tmp_path / "other")
    (tmp_path / "other" / "manifest.json").rename(tmp_path / "run" / "manifest.json")
    (tmp_path / "run" / ".manifest.driftwalk-partial-1-ab.json").write_text("{")
    with (
        pytest.raises(RunDirectoryError, match="holds a finished run"),
        RunDirectory(tmp_path / "run", specification=SPECIFICATION),
    ):
        pass
    assert visible(tmp_path / "run") == ["manifest.json"]


def test_a_figure_half_written_by_a_killed_run_is_removed(tmp_path: Path) -> None:
    """It would stay with the results for ever, and stand in the manifest."""
    leave_unfinished(tmp_path / "run")
    (tmp_path / "run" / "figures").mkdir()
    (tmp_path / "run" / "figures" / ".map.driftwalk-partial-1-ab.svg").write_text("<svg")
    finish(tmp_path / "run")
    assert [path.name for path in (tmp_path / "run" / "figures").iterdir()] == ["map.svg"]
    files = read_manifest(tmp_path / "run" / "manifest.json")["files"]
    assert [file["path"] for file in files] == ["calibration.nc", "figures/map.svg"]


def test_stores_of_one_run_are_apart(tmp_path: Path) -> None:
    with RunDirectory(tmp_path / "run", specification=SPECIFICATION) as run:
        coarse = run.store("coarse")
        run_sweep(lambda u: {"a": u.settings["a"]}, UNITS, store=coarse)
        refined = run.store("refined", fingerprint={"around": 0.5})
        assert refined.missing(UNITS) == UNITS
        with pytest.raises(RunDirectoryError, match=r"differs in sweep\.around"):
            run.store("refined", fingerprint={"around": 0.6})


def test_same_process_and_threads_are_excluded_too(tmp_path: Path) -> None:
    caught: list[BaseException] = []

    def second() -> None:
        try:
            with RunDirectory(tmp_path / "run", specification=SPECIFICATION):
                pass
        except RunDirectoryError as error:
            caught.append(error)

    with RunDirectory(tmp_path / "run", specification=SPECIFICATION) as run:
        second()
        thread = threading.Thread(target=second)
        thread.start()
        thread.join()
        run.write("a.txt", b"unharmed")
    assert [str(e) for e in caught] == [
        f"{tmp_path / 'run'} is in use by another process; wait until it is done or choose "
        "another directory"
    ] * 2
    with RunDirectory(tmp_path / "run", specification=SPECIFICATION) as run:
        assert run.state == "unfinished"


def test_nothing_is_written_outside_the_block(tmp_path: Path) -> None:
    run = RunDirectory(tmp_path / "run", specification=SPECIFICATION)
    assert not (tmp_path / "run").exists()
    with pytest.raises(RunDirectoryError, match="not open for writing"):
        run.write("a.txt", b"")
    with run:
        run.finish({})
        with pytest.raises(RunDirectoryError, match="not open for writing"):
            run.write("a.txt", b"")


@pytest.mark.parametrize(
    "name", ["../a.nc", "/a.nc", "", ".run.json", "manifest.json", "previous/a", "a//b"]
)
def test_bad_names_of_results(tmp_path: Path, name: str) -> None:
    run = RunDirectory(tmp_path / "run", specification=SPECIFICATION)
    with run, pytest.raises(InputError, match="name"):
        run.write(name, b"x")
    assert visible(tmp_path / "run") == [".run.json"]


def test_damaged_record_is_refused(tmp_path: Path) -> None:
    leave_unfinished(tmp_path / "run")
    (tmp_path / "run" / ".run.json").write_text('{"specification": 1}')
    with (
        pytest.raises(RunDirectoryError, match=r"\.run\.json is damaged; move .* away"),
        RunDirectory(tmp_path / "run", specification=SPECIFICATION),
    ):
        pass


def test_path_that_is_a_file_or_under_one(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    for path, message in (("file", "is a file"), ("file/run", "cannot make the directory")):
        with (
            pytest.raises(RunDirectoryError, match=message),
            RunDirectory(tmp_path / path, specification=SPECIFICATION),
        ):
            pass
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="needs Linux's /proc, never writable")
def test_unwritable_place_for_every_account() -> None:
    with (
        pytest.raises(RunDirectoryError, match=r"cannot make the directory /proc/driftwalk-run: "),
        RunDirectory("/proc/driftwalk-run", specification=SPECIFICATION),
    ):
        pass


def test_unwritable_directory_is_one_line(tmp_path: Path) -> None:
    """Root may write anywhere, so the check is made under an account that owns nothing."""
    tmp_path.chmod(0o755)
    (tmp_path / "locked").mkdir(mode=0o555)
    code = f"""
import os, sys
sys.path.insert(0, {SOURCE!r})
import filelock, importlib.metadata, platform
from driftwalk.core.errors import RunDirectoryError
from driftwalk.core.files.rundir import RunDirectory
if os.geteuid() == 0:
    os.setuid(65534)
for path in ("locked", "locked/run"):
    try:
        with RunDirectory(path, specification={{}}):
            pass
    except RunDirectoryError as error:
        print(error)
"""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    first, second = done.stdout.splitlines()
    assert first.startswith("cannot lock the directory locked for writing: Permission denied; ")
    assert second.startswith("cannot make the directory locked/run: Permission denied; ")
    assert os.listdir(tmp_path / "locked") == []  # noqa: PTH208


def test_arrays_in_a_specification(tmp_path: Path) -> None:
    with RunDirectory(tmp_path / "run", specification={"x": np.arange(3.0)}):
        pass
    with (
        pytest.raises(RunDirectoryError, match=r"differs in x\.sha256;"),
        RunDirectory(tmp_path / "run", specification={"x": np.array([0.0, 1.0, 3.0])}),
    ):
        pass
