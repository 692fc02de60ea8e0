"""The names of the package: resolved on first use, and the same for type checkers."""

from __future__ import annotations

import ast
import importlib
import pickle
from pathlib import Path
from types import ModuleType

import pytest

import driftwalk

STUB = Path(driftwalk.__file__).with_name("__init__.pyi")


def names_of_stub() -> dict[str, str]:
    """Return every name that the stub declares, with the module that it is from."""
    found = {}
    for node in ast.parse(STUB.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ImportFrom):
            for alias in node.names:
                # Without `as` a stub does not pass a name on.
                assert alias.asname == alias.name
                found[alias.name] = str(node.module)
    return found


def test_stub_declares_what_the_package_has() -> None:
    rooms = dict.fromkeys(driftwalk._ROOMS, "driftwalk")
    assert names_of_stub() == {**rooms, **driftwalk._MODULE_OF}


def test_every_name_is_that_of_its_room() -> None:
    for name, module in names_of_stub().items():
        found = getattr(driftwalk, name)
        if module == "driftwalk":
            assert isinstance(found, ModuleType)
        else:
            assert found is getattr(importlib.import_module(module), name)
        assert name in dir(driftwalk)


def test_a_room_that_is_imported_hides_no_name() -> None:
    for room in driftwalk._ROOMS:
        importlib.import_module(f"driftwalk.{room}")
    assert not [
        name for name in driftwalk._MODULE_OF if isinstance(getattr(driftwalk, name), ModuleType)
    ]


def test_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'studdy'"):
        _ = driftwalk.studdy


def test_functions_pickle_and_show_their_signature() -> None:
    assert pickle.loads(pickle.dumps(driftwalk.simulate)) is driftwalk.simulate
    assert "Simulate one block" in str(driftwalk.simulate.__doc__)


def test_errors_are_exported() -> None:
    with pytest.raises(driftwalk.InputError) as caught:
        driftwalk.simulate(driftwalk.Study(), driftwalk.uniform_flow(0.0, 0.0), replicates=0)
    assert isinstance(caught.value, driftwalk.DriftwalkError)
    assert isinstance(caught.value, ValueError)
