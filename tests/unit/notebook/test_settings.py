"""The keyword arguments that a type checker knows are those of the tables and declarations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, get_type_hints

import pytest

from driftwalk.core.study_keys import (
    ASSEMBLY_KEYS,
    CALIBRATION_KEYS,
    FIT_KEYS,
    STUDY_KEYS,
    AssemblySettings,
    CalibrationSettings,
    FitSettings,
    Number,
    StudySettings,
)
from driftwalk.model import Study, declared


@pytest.mark.parametrize(
    ("settings", "keys"),
    [
        (StudySettings, STUDY_KEYS),
        (CalibrationSettings, CALIBRATION_KEYS),
        (FitSettings, FIT_KEYS),
        (AssemblySettings, ASSEMBLY_KEYS),
    ],
)
def test_names_and_types_are_those_that_the_study_declares(
    settings: type, keys: Mapping[str, str]
) -> None:
    assert get_type_hints(settings) == {name: type_of(key) for name, key in keys.items()}
    assert not getattr(settings, "__required_keys__", frozenset())


def type_of(key: str) -> Any:
    """Return the type of the argument for a key of a study."""
    of_key = declared(key)
    section, _, name = key.partition(".")
    if Study.model_fields[section].annotation.model_fields[name].annotation is bool:
        return bool
    item: Any = str
    if of_key.quantity is not None:
        item = int if of_key.quantity.whole else Number
    return list[item] if of_key.is_list else item
