"""Run the driftwalk that is installed: version, command line, and the demo against its known truth.

    python .ci/wheel_run.py

For an environment that holds nothing but a wheel and what the wheel asks for.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path

# Of the fit on the bundled recording: the engine's steps make its drag act some 2 % stronger.
LARGEST_ERROR = 0.05
# Of the map of distances: two of its finest steps, and some of the noise between settings.
MAP_ERRORS = {"drag_coefficient": 0.04, "force_std_N": 0.1e-3}


def command(*words: str, folder: str) -> str:
    """Return what the command line prints; a message of it ends this program."""
    done = subprocess.run(
        [sys.executable, "-m", "driftwalk", *words],
        cwd=folder,
        capture_output=True,
        encoding="utf-8",
    )
    if done.returncode != 0:
        raise SystemExit(f"wheel: driftwalk {' '.join(words)} failed:\n{done.stderr}")
    return done.stdout


def require_installed(folder: str) -> None:
    """Refuse a driftwalk that is not of this environment: an editable one, or a source folder."""
    asked = "import driftwalk._core as core; print(core.__file__)"
    done = subprocess.run(
        [sys.executable, "-c", asked], cwd=folder, check=True, capture_output=True, text=True
    )
    module = Path(done.stdout.strip()).resolve()
    if not module.is_relative_to(Path(sys.prefix).resolve()):
        raise SystemExit(f"wheel: {module} was imported, which is not in {sys.prefix}")


def main() -> None:
    """Run it in an empty folder, and compare the fit of the demo with the truth."""
    with tempfile.TemporaryDirectory() as folder:
        require_installed(folder)
        if version("driftwalk") not in (printed := command("--version", folder=folder)):
            raise SystemExit(f"wheel: the version is {version('driftwalk')}, printed {printed!r}")
        found = json.loads(command("demo", "--quick", "--json", folder=folder))
        for name in ("drag_coefficient", "force_std_N"):
            truth, fitted = found["truth"][name], found["fit"][name]
            print(f"wheel: {name} {fitted:.6g}, truth {truth:.6g}")
            if not abs(fitted / truth - 1.0) < LARGEST_ERROR:
                raise SystemExit(f"wheel: {name} is off by more than {LARGEST_ERROR:.0%}")
        for name, error in MAP_ERRORS.items():
            truth, read = found["truth"][name], found["calibration"][name]
            print(f"wheel: {name} of the map {read:.6g}, truth {truth:.6g}")
            if not abs(read - truth) < error:
                raise SystemExit(f"wheel: {name} of the map is off by more than {error:g}")
        if found["fit"]["verdict"] != "explains":
            raise SystemExit(f"wheel: the verdict of the fit is {found['fit']['verdict']!r}")
        if not (Path(folder) / "demo" / "report.html").is_file():
            raise SystemExit("wheel: the demo left no page")
    print("wheel: passed")


if __name__ == "__main__":
    main()
