"""Names in a message, and not too many of them."""

from __future__ import annotations

from collections.abc import Sequence


def listed(names: Sequence[str]) -> str:
    """Return the first names, with commas between them.

    Examples
    --------
    >>> listed(["nose", "tail"])
    'nose, tail'
    """
    return ", ".join(names[:20]) + (", …" if len(names) > 20 else "")
