"""Every tuned threshold of a policy says how it was chosen, and is on the page."""

from __future__ import annotations

import re

import pytest
from thresholds_page import (
    CHOSEN,
    PAGE,
    CoreThreshold,
    Policy,
    core_thresholds,
    policies,
    thresholds_page,
)

CORE = core_thresholds(PAGE.read_text(encoding="utf-8"))


def test_the_page_is_made_from_the_policies() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert thresholds_page(page) == page, "run: python tests/architecture/thresholds_page.py"


@pytest.mark.parametrize("policy", list(policies()), ids=lambda policy: policy.name)
def test_every_threshold_has_a_reason(policy: Policy) -> None:
    assert policy.thresholds
    assert not [one.name for one in policy.thresholds if not one.reason.endswith(".")]
    silent = [one.name for one in policy.thresholds if not CHOSEN.search(one.reason)]
    assert not silent, f"say how it was chosen, in words of {CHOSEN.pattern}"


def test_the_table_of_the_native_core_is_read() -> None:
    assert {"outlier_chi_squared", "unknown_speed", "contact_gap", "forgotten"} <= {
        one.name for one in CORE
    }


@pytest.mark.parametrize("one", CORE, ids=lambda one: one.name)
def test_a_threshold_of_the_native_core_has_the_value_of_its_header(one: CoreThreshold) -> None:
    text = one.path.read_text(encoding="utf-8")
    found = re.findall(rf"\b{one.name} = ([^,;]+)[,;]", text)
    assert ", ".join(dict.fromkeys(found)) == one.value
    assert CHOSEN.search(one.reason), "say how it was chosen"
