"""The part of a page on where it comes from: the manifest, the command, and how to cite."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePath
from typing import Any

from driftwalk.core.text.json_text import json_value
from driftwalk.page.parts import Section, section
from driftwalk.schema.answers.citation import bibtex, citation


def manifest_section(manifest: Mapping[str, Any]) -> Section:
    """Return the section on how results were made, and how to cite them.

    Parameters
    ----------
    manifest : mapping
        The manifest of a run, or as much of it as there is.

    Returns
    -------
    dict
        A section of kind "manifest". The study stands in it once.

    Examples
    --------
    >>> manifest_section({"command": "driftwalk demo"})["command"]
    'driftwalk demo'
    """
    specification = manifest.get("specification")
    entries = {key: value for key, value in manifest.items() if key != "command"}
    if isinstance(specification, Mapping):
        same = specification.get("study") == manifest.get("study")
        entries["specification"] = {
            key: value for key, value in specification.items() if not (key == "study" and same)
        }
    version = _version(manifest)
    return section(
        "manifest", "manifest", "How to reproduce this",
        "The command reproduces the same numbers from the same inputs.",
        command=str(manifest.get("command", "")),
        entries=json_value(entries),
        inputs=_inputs(manifest),
        cite=citation(version),
        bibtex=bibtex(version),
    )  # fmt: skip


def _version(manifest: Mapping[str, Any]) -> str:
    """Return the version that made the results, that of this program when it is not said."""
    from driftwalk import __version__

    software = manifest.get("software")
    found = software.get("driftwalk") if isinstance(software, Mapping) else None
    return str(found or __version__)


def _inputs(manifest: Mapping[str, Any]) -> list[dict[str, str]]:
    inputs = manifest.get("inputs")
    if not isinstance(inputs, Mapping):
        return []
    return [
        {
            "role": str(role),
            "name": PurePath(str(facts.get("path", ""))).name,
            "sha256": str(facts.get("sha256", "")),
        }
        for role, facts in inputs.items()
        if isinstance(facts, Mapping)
    ]
