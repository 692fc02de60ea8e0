"""The version of a release: one number wherever it stands."""

from __future__ import annotations

import re
import subprocess
import tomllib
from pathlib import Path
from typing import Final

RELEASED: Final = re.compile(r"(?P<version>\d+\.\d+\.\d+) \(\d{4}-\d{2}-\d{2}\)")
UNRELEASED: Final = re.compile(r"Unreleased \((?P<version>\d+\.\d+\.\d+)\)")

# Where the version stands, and how.
PLACES: Final = {
    "src/driftwalk/__init__.py": re.compile(r'^__version__ = "(.+)"$', re.M),
    "CITATION.cff": re.compile(r"^version: (.+)$", re.M),
    "recipe/recipe.yaml": re.compile(r"^  version: (\d.+)$", re.M),
}


def project_version(root: Path) -> str:
    """Return the version of ``pyproject.toml``, which the others follow."""
    with (root / "pyproject.toml").open("rb") as file:
        return str(tomllib.load(file)["project"]["version"])


def top_section(root: Path) -> str:
    """Return the title of the newest section of the changelog."""
    found = re.search(r"^## (.+)$", (root / "CHANGELOG.md").read_text(encoding="utf-8"), re.M)
    return found[1] if found else ""


def other_versions(root: Path) -> str:
    """Say which places have another version than ``pyproject.toml``; empty if none has."""
    wanted, wrong = project_version(root), []
    for name, pattern in PLACES.items():
        found = pattern.findall((root / name).read_text(encoding="utf-8"))
        if found != [wanted]:
            wrong.append(f"{name} has {' and '.join(found) or 'none'}")
    section = top_section(root)
    stated = RELEASED.fullmatch(section) or UNRELEASED.fullmatch(section)
    if stated is None or stated["version"] != wanted:
        wrong.append(f"CHANGELOG.md begins with '{section}'")
    return f"pyproject.toml has {wanted}, but {', '.join(wrong)}" if wrong else ""


def undated(root: Path) -> str:
    """Say so where the newest section of the changelog is not that of a release."""
    if RELEASED.fullmatch(top_section(root)):
        return ""
    return (
        f"CHANGELOG.md begins with '{top_section(root)}': "
        f"make it '{project_version(root)} (YEAR-MONTH-DAY)'"
    )


def git(root: Path, *words: str) -> str:
    """Return what git prints, without the last line break."""
    done = subprocess.run(["git", *words], cwd=root, capture_output=True, text=True, check=True)
    return done.stdout.rstrip("\n")


def untagged(root: Path) -> str:
    """Say so where the tag of this version is not on this commit."""
    wanted = f"v{project_version(root)}"
    tags = git(root, "tag", "--points-at", "HEAD").split()
    if wanted in tags:
        return ""
    return f"this commit has {'the tag ' + tags[0] if tags else 'no tag'}: git tag {wanted}"


def unclean(root: Path) -> str:
    """Name files that differ from the commit."""
    changed = git(root, "status", "--porcelain").splitlines()
    return f"not as committed: {', '.join(line[3:] for line in changed[:5])}" if changed else ""
