"""Fit pairs of a block and a glued dimer, one line of JSON each.

    python studies/bodies/pairs.py SET OUT.jsonl [--count N]

SET is a folder that `recordings.py --set dimers` filled. The single block is fitted first; its fit
is where that of the dimer begins, as `driftwalk fit dimer.csv --body-shape xx --from fit/` does.
Pairs that are in OUT.jsonl are not fitted again.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

sys.path.append(str(Path(__file__).resolve().parents[1] / "verdict"))

from run import read_lines

import driftwalk as dw
from driftwalk.schema.answers.facts import facts_of

NUMBERS = (
    *("drag_coefficient", "force_std_N", "hidden_face_drag_share"),
    *("stirring_correlation", "stirring_length_m", "stirring_misfit_std"),
)


def main() -> None:
    """Fit the pairs that are not there."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("set", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--count", type=int, default=None, help="pairs of the set; default: all")
    options = parser.parse_args()
    done = {line["name"] for line in read_lines(options.out)}
    for path in sorted(options.set.glob("*-pair.json"))[: options.count]:
        truth = json.loads(path.read_text("utf-8"))
        if truth["name"] not in done:
            line = {"name": truth["name"], "truth": truth, **fitted(options.set, truth["name"])}
            with options.out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line, ensure_ascii=False) + "\n")
            print(line["name"], f"{line['seconds']:.0f} s", flush=True)


def fitted(folder: Path, name: str) -> dict[str, Any]:
    """Return the numbers of both fits of a pair, or the error."""
    begin = time.process_time()
    found: dict[str, Any] = {}
    earlier = None
    for part in ("block", "dimer"):
        recording, settings = loaded(folder / f"{name}-{part}")
        try:
            fit = dw.fit(recording, earlier=earlier, check=False, **settings)
        except dw.InputError as error:
            found["error"] = f"{part}: {error}"
            break
        found[part] = numbers(fit)
        earlier = dw.likelihood.EarlierFit(fit, [recording])
    return {"seconds": time.process_time() - begin, **found}


def loaded(path: Path) -> tuple[Any, dict[str, Any]]:
    """Return a recording, and the settings that its user states."""
    words = json.loads(path.with_suffix(".json").read_text("utf-8"))["options"]
    stated = {
        word.removeprefix("--").replace("-", "_"): value
        for word, value in zip(words[::2], words[1::2], strict=True)
    }
    recording = dw.load(path.with_suffix(".csv"), tank=stated.pop("tank"))
    return recording, stated


def numbers(fit: Any) -> dict[str, Any]:
    """Return numbers of a fit with their intervals, its law and its warnings."""
    answer = facts_of(fit)
    found = {
        name: {"value": answer[name], "interval": answer.get(f"{name}_interval")}
        for name in NUMBERS
        if answer.get(name) is not None
    }
    facts = {key: answer[key] for key in ("force_law", "drag_law", "wall_share") if key in answer}
    return {"numbers": found, "facts": facts, "warnings": answer["warnings"]}


if __name__ == "__main__":
    main()
