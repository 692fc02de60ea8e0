"""A run directory from someone else: what lies in it is data, for every command that takes one.

Nothing is read or written through a link that leads out of it, no command waits for a pipe, none
calls what the files name, and a file that is not the one of the manifest is named.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from command_line import FLOW, RECORDING, here, refusal
from every_kind import every_kind
from finished_run import StoredWork, write_finished_run

from driftwalk.model import Study, apply_overrides
from driftwalk.runs import run_work
from driftwalk.schema.stores.netcdf import netcdf_bytes, open_netcdf
from driftwalk.viewer import RunSource

pytestmark = [
    pytest.mark.skipif(os.name == "nt", reason="links need a privilege there"),
    pytest.mark.usefixtures("no_figures"),
]
LONGEST_S = 60
LITTLE = ("--blocks", "2", "--duration", "1s", "--threads", "1")
FLOW_ALONE = ("--flow", FLOW, "--tank", "30cm")


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_finished_run(tmp_path_factory.mktemp("sent") / "run")


@pytest.fixture
def received(finished: Path, tmp_path: Path) -> Path:
    """Return a copy of the run, beside a folder that is the user's own."""
    (tmp_path / "home").mkdir()
    return Path(shutil.copytree(finished, tmp_path / "received"))


@pytest.fixture(autouse=True)
def in_time() -> Iterator[None]:
    """End a test that waits, such as for what someone writes into a pipe."""

    def give_up(*_: object) -> None:
        raise TimeoutError("the command does not come to its end")

    before = signal.signal(signal.SIGALRM, give_up)
    signal.alarm(LONGEST_S)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def outside(path: Path) -> Path:
    """Move an entry of the run into the user's folder: what leads there finds it whole."""
    home = path.parents[path.parts[::-1].index("received")] / "home"
    return path.rename(home / path.name)


def linked(path: Path) -> None:
    path.symlink_to(outside(path))


def linked_upwards(path: Path) -> None:
    path.symlink_to(os.path.relpath(outside(path), path.parent))


def linked_to_a_folder(path: Path) -> None:
    path.symlink_to(outside(path).parent)


def dangling(path: Path) -> None:
    path.unlink()
    path.symlink_to(path.parent / "nothing")


def in_a_ring(path: Path) -> None:
    path.unlink()
    path.symlink_to(path.name)


def a_pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def cut_short(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-7])


LEADING_OUT = (linked, linked_upwards, linked_to_a_folder, dangling, in_a_ring, a_pipe)
RESULTS = ("calibration.nc", "flow.nc", "recording.nc")
ALL = ("manifest.json", *RESULTS, "figures/map.png")
BLOCK = ("manifest.json", "calibration.nc", "flow.nc")
Words = tuple[object, ...]
# The commands that read a run, and the files that each of them reads.
READING: dict[str, tuple[tuple[str, ...], Callable[[Path, Path], Words]]] = {
    # What it reads of the others is below, where its page is looked at too.
    "report": (("manifest.json",), lambda run, out: ("report", run, "-o", out / "page.html")),
    "cite": (ALL, lambda run, out: ("cite", run)),
    "info": (("manifest.json",), lambda run, out: ("info", run)),
    "export to csv": (
        ("manifest.json", "recording.nc"),
        lambda run, out: ("export", run, "--to", "csv", "-o", out / "made"),
    ),
    "export to mujoco": (
        BLOCK, lambda run, out: ("export", run, "--to", "mujoco", "-o", out / "made")
    ),
    "export to svg": (
        ("manifest.json", *RESULTS),
        lambda run, out: ("export", run, "--to", "svg", "-o", out / "made"),
    ),
    "assemble": (BLOCK, lambda run, out: ("assemble", run, *LITTLE, "-o", out / "made")),
    "sensitivity": (BLOCK, lambda run, out: ("sensitivity", run, *LITTLE, "-o", out / "made")),
    "simulate": (
        ("manifest.json", "calibration.nc"),
        lambda run, out: (
            *("simulate", run, "--model", "active"),
            *("--duration", "1s", "-o", out / "made.nc"),
        ),
    ),
    "play": (
        ("manifest.json", "calibration.nc"),
        lambda run, out: ("play", run, "--model", "active", "--no-open"),
    ),
    "view": (("manifest.json",), lambda run, out: ("view", run, "--no-open")),
}  # fmt: skip


