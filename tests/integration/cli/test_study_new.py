"""`driftwalk study new`: short, in full, and with the table of a page at its end."""

from __future__ import annotations

from pathlib import Path

from command_line import here, refusal

SNIPPET = '\n[tank]\nwall_friction = 1.0\n\n[forces]\nforce_interval_s = "16ms"\n'


def test_a_table_can_be_added_to_the_short_file(tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    assert here("study", "new", path).code == 0
    short = path.read_text(encoding="utf-8")
    assert len(short.splitlines()) < 25
    assert "study new --full" in short
    path.write_text(short + SNIPPET, encoding="utf-8")
    checked = here("study", "check", path)
    assert checked.code == 0
    assert "wall_friction = 1.0" in checked.out
    assert "force_interval_s = 0.016" in checked.out


def test_the_full_file_names_every_parameter_and_where_a_table_stands_twice(tmp_path: Path) -> None:
    full = here("study", "new", "--full").out
    assert len(full.splitlines()) > 300
    path = tmp_path / "study.toml"
    path.write_text(full + SNIPPET, encoding="utf-8")
    said = refusal(here("study", "check", path))
    lines = [full.splitlines().index("[tank]") + 1, len(full.splitlines()) + 2]
    assert f"the table [tank] stands twice, in line {lines[0]} and in line {lines[1]}" in said
