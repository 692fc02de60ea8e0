"""The share of small faults in the inference code that the fast tests find: mutation testing.

A mutant is the code with one token changed by an operator of Cosmic Ray: a number, a comparison, an
arithmetic or boolean operator, a loop's end. The rooms are likelihood, calibration, comparison and
assembly/outcomes. Sites are drawn in a seeded random order, one mutant each, so every prefix of the
results is a fair sample. Annotations and decorators are left out.

Which tests run a line is read from one run of the fast tests under coverage (``contexts.py``). A
mutant meets the fast tests that run its line, cheapest first, until one fails; then the other fast
tests of the same files, whose fixtures may have run it. A mutant on a line that no test runs
survives. Results go to ``fast.jsonl``, one line a mutant; run again, it continues.

    pip install cosmic-ray coverage
    MAP=/tmp/map.json PYTHONPATH=studies/mutation python -m pytest -p contexts tests/unit
    python studies/mutation/mutate.py --map /tmp/map.json --mutants 360
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
SEED = 20261127
LIMIT = 60.0  # processor time of one group of fast tests [s]; a run past it counts as killed
SLOW_LIMIT = 240.0  # of slow tests, which may be left out beyond it [s]
EXACT = "tests/reference/test_pinned_numbers.py"  # its tests name the lines that they run
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


def sample(number: int) -> list[Mutant]:
    """Return mutants of different sites in the study's random order."""
    sites: dict[tuple[str, Any], list[Mutant]] = {}
    for room in ROOMS:
        for path in sorted((ROOT / "src/driftwalk" / room).rglob("*.py")):
            for mutant in mutants_of(path):
                sites.setdefault((mutant.file, mutant.place[0]), []).append(mutant)
    print(f"{len(sites)} sites, {sum(map(len, sites.values()))} mutants", flush=True)
    draw = random.Random(SEED)
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


def run_tests(tests: list[str], file: str, code: str, limit: float = LIMIT) -> str:
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


def judge(mutant: Mutant, known: dict[str, Any]) -> Any:
    """Return what the fast tests say about a mutant, and the slow ones where those say nothing."""
    code = mutated(mutant)
    found = {"line": changed_line(mutant, code), "fast": "survived", "slow": "", "tests": 0}
    try:
        ast.parse(code)
    except SyntaxError:
        return {**found, "fast": "invalid"}
    cost, slow = known["cost"], set(known["slow"])
    lines = known["tests"].get(mutant.file, {})
    seen = set(lines.get(str(mutant.place[0][0]), []))
    if "" in seen:  # run at import: any test of the file may see it
        seen = {test for tests in lines.values() for test in tests}
    seen &= set(cost)
    files = {test.split("::")[0] for test in seen} - {EXACT}
    others = {test for test in cost if test.split("::")[0] in files} - seen
    for group in (seen - slow, others - slow):
        ordered = sorted(group, key=lambda test: cost[test])
        if ordered and found["fast"] == "survived":
            found["tests"] += len(ordered)
            found["fast"] = run_tests(ordered, mutant.file, code)
    if found["fast"] == "survived":
        left, chosen = SLOW_LIMIT, []
        for test in sorted((seen | others) & slow, key=lambda test: (test in others, cost[test])):
            left -= cost[test]
            if left > 0.0:
                chosen.append(test)
        slowly = run_tests(chosen, mutant.file, code, 3.0 * SLOW_LIMIT) if chosen else "survived"
        found |= {"slow": slowly, "slow_tests": len(chosen)}
    return found


def main() -> None:
    """Run the mutants that the results do not hold yet."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--map", type=Path, required=True, help="JSON of contexts.py")
    parser.add_argument("--mutants", type=int, default=360)
    parser.add_argument("--output", type=Path, default=HERE / "fast.jsonl")
    parser.add_argument("--again", action="store_true", help="only the survivors of the output")
    parser.add_argument("--part", type=int, nargs=2, default=(0, 1), help="K of N, side by side")
    chosen = parser.parse_args()
    os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    for module in ("numpy", "scipy.stats", "scipy.optimize", "scipy.signal", "h5py", "pandas"):
        try:
            __import__(module)  # loaded once, before the processes of the mutants fork
        except ImportError:
            print(f"without {module}", file=sys.stderr)
    os.chdir(ROOT)
    found = json.loads(chosen.map.read_text(encoding="utf-8"))
    lines = chosen.output.read_text("utf-8").splitlines() if chosen.output.exists() else []
    known = {entry["number"]: entry for entry in map(json.loads, lines)}
    for number, mutant in enumerate(sample(chosen.mutants)):
        before = known.get(number)
        if before is not None and (not chosen.again or before["fast"] != "survived"):
            continue
        if number % chosen.part[1] != chosen.part[0]:
            continue
        entry = {"number": number, "file": mutant.file, "at": list(mutant.place[0])}
        entry |= {"operator": mutant.operator.split("/")[-1]}
        entry |= judge(mutant, found)
        with chosen.output.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(entry) + "\n")


if __name__ == "__main__":
    main()
