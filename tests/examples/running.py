"""Running the examples of a page in a folder, one after the other, as a reader would."""

from __future__ import annotations

import contextlib
import hashlib
import io
import re
import shutil
import signal
import threading
import tomllib
from collections.abc import Iterable, Iterator
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

from command_line import Done, here
from made_once import made_once_in
from page_server import served

import driftwalk as dw
from driftwalk.model import read_binding
from examples.printed import Numbers, not_printed
from examples.provisions import Page
from examples.reading import LANGUAGES, ROOT, Block, Command, commands_of

SERVERS = ("view", "play")
PORT = "5000"
"""Port of the live stream on the pages; a test takes a free one."""


class Reader:
    """Somebody who follows a page in the current folder."""

    def __init__(self, page: Page, port: int) -> None:
        self.page = page
        self.names: dict[str, Any] = {"__name__": "example", **page.provide(Path())}
        self.port = port
        self._printed = io.StringIO()
        self._last = "", Numbers.SAME

    def follow(self, block: Block) -> None:
        """Do what a block says, and fail with its place where that does not work."""
        text = block.text
        for old, new in self.page.instead.items():
            text = text.replace(old, new)
        text = re.sub(rf"\b{PORT}\b", str(self.port), text)
        assert block.language in LANGUAGES, f"{block}: write console, python, toml or text"
        if block.language != "console" and self._is_left_out(text):
            return
        match block.language:
            case "console":
                self._console(block, text)
            case "python":
                self._python(block, text)
            case "toml":
                self._toml(block, text)
            case _:
                self._compare(str(block), text.splitlines())

    def _is_left_out(self, text: str) -> bool:
        return any(part in text for part in self.page.parts_weekly)

    def _console(self, block: Block, text: str) -> None:
        pairs = zip(commands_of(block.text), commands_of(text), strict=True)
        with contextlib.ExitStack() as servers:
            for written, command in pairs:
                if _matches(written, self.page.not_run) or self._is_left_out(written.text):
                    continue
                where = f"{block}: {command.text}"
                match command.words:
                    case ["cp", *sources, target]:
                        _copy(sources, target)
                    case ["driftwalk", name, *words] if name in SERVERS and "--save" not in words:
                        server = servers.enter_context(served(*command.words[1:]))
                        answer = server.get("/")
                        assert answer.status == 200, where
                        assert b"driftwalk" in answer.body, where
                    case ["driftwalk", *_]:
                        self._driftwalk(where, command, compared(self.page, written, command))
                    case _:
                        raise AssertionError(f"{where}: only driftwalk is run; see provisions.py")

    def _driftwalk(self, where: str, command: Command, numbers: Numbers) -> None:
        done = self._run(command.words[1:])
        refused = any(line.startswith("driftwalk: error: ") for line in command.shown)
        assert done.code == (2 if refused else 0), f"{where}\n{done.err}"
        if command.into:
            Path(command.into).write_text(done.out, encoding="utf-8")
        self._last = done.out + done.err, numbers
        self._compare(where, command.shown)

    def _run(self, words: list[str]) -> Done:
        """Run a command; a fit that stands on another page too is made once."""
        if words[0] != "fit" or Path(words[words.index("-o") + 1]).exists():
            return here(*words)
        folder = Path(words[words.index("-o") + 1])
        given = [Path(word).read_bytes() for word in words if Path(word).is_file()]
        key = hashlib.sha256(repr((words, given, self.page.draws)).encode()).hexdigest()
        return made_once_in([folder], f"fit {key}", lambda: here(*words))

    def _compare(self, where: str, shown: list[str]) -> None:
        """Compare the lines that a page shows with what the last command printed."""
        printed, numbers = self._last
        missing = not_printed(shown, printed, numbers, self.page.by_chance)
        assert not missing, f"{where}\nnot printed: {missing}\n{printed}"

    def _python(self, block: Block, text: str) -> None:
        """Run the example, or write the file that its first line names."""
        assert ">>>" not in text, f"{block}: an example has no prompts"
        if named := re.match(r"# (\w+\.py)\n", text):
            Path(named[1]).write_text(text, encoding="utf-8")
            return
        # Empty lines in front: a traceback names the line of the page.
        with contextlib.redirect_stdout(self._printed):
            exec(compile("\n" * block.line + text, block.page, "exec"), self.names)
        self.names["printed"] = self._printed.getvalue()

    def _toml(self, block: Block, text: str) -> None:
        """Write the file that the first line names, or edit the study that is there."""
        named = re.match(r"# ([\w.]+\.toml)", text)
        path = Path(named[1] if named else "study.toml")
        if path.exists():
            text = edited(path.read_text(encoding="utf-8"), text)
        path.write_text(text, encoding="utf-8")
        # A table of the rules of typed faces is no study.
        (read_binding if path.name == "rules.toml" else dw.load_study)(path)


def compared(page: Page, written: Command, run: Command) -> Numbers:
    """Return how the numbers of a command compare that a page shows and a test runs."""
    if run.text != written.text:
        return Numbers.ANY
    for pattern, numbers in page.numbers_of.items():
        if _matches(written, [pattern]):
            return numbers
    return page.numbers


def _matches(command: Command, patterns: Iterable[str]) -> bool:
    return any(fnmatch(command.text, pattern) for pattern in patterns)


@contextlib.contextmanager
def streaming(port: int, seconds: float = 2.0) -> Iterator[None]:
    """Publish a simulated tank on a port for a while, as a tracker does."""
    with served("play", "--blocks", 3, "--live", port) as server:
        end = threading.Timer(seconds, server.process.send_signal, [signal.SIGINT])
        end.start()
        try:
            yield
        finally:
            end.join()


def _copy(sources: list[str], target: str) -> None:
    """Copy files of the project, named from its root as a reader in a clone would."""
    for source in sources:
        found = sorted(ROOT.glob(source))
        assert found, source
        for path in found:
            shutil.copy(path, target)


def edited(study: str, changes: str) -> str:
    """Return the text of a study file with the values of some keys changed, as a reader would.

    A table that the file does not have is written at its end.
    """
    for section, keys in tomllib.loads(changes).items():
        if f"[{section}]" not in study.splitlines():
            (table,) = re.findall(rf"^\[{section}\]$.*?(?=^\[|\Z)", changes, re.M | re.S)
            study += f"\n{table}"
            continue
        for key in keys:
            (line,) = re.findall(rf"^{key} = .*$", changes, re.MULTILINE)
            place = rf"(^\[{section}\]$(?:(?!^\[).)*?)^(?:# )?{key} = [^\n]*$"
            study, count = re.subn(place, rf"\g<1>{line}", study, flags=re.MULTILINE | re.DOTALL)
            assert count == 1, f"{section}.{key} is not in the study file"
    return study
