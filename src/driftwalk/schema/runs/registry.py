"""The registry of the kinds of runs, and which kind a dataset or a run directory is."""

from __future__ import annotations

from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

from driftwalk.core.errors import InputError
from driftwalk.schema.check import kind_name
from driftwalk.schema.runs.built_in import BUILT_IN
from driftwalk.schema.runs.kind import RunKind, load_maker

if TYPE_CHECKING:
    from collections.abc import Mapping

    import xarray as xr

    from driftwalk.schema.answers.parts import Answer

_KINDS: Final[dict[str, RunKind]] = {kind.name: kind for kind in BUILT_IN}
RUN_KINDS: Final[Mapping[str, RunKind]] = MappingProxyType(_KINDS)
"""Every kind of run by its name."""


def register(kind: RunKind) -> RunKind:
    """Add a kind of run; every command and page knows it from then on.

    Parameters
    ----------
    kind : RunKind
        The kind.

    Raises
    ------
    InputError
        When another kind has its name or its file.
    """
    for other in _KINDS.values():
        if other != kind and (other.name == kind.name or other.file == kind.file):
            raise InputError(
                f"the kind of run '{kind.name}' ({kind.file}) is declared already, as "
                f"'{other.name}' ({other.file})"
            )
    _KINDS[kind.name] = kind
    return kind


def unregister(name: str) -> None:
    """Take a kind of run away, as a test does with its own.

    Parameters
    ----------
    name : str
        The name; one that is not known changes nothing.
    """
    _KINDS.pop(name, None)


def run_kind(name: str) -> RunKind:
    """Return a kind of run by its name.

    Parameters
    ----------
    name : str
        The name.

    Raises
    ------
    InputError
        When there is none of this name.

    Examples
    --------
    >>> run_kind("fit").file
    'fit.nc'
    """
    if name not in _KINDS:
        raise InputError(f"there is no kind of run '{name}': there are {', '.join(_KINDS)}")
    return _KINDS[name]


def kind_of(dataset: xr.Dataset) -> RunKind | None:
    """Return the kind of run whose result a dataset is, None for any other dataset.

    Parameters
    ----------
    dataset : xarray.Dataset
        Any dataset.
    """
    return _KINDS.get(kind_name(dataset) or "")


def answer_of(found: xr.Dataset, **more: Any) -> Answer | None:
    """Return the answer of a result as its kind of run declares it; None of any other dataset.

    Parameters
    ----------
    found : xarray.Dataset
        The main dataset of a run.
    **more
        What else the run made: ``check`` of a fit; ``reference``, ``components``, ``sobol`` of a
        sensitivity study.

    Examples
    --------
    >>> import xarray as xr
    >>> from driftwalk.schema.answers.parts import lines_of
    >>> names = {"parameter": ["drag_coefficient"], "unit": ("parameter", ["1"])}
    >>> values = {"estimate": ("parameter", [0.4]), "confidence": 0.9}
    >>> values["interval"] = (("parameter", "bound"), [[0.38, 0.42]])
    >>> answer = answer_of(xr.Dataset(values, names, {"kind": "fit"}))
    >>> lines_of(answer.parts)
    ['drag coefficient C_d   0.4000   90% interval 0.3800 to 0.4200']
    """
    kind = kind_of(found)
    if kind is None or kind.answer is None:
        return None
    answer: Answer = load_maker(kind.answer)(found, **more)
    return answer


def kind_of_folder(folder: Path, specification: Mapping[str, Any]) -> RunKind | None:
    """Return the kind of a run by its specification, else by its result file; None if unknown.

    Parameters
    ----------
    folder : Path
        The run directory.
    specification : mapping
        Everything that determines its numbers; empty where nothing says it.
    """
    named = specification.get("kind")
    if isinstance(named, str) and named in _KINDS:
        return _KINDS[named]
    # Whatever has the name: its reader refuses a link that leads out.
    there = (
        kind
        for kind in _KINDS.values()
        if (folder / kind.file).is_symlink() or (folder / kind.file).exists()
    )
    return next(there, None)
