"""What is in the source distribution and in the wheel, and what they say of themselves."""

from __future__ import annotations

import re
import tarfile
import zipfile
from email import message_from_bytes
from email.message import Message
from pathlib import Path
from typing import Final

from recipe import EXTRAS

# What an installed driftwalk is made of: no sources of the core, no tests.
WHEEL_NAMES: Final = re.compile(
    r"driftwalk/(_core\S*\.(so|pyd)|py\.typed|[\w/]+\.(py|pyi)"
    r"|page/static/driftwalk\.(js|css)"
    r"|export/simulators/files/(force|gazebo|mujoco|webots)"
    r"/(Makefile|\w+\.(c|cc|h|md|proto|sdf|txt|wbt|xml))"
    r"|datasets/tank30_ode_a/(\w+\.csv|truth\.json|PROVENANCE\.md))"
    r"|driftwalk-[^/]+\.dist-info/(METADATA|WHEEL|RECORD|entry_points\.txt|licenses/LICENSE)"
)
# With these it is built and tested where no network is.
SDIST_NAMES: Final = (
    "PKG-INFO",
    "LICENSE",
    "README.md",
    "CHANGELOG.md",
    "CITATION.cff",
    "CMakeLists.txt",
    "Makefile",
    "pyproject.toml",
    "cpp/src/dispatch.cpp",
    "docs/index.md",
    "src/driftwalk/__init__.py",
    "tests/conftest.py",
)
LARGEST_WHEEL_MB: Final = 4.0
LINK: Final = re.compile(r"\]\((?!\w+:)[^)]*\)")
PLATFORM: Final = re.compile(r"manylinux|macosx|win_")


def wheel_metadata(wheel: Path) -> Message:
    """Return the metadata of a wheel."""
    with zipfile.ZipFile(wheel) as archive:
        name = next(one for one in archive.namelist() if one.endswith(".dist-info/METADATA"))
        return message_from_bytes(archive.read(name))


def needless_files(wheel: Path) -> str:
    """Name files of a wheel that no user needs, and one that is too large; empty if none."""
    with zipfile.ZipFile(wheel) as archive:
        # auditwheel lists the folders too.
        names = [one.filename for one in archive.infolist() if not one.is_dir()]
    needless = [name for name in names if WHEEL_NAMES.fullmatch(name) is None]
    if needless:
        return f"{wheel.name} holds {', '.join(needless[:5])}"
    if not any("/_core" in name and name.endswith((".so", ".pyd")) for name in names):
        return f"{wheel.name} has no native core"
    size = wheel.stat().st_size / 1e6
    if size > LARGEST_WHEEL_MB:
        return f"{wheel.name} has {size:.1f} MB, more than {LARGEST_WHEEL_MB:g}"
    return ""


def missing_sources(sdist: Path) -> str:
    """Name files that a source distribution lacks; empty if none."""
    with tarfile.open(sdist) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    missing = [name for name in SDIST_NAMES if name not in names]
    return f"{sdist.name} lacks {', '.join(missing)}" if missing else ""


def poor_metadata(metadata: Message) -> str:
    """Say what the metadata lack; empty if nothing."""
    wrong = []
    if metadata["License-Expression"] != "BSD-3-Clause" or metadata["License-File"] != "LICENSE":
        wrong.append("no licence, or not its file")
    if metadata["Description-Content-Type"] != "text/markdown":
        wrong.append("the README is not Markdown")
    for kind in ("Operating System", "Programming Language :: Python :: 3", "Topic", "Typing"):
        if not any(one.startswith(kind) for one in metadata.get_all("Classifier", [])):
            wrong.append(f"no classifier of '{kind}'")
    for extra in EXTRAS:
        if extra not in metadata.get_all("Provides-Extra", []):
            wrong.append(f"no extra '{extra}'")
    text = str(metadata.get_payload())
    links = LINK.findall(text)
    if len(text) < 2000 or links:
        wrong.append(f"links that lead nowhere on a package index: {len(links)}")
    return "; ".join(wrong)


def without_address(metadata: Message) -> str:
    """Say so where the metadata name no place of the sources."""
    names = [one.partition(",")[0] for one in metadata.get_all("Project-URL", [])]
    if any(name.lower() in {"repository", "source"} for name in names):
        return ""
    return "pyproject.toml: name the place of the sources, Repository, under [project.urls]"
