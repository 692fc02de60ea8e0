"""Damage valid recordings and flow fields, and read them in worker processes, many a second.

    python tests/fuzz/loader_run.py FOLDER [--seed N] [--cases N] [--from N] [--workers N]
                                           [--target TEXT]

A file is fine when it is read and the dataset is one of its kind, or refused with an `InputError`
of one line that names it. Anything else is a finding: another error, a warning, a line of a
library's, more than a second of processor time or 1 GB, a file that is changed. A process that
hangs or dies is one too, and another takes its place.

A finding lies under FOLDER/findings with its input and what happened. The same seed gives the same
cases; a run that was stopped goes on where it was. Ranges of cases can run in several folders.
"""

from __future__ import annotations

import argparse
import contextlib
import fcntl
import json
import os
import select
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "helpers")]

CASES_PER_RANGE = 500
KEPT_OF_A_KIND = 3
LONGEST_WAIT_S = 300.0
"""Wall time of a case, for one that waits and uses no processor."""
PROGRESS_S = 10.0


@dataclass
class Tally:
    """What the cases so far came to; shared by the threads that watch the workers."""

    place: Path
    ends: Counter[str] = field(default_factory=Counter)
    findings: Counter[str] = field(default_factory=Counter)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def add(self, number: int, fact: dict[str, Any], case: dict[str, Any]) -> None:
        """Count a case; of each finding a few are kept with their input."""
        with self.lock:
            self.ends[fact["end"]] += 1
            if fact["end"] != "finding":
                return
            what = fact["what"]
            self.findings[what] += 1
            if self.findings[what] > KEPT_OF_A_KIND:
                return
            folder = self.place / "findings" / str(number)
            shutil.rmtree(folder, ignore_errors=True)
            if case:
                shutil.copytree(case["folder"], folder / "in")
            folder.mkdir(parents=True, exist_ok=True)
            said = f"{case.get('kind')}/{case.get('name')}\n{what}\n\n{fact['detail']}\n"
            (folder / "what.txt").write_text(said, errors="backslashreplace")
            print(f"case {number}, {case.get('kind')}/{case.get('name')}: {what}", flush=True)


