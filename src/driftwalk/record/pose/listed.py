"""Names in a message, and not too many of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

MOST: Final = 20


def listed(names: Sequence[str]) -> str:
    """Return the first names, with commas between them.

    Examples
    --------
    >>> listed(["nose", "tail"])
    'nose, tail'
    """
    return ", ".join(names[:MOST]) + (", …" if len(names) > MOST else "")
