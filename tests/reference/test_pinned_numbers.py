"""No change of the code moves a number of any kind of dataset unnoticed.

The stored sums are driftwalk's own (`pinned_numbers.py` writes them), so they say that numbers are
the same as before, not that they are right: that is what the other tests are for.
"""

from __future__ import annotations

import json

import pytest
from every_kind import FORMS, every_kind
from pinned_numbers import STORED, sums_of

# These take three seconds or more, and their rooms have other fast tests.
LONG = ("model_calibration", "outcome_posterior", "yield", "calibration of two parameters")
# Between linear algebra with and without AVX2 and FMA, and kernels with AVX2 and with baseline
# instructions, the largest difference of another form was 2e-7, and of these 6e-6, 1e-4, 1e-3 and
# 4e-6.
TOLERANCE = 1e-5
WIDER = {
    "fit of a flawed recording": 1e-4,
    "model_check of a flawed recording": 2e-3,
    "fit that estimates the wall": 1e-2,
    "outcome_posterior": 1e-4,
}


def sized(form: str) -> object:
    return pytest.param(form, marks=[pytest.mark.slow] if form in LONG else [])


@pytest.mark.parametrize("form", [sized(form) for form in FORMS])
def test_the_numbers_are_those_of_before(form: str) -> None:
    stored = json.loads(STORED.read_text(encoding="utf-8"))[form]
    found = sums_of(every_kind(form))
    tolerance = WIDER.get(form, TOLERANCE)
    assert found.keys() == stored.keys()
    for name, (count, size, signed) in found.items():
        wanted = stored[name]
        assert count == wanted[0], name
        assert size == pytest.approx(wanted[1], rel=tolerance, abs=1e-12), name
        assert signed == pytest.approx(wanted[2], abs=tolerance * wanted[1] + 1e-12), name
