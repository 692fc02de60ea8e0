"""Fit the recordings of a set in one process, one line of JSON each.

    python studies/bodies/fits.py SET OUT.jsonl [--count N] [--no-check]

SET is a folder that `recordings.py` filled. Of a pair the single block is fitted first; its fit is
where that of the dimer begins, as `driftwalk fit dimer.csv --body-shape xx --earlier-fit fit/`
does. The seconds are processor time of the fit alone, without reading, check and figures.
Recordings that are in OUT.jsonl are not fitted again.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

sys.path.append(str(Path(__file__).resolve().parents[1] / "verdict"))

from run import block_line, read_lines

import driftwalk as dw
from driftwalk.schema.answers.facts import facts_of, sentences

GLUED = ("hidden_face_drag_share", "stirring_correlation", "stirring_length_m")


def main() -> None:
    """Fit the recordings that are not there."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("set", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--count", type=int, default=None, help="of the set; default: all")
    parser.add_argument("--no-check", action="store_true")
    options = parser.parse_args()
    done = {line["name"] for line in read_lines(options.out)}
    paths = sorted(options.set.glob("*-pair.json")) or sorted(options.set.glob("*.json"))
    for path in paths[: options.count]:
        truth = json.loads(path.read_text("utf-8"))
        name = truth["name"]
        if name in done:
            continue
        if "hidden_share" in truth:
            line = pair(options.set, truth)
        else:
            fit, line = fitted(options.set / name)
            if fit is not None and not options.no_check:
                checked = dw.likelihood.judge_fit(fit, [loaded(options.set / name)[0]]).fit
                line |= answer_of(checked)
        line = {"name": name, "kind": truth["kind"], **line}
        with options.out.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line, ensure_ascii=False) + "\n")
        print(name, flush=True)


def pair(folder: Path, truth: dict[str, Any]) -> dict[str, Any]:
    """Return the truth of a pair, and the lines of both fits."""
    known = {key: truth[key] for key in ("hidden_share", "correlation", "body")}
    block = folder / f"{truth['name']}-block"
    fit, line = fitted(block)
    found = {"truth": known, "block": line}
    if fit is not None:
        before = dw.likelihood.EarlierFit(fit, [loaded(block)[0]])
        found["dimer"] = fitted(folder / f"{truth['name']}-dimer", before)[1]
    return found


def fitted(path: Path, earlier: dw.likelihood.EarlierFit | None = None) -> tuple[Any, Any]:
    """Return the fit of a recording, None where it is refused, and its line."""
    recording, stated = loaded(path)
    begin = time.process_time()
    try:
        fit = dw.fit(recording, earlier=earlier, check=False, **stated)
    except dw.InputError as error:
        return None, {"seconds": time.process_time() - begin, "verdict": "refused",
                      "reasons": [str(error)]}  # fmt: skip
    return fit, {"seconds": time.process_time() - begin, **answer_of(fit)}


def loaded(path: Path) -> tuple[Any, dict[str, Any]]:
    """Return a recording, and the settings that its user states."""
    words = json.loads(path.with_suffix(".json").read_text("utf-8"))["options"]
    stated = {
        word.removeprefix("--").replace("-", "_"): value
        for word, value in zip(words[::2], words[1::2], strict=True)
    }
    stated["tank_diameter"] = stated.pop("tank")
    return dw.load(path.with_suffix(".csv")), stated


def answer_of(fit: Any) -> dict[str, Any]:
    """Return what a fit says, as `studies/verdict/run.py` does; of glued blocks their numbers."""
    facts = facts_of(fit)
    checked = "verdict" in fit
    facts |= {"verdict": str(fit["verdict"].values) if checked else "not checked"}
    facts |= {"verdict_reasons": sentences(fit, "verdict_reason")}
    line = block_line(facts)
    line["verdict"] = facts["verdict"]
    for name in GLUED:
        if name in facts:
            line["numbers"][name] = {"value": facts[name], "interval": facts[f"{name}_interval"]}
    if "stirring_misfit_std" in facts:
        line["facts"]["stirring_misfit_std"] = facts["stirring_misfit_std"]
    return line


if __name__ == "__main__":
    main()
