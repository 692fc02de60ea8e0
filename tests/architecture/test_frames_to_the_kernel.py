"""How many frames of Python lie between `dw.fit` and a call of the kernel."""

from __future__ import annotations

import sys
from types import SimpleNamespace
from typing import Any

import pytest
from fit_worlds import coarse_study, recording

import driftwalk as dw
from driftwalk import _core
from driftwalk.likelihood.filter import filter_pass

# As docs/explanation/from-call-to-kernel.md names them.
FRAMES = ("fit", "fit_motion", "find", "_base", "find_from_afar", "find", "sums", "_pairs")


@pytest.mark.slow
def test_a_fit_calls_the_kernel_from_its_eighth_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    stacks: list[tuple[str, ...]] = []

    class Watched:
        def __init__(self, *arguments: Any, **named: Any) -> None:
            self.kernel = _core.InnovationsFilter(*arguments, **named)

        def __getattr__(self, name: str) -> Any:
            frame, names = sys._getframe(1), []
            while frame.f_code is not dw.fit.__code__ and frame.f_back is not None:
                # Wrappers of the standard library and of a decorator count as well.
                names.append(frame.f_code.co_name)
                frame = frame.f_back
            stacks.append(("fit", *reversed(names)))
            return getattr(self.kernel, name)

    monkeypatch.setattr(filter_pass, "_core", SimpleNamespace(InnovationsFilter=Watched))
    dw.fit(recording(60.0), coarse_study("auto"), check=False)
    assert FRAMES in stacks
