"""The verdict on a model: it explains the recording, it does not, or the recording cannot tell."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.schema.answers.facts import sentences, texts
from driftwalk.schema.answers.parts import Part, Row

if TYPE_CHECKING:
    import xarray as xr

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

    @property
    def explains(self) -> bool:
        """Whether nothing is against the model, and a fault would have shown."""
        return self.word == EXPLAINS


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


def verdict_variables(verdict: Verdict) -> dict[str, Any]:
    """Return the variables of a dataset that hold a verdict."""
    return {
        "verdict": ((), np.array(verdict.word)),
        "verdict_reason": ("verdict_reason", texts(verdict.reasons)),
    }


def stored_verdict(dataset: xr.Dataset) -> Verdict | None:
    """Return the verdict that a dataset holds; None where the model was not checked."""
    if "verdict" not in dataset.variables:
        return None
    return Verdict(str(dataset["verdict"].values), tuple(sentences(dataset, "verdict_reason")))


def verdict_parts(verdict: Verdict | None, unchecked: str = "") -> list[Part]:
    """Return the row of a verdict and its reasons; why there is none where it was not checked.

    Examples
    --------
    >>> verdict_parts(verdict_of(["the flow changes"], []))
    [Row(label='verdict', text='does not explain:'), '  the flow changes']
    >>> verdict_parts(None, "too few samples")
    [Row(label='verdict', text='not checked: too few samples')]
    """
    if verdict is None:
        return [Row("verdict", f"not checked{': ' if unchecked else ''}{unchecked}")]
    reasons = [f"  {text}" for text in verdict.reasons]
    return [Row("verdict", f"{verdict.word}{':' if reasons else ''}"), *reasons]


def verdict_facts(verdict: Verdict | None) -> dict[str, Any]:
    """Return the verdict for programs; None where the model was not checked."""
    if verdict is None:
        return {"verdict": None, "verdict_reasons": []}
    return {"verdict": verdict.word, "verdict_reasons": list(verdict.reasons)}
