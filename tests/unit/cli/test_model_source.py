"""What a command on self-assembly takes from a study file and options, and what it says of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import driftwalk as dw
from driftwalk.cli.inputs.model_source import assembly_source
from driftwalk.cli.options.study import StudyOptions
from driftwalk.core.study_keys import SENSITIVITY_KEYS


@pytest.fixture(scope="module")
def flow(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("flow") / "flow.nc"
    dw.save_flow(dw.uniform_flow(0.0, 0.0, arena=dw.Study().tank.to_arena()), path)
    return path


@pytest.mark.parametrize(
    ("given", "words", "mended"),
    [
        (
            {"interaction.meniscus_height_m": 1e-3},
            "--meniscus-height has no effect without --capillary on",
            {"interaction.capillary": "on"},
        ),
        (
            {"interaction.magnet_inset_m": 1e-3, "interaction.poles": "fixed"},
            "--magnet-inset and --poles have no effect without --magnets",
            {"interaction.magnets": "3x3x1mm,1.2T"},
        ),
        (
            {"assembly.relatch_clearance": 1.5},
            "--relatch-clearance has no effect without --bond-rate",
            {"sensitivity.bond_rate_per_s": [0.0, 0.01]},
        ),
    ],
)
def test_an_option_without_effect_is_stated(
    given: dict[str, Any], words: str, mended: dict[str, Any], flow: Path
) -> None:
    for more, expected in (({}, True), (mended, False)):
        options = StudyOptions(None, {**given, **more}, SENSITIVITY_KEYS)
        warnings = assembly_source(None, flow, options).warnings
        assert any(words in one for one in warnings) == expected


def test_a_table_of_attraction_lies_next_to_its_study_file(flow: Path, tmp_path: Path) -> None:
    file = tmp_path / "study.toml"
    file.write_text('[interaction]\nattraction = "pull.csv"\n', encoding="utf-8")
    source = assembly_source(None, flow, StudyOptions(file, {}, SENSITIVITY_KEYS))
    assert source.study.interaction.attraction == str(tmp_path / "pull.csv")
    assert source.inputs["attraction"] == tmp_path / "pull.csv"


def test_a_study_file_over_a_run_says_what_acts_between_blocks(tmp_path: Path) -> None:
    from driftwalk.cli.inputs.model_source import _with_sections

    file = tmp_path / "study.toml"
    file.write_text('[interaction]\nmagnets = "3x3x1mm,1.2T"\n', encoding="utf-8")
    assert _with_sections(dw.Study(), file, tmp_path).interaction.magnets == "3x3x1mm,1.2T"
