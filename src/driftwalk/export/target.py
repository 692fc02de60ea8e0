"""A target of an export: its name, a line about it, a function that writes it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from driftwalk.core.progress import ignore_progress


@dataclass(frozen=True)
class Source:
    """A run to be exported.

    Attributes
    ----------
    path : Path
        A run directory or a file, as the user named it. The target reads what it needs of it.
    flow : Path or None
        The flow field, where `path` has none: that of a study file.
    seed : int or None
        Seed of the stochastic force over the run's own.
    replicate : int or None
        The one simulated replicate to take, or run of blocks, where there are several.
    speed : float or None
        How much faster than real time a film is.
    tell : callable
        Called with each sentence that the user should read: above all what a format cannot hold.
    progress : callable
        Called with how much of a long export is done, and the whole.
    """

    path: Path
    flow: Path | None = None
    seed: int | None = None
    replicate: int | None = None
    speed: float | None = None
    tell: Callable[[str], None] = ignore_progress
    progress: Callable[[int, int], None] = ignore_progress


@dataclass(frozen=True)
class Verification:
    """Outcome of a check of what was written.

    Attributes
    ----------
    passed : bool
        Whether what was written does the same as driftwalk.
    lines : tuple of str
        What was compared and how far apart it is, a sentence each.
    numbers : dict
        The same for programs, units in the keys.
    """

    passed: bool
    lines: tuple[str, ...]
    numbers: dict[str, float | int]


@dataclass(frozen=True)
class Target:
    """Something that a run can be exported to.

    Attributes
    ----------
    name : str
        As `driftwalk export --to` takes it.
    gives : str
        What is in the folder, in a few words.
    write : callable
        ``write(source, folder)`` puts its files into an empty folder that exists, and returns
        their paths. It raises `InputError` for a source that it cannot take.
    verify : callable or None
        ``verify(folder)`` repeats the proof of a folder that `write` has made; None where there is
        nothing to compare with.
    require : callable or None
        ``require()`` raises `InputError` where `verify` cannot run on this machine.
    options : tuple of str
        What it has a use for of a source's ``flow``, ``seed``, ``replicate`` and ``speed``.
    """

    name: str
    gives: str
    write: Callable[[Source, Path], list[Path]]
    verify: Callable[[Path], Verification] | None = None
    require: Callable[[], None] | None = None
    options: tuple[str, ...] = ("flow", "seed")
