"""Every path that the architecture page names exists."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "ARCHITECTURE.md"
# Folders in which a path of the page may start; "src/driftwalk" because stages are named alone.
BASES = (ROOT, ROOT / "src" / "driftwalk", ROOT / "cpp" / "include" / "driftwalk")


def paths_named(text: str) -> set[str]:
    """Return what stands in backquotes and looks like a path: it holds a slash or a file ending."""
    words = re.findall(r"`([^`\s]+)`", text)
    endings = (".md", ".py", ".toml", ".hpp", ".cpp", ".txt", ".json", ".cff")
    paths = {
        word for word in words if ("/" in word and "://" not in word) or word.endswith(endings)
    }
    return {path for path in paths if not set(path) & set("<>{}*=()[]^|")}


def exists(path: str) -> bool:
    return any((base / path).exists() for base in BASES)


def test_reading_of_paths() -> None:
    text = "`src/driftwalk` and `kg/m3`, `README.md`, `plan`, `https://x/y`, `tests/{a,b}`"
    assert paths_named(text) == {"src/driftwalk", "kg/m3", "README.md"}


def test_every_path_named_exists() -> None:
    named = paths_named(PAGE.read_text(encoding="utf-8"))
    assert named, "the page names no path"
    assert not sorted(path for path in named if not exists(path))


def test_every_stage_is_on_the_page() -> None:
    text = PAGE.read_text(encoding="utf-8")
    stages = {path.parent.name for path in (ROOT / "src" / "driftwalk").glob("*/__init__.py")}
    assert not sorted(stage for stage in stages if stage not in text)
