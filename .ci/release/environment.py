"""An empty environment, a wheel installed in it with all that it asks for, and the demo."""

from __future__ import annotations

import json
import subprocess
import sys
from email import message_from_string
from email.message import Message
from pathlib import Path
from typing import Final

RUN: Final = Path(__file__).parents[1] / "wheel_run.py"
ALL_METADATA: Final = (
    "import json; from importlib.metadata import distributions; "
    "print(json.dumps([one.read_text('METADATA') for one in distributions()]))"
)


def run(*words: str | Path) -> str:
    """Run a command, and return the last lines of what it said if it failed; empty if not."""
    done = subprocess.run(
        [str(word) for word in words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    return "" if done.returncode == 0 else " | ".join(done.stdout.strip().splitlines()[-3:])


def install(wheel: Path, folder: Path) -> str:
    """Make the environment and install the wheel; return why that failed."""
    made = run(sys.executable, "-m", "venv", "--without-pip", folder)
    pip = (sys.executable, "-m", "pip", "--python", python_of(folder))
    return made or run(*pip, "install", "--quiet", "--no-compile", wheel)


def python_of(folder: Path) -> Path:
    """Return the interpreter of an environment."""
    return folder / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")


def demo(folder: Path) -> str:
    """Run the demo in an environment; return why it failed."""
    return run(python_of(folder), RUN)


def installed(folder: Path) -> dict[str, Message]:
    """Return the metadata of all packages in an environment, by name."""
    done = subprocess.run(
        [python_of(folder), "-c", ALL_METADATA], capture_output=True, text=True, check=True
    )
    found = [message_from_string(text) for text in json.loads(done.stdout)]
    return {str(one["Name"]): one for one in found}
