"""The help of commands: the same text in every process."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest


@pytest.mark.slow
@pytest.mark.parametrize("words", [("fit", "--help"), ("fit", "--help-all"), ("study", "--help")])
def test_it_does_not_depend_on_the_order_of_a_set(words: tuple[str, ...]) -> None:
    command = [sys.executable, "-m", "driftwalk", *words]
    texts = {
        subprocess.run(
            command, env={**os.environ, "PYTHONHASHSEED": seed}, capture_output=True, check=True
        ).stdout
        for seed in ("1", "2", "3")
    }
    assert len(texts) == 1
    assert b"--help, -h" in texts.pop() or words[-1] == "--help"