# Every file that a command reads, with two of the six attacks in turn: each command and each file
# meets most of them, and all are one question to the file.
READ_FILES = [(one, name) for one, (names, _) in READING.items() for name in names]
ATTACKS_IN_TURN = [
    (*read, LEADING_OUT[(place + more) % len(LEADING_OUT)])
    for place, read in enumerate(READ_FILES)
    for more in (0, 3)
]


@pytest.mark.fast_cases(6)
@pytest.mark.parametrize(("command", "name", "attack"), ATTACKS_IN_TURN)
def test_what_leads_out_is_not_read_and_is_named(
    received: Path, tmp_path: Path, command: str, name: str, attack: Callable[[Path], None]
) -> None:
    attack(received / name)
    done = here(*READING[command][1](received, tmp_path))
    assert done.code in (0, 2), done
    assert name in done.err, done
    assert "leads out of the run directory" in done.err or "no regular file" in done.err, done
    if done.code == 2:
        refusal(done)
        assert {path.name for path in tmp_path.iterdir()} == {"home", "received"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "attack"),
    [
        *(("flow.nc", linked), ("flow.nc", cut_short), ("calibration.nc", linked_upwards)),
        *(("recording.nc", a_pipe), ("recording.nc", Path.unlink), ("figures/map.png", dangling)),
    ],
)
def test_the_page_and_the_terminal_name_what_is_not_shown(
    received: Path, tmp_path: Path, name: str, attack: Callable[[Path], None]
) -> None:
    attack(received / name)
    done = here(*READING["report"][1](received, tmp_path))
    assert done.code == 0, done
    told: list[str] = []
    page = RunSource(received, tell=told.append).greeting()[0]["page"]
    shown = next(part for part in page["sections"] if part["kind"] == "warnings")
    assert shown["items"][: len(told)] == told
    assert [text for text in told if text.startswith(f"{name} ")] == told
    *warnings, last = done.err.splitlines()
    assert warnings == [f"driftwalk: warning: {text}" for text in told]
    assert last.startswith("next: ")
    assert len(told) == 1


@pytest.mark.slow
@pytest.mark.parametrize(
    "command", ["report", "cite", "export to csv", pytest.param("assemble", marks=pytest.mark.slow)]
)
def test_a_file_that_the_run_did_not_write_is_named(
    received: Path, tmp_path: Path, command: str
) -> None:
    """It reads as well as the one in whose place it is."""
    name = "recording.nc" if command == "export to csv" else "calibration.nc"
    other = open_netcdf(received / name).assign_attrs(note="changed")
    (received / name).write_bytes(netcdf_bytes(other))
    done = here(*READING[command][1](received, tmp_path))
    assert done.code == 0, done
    assert f"{name} was changed after the run wrote it" in done.err


@pytest.mark.slow
def test_a_whole_run_has_nothing_said_against_it(received: Path, tmp_path: Path) -> None:
    for command in ("report", "cite", "export to csv"):
        done = here(*READING[command][1](received, tmp_path))
        assert done.code == 0, done
        assert "manifest" not in done.err


@pytest.mark.slow
@pytest.mark.parametrize("name", ["/etc/hostname", "../home/secret", "../home/pipe", "a\n\x1b[2Jb"])
def test_names_in_the_manifest_lead_nowhere(received: Path, tmp_path: Path, name: str) -> None:
    (tmp_path / "home" / "secret").write_text("mine")
    os.mkfifo(tmp_path / "home" / "pipe")
    manifest = json.loads((received / "manifest.json").read_text())
    manifest["files"] += [{"path": name, "sha256": "0" * 64, "size_bytes": 4}, 3, {}, {"path": 1}]
    (received / "manifest.json").write_text(json.dumps(manifest))
    done = here("report", received, "-o", tmp_path / "page.html")
    assert done.code == 0, done
    assert "leads out of the run directory" in done.err or "is missing" in done.err
    assert "\x1b" not in done.err


@pytest.mark.slow
def test_a_file_that_was_put_there_is_named(received: Path, tmp_path: Path) -> None:
    shutil.copy(received / "recording.nc", received / "recording-2.nc")
    done = here("report", received, "-o", tmp_path / "page.html")
    assert done.code == 0, done
    assert "recording-2.nc is not in the manifest: it was put there" in done.err


WRITING: dict[str, Words] = {
    "assemble": ("assemble", *FLOW_ALONE, *LITTLE, "--runs", "2", "--film", "none"),
    "calibrate": ("calibrate", RECORDING, "--to", "60s"),
    "fit": ("fit", RECORDING, "--to", "60s"),
    "sensitivity": ("sensitivity", *FLOW_ALONE, *LITTLE),
    "compare-models": ("compare-models", RECORDING, "--to", "60s"),
}


