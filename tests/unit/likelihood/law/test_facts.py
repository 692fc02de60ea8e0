"""A fit says which part of its law was stated, and not searched for."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from fit_worlds import fitted

from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.law.force_law import FLOATING, assumptions_of
from driftwalk.likelihood.law.forward_selection import LawResult
from driftwalk.likelihood.newton import Mode
from driftwalk.likelihood.result import law_facts
from driftwalk.model import Study, apply_overrides
from driftwalk.schema.check import check_dataset


def facts_of(stated: dict[str, Any]) -> dict[str, Any]:
    """Return the facts of a law that is as stated, without a search."""
    study = apply_overrides(Study(), stated)
    assumptions = assumptions_of(study, "state", recordings=1, flows=1)
    floating = assumptions.pressure_gradient == "on"
    fixed = {**assumptions.fixed, **(FLOATING if floating else {})}
    point = Point(np.zeros((2, 1, 1)), 0.0, 0.0, 0.0, opened=assumptions.opened, fixed=fixed)
    mode = cast(Mode, SimpleNamespace(point=point))
    law = LawResult(mode, mode, floating, {}, np.inf, None)
    return law_facts(law, assumptions)


@pytest.mark.parametrize(
    ("stated", "force", "drag", "kind"),
    [
        ({}, "no", "no", "quadratic"),
        ({"fit.law": "paper"}, "yes", "yes", "quadratic"),
        ({"fit.law": "quadratic"}, "no", "yes", "quadratic"),
        ({"fit.law": "linear"}, "no", "yes", "linear"),
        ({"fit.law": "mixed"}, "no", "yes", "mixed"),
        ({"fit.law": "power"}, "no", "yes", "power"),
        ({"fit.pressure_gradient": "on"}, "yes", "no", "quadratic"),
        ({"fit.pressure_gradient": "off"}, "yes", "no", "quadratic"),
        ({"forces.pressure_gradient": True}, "yes", "no", "quadratic"),
        ({"forces.drag_power": 1.5}, "no", "yes", "power"),
    ],
)
def test_stated_laws(stated: dict[str, Any], force: str, drag: str, kind: str) -> None:
    facts = facts_of(stated)
    assert (facts["force_law_stated"], facts["drag_law_stated"]) == (force, drag)
    assert facts["drag_law"] == kind


@pytest.mark.parametrize("unsettled", [(), ("one", "two")])
@pytest.mark.parametrize("settled_by", [7.5, np.inf])
def test_a_law_that_is_not_settled_says_why(unsettled: tuple[str, ...], settled_by: float) -> None:
    """Evidence over no other law is not a number of it."""
    assumptions = assumptions_of(Study(), "state", recordings=1, flows=1)
    mode = cast(Mode, SimpleNamespace(point=Point(np.zeros((2, 1, 1)), 0.0, 0.0, 0.0)))
    law = LawResult(mode, mode, True, {}, settled_by, None, unsettled=unsettled)
    facts = law_facts(law, assumptions)
    assert facts["force_law"] == "floating body"
    assert facts.get("law_unsettled") == ("one; two" if unsettled else None)
    assert facts.get("law_settled_by") == (7.5 if np.isfinite(settled_by) else None)


@pytest.mark.slow
def test_a_fit_keeps_it() -> None:
    fit = fitted(120.0)
    assert {fit.attrs["force_law_stated"], fit.attrs["drag_law_stated"]} == {"yes"}
    check_dataset(fit)
