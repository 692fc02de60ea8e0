"""No change of the code moves a number of any kind of dataset unnoticed.

The stored sums are driftwalk's own (`pinned_numbers.py` writes them), so they say that numbers are
the same as before, not that they are right: that is what the other tests are for.
"""

from __future__ import annotations

import json

import pytest
from every_kind import FORMS, every_kind
from pinned_numbers import STORED, sums_of

# These take three seconds or more.
LONG = (
    *("model_calibration", "outcome_posterior", "yield", "calibration of two parameters"),
    *("fit of several flows",),
)
TOLERANCE = 1e-5


def sized(form: str) -> object:
    return pytest.param(form, marks=[pytest.mark.slow] if form in LONG else [])


@pytest.mark.parametrize("form", [sized(form) for form in FORMS])
def test_the_numbers_are_those_of_before(form: str) -> None:
    stored = json.loads(STORED.read_text(encoding="utf-8"))[form]
    found = sums_of(every_kind(form))
    assert found.keys() == stored.keys()
    for name, (count, size, signed) in found.items():
        wanted = stored[name]
        assert count == wanted[0], name
        assert size == pytest.approx(wanted[1], rel=TOLERANCE, abs=1e-12), name
        assert signed == pytest.approx(wanted[2], abs=TOLERANCE * wanted[1] + 1e-12), name
