"""driftwalk: calibrated stochastic motion models of floating, drifting and stirred robots.

Every public name is resolved on first use, so `import driftwalk` loads nothing heavy. A stage that
is named like its main function is called as that function: `driftwalk.simulate(study, flow)`.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any

__version__ = "0.1.0"

# The stages whose public names are also names of the package; a stage's `__all__` is the only list
# of its names.
_STAGES = (
    "record",
    "flow",
    "model",
    "simulation",
    "comparison",
    "calibration",
    "likelihood",
    "assembly",
    "track",
    "datasets",
    "plot",
    "figures",
    "page",
    "viewer",
)


class _Stage(ModuleType):
    """A stage that holds a function of its own name, and is called as that function."""

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        """Call the function that the stage is named after."""
        return getattr(self, self.__name__.rpartition(".")[2])(*arguments, **options)


class _Package(ModuleType):
    """The package: makes a stage callable at the moment at which the import system adds it.

    Without this, `driftwalk.compare` would be the function or the stage, depending on what was
    imported before.
    """

    def __setattr__(self, name: str, value: Any) -> None:
        if isinstance(value, ModuleType) and name in getattr(value, "__all__", ()):
            value.__class__ = _Stage
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


def __getattr__(name: str) -> Any:
    """Resolve a public name of a stage, or a stage itself, on first use."""
    import importlib

    if name in _STAGES:
        return importlib.import_module(f"driftwalk.{name}")
    if not name.startswith("_"):
        for stage in _STAGES:
            module = importlib.import_module(f"driftwalk.{stage}")
            if name in module.__all__:
                globals()[name] = getattr(module, name)
                return globals()[name]
    raise AttributeError(f"module 'driftwalk' has no attribute '{name}'")


def __dir__() -> list[str]:
    """List the public names of every stage."""
    import importlib

    names = {"__version__", *_STAGES}
    for stage in _STAGES:
        names.update(importlib.import_module(f"driftwalk.{stage}").__all__)
    return sorted(names)
