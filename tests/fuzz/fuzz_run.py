"""Damage valid files and hand them to the command line: it must read them, or refuse in one line.

    python tests/fuzz/fuzz_run.py FOLDER [--seed N] [--cases N] [--only N] [--quick]

A case is fine when the command ends with 0, or with 2 and one line on stderr that begins
"driftwalk: error:". Anything else is a finding: a traceback, a line of a library's, a command that
takes longer than 25 s or more than 3 GB, or kills its process. A finding lies under
FOLDER/findings with its input, command and output. The same seed gives the same cases.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import select
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "helpers")]

from mutate import BYTES, PACKED, TEXT, mutated  # noqa: E402
from mutate_netcdf import damage  # noqa: E402
from seeds import Seed, seeds  # noqa: E402

LONGEST_WAIT_S = 300.0
LONGEST_LINE = 2000
CASES_PER_WORKER = 200
KEPT_OF_A_KIND = 3
PROGRESS_EVERY = 100


@dataclass(frozen=True)
class Outcome:
    """How a case ended."""

    code: int | None
    stdout: str
    stderr: str
    ended: str
    """Empty; or how the process was ended: by the limit on its time, by a signal."""

    @property
    def finding(self) -> str | None:
        """What is wrong with it, in a few words that are the same for the same mistake."""
        if self.ended:
            return self.ended
        lines = [line for line in self.stderr.splitlines() if line.strip()]
        traced = [line.strip() for line in lines if line.strip().startswith('File "')]
        if self.code is None or any(line.startswith("Traceback") for line in lines):
            where = next((line for line in traced[::-1] if "driftwalk/" in line), "?")
            return f"{lines[-1][:80]} | {where.rpartition('driftwalk/')[2][:80]}"
        foreign = [line for line in lines if not line.startswith(("driftwalk: ", "next: "))]
        if foreign:
            return f"foreign line: {foreign[0][:100]}"
        errors = [line for line in lines if line.startswith("driftwalk: error: ")]
        if self.code not in (0, 2) or len(errors) != (self.code == 2):
            return f"exit code {self.code} with {len(errors)} lines of error"
        if any(len(line) > LONGEST_LINE for line in lines):
            return "a line beyond 2000 characters"
        return None


class Worker:
    """A process that runs cases; a new one takes its place when it dies or has run many."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._process: subprocess.Popen[bytes] | None = None
        self._left = 0

    def run(self, words: list[str]) -> Outcome:
        """Run a command line and say how it ended."""
        if self._process is None or self._left == 0:
            self.end()
            self._start()
        self._left -= 1
        stdout, stderr = self._folder / "stdout.txt", self._folder / "stderr.txt"
        case = {"words": words, "stdout": str(stdout), "stderr": str(stderr)}
        self._to.write(json.dumps(case) + "\n")
        self._to.flush()
        ready, _, _ = select.select([self._from], [], [], LONGEST_WAIT_S)
        answer = self._from.readline() if ready else None
        code, ended = None, ""
        if answer:
            code = json.loads(answer)["code"]
        else:
            ended = "came to no end" if answer is None else self._death()
            self.end()
        texts = (path.read_text(errors="replace") for path in (stdout, stderr))
        return Outcome(code, *texts, ended)

    def _start(self) -> None:
        cases, to = os.pipe()
        back, answers = os.pipe()
        threads = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL")}
        self._process = subprocess.Popen(
            [sys.executable, str(HERE / "worker.py"), str(cases), str(answers)],
            pass_fds=(cases, answers), stdin=subprocess.DEVNULL, cwd=self._folder,
            env=os.environ | threads | {"MALLOC_ARENA_MAX": "2", "PYTHONFAULTHANDLER": "1"},
        )  # fmt: skip
        os.close(cases)
        os.close(answers)
        self._to, self._from = os.fdopen(to, "w"), os.fdopen(back)
        self._left = CASES_PER_WORKER

    def _death(self) -> str:
        assert self._process is not None
        code = self._process.wait()
        if code == -signal.SIGXCPU:
            return "took more than 25 s"
        return (
            f"the process was ended by {signal.Signals(-code).name}"
            if code < 0
            else f"left: {code}"
        )

    def end(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._to.close()
            self._from.close()
            self._process = None


def make_case(seed: Seed, folder: Path, rng: random.Random) -> list[str]:
    """Put a damaged copy of a seed into a folder and return the words of the command."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(seed.folder, folder / "in", ignore=shutil.ignore_patterns("figures"))
    target = folder / "in" / seed.target
    if seed.is_netcdf and rng.random() < 0.75:
        damage(target, rng)
    else:
        text = target.suffix in (".csv", ".txt", ".json", ".toml")
        mutators = [*TEXT, *PACKED] if text else BYTES
        target.write_bytes(mutated(target.read_bytes(), mutators, rng))
    command = rng.choice(seed.commands)
    return [word.replace("@", str(folder / "in")) for word in command]


def fuzz(
    place: Path, *, seed: int, cases: range, runs: bool = True, only_target: str = ""
) -> tuple[Counter[str], Counter[str]]:
    """Run cases; return how often each finding came up, and how cases ended by exit code.

    Parameters
    ----------
    place : Path
        Folder for seeds, the case at hand and the findings.
    seed : int
        With the number of a case it determines the case.
    cases : range
        Numbers of the cases.
    runs : bool
        Whether run directories take part that are slow to make.
    only_target : str
        Keep to the seeds whose name holds it.
    """
    known = [one for one in seeds(place / "seeds", runs=runs) if only_target in one.name]
    folder, worker = place / "case", Worker(place)
    findings: Counter[str] = Counter()
    ends: Counter[str] = Counter()
    try:
        for number in cases:
            rng = random.Random(f"{seed}/{number}")
            chosen = rng.choice(known)
            try:
                words = make_case(chosen, folder, rng)
            except Exception as error:  # The libraries cannot write everything that is asked for.
                ends[f"not made ({type(error).__name__})"] += 1
                continue
            if number % PROGRESS_EVERY == 0:
                print(f"case {number}", flush=True)
            outcome = worker.run(words)
            ends[str(outcome.code)] += 1
            found = outcome.finding
            if found is not None:
                findings[found] += 1
                if findings[found] <= KEPT_OF_A_KIND:
                    _keep(place / "findings" / f"{seed}-{number}", folder, words, outcome)
                    print(f"case {number}, {chosen.name}: {found}", flush=True)
    finally:
        worker.end()
    return findings, ends


def _keep(target: Path, folder: Path, words: list[str], outcome: Outcome) -> None:
    shutil.rmtree(target, ignore_errors=True)
    shutil.copytree(folder, target, ignore=shutil.ignore_patterns("in-*"))
    moved = [word.replace(str(folder), str(target)) for word in words]
    (target / "command.txt").write_text(" ".join(["driftwalk", *moved]) + "\n")
    (target / "stdout.txt").write_text(outcome.stdout)
    (target / "stderr.txt").write_text(f"{outcome.stderr}\n{outcome.ended}\n")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="for seeds and findings")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cases", type=int, default=2000)
    parser.add_argument("--only", type=int, help="run this case alone")
    parser.add_argument("--target", default="", help="keep to seeds whose name holds this")
    parser.add_argument("--quick", action="store_true", help="without the slow run directories")
    given = parser.parse_args()
    cases = range(given.cases) if given.only is None else range(given.only, given.only + 1)
    started = time.monotonic()
    place = given.folder.resolve()
    findings, ends = fuzz(
        place, seed=given.seed, cases=cases, runs=not given.quick, only_target=given.target
    )
    print(f"\n{len(cases)} cases in {time.monotonic() - started:.0f} s; by exit code:",
          ", ".join(f"{code}: {number}" for code, number in ends.most_common()))  # fmt: skip
    print(f"{findings.total()} findings of {len(findings)} kinds" if findings else "no findings")
    for what, number in findings.most_common():
        print(f"{number:6}  {what}")
    if findings:
        print(f"their inputs: {place / 'findings'}")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
