"""The conda recipe asks for what ``pyproject.toml`` asks for."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any, Final

import yaml

# Names that conda-forge gives to packages. Its matplotlib brings a toolkit for windows along.
CONDA_NAMES: Final = {"matplotlib": "matplotlib-base", "opencv-python-headless": "py-opencv"}

EXTRAS: Final = ("track", "cluster", "ros", "view")
"""What users choose from; the other extras are for those who work on driftwalk."""


def read_project(root: Path) -> dict[str, Any]:
    """Return ``pyproject.toml``."""
    with (root / "pyproject.toml").open("rb") as file:
        return tomllib.load(file)


def conda_form(requirement: str) -> str:
    """Return a requirement in the words of a recipe.

    Examples
    --------
    >>> conda_form("matplotlib>=3.9")
    'matplotlib-base >=3.9'
    """
    name, wanted = re.fullmatch(r"([A-Za-z0-9._-]+)(.*)", requirement).groups()  # type: ignore[union-attr]
    return f"{CONDA_NAMES.get(name, name)} {wanted}".strip()


def differing_recipe(root: Path) -> str:
    """Name the requirements that the recipe and ``pyproject.toml`` do not share; empty if none."""
    recipe = yaml.safe_load((root / "recipe" / "recipe.yaml").read_text(encoding="utf-8"))
    project = read_project(root)
    about, needs = project["project"], recipe["requirements"]
    extras = about["optional-dependencies"]
    python = f"python {about['requires-python']}"
    optional = [one for name in EXTRAS for one in extras[name]]
    pairs = {
        "run": ([python, *map(conda_form, about["dependencies"])], needs["run"]),
        "host": (
            [python, "pip", *map(conda_form, project["build-system"]["requires"])],
            needs["host"],
        ),
        "run_constraints": ([conda_form(one) for one in optional], needs["run_constraints"]),
    }
    wrong = []
    for name, (wanted, found) in pairs.items():
        wrong += [f"{name} lacks '{one}'" for one in wanted if one not in found]
        wrong += [f"{name} has '{one}'" for one in found if one not in wanted]
    if recipe["about"]["license"] != about["license"]:
        wrong.append(f"the licence is {recipe['about']['license']}")
    return f"recipe/recipe.yaml: {', '.join(wrong)}" if wrong else ""