class Worker:
    """A process that reads damaged files, followed case by case; another replaces a dead one."""

    def __init__(self, place: Path, seeds_at: Path) -> None:
        self._place, self._seeds_at = place, seeds_at
        self._process: subprocess.Popen[bytes] | None = None

    def run(self, order: dict[str, Any], tally: Tally) -> Counter[str]:
        """Run a range of cases, whatever some do to the process; return how many ended how."""
        at, stop = order["start"], order["stop"]
        ends: Counter[str] = Counter()
        while at < stop:
            case: dict[str, Any] = {}
            number: int | None = None
            for fact in self._answers({**order, "start": at}):
                if "begins" in fact:
                    number, case = fact["begins"], {}
                elif "folder" in fact:
                    case = fact
                else:
                    tally.add(fact["ended"], fact, case)
                    ends[fact["end"]] += 1
                    number, at = None, fact["ended"] + 1
                    if at == stop:
                        return ends
            what = self._death()
            if number is None:
                raise RuntimeError(f"a worker could not begin: {what}; see {self._place}")
            kind = f"{what}: {case.get('kind')}" if case else f"{what}, while it was made"
            tally.add(number, {"end": "finding", "what": kind, "detail": self._printed()}, case)
            ends["finding"] += 1
            at = number + 1
        return ends

    def _answers(self, order: dict[str, Any]) -> Iterator[dict[str, Any]]:
        """Send a range, and yield what the process answers until it is silent or gone."""
        if self._process is None:
            self._start()
        self._to.write(json.dumps(order) + "\n")
        self._to.flush()
        rest = b""
        while select.select([self._from], [], [], LONGEST_WAIT_S)[0]:
            block = os.read(self._from, 1 << 16)
            if not block:
                return
            *lines, rest = (rest + block).split(b"\n")
            yield from map(json.loads, lines)

    def _start(self) -> None:
        self._place.mkdir(parents=True, exist_ok=True)
        ranges, to = os.pipe()
        self._from, answers = os.pipe()
        threads = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL")}
        words = [str(ranges), str(answers), str(self._place), str(self._seeds_at)]
        self._process = subprocess.Popen(
            [sys.executable, str(HERE / "loader_worker.py"), *words],
            pass_fds=(ranges, answers), stdin=subprocess.DEVNULL,
            env=os.environ | threads | {"MALLOC_ARENA_MAX": "2", "PYTHONFAULTHANDLER": "1"},
        )  # fmt: skip
        os.close(ranges)
        os.close(answers)
        self._to = os.fdopen(to, "w")

    def _death(self) -> str:
        assert self._process is not None
        code: int | None = None
        with contextlib.suppress(subprocess.TimeoutExpired):
            # A process that dies closes its pipe a moment before it is gone.
            code = self._process.wait(timeout=5.0)
        self.end()
        if code is None:
            return "came to no end"
        if code == -signal.SIGXCPU:
            return "took more than 3 s"
        return f"ended by {signal.Signals(-code).name}" if code < 0 else f"left with {code}"

    def _printed(self) -> str:
        return (self._place / "printed.txt").read_text(errors="replace")

    def end(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._to.close()
            os.close(self._from)
            self._process = None


def fuzz_loaders(
    place: Path, *, seed: int, cases: range, workers: int = 1, target: str = ""
) -> Tally:
    """Run cases in worker processes; what an earlier call finished is not run again.

    Parameters
    ----------
    place : Path
        Folder for seeds, finished ranges and findings.
    seed : int
        With the number of a case it determines the case.
    cases : range
        Numbers of the cases.
    workers : int
        Processes at a time.
    target : str
        Keep to the seeds whose name holds it.
    """
    from seeds import readable_seeds

    readable_seeds(place / "seeds")
    tally = Tally(place)
    log = place / f"done-{seed}-{target or 'all'}.jsonl"
    left = _left(cases, log, tally)
    total, done, begin = sum(stop - start for start, stop in left), [0], time.monotonic()
    failed: list[BaseException] = []

    def work(which: int) -> None:
        worker = Worker(place / f"worker-{which}", place / "seeds")
        try:
            while left and not failed:
                with tally.lock:
                    if not left:
                        return
                    start, stop = left.pop(0)
                order = {"seed": seed, "start": start, "stop": stop, "target": target}
                ends = worker.run(order, tally)
                with tally.lock:
                    done[0] += stop - start
                    with log.open("a") as file:
                        file.write(json.dumps({"range": [start, stop], "ends": ends}) + "\n")
        except BaseException as error:
            failed.append(error)
        finally:
            worker.end()

    threads = [threading.Thread(target=work, args=(k,), daemon=True) for k in range(workers)]
    for thread in threads:
        thread.start()
    said = begin
    while any(thread.is_alive() for thread in threads):
        time.sleep(0.05)
        if time.monotonic() - said > PROGRESS_S:
            said = time.monotonic()
            _print_progress(done[0], total, said - begin, tally)
    if failed:
        raise failed[0]
    return tally


def _print_progress(done: int, total: int, took_s: float, tally: Tally) -> None:
    left = f"{(total - done) * took_s / done / 60:.0f} min left" if done else "begun"
    print(
        f"{done} of {total} cases, {done / took_s:.0f} a second, {left}; "
        f"{tally.findings.total()} findings of {len(tally.findings)} kinds",
        flush=True,
    )


def _left(cases: range, log: Path, tally: Tally) -> list[tuple[int, int]]:
    """Return the ranges that are still to be run, and count those that are done."""
    ranges = [
        (start, min(start + CASES_PER_RANGE, cases.stop))
        for start in range(cases.start, cases.stop, CASES_PER_RANGE)
    ]
    if log.exists():
        for entry in map(json.loads, log.read_text(encoding="utf-8").splitlines()):
            if tuple(entry["range"]) in ranges:
                ranges.remove(tuple(entry["range"]))
                tally.ends.update(entry["ends"])
    return ranges


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="for seeds, finished ranges and findings")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cases", type=int, default=200_000, help="number of the last, plus one")
    parser.add_argument("--from", type=int, default=0, dest="first", help="number of the first")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--target", default="", help="keep to seeds whose name holds this")
    given = parser.parse_args()
    begin = time.monotonic()
    given.folder.mkdir(parents=True, exist_ok=True)
    lock = (given.folder / "lock").open("w")
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        parser.error(f"{given.folder} is in use by another run: take another folder")
    tally = fuzz_loaders(
        given.folder.resolve(),
        seed=given.seed,
        cases=range(given.first, given.cases),
        workers=given.workers,
        target=given.target,
    )
    ends = ", ".join(f"{end}: {number}" for end, number in tally.ends.most_common())
    print(f"{tally.ends.total()} cases, {time.monotonic() - begin:.0f} s in this run; {ends}")
    for what, number in tally.findings.most_common():
        print(f"{number:6}  {what}")
    if tally.ends["finding"]:
        print(f"their inputs: {given.folder.resolve() / 'findings'}")
    return 1 if tally.ends["finding"] else 0


if __name__ == "__main__":
    sys.exit(main())
