"""The sections [assembly] and [sensitivity]: defaults, lists, refusals."""

from __future__ import annotations

from typing import Any

import pytest

from driftwalk.core.errors import ConfigurationError
from driftwalk.model import Assembly, Sensitivity, Study, apply_overrides, parse_study


def test_defaults_are_the_papers_simulations() -> None:
    """Section V-B: 4 blocks, 1000 runs of 5 minutes, 31 x 31 settings, 10 realisations."""
    study = Study()
    assembly, sensitivity = study.assembly, study.sensitivity
    assert (assembly.blocks, assembly.runs, assembly.duration_s) == (4, 1000, 300.0)
    assert (assembly.latching, assembly.chirality) == ("collision", "merged")
    assert assembly.hidden_face_drag == "none"
    assert (sensitivity.runs, sensitivity.reference_realisations) == (1000, 10)
    drag, force = sensitivity.drag_coefficients, sensitivity.force_stds_N
    assert (drag[0], drag[9], drag[-1], len(drag)) == (0.0, 0.45, 1.5, 31)
    assert (force[0], force[11], force[-1], len(force)) == (0.0, 0.55e-3, 1.5e-3, 31)


def test_friction_between_blocks_is_that_of_a_wet_wall_by_default() -> None:
    assert Assembly().block_friction == Study().tank.wall_friction == 0.0


def test_lists_are_read_with_units_and_survive_the_file() -> None:
    study = parse_study(
        '[assembly]\nduration_s = "5min"\nconnector_distance_m = "8mm"\n'
        '[sensitivity]\ntank_diameter_m = ["25cm", 0.3]\nblocks = [3, 4]\n'
        'flow = ["a.nc"]\nlatching = ["none", "connector"]\nhidden_face_drag = ["full"]\n'
    )
    assert (study.assembly.duration_s, study.assembly.connector_distance_m) == (300.0, 0.008)
    assert study.sensitivity.tank_diameter_m == (0.25, 0.3)
    assert study.sensitivity.blocks == (3, 4)
    assert study.sensitivity.flow == ("a.nc",)
    assert parse_study(study.to_toml()) == study
    assert hash(study) == hash(parse_study(study.to_toml()))
    without = apply_overrides(study, {"sensitivity.blocks": None})
    assert without.sensitivity.blocks is None


@pytest.mark.parametrize(
    ("section", "values", "words"),
    [
        (Assembly, {"blocks": 0}, "[assembly] blocks: must be at least 1, got 0"),
        (Assembly, {"blocks": 2.5}, "[assembly] blocks: expected a whole number, got 2.5"),
        (Assembly, {"runs": 0}, "[assembly] runs: must be at least 1, got 0"),
        (Assembly, {"duration_s": 0}, "[assembly] duration_s: must be more than 0 s, got 0"),
        (Assembly, {"duration_s": "5mm"}, "[assembly] duration_s: expected a number in s"),
        (
            Assembly,
            {"latching": "colision"},
            '[assembly] latching must be "collision" or "connector" or "none", got '
            "'colision'; did you mean 'collision'?",
        ),
        (Assembly, {"chirality": "both"}, '[assembly] chirality must be "merged" or "distinct"'),
        (Assembly, {"hidden_face_drag": "half"}, 'expected a number or "none" or "full"'),
        (Assembly, {"block_restitution": 1.1}, "block_restitution: must be at most 1, got 1.1"),
        (Assembly, {"confidence": 1.0}, "confidence: must be less than 1, got 1.0"),
        (Sensitivity, {"runs": 0}, "[sensitivity] runs: must be at least 1, got 0"),
        (
            Sensitivity,
            {"reference_realisations": 1},
            "reference_realisations: must be at least 2, got 1",
        ),
        (
            Sensitivity,
            {"drag_coefficient_min": 2.0},
            "drag_coefficient_max = 1.5 is below drag_coefficient_min = 2",
        ),
        (Sensitivity, {"force_std_step_N": 1e-12}, "force_std: a step of 1e-12"),
        (
            Sensitivity,
            {"force_std_step_N": 1e-6, "drag_coefficient_step": 1e-3},
            "the map has 1501 x 1501 = 2253001 settings",
        ),
        (Sensitivity, {"blocks": []}, "[sensitivity] blocks: the list is empty"),
        (Sensitivity, {"blocks": [3, 0]}, "[sensitivity] blocks: must be at least 1, got 0"),
        (Sensitivity, {"blocks": 3}, "[sensitivity] blocks must be a list, got 3"),
        (Sensitivity, {"tank_diameter_m": [0.3, "30cm"]}, "names a value twice: [0.3, 0.3]"),
        (
            Sensitivity,
            {"latching": ["conector"]},
            "got 'conector'; did you mean 'connector'?",
        ),
    ],
)
def test_refusal_names_section_and_key(
    section: type[Assembly] | type[Sensitivity], values: dict[str, Any], words: str
) -> None:
    with pytest.raises(ConfigurationError) as caught:
        section(**values)
    assert words in str(caught.value)
