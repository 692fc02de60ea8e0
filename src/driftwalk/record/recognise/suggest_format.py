"""Suggest formats for an unrecognised file: the nearest ones, and what it lacks of each."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from driftwalk.record.raw import Marks
from driftwalk.record.recognise.contents import Contents, contents_of

KNOWN: Final = (
    (
        "HDF5",
        {"frames", "instances", "points"},
        "it is a SLEAP project: export it as analysis HDF5 or CSV",
    ),
)
"""Files that are no recordings, and what to do: container, names in it, advice."""


def unknown_file(path: Path, head: bytes, loaders: Mapping[str, Any]) -> str:
    """Return what a file is that no loader recognises, and which formats it is nearest to.

    Parameters
    ----------
    path : Path
        The file.
    head : bytes
        Its start.
    loaders : mapping
        Loaders by their names; those with `marks` can be near.
    """
    contents = contents_of(path, head)
    for container, names, advice in KNOWN:
        if container == contents.container and names <= set(contents.names):
            return advice
    near = _near(contents, loaders)
    found = [f"{name} ({lacks or 'it is damaged'})" for _, name, lacks in near[:3]]
    if found:
        nearest = f"the nearest are {', '.join(found)}; if it is one of these, name it"
    else:
        nearest = f"if it is one that is read ({', '.join(loaders)}), name it"
    return f"it is {contents.described()}; {nearest} with `format`"


def nearest_table(path: Path, head: bytes, loaders: Mapping[str, Any]) -> str:
    """Return which format a table that was read as a plain one may be, ``""`` where none is near.

    Parameters
    ----------
    path, head, loaders
        As in `unknown_file`.
    """
    near = _near(contents_of(path, head), loaders)
    # With half the names of a format or fewer, a table is just a table.
    if not near or near[0][0] <= 0.5:
        return ""
    _, name, lacks = near[0]
    return f"; as {name} it {lacks}" if lacks else ""


def _near(contents: Contents, loaders: Mapping[str, Any]) -> list[tuple[float, str, str]]:
    """Return (share of the names that are there, format, what it lacks), the nearest first.

    Formats of the same container of which nothing is there come last, so that the user learns what
    is looked for.
    """
    near = []
    for name, loader in loaders.items():
        marks: tuple[Marks, ...] = getattr(loader, "marks", ())
        shares = [
            (len(set(one.names) & set(contents.names)) / len(one.names), one)
            for one in marks
            if one.container == contents.container
        ]
        if shares:
            share, one = max(shares, key=lambda entry: entry[0])
            missing = [f"'{mark}'" for mark in one.names if mark not in contents.names]
            near.append((share, name, f"lacks {', '.join(missing[:4])}" if missing else ""))
    near.sort(key=lambda entry: (-entry[0], entry[1]))
    anything = [entry for entry in near if entry[0] > 0.0]
    return anything or (near if contents.container != "table" else [])
