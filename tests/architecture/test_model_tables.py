"""The page of every motion model on every recording is what the study's lines give."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
STUDY = ROOT / "studies" / "motion_models"


def test_the_page_is_made_of_the_stored_lines(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    made = [STUDY / "all_models.py", STUDY / "results" / "compare.jsonl", page]
    subprocess.run([sys.executable, *map(str, made)], check=True)
    stored = ROOT / "docs" / "reference" / "models-on-recordings.md"
    assert page.read_text(encoding="utf-8") == stored.read_text(encoding="utf-8")
