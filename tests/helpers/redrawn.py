"""The figures of a finished run, drawn again from what it stores: the same, line by line."""

from __future__ import annotations

import re
from pathlib import Path

from command_line import apart


def drawings(folder: Path) -> dict[str, str]:
    """Return the drawings of a folder, without the sentences that name the files beside them."""
    return {
        path.name: re.sub(r"<metadata>.*?</metadata>", "", path.read_text(), flags=re.DOTALL)
        for path in folder.glob("*.svg")
    }


def assert_drawn_alike(run: Path, out: Path) -> None:
    """Export the figures of a run, in a process that leaves none out, and compare them."""
    done = apart("export", run, "--to", "svg", "-o", out)
    assert done.code == 0, done.err
    own, again = drawings(run / "figures"), drawings(out)
    assert own
    assert sorted(again) == sorted(own)
    assert [name for name in own if own[name] != again[name]] == []
