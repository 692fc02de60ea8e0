"""The process that runs the command line on damaged files, one case after another.

It reads cases, a line of JSON each, from the pipe whose number it is given, and answers on another.
Everything that a command prints, also from the C libraries, goes to the file that the case names.
"""

from __future__ import annotations

import json
import os
import resource
import sys
import traceback

MEMORY_BYTES = 3 << 30
PROCESSOR_S = 25
"""Time that a case may take; counted by the processor, as other programs may use it too."""


def serve(cases: int, answers: int) -> None:
    """Run cases until the pipe is closed."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    from driftwalk.cli.main import main

    with os.fdopen(cases) as lines, os.fdopen(answers, "w") as out:
        for line in lines:
            case = json.loads(line)
            code: int | None = None
            used = resource.getrusage(resource.RUSAGE_SELF)
            end = int(used.ru_utime + used.ru_stime) + 1 + PROCESSOR_S
            # At its end the process is killed by SIGXCPU.
            resource.setrlimit(resource.RLIMIT_CPU, (end, resource.RLIM_INFINITY))
            with _printing_to(case["stdout"], 1), _printing_to(case["stderr"], 2):
                try:
                    code = main(case["words"])
                except BaseException:
                    traceback.print_exc()
            out.write(json.dumps({"code": code}) + "\n")
            out.flush()


class _printing_to:
    """Send what is printed to a file; below Python, so that libraries are heard too."""

    def __init__(self, path: str, number: int) -> None:
        self._path, self._number = path, number

    def __enter__(self) -> None:
        self._stream = sys.stdout if self._number == 1 else sys.stderr
        self._stream.flush()
        self._kept = os.dup(self._number)
        file = os.open(self._path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(file, self._number)
        os.close(file)

    def __exit__(self, *_: object) -> None:
        self._stream.flush()
        os.dup2(self._kept, self._number)
        os.close(self._kept)


if __name__ == "__main__":
    serve(int(sys.argv[1]), int(sys.argv[2]))
