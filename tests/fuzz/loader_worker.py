"""The process that reads damaged files, one after another.

It reads ranges of cases, a line of JSON each, from the pipe whose number it is given. On another it
answers with a line before and after each case: whoever reads them knows which case it died of.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import resource
import sys
from pathlib import Path

MEMORY_BYTES = 1 << 30
"""Address space that a file may take beyond what the process had when it began."""
PROCESSOR_S = 3
"""Processor time after which the process is killed, by SIGXCPU: a library hangs."""


def serve(ranges: int, answers: int, place: Path, seeds_at: Path) -> None:
    """Read damaged files until the pipe is closed.

    Parameters
    ----------
    ranges, answers : int
        Numbers of the pipes.
    place : Path
        Folder of this process alone.
    seeds_at : Path
        Folder of the seeds, which have been made.
    """
    # What libraries print, below Python too, goes to a file that is looked at after each case.
    printed = os.open(place / "printed.txt", os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND)
    os.dup2(printed, 1)
    os.dup2(printed, 2)
    from loader_case import Verdict, judge, make_case
    from seeds import readable_seeds

    known = readable_seeds(seeds_at)
    _limit(resource.RLIMIT_AS, _address_space() + MEMORY_BYTES)
    with os.fdopen(ranges) as lines, os.fdopen(answers, "w") as out:

        def say(**fact: object) -> None:
            out.write(json.dumps(fact) + "\n")
            out.flush()

        for line in lines:
            order = json.loads(line)
            chosen = [seed for seed in known if order["target"] in seed.name]
            for number in range(order["start"], order["stop"]):
                say(begins=number)
                rng = random.Random(f"{order['seed']}/{number}")
                # Making a case is no part of what is tested, and takes libraries that write.
                _limit(resource.RLIMIT_CPU, _used_s() + 60)
                try:
                    case = make_case(chosen, place, rng)
                except Exception as error:  # The libraries cannot write all that is asked for.
                    say(ended=number, end=f"not made ({type(error).__name__})")
                    continue
                os.ftruncate(printed, 0)
                say(folder=str(case.folder), kind=case.seed.folder.name, name=case.seed.target)
                _limit(resource.RLIMIT_CPU, _used_s() + PROCESSOR_S)
                verdict = judge(case)
                sys.stdout.flush()
                sys.stderr.flush()
                if os.fstat(printed).st_size and verdict.end != "finding":
                    text = (place / "printed.txt").read_text(errors="replace")
                    verdict = Verdict("finding", f"printed: {text.splitlines()[0][:80]}", text)
                say(ended=number, end=verdict.end, what=verdict.what, detail=verdict.detail)


def _limit(what: int, most: int) -> None:
    resource.setrlimit(what, (most, resource.getrlimit(what)[1]))


def _used_s() -> int:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return int(used.ru_utime + used.ru_stime) + 1


def _address_space() -> int:
    """Return the bytes of address space that this process has."""
    pages = int(Path("/proc/self/statm").read_text(encoding="utf-8").split()[0])
    return pages * resource.getpagesize()


if __name__ == "__main__":
    here = Path(__file__).resolve().parent
    sys.path[:0] = [str(here), str(here.parent / "helpers")]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for number in ("ranges", "answers"):
        parser.add_argument(number, type=int)
    for folder in ("place", "seeds_at"):
        parser.add_argument(folder, type=Path)
    serve(**vars(parser.parse_args()))
