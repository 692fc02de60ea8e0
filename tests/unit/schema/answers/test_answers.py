"""What the terminal, a notebook and ``--json`` say of a stored result of each kind."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
import xarray as xr
from small_sensitivity import small

from driftwalk.cli.prediction import assemble
from driftwalk.cli.terminal import (
    calibration_answer,
    fit_answer,
    model_answer,
    model_recover_answer,
    models_answer,
    recover_answer,
    sensitivity_answer,
)
from driftwalk.cli.terminal.output import to_json
from driftwalk.runs import AssemblyResult, SensitivityResult
from driftwalk.schema.answers.answer import answer_lines

STORED = Path(__file__).resolve().parents[3] / "data" / "answers"
FORMS = sorted(path.stem for path in STORED.glob("*.txt"))
RUN = Path("run")
Said = tuple[Callable[[], None], xr.Dataset, Mapping[str, Any]]


def stored(name: str) -> xr.Dataset:
    """Return a small result, without the maps and fields that no answer shows."""
    return xr.Dataset.from_dict(json.loads((STORED / f"{name}.json").read_text()))


def fit(form: str) -> Said:
    found = stored(form)
    found.attrs.setdefault("source", "recording.csv")
    check = stored("model-check") if form.endswith("state") else None

    def printed() -> None:
        fit_answer.print_found(found)
        fit_answer.print_verdict(found, check)
        fit_answer.print_places(found, RUN)

    return printed, found, fit_answer.answer(found, check)


def one(form: str) -> Said:
    found = stored(form)
    of: Any = {
        "calibration": calibration_answer,
        "model_calibration": model_answer,
        "model_comparison": models_answer,
        "recovery": recover_answer,
        "model_recovery": model_recover_answer,
    }[found.attrs["kind"]]
    return lambda: of.print_answer(found, RUN), found, of.summary(found)


def assembly(form: str) -> Said:
    found, times = stored("outcome-distribution"), stored("class-times")
    drawn = found.assign_attrs(drawn="drag_coefficient force_std")
    result = AssemblyResult(found, times, drawn)
    if form == "assembly-of-many":
        result = AssemblyResult(found, times, None, stored("assembly-sizes"))
    study = small()
    return (
        lambda: assemble.print_answer(study, result, RUN),
        found,
        assemble.summary(study, result),
    )


def sensitivity(form: str) -> Said:
    names = ("outcome-distribution-of-realisations", form, "components", "sobol-indices-of-a-tank")
    result, study = SensitivityResult(*map(stored, names)), small()
    return (
        lambda: sensitivity_answer.print_answer(study, result, RUN),
        result.sensitivity,
        sensitivity_answer.summary(study, result),
    )


MAKERS = {"fit": fit, "assembly": assembly, "sensitivity": sensitivity}


@pytest.mark.parametrize("form", FORMS)
def test_an_answer_is_what_it_was(form: str, capsys: pytest.CaptureFixture[str]) -> None:
    printed, found, answer = MAKERS.get(form.split("-")[0], one)(form)
    printed()
    shown = capsys.readouterr()
    notebook = "".join(f"{line}\n" for line in answer_lines(found))
    text = f"== terminal\n{shown.out}== remarks\n{shown.err}== notebook\n{notebook}"
    expected, _, values = (STORED / f"{form}.txt").read_text().partition("== json\n")
    assert text == expected
    assert json.loads(to_json(answer)) == json.loads(values)
