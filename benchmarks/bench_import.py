"""How long `import driftwalk` and `driftwalk --help` take in a fresh interpreter.

    python benchmarks/bench_import.py [--rounds 7]

The bare interpreter is timed beside them, rounds interleaved; `import driftwalk` is the time above
it. Checked, else the script fails: the import gives the package, the help names its commands, and
the import loads none of the heavy libraries.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import time

from timing import machine, spread

HEAVY = ("xarray", "scipy", "pandas", "matplotlib", "pydantic", "h5py")
COMMANDS = ("calibrate", "demo", "simulate")
TARGET_IMPORT_S = 0.3
TARGET_HELP_S = 0.5
WAYS = {
    "python": ["-c", "pass"],
    "import driftwalk": ["-c", "import driftwalk; print(driftwalk.__version__)"],
    "driftwalk --help": ["-c", "from driftwalk.cli.main import run; run()", "--help"],
}


def once(arguments: list[str]) -> tuple[float, str]:
    begin = time.perf_counter()
    done = subprocess.run([sys.executable, *arguments], check=True, capture_output=True, text=True)
    return time.perf_counter() - begin, done.stdout


def check_answers() -> None:
    """Stop unless the import is light and the help is the help."""
    loaded = once(["-c", "import sys, driftwalk; print(*sys.modules)"])[1].split()
    heavy = sorted(set(HEAVY) & set(loaded))
    if heavy:
        sys.exit(f"wrong answer: import driftwalk loads {', '.join(heavy)}")
    shown = once(WAYS["driftwalk --help"])[1]
    missing = [name for name in COMMANDS if name not in shown]
    if missing:
        sys.exit(f"wrong answer: driftwalk --help does not name {', '.join(missing)}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=7)
    options = parser.parse_args()
    print(machine())
    check_answers()
    times: dict[str, list[float]] = {name: [] for name in WAYS}
    for _ in range(options.rounds):
        for name, arguments in WAYS.items():
            times[name].append(once(arguments)[0])
    bare = statistics.median(times["python"])
    targets = {"import driftwalk": TARGET_IMPORT_S, "driftwalk --help": TARGET_HELP_S}
    print(f"\n{'fresh interpreter':<18} {'s, all of it':>18} {'above bare':>11} {'target':>7}")
    for name, seconds in times.items():
        above = f"{statistics.median(seconds) - bare:>11.2f}" if name in targets else f"{'':>11}"
        target = f"{targets[name]:>7.1f}" if name in targets else ""
        print(f"{name:<18} {spread(seconds, digits=2):>18} {above} {target}")


if __name__ == "__main__":
    main()
