"""What a recovery study of a motion model prints: the counts of the dataset."""

from __future__ import annotations

from pathlib import Path

import pytest
from model_recovery_worlds import lost, made_up, made_up_recovery

from driftwalk.cli.terminal.output import print_result
from driftwalk.schema.answers.recovery import model_recovery_answer


def test_the_table_has_the_counts(capsys: pytest.CaptureFixture[str]) -> None:
    made = lost(made_up(), 3, 2, "it lost its numbers")
    found = made_up_recovery(made)
    print_result(found, Path("run"), json=False)
    captured = capsys.readouterr()
    head, _, *rows = captured.out.splitlines()
    assert head == "active: 12 recordings of 10 min at 10 Hz, tracking noise 0.3 mm"
    for index, (row, words, truth) in enumerate(
        zip(
            rows,
            ("speed", "rotational diffusion", "turn rate"),
            ("0.03 m/s", "0.5 rad2/s", "0.3 rad/s"),
            strict=False,
        )
    ):
        low, high = made["interval"][:, index].T
        value = float(found["truth"][index])
        held = sum(1 for a, b in zip(low, high, strict=True) if a <= value <= b)
        error = 100.0 * float(found["median_error"][index])
        cells = [cell.strip() for cell in row.split("  ") if cell.strip()]
        determined = f"{made['determined'][:, index].sum()} of 11"
        assert cells == [words, truth, f"{error:.1f} %", determined, f"{held} of 11"]
    assert "1 of 12 recordings could not be simulated: it lost its numbers" in captured.err
    assert captured.err.endswith("next: driftwalk report run -o report.html\n")


def test_json_has_no_number_where_there_is_none() -> None:
    found = made_up(2)
    for which in range(2):
        found = lost(found, which, 1, "too short")
    said = model_recovery_answer(made_up_recovery(found)).facts
    assert (said["recordings"], said["calibrated"]) == (2, 0)
    one = said["parameters"]["speed_m_s"]
    assert (one["truth"], one["median_error"], one["coverage"]) == (0.03, None, None)
    assert (one["calibrated"], one["determined"], one["intervals"]) == (0, 0, 0)
    assert said["warnings"] == ["2 of 2 recordings could not be calibrated: too short"]


def test_without_intervals_none_is_counted(capsys: pytest.CaptureFixture[str]) -> None:
    found = made_up()
    found["interval"][:] = float("nan")
    study = made_up_recovery(found)
    print_result(study, Path("run"), json=False)
    assert capsys.readouterr().out.count("no intervals") == 3
    assert model_recovery_answer(study).warnings == []
