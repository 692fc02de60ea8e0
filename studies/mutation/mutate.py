"""The share of small faults in the inference code that the fast tests find: mutation testing.

A mutant is the code with one token changed by an operator of Cosmic Ray: a number, a comparison, an
arithmetic or boolean operator, a loop's end. The rooms are likelihood, calibration, comparison and
assembly/outcomes. Sites are drawn in a seeded random order, one mutant each, so every prefix of the
results is a fair sample. Annotations and decorators are left out.

Which tests run a line is read from one run of the tests under coverage (``contexts.py``). A mutant
meets the fast tests that run its line, cheapest first, until one fails; then the other fast tests
of the same files, whose fixtures may have run it. A mutant on a line that no test runs survives.
Results go to ``fast.jsonl``, one line a mutant; run again, it continues. With ``--slow`` the
survivors meet the slow tests, in ``whole.jsonl``.

    pip install cosmic-ray coverage
    MAP=/tmp/fast.json PYTHONPATH=studies/mutation python -m pytest -p contexts tests/unit
    python studies/mutation/mutate.py --map /tmp/fast.json --mutants 150
    MAP=/tmp/slow.json PYTHONPATH=studies/mutation python -m pytest -p contexts -m slow tests/unit
    python studies/mutation/mutate.py --map /tmp/fast.json /tmp/slow.json --mutants 150 --slow
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import random
import sys
import time
from collections.abc import Iterator
from importlib.machinery import SourceFileLoader
from pathlib import Path
from typing import Any, NamedTuple

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
ROOMS = ("likelihood", "calibration", "comparison", "assembly/outcomes")
LEFT_OUT = {"RemoveDecorator", "VariableReplacer", "VariableInserter"}
SEED = 20261130
LIMIT = 60.0  # processor time of one group of tests [s]; a run past it, and three times its usual
# time, counts as killed
SLOW_LIMIT = 120.0  # of slow tests, which are left out beyond it [s]
EXACT = "tests/reference/test_pinned_numbers.py"  # its tests name the lines that they run
# Loaded once, before the processes of the mutants fork; none of these loads a room.
LOADED = ("scipy.stats", "scipy.optimize", "scipy.signal", "h5py", "pandas", "xarray")
LOADED += ("driftwalk.model", "driftwalk.flow", "driftwalk.simulation")
Place = tuple[tuple[int, int], tuple[int, int]]


class Mutant(NamedTuple):
    """One change of one file."""

    file: str
    place: Place
    operator: str
    occurrence: int


def unmutated(source: str) -> list[Place]:
    """Return the places of annotations and decorators."""
    found: list[Place] = []
    for node in ast.walk(ast.parse(source)):
        parts: list[Any] = list(getattr(node, "decorator_list", []))
        parts += [getattr(node, name, None) for name in ("annotation", "returns")]
        for part in parts:
            if isinstance(part, ast.expr):
                end = (part.end_lineno or 0, part.end_col_offset or 0)
                found.append(((part.lineno, part.col_offset), end))
    return found


def mutants_of(path: Path) -> Iterator[Mutant]:
    """Yield every mutant of a file."""
    import cosmic_ray.ast
    import cosmic_ray.plugins

    source = path.read_text(encoding="utf-8")
    apart = unmutated(source)
    nodes = list(cosmic_ray.ast.ast_nodes(cosmic_ray.ast.get_ast(source)))
    for name in cosmic_ray.plugins.operator_names():
        if name.split("/")[-1] in LEFT_OUT:
            continue
        operator = cosmic_ray.plugins.get_operator(name)()
        places = [tuple(p) for node in nodes for p in operator.mutation_positions(node)]
        for number, (start, end) in enumerate(places):
            if not any(a <= start and end <= b for a, b in apart):
                yield Mutant(str(path.relative_to(ROOT)), (start, end), name, number)


def sample(number: int, seed: int = SEED) -> list[Mutant]:
    """Return mutants of different sites in the study's random order."""
    sites: dict[tuple[str, Any], list[Mutant]] = {}
    for room in ROOMS:
        for path in sorted((ROOT / "src/driftwalk" / room).rglob("*.py")):
            for mutant in mutants_of(path):
                sites.setdefault((mutant.file, mutant.place[0]), []).append(mutant)
    print(f"{len(sites)} sites, {sum(map(len, sites.values()))} mutants", flush=True)
    draw = random.Random(seed)
    order = sorted(sites)
    draw.shuffle(order)
    return [draw.choice(sites[site]) for site in order[:number]]


def mutated(mutant: Mutant) -> str:
    """Return the source of the file with the change."""
    import cosmic_ray.plugins
    from cosmic_ray.mutating import mutate_code

    source = (ROOT / mutant.file).read_text(encoding="utf-8")
    operator = cosmic_ray.plugins.get_operator(mutant.operator)()
    changed: str | None = mutate_code(source, operator, mutant.occurrence)
    if changed is None:
        raise RuntimeError(f"{mutant} changes nothing")
    return changed


def changed_line(mutant: Mutant, code: str) -> str:
    """Return the first line that differs, after the change."""
    before = (ROOT / mutant.file).read_text(encoding="utf-8").splitlines()
    return next((b.strip() for a, b in zip(before, code.splitlines(), strict=False) if a != b), "")


