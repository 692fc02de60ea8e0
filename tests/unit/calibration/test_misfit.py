"""Sentences for the verdict of a calibration."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

from driftwalk.calibration import warnings
from driftwalk.calibration.grid.stages import GridCalibration
from driftwalk.calibration.warnings import fit_disagreements, step_differences, undetermined
from driftwalk.comparison import StepDistance, StepTable
from driftwalk.schema import Parameter

DRAG = Parameter("drag", "1", 0.0, 2.0, step=0.05)
RATE = Parameter("rate", "1/s", 0.0, 4.0, step=0.1)


@pytest.mark.parametrize(
    ("value", "ends", "known"),
    [
        (0.4, (0.31, 0.49), True),
        (0.4, (0.29, 0.51), False),
        (0.0, (0.0, 0.03), True),
        (0.0, (0.0, 0.05), False),
    ],
)
def test_an_interval_of_a_quarter_of_the_value_determines_it(
    value: float, ends: tuple[float, float], known: bool
) -> None:
    assert (undetermined([DRAG], [ends], [value]) == []) == known


def test_a_parameter_on_a_logarithmic_scale_is_judged_by_its_value() -> None:
    """A decade is too wide; a tenth of one is not: 10**0.05 is 1.12."""
    one = Parameter("diffusivity", "m2/s", 1e-6, 1e-4, step=0.1, scale="log")
    assert undetermined([one], [(-5.5, -4.5)], [-5.0]) == [
        "the diffusivity is not determined: its interval is 3.16e-06 to 3.16e-05 m2/s; record "
        "longer, or other motion"
    ]
    assert undetermined([one], [(-5.05, -4.95)], [-5.0]) == []


def steps_of(scale: float, turn: float, rows: int = 8) -> StepTable:
    generator = np.random.default_rng(3)
    shape = (rows, 2000)
    length = scale * generator.rayleigh(1e-3, shape)
    return StepTable(length, turn * generator.normal(size=shape), np.full(rows, 2000))


def problem_with(table: StepTable) -> Any:
    steps = np.column_stack([table.length[0], table.angle[0]])
    return SimpleNamespace(statistic=StepDistance(), steps=steps)


@pytest.mark.parametrize(
    ("scale", "turn", "names"),
    [(1.0, 1.0, []), (1.5, 1.0, ["step lengths"]), (1.0, 0.5, ["turning angles"])],
)
def test_what_differs_is_named_with_its_size(
    scale: float, turn: float, names: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    simulated = steps_of(1.0, 1.0)
    monkeypatch.setattr(warnings, "simulated_steps", lambda *_, **__: (simulated, np.zeros(8)))
    other = np.random.default_rng(4).permutation(steps_of(scale, turn).length[0])
    recorded = problem_with(steps_of(scale, turn)._replace(length=other[None]))
    said = step_differences(recorded, (0.0,))
    assert [text.split(" differ")[0].removeprefix("the ") for text in said] == names
    # The median of a Rayleigh distribution is 1.177 times its scale.
    if names == ["step lengths"]:
        assert "half of them are below 1.7" in said[0]
        assert "simulated ones below 1.1" in said[0]
    of_a_user = SimpleNamespace(statistic=object(), steps=recorded.steps)
    assert step_differences(of_a_user, (0.0,)) == []  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("drawn", "at_end", "word"),
    [(0.05, False, "does not explain"), (0.5, False, "cannot tell"), (0.05, True, "cannot tell")],
)
def test_a_large_distance_counts_unless_chance_in_the_values_is_as_large(
    drawn: float, at_end: bool, word: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    from driftwalk.calibration.goodness_of_fit import GoodnessOfFit
    from driftwalk.calibration.grid import stages

    monkeypatch.setattr(stages, "drawn_distance", lambda *_: drawn)
    monkeypatch.setattr(stages, "step_differences", lambda *_: [])
    made = GridCalibration(SimpleNamespace(), SimpleNamespace())  # type: ignore[arg-type]
    made.optimum = SimpleNamespace(point=(0.4,))  # type: ignore[assignment]
    made.quality = GoodnessOfFit(0.3, 0.01, 0.03, 0.04)
    made.bootstrap = SimpleNamespace()  # type: ignore[assignment]
    made._say_how_far(at_end=at_end)
    assert made.verdict is not None
    assert made.verdict.word == word
    assert made.verdict.reasons[0].startswith("D = 0.300 at the optimum is 10.0 times")


FIT = {
    "source": "first.csv, second.csv",
    "interval_of_drag_coefficient": [0.156, 0.231],
    "interval_of_force_noise_intensity": [2e-9, 4e-9],
}


@pytest.mark.parametrize(
    ("recording", "drag", "force", "named"),
    [
        ("second.csv", (0.0, 0.126), (3e-9, 5e-9), ["drag coefficient C_d is 0 to 0.126 here"]),
        ("second.csv", (0.23, 0.3), (5e-9, 6e-9), ["noise intensity σ_F²·τ is 5e-09 to 6e-09"]),
        ("second.csv", (0.1, 0.16), (1e-9, 2.1e-9), []),
        ("third.csv", (0.0, 0.126), (5e-9, 6e-9), []),
    ],
)
def test_a_calibration_that_excludes_the_fit_of_its_flow_is_told_so(
    recording: str, drag: tuple[float, float], force: tuple[float, float], named: list[str]
) -> None:
    flow = xr.Dataset(attrs=FIT)
    said = fit_disagreements(
        flow, recording, {"drag_coefficient": drag, "force_noise_intensity": force}
    )
    assert len(said) == len(named)
    for text, words in zip(said, named, strict=True):
        assert text.startswith(words)
    assert fit_disagreements(xr.Dataset(), recording, {"drag_coefficient": drag}) == []
