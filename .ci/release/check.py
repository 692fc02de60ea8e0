"""Everything that has to hold before a release, one line each.

    make release-check                    # all of it
    python .ci/release/check.py versions recipe

A line says ok, or failed and why. The exit code is 1 where one failed.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Final

import environment
from environment import run
from licences import binding_licence, licence_of
from packages import (
    PLATFORM,
    missing_sources,
    needless_files,
    poor_metadata,
    wheel_metadata,
    without_address,
)
from recipe import differing_recipe
from versions import other_versions, unclean, undated, untagged

ROOT: Final = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Release:
    """What the checks look at: the repository, and the packages built from it in a folder."""

    root: Path
    folder: Path

    @cached_property
    def built(self) -> str:
        """Why the packages could not be built; empty if they were.

        The wheel is built from the source distribution, in an empty folder.
        """
        return run(sys.executable, "-m", "build", "--outdir", self.folder / "dist", self.root)

    @cached_property
    def audited(self) -> str:
        """Why the wheel cannot be used on other machines; empty if it can."""
        if sys.platform != "linux":
            return ""
        return run(
            sys.executable, "-m", "auditwheel", "repair", "--wheel-dir", self.folder / "audited",
            self._only("dist", "*.whl"),
        )  # fmt: skip

    @cached_property
    def installed(self) -> str:
        """Why the wheel could not be installed; empty if it was."""
        return environment.install(self.wheel, self.folder / "venv")

    @property
    def sdist(self) -> Path:
        """The source distribution."""
        return self._only("dist", "*.tar.gz")

    @property
    def wheel(self) -> Path:
        """The wheel that would be uploaded."""
        audited = sys.platform == "linux" and not self.audited
        return self._only("audited" if audited else "dist", "*.whl")

    def _only(self, folder: str, pattern: str) -> Path:
        (found,) = (self.folder / folder).glob(pattern)
        return found


def check_audit(release: Release) -> str:
    """Say why the wheel would not run on other machines."""
    if release.audited:
        return release.audited
    return "" if PLATFORM.search(release.wheel.name) else f"{release.wheel.name} is of this machine"


def check_index(release: Release) -> str:
    """Ask what a package index would refuse or could not show."""
    return run(sys.executable, "-m", "twine", "check", "--strict", release.sdist, release.wheel)


def check_licences(release: Release) -> str:
    """Name what an installation brings along under a licence that is not known to be free."""
    found = environment.installed(release.folder / "venv")
    wrong = {name: binding_licence(licence_of(one)) for name, one in found.items()}
    return "; ".join(f"{name}: {why}" for name, why in sorted(wrong.items()) if why)


def whole(script: str) -> Callable[[Release], str]:
    """Return the check that a script of this repository passes."""
    return lambda release: run(release.root / ".ci" / script)


Check = Callable[[Release], str]
CHECKS: Final[dict[str, Check]] = {
    "clean": lambda release: unclean(release.root),
    "versions": lambda release: other_versions(release.root),
    "changelog": lambda release: undated(release.root),
    "tag": lambda release: untagged(release.root),
    "recipe": lambda release: differing_recipe(release.root),
    "build": lambda release: release.built,
    "sources": lambda release: missing_sources(release.sdist),
    "contents": lambda release: needless_files(release.wheel),
    "metadata": lambda release: poor_metadata(wheel_metadata(release.wheel)),
    "address": lambda release: without_address(wheel_metadata(release.wheel)),
    "audit": check_audit,
    "index": check_index,
    "install": lambda release: release.installed,
    "demo": lambda release: environment.demo(release.folder / "venv"),
    "licences": check_licences,
    "cross": whole("cross"),
    "tests": whole("run"),
}
# What a check cannot do without.
OF_PACKAGES: Final = ("sources", "contents", "metadata", "address", "audit", "index", "install")
AFTER: Final = {
    **dict.fromkeys(OF_PACKAGES, "build"),
    **dict.fromkeys(("demo", "licences"), "install"),
}


def reason_of(release: Release, name: str) -> str:
    """Return why a check fails; empty if it holds."""
    needed = AFTER.get(name)
    if needed and reason_of(release, needed):
        return f"not tried, '{needed}' failed"
    return CHECKS[name](release)


def main(words: list[str] | None = None) -> int:
    """Print a line for each check, and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("check", nargs="*", choices=[*CHECKS, []], help="only these checks")
    names = parser.parse_args(words).check or list(CHECKS)
    bad = 0
    with tempfile.TemporaryDirectory() as folder:
        release = Release(ROOT, Path(folder))
        for name in names:
            reason = reason_of(release, name)
            bad += bool(reason)
            print(f"{name:<10} {'failed: ' + reason if reason else 'ok'}", flush=True)
    left_out = [name for name in CHECKS if name not in names]
    remark = f"; left out: {', '.join(left_out)}" if left_out else ""
    print(f"release-check: {len(names) - bad} of {len(names)} hold{remark}")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
