"""The force law of a fit in words: found, stated, undecided; its numbers and the wall's."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr

from driftwalk.schema.answers.facts import fit_parts
from driftwalk.schema.answers.force_law import (
    compared_laws,
    law_estimates,
    law_limits,
    law_words,
    wall_estimates,
)

STATED = "as stated; the fit tried no other"


@pytest.mark.parametrize(
    ("facts", "rows"),
    [
        ({}, {}),
        ({"force_law": "paper"}, {"force law": "the paper's, as far as this recording tells"}),
        (
            {"force_law": "paper", "law_settled_by": 1.2},
            {"force law": "the paper's; the recording cannot tell it from a floating body's"},
        ),
        (
            {"force_law": "floating body", "force_law_stated": "no", "law_settled_by": 200.4},
            {"force law": "a floating body's; the paper's is less likely by e^200"},
        ),
        (
            {"force_law": "paper", "force_law_stated": "yes", "drag_law_stated": "yes"},
            {"force law": f"the paper's, {STATED}"},
        ),
        (
            {"force_law": "floating body", "force_law_stated": "yes", "drag_law_stated": "no"},
            {"force law": f"a floating body's, {STATED}"},
        ),
        (
            {"force_law": "paper", "drag_law": "linear", "drag_law_stated": "yes"},
            {
                "force law": "the paper's, as far as this recording tells",
                "drag law": f"linear, {STATED}",
            },
        ),
        (
            {
                "force_law": "floating body",
                "force_law_stated": "yes",
                "drag_law": "power",
                "drag_law_stated": "yes",
            },
            {
                "force law": f"a floating body's, {STATED}",
                "drag law": f"a power of the speed, {STATED}",
            },
        ),
    ],
)
def test_a_stated_law_is_not_called_found(facts: dict[str, Any], rows: dict[str, str]) -> None:
    assert law_words(facts) == rows


def fit_of(facts: dict[str, Any], **attrs: str) -> xr.Dataset:
    data, coords, _ = fit_parts({**facts, "confidence": 0.9})
    return xr.Dataset(data, coords, {"kind": "fit", **attrs})


def texts(facts: dict[str, Any], **attrs: str) -> list[str]:
    return [f"{one.label} {one.text}" for one in law_estimates(fit_of(facts, **attrs))]


def test_numbers_are_in_the_units_of_a_reader() -> None:
    facts = {
        "orientation_offset_rad": math.radians(5.0),
        "marker_x_m": 0.003,
        "force_memory_s": 0.1,
        "pulse_frequency_Hz": 0.099945,
    }
    ends = [0.9, 1.1]
    facts |= {f"{key}_interval": [end * facts[key] for end in ends] for key in list(facts)}
    facts["pulse_frequency_Hz_interval"] = [0.099935, 0.099955]
    assert texts(facts) == [
        "memory of the force 0.1000 s   90 % interval 0.09000 to 0.1100",
        "orientation offset 5.000°   90 % interval 4.500 to 5.500",
        "marker off by, x 3.000 mm   90 % interval 2.700 to 3.300",
        "frequency of pulses 0.099945 Hz   90 % interval 0.099935 to 0.099955",
    ]


def test_an_open_interval_and_no_interval_are_said() -> None:
    wall = {"wall_contacts": 60, "wall_restitution": 0.5, "wall_friction": 1.2}
    wall |= {"wall_restitution_interval": [0.42, 0.58], "wall_friction_interval": [0.9, np.inf]}
    assert [one.text for one in wall_estimates(fit_of(wall))] == [
        "0.5000   90 % interval 0.4200 to 0.5800",
        "1.200   90 % interval 0.9000 or more",
    ]
    assert wall_estimates(fit_of({"wall_contacts": 3})) == []
    assert texts({"drag_power": 1.5, "drag_power_interval": [1.5, 1.5]}) == [
        "power of the drag 1.5, as stated"
    ]
    endless = {"drag_power": np.inf, "drag_power_interval": [0.9, np.inf]}
    assert texts(endless) == [
        "power of the drag so large that it makes no difference (0.9000 or more)"
    ]


def test_a_linear_drag_has_no_quadratic_part() -> None:
    facts = {"linear_drag_kg_s": 5e-3, "effective_drag_coefficient": 0.4}
    facts |= {f"{key}_interval": [0.9 * facts[key], 1.1 * facts[key]] for key in list(facts)}
    assert len(law_estimates(fit_of(facts))) == 2
    (one,) = law_estimates(fit_of(facts, drag_law="linear"))
    assert (one.label, one.number.note) == ("linear drag", "there is no other drag")


def test_the_added_mass_that_nobody_knows_is_named() -> None:
    facts: dict[str, Any] = {"force_law": "paper"}
    assert len(law_limits(facts)) == 1
    facts["drag_coefficient_any_added_mass_interval"] = [0.38, 0.76]
    facts["force_std_any_added_mass_interval_N"] = [6e-4, 1.2e-3]
    assert "C_d is between 0.38 and 0.76, σ_F is between 0.6 and 1.2 mN" in law_limits(facts)[1]
    facts["drag_law"] = "linear"
    assert not any("C_d" in text for text in law_limits(facts))


def test_compared_laws_begin_with_the_best_and_end_with_the_unsolved() -> None:
    columns = {"log_score": [1.0, np.nan, 2.0], "log_score_std": [0.1, np.nan, 0.0]}
    columns["log_evidence"] = [50.0, np.nan, 40.0]
    fit = xr.Dataset(
        {f"compared_{name}": ("compared_law", values) for name, values in columns.items()},
        {"compared_law": ["paper", "paper, linear drag", "floating body"]},
    )
    found = compared_laws(fit)
    assert [law.name for law in found] == ["floating body", "paper", "paper, linear drag"]
    assert [law.solved for law in found] == [True, True, False]
    assert (found[1].loss, found[0].evidence) == (1.0, -10.0)
    assert compared_laws(xr.Dataset()) == []
