"""What the stages of a grid calibration say, with maps and a bootstrap that are made up."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from driftwalk.calibration.goodness_of_fit import GoodnessOfFit
from driftwalk.calibration.grid import stages
from driftwalk.calibration.grid.energy_score import Optimum
from driftwalk.calibration.grid.stages import GridCalibration
from driftwalk.schema import Parameter

PARAMETERS = (
    Parameter("drag", "1", 0.0, 2.0, step=0.5, label="C_d"),
    Parameter("force", "N", 0.0, 4.0, step=1.0, label="the force"),
)
AXES = (np.linspace(0.0, 2.0, 5), np.linspace(0.0, 4.0, 5))


def problem_of(**search: Any) -> Any:
    calibration = SimpleNamespace(
        replicates=2, refined_replicates=3, refine="none", bootstrap=0, **search
    )
    return SimpleNamespace(
        parameters=PARAMETERS, study=SimpleNamespace(calibration=calibration), steps=None
    )


def coarse_at(cell: tuple[int, int]) -> Any:
    mean = np.full((5, 5), 0.5)
    mean[cell] = 0.1
    return SimpleNamespace(
        axes=AXES,
        mean=mean,
        arrays={"status": np.zeros((5, 5, 1), dtype=np.uint32)},
        simulated=np.ones((5, 5), dtype=bool),
        cell_of_minimum=lambda: cell,
        point=lambda at: tuple(float(axis[k]) for axis, k in zip(AXES, at, strict=True)),
    )


@pytest.mark.parametrize(
    ("cell", "known", "unable"),
    [
        ((2, 2), [], []),
        ((0, 2), ["C_d = 0 "], []),  # there is nothing below 0
        ((4, 2), [], ["C_d = 2 "]),
        ((0, 4), ["C_d = 0 "], ["the force = 4 "]),
        ((4, 4), [], ["C_d = 2 ", "the force = 4 "]),
    ],
)
def test_an_optimum_at_the_end_of_a_map_leaves_the_answer_open(
    monkeypatch: pytest.MonkeyPatch, cell: tuple[int, int], known: list[str], unable: list[str]
) -> None:
    found = GridCalibration(problem_of(), None)  # type: ignore[arg-type]
    monkeypatch.setattr(found, "_coarse_map", lambda replicates: coarse_at(cell))
    assert found.run() is found
    assert found.optimum == Optimum((0.5 * cell[0], 1.0 * cell[1]), 0.1)
    for said, words in ((found.warnings, known), (found.unable, unable)):
        assert len(said) == len(words)
        for text, some in zip(said, words, strict=True):
            assert f"edge of the grid: {some}" in text
    assert found.refined is None
    assert found.verdict is None


@pytest.mark.parametrize(
    ("distance", "at_end", "drawn", "against", "unable"),
    [
        (0.019, False, 0.0, 0, 0),  # no farther than the floor
        (0.09, False, 0.05, 2, 0),
        (0.09, False, 0.10, 0, 1),
        (0.09, True, 0.05, 0, 1),
    ],
)
def test_a_distance_above_the_floor_is_against_the_model(
    monkeypatch: pytest.MonkeyPatch,
    distance: float,
    at_end: bool,
    drawn: float,
    against: int,
    unable: int,
) -> None:
    """Not where other values may be closer, or where chance allows values as far apart."""
    found = GridCalibration(problem_of(), None)  # type: ignore[arg-type]
    found.optimum = Optimum((1.0, 2.0), distance)
    found.quality = GoodnessOfFit(distance, 0.001, 0.03, 0.04)
    found.bootstrap = SimpleNamespace()  # type: ignore[assignment]
    monkeypatch.setattr(stages, "drawn_distance", lambda *_: drawn)
    monkeypatch.setattr(stages, "step_differences", lambda *_: ["the steps are longer"])
    found._say_how_far(at_end=at_end)
    assert (len(found.against), len(found.unable)) == (against, unable)
    for text in found.against[:1] + found.unable:
        assert text.startswith("D = 0.090 at the optimum is 3.0 times the noise floor 0.030")


def test_a_closer_setting_that_the_refined_grid_misses_is_named() -> None:
    found = GridCalibration(problem_of(), None)  # type: ignore[arg-type]
    said = found._unresolved((0.52345, 2.0))
    assert said.startswith("the setting C_d = 0.5234, the force = 2 is closer to the recording")