@pytest.mark.parametrize("command", WRITING)
@pytest.mark.parametrize("journal", ["{home}", "../../home"])
def test_a_journal_replaces_no_file_of_the_user(
    received: Path, tmp_path: Path, command: str, journal: str
) -> None:
    (tmp_path / "home" / "authorized_keys").write_text("mine")
    (received / "authorized_keys").write_text("of an attacker")
    (received / ".moving").write_text(journal.format(home=tmp_path / "home"))
    said = refusal(here(*WRITING[command], "-o", received))
    assert ".moving does not say where" in said
    assert (tmp_path / "home" / "authorized_keys").read_text() == "mine"


OWN_FILES = (*ALL, ".lock", ".run.json", ".moving", ".shards")


@pytest.mark.fast_cases(6)
@pytest.mark.parametrize(
    ("name", "attack"),
    [
        (name, LEADING_OUT[(place + more) % len(LEADING_OUT)])
        for place, name in enumerate(OWN_FILES)
        for more in (0, 3)
    ],
)
def test_nothing_is_written_where_something_leads_out(
    received: Path, tmp_path: Path, name: str, attack: Callable[[Path], None]
) -> None:
    (received / name).touch()
    attack(received / name)
    before = sorted((path, path.lstat().st_mtime_ns) for path in tmp_path.rglob("*"))
    said = refusal(here(*WRITING["assemble"], "-o", received, "--overwrite"))
    assert name in said
    assert sorted((path, path.lstat().st_mtime_ns) for path in tmp_path.rglob("*")) == before


@pytest.mark.parametrize("command", ["demo", "assemble"])
def test_links_in_a_folder_of_the_user_are_none_of_its_business(
    tmp_path: Path, command: str
) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "link").symlink_to(tmp_path)
    words = () if command == "demo" else FLOW_ALONE
    assert "holds files but no run" in refusal(here(command, *words, "-o", tmp_path / "mine"))


def test_control_characters_of_a_manifest_do_not_reach_the_terminal(received: Path) -> None:
    path = received / "manifest.json"
    manifest = json.loads(path.read_text(encoding="utf-8"))
    manifest["inputs"] = {"\x1b[31mrole": {"path": "a\x1b]0;b\x07.csv", "sha256": "\u202e"}}
    path.write_text(json.dumps(manifest), encoding="utf-8")
    done = here("cite", received)
    assert done.code == 0, done.err
    assert "\\x1b[31mrole a\\x1b]0;b\\x07.csv" in done.out
    assert not any(one in done.out + done.err for one in "\x1b\x07\u202e")


def test_a_demo_in_a_folder_that_leads_out_is_refused(tmp_path: Path) -> None:
    (tmp_path / "home").mkdir()
    (tmp_path / "demo").mkdir()
    (tmp_path / "demo" / "fit").symlink_to(tmp_path / "home")
    assert "leads out of the run directory" in refusal(here("demo", "-o", tmp_path / "demo"))
    assert not list((tmp_path / "home").iterdir())


# What the file of a model, the name of a program and the command of the manifest would do.
TRAP = """
from pathlib import Path
Path({marker!r}).touch()


def robot(scene, *, speed=(0.01, 0.1, "m/s"), tumble_rate=(0.1, 4.0, "1/s")):
    Path({marker!r}).touch()
    return (scene.start.x[:, None] + 0 * scene.times,) * 2
"""
NAMES = ("mine.py:robot", "{run}/mine.py:robot", "command:touch {marker}", "command:{run}/program")
ALSO: dict[str, Callable[[Path, Path], Words]] = {
    "simulate of the block": lambda run, out: ("simulate", run, "-o", out / "made.nc"),
    "play of the block": lambda run, out: ("play", run, "--no-open"),
    "compare": lambda run, out: (
        *("compare", run / "recording.nc", run / "recording.nc", "--permutations", "0"),
    ),
    "compare the run": lambda run, out: ("compare", run, RECORDING),
    "compare-models": lambda run, out: (
        *("compare-models", run / "recording.nc", "--models", "no-such", "-o", out / "made"),
    ),
    "classify": lambda run, out: ("classify", run),
    "calibrate on it": lambda run, out: ("calibrate", run, "-o", out / "made"),
    "fit of it": lambda run, out: ("fit", run, "-o", out / "made"),
    "models": lambda run, out: ("models",),
    "go on without the model": lambda run, out: (
        *("calibrate", run / "recording.nc", "-o", run, "--bootstrap", "0"),
    ),
    "start again without the model": lambda run, out: (
        *("assemble", *FLOW_ALONE, *LITTLE, "--runs", "2", "--film", "none"),
        *("-o", run, "--overwrite"),
    ),
}
"""The rest of the commands that may be given a run, or a file of one; some refuse it."""


