"""Loaders of other packages, found by their entry points: a package is made, installed and used."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

PENDULUM = '''"""Pendulum log: lines `frame|x|y`, pixels."""

from driftwalk.core.errors import FormatError
from driftwalk.record.raw import TableLayout
from driftwalk.record.raw import RawBody, RawRecording
from driftwalk.record.text import read_table


class PendulumLoader:
    name = "pendulum"
    description = "pendulum log (frame|x|y; pixels)"

    def sniff(self, head, path):
        if b"confusing" in head:
            raise KeyError("sniffed in vain")
        return 0.9 if head.startswith(b"#pendulum") else 0.0

    def read(self, path, options):
        text = path.read_text()
        if "broken" in text:
            raise KeyError("no such\\nkey")
        if "refused" in text:
            raise FormatError("has no swing", path=path, line=2)
        if "nothing" in text:
            return None
        table = read_table(path, TableLayout("|", ["frame", "x", "y"], 1, numbers=(0, 1, 2)))
        frame, x, y = (table.numbers[column] for column in range(3))
        if "short" in text:
            x = x[:1]
        return RawRecording([RawBody("bob", frame, x, y)], length_unit="px", rows=table.rows)


LOADER = PendulumLoader()


class Taken(PendulumLoader):
    name = "csv"


TAKEN = Taken()
'''
POINTS = """[driftwalk.loaders]
pendulum = driftwalk_pendulum:LOADER
absent = driftwalk_pendulum:NO_SUCH_NAME
csv = driftwalk_pendulum:TAKEN
"""
FILES = {
    "good": "#pendulum\n0|10|20\n1|11|21\n",
    "broken": "#pendulum\n0|10|broken\n",
    "refused": "#pendulum\n0|10|refused\n",
    "nothing": "#pendulum\n0|10|nothing\n",
    "short": "#pendulum short\n0|10|20\n1|11|21\n",
    "confusing": "[confusing\n",
    "table": "t,x,y\n0,1,2\n1,1,3\n",
}
OPTIONS = ("--fps", "10", "--scale", "0.01")


def package(folder: Path) -> Path:
    """Install a package into a folder as pip does: its modules, and what it says about itself."""
    site = folder / "site"
    about = site / "driftwalk_pendulum-1.0.dist-info"
    about.mkdir(parents=True)
    (site / "driftwalk_pendulum.py").write_text(PENDULUM)
    (about / "METADATA").write_text(
        "Metadata-Version: 2.1\nName: driftwalk-pendulum\nVersion: 1.0\n"
    )
    (about / "entry_points.txt").write_text(POINTS)
    return site


RUN = """
import sys
from driftwalk.cli.main import main
for arguments in {commands!r}:
    print(main(arguments), flush=True)
    print("---", file=sys.stderr, flush=True)
"""


@pytest.fixture(scope="module")
def answers(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[str, str, Path]]:
    """What `driftwalk info` says of every file, in a process that has the package."""
    folder = tmp_path_factory.mktemp("foreign")
    site = package(folder)
    commands = {}
    for name, text in FILES.items():
        path = folder / f"{name}.txt"
        path.write_text(text)
        options = () if name in ("table", "confusing") else OPTIONS
        commands[name] = ["info", str(path), *options]
    commands["absent"] = ["info", str(folder / "good.txt"), "--format", "absent"]
    done = subprocess.run(
        [sys.executable, "-c", RUN.format(commands=list(commands.values()))],
        env={**os.environ, "PYTHONPATH": str(site)},
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    errors = done.stderr.split("---\n")
    codes = [line for line in done.stdout.splitlines() if line in ("0", "1", "2")]
    assert len(codes) == len(commands)
    return {
        name: (code, error, folder)
        for name, code, error in zip(commands, codes, errors, strict=False)
    }


@pytest.mark.slow
def test_a_file_of_the_package_is_read(answers: dict[str, tuple[str, str, Path]]) -> None:
    assert answers["good"][0] == "0"


@pytest.mark.slow
def test_other_files_are_read_though_two_entry_points_are_broken(
    answers: dict[str, tuple[str, str, Path]],
) -> None:
    code, said, _ = answers["table"]
    assert code == "0"
    assert said.startswith("next: driftwalk fit ")  # no word of the entry points
    assert said.count("\n") == 1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("broken", "the loader 'pendulum' of the package driftwalk-pendulum failed: KeyError: "),
        ("refused", "line 2: has no swing (the loader 'pendulum' of the package driftwalk-pend"),
        ("nothing", "returned NoneType, and has to return a RawRecording"),
        ("short", "returned x of body 'bob' as float64 of shape (1,)"),
        ("absent", "the package driftwalk-pendulum has a broken loader (AttributeError: "),
        ("confusing", "the package driftwalk-pendulum failed to recognise it: KeyError: 'sniffed"),
        ("confusing", "has a loader named 'csv', which another loader is named already"),
    ],
)
def test_what_goes_wrong_is_one_line_with_the_name_of_the_package(
    answers: dict[str, tuple[str, str, Path]], name: str, message: str
) -> None:
    code, error, _ = answers[name]
    assert code == "2"
    assert error.count("\n") == 1
    assert message in error
