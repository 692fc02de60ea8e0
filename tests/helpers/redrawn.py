"""The figures of a finished run, drawn again from what it stores: the same, line by line."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from command_line import Done, here

from driftwalk.figures import write
from driftwalk.plot import film


def drawings(folder: Path) -> dict[str, str]:
    """Return the drawings of a folder, without the sentences that name the files beside them."""
    return {
        path.name: re.sub(r"<metadata>.*?</metadata>", "", path.read_text(), flags=re.DOTALL)
        for path in folder.glob("*.svg")
    }


def drawn(*words: object) -> Done:
    """Run a command in this process, with what draws its figures in its place again.

    A film has one frame a second, 20 in place of 250.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("driftwalk.figures.write_figures", write.write_figures)
        patch.setattr("driftwalk.plot.write_animation", film.write_animation)
        patch.setitem(film.FRAMES_PER_S, ".gif", 1.0)
        return here(*words)


def assert_drawn_alike(run: Path, out: Path) -> None:
    """Export the figures of a run and compare them."""
    done = drawn("export", run, "--to", "svg", "-o", out)
    assert done.code == 0, done.err
    own, again = drawings(run / "figures"), drawings(out)
    assert own
    assert sorted(again) == sorted(own)
    assert [name for name in own if own[name] != again[name]] == []
