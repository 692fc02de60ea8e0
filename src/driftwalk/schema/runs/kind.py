"""The declaration of a kind of run: its files, and what computes, draws and shows it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

Maker = str | Callable[..., Any]
"""A callable, or where it stands, "module:name": its module is imported when it is used."""


@dataclass(frozen=True)
class RunKind:
    """A kind of run, declared once for every command, page and file that deals with its runs.

    The makers of figures and sections name, as their parameters, the datasets of the run that they
    use: ``check`` for ``check.nc``, ``recordings`` for all recordings, ``body`` for the name of the
    body. A dataset that is not there is None.

    Attributes
    ----------
    name : str
        Attribute ``kind`` of its result, and the key ``kind`` of its specification.
    title : str
        Title of its page.
    under_way : str
        Title of its live page before the run has finished.
    words : str
        Name of its result in a sentence.
    command : str
        The command that makes such a run.
    file : str
        The file of its result; a finished run without a specification is known by it.
    datasets : tuple of str
        The other datasets that it may hold, without the ending of their files.
    page : callable or str
        Returns the sections of its page.
    figures : callable or str, optional
        Returns its figures, a table from their names to functions that draw them.
    live : callable or str, optional
        View of a run under way, see `driftwalk.viewer.watch.run_page.Running`; without one the
        page counts the finished work units.
    answer : callable or str, optional
        Returns the `driftwalk.schema.answers.parts.Answer` of its result.
    places : mapping
        Files and folders of a run that its command names, by their labels.
    flow : callable or str, optional
        Returns the flow field that its result holds.
    gives_model : bool
        Whether later commands take a motion model with its values from it.
    no_draws : str
        What is missing where no parameters can be drawn from its result.
    """

    name: str
    title: str
    under_way: str
    words: str
    command: str
    file: str
    page: Maker
    datasets: tuple[str, ...] = ()
    figures: Maker | None = None
    live: Maker | None = None
    answer: Maker | None = None
    places: Mapping[str, str] = field(default_factory=dict)
    flow: Maker | None = None
    gives_model: bool = False
    no_draws: str = "no uncertainty of its values, as a fit or a calibration has"


def load_maker(maker: Maker) -> Callable[..., Any]:
    """Return a maker; one that is given by name is imported.

    Parameters
    ----------
    maker : callable or str
        The callable, or "module:name".

    Examples
    --------
    >>> load_maker("math:floor")(1.5)
    1
    """
    if not isinstance(maker, str):
        return maker
    module, _, name = maker.partition(":")
    found: Callable[..., Any] = getattr(import_module(module), name)
    return found
