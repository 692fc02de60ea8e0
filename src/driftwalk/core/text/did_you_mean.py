"""Known names in a message: the one that a mistyped one is close to, or a list of them."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return "; did you mean '…'?" for the closest known word, or nothing.

    A name that lacks only its unit ("diameter" for "diameter_m") counts as close.
    """
    names = list(known)
    found = difflib.get_close_matches(word, names, n=1, cutoff=0.6)
    found = found or [name for name in names if name.startswith(f"{word}_")]
    return f"; did you mean '{found[0]}'?" if found else ""


def listed(names: Sequence[str]) -> str:
    """Return the first names, with commas between them.

    Examples
    --------
    >>> listed(["nose", "tail"])
    'nose, tail'
    """
    return ", ".join(names[:20]) + (", …" if len(names) > 20 else "")
