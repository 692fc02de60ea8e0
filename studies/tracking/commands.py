"""Running driftwalk as a user does, and which version of its tracking that was."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Final

ROOT: Final = Path(__file__).resolve().parents[2]
ASIDE: Final = (
    "__init__", "boards", "explain", "live", "live_camera", "observer", "overlay", "pair_state",
    "possible", "tags",
)  # fmt: skip
"""Modules of the tracking that make no difference to these recordings."""


class CommandFailed(Exception):
    """A command ended with an error."""


def driftwalk(*words: object) -> tuple[str, float]:
    """Run a command, and return what it printed on stdout and the seconds it took."""
    program = Path(sys.executable).with_name("driftwalk")
    begin = time.perf_counter()
    done = subprocess.run(
        [str(program), *map(str, words)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
    )
    if done.returncode != 0:
        raise CommandFailed(f"driftwalk {words[0]}: {done.stderr.strip()}")
    return done.stdout, time.perf_counter() - begin


def driftwalk_json(*words: object) -> tuple[dict[str, Any], float]:
    """Run a command with --json, and return what it found and the seconds it took."""
    text, seconds = driftwalk(*words, "--json")
    return json.loads(text), seconds


def tracker_version() -> str:
    """Return a number that is another one for another version of what measures."""
    files = [file for file in ROOT.glob("src/driftwalk/track/**/*.py") if file.stem not in ASIDE]
    content = b"".join(file.read_bytes() for file in sorted(files))
    return hashlib.sha256(content).hexdigest()[:12]
