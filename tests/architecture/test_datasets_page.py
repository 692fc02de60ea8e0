"""The page on the datasets has every kind, and its tables are those of the schemas."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from datasets_tables import datasets_page, kinds_on

from driftwalk.schema.kinds import KINDS

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "reference" / "datasets.md"


def test_every_kind_is_on_the_page() -> None:
    assert sorted(kinds_on(PAGE.read_text(encoding="utf-8"))) == sorted(KINDS)


def test_tables_are_those_of_the_schemas() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert datasets_page(page) == page, (
        f"run: python tests/architecture/datasets_tables.py {PAGE.relative_to(ROOT)}"
    )


@pytest.mark.parametrize("name", KINDS)
def test_a_kind_has_a_heading_of_its_own(name: str) -> None:
    assert re.search(rf"^## {name}$", PAGE.read_text(encoding="utf-8"), flags=re.M)
