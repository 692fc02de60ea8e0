"""Every example of the pages runs: as a reader would, in one folder per page, block after block."""

from __future__ import annotations

import fnmatch
import os
import re
import shutil
import subprocess
from contextlib import closing, nullcontext
from pathlib import Path

import pytest
from command_line import leave_out_figures
from few_simulations import compare_after_little, simulate_little
from ports import held_port

from driftwalk.cli.demo import demo_truth
from examples.printed import NUMBER, Numbers
from examples.provisions import ELSEWHERE, NOT_COMPARED, PAGES, Page
from examples.reading import ROOT, blocks_of, commands_of, pages, read_blocks
from examples.running import Reader, compared, streaming

TUTORIAL, FIT_PAGE = "docs/tutorials/first-calibration.md", "docs/how-to/fit.md"


def run_page(name: str, page: Page, monkeypatch: pytest.MonkeyPatch) -> None:
    """Follow a page in a folder that is empty."""
    for package in page.needs:
        pytest.importorskip(package, reason=f"{package} is not installed")
    monkeypatch.setenv("MPLBACKEND", "Agg")
    if not page.draws:
        leave_out_figures(monkeypatch)
    if page.little:
        simulate_little(monkeypatch)
        compare_after_little(monkeypatch)
    with held_port() as port, streaming(port) if page.streams else nullcontext():
        reader = Reader(page, port)
        for block in blocks_of(name):
            reader.follow(block)
    for expression in page.holds:
        assert eval(expression, reader.names), expression
    for made in page.makes:
        assert Path(made).stat().st_size > 0


