"""The names of the package: resolved on first use, one list per stage."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import pytest

import driftwalk
from driftwalk.model import Study


def test_public_names_resolve_to_the_stages() -> None:
    listed: dict[str, Any] = {name: getattr(driftwalk, name) for name in dir(driftwalk)}
    assert listed["Study"] is Study
    assert listed["model"].__name__ == "driftwalk.model"
    stages = [value for value in listed.values() if isinstance(value, ModuleType)]
    assert stages
    for stage in stages:
        assert all(hasattr(stage, name) for name in stage.__all__), stage.__name__


def test_a_name_stands_in_one_stage_only() -> None:
    seen: dict[str, str] = {}
    for stage in (getattr(driftwalk, name) for name in driftwalk._STAGES):
        for name in stage.__all__:
            assert seen.setdefault(name, stage.__name__) == stage.__name__, name


def test_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'studdy'"):
        _ = driftwalk.studdy


def test_stage_named_like_its_function_is_called_as_it() -> None:
    stage = ModuleType("driftwalk.drift")
    stage.__dict__.update(__all__=["drift", "other"], drift=lambda speed, *, time: speed * time)
    plain = ModuleType("driftwalk.plain")
    plain.__dict__.update(__all__=["other"])
    # The import system adds a module to its package in this way.
    for name, module in (("drift", stage), ("plain", plain)):
        setattr(driftwalk, name, module)
    try:
        assert driftwalk.drift(2.0, time=3.0) == 6.0
        assert driftwalk.drift.__all__ == ["drift", "other"]
        assert not callable(driftwalk.plain)
    finally:
        del driftwalk.drift, driftwalk.plain