def set_traps(run: Path, marker: Path, state: str) -> None:
    """Make the run one of a model that nobody but its files names, in every way of naming it."""
    names = [name.format(run=run, marker=marker) for name in NAMES]
    (run / "mine.py").write_text(TRAP.format(marker=str(marker)))
    (run / "program").write_text(f"#!/bin/sh\ntouch {marker}\n")
    (run / "program").chmod(0o755)
    found = open_netcdf(run / "calibration.nc")
    named = {"model": names[0], "model_made_by": names[1], "made_by": names[2]}
    (run / "calibration.nc").write_bytes(netcdf_bytes(found.assign_attrs(named)))
    manifest = json.loads((run / "manifest.json").read_text())
    manifest["command"] = f"touch {marker}"
    manifest["specification"] |= {"kind": "calibration", "model": {**named, "name": names[2]}}
    manifest["specification"] |= {"models": [{"name": name} for name in names], "program": names}
    (run / "manifest.json").write_text(json.dumps(manifest))
    if state == "unfinished":
        record = {key: manifest[key] for key in ("fingerprint", "specification")}
        (run / ".run.json").write_text(json.dumps(record))
        (run / "manifest.json").unlink()


LONG = ("report", "compare", "compare-models", "start again without the model", "view")
CALLS = [
    *(("finished", command) for command in (*READING, *ALSO)),
    *(("unfinished", command) for command in ("report", "view", "simulate", "assemble", "cite")),
    *(("unfinished", command) for command in ("go on without the model",)),
]


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(
    ("state", "command"),
    [pytest.param(*one, marks=pytest.mark.slow if one[1] in LONG else ()) for one in CALLS],
)
def test_nothing_that_a_run_names_is_called(
    received: Path, tmp_path: Path, state: str, command: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    marker = tmp_path / "marker"
    set_traps(received, marker, state)
    # Where a name without a folder would be found.
    monkeypatch.chdir(received)
    monkeypatch.setattr("driftwalk.viewer.serve", lambda source, **_: None)
    made = READING[command][1] if command in READING else ALSO[command]
    done = here(*made(received, tmp_path))
    assert done.code in (0, 2), done
    assert "Traceback" not in done.err
    assert not marker.exists()


def test_the_trap_is_one(received: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The user who names the model gets it called."""
    marker = tmp_path / "marker"
    (received / "mine.py").write_text(TRAP.format(marker=str(marker)))
    monkeypatch.chdir(received)
    here("simulate", "--model", "mine.py:robot", "--duration", "1s", "-o", tmp_path / "made.nc")
    assert marker.exists()


@pytest.mark.slow
@pytest.mark.parametrize("file", ["/etc/hostname", "../home/pipe"])
def test_flow_files_that_the_study_of_a_run_names_are_not_read(
    received: Path, tmp_path: Path, file: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(received)
    os.mkfifo(tmp_path / "home" / "pipe")
    found = open_netcdf(received / "calibration.nc")
    own = f'[sensitivity]\nflow = ["{file}", "flow.nc"]\n'
    study = found.attrs["study"].replace("[sensitivity]\n", own)
    (received / "calibration.nc").write_bytes(netcdf_bytes(found.assign_attrs(study=study)))
    said = refusal(here("sensitivity", received, *LITTLE, "-o", tmp_path / "made"))
    assert f"names flow files ({file}, flow.nc)" in said
    assert "--vary flow=" in said


@pytest.mark.slow
def test_the_flow_that_the_study_of_a_run_names_for_its_recovery_is_not_read(
    tmp_path: Path,
) -> None:
    study = apply_overrides(Study(), {"recover.flow": "/etc/hostname"})
    found = {"model_calibration.nc": every_kind("model_calibration")}
    run_work(StoredWork("model_calibration", found, study), tmp_path / "run")
    short = ("--recordings", "2", "--duration", "1s", "-o", tmp_path / "made")
    said = refusal(here("study", "recover", tmp_path / "run", *short))
    assert "hostname" not in said
    assert "too short" in said or "steps" in said