@pytest.mark.parametrize(
    ("name", "page"),
    [
        pytest.param(name, page, marks=marks, id=f"{name}{added}")
        for name, whole in PAGES.items()
        for added, page, marks in whole.runs
    ],
)
def test_examples_of_a_page_run(
    name: str, page: Page, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    run_page(name, page, monkeypatch)


def test_every_page_with_examples_is_run() -> None:
    assert sorted([*PAGES, *ELSEWHERE]) == pages()
    for name, test in ELSEWHERE.items():
        assert f'"{Path(name).name}"' in (ROOT / test).read_text(encoding="utf-8")


def test_commands_that_no_test_runs_exist() -> None:
    """The targets of make, and the files of the project."""
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    commands = [
        command.words
        for name in PAGES
        for block in blocks_of(name)
        if block.language == "console"
        for command in commands_of(block.text)
    ]
    for words in commands:
        if words[0] == "make":
            assert re.search(rf"^{words[1]}:", makefile, re.MULTILINE), words
        for word in words:
            if word.startswith((".ci/", "benchmarks/", "studies/")):
                assert (ROOT / word).exists(), word


def section(page: str, heading: str) -> str:
    """Return the text of a page below one of its headings."""
    text = (ROOT / page).read_text(encoding="utf-8")
    return text.split(f"\n## {heading}\n")[1].split("\n## ")[0]


def console(page: str, text: str) -> list[list[str]]:
    """Return the words of the commands in a part of a page."""
    blocks = read_blocks(page, text)
    return [c.words for b in blocks if b.language == "console" for c in commands_of(b.text)]


def test_two_commands_of_the_front_page_do_all_the_set_up() -> None:
    """No package is on an index, so pip works from the sources alone, by `make`."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert console("README.md", section("README.md", "Try it")) == [
        ["make", "demo"],
        ["make", "test"],
    ]
    assert not [words for words in console("README.md", text) if words[0] == "pip"]


def test_a_recording_on_the_front_page_states_what_no_tracker_tells() -> None:
    own = console("README.md", section("README.md", "With your own recording"))
    read = [words for words in own if words[:2] == ["driftwalk", "read"]]
    assert read
    for words in read:
        assert {"--tank", "--side", "--mass"} <= set(words)


def test_the_tutorial_begins_with_the_demo() -> None:
    """And not with the tests, which take far longer than its ten minutes."""
    first, *rest = console(TUTORIAL, (ROOT / TUTORIAL).read_text(encoding="utf-8"))
    assert first == ["make", "demo"]
    assert ["make", "test"] not in rest


@pytest.mark.parametrize("page", ["README.md", TUTORIAL, FIT_PAGE])
def test_the_interval_that_a_page_prints_holds_the_truth_that_it_states(page: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    printed = re.search(r"^drag coefficient C_d .*interval ([\d.]+) to ([\d.]+)$", text, re.M)
    assert printed is not None
    low, high = map(float, printed.groups())
    assert low < demo_truth()["drag_coefficient"] < high
    stated = [float(one) for one in re.findall(r"0\.3[89]\d*(?=[\s,:.])", text)]
    assert any(abs(one - demo_truth()["drag_coefficient"]) < 5e-4 for one in stated)


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
@pytest.mark.skipif(os.name == "nt", reason="there are no pseudo-terminals there")
@pytest.mark.parametrize("terminal", [False, True])
def test_make_says_what_it_installs(terminal: bool, tmp_path: Path) -> None:
    """A word before every pip, and pip's own bar where someone looks."""
    ours, theirs = os.openpty()
    with closing(os.fdopen(ours, "rb")), closing(os.fdopen(theirs, "wb")) as screen:
        done = subprocess.run(
            ["make", "--dry-run", "lint", f"VENV={tmp_path / 'none'}"],
            cwd=ROOT, stdout=subprocess.PIPE, stderr=screen if terminal else subprocess.PIPE,
            text=True, check=True,
        )  # fmt: skip
    lines = done.stdout.splitlines()
    places = [place for place, line in enumerate(lines) if " -m pip install " in line]
    assert len(places) == 3  # the package, what the tests need, and what the developers do
    for place in places:
        assert lines[place - 1].startswith('echo "Installing ')
        assert ("--quiet" in lines[place]) != terminal


def test_shown_numbers_are_compared_or_it_is_said_why_not() -> None:
    """Where a test computes less than the page says, what the page shows can grow old."""
    shown = []
    for name, page in PAGES.items():
        latest = None
        for block in blocks_of(name):
            if block.language == "console":
                text = block.text
                for old, new in page.instead.items():
                    text = text.replace(old, new)
                for written, run in zip(commands_of(block.text), commands_of(text), strict=True):
                    latest = written, compared(page, written, run)
                    shown += [(*latest, line) for line in written.shown]
            elif block.language == "":
                assert latest is not None, block
                shown += [(*latest, line) for line in block.text.splitlines()]
    apart = {
        command.text
        for command, numbers, line in shown
        if numbers is Numbers.ANY and NUMBER.search(line)
    }
    excused = {text for text in apart for one in NOT_COMPARED if fnmatch.fnmatch(text, one)}
    assert apart == excused
    for one in NOT_COMPARED:
        assert fnmatch.filter(apart, one), one


@pytest.mark.parametrize("name", PAGES)
def test_what_is_said_about_a_page_is_on_it(name: str) -> None:
    """A replacement or a reason that no example needs any more has to go."""
    blocks = blocks_of(name)
    commands = [
        command.text
        for block in blocks
        if block.language == "console"
        for command in commands_of(block.text)
    ]
    for pattern in (*PAGES[name].not_run, *PAGES[name].numbers_of):
        assert fnmatch.filter(commands, pattern), pattern
    for old in (*PAGES[name].instead, *PAGES[name].parts_weekly):
        assert any(old in block.text for block in blocks), old


def test_the_lines_of_the_example_on_its_page_are_the_program_s() -> None:
    """Blocks of text show parts of the program, in its order."""
    program = (ROOT / "docs" / "examples" / "mujoco_robot.py").read_text(encoding="utf-8")
    page = (ROOT / "docs" / "how-to" / "use-a-simulator.md").read_text(encoding="utf-8")
    places = [program.find(part) for part in re.findall(r"^```text\n(.*?)^```$", page, re.M | re.S)]
    assert len(places) >= 7
    assert -1 not in places, places
    assert places == sorted(places)
