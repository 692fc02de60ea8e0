"""What the terminal, a notebook and ``--json`` say of a stored result of each kind."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import xarray as xr
from small_sensitivity import small

from driftwalk.cli.assembly.sensitivity import sensitivity_of
from driftwalk.cli.terminal.output import print_parts, print_places, print_prediction, to_json
from driftwalk.notebook.result import answer_lines
from driftwalk.runs import SensitivityResult
from driftwalk.schema.answers.parts import Answer
from driftwalk.schema.runs import answer_of

STORED = Path(__file__).resolve().parents[3] / "data" / "answers"
FORMS = sorted(path.stem for path in STORED.glob("*.txt"))
RUN = Path("run")


def stored(name: str) -> xr.Dataset:
    """Return a small result, without the maps and fields that no answer shows."""
    return xr.Dataset.from_dict(json.loads((STORED / f"{name}.json").read_text()))


def answered(form: str) -> tuple[xr.Dataset, Answer]:
    """Return the main dataset of a run, and its answer with what else the run made."""
    if form.startswith("assembly"):
        found = stored("outcome-distribution")
        if form == "assembly-of-many":
            return found, of_assembly(found, sizes=stored("assembly-sizes"))
        drawn = found.assign_attrs(drawn="drag_coefficient force_std")
        return found, of_assembly(found, distribution_drawn=drawn)
    found = stored(form)
    if form == "sensitivity":
        reference = stored("outcome-distribution-of-realisations")
        more = stored("components"), stored("sobol-indices-of-a-tank")
        return found, sensitivity_of(SensitivityResult(reference, found, *more))
    more = {"check": stored("model-check")} if form.endswith("in-the-state") else {}
    answer = answer_of(found, **more)
    assert answer is not None
    return found, answer


def of_assembly(found: xr.Dataset, **more: xr.Dataset) -> Answer:
    """Return the answer of an assembly with a distribution."""
    assembly = xr.Dataset(attrs={**found.attrs, "kind": "assembly", "study": small().to_toml()})
    answer = answer_of(assembly, distribution=found, class_times=stored("class-times"), **more)
    assert answer is not None
    return answer


def test_json_says_how_blocks_start() -> None:
    found = stored("outcome-distribution").assign_attrs(glued="xx")
    assert json.loads(to_json(of_assembly(found).facts))["glued"] == "xx"


def _rounded(text: str) -> Any:
    """Return what JSON holds; the last digits of numbers depend on the processor."""
    return json.loads(text, parse_float=lambda number: float(f"{float(number):.12g}"))


@pytest.mark.parametrize("form", FORMS)
def test_an_answer_is_what_it_was(form: str, capsys: pytest.CaptureFixture[str]) -> None:
    found, answer = answered(form)
    if form.startswith(("assembly", "sensitivity")):
        print_prediction(answer, RUN, None, answer.warnings, json=False)
    else:
        print_parts(answer.parts)
        print_places(found, RUN, answer.warnings)
    shown = capsys.readouterr()
    notebook = "".join(f"{line}\n" for line in answer_lines(found))
    text = f"== terminal\n{shown.out}== remarks\n{shown.err}== notebook\n{notebook}"
    expected, _, values = (STORED / f"{form}.txt").read_text().partition("== json\n")
    assert _rounded(to_json(answer.facts)) == _rounded(values)
    assert text == expected
