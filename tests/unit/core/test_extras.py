"""Dask is hidden from xarray, and comes back for those who need it."""

from __future__ import annotations

import importlib
import sys

import pytest

from driftwalk.core.extras import hide_dask, show_dask


def test_dask_is_hidden_and_shown_again(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("dask", reason="Dask is not installed")
    monkeypatch.delitem(sys.modules, "dask")
    hide_dask()
    with pytest.raises(ModuleNotFoundError):
        importlib.import_module("dask")
    show_dask()
    assert importlib.import_module("dask").__name__ == "dask"


def test_dask_that_is_loaded_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    loaded = type(sys)("dask")
    monkeypatch.setitem(sys.modules, "dask", loaded)
    hide_dask()
    show_dask()
    assert sys.modules["dask"] is loaded
