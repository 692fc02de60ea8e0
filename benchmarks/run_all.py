"""Run every benchmark, one after another.

    python benchmarks/run_all.py [NAME ...]

Names are those of the files without `bench_` and `.py`; default: all. A benchmark that lacks
something (a peer that is not installed) says so and is skipped. The exit code is 1 when one gave a
wrong answer or failed.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
SKIPPED = 77


def main() -> None:
    known = {path.stem.removeprefix("bench_"): path for path in sorted(HERE.glob("bench_*.py"))}
    names = sys.argv[1:] or list(known)
    unknown = [name for name in names if name not in known]
    if unknown:
        sys.exit(f"no such benchmark: {', '.join(unknown)}; there are: {', '.join(known)}")
    outcomes = {}
    for name in names:
        print(f"\n=== {name}", flush=True)
        outcomes[name] = subprocess.run([sys.executable, known[name]], check=False).returncode
    skipped = [name for name, code in outcomes.items() if code == SKIPPED]
    failed = [name for name, code in outcomes.items() if code not in (0, SKIPPED)]
    passed = len(names) - len(skipped) - len(failed)
    print(f"\n{passed} passed", *(f"skipped: {name}" for name in skipped), sep="; ")
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main()
