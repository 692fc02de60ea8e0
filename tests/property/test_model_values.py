"""Values of a motion model as they are typed: every number arrives, everything else is refused."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, strategies as st

from driftwalk.cli.options.model import known_model
from driftwalk.core.errors import ConfigurationError
from driftwalk.motion import known_values

USUAL = {"speed": 0.1, "rotational_diffusion": 0.5, "turn_rate": 0.0}


def typed(values: dict[str, str]) -> dict[str, float]:
    """Return the values that a simulation of the model active would have."""
    words = [f"{name}={text}" for name, text in values.items()]
    return known_values(*known_model("active", words, None)[:2])


@given(st.floats(min_value=0.0, allow_infinity=False, allow_nan=False))
def test_every_number_arrives_as_it_is(value: float) -> None:
    values = {**USUAL, "speed": value}
    assert typed({name: repr(one) for name, one in values.items()}) == values


@given(st.permutations(list(USUAL)), st.sampled_from(["", " "]))
def test_neither_order_nor_spaces_count(names: list[str], space: str) -> None:
    words = [f"{space}{name}{space}={space}{USUAL[name]!r}{space}" for name in names]
    assert known_model("active", words, None).values == USUAL


@given(st.text(max_size=30))
def test_a_text_is_a_number_or_refused(text: str) -> None:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if math.isfinite(value) and value >= 0.0:
        assert typed({**dict.fromkeys(USUAL, "1"), "speed": text})["speed"] == value
        return
    with pytest.raises(ConfigurationError):
        typed({**dict.fromkeys(USUAL, "1"), "speed": text})


@given(st.text(max_size=30).filter(lambda text: "=" not in text))
def test_a_word_without_an_equals_sign_is_refused(text: str) -> None:
    with pytest.raises(ConfigurationError, match="expected NAME=VALUE"):
        known_model("active", [text], None)
