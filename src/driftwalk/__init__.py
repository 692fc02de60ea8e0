"""driftwalk: calibrated stochastic motion models of floating, drifting and stirred robots.

Every public name is resolved on first use, so `import driftwalk` loads nothing heavy.
"""

from __future__ import annotations

from typing import Any

__version__ = "0.1.0"

# The stages whose public names are also names of the package. A stage's `__all__` is the only list
# of its names. A name that is a stage is the stage: the function is `driftwalk.compare.compare`.
_STAGES = ("record", "flow", "model", "simulate", "compare", "calibrate", "datasets", "report")


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
