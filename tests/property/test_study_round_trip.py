"""A study survives its TOML file, whatever it holds."""

from __future__ import annotations

import math
import tomllib
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st

from driftwalk.core.errors import ConfigurationError
from driftwalk.model import Study, apply_overrides, parse_study, study_template


def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False, allow_infinity=False)


def polygon(corners: int, radius: float, turn: float) -> list[list[float]]:
    angles = [turn + 2 * math.pi * k / corners for k in range(corners)]
    return [[radius * math.cos(angle), radius * math.sin(angle)] for angle in angles]


TANKS = st.one_of(
    st.fixed_dictionaries({"shape": st.just("circle"), "diameter_m": numbers(0.2, 100.0)}),
    st.fixed_dictionaries(
        {"shape": st.just("rectangle"), "width_m": numbers(0.2, 10), "height_m": numbers(0.2, 10)}
    ),
    st.builds(polygon, st.integers(3, 12), numbers(0.2, 5.0), numbers(0.0, 6.0)).map(
        lambda corners: {"shape": "polygon", "vertices_m": corners}
    ),
)
STUDIES: st.SearchStrategy[dict[str, Any]] = st.fixed_dictionaries(
    {},
    optional={
        "block": st.fixed_dictionaries(
            {"side_m": numbers(1e-4, 0.1), "mass_kg": numbers(1e-6, 10.0)},
            optional={"depth_m": numbers(1e-4, 1.0), "strips_per_face": st.integers(1, 64)},
        ),
        "tank": TANKS,
        "forces": st.fixed_dictionaries(
            {"drag_coefficient": numbers(0, 4), "force_std_N": numbers(0, 4e-3)},
            optional={"force_interval_s": numbers(1e-4, 10.0)},
        ),
        "simulation": st.fixed_dictionaries(
            {"seed": st.integers(0, 2**63 - 1)},
            optional={"start": st.just({"x_m": 0.0, "y_m": 0.0, "theta_rad": 1.25})},
        ),
        "observation": st.fixed_dictionaries(
            {"position_noise_m": st.one_of(st.just("estimate"), numbers(0, 1))},
            optional={"field_of_view": TANKS, "gaps": st.sampled_from(["recording", "none"])},
        ),
        "recording": st.fixed_dictionaries(
            {"format": st.text(), "body": st.text()},
            optional={
                "columns": st.fixed_dictionaries({"x": st.text(), "y": st.integers(1, 99)}),
                "start_s": numbers(-1e6, 1e6),
            },
        ),
        "steps": st.fixed_dictionaries({"step_interval_s": numbers(1e-3, 100)}),
    },
)


@pytest.mark.slow
@settings(deadline=None, max_examples=60)
@given(values=STUDIES)
def test_study_survives_its_file(values: dict[str, Any]) -> None:
    study = Study(**values)
    assert parse_study(study.to_toml()) == study
    assert tomllib.loads(study.to_toml()).keys() == Study.model_fields.keys()
    assert parse_study(study_template(study)) == study
    assert apply_overrides(study, {}) == study


@settings(deadline=None, max_examples=100)
@given(interval=numbers(1e-5, 10.0))
def test_automatic_step_divides_the_interval(interval: float) -> None:
    step = Study(forces={"force_interval_s": interval}).time_step_s
    parts = interval / step
    assert abs(parts - round(parts)) < 1e-9 * parts
    assert step <= 0.010 * (1 + 1e-9)
    # The next coarser whole divisor would be above 10 ms.
    assert round(parts) == 1 or interval / (round(parts) - 1) > 0.010 * (1 - 1e-9)


VALUES = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=8)),
    lambda inner: st.one_of(
        st.lists(inner, max_size=3), st.dictionaries(st.text(max_size=8), inner, max_size=3)
    ),
    max_leaves=4,
)
KEYS = st.sampled_from(
    [
        f"{section}.{key}"
        for section in Study.model_fields
        for key in type(getattr(Study(), section)).model_fields
    ]
)


@pytest.mark.slow
@settings(deadline=None, max_examples=300)
@given(key=KEYS, value=VALUES)
def test_any_value_is_taken_or_refused_in_one_sentence(key: str, value: Any) -> None:
    try:
        message, study = "", apply_overrides(Study(), {key: value})
    except ConfigurationError as error:
        message, study = str(error), Study()
    assert parse_study(study.to_toml()) == study
    assert not message or key.split(".")[0] in message
