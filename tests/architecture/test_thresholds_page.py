"""Every tuned threshold of a policy says how it was chosen, and is on the page."""

from __future__ import annotations

import pytest
from thresholds_page import PAGE, Policy, policies, thresholds_page


def test_the_page_is_made_from_the_policies() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert thresholds_page(page) == page, "run: python tests/architecture/thresholds_page.py"


@pytest.mark.parametrize("policy", list(policies()), ids=lambda policy: policy.name)
def test_every_threshold_has_a_reason(policy: Policy) -> None:
    assert policy.thresholds
    assert not [one.name for one in policy.thresholds if not one.reason.endswith(".")]
