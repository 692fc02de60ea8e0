"""The verdict on a model: it explains the recording, it does not, or the recording cannot tell."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

EXPLAINS: Final = "explains"
DOES_NOT_EXPLAIN: Final = "does not explain"
CANNOT_TELL: Final = "cannot tell"
VERDICTS: Final = (EXPLAINS, DOES_NOT_EXPLAIN, CANNOT_TELL)


class Verdict(NamedTuple):
    """Whether a model explains a recording."""

    word: str
    """Of `VERDICTS`."""
    reasons: tuple[str, ...]
    """Sentences: where it does not explain the recording, or what would be needed to tell."""


def verdict_of(against: Sequence[str], unable: Sequence[str]) -> Verdict:
    """Return the verdict that follows from findings.

    Parameters
    ----------
    against : sequence of str
        Sentences on what the model does not reproduce, the worst first.
    unable : sequence of str
        Sentences on tests without power and numbers without a meaning, with what would be needed.

    Returns
    -------
    Verdict
        "does not explain" where anything is against the model, with all sentences; else "cannot
        tell" where a test could not have failed; else "explains", without a reason.

    Examples
    --------
    >>> verdict_of([], ["the block has been over 4 % of the tank: record more of it"]).word
    'cannot tell'
    """
    reasons = (*against, *unable)
    if against:
        return Verdict(DOES_NOT_EXPLAIN, reasons)
    return Verdict(CANNOT_TELL if unable else EXPLAINS, reasons)
