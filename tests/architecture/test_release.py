"""What `make release-check` asks: the repository holds, and what would be wrong is found."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from email.message import Message
from pathlib import Path

import pytest
from licences import binding_licence, licence_of
from packages import missing_sources, needless_files, poor_metadata, without_address
from recipe import conda_form, differing_recipe, read_project
from versions import other_versions, unclean, undated, untagged

ROOT = Path(__file__).resolve().parents[2]
FILES = (
    "pyproject.toml",
    "CHANGELOG.md",
    "CITATION.cff",
    "recipe/recipe.yaml",
    "src/driftwalk/__init__.py",
)


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """Return a repository of its own, with the files that hold a version."""
    for name in FILES:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    commands = (
        ["init", "--quiet"],
        ["config", "user.name", "Somebody"],
        ["config", "user.email", "somebody@localhost"],
        ["add", "."],
        ["commit", "--quiet", "--message", "A release"],
    )
    for words in commands:
        subprocess.run(["git", *words], cwd=tmp_path, check=True)
    return tmp_path


def change(path: Path, pattern: str, text: str) -> None:
    old = path.read_text(encoding="utf-8")
    new = re.sub(pattern, text, old, count=1, flags=re.M)
    assert new != old
    path.write_text(new, encoding="utf-8")


def test_the_version_is_the_same_everywhere() -> None:
    assert other_versions(ROOT) == ""


@pytest.mark.parametrize(
    ("name", "pattern"),
    [
        ("CITATION.cff", r"^version: .*"),
        ("recipe/recipe.yaml", r"^  version: .*"),
        ("src/driftwalk/__init__.py", r"^__version__ = .*"),
    ],
)
def test_another_version_is_found(copy: Path, name: str, pattern: str) -> None:
    change(copy / name, pattern, pattern[1:-2].replace("= ", '= "') + "9.9.9")
    assert name in other_versions(copy)


def test_a_changelog_of_another_version_is_found(copy: Path) -> None:
    change(copy / "CHANGELOG.md", "^## .*", "## 9.9.9 (2026-01-31)")
    assert "CHANGELOG.md begins with '9.9.9 (2026-01-31)'" in other_versions(copy)


def test_a_release_is_dated_and_tagged_and_as_committed(copy: Path) -> None:
    version = read_project(copy)["project"]["version"]
    (copy / "CHANGELOG.md").write_text(f"# Changelog\n\n## Unreleased ({version})\n")
    assert undated(copy).startswith(f"CHANGELOG.md begins with 'Unreleased ({version})'")
    change(copy / "CHANGELOG.md", "^## .*", f"## {version} (2026-01-31)")
    assert undated(copy) == other_versions(copy) == ""
    assert unclean(copy) == "not as committed: CHANGELOG.md"
    subprocess.run(["git", "commit", "--quiet", "-am", "Date"], cwd=copy, check=True)
    assert unclean(copy) == ""
    assert untagged(copy) == f"this commit has no tag: git tag v{version}"
    subprocess.run(["git", "tag", "v9.9.9"], cwd=copy, check=True)
    assert untagged(copy).startswith("this commit has the tag v9.9.9")
    subprocess.run(["git", "tag", f"v{version}"], cwd=copy, check=True)
    assert untagged(copy) == ""


def test_the_recipe_asks_for_what_the_project_asks_for() -> None:
    assert differing_recipe(ROOT) == ""
    assert conda_form("opencv-python-headless>=4.10") == "py-opencv >=4.10"


def test_a_recipe_that_differs_is_found(copy: Path) -> None:
    change(copy / "recipe/recipe.yaml", "numpy >=2.0", "numpy >=1.0")
    assert differing_recipe(copy) == (
        "recipe/recipe.yaml: run lacks 'numpy >=2.0', run has 'numpy >=1.0'"
    )


def test_the_readme_of_a_package_index_has_no_link_that_leads_nowhere() -> None:
    rules = read_project(ROOT)["tool"]["hatch"]["metadata"]["hooks"]["fancy-pypi-readme"]
    readme = shown = (ROOT / "README.md").read_text(encoding="utf-8")
    for rule in rules["substitutions"]:
        shown = re.sub(rule["pattern"], rule["replacement"], shown)
    assert "](docs/" in readme
    assert "](" not in re.sub(r"\]\(\w+://", "", shown)
    # Nothing but links and the picture is left out: the words are the same.
    words = re.sub(r"!\[[^\]]*\]\([^)]*\)", "", readme)
    words = re.sub(r"\]\((?!\w+:)[^)]*\)", "", words).replace("[", "")
    assert words.split() == shown.replace("[", "").split()


def a_wheel(path: Path, *names: str) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        for name in names:
            archive.writestr(name, "")
    return path


def test_needless_files_of_a_wheel_are_found(tmp_path: Path) -> None:
    kept = ("driftwalk/core/units.py", "driftwalk-1.dist-info/RECORD")
    sound = a_wheel(tmp_path / "a.whl", "driftwalk/", "driftwalk/_core.abi3.so", *kept)
    assert needless_files(sound) == ""
    folder = "driftwalk/export/simulators/files/webots"
    exported = a_wheel(tmp_path / "e.whl", "driftwalk/_core.abi3.so", f"{folder}/Makefile", *kept)
    assert needless_files(exported) == ""
    bare = a_wheel(tmp_path / "b.whl", *kept)
    assert needless_files(bare) == "b.whl has no native core"
    left = a_wheel(tmp_path / "d.whl", "driftwalk/_core.abi3.so", f"{folder}/wall.o", *kept)
    assert needless_files(left) == f"d.whl holds {folder}/wall.o"
    full = a_wheel(tmp_path / "c.whl", "driftwalk/_core.abi3.so", "cpp/src/infer.cpp", *kept)
    assert needless_files(full) == "c.whl holds cpp/src/infer.cpp"


def test_missing_sources_are_found(tmp_path: Path) -> None:
    with tarfile.open(tmp_path / "driftwalk-1.tar.gz", "w:gz") as archive:
        archive.add(ROOT / "LICENSE", "driftwalk-1/LICENSE")
    found = missing_sources(tmp_path / "driftwalk-1.tar.gz")
    assert found.startswith("driftwalk-1.tar.gz lacks PKG-INFO, README.md, CHANGELOG.md")


def test_poor_metadata_are_found() -> None:
    message = Message()
    message["License-Expression"] = "BSD-3-Clause"
    message["License-File"] = "LICENSE"
    message["Description-Content-Type"] = "text/markdown"
    message["Classifier"] = "Topic :: Scientific/Engineering"
    message["Provides-Extra"] = "track"
    message.set_payload("[a page](docs/index.md)")
    found = poor_metadata(message)
    assert "no licence" not in found
    assert "no classifier of 'Operating System'" in found
    assert "no extra 'ros'" in found
    assert "no extra 'track'" not in found
    assert found.endswith("links that lead nowhere on a package index: 1")
    assert "Repository" in without_address(message)
    message["Project-URL"] = "Repository, https://x/y"
    assert without_address(message) == ""


@pytest.mark.parametrize(
    ("fields", "licence", "fault"),
    [
        ({"License-Expression": "MIT"}, "MIT", ""),
        ({"Classifier": "License :: OSI Approved :: BSD License"}, "BSD License", ""),
        ({"License": "Apache-2.0"}, "Apache-2.0", ""),
        (
            {"License-Expression": "BSD-3-Clause AND GPL-3.0-or-later WITH GCC-exception-3.1"},
            "BSD-3-Clause AND GPL-3.0-or-later WITH GCC-exception-3.1",
            "",
        ),
        ({"License": "AGPL-3.0"}, "AGPL-3.0", "'AGPL-3.0' binds whoever passes it on"),
        ({"License": "GPLv3"}, "GPLv3", "'GPLv3' binds whoever passes it on"),
        ({"License-Expression": "MIT AND GPL-2.0-only"}, "MIT AND GPL-2.0-only", "binds"),
        ({}, "", "'' is not known here"),
    ],
)
def test_licences(fields: dict[str, str], licence: str, fault: str) -> None:
    message = Message()
    for name, value in fields.items():
        message[name] = value
    assert licence_of(message) == licence
    assert fault in binding_licence(licence)
    assert bool(fault) == bool(binding_licence(licence))


def test_a_line_for_each_check() -> None:
    done = subprocess.run(
        [sys.executable, ROOT / ".ci/release/check.py", "versions", "recipe"],
        capture_output=True,
        text=True,
        cwd=ROOT,
    )
    lines = done.stdout.splitlines()
    assert lines[:2] == ["versions   ok", "recipe     ok"]
    assert lines[2].startswith("release-check: 2 of 2 hold; left out: clean, changelog, tag")
    assert done.returncode == 0
