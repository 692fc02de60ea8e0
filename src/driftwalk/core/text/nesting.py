"""How deep values lie inside each other: whatever walks through them later recurses."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from driftwalk.core.errors import FormatError

MOST_LEVELS: Final = 64


def refuse_deep(values: Any, *, path: str | Path | None = None) -> None:
    """Refuse lists and mappings that lie more than 64 levels inside each other.

    Raises
    ------
    FormatError
        When they do.

    Examples
    --------
    >>> refuse_deep({"x": [[1, 2], [3, 4]]})
    """
    level = [values]
    for _ in range(MOST_LEVELS):
        level = [
            item
            for value in level
            if isinstance(value, (dict, list))
            for item in (value.values() if isinstance(value, dict) else value)
            if isinstance(item, (dict, list))
        ]
        if not level:
            return
    raise FormatError(f"holds values nested more than {MOST_LEVELS} levels deep", path=path)