def run_tests(tests: list[str], file: str, code: str, limit: float) -> str:
    """Run tests on the changed file in a forked process: `killed`, `survived` or `timeout`."""
    child = os.fork()
    if child == 0:
        os.setsid()
        quiet = os.open(os.devnull, os.O_WRONLY)
        os.dup2(quiet, 1)
        os.dup2(quiet, 2)
        whole = str(ROOT / file)
        usual = SourceFileLoader.get_code

        def get_code(self: SourceFileLoader, name: str) -> Any:
            return compile(code, whole, "exec") if self.path == whole else usual(self, name)

        SourceFileLoader.get_code = get_code  # type: ignore[method-assign]
        import pytest

        options = ["-q", "-x", "-p", "no:cacheprovider", "-m", "not study and not browser"]
        status = pytest.main([*options, *tests])
        os._exit(status)
    # Other programs may take the processor meanwhile; a process that waits for ever is ended.
    hang = time.monotonic() + 20.0 * limit
    while processor_time(child) < limit and time.monotonic() < hang:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            return "survived" if status == 0 else "killed"
        time.sleep(0.02)
    os.killpg(child, 9)
    os.waitpid(child, 0)
    return "timeout"


def processor_time(process: int) -> float:
    """Return the processor time of a process so far [s]."""
    fields = Path(f"/proc/{process}/stat").read_text("utf-8").rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Known(NamedTuple):
    """What is known of the tests."""

    lines: dict[str, dict[str, list[str]]]
    """Tests that run each line, by file and number; "" where it is run at import."""
    cost: dict[str, float]
    """Processor time of each test that passes [s]."""
    slow: set[str]

    def seeing(self, mutant: Mutant) -> tuple[set[str], set[str]]:
        """Return the tests that run the line of a mutant, and the others of their files."""
        lines = self.lines.get(mutant.file, {})
        seen = set(lines.get(str(mutant.place[0][0]), []))
        if "" in seen:  # run at import: any test of the file may see it
            seen = {test for tests in lines.values() for test in tests}
        seen &= set(self.cost)
        files = {test.split("::")[0] for test in seen} - {EXACT}
        return seen, {test for test in self.cost if test.split("::")[0] in files} - seen


def known_of(maps: list[Path]) -> Known:
    """Return what one or several runs of ``contexts.py`` say."""
    known = Known({}, {}, set())
    for one in maps:
        found = json.loads(one.read_text(encoding="utf-8"))
        known.cost.update(found["cost"])
        known.slow.update(found["slow"])
        for file, lines in found["tests"].items():
            own = known.lines.setdefault(file, {})
            for line, tests in lines.items():
                own[line] = [*own.get(line, []), *tests]
    return known


def judge(mutant: Mutant, known: Known, *, slow: bool) -> dict[str, Any]:
    """Return what the fast tests say about a mutant, or the slow ones."""
    code = mutated(mutant)
    found: dict[str, Any] = {"line": changed_line(mutant, code)}
    kind = "slow" if slow else "fast"
    try:
        ast.parse(code)
    except SyntaxError:
        return {**found, kind: "invalid", "tests": 0}
    seen, others = known.seeing(mutant)
    found |= {kind: "survived", "tests": 0}
    left = SLOW_LIMIT if slow else float("inf")
    for group in (seen, others):
        chosen = []
        for test in sorted(group, key=known.cost.__getitem__):
            if (test in known.slow) == slow and known.cost[test] < left:
                left -= known.cost[test]
                chosen.append(test)
        if chosen and found[kind] == "survived":
            found["tests"] += len(chosen)
            usual = sum(known.cost[test] for test in chosen)
            found[kind] = run_tests(chosen, mutant.file, code, max(LIMIT, 3.0 * usual))
    return found


def entries_of(path: Path) -> dict[int, dict[str, Any]]:
    """Return the results that a file holds, by number; the last of each counts."""
    lines = path.read_text("utf-8").splitlines() if path.exists() else []
    return {entry["number"]: entry for entry in map(json.loads, lines)}


def main() -> None:
    """Run the mutants that the results do not hold yet."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--map", type=Path, nargs="+", required=True, help="JSON of contexts.py")
    parser.add_argument("--mutants", type=int, default=150)
    parser.add_argument("--seed", type=int, default=SEED, help="of the sample")
    parser.add_argument("--output", type=Path, default=HERE / "fast.jsonl")
    parser.add_argument("--again", action="store_true", help="only the survivors of the output")
    parser.add_argument("--slow", action="store_true", help="its survivors meet the slow tests")
    parser.add_argument("--whole", type=Path, default=HERE / "whole.jsonl", help="what they say")
    parser.add_argument("--part", type=int, nargs=2, default=(0, 1), help="K of N, side by side")
    chosen = parser.parse_args()
    os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    for module in LOADED:
        try:
            __import__(module)
        except ImportError:
            print(f"without {module}", file=sys.stderr)
    os.chdir(ROOT)
    known, fast = known_of(chosen.map), entries_of(chosen.output)
    survivors = {number for number, entry in fast.items() if entry["fast"] == "survived"}
    output, done = chosen.output, set(fast) - (survivors if chosen.again else set())
    if chosen.slow:
        output, done = chosen.whole, set(entries_of(chosen.whole))
    for number, mutant in enumerate(sample(chosen.mutants, chosen.seed)):
        if number in done or number % chosen.part[1] != chosen.part[0]:
            continue
        if (chosen.slow or chosen.again) and number not in survivors:
            continue
        entry = {"number": number, "file": mutant.file, "at": list(mutant.place[0])}
        entry |= {"operator": mutant.operator.split("/")[-1]}
        entry |= judge(mutant, known, slow=chosen.slow)
        with output.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(entry) + "\n")


if __name__ == "__main__":
    main()
