"""The page of a fit holds all that the command line prints of the force law and the wall."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from made_up_fit import made_up_fit
from page_reading import numbers_of, part_of

from driftwalk.cli.terminal.output import print_parts
from driftwalk.page.sections.fit import fit_sections
from driftwalk.schema.answers.facts import facts_of, fit_parts
from driftwalk.schema.answers.fit import checked_parts, fitted_parts

NUMBERS = {
    "added_mass_share": 0.5,
    "linear_drag_kg_s": 5e-3,
    "drag_power": 1.5,
    "force_memory_s": 0.1,
    "time_stamp_noise_s": 0.01,
    "orientation_offset_rad": 0.0873,
    "marker_x_m": 3e-3,
    "flow_strength_change": 0.2,
    "pulse_amplitude": 0.19,
    "pulse_frequency_Hz": 0.1,
}
WALL = {
    "wall_contacts": 60, "wall_restitution": 0.5, "wall_friction": 1.2,
    "wall_restitution_interval": [0.42, 0.58], "wall_friction_interval": [0.9, np.inf],
}  # fmt: skip


def fit_of(**words: str) -> xr.Dataset:
    """Return a fit in which everything was opened; nothing was fitted."""
    fit = made_up_fit()
    facts = {**facts_of(fit), **NUMBERS, **WALL, "law_settled_by": 176.0}
    facts |= {f"{name}_interval": [0.9 * v, 1.1 * v] for name, v in NUMBERS.items()}
    data, coords, _ = fit_parts(facts)
    fit = fit.drop_dims("parameter").assign(data).assign_coords(coords)
    compared = {"log_score": [1.0, 2.0], "log_score_std": [0.1, 0.0], "log_evidence": [40.0, 50.0]}
    columns: dict[str, Any] = {
        f"compared_{name}": ("compared_law", values) for name, values in compared.items()
    }
    columns["departure_estimate"] = ("departure", [0.3, -2e-3])
    columns["departure_std"] = ("departure", [0.1, 1e-3])
    names = {"compared_law": ["paper", "floating body"]}
    names["departure"] = ["angle_offset", "strength_1"]
    fit = fit.assign(columns).assign_coords(names)
    return fit.assign_attrs({"force_law": "floating body", **words})


def lines_of(fit: xr.Dataset, capsys: pytest.CaptureFixture[str]) -> dict[str, str]:
    """Return the rows that the command line prints, by their label."""
    print_parts(fitted_parts(fit))
    print_parts(checked_parts(fit, None))
    return {line[:22].rstrip(): line[23:] for line in capsys.readouterr().out.splitlines()}


def test_what_is_printed_stands_on_the_page(capsys: pytest.CaptureFixture[str]) -> None:
    fit = fit_of()
    printed, made = lines_of(fit, capsys), fit_sections(fit)
    law = part_of(made, "law")
    assert law["paragraphs"][0] == f"Force law: {printed['force law']}."
    shown = numbers_of(law) | numbers_of(part_of(made, "wall"))
    assert shown["evidence for this law over the other"]["value"] == 176.0
    labels = [label for label in printed if label in shown]
    assert len(labels) == len(NUMBERS) + 2
    for label in labels:
        value, rest = printed[label].replace("°", " °").split(maxsplit=1)
        assert float(value) == pytest.approx(shown[label]["value"], rel=1e-2)
        assert shown[label]["unit"] in {"1", rest.split()[0]}
    assert shown["wall friction"]["high"] is None
    assert shown["wall friction"]["note"].startswith("90 %: 0.9 or more")
    rows = part_of(made, "laws")["rows"]
    assert rows == [["floating body", 0.0, 0.0, 0.0], ["paper", 1.0, 0.1, -10.0]]


def test_what_was_tested_is_a_table() -> None:
    part = part_of(fit_sections(fit_of()), "tested")
    assert [row[:2] for row in part["rows"]] == [
        ["orientation offset", 3.0],
        ["strength of the flow, cosine 1", -2.0],
    ]


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize(
    ("name", "sigmas", "reason"),
    [
        ("force_memory", 1.4, "as near as chance brings it"),
        ("force_memory", 3.2, "too weak: fitted from 4 on"),
        ("angle_offset", -3.2, "too weak: fitted from 6 on"),
        ("force_memory", 4.5, "too small to matter, of the wrong sign, or not found by the fit"),
        ("water_spin", 7.0, "the two force laws were compared as a whole"),
        ("strength_3", 4.0, "line and cosines are tested together"),
        ("marker_x", np.nan, "it has no estimate"),
    ],
)
def test_what_was_tested_says_why_it_is_not_in_the_fit(
    name: str, sigmas: float, reason: str
) -> None:
    fit = fit_of().isel(departure=[0]).assign_coords(departure=[name])
    fit["departure_estimate"].values[:] = sigmas * fit["departure_std"].values
    part = part_of(fit_sections(fit), "tested")
    assert part["rows"][0][2].startswith(reason)
    assert len(part["columns"]) == len(part["rows"][0])


def test_a_linear_law_has_no_drag_coefficient(capsys: pytest.CaptureFixture[str]) -> None:
    fit = fit_of(drag_law="linear", drag_law_stated="yes")
    printed, made = lines_of(fit, capsys), fit_sections(fit)
    assert printed["drag coefficient C_d"] == "none, as the drag is linear"
    assert printed["drag law"] == "linear, as stated; the fit tried no other"
    assert "drag coefficient" not in numbers_of(part_of(made, "summary"))
    assert (
        "The drag coefficient: none, as the drag is linear."
        in part_of(made, "summary")["paragraphs"][-1]
    )
    assert part_of(made, "law")["paragraphs"][1] == f"Drag law: {printed['drag law']}."


def test_an_old_fit_has_no_section_on_the_law() -> None:
    made = fit_sections(made_up_fit())
    assert not {"law", "laws", "tested", "wall"} & {part["id"] for part in made}
