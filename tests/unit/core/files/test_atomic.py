"""Files appear whole or not at all, and a storage that refuses is one clear sentence."""

from __future__ import annotations

import errno
import subprocess
import sys
from pathlib import Path

import pytest

from driftwalk.core.errors import RunDirectoryError
from driftwalk.core.files import atomic
from driftwalk.core.files.atomic import (
    PARTIAL,
    atomic_path,
    remove_partials,
    storage_error,
    write_atomic,
)

SOURCE = str(Path(sys.modules["driftwalk.core.files.atomic"].__file__ or "").parents[2])


def test_write_makes_and_replaces(tmp_path: Path) -> None:
    path = tmp_path / "seed.txt"
    write_atomic(path, b"one")
    write_atomic(path, memoryview(b"two"))
    assert path.read_bytes() == b"two"
    assert list(tmp_path.iterdir()) == [path]


def test_old_content_is_never_written_into(tmp_path: Path) -> None:
    """Another name of the old file shows whether a write touched it, however briefly."""
    path, witness = tmp_path / "seed.txt", tmp_path / "witness"
    path.write_bytes(b"one")
    witness.hardlink_to(path)
    write_atomic(path, b"two")
    assert witness.read_bytes() == b"one"


def test_temporary_has_the_suffix_and_the_folder(tmp_path: Path) -> None:
    with atomic_path(tmp_path / "flow.nc") as temporary:
        assert temporary.parent == tmp_path
        assert temporary.suffix == ".nc"
        assert not (tmp_path / "flow.nc").exists()
        temporary.write_bytes(b"x")
    assert (tmp_path / "flow.nc").read_bytes() == b"x"


@pytest.mark.parametrize("error", [ValueError("fault"), KeyboardInterrupt()])
def test_error_keeps_the_old_content(tmp_path: Path, error: BaseException) -> None:
    path = tmp_path / "flow.nc"
    path.write_bytes(b"old")

    def write_half() -> None:
        with atomic_path(path) as temporary:
            temporary.write_bytes(b"half")
            raise error

    with pytest.raises(type(error)):
        write_half()
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_unrelated_os_error_passes_unchanged(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="elsewhere"), atomic_path(tmp_path / "a"):
        Path("/no/such/elsewhere").read_bytes()


def test_full_device_is_named() -> None:
    """/dev/full answers every write with ENOSPC."""
    with (
        pytest.raises(OSError, match="No space") as caught,
        Path("/dev/full").open("wb", 0) as full,
    ):
        full.write(b"x")
    refusal = storage_error(caught.value, "run/flow.nc")
    assert isinstance(refusal, RunDirectoryError)
    assert str(refusal).startswith("cannot write run/flow.nc: the disk is full; ")
    assert "run the same command again" in str(refusal)


def test_full_disk_reported_by_hdf5_is_understood() -> None:
    error = RuntimeError(
        "Can't decrement id ref count (unable to extend file properly, errno = 28, "
        "error message = 'No space left on device')"
    )
    assert "the disk is full" in str(storage_error(error, "flow.nc"))
    assert storage_error(RuntimeError("fault"), "flow.nc") is None


def test_file_size_limit_keeps_the_old_content(tmp_path: Path) -> None:
    """A limit of the system on file sizes ends the write in the middle, as a full disk does."""
    path = tmp_path / "flow.nc"
    path.write_bytes(b"old")
    code = f"""
import resource, signal, sys
sys.path.insert(0, {SOURCE!r})
from driftwalk.core.files.atomic import write_atomic
from driftwalk.core.errors import RunDirectoryError
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (4096, resource.RLIM_INFINITY))
try:
    write_atomic({str(path)!r}, bytes(100_000))
except RunDirectoryError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.startswith(f"cannot write {path}: files of this size are not allowed here;")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("no/such/folder/a.nc", "its folder does not exist"),
        ("file/a.nc", "a part of its path is a file"),
        ("folder", "it exists and is not a regular file"),
        ("x" * 300, "its name is too long"),
    ],
)
def test_impossible_places(tmp_path: Path, name: str, reason: str) -> None:
    (tmp_path / "file").write_bytes(b"")
    (tmp_path / "folder").mkdir()
    with pytest.raises(RunDirectoryError, match=reason):
        write_atomic(tmp_path / name, b"x")


def test_device_is_not_replaced() -> None:
    with pytest.raises(RunDirectoryError, match="not a regular file"):
        write_atomic("/dev/null", b"x")
    assert Path("/dev/null").is_char_device()


def test_remove_partials_removes_nothing_else(tmp_path: Path) -> None:
    kept = [tmp_path / ".hidden", tmp_path / "flow.nc", tmp_path / f"a{PARTIAL}b"]
    for path in [*kept, tmp_path / f".flow{PARTIAL}123-ab.nc"]:
        path.write_bytes(b"x")
    remove_partials(tmp_path)
    assert sorted(tmp_path.iterdir()) == sorted(kept)


# What Windows does to a file that another program has open, which no Linux does.
def hold_open(monkeypatch: pytest.MonkeyPatch, refusals: int) -> None:
    """Let renames be refused so many times, as Windows does while somebody reads the target."""
    left = iter(range(refusals))
    real = Path.replace

    def replace(path: Path, target: Path) -> Path:
        if next(left, None) is not None:
            raise PermissionError(errno.EACCES, "Access is denied", str(path))
        return real(path, target)

    monkeypatch.setattr(Path, "replace", replace)
    monkeypatch.setattr(atomic, "OPEN_FILES_STAY", True)
    monkeypatch.setattr(atomic, "PAUSES_S", (0.001,) * 3)


def test_a_file_that_is_read_meanwhile_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "seed.txt").write_bytes(b"one")
    hold_open(monkeypatch, 3)
    write_atomic(tmp_path / "seed.txt", b"two")
    assert (tmp_path / "seed.txt").read_bytes() == b"two"


def test_a_file_that_stays_open_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "seed.txt"
    path.write_bytes(b"one")
    hold_open(monkeypatch, 4)
    with pytest.raises(RunDirectoryError, match=r"seed\.txt: another program has it open"):
        write_atomic(path, b"two")
    assert path.read_bytes() == b"one"
    assert list(tmp_path.iterdir()) == [path]
